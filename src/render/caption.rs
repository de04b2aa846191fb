//! Captions above the panels of a picture.

use font8x8::{BASIC_FONTS, LATIN_FONTS, UnicodeFonts};

use super::Display;

const PAPER: [u8; 4] = [255, 255, 255, 255];
const INK: [u8; 4] = [31, 41, 55, 255];
/// Dots of a letter, and of what is left free around a line.
const LETTER: usize = 8;
const MARGIN: usize = 4;
/// Dots of a bar of colours.
const BAR: usize = 64;
/// From this width on a dot is two pixels wide.
const LARGE: usize = 420;

impl Display {
    /// Below a line of text, and of colours that stand for 0 to 1 if there are any. What finds no room is left out.
    pub fn captioned(&self, text: &str, colours: &[[u8; 4]]) -> Self {
        let dot = if self.width >= LARGE { 2 } else { 1 };
        let rows = dot * (LETTER + 2 * MARGIN);
        let mut line = Line {
            pixels: vec![PAPER; self.width * rows],
            width: self.width,
            dot,
            at: MARGIN,
        };
        line.write(text);
        if !colours.is_empty() {
            line.write("  0 ");
            line.draw(colours);
            line.write(" 1");
        }
        Self {
            height: self.height + rows,
            pixels: [&line.pixels[..], &self.pixels].concat(),
            ..*self
        }
    }
}

struct Line {
    pixels: Vec<[u8; 4]>,
    width: usize,
    dot: usize,
    /// Dots that are taken.
    at: usize,
}

impl Line {
    fn write(&mut self, text: &str) {
        for letter in text.chars() {
            let glyph = BASIC_FONTS.get(letter).or_else(|| LATIN_FONTS.get(letter));
            let glyph = glyph.or_else(|| BASIC_FONTS.get('?')).unwrap_or_default();
            for (y, row) in glyph.into_iter().enumerate() {
                for x in (0..LETTER).filter(|x| row >> x & 1 == 1) {
                    self.set(self.at + x, y, INK);
                }
            }
            self.at += LETTER;
        }
    }

    fn draw(&mut self, colours: &[[u8; 4]]) {
        for x in 0..BAR {
            let colour = colours[x * (colours.len() - 1) / (BAR - 1)];
            for y in 0..LETTER {
                self.set(self.at + x, y, colour);
            }
        }
        self.at += BAR;
    }

    fn set(&mut self, x: usize, y: usize, colour: [u8; 4]) {
        for row in self.dot * (MARGIN + y)..self.dot * (MARGIN + y + 1) {
            for column in (self.dot * x..self.dot * (x + 1)).take_while(|x| *x < self.width) {
                self.pixels[row * self.width + column] = colour;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pattern::Transfer;

    #[test]
    fn a_caption_is_above_its_panel_and_as_wide() {
        let panel = Display {
            width: 150,
            height: 3,
            pixels: vec![[7; 4]; 450],
            transfer: Transfer::Srgb,
            clipped: 0,
        };
        let bar = [[0, 0, 0, 255], [255, 0, 0, 255]];
        let shown = panel.captioned("|A × B", &bar);
        assert_eq!((shown.width, shown.height), (150, 3 + 16));
        assert_eq!(shown.pixels[150 * 16..], panel.pixels);
        let strip = &shown.pixels[..150 * 16];
        let has = |colour: [u8; 4]| strip.contains(&colour);
        assert!(has(INK) && has(bar[0]) && has(bar[1]));
        // Too long a text is cut.
        let long = panel.captioned(&"W".repeat(99), &bar);
        assert_eq!(long.pixels.len(), 150 * 19);
    }
}

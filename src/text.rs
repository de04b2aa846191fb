//! Files that people write: read no further than a limit, and as TOML text of whose mistakes file, line and key are told.

use std::borrow::Cow;
use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{self, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::Spanned;

use crate::brdf::limits;

/// What is wrong with the text of a fabric, pattern or scene, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}: {message}")]
pub struct TextError {
    /// The file, or the name it was given.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// The key whose value is out of range, where there is one.
    pub key: Option<String>,
    /// What is wrong and what would be right.
    pub message: String,
}

/// An array of as many values; of what has more, too, serde would take the first.
#[derive(Clone, Copy)]
pub(crate) struct Exactly<T, const N: usize>(pub(crate) [T; N]);

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Exactly<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let values = Vec::deserialize(deserializer)?;
        let values: Result<[T; N], Vec<T>> = values.try_into();
        values.map(Self).map_err(|values| {
            de::Error::custom(format!("expected {N} values, there are {}", values.len()))
        })
    }
}

/// An albedo: `{ color = [r, g, b], scale = s }`, `[r, g, b]`, or one number for a grey.
pub(crate) struct AlbedoToml {
    color: [f64; 3],
    scale: f64,
}

impl<'de> Deserialize<'de> for AlbedoToml {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AlbedoForms)
    }
}

/// By hand, since what serde says of an untagged choice names no mistake.
struct AlbedoForms;

impl<'de> Visitor<'de> for AlbedoForms {
    type Value = AlbedoToml;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("{ color = [r, g, b], scale = s }, [r, g, b] or one number")
    }

    fn visit_f64<E: de::Error>(self, grey: f64) -> Result<AlbedoToml, E> {
        Ok(AlbedoToml {
            color: [grey; 3],
            scale: 1.0,
        })
    }

    fn visit_i64<E: de::Error>(self, grey: i64) -> Result<AlbedoToml, E> {
        self.visit_f64(grey as f64)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<AlbedoToml, A::Error> {
        let Exactly(color) = Deserialize::deserialize(SeqAccessDeserializer::new(list))?;
        Ok(AlbedoToml { color, scale: 1.0 })
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<AlbedoToml, A::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Scaled {
            color: Exactly<f64, 3>,
            #[serde(default = "one")]
            scale: f64,
        }
        let Scaled { color, scale } = Deserialize::deserialize(MapAccessDeserializer::new(map))?;
        let Exactly(color) = color;
        Ok(AlbedoToml { color, scale })
    }
}

fn one() -> f64 {
    1.0
}

/// What a text describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// It has threads; or it is none of the others, nor TOML.
    Fabric,
    /// It has materials.
    Pattern,
    /// It has cameras, lights or objects.
    Scene,
}

impl Kind {
    /// By its keys.
    pub fn of(text: &[u8]) -> Self {
        let text = text.get(..MAX_TOML_BYTES).unwrap_or(text);
        let table = std::str::from_utf8(text).ok();
        let table: Option<toml::Table> = table.and_then(|text| toml::from_str(text).ok());
        let has = |key| table.as_ref().is_some_and(|table| table.contains_key(key));
        if ["camera", "light", "object"].into_iter().any(has) {
            Self::Scene
        } else if has("material") {
            Self::Pattern
        } else {
            Self::Fabric
        }
    }
}

/// The most bytes of a fabric's, pattern's or scene's text.
pub const MAX_TOML_BYTES: usize = 1 << 20;
const MAX_NAME_BYTES: usize = 64;

/// All bytes of a file.
///
/// # Errors
/// When it cannot be read, or has more than `most` bytes, of which no more is read.
pub fn read_capped(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let message = format!("it has more than {most} bytes");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// All bytes of a file that another file names: not of a pipe or device, which may never end.
///
/// # Errors
/// As [`read_capped`]; and when it is no ordinary file.
pub fn read_ordinary(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    if !path.metadata()?.is_file() {
        return Err(io::Error::other("it is no ordinary file"));
    }
    read_capped(path, most)
}

/// What a file says, for a message: its beginning, if it is long.
pub fn cut(text: &str) -> Cow<'_, str> {
    const LETTERS: usize = 60;
    match text.char_indices().nth(LETTERS) {
        None => text.into(),
        Some((end, _)) => format!("{}…", &text[..end]).into(),
    }
}

/// A list of names, for a message: the first of them, if there are many.
#[cfg(feature = "scene")]
pub(crate) fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    const NAMES: usize = 12;
    let names: Vec<String> = names
        .into_iter()
        .map(|name| format!("\"{}\"", cut(name)))
        .collect();
    let more = match names.len() {
        ..=NAMES => String::new(),
        count => format!(" and {} more", count - NAMES),
    };
    names[..names.len().min(NAMES)].join(", ") + &more
}

/// A text that is read.
pub(crate) struct Source<'a> {
    pub(crate) file: &'a str,
    pub(crate) text: &'a str,
}

impl Source<'_> {
    pub(crate) fn error(&self, offset: usize, key: Option<&str>, message: String) -> TextError {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
        TextError {
            file: self.file.to_owned(),
            line,
            key: key.map(str::to_owned),
            message,
        }
    }

    /// The value under `key` if `valid`, or an error saying that it `must`.
    pub(crate) fn number(
        &self,
        key: &str,
        value: &Spanned<f64>,
        valid: impl Fn(f64) -> bool,
        must: &str,
    ) -> Result<f64, TextError> {
        let x = *value.get_ref();
        if x.is_finite() && valid(x) {
            Ok(x)
        } else {
            let message = format!("{key} = {x:?} must {must}");
            Err(self.error(value.span().start, Some(key), message))
        }
    }

    /// What the TOML parser says, with the key of the line that it says it of.
    pub(crate) fn syntax_error(&self, error: &toml::de::Error) -> TextError {
        let offset = error
            .span()
            .map_or(0, |span| span.start)
            .min(self.text.len());
        let before = self.text.get(..offset).unwrap_or_default();
        let line = before.rsplit('\n').next().unwrap_or_default();
        let key = line
            .split_once('=')
            .map(|(key, _)| key.trim())
            .filter(|key| !key.is_empty());
        let message = match key {
            Some(key) => format!("{}: {}", cut(key), error.message()),
            None => error.message().to_owned(),
        };
        self.error(offset, key, message)
    }

    pub(crate) fn name(&self, key: &str, name: &str, at: usize) -> Result<String, TextError> {
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
        if !name.is_empty() && name.len() <= MAX_NAME_BYTES && name.chars().all(plain) {
            Ok(name.to_owned())
        } else {
            let message = format!(
                "{key}: \"{}\" must be 1 to {MAX_NAME_BYTES} of the characters a-z 0-9 - _",
                cut(name)
            );
            Err(self.error(at, Some(key), message))
        }
    }

    pub(crate) fn albedo(
        &self,
        key: &str,
        value: &Spanned<AlbedoToml>,
    ) -> Result<[f64; 3], TextError> {
        let AlbedoToml { color, scale } = value.get_ref();
        let albedo = color.map(|channel| channel * scale);
        if albedo
            .iter()
            .all(|channel| limits::ALBEDO.contains(channel))
        {
            Ok(albedo)
        } else {
            let message = format!("{key}: color × scale = {albedo:?} must lie between 0 and 1000");
            Err(self.error(value.span().start, Some(key), message))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Kind;

    #[test]
    fn a_text_is_told_by_its_keys() {
        for (text, kind) in [
            (include_str!("../tables/fabrics/denim.toml"), Kind::Fabric),
            (
                include_str!("../tables/patterns/polka-dot-lining.toml"),
                Kind::Pattern,
            ),
            (
                include_str!("../tables/scenes/product-shot.toml"),
                Kind::Scene,
            ),
            // A scene's objects may have materials.
            ("[[object]]\n[[material]]\n", Kind::Scene),
            ("[[material]]\nname = \"a\"\n", Kind::Pattern),
            ("camera = 1\n", Kind::Scene),
            ("material is what?", Kind::Fabric),
            ("", Kind::Fabric),
        ] {
            assert_eq!(Kind::of(text.as_bytes()), kind, "{text}");
        }
        assert_eq!(Kind::of(b"camera = \"\xff\""), Kind::Fabric);
    }
}

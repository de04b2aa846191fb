//! Tables as bytes: `FORMAT.md` says what is where; `read` and `write` do it, with the chunks of `coding`.

mod coding;
mod header;
mod read;
mod write;

use super::Grid;
use super::grid::PADDING;
use crate::chart::{Chart, Coordinates, Rim};

/// Major version of the format: readers refuse what they do not know.
pub const MAJOR: u16 = 2;
/// Minor version of the format.
pub const MINOR: u16 = 5;
/// The most memory that samples and metadata of one file may take, whatever its header says.
pub const MAX_DECODED_BYTES: u64 = 256 << 20;

const MAGIC: [u8; 8] = *b"\x89SATEEN\n";
/// Headers and chunks begin at multiples of this.
const ALIGNMENT: usize = 64;
/// Where the checksummed part of the header begins.
const CHECKED_FROM: usize = 20;
/// The minor version of files whose samples are looked up where they are: …
const MAPPED_MINOR: u16 = 5;
/// … so many zeros follow the last chunk, so that its last rows can be read whole, too.
const MARGIN: usize = 64;
const _: () = assert!(MARGIN >= PADDING * size_of::<f32>());

/// What grids may be functions of: the first four are those of a straight thread's segments, which always look the same from
/// both sides, the first nine those of any response, and all those of a projection.
const COORDINATES: [Coordinates; 11] = [
    thread(Chart::Thesis, false, true),
    thread(Chart::Thesis, true, true),
    thread(Chart::Highlight, false, true),
    thread(Chart::Highlight, true, true),
    thread(Chart::Thesis, false, false),
    thread(Chart::Thesis, true, false),
    thread(Chart::Highlight, false, false),
    thread(Chart::Highlight, true, false),
    Coordinates::Isotropic,
    Coordinates::View { isotropic: false },
    Coordinates::View { isotropic: true },
];

const fn thread(chart: Chart, ends_fold: bool, sides_fold: bool) -> Coordinates {
    Coordinates::Thread {
        chart,
        ends_fold,
        sides_fold,
        rim: Rim::NONE,
    }
}

/// The two bytes that stand for coordinates.
fn code_of(coordinates: Coordinates) -> [u8; 2] {
    match coordinates {
        Coordinates::Thread {
            chart,
            ends_fold,
            sides_fold,
            ..
        } => {
            let chart = match chart {
                Chart::Thesis => 0,
                Chart::Highlight => 1,
            };
            [chart, u8::from(ends_fold) + 2 * u8::from(!sides_fold)]
        }
        Coordinates::Isotropic => [2, 0],
        Coordinates::View { isotropic } => [3, u8::from(isotropic)],
    }
}

/// The axes that bend at the knot ½ in tables before minor version 3, which do not say so.
fn implied_kinks(coordinates: Coordinates) -> [bool; 4] {
    match coordinates {
        Coordinates::Thread { sides_fold, .. } => [true, false, true, !sides_fold],
        Coordinates::Isotropic => [true, false, false, false],
        Coordinates::View { .. } => [false; 4],
    }
}

impl Grid {
    /// Whether its axes bend where those of tables before minor version 3 do.
    pub(super) fn has_implied_kinks(&self) -> bool {
        let implied = implied_kinks(self.coordinates);
        self.axes
            .iter()
            .zip(implied)
            .all(|(axis, implied)| axis.has_kink() == (implied && axis.has_middle()))
    }
}

//! Tables as bytes: `FORMAT.md` says what is where; `read` and `write` do it, with the chunks of `coding`.

mod coding;
mod header;
mod read;
mod write;

use super::grid::PADDING;
use crate::chart::{Chart, Coordinates, Rim};

/// Version of the format: readers refuse others.
pub const VERSION: u32 = 3;
/// The most memory that samples and metadata of one file may take, whatever its header says.
pub const MAX_DECODED_BYTES: u64 = 256 << 20;

const MAGIC: [u8; 8] = *b"\x89SATEEN\n";
/// Headers and chunks begin at multiples of this.
const ALIGNMENT: usize = 64;
/// Where the checksummed part of the header begins.
const CHECKED_FROM: usize = 20;
/// So many zeros follow the last chunk: the last tiles can be read whole where they are, too.
const MARGIN: usize = 64;
const _: () = assert!(MARGIN >= PADDING * size_of::<i16>());

/// What a table has for sampling: albedos, histograms too, and whether ρ is divided by the albedo where that is above 1.
const HAS_ALBEDO: u8 = 1;
const HAS_HISTOGRAMS: u8 = 2;
const DIMS_VIEWS: u8 = 4;

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

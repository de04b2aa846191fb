//! The metadata of an export.

use serde::Serialize;

use super::{Export, Format};
use crate::metrics::{ErrorReport, PairErrors};

/// Of the metadata and of all layouts.
const VERSION: u32 = 1;

const VOLUME: &str = "sateen_volume(uvw) = texture(volume, uvw): linear filter, clamped to the edge, no smaller mips. Texel i of n has its \
    centre at (i + 0.5)/n. R and G are sqrt(S) and sqrt(V) at node k of u3, B and A at node k + 1; the grid's texels begin at its first slab: \
    x = t0, y = t1, z = first + n2 k + t2.";
const ATLAS: &str = "Slab z of the volume is in column z mod columns and row floor(z / columns) of the atlas; row 0 is the top of the picture \
    and y = 0 of a slab. z = uvw.z depth - 0.5, a = floor(z), slab(z) = texture(atlas, ((z mod columns, floor(z / columns)) + uvw.xy) / \
    (columns, rows)), sateen_volume(uvw) = mix(slab(max(a, 0)), slab(min(a + 1, depth - 1)), z - a): linear filter, no smaller mips. Texel i of n \
    has its centre at (i + 0.5)/n.";
const THREES: &str = "z = uvw.z depth - 0.5, k = floor((z + 0.5) / pitch), t = z - pitch k, first = pitch (k - k mod 2). s = texture(volume, \
    (uvw.xy, (first + t + 0.5) / depth)), v = texture(volume, (uvw.xy, (first + pitch + t + 0.5) / depth)). sateen_volume(uvw) = (s.r, v.r, \
    s.g, v.g) where k is even, (s.g, v.g, s.b, v.b) where it is odd: linear filter, clamped to the edge, no smaller mips. Texel i of n has its \
    centre at (i + 0.5)/n. A texel holds sqrt(S) or sqrt(V) at nodes 2 j, 2 j + 1 and 2 j + 2 of u3; slabs of S and V take turns.";
const REST: &str = " sateen_parameter(index) = parameters[index]. The functions above these two are sateen's lookup.wgsl, lookup.glsl and \
    lookup.hlsl.";

/// What is known of a table that is exported.
#[derive(Debug, Clone, Copy)]
pub struct About<'a> {
    /// The fabric's name.
    pub fabric: &'a str,
    /// The error that the table records.
    pub recorded: &'a ErrorReport,
    /// What [`Export::measure`] found.
    pub measured: &'a Cost,
}

/// The error against direct integration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Cost {
    /// The seed that drew the pairs.
    pub seed: u64,
    /// Of the table.
    pub table: PairErrors,
    /// Of what is exported.
    pub exported: PairErrors,
}

/// Where the slabs of a volume are in a picture.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Atlas {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Texels along x and y.
    pub(super) slab: [usize; 2],
    /// Slabs.
    pub(super) depth: usize,
    row_origin: &'static str,
}

impl Atlas {
    /// About as wide as high.
    pub(super) fn of([width, height, depth]: [usize; 3]) -> Self {
        let square = (depth as f64 * height as f64 / width as f64).sqrt();
        let columns = (square.round() as usize).clamp(1, depth);
        Self {
            columns,
            rows: depth.div_ceil(columns),
            slab: [width, height],
            depth,
            row_origin: "top",
        }
    }

    pub(super) fn in_words(&self) -> String {
        let Self {
            columns,
            rows,
            slab: [width, height],
            depth,
            row_origin,
        } = self;
        format!(
            "columns: {columns}\nrows: {rows}\nslab width: {width}\nslab height: {height}\nslabs: {depth}\nrow 0: {row_origin}\n"
        )
    }
}

#[derive(Serialize)]
struct Thread<'a> {
    name: &'a str,
    albedo: [f32; 3],
}

/// What a shader needs, and what it may want to know.
#[derive(Serialize)]
pub(super) struct Note<'a> {
    version: u32,
    tool: &'static str,
    fabric: &'a str,
    table_format: u32,
    layout: &'static str,
    pixels: &'static str,
    size: [usize; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    pitch: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) atlas: Option<Atlas>,
    threads: Vec<Thread<'a>>,
    recorded: &'a ErrorReport,
    measured: &'a Cost,
    recipe: String,
    parameters: &'a [[f32; 4]],
}

impl<'a> Note<'a> {
    pub(super) fn new(export: &'a Export<'a>, about: &About<'a>) -> Self {
        let (layout, recipe) = match export.format {
            Format::Ktx2 | Format::Dds | Format::Raw => ("volume", VOLUME),
            Format::Exr => ("atlas", ATLAS),
            Format::Rgb9e5 | Format::Bc6h => ("threes", THREES),
        };
        let threads = export.table.threads().iter();
        Self {
            version: VERSION,
            tool: crate::TOOL,
            fabric: about.fabric,
            table_format: crate::table::VERSION,
            layout,
            pixels: export.format.pixels().name(),
            size: export.size,
            pitch: export.pitch,
            atlas: None,
            threads: threads
                .map(|thread| Thread {
                    name: thread.name(),
                    albedo: thread.albedo(),
                })
                .collect(),
            recorded: about.recorded,
            measured: about.measured,
            recipe: recipe.to_owned() + REST,
            parameters: &export.parameters,
        }
    }

    /// In ASCII, which all of the files have: other letters are escaped.
    pub(super) fn to_json(&self) -> String {
        let json = serde_json::to_string(self).expect("numbers, strings and arrays are JSON");
        let mut ascii = String::with_capacity(json.len());
        for letter in json.chars() {
            if letter.is_ascii() {
                ascii.push(letter);
            } else {
                for unit in letter.encode_utf16(&mut [0; 2]) {
                    ascii += &format!("\\u{unit:04x}");
                }
            }
        }
        ascii
    }
}

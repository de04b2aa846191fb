//! Files that engines read: a table's [`Volume`] as a texture, and beside the texels everything that a shader needs.
//!
//! | format | texels | what it is for |
//! |---|---|---|
//! | [`Format::Ktx2`] | RGBA16F, 3D, zstd | the first choice: three.js, Babylon.js, Bevy, anything with a KTX2 loader |
//! | [`Format::Dds`] | RGBA16F, 3D | Direct3D tools |
//! | [`Format::Exr`] | RGBA16F, slabs side by side in 2D | engines that import volumes from pictures, and eyes |
//! | [`Format::Raw`] | RGBA16F, plain | anything: `NAME.bin` are the bytes to upload, `NAME.bin.json` says how large |
//! | [`Format::Rgb9e5`] | RGB9E5, 3D, KTX2 | half the bytes; no fewer for cloth that needs three axes alone, as felt |
//! | [`Format::Bc6h`] | BC6H, 3D, KTX2 | an eighth of the bytes, and an error that shows: measure it |
//!
//! # Reconstruction
//!
//! The texts of [`crate::shader`] stay as they are for every format. They ask for two functions: `sateen_parameter(index)` is the array
//! `parameters` of the metadata, `sateen_volume(uvw)` is what the recipe of the format says, with linear filters, coordinates clamped to the
//! edge, and no smaller mips. Texel i of n has its centre at (i + ½)/n: the texts already ask there.
//!
//! ```text
//! volume    sateen_volume(uvw) = texture(volume, uvw)                                                          ktx2, dds, raw
//!
//! atlas     slab z of the volume is in column z mod columns, row ⌊z / columns⌋; row 0 of the picture is its top and y = 0 of a slab.
//!           z = uvw.z depth − ½,  a = ⌊z⌋                                                                      exr
//!           sateen_volume(uvw) = mix(slab(a), slab(a + 1), z − a),  slabs clamped to 0 … depth − 1
//!           slab(z) = texture(atlas, ((z mod columns, ⌊z / columns⌋) + uvw.xy) / (columns, rows))
//!
//! threes    z = uvw.z depth − ½,  k = ⌊(z + ½) / pitch⌋,  t = z − pitch k,  first = pitch (k − k mod 2)        rgb9e5, bc6h
//!           s = texture(volume, (uvw.xy, (first + t + ½) / depth))
//!           v = texture(volume, (uvw.xy, (first + pitch + t + ½) / depth))
//!           sateen_volume(uvw) = (s.r, v.r, s.g, v.g) where k is even, (s.g, v.g, s.b, v.b) where it is odd
//! ```
//!
//! **Threes** are for texels without a fourth channel. A volume's texel holds √S and √V at two neighbouring nodes of u₃. Here a texel holds
//! one of both at three nodes, 2 j … 2 j + 2, and slabs of √S and √V take turns: two fetches a lookup, as many texels as a volume has, and
//! three numbers in each that are near one another, as exponents and lines that they share want it; (√S, √V, 0) at every node would take
//! the same room and leave a third of it empty. All grids have as many slabs per node, the `pitch`, and the parameters know. Where u₃ has an
//! even number of nodes, one more is stored; grids without a fourth axis, as felt's, take four times as many texels, and with RGB9E5 twice
//! the bytes: they are small as they are.
//!
//! # Metadata
//!
//! One JSON object in ASCII: the value of the key `sateen` in KTX2, the attribute `sateen` in EXR, `NAME.dds.json` or `NAME.bin.json` beside DDS and raw texels. It
//! holds the format's version, the fabric's name, `layout`, `pixels`, `size`, `pitch` or `atlas`, threads and their albedos in the order of
//! `sateen_eval_with`, the `recipe`, the `parameters`, and the errors: `recorded` in the table, and `measured` of the table and of what is
//! exported, on the same pairs.
//!
//! A table without grids is a texture of one texel (one block), which nothing reads: its parameters say everything.

mod bc6h;
mod dds;
mod exr;
mod ktx2;
mod note;
mod raw;
mod rgb9e5;
mod threes;

pub use note::{About, Cost};

use half::f16;

use crate::fabric::Fabric;
use crate::metrics::{PairErrors, TableModel, Truth};
use crate::model::Model;
use crate::progress::{Cancelled, Progress};
use crate::shader::{Filter, Lookup, parameters};
use crate::table::Table;
use crate::volume::{self, MAX_SIDE, Volume};
use threes::Threes;

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Format {
    /// KTX2: a 3D texture of RGBA16F.
    Ktx2,
    /// DDS with a DX10 header: a 3D texture of RGBA16F, and a JSON file of metadata.
    Dds,
    /// OpenEXR: all slabs of the volume side by side, as half floats.
    Exr,
    /// KTX2 of three channels that share an exponent: half the bytes, and two fetches a lookup.
    Rgb9e5,
    /// KTX2 of BC6H blocks: an eighth of the bytes, two fetches a lookup, and an error that shows.
    Bc6h,
    /// RGBA16F without a header, and a JSON file of metadata.
    Raw,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Ktx2,
        Self::Dds,
        Self::Exr,
        Self::Rgb9e5,
        Self::Bc6h,
        Self::Raw,
    ];

    /// What the flag calls it: `ktx2`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ktx2 => "ktx2",
            Self::Dds => "dds",
            Self::Exr => "exr",
            Self::Rgb9e5 => "rgb9e5",
            Self::Bc6h => "bc6h",
            Self::Raw => "raw",
        }
    }

    /// What files of it end in.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ktx2 | Self::Rgb9e5 | Self::Bc6h => "ktx2",
            Self::Dds => "dds",
            Self::Exr => "exr",
            Self::Raw => "bin",
        }
    }

    /// What its texels are.
    pub fn pixels(self) -> Pixels {
        match self {
            Self::Rgb9e5 => Pixels::Rgb9e5,
            Self::Bc6h => Pixels::Bc6h,
            Self::Ktx2 | Self::Dds | Self::Exr | Self::Raw => Pixels::Rgba16f,
        }
    }
}

/// What texels are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Pixels {
    /// Four half floats.
    Rgba16f,
    /// Three mantissas of nine bits and an exponent of five, R in the lowest bits.
    Rgb9e5,
    /// Blocks of 4 × 4 texels in 16 bytes, unsigned.
    Bc6h,
}

impl Pixels {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgba16f => "RGBA16F",
            Self::Rgb9e5 => "RGB9E5",
            Self::Bc6h => "BC6H",
        }
    }
}

/// A file to write.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct File {
    /// What its name ends in.
    pub extension: &'static str,
    /// What is in it.
    pub bytes: Vec<u8>,
}

/// Why there is no such file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is no volume.
    #[error(transparent)]
    Volume(#[from] volume::Error),
    /// More slabs than textures can have.
    #[error(
        "three nodes a texel would make the texture {0} texels deep, but textures are at most {MAX_SIDE}; a smaller volume would fit"
    )]
    TooDeep(usize),
    /// What the EXR writer says.
    #[error("cannot make an EXR file: {0}")]
    Exr(#[from] ::exr::error::Error),
    /// What the DDS writer says.
    #[error("cannot make a DDS file: {0}")]
    Dds(#[from] ddsfile::Error),
    /// What the compression says.
    #[error("cannot compress texels: {0}")]
    Compression(#[from] std::io::Error),
}

/// A table in the texels of a format.
#[derive(Debug, Clone)]
pub struct Export<'a> {
    table: &'a Table,
    format: Format,
    size: [usize; 3],
    texels: Vec<u8>,
    parameters: Vec<[f32; 4]>,
    /// Slabs per node, of threes.
    pitch: Option<usize>,
    lookup: Volume,
}

impl<'a> Export<'a> {
    /// Of a table and the volume that `settings` give; a smaller one, if threes would make it too deep.
    ///
    /// # Errors
    /// When there is no such volume.
    pub fn within(
        table: &'a Table,
        settings: &volume::Settings,
        format: Format,
    ) -> Result<Self, Error> {
        let mut settings = *settings;
        loop {
            let volume = Volume::new(table, &settings)?;
            match Self::new(table, &volume, format) {
                Err(Error::TooDeep(depth)) => {
                    // By as much as it is too deep, and at least by one: it ends.
                    let side = volume.size()[2] * MAX_SIDE / depth;
                    settings.max_side = side.min(settings.max_side - 1);
                }
                result => return result,
            }
        }
    }

    /// Of a table and its volume.
    ///
    /// # Errors
    /// When the texture would be too deep.
    ///
    /// # Panics
    /// When the volume is of another table.
    pub fn new(table: &'a Table, volume: &Volume, format: Format) -> Result<Self, Error> {
        let parameters = parameters(table, volume);
        let with_threes = |threes: &Threes, texels: Vec<u8>, decoded: &[[f16; 3]]| Self {
            table,
            format,
            size: threes.size(),
            texels,
            parameters: threes.parameters(parameters.clone()),
            pitch: Some(threes.pitch()),
            lookup: threes.volume(volume, decoded),
        };
        Ok(match format.pixels() {
            Pixels::Rgba16f => Self {
                table,
                format,
                size: volume.size(),
                texels: volume.to_bytes(),
                pitch: None,
                lookup: volume.clone(),
                parameters,
            },
            Pixels::Rgb9e5 => {
                let threes = Threes::of(volume, 1)?;
                let words = rgb9e5::encode(&threes.texels(volume));
                let texels = words.iter().flat_map(|word| word.to_le_bytes()).collect();
                with_threes(&threes, texels, &rgb9e5::decode(&words))
            }
            Pixels::Bc6h => {
                let threes = Threes::of(volume, bc6h::SIDE)?;
                let [width, height, _] = threes.size();
                let texels = bc6h::encode(&threes.texels(volume), [width, height]);
                let decoded = bc6h::decode(&texels, [width, height]);
                with_threes(&threes, texels, &decoded)
            }
        })
    }

    /// Texels along x, y and z of the texture.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// The texels as a graphics API takes them: little-endian, rows and slices without gaps.
    pub fn texels(&self) -> &[u8] {
        &self.texels
    }

    /// What `sateen_parameter` gives.
    pub fn parameters(&self) -> &[[f32; 4]] {
        &self.parameters
    }

    /// What is looked up in the texture, as a volume like that it was made of.
    pub fn volume(&self) -> &Volume {
        &self.lookup
    }

    /// The error against direct integration of `fabric`, of the table and of what is exported, with filters of graphics hardware, on the
    /// same `pairs` protocol pairs; fewer, where the table has not all.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn measure(
        &self,
        fabric: &Fabric,
        pairs: usize,
        seed: u64,
        progress: Progress<'_>,
    ) -> Result<Cost, Cancelled> {
        let truth = Truth::of_table(fabric, self.table, pairs, seed, progress.part(0.0, 0.9))?;
        let errors = |model: &dyn Model<f64>, progress| -> Result<PairErrors, Cancelled> {
            let values = truth.values_of(model, progress)?;
            Ok(truth.errors_of(&values))
        };
        let lookup = Lookup::new(self.table, &self.lookup, Filter::EightBit);
        let table = TableModel(self.table);
        Ok(Cost {
            seed,
            table: errors(&table, progress.part(0.9, 0.95))?,
            exported: errors(&Sampled(lookup), progress.part(0.95, 1.0))?,
        })
    }

    /// The files, the first with the format's own extension.
    ///
    /// Level data of KTX2 is compressed by zstd if `supercompress`.
    ///
    /// # Errors
    /// What the writers say.
    pub fn files(&self, about: &About<'_>, supercompress: bool) -> Result<Vec<File>, Error> {
        let note = note::Note::new(self, about);
        let one = |bytes| {
            vec![File {
                extension: self.format.extension(),
                bytes,
            }]
        };
        Ok(match self.format {
            Format::Ktx2 | Format::Rgb9e5 | Format::Bc6h => one(ktx2::write(
                self.format.pixels(),
                self.size,
                &self.texels,
                &note.to_json(),
                supercompress,
            )?),
            Format::Exr => one(exr::write(&self.lookup, note)?),
            Format::Dds => {
                raw::with_json(one(dds::write(self.size, &self.texels)?), "dds.json", &note)
            }
            Format::Raw => raw::with_json(one(self.texels.clone()), "bin.json", &note),
        })
    }
}

/// A lookup as a model.
struct Sampled<'a>(Lookup<'a>);

impl Model<f64> for Sampled<'_> {
    fn eval_cos(&self, wi: [f64; 3], wr: [f64; 3]) -> [f64; 3] {
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        self.0.eval_cos(single(wi), single(wr)).map(f64::from)
    }
}

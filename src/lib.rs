//! sateen bakes anisotropic fabric BRDFs into small 4D tables, evaluates them fast, and tells what the approximation costs.
//!
//! ```
//! # #[cfg(feature = "bake")] {
//! use sateen::bake::{Preset, bake};
//! use sateen::fabric::Fabric;
//! use sateen::progress::Progress;
//!
//! let fabric = Fabric::from_library("faux-suede").unwrap();
//! let table = bake(&fabric, Preset::Draft, Progress::silent()).unwrap().table;
//!
//! let (wi, wr) = ([0.0, 0.6, 0.8], [0.0, 0.0, 1.0]);
//! let [r, g, b] = table.eval(wi, wr);
//! assert!(r > g && g > b && b > 0.0);
//! # }
//! ```
//!
//! An engine loads the bytes of a file with [`table::Table::from_bytes`], which checks everything, and calls
//! [`table::Table::eval`] or [`table::Table::eval_cos`], which cannot fail.
//!
//! # Conventions
//!
//! - Surface frame: x = warp direction, y = weft direction, z = normal. Directions are unit vectors that point away from
//!   the surface: `wi` to the light, `wr` to the viewer.
//! - `eval` is the BRDF \[1/sr\] **without** the cosine. `eval_cos` = ρ is BRDF × cosine, the kernel of
//!   L_r = ∫ ρ L_i dwi. (pbrt's `f` excludes the cosine; Mitsuba's `eval` includes it, and its `wi` is the viewer.)
//! - Colours are linear RGB. Angles are radians in memory, degrees in files and under names that end in `_deg`.
//! - A thread has one direction in the surface, or one that changes along its curve, as in knits and felt.
//! - A thread's S (surface) and V (volume, for albedo 1) are achromatic. Tables hold no albedo: dyeing is a run-time
//!   multiplication.
//!
//! # Modules
//!
//! From the bottom to the top: each names only those before it, which `scripts/layers.py` checks by this list.
//!
//! - [`math`]: numbers side by side, vectors, roots
//! - [`needs`]: which pairs of directions are needed
//! - [`brdf`]: the closed form of a thread, and threads woven
//! - `progress`: how far long work is, and whether it goes on
//! - `text`: TOML files, and what is wrong with them by line
//! - `fabric`: fabrics, from files and from the library
//! - `pattern`: several fabrics, by masks
//! - `model`: direct evaluation of fabrics, and other models
//! - [`chart`]: pairs of directions as points of a box
//! - [`table`]: what is baked, and its file
//! - [`lookup`]: evaluation of tables
//! - `volume`: a table as one 3D texture
//! - `shader`: its lookup in shaders
//! - `metrics`: how error is measured
//! - `evaluator`: ways to evaluate a fabric, by name
//! - `mesh`: triangles of cloth, from files and as it hangs
//! - `render`: pictures of cloth
//! - `scene`: what scenes need, and pictures of them
//! - `fit`: other models made like a fabric
//! - `bake`: fabrics to tables
//! - `export`: tables as files for engines
//! - `report`: error against time and bytes of every evaluator
//! - `stress`: what holds in extreme cases
//! - `ffi`: tables for C and C++
//!
//! The tool uses only what is public here.
//!
//! # Features
//!
//! | feature | what it adds |
//! |---|---|
//! | `std`, `libm` | floating-point functions; one of the two is required, `std` wins |
//! | `zstd` | loading of compressed tables, which is what `bake` writes, by zstd's code in C: it takes a C compiler for the target |
//! | `small` | less code, at the price of some speed |
//! | `ffi` | `ffi`: the functions of `sateen.h`, for C and C++ (`scripts/capi.sh` builds the libraries) |
//! | `shader` | [`volume`]: a table as one 3D texture; [`shader`]: its lookup in WGSL, GLSL and HLSL |
//! | `bake` | [`text`], [`fabric`], [`pattern`], [`model`], [`metrics`], [`evaluator`], [`mod@fit`], [`mod@bake`] |
//! | `render` | [`mesh`]: triangles from files; [`render`](mod@render): pictures of cloth on cylinders, a sphere and meshes, as PNG and EXR, and how far two of them look apart |
//! | `scene` | [`scene`]: scenes, which pairs of directions they can ask of each fabric, and pictures of them |
//! | `report` | [`report`]: error against time and bytes, as CSV, JSON, plots and a page; [`stress`]: what holds in extreme cases, as CSV and JSON |
//! | `export` | [`export`]: a table's volume and parameters as KTX2, DDS, EXR and plain bytes, for engines |
//! | `cli` | the tool; the default |
//!
//! The core without features is `no_std` and needs `alloc`.
#![cfg_attr(not(feature = "std"), no_std)]

extern crate alloc;

/// Name and version of what writes files.
#[doc(hidden)]
pub const TOOL: &str = concat!("sateen ", env!("CARGO_PKG_VERSION"));

#[cfg(not(any(feature = "std", feature = "libm")))]
compile_error!("sateen needs one of the features `std` and `libm`");

pub mod brdf;
pub mod chart;
pub mod lookup;
pub mod math;
pub mod needs;
pub mod table;

#[cfg(feature = "bake")]
pub mod bake;
#[cfg(feature = "bake")]
pub mod evaluator;
#[cfg(feature = "export")]
pub mod export;
#[cfg(feature = "bake")]
pub mod fabric;
#[cfg(feature = "ffi")]
pub mod ffi;
#[cfg(feature = "bake")]
pub mod fit;
#[cfg(feature = "render")]
pub mod mesh;
#[cfg(feature = "bake")]
pub mod metrics;
#[cfg(feature = "bake")]
pub mod model;
#[cfg(feature = "bake")]
pub mod pattern;
#[cfg(feature = "bake")]
pub mod progress;
#[cfg(feature = "render")]
pub mod render;
#[cfg(feature = "report")]
pub mod report;
#[cfg(feature = "scene")]
pub mod scene;
#[cfg(feature = "shader")]
pub mod shader;
#[cfg(feature = "report")]
pub mod stress;
#[cfg(feature = "bake")]
pub mod text;
#[cfg(feature = "shader")]
pub mod volume;

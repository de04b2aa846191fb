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
//! Each names only those before it: [`math`], [`needs`] ← [`brdf`], [`chart`] ← [`table`] ← [`lookup`] ← `ffi`, and apart from these
//! [`fabric`] ← [`pattern`]; [`fabric`] ← [`model`] ← [`metrics`] ← [`mod@fit`], [`bake`] ← [`report`] ← [`stress`], which also use
//! the former; [`model`], [`pattern`] and [`lookup`] ← [`render`](mod@render) ← [`report`]; [`needs`] and [`render`](mod@render) ←
//! [`scene`]; [`table`], [`lookup`] ← [`volume`] ← [`shader`]; [`shader`], [`mod@bake`] ←
//! [`export`]. The tool uses only what is public here.
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
//! | `bake` | [`fabric`], [`pattern`], [`model`], [`metrics`], [`mod@fit`], [`mod@bake`] |
//! | `render` | [`render`](mod@render): pictures of cloth on cylinders, a sphere and meshes, as PNG and EXR, and how far two of them look apart |
//! | `scene` | [`scene`]: scenes, which pairs of directions they can ask of each fabric, and pictures of them |
//! | `report` | [`report`]: error against time and bytes, as CSV, JSON, plots and a page; [`stress`]: the same of stiff and extreme cases |
//! | `export` | [`export`]: a table's volume and parameters as KTX2, DDS, EXR and plain bytes, for engines |
//! | `cli` | the tool; the default |
//!
//! The core without features is `no_std` and needs `alloc`.
#![cfg_attr(not(feature = "std"), no_std)]

extern crate alloc;

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
#[cfg(feature = "export")]
pub mod export;
#[cfg(feature = "bake")]
pub mod fabric;
#[cfg(feature = "ffi")]
pub mod ffi;
#[cfg(feature = "bake")]
pub mod fit;
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
#[cfg(feature = "shader")]
pub mod volume;

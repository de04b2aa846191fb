//! Shaders: a table's lookup in WGSL, GLSL and HLSL, by a [`Volume`](crate::volume::Volume) and an array of parameters.
//!
//! The texts are functions alone, to be pasted or included after two of the engine's own, so that they bind nothing:
//!
//! ```text
//! WGSL    fn sateen_parameter(index: i32) -> vec4f          parameters[index], 32-bit floats
//!         fn sateen_volume(uvw: vec3f) -> vec4f             the volume at these coordinates, linearly filtered, mip 0
//! GLSL    vec4 sateen_parameter(int index)                  vec4 sateen_volume(vec3 uvw)
//! HLSL    float4 sateen_parameter(int index)                float4 sateen_volume(float3 uvw)
//! ```
//!
//! They give
//!
//! ```text
//! sateen_eval_cos(wi, wr)                  ρ = BRDF × cosine [1/sr], with the fabric's own albedo
//! sateen_eval(wi, wr)                      the BRDF [1/sr]
//! sateen_eval_cos_with(wi, wr, albedos)    ρ with other albedos: of the first four threads, in their order
//! sateen_eval_with(wi, wr, albedos)        the BRDF with them
//! sateen_direct_cos(wi, wr, n)             ρ by the thesis' rule: n midpoints along each thread, n closed forms
//! sateen_albedos()                         the fabric's own, to change some of
//! ```
//!
//! `wi` and `wr` are unit vectors to the light and to the viewer in the surface frame (x warp, y weft, z normal). They do what the
//! lookup does, under the same names: single tilts, projections and threads without a grid by their closed forms ([`crate::brdf`]),
//! threads with one by their volume, and by placed nodes near the horizon if it ends before. [`Lookup`] is the same in Rust, step by step: what shaders are held to (`tests/gpu/shader.rs`).
//!
//! # Parameters
//!
//! An array of float4, which [`parameters`] writes. Indices and counts are whole numbers in floats.
//!
//! ```text
//! 0                  1 − Σa, width of u (radians), scale of ρ, 1 if Q weighs tangents by both directions, else 0
//! 1                  width, height and depth of the volume in texels, number of threads
//! 2 + 7 j            cos α, sin α of thread j's direction, coverage a, kind: 0 tilts alone, 1 grid, 2 placed nodes, 3 curve
//!         + 1        albedo r, g, b, –
//!         + 2        η² − 1, k_d, γ_s, γ_v
//!         + 3        first tilt, how many, first arc, how many         (arcs: the segments in parts of at most 90°)
//!         + 4        first segment, how many, first node, how many     (of kinds 1 and 2)
//!         + 5        c/2, then 1 or 0: is stiff, surface lobe is wide, volume lobe is wide                    (of kinds 1 and 2)
//!         + 6        grid of S and V, grid of the projection (of kind 3), –, –
//! tilt               cos δ, sin δ, weight, δ
//! arc and segment    cos and sin of the lower end, cos and sin of the upper end
//!         + 1        tan(half the width), weight per radian, lower end, upper end
//! node               place and weight of a Gauss–Legendre node, –, –
//! grid               chart: 0 thesis, 1 highlight, 2 isotropic, 3 view; 1 if ends fold; 1 if sides fold (view: is isotropic); first slab
//!         + 1        what 1 stands for in S and in V; nodes of u₂, nodes of u₃
//!         + 2 … 5    u₀ … u₃: first warp, pieces, nodes − 1, – (of u₃: how far before the horizon the box ends, radians)
//! warp               a, b, a', b' of two neighbouring pieces: t = a + b u
//! ```
//!
//! The library's fabrics take 12 to 492 float4 in 8 MiB, and at most 716 in 32 MiB: 16 KiB, which every uniform or constant buffer can have, are
//! 1024. A fabric of your own with hundreds of segments or tilts, or four threads with grids, may have more; its array goes into a storage buffer, or a
//! texture of 32-bit floats, which `sateen_parameter` reads as well.
//!
//! # Precision
//!
//! Directions, parameters and everything in between must be of 32 bits (GLSL: `highp`, and `highp sampler3D`): differences of coordinates
//! and products of small cosines are lost in 16. Texels may be half floats, since they are ([`crate::volume`]), and so may the results: on pairs
//! of the error protocol the largest ρ of the library's fabrics is 2.4 and their largest BRDF 9. At the very horizon the BRDF has no
//! bound: `sateen_eval` is finite in 32 bits; for half floats take its minimum with 65 504, or stay with `sateen_eval_cos`.
//!
//! On Mesa's software Vulkan all three differ from [`Lookup`] by at most 2e-5 of ρ and a hundredth of its mean, over 2048 pairs of each fabric of the
//! library. Hardware filters with weights of 8 fractional bits, which [`Filter::EightBit`] imitates: that moves single pairs by up to 1.4 %
//! where nodes are few (256 KiB), and means by no more than 0.003 % of ρ.

mod lookup;
mod parameters;

pub use lookup::{Filter, Lookup};
#[cfg(feature = "export")]
pub(crate) use parameters::grid_places;
pub use parameters::parameters;

/// The functions in WGSL.
pub const WGSL: &str = include_str!("lookup.wgsl");
/// The functions in GLSL: ES 3.00 (WebGL 2), 3.30 and later.
pub const GLSL: &str = include_str!("lookup.glsl");
/// The functions in HLSL: shader model 4 and later.
pub const HLSL: &str = include_str!("lookup.hlsl");

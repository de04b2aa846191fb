//! Parameters of other reflectance models that a fabric's file may have beside its threads.

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

/// Parameters of other models; `None` where the file has no section of that name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Models {
    /// `[lambert]`
    pub lambert: Option<Lambert>,
    /// `[oren_nayar]`
    pub oren_nayar: Option<OrenNayar>,
    /// `[torrance_sparrow]`
    pub torrance_sparrow: Option<TorranceSparrow>,
    /// `[irawan]`
    pub irawan: Option<Irawan>,
}

/// Lambert's model (\[Fecho13\] 3.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lambert {
    /// Linear RGB.
    pub albedo: [f64; 3],
}

/// The Oren–Nayar model (\[Fecho13\] 3.2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrenNayar {
    /// Of the facets, linear RGB.
    pub albedo: [f64; 3],
    /// Standard deviation σ of the facets' inclination, radians.
    pub sigma: f64,
}

impl OrenNayar {
    /// The range of σ, radians.
    pub const SIGMA: RangeInclusive<f64> = 0.0..=0.5 * PI;
}

/// Which distribution of facets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Distribution {
    /// Gaussian slopes.
    Beckmann,
    /// Long tails, as Trowbridge and Reitz have it.
    #[default]
    Ggx,
}

/// How facets hide each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shadowing {
    /// Torrance and Sparrow's: every facet has its opposite in a symmetric groove.
    VCavity,
    /// Smith's, where heights and slopes are independent, correlated in height.
    #[default]
    Smith,
}

/// Which reflectance of a facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FresnelTerm {
    /// Unpolarised light at a dielectric.
    #[default]
    Dielectric,
    /// Schlick's fifth power.
    Schlick,
}

/// The Torrance–Sparrow model over a diffuse base (\[Fecho13\] 3.3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorranceSparrow {
    /// k_d · albedo, linear RGB.
    pub diffuse: [f64; 3],
    /// k_s, linear RGB.
    pub specular: [f64; 3],
    /// Roughness along the warp: √2 times the standard deviation of slopes.
    pub alpha_x: f64,
    /// Roughness along the weft.
    pub alpha_y: f64,
    /// Index of refraction.
    pub eta: f64,
    /// Which distribution of facets.
    pub distribution: Distribution,
    /// How facets hide each other.
    pub shadowing: Shadowing,
    /// Which reflectance of a facet.
    pub fresnel: FresnelTerm,
}

impl TorranceSparrow {
    /// The range of both roughnesses; below, lobes are lost in single precision.
    pub const ALPHA: RangeInclusive<f64> = 1e-3..=10.0;
}

/// The large-scale Irawan–Marschner model (\[Fecho13\] 3.2.1).
#[derive(Debug, Clone, PartialEq)]
pub struct Irawan {
    /// k_d, linear RGB.
    pub diffuse: [f64; 3],
    /// Warp and weft.
    pub yarns: Vec<Yarn>,
}

/// The segments of one set of parallel yarns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yarn {
    /// Angle of the yarn in the surface from the x axis towards y, radians.
    pub direction: f64,
    /// Share of the surface that the segments cover.
    pub coverage: f64,
    /// k_s, linear RGB.
    pub specular: [f64; 3],
    /// Uniform scattering α.
    pub alpha: f64,
    /// Forward scattering β.
    pub beta: f64,
    /// Smoothing δ of a filament yarn's highlight at its ends; 0 is none.
    pub delta: f64,
    /// Fibre twist ψ, radians; 0 is a filament yarn, all others are staple yarns.
    pub psi: f64,
    /// Largest inclination u_max of the spine, radians.
    pub u_max: f64,
    /// Spine curvature κ; the more negative, the more pointed.
    pub kappa: f64,
    /// Width w of a segment.
    pub width: f64,
    /// Length l of a segment.
    pub length: f64,
}

impl Yarn {
    /// The range of α.
    pub const ALPHA: RangeInclusive<f64> = 0.0..=10.0;
    /// The range of β.
    pub const BETA: RangeInclusive<f64> = 0.0..=1000.0;
    /// The range of δ.
    pub const DELTA: RangeInclusive<f64> = 0.0..=0.9;
    /// The range of |ψ| of staple yarns, radians: 1° to 89°, and a little for rounding.
    pub const PSI: RangeInclusive<f64> = 0.0174..=1.554;
    /// The range of u_max, radians: 1° to 89°, and a little for rounding.
    pub const U_MAX: RangeInclusive<f64> = 0.0174..=1.554;
    /// The range of κ. At −1 the spine would be a corner.
    pub const KAPPA: RangeInclusive<f64> = -0.999..=100.0;
    /// The range of w and l.
    pub const SIZE: RangeInclusive<f64> = 1e-3..=1e3;

    /// Half the length of the spine, l/2 − (w/2) sin u_max; it must be above 0.
    pub fn half_spine(&self) -> f64 {
        0.5 * (self.length - self.width * self.u_max.sin())
    }
}

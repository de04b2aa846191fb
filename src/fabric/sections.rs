//! The sections `[lambert]`, `[oren_nayar]`, `[torrance_sparrow]` and `[irawan]`, read and written.

use std::fmt::Write;
use std::ops::RangeInclusive;

use serde::Deserialize;
use toml::Spanned;

use super::models::{
    Distribution, FresnelTerm, Irawan, Lambert, Models, OrenNayar, Shadowing, TorranceSparrow, Yarn,
};
use crate::brdf::limits;
use crate::text::{AlbedoToml, Source, TextError};

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [lambert]")]
pub(super) struct LambertToml {
    albedo: Spanned<AlbedoToml>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [oren_nayar]")]
pub(super) struct OrenNayarToml {
    albedo: Spanned<AlbedoToml>,
    sigma_deg: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [torrance_sparrow]")]
pub(super) struct TorranceSparrowToml {
    diffuse: Spanned<AlbedoToml>,
    specular: Spanned<AlbedoToml>,
    alpha_x: Spanned<f64>,
    alpha_y: Spanned<f64>,
    eta: Spanned<f64>,
    #[serde(default)]
    distribution: Distribution,
    #[serde(default)]
    shadowing: Shadowing,
    #[serde(default)]
    fresnel: FresnelTerm,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [irawan]")]
pub(super) struct IrawanToml {
    diffuse: Spanned<AlbedoToml>,
    yarn: Spanned<Vec<YarnToml>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [[irawan.yarn]]")]
struct YarnToml {
    direction_deg: Spanned<f64>,
    coverage: Spanned<f64>,
    specular: Spanned<AlbedoToml>,
    alpha: Spanned<f64>,
    beta: Spanned<f64>,
    delta: Spanned<f64>,
    psi_deg: Spanned<f64>,
    u_max_deg: Spanned<f64>,
    kappa: Spanned<f64>,
    width: Spanned<f64>,
    length: Spanned<f64>,
}

/// More sets of yarns than any cloth has.
const MAX_YARNS: usize = 64;

/// A number within `range`, which is that of [`Source::number`]'s message.
fn within(
    source: &Source<'_>,
    key: &str,
    value: &Spanned<f64>,
    range: &RangeInclusive<f64>,
) -> Result<f64, TextError> {
    let must = format!("lie between {:?} and {:?}", range.start(), range.end());
    source.number(key, value, |x| range.contains(&x), &must)
}

pub(super) fn lambert(source: &Source<'_>, raw: &LambertToml) -> Result<Lambert, TextError> {
    Ok(Lambert {
        albedo: source.albedo("albedo", &raw.albedo)?,
    })
}

pub(super) fn oren_nayar(source: &Source<'_>, raw: &OrenNayarToml) -> Result<OrenNayar, TextError> {
    Ok(OrenNayar {
        albedo: source.albedo("albedo", &raw.albedo)?,
        sigma: within(source, "sigma_deg", &raw.sigma_deg, &(0.0..=90.0))?.to_radians(),
    })
}

pub(super) fn torrance_sparrow(
    source: &Source<'_>,
    raw: &TorranceSparrowToml,
) -> Result<TorranceSparrow, TextError> {
    let alpha = &TorranceSparrow::ALPHA;
    Ok(TorranceSparrow {
        diffuse: source.albedo("diffuse", &raw.diffuse)?,
        specular: source.albedo("specular", &raw.specular)?,
        alpha_x: within(source, "alpha_x", &raw.alpha_x, alpha)?,
        alpha_y: within(source, "alpha_y", &raw.alpha_y, alpha)?,
        eta: within(source, "eta", &raw.eta, &limits::ETA)?,
        distribution: raw.distribution,
        shadowing: raw.shadowing,
        fresnel: raw.fresnel,
    })
}

pub(super) fn irawan(source: &Source<'_>, raw: &IrawanToml) -> Result<Irawan, TextError> {
    let yarns = raw.yarn.get_ref();
    if yarns.is_empty() || yarns.len() > MAX_YARNS {
        let message = format!(
            "yarn: there are 1 to {MAX_YARNS} yarns, not {}",
            yarns.len()
        );
        return Err(source.error(raw.yarn.span().start, Some("yarn"), message));
    }
    let mut covered = 0.0;
    let mut checked = Vec::new();
    for raw in yarns {
        let yarn = yarn(source, raw)?;
        covered += yarn.coverage;
        if covered > 1.0 + 1e-9 {
            let message =
                format!("coverage: the yarns' coverages sum to {covered}, but must not exceed 1");
            return Err(source.error(raw.coverage.span().start, Some("coverage"), message));
        }
        checked.push(yarn);
    }
    Ok(Irawan {
        diffuse: source.albedo("diffuse", &raw.diffuse)?,
        yarns: checked,
    })
}

fn yarn(source: &Source<'_>, raw: &YarnToml) -> Result<Yarn, TextError> {
    let number = |key: &str, value, range: RangeInclusive<f64>| within(source, key, value, &range);
    let psi = source.number(
        "psi_deg",
        &raw.psi_deg,
        |x| x == 0.0 || (1.0..=89.0).contains(&x.abs()),
        "be 0 (a filament yarn) or between 1 and 89 or -89 and -1",
    )?;
    let yarn = Yarn {
        direction: number("direction_deg", &raw.direction_deg, -360.0..=360.0)?.to_radians(),
        coverage: number("coverage", &raw.coverage, 0.0..=1.0)?,
        specular: source.albedo("specular", &raw.specular)?,
        alpha: number("alpha", &raw.alpha, Yarn::ALPHA)?,
        beta: number("beta", &raw.beta, Yarn::BETA)?,
        delta: number("delta", &raw.delta, Yarn::DELTA)?,
        psi: psi.to_radians(),
        u_max: number("u_max_deg", &raw.u_max_deg, 1.0..=89.0)?.to_radians(),
        kappa: number("kappa", &raw.kappa, Yarn::KAPPA)?,
        width: number("width", &raw.width, Yarn::SIZE)?,
        length: number("length", &raw.length, Yarn::SIZE)?,
    };
    if yarn.half_spine() > 0.0 {
        Ok(yarn)
    } else {
        let message = format!(
            "length = {:?} must exceed width · sin u_max = {:?}, or nothing is left of the spine",
            yarn.length,
            yarn.width * yarn.u_max.sin()
        );
        Err(source.error(raw.length.span().start, Some("length"), message))
    }
}

impl Models {
    /// The sections as a fabric's file has them.
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        write(&mut text, self).expect("writing to a string");
        text
    }
}

fn write(text: &mut String, models: &Models) -> std::fmt::Result {
    let Models {
        lambert,
        oren_nayar,
        torrance_sparrow,
        irawan,
    } = models;
    if let Some(Lambert { albedo }) = lambert {
        writeln!(text, "\n[lambert]")?;
        write_color(text, "albedo", albedo)?;
    }
    if let Some(OrenNayar { albedo, sigma }) = oren_nayar {
        writeln!(text, "\n[oren_nayar]")?;
        write_color(text, "albedo", albedo)?;
        writeln!(text, "sigma_deg = {:?}", sigma.to_degrees().min(90.0))?;
    }
    if let Some(model) = torrance_sparrow {
        let name = |value| toml::Value::to_string(&value);
        let names = [
            ("distribution", toml::Value::try_from(model.distribution)),
            ("shadowing", toml::Value::try_from(model.shadowing)),
            ("fresnel", toml::Value::try_from(model.fresnel)),
        ];
        writeln!(text, "\n[torrance_sparrow]")?;
        write_color(text, "diffuse", &model.diffuse)?;
        write_color(text, "specular", &model.specular)?;
        writeln!(text, "alpha_x = {:?}", model.alpha_x)?;
        writeln!(text, "alpha_y = {:?}", model.alpha_y)?;
        writeln!(text, "eta = {:?}", model.eta)?;
        for (key, value) in names {
            writeln!(text, "{key} = {}", name(value.expect("a name")))?;
        }
    }
    if let Some(Irawan { diffuse, yarns }) = irawan {
        writeln!(text, "\n[irawan]")?;
        write_color(text, "diffuse", diffuse)?;
        yarns.iter().try_for_each(|yarn| write_yarn(text, yarn))?;
    }
    Ok(())
}

fn write_yarn(text: &mut String, yarn: &Yarn) -> std::fmt::Result {
    writeln!(text, "\n[[irawan.yarn]]")?;
    write_color(text, "specular", &yarn.specular)?;
    let u_max_deg = yarn.u_max.to_degrees().clamp(1.0, 89.0);
    let psi_deg = yarn.psi.to_degrees().clamp(-89.0, 89.0);
    for (key, value) in [
        ("direction_deg", yarn.direction.to_degrees()),
        ("coverage", yarn.coverage),
        ("alpha", yarn.alpha),
        ("beta", yarn.beta),
        ("delta", yarn.delta),
        ("psi_deg", psi_deg),
        ("u_max_deg", u_max_deg),
        ("kappa", yarn.kappa),
        ("width", yarn.width),
        ("length", yarn.length),
    ] {
        writeln!(text, "{key} = {value:?}")?;
    }
    Ok(())
}

fn write_color(text: &mut String, key: &str, color: &[f64; 3]) -> std::fmt::Result {
    writeln!(text, "{key} = {{ color = {color:?} }}")
}

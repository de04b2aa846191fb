//! TOML text to [`Fabric`], with errors that name file, line and key.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::value::SeqAccessDeserializer;
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::Spanned;

use super::models::Models;
use super::sections::{self, IrawanToml, LambertToml, OrenNayarToml, TorranceSparrowToml};
use super::{Fabric, Thread};
use crate::brdf::{Optics, Reweighting, limits};
use crate::text::{AlbedoToml, MAX_TOML_BYTES, Source, TextError, cut};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FabricToml {
    name: Spanned<String>,
    #[serde(default)]
    title: String,
    #[serde(default)]
    source: String,
    #[serde(default)]
    reweighting: Reweighting,
    #[serde(default)]
    correlation_width_deg: Option<Spanned<f64>>,
    #[serde(default)]
    rho_scale: Option<Spanned<f64>>,
    thread: Spanned<Vec<Spanned<ThreadToml>>>,
    lambert: Option<LambertToml>,
    oren_nayar: Option<OrenNayarToml>,
    torrance_sparrow: Option<TorranceSparrowToml>,
    irawan: Option<IrawanToml>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [[thread]]")]
struct ThreadToml {
    name: Spanned<String>,
    direction_deg: Spanned<DirectionToml>,
    coverage: Spanned<f64>,
    albedo: Option<Spanned<AlbedoToml>>,
    albedos: Option<Spanned<BTreeMap<String, Spanned<AlbedoToml>>>>,
    eta: Spanned<f64>,
    k_d: Spanned<f64>,
    gamma_s_deg: Spanned<f64>,
    gamma_v_deg: Spanned<f64>,
    tangent_offsets_deg: Spanned<Vec<Spanned<f64>>>,
    tangent_lengths: Spanned<Vec<Spanned<f64>>>,
}

/// One direction, or one for every tangent offset.
enum DirectionToml {
    One(f64),
    Curve(Vec<f64>),
}

impl<'de> Deserialize<'de> for DirectionToml {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Directions;

        impl<'de> Visitor<'de> for Directions {
            type Value = DirectionToml;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("degrees, or a list of them, one for every tangent offset")
            }

            fn visit_i64<E>(self, degrees: i64) -> Result<DirectionToml, E> {
                Ok(DirectionToml::One(degrees as f64))
            }

            fn visit_f64<E>(self, degrees: f64) -> Result<DirectionToml, E> {
                Ok(DirectionToml::One(degrees))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<DirectionToml, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(list)).map(DirectionToml::Curve)
            }
        }

        deserializer.deserialize_any(Directions)
    }
}

/// More segments or threads than any cloth has; keeps hostile files cheap. Where n segments overlap they become up to
/// 2n − 1, of which a table holds 4096.
const MAX_SEGMENTS: usize = 2048;
const MAX_THREADS: usize = 64;
const DEFAULT_CORRELATION_WIDTH_DEG: f64 = 20.0;

pub(super) fn parse(text: &str, file: &str, variant: Option<&str>) -> Result<Fabric, TextError> {
    let source = Source { file, text };
    if text.len() > MAX_TOML_BYTES {
        let message = format!(
            "{} bytes are more than any fabric has ({MAX_TOML_BYTES})",
            text.len()
        );
        return Err(source.error(0, None, message));
    }
    let raw: FabricToml = toml::from_str(text).map_err(|error| source.syntax_error(&error))?;

    let sigma_u = match &raw.correlation_width_deg {
        None => DEFAULT_CORRELATION_WIDTH_DEG,
        Some(width) => source.number(
            "correlation_width_deg",
            width,
            |x| (1.0..=1000.0).contains(&x),
            "lie between 1 and 1000 degrees",
        )?,
    };
    let rho_scale = match &raw.rho_scale {
        None => 1.0,
        Some(scale) => source.number(
            "rho_scale",
            scale,
            |x| limits::RHO_SCALE.contains(&x),
            "lie between 0.0001 and 1",
        )?,
    };
    let threads_at = raw.thread.span().start;
    if raw.thread.get_ref().is_empty() || raw.thread.get_ref().len() > MAX_THREADS {
        let message = format!(
            "thread: a fabric has 1 to {MAX_THREADS} threads, this one {}",
            raw.thread.get_ref().len()
        );
        return Err(source.error(threads_at, Some("thread"), message));
    }

    let chosen = choose_variant(&source, raw.thread.get_ref(), variant)?;
    let mut threads = Vec::new();
    let mut covered = 0.0;
    for entry in raw.thread.get_ref() {
        let thread = parse_thread(
            &source,
            entry.get_ref(),
            entry.span().start,
            chosen.as_deref(),
        )?;
        covered += thread.coverage;
        if covered > 1.0 + 1e-9 {
            let message =
                format!("coverage: the threads' coverages sum to {covered}, but must not exceed 1");
            return Err(source.error(
                entry.get_ref().coverage.span().start,
                Some("coverage"),
                message,
            ));
        }
        if threads
            .iter()
            .any(|other: &Thread| other.name == thread.name)
        {
            let message = format!("name: two threads are called \"{}\"", thread.name);
            return Err(source.error(entry.get_ref().name.span().start, Some("name"), message));
        }
        threads.push(thread);
    }

    let source = &source;
    let models = Models {
        lambert: (raw.lambert.as_ref())
            .map(|raw| sections::lambert(source, raw))
            .transpose()?,
        oren_nayar: (raw.oren_nayar.as_ref())
            .map(|raw| sections::oren_nayar(source, raw))
            .transpose()?,
        torrance_sparrow: (raw.torrance_sparrow.as_ref())
            .map(|raw| sections::torrance_sparrow(source, raw))
            .transpose()?,
        irawan: (raw.irawan.as_ref())
            .map(|raw| sections::irawan(source, raw))
            .transpose()?,
    };

    let base = source.name("name", raw.name.get_ref(), raw.name.span().start)?;
    let name = chosen
        .as_ref()
        .map_or_else(|| base.clone(), |variant| format!("{base}-{variant}"));
    let title = if raw.title.is_empty() {
        base
    } else {
        raw.title
    };
    let title = chosen
        .as_ref()
        .map_or_else(|| title.clone(), |variant| format!("{title}, {variant}"));
    Ok(Fabric {
        name,
        title,
        source: raw.source,
        reweighting: raw.reweighting,
        sigma_u: sigma_u.to_radians(),
        rho_scale,
        threads,
        models: Box::new(models),
        toml: text.to_owned(),
        variant: chosen,
    })
}

/// The albedo variant to use: the one asked for, the first one, or none where no thread names any.
fn choose_variant(
    source: &Source<'_>,
    threads: &[Spanned<ThreadToml>],
    asked: Option<&str>,
) -> Result<Option<String>, TextError> {
    let named = threads
        .iter()
        .find_map(|thread| thread.get_ref().albedos.as_ref());
    let Some(named) = named else {
        return match asked {
            None => Ok(None),
            Some(asked) => Err(source.error(
                0,
                Some("albedos"),
                format!(
                    "albedos: the fabric names no albedos, so none is \"{}\"",
                    cut(asked)
                ),
            )),
        };
    };
    let names: Vec<&String> = named.get_ref().keys().collect();
    let at = named.span().start;
    for name in &names {
        source.name("albedos", name, at)?;
    }
    match asked {
        Some(asked) if names.iter().any(|name| *name == asked) => Ok(Some(asked.to_owned())),
        Some(asked) => Err(source.error(
            at,
            Some("albedos"),
            format!("albedos: none is \"{}\"; there are {names:?}", cut(asked)),
        )),
        None => match names.first() {
            Some(first) => Ok(Some((*first).clone())),
            None => Err(source.error(
                at,
                Some("albedos"),
                "albedos: at least one must be named".to_owned(),
            )),
        },
    }
}

fn parse_thread(
    source: &Source<'_>,
    raw: &ThreadToml,
    at: usize,
    variant: Option<&str>,
) -> Result<Thread, TextError> {
    let name = source.name("name", raw.name.get_ref(), raw.name.span().start)?;
    let albedo = match (&raw.albedo, &raw.albedos) {
        (Some(albedo), None) => source.albedo("albedo", albedo)?,
        (None, Some(named)) => match variant.and_then(|variant| named.get_ref().get(variant)) {
            Some(albedo) => source.albedo("albedos", albedo)?,
            None => {
                let message = format!(
                    "albedos: thread \"{name}\" lacks \"{}\"",
                    variant.unwrap_or_default()
                );
                return Err(source.error(named.span().start, Some("albedos"), message));
            }
        },
        _ => {
            let message = format!("albedo: thread \"{name}\" needs either albedo or albedos");
            return Err(source.error(at, Some("albedo"), message));
        }
    };

    let (offsets, lengths) = (
        raw.tangent_offsets_deg.get_ref(),
        raw.tangent_lengths.get_ref(),
    );
    let lengths_at = raw.tangent_lengths.span().start;
    if offsets.len() != lengths.len() + 1 || lengths.is_empty() || lengths.len() > MAX_SEGMENTS {
        let message = format!(
            "tangent_lengths: {} offsets need {} lengths (1 to {MAX_SEGMENTS}), there are {}",
            offsets.len(),
            offsets.len().saturating_sub(1),
            lengths.len()
        );
        return Err(source.error(lengths_at, Some("tangent_lengths"), message));
    }
    let mut tangent_offsets = Vec::with_capacity(offsets.len());
    for offset in offsets {
        let offset = source.number(
            "tangent_offsets_deg",
            offset,
            |x| x.abs() <= 90.0,
            "lie between -90 and 90 degrees",
        )?;
        tangent_offsets.push(offset.to_radians());
    }
    let mut tangent_lengths = Vec::with_capacity(lengths.len());
    for length in lengths {
        tangent_lengths.push(source.number(
            "tangent_lengths",
            length,
            |x| x >= 0.0,
            "not be negative",
        )?);
    }
    let total: f64 = tangent_lengths.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        let message = format!("tangent_lengths: their sum {total} must be finite and above 0");
        return Err(source.error(lengths_at, Some("tangent_lengths"), message));
    }

    let gamma = |x: f64| (0.001..=1000.0).contains(&x);
    let gamma_range = "be above 0: between 0.001 and 1000 degrees";
    Ok(Thread {
        name,
        directions: parse_directions(source, &raw.direction_deg, offsets.len())?,
        coverage: source.number(
            "coverage",
            &raw.coverage,
            |x| x == 0.0 || limits::COVERAGE.contains(&x),
            "lie between 0 and 1 (and be 0 or at least 1e-12)",
        )?,
        albedo,
        optics: Optics::new(
            source.number(
                "eta",
                &raw.eta,
                |x| limits::ETA.contains(&x),
                "be at least 1 and at most 100",
            )?,
            source.number(
                "k_d",
                &raw.k_d,
                |x| (0.0..=1.0).contains(&x),
                "lie between 0 and 1",
            )?,
            source
                .number("gamma_s_deg", &raw.gamma_s_deg, gamma, gamma_range)?
                .to_radians(),
            source
                .number("gamma_v_deg", &raw.gamma_v_deg, gamma, gamma_range)?
                .to_radians(),
        ),
        tangent_offsets,
        tangent_lengths,
    })
}

/// One direction per tangent offset, of which there are `count`, in radians.
fn parse_directions(
    source: &Source<'_>,
    raw: &Spanned<DirectionToml>,
    count: usize,
) -> Result<Vec<f64>, TextError> {
    const KEY: &str = "direction_deg";
    let at = raw.span().start;
    let degrees = match raw.get_ref() {
        DirectionToml::One(direction) => vec![*direction; count],
        DirectionToml::Curve(directions) => directions.clone(),
    };
    if degrees.len() != count {
        let message = format!(
            "{KEY}: {} directions for {count} tangent offsets; give one for each, or a single one for all",
            degrees.len()
        );
        return Err(source.error(at, Some(KEY), message));
    }
    if let Some(outside) = degrees.iter().find(|x| x.is_nan() || x.abs() > 360.0) {
        let message = format!("{KEY} = {outside:?} must lie between -360 and 360");
        return Err(source.error(at, Some(KEY), message));
    }
    Ok(degrees.into_iter().map(f64::to_radians).collect())
}

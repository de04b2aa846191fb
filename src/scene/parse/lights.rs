//! `[[light]]`

use std::f64::consts::TAU;

use serde::Deserialize;
use toml::Spanned;

use super::{LENGTHS, MUST_BE_LENGTH, RangeToml, Reader, named};
use crate::scene::{Light, LightSource, SceneError, Sky};
use crate::text::{Exactly, cut};

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [[light]]")]
pub(super) struct LightToml {
    name: Option<String>,
    kind: Spanned<String>,
    strength: Option<Spanned<f64>>,
    direction: Option<Spanned<Exactly<f64, 3>>>,
    azimuth_deg: Option<Spanned<RangeToml>>,
    elevation_deg: Option<Spanned<RangeToml>>,
    position: Option<Spanned<Exactly<f64, 3>>>,
    position_to: Option<Spanned<Exactly<f64, 3>>>,
    distance: Option<Spanned<f64>>,
    inner_deg: Option<Spanned<f64>>,
    outer_deg: Option<Spanned<f64>>,
    above_deg: Option<Spanned<f64>>,
}

impl Reader<'_> {
    pub(super) fn light(
        &self,
        index: usize,
        entry: &Spanned<LightToml>,
    ) -> Result<Light, SceneError> {
        let (raw, at) = (entry.get_ref(), entry.span().start);
        let kind = raw.kind.get_ref().as_str();
        // What each kind takes, besides name and strength.
        let taken: &[&str] = match kind {
            "directional" => &["direction", "azimuth_deg", "elevation_deg"],
            "point" => &["position", "position_to", "distance"],
            "spot" => &[
                "position",
                "position_to",
                "distance",
                "direction",
                "inner_deg",
                "outer_deg",
            ],
            "environment" => &["above_deg"],
            "collocated" => &[],
            _ => {
                let message = format!(
                    "kind: \"{}\" must be directional, point, spot, environment or collocated",
                    cut(kind)
                );
                return Err(self.error(raw.kind.span().start, "kind", message).into());
            }
        };
        let given = [
            ("direction", raw.direction.is_some()),
            ("azimuth_deg", raw.azimuth_deg.is_some()),
            ("elevation_deg", raw.elevation_deg.is_some()),
            ("position", raw.position.is_some()),
            ("position_to", raw.position_to.is_some()),
            ("distance", raw.distance.is_some()),
            ("inner_deg", raw.inner_deg.is_some()),
            ("outer_deg", raw.outer_deg.is_some()),
            ("above_deg", raw.above_deg.is_some()),
        ];
        for (key, is_given) in given {
            if is_given && !taken.contains(&key) {
                let message = format!("{key}: a light of kind \"{kind}\" has none; remove it");
                return Err(self.error(at, key, message).into());
            }
        }
        let missing = |key: &str, what: &str| {
            let message = format!("{key}: a light of kind \"{kind}\" needs {what}");
            self.error(at, key, message)
        };
        let strength = match &raw.strength {
            Some(strength) => {
                let valid = |x: f64| (0.0..=1e9).contains(&x);
                self.source
                    .number("strength", strength, valid, "lie between 0 and 1e9")?
            }
            None => 1.0,
        };
        let degrees = |key: &str, value: &Spanned<f64>, [low, high]: [f64; 2]| {
            let valid = |x: f64| (low..=high).contains(&x);
            let must = format!("lie between {low} and {high}");
            let degrees = self.source.number(key, value, valid, &must);
            degrees.map(f64::to_radians)
        };
        let distance = match &raw.distance {
            Some(distance) => {
                let valid = |x: f64| LENGTHS.contains(&x);
                self.source
                    .number("distance", distance, valid, MUST_BE_LENGTH)?
            }
            None => 1.0,
        };
        let place = || {
            let position = raw.position.as_ref();
            let position = position.ok_or_else(|| missing("position", "a position"))?;
            self.region(position, raw.position_to.as_ref())
        };
        let source = match kind {
            "directional" => match (&raw.direction, &raw.elevation_deg) {
                (Some(direction), None) if raw.azimuth_deg.is_none() => LightSource::Directional(
                    Sky::direction(self.vector("direction", direction, true)?),
                ),
                (None, Some(elevation)) => {
                    LightSource::Directional(self.sky(raw.azimuth_deg.as_ref(), Some(elevation))?)
                }
                _ => {
                    let what = "either a direction towards it, or azimuth_deg and elevation_deg";
                    return Err(missing("direction", what).into());
                }
            },
            "point" => LightSource::Point {
                place: place()?,
                distance,
            },
            "spot" => {
                let direction = raw.direction.as_ref();
                let direction = direction
                    .ok_or_else(|| missing("direction", "a direction in which it shines"))?;
                let outer = raw.outer_deg.as_ref();
                let outer =
                    outer.ok_or_else(|| missing("outer_deg", "the half angle of its cone"))?;
                let outer = degrees("outer_deg", outer, [0.01, 90.0])?;
                let inner = match &raw.inner_deg {
                    Some(inner) => degrees("inner_deg", inner, [0.0, outer.to_degrees()])?,
                    None => 0.8 * outer,
                };
                LightSource::Spot {
                    place: place()?,
                    distance,
                    axis: self.vector("direction", direction, true)?.normalize(),
                    cone: [inner, outer],
                }
            }
            "environment" => LightSource::Environment(match &raw.above_deg {
                Some(above) => degrees("above_deg", above, [-90.0, 89.0])?,
                None => -0.25 * TAU,
            }),
            _ => LightSource::Collocated,
        };
        Ok(Light {
            name: named(raw.name.as_ref(), "light", index),
            strength,
            source,
        })
    }
}

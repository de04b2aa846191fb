//! `[[camera]]`

use glam::DVec3;
use serde::Deserialize;
use toml::Spanned;

use super::{LENGTHS, MUST_BE_LENGTH, RangeToml, Reader, named};
use crate::scene::{Camera, CameraPath, Lens, SceneError};
use crate::text::Exactly;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [[camera]]")]
pub(super) struct CameraToml {
    name: Option<String>,
    target: Spanned<Exactly<f64, 3>>,
    position: Option<Spanned<Exactly<f64, 3>>>,
    position_to: Option<Spanned<Exactly<f64, 3>>>,
    up: Option<Spanned<Exactly<f64, 3>>>,
    distance: Option<Spanned<RangeToml>>,
    azimuth_deg: Option<Spanned<RangeToml>>,
    elevation_deg: Option<Spanned<RangeToml>>,
    fov_deg: Option<Spanned<f64>>,
    height: Option<Spanned<f64>>,
}

impl Reader<'_> {
    pub(super) fn camera(
        &self,
        index: usize,
        entry: &Spanned<CameraToml>,
    ) -> Result<Camera, SceneError> {
        let (raw, at) = (entry.get_ref(), entry.span().start);
        let target = self.vector("target", &raw.target, false)?;
        let lens = match (&raw.fov_deg, &raw.height) {
            (Some(fov), None) => {
                let valid = |x: f64| (0.01..=170.0).contains(&x);
                let fov = self
                    .source
                    .number("fov_deg", fov, valid, "lie between 0.01 and 170")?;
                Lens::Perspective(fov.to_radians())
            }
            (None, Some(height)) => {
                let valid = |x: f64| LENGTHS.contains(&x);
                Lens::Orthographic(
                    self.source
                        .number("height", height, valid, MUST_BE_LENGTH)?,
                )
            }
            _ => {
                let message =
                    "camera: it needs either fov_deg (perspective) or height (orthographic)";
                return Err(self.error(at, "camera", message).into());
            }
        };
        let path = match (&raw.position, &raw.distance) {
            (Some(position), None) => {
                if raw.azimuth_deg.is_some() || raw.elevation_deg.is_some() {
                    let message = "camera: azimuth_deg and elevation_deg are of one that orbits, which has a distance instead of a position";
                    return Err(self.error(at, "camera", message).into());
                }
                let place = self.region(position, raw.position_to.as_ref())?;
                let up = match &raw.up {
                    Some(up) => self.vector("up", up, true)?,
                    None => DVec3::Y,
                };
                if place.low == place.high && place.low == target {
                    let message = "target: it must not be the camera's position";
                    return Err(self
                        .error(raw.target.span().start, "target", message)
                        .into());
                }
                CameraPath::Within { place, target, up }
            }
            (None, Some(distance)) => {
                if raw.position_to.is_some() || raw.up.is_some() {
                    let message = "camera: position_to and up are of one that has a position, not of one that orbits";
                    return Err(self.error(at, "camera", message).into());
                }
                CameraPath::Orbit {
                    target,
                    distance: self.range(
                        "distance",
                        distance,
                        |x| LENGTHS.contains(&x),
                        MUST_BE_LENGTH,
                    )?,
                    sky: self.sky(raw.azimuth_deg.as_ref(), raw.elevation_deg.as_ref())?,
                }
            }
            _ => {
                let message = "camera: it needs either a position, or a distance from the target that it orbits";
                return Err(self.error(at, "camera", message).into());
            }
        };
        Ok(Camera {
            name: named(raw.name.as_ref(), "camera", index),
            lens,
            path,
        })
    }
}

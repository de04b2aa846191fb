//! TOML text to [`Pattern`].

use std::collections::BTreeMap;
use std::io;

use serde::Deserialize;
use toml::Spanned;

use super::layout::Layout;
use super::{Files, Image, Material, Pattern, albedos};
use crate::brdf::limits;
use crate::fabric::Fabric;
use crate::text::{AlbedoToml, Exactly, MAX_TOML_BYTES, Source, TextError, cut};

/// Why there is no pattern.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PatternError {
    /// The text of the pattern, or of a fabric that it names.
    #[error(transparent)]
    Text(#[from] TextError),
    /// A file that the pattern names cannot be read.
    #[error("{place}: cannot read {file}")]
    Unreadable {
        /// File and line that name it.
        place: String,
        /// Which.
        file: String,
        /// Why.
        source: io::Error,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PatternToml {
    name: Spanned<String>,
    #[serde(default)]
    title: String,
    #[serde(default)]
    source: String,
    material: Spanned<Vec<MaterialToml>>,
    dots: Option<Spanned<DotsToml>>,
    stripes: Option<Spanned<StripesToml>>,
    checks: Option<Spanned<ChecksToml>>,
    mask: Option<Spanned<MaskToml>>,
    albedo: Option<Spanned<ImageToml>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [[material]]")]
struct MaterialToml {
    name: Spanned<String>,
    fabric: Spanned<String>,
    variant: Option<String>,
    #[serde(default)]
    albedo: BTreeMap<Spanned<String>, Spanned<AlbedoToml>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [dots]")]
struct DotsToml {
    background: Spanned<String>,
    dots: Spanned<String>,
    spacing: Exactly<Spanned<f64>, 2>,
    radius: Spanned<f64>,
    #[serde(default)]
    staggered: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [stripes]")]
struct StripesToml {
    materials: Vec<Spanned<String>>,
    widths: Spanned<Vec<Spanned<f64>>>,
    across_deg: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [checks]")]
struct ChecksToml {
    materials: Exactly<Spanned<String>, 2>,
    size: Exactly<Spanned<f64>, 2>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [mask]")]
struct MaskToml {
    image: Spanned<String>,
    materials: Spanned<Vec<Spanned<String>>>,
    size: Exactly<Spanned<f64>, 2>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [albedo]")]
struct ImageToml {
    image: Spanned<String>,
    material: Spanned<String>,
    size: Exactly<Spanned<f64>, 2>,
    scale: Option<Spanned<f64>>,
    threads: Option<Vec<Spanned<String>>>,
}

/// More than any cloth has; keeps hostile files cheap.
const MAX_MATERIALS: usize = 64;
const MAX_STRIPES: usize = 4096;
/// Lengths in the plane.
const LENGTHS: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// A text, and what reads the files that it names.
struct Reader<'a> {
    source: Source<'a>,
    files: Files<'a>,
}

pub(super) fn parse(text: &str, file: &str, files: Files<'_>) -> Result<Pattern, PatternError> {
    let source = Source { file, text };
    if text.len() > MAX_TOML_BYTES {
        let message = format!(
            "{} bytes are more than any pattern has ({MAX_TOML_BYTES})",
            text.len()
        );
        return Err(source.error(0, None, message).into());
    }
    let raw: PatternToml = toml::from_str(text).map_err(|error| source.syntax_error(&error))?;
    let reader = Reader { source, files };
    let name = reader
        .source
        .name("name", raw.name.get_ref(), raw.name.span().start)?;
    let count = raw.material.get_ref().len();
    if count == 0 || count > MAX_MATERIALS {
        let message = format!("material: a pattern has 1 to {MAX_MATERIALS}, this one {count}");
        let at = raw.material.span().start;
        return Err(reader.source.error(at, Some("material"), message).into());
    }
    let mut materials: Vec<Material> = Vec::new();
    for entry in raw.material.get_ref() {
        let material = reader.material(entry)?;
        if materials.iter().any(|other| other.name == material.name) {
            let message = format!("name: two materials are called \"{}\"", material.name);
            let at = entry.name.span().start;
            return Err(reader.source.error(at, Some("name"), message).into());
        }
        materials.push(material);
    }
    let layout = reader.layout(&raw, &materials)?;
    let title = if raw.title.is_empty() {
        name.clone()
    } else {
        raw.title
    };
    Ok(Pattern::new([name, title, raw.source], materials, layout))
}

impl Reader<'_> {
    fn error(&self, at: usize, key: &str, message: String) -> PatternError {
        self.source.error(at, Some(key), message).into()
    }

    fn bytes(&self, key: &str, path: &Spanned<String>) -> Result<Vec<u8>, PatternError> {
        (self.files)(path.get_ref()).map_err(|source| PatternError::Unreadable {
            place: self
                .error(path.span().start, key, key.to_owned())
                .to_string(),
            file: path.get_ref().clone(),
            source,
        })
    }

    fn material(&self, raw: &MaterialToml) -> Result<Material, PatternError> {
        let name = self
            .source
            .name("name", raw.name.get_ref(), raw.name.span().start)?;
        let fabric = self.fabric(&raw.fabric, raw.variant.as_deref())?;
        let mut albedos = albedos(&fabric);
        for (thread, albedo) in &raw.albedo {
            let is_named = |other: &crate::fabric::Thread| other.name == *thread.get_ref();
            let Some(index) = fabric.visible_threads().position(is_named) else {
                let message = format!(
                    "albedo: {} has no visible thread \"{}\"",
                    fabric.name,
                    cut(thread.get_ref())
                );
                return Err(self.error(thread.span().start, "albedo", message));
            };
            let albedo = self.source.albedo("albedo", albedo)?;
            albedos[index] = albedo.map(|channel| channel as f32);
        }
        Ok(Material {
            name,
            fabric,
            albedos,
            bake: 0,
        })
    }

    /// A name of the library, or a file beside the pattern.
    fn fabric(
        &self,
        name: &Spanned<String>,
        variant: Option<&str>,
    ) -> Result<Fabric, PatternError> {
        if !name.get_ref().ends_with(".toml") {
            let name_in_library = variant.map_or_else(
                || name.get_ref().clone(),
                |variant| format!("{}-{variant}", name.get_ref()),
            );
            return Fabric::from_library(&name_in_library).ok_or_else(|| {
                let message = format!(
                    "fabric: the library has no \"{}\"; a file's name ends in .toml",
                    cut(&name_in_library)
                );
                self.error(name.span().start, "fabric", message)
            });
        }
        let bytes = self.bytes("fabric", name)?;
        let text = String::from_utf8(bytes).map_err(|_| {
            let message = format!("fabric: {} is not text", name.get_ref());
            self.error(name.span().start, "fabric", message)
        })?;
        Ok(Fabric::from_toml(&text, name.get_ref(), variant)?)
    }

    fn layout(&self, raw: &PatternToml, materials: &[Material]) -> Result<Layout, PatternError> {
        let index = |name: &Spanned<String>| {
            let found = materials.iter().position(|m| m.name == *name.get_ref());
            found.ok_or_else(|| {
                let message = format!("no material is called \"{}\"", cut(name.get_ref()));
                self.error(name.span().start, "material", message)
            })
        };
        let all =
            |names: &[Spanned<String>]| names.iter().map(index).collect::<Result<Vec<_>, _>>();
        let length = |key: &str, value: &Spanned<f64>| {
            let valid = |x: f64| LENGTHS.contains(&x);
            self.source
                .number(key, value, valid, "lie between 1e-9 and 1e9")
        };
        let size =
            |key: &str,
             Exactly([u, v]): &Exactly<Spanned<f64>, 2>|
             -> Result<[f64; 2], TextError> { Ok([length(key, u)?, length(key, v)?]) };
        let places = [
            raw.dots.as_ref().map(Spanned::span),
            raw.stripes.as_ref().map(Spanned::span),
            raw.checks.as_ref().map(Spanned::span),
            raw.mask.as_ref().map(Spanned::span),
            raw.albedo.as_ref().map(Spanned::span),
        ];
        let mut places = places.into_iter().flatten();
        if let (Some(_), Some(second)) = (places.next(), places.next()) {
            let message = "a pattern has one of dots, stripes, checks, mask and albedo".to_owned();
            return Err(self.error(second.start, "layout", message));
        }
        if let Some(raw) = &raw.dots {
            let raw = raw.get_ref();
            let spacing = size("spacing", &raw.spacing)?;
            let most = 0.5 * spacing[0].min(spacing[1]);
            return Ok(Layout::Dots {
                background: index(&raw.background)?,
                dots: index(&raw.dots)?,
                radius: self.source.number(
                    "radius",
                    &raw.radius,
                    |x| x > 0.0 && x <= most,
                    &format!("be above 0 and at most {most}, half the spacing"),
                )?,
                spacing,
                staggered: raw.staggered,
            });
        }
        if let Some(raw) = &raw.stripes {
            let raw = raw.get_ref();
            let widths = raw.widths.get_ref();
            let count = raw.materials.len();
            if count != widths.len() || count == 0 || count > MAX_STRIPES {
                let message = format!(
                    "widths: {count} materials (1 to {MAX_STRIPES}) need as many widths, there are {}",
                    widths.len()
                );
                return Err(self.error(raw.widths.span().start, "widths", message));
            }
            let mut ends = Vec::with_capacity(count);
            for width in widths {
                ends.push(ends.last().copied().unwrap_or(0.0) + length("widths", width)?);
            }
            let across = self.source.number(
                "across_deg",
                &raw.across_deg,
                |x| x.abs() <= 360.0,
                "lie between -360 and 360",
            )?;
            let (sin, cos) = across.to_radians().sin_cos();
            return Ok(Layout::Stripes {
                materials: all(&raw.materials)?,
                ends,
                across: [cos, sin],
            });
        }
        if let Some(raw) = &raw.checks {
            let raw = raw.get_ref();
            let Exactly([even, odd]) = &raw.materials;
            return Ok(Layout::Checks {
                materials: [index(even)?, index(odd)?],
                size: size("size", &raw.size)?,
            });
        }
        if let Some(raw) = &raw.mask {
            let raw = raw.get_ref();
            let materials = all(raw.materials.get_ref())?;
            if materials.is_empty() {
                let message = "materials: a mask chooses among at least one".to_owned();
                return Err(self.error(raw.materials.span().start, "materials", message));
            }
            return Ok(Layout::Mask {
                materials,
                size: size("size", &raw.size)?,
                image: self.image(&raw.image)?,
            });
        }
        if let Some(raw) = &raw.albedo {
            let raw = raw.get_ref();
            let material = index(&raw.material)?;
            let size = size("size", &raw.size)?;
            let scale = match &raw.scale {
                Some(scale) => self.source.number(
                    "scale",
                    scale,
                    |x| (0.0..=1000.0).contains(&x),
                    "lie between 0 and 1000",
                )?,
                None => 1.0,
            };
            let fabric = &materials[material].fabric;
            let mut threads = vec![raw.threads.is_none(); fabric.visible_threads().count()];
            for name in raw.threads.iter().flatten() {
                let mut visible = fabric.visible_threads();
                match visible.position(|thread| thread.name == *name.get_ref()) {
                    Some(thread) => threads[thread] = true,
                    None => {
                        let message = format!(
                            "threads: {} has no visible thread \"{}\"",
                            fabric.name,
                            cut(name.get_ref())
                        );
                        return Err(self.error(name.span().start, "threads", message));
                    }
                }
            }
            let image = self.image(&raw.image)?;
            let transfer = image.transfer();
            let image =
                image.map(|pixel| pixel.map(|x| (scale * transfer.linear(x.into())) as f32));
            let is_albedo = |x: &f32| limits::ALBEDO.contains(&f64::from(*x));
            if !image.pixels().iter().flatten().all(is_albedo) {
                let message = format!(
                    "image: albedos of {} × scale must lie between 0 and 1000",
                    raw.image.get_ref()
                );
                return Err(self.error(raw.image.span().start, "image", message));
            }
            return Ok(Layout::Albedo {
                image,
                material,
                size,
                threads,
            });
        }
        Ok(Layout::Plain)
    }

    fn image(&self, path: &Spanned<String>) -> Result<Image, PatternError> {
        let bytes = self.bytes("image", path)?;
        Image::from_bytes(&bytes).map_err(|why| {
            let message = format!("image: cannot read {}: {why}", path.get_ref());
            self.error(path.span().start, "image", message)
        })
    }
}

//! Patterns: which fabric, of which albedos, a cloth has at (u, v) (\[Fecho13\] 6.2).
//!
//! u runs along the warp (x) and v along the weft (y), in any unit. A pattern is a list of [`Material`]s and a layout of them
//! over the plane. Since tables hold no albedo, materials that differ in nothing else share a table: [`Pattern::bakes`] are the
//! fabrics that a pattern needs tables of, and [`Place::albedos`] what to evaluate them with.

mod image;
mod layout;
mod parse;

use std::io;

#[cfg(feature = "render")]
pub(crate) use image::decode as decode_image;
pub use image::{Image, MAX_IMAGE_BYTES, Transfer};
pub use parse::PatternError;

use crate::fabric::{Fabric, Thread};
use layout::Layout;

/// A cloth whose fabric or albedo changes from place to place.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    /// The name to call it by.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// Where it comes from.
    pub source: String,
    materials: Vec<Material>,
    layout: Layout,
    /// Materials whose fabrics stand for all that differ from them only in albedo.
    bakes: Vec<usize>,
}

/// One of the cloths of a pattern.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// What the pattern's text calls it.
    pub name: String,
    /// Its parameters; of the albedos only what is in `albedos` counts.
    pub fabric: Fabric,
    /// Albedo of each visible thread, linear RGB.
    pub albedos: Vec<[f32; 3]>,
    /// Which of [`Pattern::bakes`] is its table's fabric.
    pub bake: usize,
}

/// What a pattern is at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Place<'a> {
    /// The cloth there.
    pub material: &'a Material,
    /// Albedo of each visible thread, linear RGB: what evaluators take as `albedos`.
    pub albedos: Vec<[f32; 3]>,
}

/// Where a pattern's text finds what it names: bytes of a file whose path is relative to the pattern.
pub type Files<'a> = &'a dyn Fn(&str) -> io::Result<Vec<u8>>;

impl Pattern {
    /// Reads a pattern from TOML text. `file` names it in errors; fabrics and images that it names are read by `files`.
    ///
    /// # Errors
    /// What is wrong, with the line, in the pattern or in a file that it names.
    pub fn from_toml(text: &str, file: &str, files: Files<'_>) -> Result<Self, PatternError> {
        parse::parse(text, file, files)
    }

    fn new(
        [name, title, source]: [String; 3],
        mut materials: Vec<Material>,
        layout: Layout,
    ) -> Self {
        let mut bakes: Vec<usize> = Vec::new();
        for index in 0..materials.len() {
            let fabric = &materials[index].fabric;
            let same = |bake: &usize| materials[*bake].fabric.is_dyed_like(fabric);
            let bake = bakes.iter().position(same).unwrap_or(bakes.len());
            if bake == bakes.len() {
                bakes.push(index);
            }
            materials[index].bake = bake;
        }
        Self {
            name,
            title,
            source,
            materials,
            layout,
            bakes,
        }
    }

    /// The cloths that it is made of.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The fabrics that it needs tables of: one for all materials that differ only in albedo.
    pub fn bakes(&self) -> impl ExactSizeIterator<Item = &Fabric> {
        self.bakes
            .iter()
            .map(|index| &self.materials[*index].fabric)
    }

    /// How far it is until the pattern repeats along both u and v, the longer where these differ; `None` if it is the same
    /// everywhere.
    pub fn period(&self) -> Option<f64> {
        self.layout.period()
    }

    /// The cloth at (u, v). Never fails: what is no number counts as 0.
    pub fn at(&self, u: f64, v: f64) -> Place<'_> {
        let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
        let (index, dye) = self.layout.at(finite(u), finite(v));
        let material = &self.materials[index];
        let mut albedos = material.albedos.clone();
        if let Some(dye) = dye {
            for (albedo, is_dyed) in albedos.iter_mut().zip(&dye.threads) {
                if *is_dyed {
                    *albedo = dye.albedo;
                }
            }
        }
        Place { material, albedos }
    }
}

/// Albedo of every visible thread.
fn albedos(fabric: &Fabric) -> Vec<[f32; 3]> {
    let single = |thread: &Thread| thread.albedo.map(|channel| channel as f32);
    fabric.visible_threads().map(single).collect()
}

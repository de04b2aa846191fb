//! How an evaluator looks: its pictures against those of direct integration.

use serde::{Deserialize, Serialize};

use super::candidate::Candidate;
use crate::evaluator::Evaluator;
use crate::fabric::Fabric;
use crate::model::Rule;
use crate::progress::{Cancelled, Progress};
use crate::render::{Cloth, Comparison, Light, Picture, Shape, View, compare, render};

/// The light is at the viewer, as the thesis has it.
const LIGHTS: &[Light] = &[Light::of([0.0, 0.0, 1.0])];
/// More than enough for what eyes tell apart: its error is a few hundredths of a percent.
const TRUTH: Rule = Rule::Quadrature(24);

/// How far pictures of an evaluator are from those of direct integration, lit from where they are seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Looks {
    /// On the sphere.
    pub sphere: Look,
    /// On the cylinders.
    pub cylinders: Look,
}

/// How far a picture is from the truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// Mean FLIP of what is covered.
    pub flip: f64,
    /// Mean relative error of its pixels, [`Comparison::mean_relative_error`].
    pub error: f64,
}

impl Look {
    fn of(comparison: &Comparison) -> Self {
        Self {
            flip: comparison.flip_mean,
            error: comparison.mean_relative_error,
        }
    }
}

/// The pictures of direct integration.
pub(super) struct Truths {
    size: usize,
    sphere: Picture,
    cylinders: Picture,
}

impl Truths {
    /// Pictures of that many rows.
    pub(super) fn new(
        fabric: &Fabric,
        size: usize,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let cloth = Cloth::from(Evaluator::rule(fabric, TRUTH));
        Ok(Self {
            size,
            sphere: picture(Shape::Sphere, &cloth, size, progress.part(0.0, 0.9))?,
            cylinders: picture(Shape::Cylinders, &cloth, size, progress.part(0.9, 1.0))?,
        })
    }

    /// How far the pictures of an evaluator are from these.
    pub(super) fn looks(&self, candidate: &Candidate) -> Result<Looks, Cancelled> {
        let cloth = Cloth::from(candidate.evaluator.clone());
        let look = |shape: Shape, truth: &Picture| {
            let picture = picture(shape, &cloth, self.size, Progress::silent())?;
            Ok(Look::of(&compare(&picture, truth, 0.0)))
        };
        Ok(Looks {
            sphere: look(Shape::Sphere, &self.sphere)?,
            cylinders: look(Shape::Cylinders, &self.cylinders)?,
        })
    }
}

fn picture(
    shape: Shape,
    cloth: &Cloth,
    size: usize,
    progress: Progress<'_>,
) -> Result<Picture, Cancelled> {
    let view = View {
        size,
        samples: 1,
        lights: LIGHTS,
        repeats: 1.0,
    };
    render(&shape, cloth, &view, progress)
}

//! The models that the microcylinder is compared with, by name.

use super::{IrawanMarschner, Model, SpineError};
use crate::fabric::Models;
use crate::math::Real;

/// Which model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[expect(missing_docs, reason = "the names say it")]
pub enum ModelKind {
    Lambert,
    OrenNayar,
    TorranceSparrow,
    Irawan,
}

impl ModelKind {
    /// All of them, from the simplest on.
    pub const ALL: [Self; 4] = [
        Self::Lambert,
        Self::OrenNayar,
        Self::TorranceSparrow,
        Self::Irawan,
    ];

    /// What the tool calls it: `oren-nayar`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lambert => "lambert",
            Self::OrenNayar => "oren-nayar",
            Self::TorranceSparrow => "torrance-sparrow",
            Self::Irawan => "irawan",
        }
    }

    /// The one of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The model with its parameters, if there are any.
    ///
    /// # Errors
    /// When these are Irawan's and a yarn has no spine, which files are checked for.
    pub fn prepare<R: Real>(
        self,
        models: &Models,
    ) -> Result<Option<Box<dyn Model<R> + Send>>, SpineError> {
        fn boxed<R: Real>(model: impl Model<R> + Send + 'static) -> Box<dyn Model<R> + Send> {
            Box::new(model)
        }
        Ok(match self {
            Self::Lambert => models.lambert.map(boxed),
            Self::OrenNayar => models.oren_nayar.map(boxed),
            Self::TorranceSparrow => models.torrance_sparrow.map(boxed),
            Self::Irawan => match &models.irawan {
                Some(parameters) => Some(boxed(IrawanMarschner::<R>::new(parameters)?)),
                None => None,
            },
        })
    }
}

//! What is asked of a bake.

use super::{Budget, Preset, Scope, Settings};

/// What to bake of a fabric, and how.
///
/// From a [`Preset`] or [`Settings`] alone it is everything, as set; with more, as
/// `Request { goal: Goal::Promise, ..Preset::Draft.into() }`.
#[derive(Debug, Clone)]
pub struct Request<'a> {
    /// How to bake.
    pub settings: Settings,
    /// What to reach by other settings, if these do not.
    pub goal: Goal,
    /// What the table will be asked for.
    pub scope: Scope<'a>,
}

/// What a table is to reach.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Goal {
    /// Whatever comes of the settings.
    #[default]
    AsSet,
    /// What the settings' preset promises; by other means, if need be ([`Adapted`](super::Adapted)).
    Promise,
    /// The cheapest table within a budget. What settings say of size and error is not used.
    Within(Budget),
}

impl From<Settings> for Request<'_> {
    fn from(settings: Settings) -> Self {
        Self {
            settings,
            goal: Goal::default(),
            scope: Scope::default(),
        }
    }
}

impl From<&Settings> for Request<'_> {
    fn from(settings: &Settings) -> Self {
        settings.clone().into()
    }
}

impl From<Preset> for Request<'_> {
    fn from(preset: Preset) -> Self {
        preset.settings().into()
    }
}

//! Fabrics to tables.
//!
//! [`bake`] makes one table of a fabric, a [`Baker`] any number of them. What to bake is a [`Request`]: [`Settings`], ready-made as
//! [`Preset`]s; a [`Goal`] that other settings may reach where these do not; and a [`Scope`].
//!
//! Per thread: how its segments are evaluated is chosen (`choose`), the knots of a grid are placed (`plan`), the segments'
//! mean response integrated at its sites (`integrate`) and stored (`encode`). Then the table's error is measured by the protocol of
//! [`crate::metrics`] and written into it, together with everything that made it. What depends on neither size nor error is found once
//! (`survey`).

mod baker;
mod budget;
mod choose;
#[doc(hidden)]
pub mod enclosure;
mod encode;
mod forecast;
mod integrate;
mod plan;
mod price;
mod promise;
mod provenance;
mod request;
mod sampling;
mod scope;
mod settings;
mod size;
mod survey;

pub use baker::{Baked, Baker, bake};
pub use budget::{Budget, Cost};
pub use choose::{Choice, Direct, RimChoice};
pub use forecast::{Forecast, GridForecast, Projection, ThreadForecast, forecast};
pub use price::For;
pub use promise::{Adapted, Promise};
pub use provenance::{FabricText, Provenance};
pub use request::{Goal, Request};
pub use scope::{Scope, ScopeNote};
pub use settings::{Preset, Settings};
pub use size::{size_name, size_named};

use crate::progress::Cancelled;

/// Why there is no table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The caller wants it no more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A fabric's fields were changed, but not the text that would be recorded as what made the table.
    #[error(
        "the parameters of {0} are not those of its TOML text; change the text and read it again"
    )]
    TextDiffers(String),
    /// There is no pair of directions to bake.
    #[error("nothing ever asks for {0}: there is no table to bake")]
    NotNeeded(String),
}

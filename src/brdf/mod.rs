//! Closed forms of the Sadeghi microcylinder: what is known of a thread without integrating over its tangents.
//!
//! The table lookup multiplies by them, the direct evaluators integrate them, so they stand below both.
//!
//! Sources, cited by key throughout the crate:
//!
//! - **\[Fecho13\]** M. Fecho, *An Evaluation of Appearance Models for Cloth Rendering*, MSc thesis, UC San Diego, 2013.
//! - **\[SBDJ13\]** I. Sadeghi, O. Bisker, J. De Deken, H. W. Jensen, *A Practical Microcylinder Appearance Model for
//!   Cloth Rendering*, ACM Transactions on Graphics 32(2), 2013.

mod cylinder;
mod frame;
pub mod limits;
mod placed;
mod psi;
mod tangent;
mod weave;

pub use cylinder::{Optics, Response};
#[doc(hidden)]
pub use cylinder::{ThreadPair, fresnel};
pub use frame::ThreadFrame;
pub(crate) use placed::{PlacedNodes, SharedNodes};
pub use tangent::{Reweighting, Segment, TangentCurve, Tilt};
pub(crate) use tangent::{projection_of_arcs, projection_of_tilts};
pub use weave::{Components, ThreadResponse};
pub(crate) use weave::{Weave, without_cosine};

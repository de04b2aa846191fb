//! What to bake.
use crate::chart::Chart;
use crate::table::{Encoding, Interpolation};

/// settings
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "trial")]
pub struct Settings {
    pub chart: Chart,
    pub encoding: Encoding,
    pub interpolation: [Interpolation; 4],
    /// Most nodes of a thread.
    pub max_nodes: usize,
    pub target_error: f64,
    pub tolerance: f64,
}

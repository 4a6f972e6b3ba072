//! Report of loading a scene.

use serde::{Deserialize, Serialize};

/// Faults and approximations while a scene was loaded: counted, shown and recorded.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LoadReport {
    /// Triangles dropped because a vertex was NaN or infinite.
    pub dropped_non_finite: usize,
    /// Triangles of zero area: they stay, but can never be hit.
    pub zero_area: usize,
    /// Everything else worth a line (missing texture, material approximated as diffuse, …).
    pub warnings: Vec<String>,
}

impl LoadReport {
    /// Every deviation of the scene from its file, one readable line each.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = match self.dropped_non_finite {
            0 => Vec::new(),
            1 => vec!["1 triangle dropped: a vertex is not finite".to_owned()],
            n => vec![format!("{n} triangles dropped: a vertex is not finite")],
        };
        lines.extend_from_slice(&self.warnings);
        lines
    }
}

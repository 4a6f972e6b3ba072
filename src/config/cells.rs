//! The cells of a plan.

use crate::params::Variant;
use std::fmt;

/// A structure on a scene: built, gated and timed with the recorded rays.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureCell {
    /// What is traced.
    pub scene: Variant,
    /// The structure; its label ends with the kernels', unless they are the embedded ones.
    pub accel: Variant,
    /// The kernels.
    pub kernels: Variant,
}

/// A sampler on a scene: its error is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplerCell {
    /// What is traced.
    pub scene: Variant,
    /// What is computed.
    pub integrator: Variant,
    /// The sequence.
    pub sequence: Variant,
    /// The decorrelation; its label ends with the kernels', unless they are the embedded ones.
    pub decorrelation: Variant,
    /// The kernels.
    pub kernels: Variant,
    /// Whether each seed gives another image.
    pub randomised: bool,
    /// Renders needed: all replicates, or one if the sampler is deterministic.
    pub replicates: u32,
}

/// A full cell: its time is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeCell {
    /// What is traced.
    pub scene: Variant,
    /// The structure; its label ends with the kernels', unless they are the embedded ones.
    pub accel: Variant,
    /// The sequence.
    pub sequence: Variant,
    /// The decorrelation, labelled as the structure.
    pub decorrelation: Variant,
    /// What is computed.
    pub integrator: Variant,
    /// The kernels.
    pub kernels: Variant,
}

/// A sampler's stream: its star discrepancy is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamCell {
    /// The sequence.
    pub sequence: Variant,
    /// The decorrelation; its label ends with the kernels', unless they are the embedded ones.
    pub decorrelation: Variant,
    /// The kernels.
    pub kernels: Variant,
    /// Whether each seed gives another point set.
    pub randomised: bool,
}

impl fmt::Display for StructureCell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.scene, self.accel)
    }
}

impl fmt::Display for SamplerCell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            scene,
            integrator,
            sequence,
            decorrelation,
            ..
        } = self;
        write!(f, "{scene}, {integrator}, {sequence} × {decorrelation}")
    }
}

impl fmt::Display for TimeCell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            scene,
            accel,
            sequence,
            decorrelation,
            integrator,
            ..
        } = self;
        write!(
            f,
            "{scene}, {accel}, {integrator}, {sequence} × {decorrelation}"
        )
    }
}

impl fmt::Display for StreamCell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} × {}", self.sequence, self.decorrelation)
    }
}

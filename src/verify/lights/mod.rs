//! The checks of each light kind, one file per kind.

mod delta;
pub(crate) mod environment;
pub(crate) mod flat;
mod ies;
pub(crate) mod sphere;

use crate::known_images::KnownImage;
use crate::mitsuba::{Export, ExportError};
use crate::path_oracle::{LightSample, Rounding};
use crate::trial_scenes::TrialScene;
use glam::DVec3;
use raystone_core::params::{Kinds, Named, Sources};
use raystone_scene::{Light, LightKind, SceneError};

/// How a point of a light is sampled in f64.
#[derive(Clone, Copy)]
pub enum LightTwin {
    /// On triangles of an emissive material.
    Surface,
    /// From the light alone, for a position and two numbers in [0, 1); `None` if no light arrives.
    Alone(fn(&Light, DVec3, [f64; 2], &mut Rounding) -> Option<LightSample>),
    /// In a map around the scene.
    Map,
}

/// The checks of one light kind.
pub struct LightChecks {
    /// The kind.
    pub kind: &'static LightKind,
    /// Its formulas in f64.
    pub twin: LightTwin,
    /// Export to Mitsuba.
    pub mitsuba: ToMitsuba,
    /// Lights of this kind in the trial scene `points`.
    pub points: fn() -> Vec<Light>,
    /// Additional trial scenes, used to check paths of every scene with such a light.
    pub trials: fn() -> Result<Vec<TrialScene>, SceneError>,
    /// Additional known images.
    pub images: fn() -> Result<Vec<KnownImage>, SceneError>,
}

/// Writes the light with this index for Mitsuba, or fails with [`ExportError::Light`].
pub type ToMitsuba = fn(&mut Export<'_>, usize, &Light) -> Result<(), ExportError>;

impl LightChecks {
    /// A kind without trial scenes or images.
    pub const fn new(kind: &'static LightKind, twin: LightTwin, mitsuba: ToMitsuba) -> Self {
        Self {
            kind,
            twin,
            mitsuba,
            points: Vec::new,
            trials: || Ok(Vec::new()),
            images: || Ok(Vec::new()),
        }
    }
}

/// The registered kinds.
pub type LightRegistry = Kinds<LightChecks>;

impl Named for LightChecks {
    fn built_in() -> Vec<&'static Self> {
        vec![
            &flat::TRIANGLES,
            &flat::PARALLELOGRAMS,
            &sphere::CHECKS,
            &delta::POINTS,
            &delta::SPOTS,
            &ies::CHECKS,
            &delta::DIRECTIONAL,
            &environment::CHECKS,
        ]
    }

    fn name(&self) -> &'static str {
        self.kind.name
    }

    fn description(&self) -> &'static str {
        self.kind.description
    }

    fn sources(&self) -> Sources {
        self.kind.sources
    }
}

//! What checks know of each kind of light: one row, in a file of its own.

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

/// How a point of a light is found in f64.
#[derive(Clone, Copy)]
pub enum LightTwin {
    /// On triangles of a material that emits.
    Surface,
    /// By the light alone, from a place, by two numbers in [0, 1); nothing if no light arrives.
    Alone(fn(&Light, DVec3, [f64; 2], &mut Rounding) -> Option<LightSample>),
    /// In a map around the scene.
    Map,
}

/// What checks know of a kind of light.
pub struct LightChecks {
    /// The kind.
    pub kind: &'static LightKind,
    /// Its formulas in f64.
    pub twin: LightTwin,
    /// The light in Mitsuba.
    pub mitsuba: ToMitsuba,
    /// Those that shine in the trial scene `points`.
    pub points: fn() -> Vec<Light>,
    /// Trial scenes of its own, on which paths of every scene with such a light are checked, too.
    pub trials: fn() -> Result<Vec<TrialScene>, SceneError>,
    /// Known images of its own.
    pub images: fn() -> Result<Vec<KnownImage>, SceneError>,
}

/// Writes the light of this number for Mitsuba, or says with [`ExportError::Light`] why it cannot be.
pub type ToMitsuba = fn(&mut Export<'_>, usize, &Light) -> Result<(), ExportError>;

impl LightChecks {
    /// A kind that nothing shows yet.
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

/// The rows of all kinds.
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

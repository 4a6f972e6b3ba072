//! What checks know of each kind of light: one row, in a file of its own.

pub(crate) mod environment;
pub(crate) mod flat;
mod ies;
mod point;
pub(crate) mod sphere;

use crate::known_images::KnownImage;
use crate::mitsuba::{Export, ExportError};
use crate::path_oracle::{LightSample, Rounding, around};
use crate::trial_scenes::TrialScene;
use glam::{DVec3, Vec3};
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
    /// Writes the light of this number for Mitsuba.
    ///
    /// # Errors
    /// [`ExportError::Light`]: Mitsuba has no counterpart.
    pub mitsuba: fn(&mut Export<'_>, usize, &Light) -> Result<(), ExportError>,
    /// Those that shine in the trial scene `points`.
    pub points: fn() -> Vec<Light>,
    /// Trial scenes of its own, on which paths of every scene with such a light are checked, too.
    pub trials: fn() -> Result<Vec<TrialScene>, SceneError>,
    /// Known images of its own.
    pub images: fn() -> Result<Vec<KnownImage>, SceneError>,
}

/// The rows of all kinds.
pub type LightRegistry = Kinds<LightChecks>;

impl Named for LightChecks {
    fn built_in() -> Vec<&'static Self> {
        vec![
            &flat::TRIANGLES,
            &flat::PARALLELOGRAMS,
            &sphere::CHECKS,
            &point::POINTS,
            &point::SPOTS,
            &ies::CHECKS,
            &point::DIRECTIONAL,
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

/// Distance of what has none.
const FAR: f64 = 1e30;

/// What arrives along one direction, if anything does.
fn delta(direction: DVec3, distance: f64, radiance: DVec3) -> Option<LightSample> {
    (radiance.max_element() > 0.0).then_some(LightSample {
        direction,
        distance,
        radiance,
        density: None,
        triangles: None,
    })
}

/// The unit direction to a place, and how far it is.
fn towards(place: Vec3, from: DVec3) -> (DVec3, f64) {
    let to_light = place.as_dvec3() - from;
    (to_light.normalize(), to_light.length())
}

fn no_lights() -> Vec<Light> {
    Vec::new()
}

fn no_images() -> Result<Vec<KnownImage>, SceneError> {
    Ok(Vec::new())
}

fn no_trials() -> Result<Vec<TrialScene>, SceneError> {
    Ok(Vec::new())
}

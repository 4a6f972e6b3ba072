//! What checks know of each kind of material: one row, in a file of its own.

mod cook_torrance;
mod dielectric;
mod diffuse;
mod mirror;
mod phong;
mod principled;

use crate::known_images::KnownImage;
use crate::mesh::Mesh;
use crate::mitsuba::{Color, by_formula};
use crate::path_oracle::bsdf::*;
use crate::path_oracle::{Rounding, Surface, luminance};
use crate::trial_scenes::TrialScene;
use glam::{DVec3, Vec3, vec3};
use raystone_core::params::{Kinds, Named, Sources};
use raystone_scene::{Material, MaterialKind, SceneError};
use std::f64::consts::{PI, TAU};

pub(crate) use diffuse::CHECKS as DIFFUSE_CHECKS;
pub(crate) use principled::CHECKS as PRINCIPLED_CHECKS;

/// The formulas of a kind in f64, at a point.
pub type Twin = for<'a> fn(&'a Surface<'a>) -> Box<dyn Bsdf + 'a>;

/// What checks know of a kind of material.
pub struct MaterialChecks {
    /// The kind.
    pub kind: &'static MaterialKind,
    /// Its formulas in f64.
    pub twin: Twin,
    /// A material as an element of a Mitsuba scene with this attribute: `id="…"`, or nothing. What Mitsuba draws otherwise is said in
    /// the last argument.
    pub mitsuba: fn(&Material, &Color, &str, &mut Vec<String>) -> String,
    /// Python that teaches Mitsuba the kind after `mitsuba/opaque.py`; empty where it knows it.
    pub python: &'static str,
    /// What balls of the trial scene `glossy` are made of, and the places where they stand: those without one stand last.
    pub balls: fn() -> Vec<(Option<usize>, Material)>,
    /// What planes of the known image `materials` are made of.
    pub planes: fn() -> Vec<(&'static str, Material)>,
    /// Trial scenes of its own.
    pub trials: fn() -> Result<Vec<TrialScene>, SceneError>,
    /// Known images of its own.
    pub images: fn() -> Result<Vec<KnownImage>, SceneError>,
}

impl MaterialChecks {
    /// A kind that nothing shows yet.
    pub const fn new(
        kind: &'static MaterialKind,
        twin: Twin,
        mitsuba: fn(&Material, &Color, &str, &mut Vec<String>) -> String,
    ) -> Self {
        Self {
            kind,
            twin,
            mitsuba,
            python: "",
            balls: Vec::new,
            planes: Vec::new,
            trials: || Ok(Vec::new()),
            images: || Ok(Vec::new()),
        }
    }
}

/// The rows of all kinds.
pub type MaterialRegistry = Kinds<MaterialChecks>;

impl Named for MaterialChecks {
    fn built_in() -> Vec<&'static Self> {
        vec![
            &diffuse::CHECKS,
            &phong::CHECKS,
            &cook_torrance::CHECKS,
            &principled::CHECKS,
            &mirror::CHECKS,
            &dielectric::CHECKS,
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

/// Parameter number `place` of a material; 0 where it has none.
fn number(material: &Material, place: usize) -> f32 {
    material.parameters.get(place).copied().unwrap_or_default()
}

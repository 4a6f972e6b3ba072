//! The checks of each material kind, one file per kind.

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

/// Builds the f64 formulas of a kind at a point.
pub type Twin = for<'a> fn(&'a Surface<'a>) -> Box<dyn Bsdf + 'a>;

/// The checks of one material kind.
pub struct MaterialChecks {
    /// The kind.
    pub kind: &'static MaterialKind,
    /// Its formulas in f64.
    pub twin: Twin,
    /// A material as an element of a Mitsuba scene with this attribute: `id="…"`, or nothing.
    /// Differences in what Mitsuba renders are appended to the last argument.
    pub mitsuba: fn(&Material, &Color, &str, &mut Vec<String>) -> String,
    /// Python that defines the kind for Mitsuba, after `mitsuba/opaque.py`; empty if built in.
    pub python: &'static str,
    /// Materials for the balls of the trial scene `glossy`, with positions; `None` comes last.
    pub balls: fn() -> Vec<(Option<usize>, Material)>,
    /// Materials for the planes of the known image `materials`.
    pub planes: fn() -> Vec<(&'static str, Material)>,
    /// Additional trial scenes.
    pub trials: fn() -> Result<Vec<TrialScene>, SceneError>,
    /// Additional known images.
    pub images: fn() -> Result<Vec<KnownImage>, SceneError>,
}

impl MaterialChecks {
    /// A kind without trial scenes or images.
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

/// The registered kinds.
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

/// Parameter number `place` of a material; 0 if it has none.
fn number(material: &Material, place: usize) -> f32 {
    material.parameters.get(place).copied().unwrap_or_default()
}

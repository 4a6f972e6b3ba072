//! `raystone trace`.

use super::arguments::{ValueArguments, of_flags, on_axis, one_cell, warn_of};
use super::failure::ended;
use super::output::print;
use anyhow::{Result, anyhow};
use clap::Args;
use raystone::accel::{Ray, TriangleSoup};
use raystone::config::{Axis, Cell};
use raystone::params::Variant;
use raystone::run::Registries;
use raystone::scene::{LoadOptions, SceneData, load};
use raystone::stress::case::Address;
use raystone::stress::explain::{explain, scene_of};
use std::process::ExitCode;

/// Show what a structure does with one ray: every node visited and triangle tested, on the host
#[derive(Args)]
pub struct Trace {
    /// The ray: origin, direction, t_min and t_max, eight numbers; the first six mean the whole line
    #[arg(
        long,
        value_name = "OX OY OZ DX DY DZ TMIN TMAX",
        allow_hyphen_values = true
    )]
    ray: String,
    /// Built-in scene, path of a model, or a case of the suite: stress:FAMILY:LABEL:SEED
    #[arg(long)]
    scene: String,
    /// Structure
    #[arg(long, default_value = "bvh")]
    accel: String,
    /// Triangle test [default: the one of runs]
    #[arg(long)]
    triangle: Option<String>,
    /// Box test [default: the one of runs]
    #[arg(long)]
    box_test: Option<String>,
    #[command(flatten)]
    values: ValueArguments,
}

impl Trace {
    pub fn execute(self) -> Result<ExitCode> {
        let ray = self.ray.parse::<Ray>().map_err(|e| anyhow!("--ray: {e}"))?;
        let registries = Registries::default();
        let cell = self.cell(&registries)?;
        let scene = self.load(&cell[Axis::Scene])?;
        let tests = registries.intersection(&cell).map_err(|e| anyhow!(e))?;
        let soup = TriangleSoup::new(&scene).intersecting(tests);
        let accel = &cell[Axis::Accel];
        let kind = registries.accel.named("structure", &accel.name);
        let kind = kind.map_err(|e| anyhow!(e))?;
        let explained = explain(&scene, &soup, kind, &accel.params, &ray);
        let (text, equal) = explained.map_err(|e| anyhow!(e))?;
        print(&text)?;
        Ok(ended(equal))
    }

    /// Reads scene, structure and tests with their parameters, as those of an experiment file.
    fn cell(&self, registries: &Registries) -> Result<Cell> {
        // A case of the suite is no scene of an experiment; the cell then has the default one.
        let scene = Address::parse(&self.scene).is_none().then_some(&self.scene);
        let flags = [
            on_axis(Axis::Scene, scene),
            on_axis(Axis::Accel, [&self.accel]),
            on_axis(Axis::Triangle, &self.triangle),
            on_axis(Axis::BoxTest, &self.box_test),
        ];
        let flags = flags.into_iter().flatten();
        one_cell(&of_flags("trace", flags, &self.values.set, registries)?)
    }

    fn load(&self, variant: &Variant) -> Result<SceneData> {
        if let Some(address) = Address::parse(&self.scene) {
            return scene_of(&address).map_err(|e| anyhow!("--scene: {e}"));
        }
        let options = LoadOptions {
            textures: false,
            allow_outside: self.values.allow_outside,
            ..LoadOptions::default()
        };
        let scene = load(variant, &options)?;
        warn_of(&scene);
        Ok(scene)
    }
}

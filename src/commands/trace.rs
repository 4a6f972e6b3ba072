//! `raystone trace`.

use super::arguments::{ValueArguments, list_override, warn_of};
use super::failure::FAILED;
use super::output::print;
use anyhow::{Result, anyhow};
use clap::Args;
use raystone::accel::{Ray, TriangleSoup};
use raystone::config::{Axis, Catalogue, Cell, Experiment, Plan};
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
        Ok(match equal {
            true => ExitCode::SUCCESS,
            false => ExitCode::from(FAILED),
        })
    }

    /// Scene, structure and tests with their parameters, read as those of an experiment file.
    fn cell(&self, registries: &Registries) -> Result<Cell> {
        let catalogue = registries.catalogue();
        // A case of the suite is no scene of an experiment; any other one stands in its place there.
        let scene = match Address::parse(&self.scene) {
            Some(_) => "cornell-box".to_owned(),
            None => self.scene.clone(),
        };
        let tests = [("triangle", &self.triangle), ("box_test", &self.box_test)];
        let tests = tests
            .into_iter()
            .filter_map(|(axis, name)| Some((axis, name.as_ref()?)));
        let named = [("scene", &scene), ("accel", &self.accel)]
            .into_iter()
            .chain(tests);
        let one = |(axis, name): (&str, &String)| {
            list_override(&format!("axes.{axis}"), std::slice::from_ref(name))
        };
        let mut overrides: Vec<String> = named.map(one).collect();
        overrides.extend(self.values.set.iter().cloned());
        let experiment =
            Experiment::parse(&text(&catalogue), "raystone trace", &overrides, &catalogue)?;
        let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d))?;
        let cell = plan.structures.into_iter().next();
        cell.ok_or_else(|| anyhow!("--set leaves no scene or no structure"))
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

/// An experiment with everything but scene and structure.
fn text(catalogue: &Catalogue) -> String {
    let sequence = catalogue[Axis::Sequence]
        .first()
        .map(|entry| entry.name.as_str());
    format!(
        "[run]\nname = \"trace\"\n[axes]\nsequence = {}\n",
        toml::Value::from(sequence.unwrap_or_default()),
    )
}

//! `raystone trace`.

use super::arguments::{list_override, warn_of};
use super::failure::FAILED;
use super::output::print;
use anyhow::{Result, anyhow};
use clap::Args;
use raystone::accel::triangle::TriangleTest;
use raystone::accel::{BoxTest, Intersection, TriangleSoup};
use raystone::config::{Catalogue, Experiment, Plan};
use raystone::params::Variant;
use raystone::run::Registries;
use raystone::scene::{LoadOptions, SceneData, load};
use raystone::stress::case::{Address, parse_ray};
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
    /// Let a glTF model name files outside its folder, and an OBJ model absolute paths
    #[arg(long)]
    allow_outside: bool,
    /// Parameter as in an experiment file: `--set accel.bvh.traversal=short-stack`
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Trace {
    pub fn execute(self) -> Result<ExitCode> {
        let ray = parse_ray(&self.ray).map_err(|e| anyhow!("--ray: {e}"))?;
        let registries = Registries::default();
        let (scene, accel) = self.variants(&registries)?;
        let scene = self.load(&scene)?;
        let soup = TriangleSoup::new(&scene).intersecting(self.intersection()?);
        let kind = registries
            .accel
            .get(&accel.name)
            .ok_or_else(|| anyhow!("no structure `{}`", accel.name))?;
        let explained = explain(&scene, &soup, kind, &accel.params, &ray);
        let (text, equal) = explained.map_err(|e| anyhow!(e))?;
        print(&text)?;
        Ok(match equal {
            true => ExitCode::SUCCESS,
            false => ExitCode::from(FAILED),
        })
    }

    fn intersection(&self) -> Result<Intersection> {
        let unknown = |what: &str, name: &str, known: Vec<&str>| {
            anyhow!("--{what}: no `{name}`; there are: {}", known.join(", "))
        };
        let mut tests = Intersection::default();
        if let Some(name) = &self.triangle {
            let known = || TriangleTest::ALL.map(TriangleTest::name).to_vec();
            tests.triangle =
                TriangleTest::named(name).ok_or_else(|| unknown("triangle", name, known()))?;
        }
        if let Some(name) = &self.box_test {
            let known = || BoxTest::ALL.map(|(_, name, _)| name).to_vec();
            tests.box_test =
                BoxTest::named(name).ok_or_else(|| unknown("box-test", name, known()))?;
        }
        Ok(tests)
    }

    /// Scene and structure with their parameters, read as those of an experiment file.
    fn variants(&self, registries: &Registries) -> Result<(Variant, Variant)> {
        let catalogue = registries.catalogue();
        // A case of the suite is no scene of an experiment; any other one stands in its place there.
        let scene = match Address::parse(&self.scene) {
            Some(_) => "cornell-box".to_owned(),
            None => self.scene.clone(),
        };
        let mut overrides = vec![
            list_override("axes.scene", &[scene]),
            list_override("axes.accel", std::slice::from_ref(&self.accel)),
        ];
        overrides.extend(self.set.iter().cloned());
        let experiment =
            Experiment::parse(&text(&catalogue), "raystone trace", &overrides, &catalogue)?;
        let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d))?;
        match (plan.scenes.first(), plan.structures.first()) {
            (Some(scene), Some(cell)) => Ok((scene.clone(), cell.accel.clone())),
            _ => Err(anyhow!("--set leaves no scene or no structure")),
        }
    }

    fn load(&self, variant: &Variant) -> Result<SceneData> {
        if let Some(address) = Address::parse(&self.scene) {
            return scene_of(&address).map_err(|e| anyhow!("--scene: {e}"));
        }
        let options = LoadOptions {
            textures: false,
            allow_outside: self.allow_outside,
            ..LoadOptions::default()
        };
        let scene = load(variant, &options)?;
        warn_of(&scene);
        Ok(scene)
    }
}

/// An experiment with everything but scene and structure.
fn text(catalogue: &Catalogue) -> String {
    let sequence = catalogue.sequence.first().map(|entry| entry.name.as_str());
    format!(
        "[run]\nname = \"trace\"\n[axes]\nsequence = {}\n",
        toml::Value::from(sequence.unwrap_or_default()),
    )
}

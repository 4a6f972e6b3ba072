//! `raystone export-mitsuba`.

use super::arguments::{ValueArguments, list_override, warn_of};
use super::output::{print, warn};
use anyhow::{Result, anyhow};
use clap::Args;
use raystone::config::{Axis, Experiment};
use raystone::measure::mitsuba::{MITSUBA_FILE, MitsubaSettings, export_mitsuba};
use raystone::run::Registries;
use raystone::scene::{LoadOptions, load};
use std::path::PathBuf;
use std::process::ExitCode;

/// What `raystone render` takes where nothing is said: both programs then make the same picture.
const DEFAULTS: &str = r#"
[run]
name = "export"
resolution = [512, 384]
spp = { pow2 = [6, 6] }
[axes]
scene = ["cornell-box"]
accel = ["bvh"]
sequence = ["sobol"]
integrator = ["path"]
"#;

/// Write a scene for the renderer Mitsuba 3, with the camera and the path depth of `render`
///
/// Meshes are written as PLY, textures as PNG or EXR. `mitsuba FOLDER/scene.xml -D spp=256` renders it.
#[derive(Args)]
pub struct ExportMitsuba {
    /// Built-in scene or path of a model
    scene: String,
    /// Folder to write into; made if it is missing
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Width and height, pixels [default: 512x384]
    #[arg(long, value_name = "WxH", value_parser = super::render::parse_size)]
    size: Option<[u32; 2]>,
    /// Leave out the backs of emitters: for scenes in which nothing sees them
    #[arg(long)]
    fronts_only: bool,
    #[command(flatten)]
    values: ValueArguments,
}

impl ExportMitsuba {
    pub fn execute(self) -> Result<ExitCode> {
        let registries = Registries::default();
        let mut overrides = vec![list_override(
            "axes.scene",
            std::slice::from_ref(&self.scene),
        )];
        if let Some([width, height]) = self.size {
            overrides.push(format!("run.resolution=[{width}, {height}]"));
        }
        overrides.extend(self.values.set.iter().cloned());
        let experiment = Experiment::parse(
            DEFAULTS,
            "raystone export-mitsuba",
            &overrides,
            &registries.catalogue(),
        )?;
        let first = |axis: Axis| experiment.axes[axis].first();
        let (Some(scene), Some(integrator)) = (first(Axis::Scene), first(Axis::Integrator)) else {
            return Err(anyhow!("--set leaves no scene or no integrator"));
        };
        let options = LoadOptions {
            allow_outside: self.values.allow_outside,
            ..LoadOptions::default()
        };
        let scene = load(scene, &options)?;
        warn_of(&scene);
        let kind = registries.integrators.configured(integrator)?;
        let constants = kind.kind.constants(&kind.params);
        let bounces = constants.iter().find(|(name, _)| *name == "MAX_DEPTH");
        let bounces = bounces.ok_or_else(|| {
            anyhow!("{integrator} has no bounces; Mitsuba's path tracer is compared with `path`")
        })?;
        let own = || scene.view(experiment.aspect());
        let camera = experiment.camera.unwrap_or_else(own);
        raystone::scene::check_camera(&camera)?;
        let settings = MitsubaSettings {
            camera,
            size: experiment.run.resolution,
            spp: experiment.run.spp.max(),
            bounces: bounces.1,
            fronts_only: self.fronts_only,
        };
        for line in export_mitsuba(&scene, &settings, &self.out)? {
            warn(&line);
        }
        print(&format!("{}\n", self.out.join(MITSUBA_FILE).display()))?;
        Ok(ExitCode::SUCCESS)
    }
}

//! `raystone export SCENE --to mitsuba`.

use super::arguments::{ValueArguments, of_flags, on_axis, one_cell, parse_size, warn_of};
use super::output::{print, warn};
use anyhow::{Result, anyhow};
use clap::Args;
use raystone::config::Axis;
use raystone::measure::mitsuba::{MITSUBA_FILE, MitsubaSettings, export_mitsuba};
use raystone::run::Registries;
use raystone::scene::{LoadOptions, check_camera, load};
use std::path::Path;

/// The format of scenes.
pub const MITSUBA: (&str, &str) = (
    "mitsuba",
    "a scene for the renderer Mitsuba 3, with the camera and the path depth of `render`",
);

/// How a scene is exported.
#[derive(Args)]
pub struct SceneArguments {
    /// Width and height of a scene's image, pixels [default: 512x384]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Leave out the backs of a scene's emitters: where nothing sees them
    #[arg(long)]
    fronts_only: bool,
    #[command(flatten)]
    values: ValueArguments,
}

impl SceneArguments {
    /// Returns a flag that was given, if any was.
    pub fn first_given(&self) -> Option<&'static str> {
        let flags = [
            ("--size", self.size.is_some()),
            ("--fronts-only", self.fronts_only),
            ("--set", !self.values.set.is_empty()),
            ("--allow-outside", self.values.allow_outside),
        ];
        let mut given = flags.into_iter().filter(|(_, given)| *given);
        given.next().map(|(flag, _)| flag)
    }

    /// Writes the scene into a folder.
    pub fn export(&self, scene: &Path, out: &Path) -> Result<()> {
        let registries = Registries::default();
        let flags = on_axis(Axis::Scene, [scene.display()]).into_iter();
        let flags = flags.chain([
            // The defaults of `render`: both programs make the same picture.
            format!("run.resolution={:?}", self.size.unwrap_or([512, 384])),
            "run.spp=[64]".to_owned(),
        ]);
        let experiment = of_flags("export", flags, &self.values.set, &registries)?;
        let cell = one_cell(&experiment)?;
        let options = LoadOptions {
            allow_outside: self.values.allow_outside,
            ..LoadOptions::default()
        };
        let scene = load(&cell[Axis::Scene], &options)?;
        warn_of(&scene);
        let integrator = &cell[Axis::Integrator];
        let kind = registries.integrators.configured(integrator)?;
        let constants = kind.kind.constants(&kind.params);
        let bounces = constants.iter().find(|(name, _)| *name == "MAX_DEPTH");
        let bounces = bounces.ok_or_else(|| {
            anyhow!("{integrator} has no bounces; Mitsuba's path tracer is compared with `path`")
        })?;
        let own = || scene.view(experiment.aspect());
        let camera = experiment.camera.unwrap_or_else(own);
        check_camera(&camera)?;
        let settings = MitsubaSettings {
            camera,
            size: experiment.run.resolution,
            spp: experiment.run.spp.max(),
            bounces: bounces.1,
            fronts_only: self.fronts_only,
        };
        for line in export_mitsuba(&scene, &settings, out)? {
            warn(&line);
        }
        print(&format!("{}\n", out.join(MITSUBA_FILE).display()))
    }
}

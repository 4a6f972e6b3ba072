//! `raystone render`.

use super::arguments::{
    DeviceArguments, ValueArguments, of_flags, on_axis, one_cell, parse_size, plan,
};
use super::output::{print, tell};
use anyhow::{Result, bail};
use clap::Args;
use raystone::config::Axis;
use raystone::image::FileFormat;
use raystone::integrator::Order;
use raystone::params::Choice as _;
use raystone::report::format::{count, plural};
use raystone::run::{Pictures, Registries, Rendering};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Render one picture
///
/// Every flag is a short form of --set: --accel bvh means --set axes.accel=bvh.
#[derive(Args)]
pub struct Render {
    /// Built-in scene or path of a model
    #[arg(long, default_value = "cornell-box")]
    scene: String,
    /// Acceleration structure
    #[arg(long, default_value = "cwbvh")]
    accel: String,
    /// Sample sequence
    #[arg(long, default_value = "sobol")]
    sequence: String,
    /// Decorrelation of the pixels
    #[arg(long, default_value = "cranley-patterson")]
    decorrelation: String,
    /// What is computed
    #[arg(long, default_value = "path")]
    integrator: String,
    /// Samples per pixel, at most 65536
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    spp: u32,
    /// Width and height, pixels
    #[arg(long, value_name = "WxH", default_value = "512x384", value_parser = parse_size)]
    size: [u32; 2],
    /// Seed [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    seed: Option<u32>,
    /// Order of the pixels: each sample in one-pass, in 16 blocks, or one pixel of each tile of 16 x 16 at a time, which
    /// shows a coarse picture after the first of 256 passes (quad-tree); at most 256 spp, and no other picture than the first and
    /// the last is written
    #[arg(long, value_name = "ORDER", value_parser = parse_order)]
    order: Option<Order>,
    /// Picture to write with the first that has no gap, in an order of passes; without it, that is written to the output first
    #[arg(long, value_name = "FILE", requires = "order")]
    preview: Option<PathBuf>,
    #[command(flatten)]
    values: ValueArguments,
    /// Picture to write; the ending chooses the format: tone-mapped .png, or linear radiance in .exr,
    /// .hdr, .pfm, .npy
    #[arg(long, short, value_name = "FILE", default_value = "render.png")]
    output: PathBuf,
    #[command(flatten)]
    device: DeviceArguments,
}

impl Render {
    pub fn execute(self) -> Result<ExitCode> {
        check_output(&self.output)?;
        if let Some(preview) = &self.preview {
            check_output(preview)?;
            if *preview == self.output {
                bail!(
                    "--preview {}: this is the picture of --output, too",
                    preview.display()
                );
            }
        }
        let registries = Registries::default();
        let experiment = of_flags("render", self.flags(), &self.values.set, &registries)?;
        one_cell(&experiment)?;
        let plan = plan(&experiment, &[], &registries)?;
        // Only the picture is written: no folder is needed.
        let options = self.device.options(PathBuf::new(), &self.values, false);
        let rendering = raystone::run::render(
            &experiment,
            &plan,
            &registries,
            &options,
            &Pictures {
                file: &self.output,
                order: self.order,
                preview: self.preview.as_deref(),
            },
        )?;
        tell(summary(&rendering, experiment.run.resolution).trim_end());
        print(&format!("{}\n", self.output.display()))?;
        Ok(ExitCode::SUCCESS)
    }

    fn flags(&self) -> impl Iterator<Item = String> {
        let axes = [
            (Axis::Scene, &self.scene),
            (Axis::Accel, &self.accel),
            (Axis::Sequence, &self.sequence),
            (Axis::Decorrelation, &self.decorrelation),
            (Axis::Integrator, &self.integrator),
        ];
        let settings = [
            "run.replicates=1".to_owned(),
            format!("run.spp=[{}]", self.spp),
            format!("run.resolution={:?}", self.size),
        ];
        // There is no reference image here, but its seeds have to differ all the same.
        let seeds = self.seed.map(|seed| {
            let other = seed.wrapping_add(1);
            [
                format!("run.seed={seed}"),
                format!("reference.seed={other}"),
            ]
        });
        let axes = axes
            .into_iter()
            .filter_map(|(axis, name)| on_axis(axis, [name]));
        axes.chain(settings)
            .chain(seeds.into_iter().flatten())
            .chain(self.device.kernels_override())
    }
}

/// Checks that the picture can be written, before anything is rendered.
fn check_output(file: &Path) -> Result<()> {
    FileFormat::of(file)?;
    let folder = file.parent().filter(|f| !f.as_os_str().is_empty());
    if !folder.is_none_or(Path::is_dir) {
        bail!("cannot write {}: its folder does not exist", file.display());
    }
    Ok(())
}

/// Lists approximations, a line each, and the time of the rendering.
fn summary(rendering: &Rendering, [width, height]: [u32; 2]) -> String {
    let mut text = String::new();
    for note in rendering.report.lines() {
        text += &format!("note: {note}\n");
    }
    if rendering.non_finite_pixels > 0 {
        text += &format!(
            "warning: {} pixels are NaN or infinite\n",
            rendering.non_finite_pixels
        );
    }
    if let Some(remark) = &rendering.uniform {
        text += &format!("warning: {remark}\n");
    }
    let work = match rendering.in_order {
        // Rays are not counted then.
        Some(in_order) => format!(
            "{} passes a sample took {:.1} ms in all, {:.1} ms to the first picture without a gap",
            in_order.passes, in_order.total.wall_ms, in_order.first_picture.wall_ms,
        ),
        None => format!(
            "{} rays, {:.2} Mrays/s",
            count(rendering.rays),
            rendering.rays as f64 / 1e6 / rendering.samples_s.max(1e-9),
        ),
    };
    text + &format!(
        "{}, {width}×{height} pixels, {} spp: {:.1} s, first picture after {:.1} s; {work}\n",
        plural(rendering.triangles, "triangle"),
        rendering.spp,
        rendering.total_s,
        rendering.first_picture_s,
    )
}

fn parse_order(text: &str) -> Result<Order, String> {
    Order::from_name(text).ok_or_else(|| format!("must be one of {}", Order::NAMES.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use raystone::config::Experiment;

    #[derive(Parser)]
    struct Shell {
        #[command(flatten)]
        render: Render,
    }

    fn experiment(arguments: &[&str]) -> Result<Experiment, String> {
        let arguments = std::iter::once(&"render").chain(arguments);
        let shell = Shell::try_parse_from(arguments).map_err(|e| e.to_string())?;
        let render = shell.render;
        let set = &render.values.set;
        let parsed = of_flags("render", render.flags(), set, &Registries::default());
        parsed.map_err(|e| e.to_string())
    }

    #[test]
    fn flags_reach_the_experiment_and_set_has_the_last_word() {
        let flags =
            "--spp 12 --size 64x48 --seed 9001 --accel roped-bvh --set run.resolution=[32,24]";
        let experiment = experiment(&flags.split(' ').collect::<Vec<_>>()).unwrap();
        assert_eq!((experiment.run.spp.max(), experiment.run.seed), (12, 9001));
        assert_eq!(experiment.run.resolution, [32, 24]);
        assert_eq!(experiment.axes[Axis::Accel][0].name, "roped-bvh");
        assert_eq!(experiment.axes[Axis::Scene][0].name, "cornell-box");
    }

    #[test]
    fn a_scene_path_may_hold_commas_and_quotes() {
        let experiment = experiment(&["--scene", r#"my "a,b".obj"#]).unwrap();
        assert_eq!(experiment.axes[Axis::Scene].len(), 1);
        assert_eq!(experiment.axes[Axis::Scene][0].name, r#"my "a,b".obj"#);
    }

    #[test]
    fn what_cannot_be_is_refused_with_what_can() {
        for (flag, text, says) in [
            ("--spp", "0", "1..=65536"),
            ("--spp", "70000", "1..=65536"),
            ("--size", "64", "512x384"),
            ("--size", "64x4", "--size: "),
            ("--integrator", "pat", "--integrator: unknown"),
        ] {
            let error = experiment(&[flag, text]).unwrap_err();
            assert!(error.contains(says), "{text}: {error}");
        }
    }

    #[test]
    fn the_speed_is_that_of_the_samples_without_loading_and_building() {
        let rendering = Rendering {
            triangles: 12,
            spp: 4,
            first_picture_s: 5.0,
            samples_s: 1.5,
            total_s: 6.0,
            rays: 3_000_000,
            report: Default::default(),
            non_finite_pixels: 0,
            uniform: None,
            in_order: None,
        };
        let text = summary(&rendering, [64, 48]);
        for part in [
            "4 spp: 6.0 s, first picture after 5.0 s",
            "3,000,000 rays, 2.00 Mrays/s",
        ] {
            assert!(text.contains(part), "{text}");
        }
    }
}

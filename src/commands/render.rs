//! `raystone render`.

use super::arguments::{DeviceArguments, ValueArguments, list_override, plan};
use super::output::print;
use anyhow::{Result, bail};
use clap::Args;
use raystone::config::{Axis, Experiment};
use raystone::image::FileFormat;
use raystone::integrator::Order;
use raystone::params::Choice as _;
use raystone::run::{Pictures, Registries, Rendering};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What is rendered where the command line says nothing: an experiment of one cell, so that one
/// parser checks files, flags and `--set` alike.
const DEFAULTS: &str = r#"
[run]
name = "render"
replicates = 1
resolution = [512, 384]
spp = { pow2 = [6, 6] }
[axes]
scene = ["cornell-box"]
accel = ["cwbvh"]
sequence = ["sobol"]
decorrelation = ["cranley-patterson"]
integrator = ["path"]
"#;

/// Render one picture
///
/// Every flag is a short form of --set: --accel bvh means --set axes.accel=bvh.
#[derive(Args)]
pub struct Render {
    /// Built-in scene or path of a model [default: cornell-box]
    #[arg(long)]
    scene: Option<String>,
    /// Acceleration structure [default: cwbvh]
    #[arg(long)]
    accel: Option<String>,
    /// Sample sequence [default: sobol]
    #[arg(long)]
    sequence: Option<String>,
    /// Decorrelation of the pixels [default: cranley-patterson]
    #[arg(long)]
    decorrelation: Option<String>,
    /// What is computed [default: path]
    #[arg(long)]
    integrator: Option<String>,
    /// Samples per pixel, at most 65536 [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    spp: Option<u32>,
    /// Width and height, pixels [default: 512x384]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Seed [default: 1]
    #[arg(long, value_name = "N")]
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
        }
        let registries = Registries::default();
        let catalogue = registries.catalogue();
        let experiment =
            Experiment::parse(DEFAULTS, "raystone render", &self.overrides(), &catalogue)?;
        check_is_one(&experiment)?;
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
        super::output::tell(summary(&rendering, experiment.run.resolution).trim_end());
        print(&format!("{}\n", self.output.display()))?;
        Ok(ExitCode::SUCCESS)
    }

    fn overrides(&self) -> Vec<String> {
        let mut overrides = Vec::new();
        for (axis, name) in [
            (Axis::Scene, &self.scene),
            (Axis::Accel, &self.accel),
            (Axis::Sequence, &self.sequence),
            (Axis::Decorrelation, &self.decorrelation),
            (Axis::Integrator, &self.integrator),
        ] {
            let list = |name| list_override(&format!("axes.{axis}"), std::slice::from_ref(name));
            overrides.extend(name.as_ref().map(list));
        }
        overrides.extend(self.spp.map(|spp| format!("run.spp=[{spp}]")));
        if let Some([width, height]) = self.size {
            overrides.push(format!("run.resolution=[{width}, {height}]"));
        }
        if let Some(seed) = self.seed {
            overrides.push(format!("run.seed={seed}"));
            // There is no reference image here, but its seeds have to differ all the same.
            overrides.push(format!("reference.seed={}", seed.wrapping_add(1)));
        }
        overrides.extend(self.device.kernels_override());
        overrides.extend(self.values.set.iter().cloned());
        overrides
    }
}

/// Whether the picture can be written, asked before anything is rendered.
fn check_output(file: &Path) -> Result<()> {
    FileFormat::of(file)?;
    let folder = file.parent().filter(|f| !f.as_os_str().is_empty());
    if !folder.is_none_or(Path::is_dir) {
        bail!("cannot write {}: its folder does not exist", file.display());
    }
    Ok(())
}

/// What was approximated, a line each, and how long it took.
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
    let work = match rendering.in_order {
        // Rays are not counted then.
        Some(in_order) => format!(
            "{} passes a sample took {:.1} ms in all, {:.1} ms to the first picture without a gap",
            in_order.passes, in_order.total.wall_ms, in_order.first_picture.wall_ms,
        ),
        None => format!(
            "{:.1} million rays, {:.2} Mrays/s",
            rendering.rays as f64 / 1e6,
            rendering.rays as f64 / 1e6 / rendering.samples_s.max(1e-9),
        ),
    };
    text + &format!(
        "{} triangles, {width}×{height} pixels, {} spp: {:.1} s, first picture after {:.1} s; {work}\n",
        rendering.triangles, rendering.spp, rendering.total_s, rendering.first_picture_s,
    )
}

/// One picture is one cell.
fn check_is_one(experiment: &Experiment) -> Result<()> {
    for axis in Axis::ALL {
        let variants = &experiment.axes[axis];
        if variants.len() > 1 {
            let labels: Vec<_> = variants.iter().map(|v| v.label.as_str()).collect();
            bail!(
                "render makes one picture, but {axis} has {} values ({}); give one",
                labels.len(),
                labels.join(", ")
            );
        }
    }
    Ok(())
}

fn parse_order(text: &str) -> Result<Order, String> {
    Order::from_name(text).ok_or_else(|| format!("must be one of {}", Order::NAMES.join(", ")))
}

pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parsed = text
        .split_once(['x', 'X', '×'])
        .and_then(|(width, height)| {
            Some([width.trim().parse().ok()?, height.trim().parse().ok()?])
        });
    parsed.ok_or_else(|| "must be width x height in pixels, for instance 512x384".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Shell {
        #[command(flatten)]
        render: Render,
    }

    fn experiment(arguments: &[&str]) -> Result<Experiment, String> {
        let arguments = std::iter::once(&"render").chain(arguments);
        let shell = Shell::try_parse_from(arguments).map_err(|e| e.to_string())?;
        let catalogue = Registries::default().catalogue();
        let overrides = shell.render.overrides();
        Experiment::parse(DEFAULTS, "render", &overrides, &catalogue).map_err(|e| e.to_string())
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
            ("--size", "64x4", "run.resolution"),
        ] {
            let error = experiment(&[flag, text]).unwrap_err();
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}

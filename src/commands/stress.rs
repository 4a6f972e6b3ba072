//! `raystone stress`.

use super::arguments::{DeviceArguments, warn_of};
use super::failure::FAILED;
use super::faults::plant_faults;
use super::output::{OutputArguments, print, print_json, screen, tell};
use anyhow::Result;
use clap::Args;
use raystone::measure::record::Verdict;
use raystone::run::{Registries, lock_folder};
use raystone::scene::named;
use raystone::stress::record::{Line, Record, write};
use raystone::stress::report::{stress_tables, write_stress_page};
use raystone::stress::{StressOptions, run};
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Run the numerical stress suite: every triangle test and structure on what rounding makes hard
///
/// Prints tables, writes stress.jsonl and a page with pictures, and ends with 1 if the default
/// configuration misses a target.
#[derive(Args)]
pub struct Stress {
    /// Few rungs and shots: a minute at most
    #[arg(long)]
    quick: bool,
    /// Triangle test; may be given many times [default: all]
    #[arg(long)]
    triangle: Vec<String>,
    /// Structure; may be given many times; brute force always takes part [default: all]
    #[arg(long)]
    accel: Vec<String>,
    /// Family; may be given many times [default: all, and the shots]
    #[arg(long)]
    family: Vec<String>,
    /// Rays per case [default: 512, quick 128]
    #[arg(long, value_name = "N")]
    rays: Option<usize>,
    /// Shots at each closed mesh, 0 for none [default: 1000000, quick 16384]
    #[arg(long, value_name = "N")]
    shots: Option<usize>,
    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// A model to shoot at from inside, its holes closed [default: none]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// In a checkout, run the planted faults instead: each must turn a check red; takes --out and --adapter
    #[arg(long)]
    mutants: bool,
    /// Folder for the records and the page
    #[arg(long, short, value_name = "DIR", default_value = "results/stress")]
    out: PathBuf,
    #[command(flatten)]
    device: DeviceArguments,
    #[command(flatten)]
    output: OutputArguments,
}

impl Stress {
    pub fn execute(self) -> Result<ExitCode> {
        if self.mutants {
            return plant_faults(&self.out, self.device.adapter.as_ref());
        }
        if let Some(model) = &self.model {
            // A model that was asked for has to be there; the default one may be missing.
            warn_of(&named(&model.to_string_lossy())?);
        }
        let settings = self.settings();
        settings.check()?;
        let _lock = lock_folder(&self.out)?;
        let registries = Registries::default();
        let mut gpus = vec![self.device.open(&registries)?];
        // The host does most of the work of a software adapter one thread at a time.
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        if gpus[0].is_software() && cores > 1 {
            gpus.push(self.device.open(&registries)?);
        }
        let start = Instant::now();
        let progress =
            |what: &str| tell(&format!("{:6.1} s  {what}", start.elapsed().as_secs_f64()));
        let records = run(&gpus, &settings, &progress)?;
        write(&self.out, &records)?;
        let page = write_stress_page(&self.out, &records)?;
        match self.output.json {
            true => print_json("stress", json!({ "records": records, "report": page }))?,
            false => print(&format!(
                "{}report: {}\n",
                stress_tables(&records, screen()),
                page.display()
            ))?,
        }
        Ok(match records.iter().any(is_missed_target) {
            true => ExitCode::from(FAILED),
            false => ExitCode::SUCCESS,
        })
    }

    fn settings(&self) -> StressOptions {
        let mut settings = StressOptions::new(self.quick);
        settings.program = raystone::PROGRAM;
        settings.seed = self.seed;
        settings.families = self.family.clone();
        settings.accels = self.accel.clone();
        settings.triangles = self.triangle.clone();
        settings.rays = self.rays.unwrap_or(settings.rays);
        settings.shots = self.shots.unwrap_or(settings.shots);
        if !self.family.is_empty() && self.shots.is_none() {
            settings.shots = 0;
        }
        settings.model = self.model.clone();
        settings
    }
}

fn is_missed_target(line: &Line) -> bool {
    matches!(&line.body, Record::Target(target) if target.verdict == Verdict::Fail)
}

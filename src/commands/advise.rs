//! `raystone advise`.

use super::arguments::{ValueArguments, of_flags, on_axis, one_cell};
use super::output::{OutputArguments, screen, warn};
use anyhow::{Context as _, Result, anyhow, bail};
use clap::Args;
use raystone::advice::{
    AdviceTable, CLASSES, Demand, FEATURES, Prediction, Regret, Sample, SceneFeatures, Trial, fit,
    leave_one_out,
};
use raystone::config::Axis;
use raystone::measure::record::read_records;
use raystone::report::advice::{BUDGETS, demands, samples};
use raystone::report::document::{Table, TableCell};
use raystone::report::format::{count, number};
use raystone::run::{Registries, records_in};
use raystone::scene::{LoadOptions, load};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Say which structure suits a scene: predicted costs of building and tracing, cheapest first
///
/// With `--fit` a table of your own adapter is made from the records of runs, and tried on scenes that are left out.
#[derive(Args)]
pub struct Advise {
    /// Built-in scene or path of a model
    #[arg(required_unless_present = "fit")]
    scene: Option<String>,
    /// Rays that the structure will answer
    #[arg(
        long,
        default_value_t = 1e7,
        value_name = "N",
        allow_negative_numbers = true
    )]
    rays: f64,
    /// Class of these rays; may be given many times [default: all in equal parts]
    #[arg(long, value_parser = CLASSES)]
    class: Vec<String>,
    /// Table to use [default: the one that comes with the program]
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Folders of runs to fit a table on, all of one adapter
    #[arg(long, num_args = 1.., value_name = "DIR", conflicts_with_all = ["scene", "rays", "class", "table"])]
    fit: Vec<PathBuf>,
    /// File for the fitted table [default: it is tried and not kept]
    #[arg(long, value_name = "FILE", requires = "fit", conflicts_with = "scene")]
    save: Option<PathBuf>,
    #[command(flatten)]
    values: ValueArguments,
    #[command(flatten)]
    output: OutputArguments,
}

impl Advise {
    pub fn execute(self) -> Result<ExitCode> {
        match &self.scene {
            Some(scene) => self.advise(scene)?,
            None => self.fit()?,
        }
        Ok(ExitCode::SUCCESS)
    }

    fn advise(&self, scene: &str) -> Result<()> {
        if !(self.rays.is_finite() && self.rays > 0.0) {
            bail!("--rays {}: must be a number above 0", self.rays);
        }
        let table = self.table()?;
        let features = self.features(scene)?;
        let demand = Demand {
            rays: self.rays,
            classes: self.class.clone(),
        };
        let advised = table.advise(&features, &demand);
        let [(best, _), ..] = &advised[..] else {
            bail!(
                "the table has no structure with times of these classes: {}",
                self.class.join(", ")
            );
        };
        let text = format!(
            "{}\n{}\n{}\nWrite `accel = \"{}\"`{} in an experiment, or `accel = \"auto\"`.\n",
            screen().table(&features_table(&features)),
            screen().table(&costs_table(&advised, &demand, &table)),
            why(&advised, &demand),
            best.choice.structure,
            (best.choice.builder.as_ref()).map_or(String::new(), |builder| format!(
                " and `builder = \"{builder}\"` for it"
            )),
        );
        let one = |(p, ms): &(Prediction, f64)| json!({ "choice": p.choice.label(), "build_ms": p.build_ms, "ns": p.ns, "total_ms": ms });
        let advised: Vec<Value> = advised.iter().map(one).collect();
        let fields = json!({
            "scene": scene, "rays": self.rays, "features": features, "adapter": table.adapter, "advised": advised,
        });
        self.output.show("advise", fields, &text)
    }

    /// The table that is used: no adapter is opened, so that the program's own is the first of its tables.
    fn table(&self) -> Result<AdviceTable> {
        let Some(file) = &self.table else {
            return Ok(AdviceTable::built_in("")?.0);
        };
        let text = std::fs::read_to_string(file);
        let text = text.with_context(|| format!("--table {}", file.display()))?;
        AdviceTable::parse(&text).with_context(|| format!("--table {}", file.display()))
    }

    fn features(&self, scene: &str) -> Result<SceneFeatures> {
        let flags = on_axis(Axis::Scene, [&scene.to_owned()]);
        let set = &self.values.set;
        // The scene is no flag here.
        let experiment = of_flags("advise", flags, set, &Registries::default());
        let experiment = experiment.map_err(|e| anyhow!(e.to_string().replace("--scene: ", "")))?;
        let cell = one_cell(&experiment)?;
        let options = LoadOptions {
            textures: false,
            allow_outside: self.values.allow_outside,
            ..LoadOptions::default()
        };
        let scene = load(&cell[Axis::Scene], &options)?;
        let copies = scene.assembly.as_ref().map_or(1, |a| a.instances().len());
        Ok(SceneFeatures::of(
            scene.triangles.iter().map(|t| t.vertices),
            copies,
        ))
    }

    fn fit(&self) -> Result<()> {
        let (mut all, mut adapters) = (Vec::<Sample>::new(), Vec::<String>::new());
        for dir in self.fit.iter().map(|dir| records_in(dir)) {
            let records = read_records(&dir)?;
            for warning in &records.warnings {
                warn(&format!("{}: {warning}", dir.display()));
            }
            let (adapter, samples) = samples(&records.lines);
            if samples.is_empty() {
                warn(&format!(
                    "{}: no structure with features of its scene and times, so nothing to fit",
                    dir.display()
                ));
            }
            adapters.push(adapter);
            all.extend(samples);
        }
        adapters.sort();
        adapters.dedup();
        let [adapter] = &adapters[..] else {
            bail!(
                "--fit: runs of several adapters ({}): fit a table for each",
                adapters.join("; ")
            );
        };
        let table = fit(adapter, &all)?;
        let trials = leave_one_out(&all, &demands())?;
        let mut text = format!(
            "{}\n{}\n",
            screen().table(&trials_table(&trials)),
            screen().table(&regrets_table(&trials))
        );
        if let Some(file) = &self.save {
            std::fs::write(file, table.to_text())
                .with_context(|| format!("--save {}", file.display()))?;
            text += &format!("table: {}\n", file.display());
        }
        let regret = Regret::of(trials.iter());
        let one = |t: &Trial| json!({ "scene": t.scene, "rays": t.rays, "advised": t.advised.label(), "best": t.best.label(), "regret": t.regret });
        let fields = json!({
            "adapter": adapter, "scenes": table.scenes, "mean_regret": regret.mean, "worst_regret": regret.worst,
            "trials": trials.iter().map(one).collect::<Vec<_>>(), "table": self.save,
        });
        self.output.show("advise", fields, &text)
    }
}

fn features_table(features: &SceneFeatures) -> Table {
    let mut table = Table::new("What the scene shows", &["feature", "value"]);
    let f = features;
    let rows = [
        ("triangles", count(f.triangles)),
        ("instances", count(f.copies)),
        ("spread of sizes, powers of two", number(f.size_spread)),
        (
            "boxes of triangles that a random line crosses",
            number(f.boxes_crossed),
        ),
        (
            "triangles that a random line crosses",
            number(f.surfaces_crossed),
        ),
        (
            "occupied of 32³ cells",
            format!("{} %", number(100.0 * f.occupied)),
        ),
    ];
    table.rows = rows
        .map(|(name, value)| vec![name.into(), value.into()])
        .to_vec();
    table
}

fn costs_table(advised: &[(Prediction, f64)], demand: &Demand, table: &AdviceTable) -> Table {
    let classes: Vec<&str> = match &demand.classes[..] {
        [] => CLASSES.to_vec(),
        classes => classes.iter().map(String::as_str).collect(),
    };
    let heads: Vec<String> = classes.iter().map(|class| format!("{class}, ns")).collect();
    let mut columns = vec!["structure", "total, ms", "build, ms"];
    columns.extend(heads.iter().map(String::as_str));
    let caption = format!(
        "Predicted for {} rays, by a table of {} scenes on {}",
        count(demand.rays as u64),
        table.scenes.len(),
        table.adapter
    );
    let mut shown = Table::new(caption, &columns);
    let row = |(p, ms): &(Prediction, f64)| {
        let ns = classes
            .iter()
            .map(|class| p.ns.get(*class).map_or("–".into(), |ns| number(*ns).into()));
        let first: [TableCell; 3] = [
            p.choice.label().into(),
            number(*ms).into(),
            number(p.build_ms).into(),
        ];
        first.into_iter().chain(ns).collect()
    };
    shown.rows = advised.iter().map(row).collect();
    shown
}

/// A sentence that says what decides between the best choice and the next, and where another budget would choose otherwise.
fn why(advised: &[(Prediction, f64)], demand: &Demand) -> String {
    let [(best, ms), others @ ..] = advised else {
        return String::new();
    };
    let rays_ms = ms - best.build_ms;
    let share = |of_one: f64| format!("{:.1}", 100.0 * of_one);
    let mut text = format!(
        "{}: {} % of its cost are rays, {} % the build.",
        best.choice.label(),
        share(rays_ms / ms),
        share(best.build_ms / ms),
    );
    if let Some((next, next_ms)) = others.first() {
        text += &format!(
            " {} would cost {} % more.",
            next.choice.label(),
            share(next_ms / ms - 1.0)
        );
    }
    let ns = |p: &Prediction, ms: f64| (ms - p.build_ms) / demand.rays * 1e6;
    let own = ns(best, *ms);
    // Those that are built faster win below a number of rays, those with faster rays above one.
    let quicker = others.iter().filter(|(p, _)| p.build_ms < best.build_ms);
    let below = quicker.map(|(p, ms)| ((best.build_ms - p.build_ms) / (ns(p, *ms) - own) * 1e6, p));
    if let Some((rays, p)) = below
        .filter(|(rays, _)| *rays > 0.0)
        .max_by(|a, b| a.0.total_cmp(&b.0))
    {
        text += &format!(
            " Below {} rays {} is cheaper.",
            count(rays as u64),
            p.choice.label()
        );
    }
    let faster = others.iter().filter(|(p, ms)| ns(p, *ms) < own);
    let above = faster.map(|(p, ms)| ((p.build_ms - best.build_ms) / (own - ns(p, *ms)) * 1e6, p));
    if let Some((rays, p)) = above.min_by(|a, b| a.0.total_cmp(&b.0)) {
        text += &format!(
            " From {} rays on {} is cheaper.",
            count(rays as u64),
            p.choice.label()
        );
    }
    text
}

fn trials_table(trials: &[Trial]) -> Table {
    let caption = "Each scene by a table that was fitted without it and its like: cost of the advised structure over the cheapest measured";
    let mut table = Table::new(
        caption,
        &[
            "scene",
            "rays",
            ":cheapest as measured",
            ":advised",
            "dearer by",
        ],
    );
    let row = |t: &Trial| -> Vec<TableCell> {
        vec![
            t.scene.as_str().into(),
            count(t.rays as u64).into(),
            t.best.label().into(),
            t.advised.label().into(),
            format!("{:.1} %", 100.0 * t.regret).into(),
        ]
    };
    table.rows = trials.iter().map(row).collect();
    table
}

fn regrets_table(trials: &[Trial]) -> Table {
    let caption = format!("Dearer by, over {} weights per cost", FEATURES.len());
    let mut table = Table::new(caption, &["rays", "mean", "worst"]);
    let row = |name: String, of: &dyn Fn(&&Trial) -> bool| -> Vec<TableCell> {
        let chosen: Vec<&Trial> = trials.iter().filter(of).collect();
        let regret = Regret::of(chosen.iter().copied());
        [regret.mean, regret.worst]
            .iter()
            .fold(vec![name.into()], |mut row, share| {
                row.push(format!("{:.1} %", 100.0 * share).into());
                row
            })
    };
    let rows = BUDGETS
        .iter()
        .map(|rays| row(count(*rays as u64), &|t| t.rays == *rays));
    table.rows = rows.collect();
    table.rows.push(row("all".to_owned(), &|_| true));
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone::advice::Choice;
    use std::collections::BTreeMap;

    #[test]
    fn what_is_cheaper_for_fewer_or_more_rays_is_named_with_their_number() {
        let of = |name: &str, build_ms: f64, ns: f64| {
            let prediction = Prediction {
                choice: Choice::of_label(name).expect("a label"),
                build_ms,
                ns: BTreeMap::from([("bounce".to_owned(), ns)]),
            };
            // A million rays.
            (prediction, build_ms + ns)
        };
        // 100 + 100 ms; as fast is `bvh` at 300,000 rays, `roped-bvh` at half a million, and `bvh8` from two million on.
        let advised = [
            of("cwbvh", 100.0, 100.0),
            of("roped-bvh", 50.0, 200.0),
            of("bvh", 10.0, 400.0),
            of("bvh8", 280.0, 10.0),
            of("bvh4", 500.0, 20.0),
        ];
        let demand = Demand {
            rays: 1e6,
            classes: Vec::new(),
        };
        let text = why(&advised, &demand);
        for part in [
            "cwbvh: 50.0 % of its cost are rays, 50.0 % the build.",
            "roped-bvh would cost 25.0 % more.",
            "Below 500,000 rays roped-bvh is cheaper.",
            "From 2,000,000 rays on bvh8 is cheaper.",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}

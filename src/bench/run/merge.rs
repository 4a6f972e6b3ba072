//! Folders of shards joined to the folder of one run.
//!
//! Of a cell that several folders hold one is taken, after it was compared with the others: contradictions are errors. Figures of clocks are
//! taken from one device alone. What does not depend on the device (errors, discrepancies, models) comes from any.

use super::error::RunError;
use super::folder::lock_folder;
use super::inputs::differing;
use super::registries::Registries;
use super::resume::{Earlier, made_of};
use super::units::Unit;
use raystone_config::Skipped;
use raystone_core::atomic::write_atomic;
use raystone_image::FileFormat;
use raystone_record::{
    Body, CellRecord, CpuTime, FinishedRecord, InterruptedRecord, KernelSetRecord, Line, Outcome,
    Pictures, RunRecord, SkippedRecord, records_file, text_of,
};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs;
use std::path::{Path, PathBuf};

/// What was joined.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Merged {
    /// Cells that were taken.
    pub cells: usize,
    /// What a reader has to know: cells that several folders hold, that are missing or were left behind, in words.
    pub notes: Vec<String>,
    /// Whether a cell of the plan is missing or failed.
    pub incomplete: bool,
}

fn input(text: String) -> RunError {
    RunError::Input(text)
}

/// Why the last run of a folder ended early; `None` if it did not.
fn unfinished(part: &Earlier) -> Option<String> {
    let reason = match &part.lines().last()?.body {
        Body::Finished(_) => return None,
        Body::Interrupted(record) => record.reason.as_str(),
        _ => "it did not end",
    };
    Some(format!("{}: {reason}", part.dir.display()))
}

/// Joins the folders of shards to `out`, where nothing may be yet. Clocks speak of the devices alone whose name holds `device`, if that
/// is given.
///
/// # Errors
/// Folders of different experiments, cells that contradict each other, times of several devices without a choice, and files that cannot
/// be read or written.
pub fn merge(
    dirs: &[PathBuf],
    out: &Path,
    device: Option<&str>,
    registries: &Registries,
) -> Result<Merged, RunError> {
    let mut merged = Merged::default();
    let parts = dirs.iter().map(|dir| Earlier::read(dir));
    let parts: Vec<Earlier> = parts.collect::<Result<_, _>>()?;
    for part in &parts {
        let told = part.warnings.iter();
        let told = told.map(|warning| format!("{}: {warning}", part.dir.display()));
        merged.notes.extend(told);
    }
    let first = parts
        .first()
        .ok_or_else(|| input("nothing to join: name the folders of the shards".to_owned()))?;
    for part in &parts[1..] {
        same_experiment(first, part)?;
    }
    let (experiment, plan) = first.planned(registries)?;
    let units = registries.measurements.units(&experiment, &plan);
    let chosen = choose(&parts, &units, device, &mut merged)?;
    check_devices(&parts, &units, &chosen)?;
    let mut lines = Vec::new();
    let mut pictures = Carried::default();
    for (part, cells) in parts.iter().zip(&chosen) {
        let own = part.lines_of(cells);
        own.iter().for_each(|line| pictures.add(line, &part.dir));
        lines.extend(own);
        merged.cells += cells.len();
    }
    lines.extend(told_once(&parts));
    let tally = Tally::new(&units, &chosen);
    tally.tell(&mut merged);
    lines.push(Line::about_all(Body::Run(RunRecord {
        shard: None,
        ..first.run()?.clone()
    })));
    lines.push(Line::about_all(tally.end(&parts, &plan.skipped)));
    let _lock = lock_folder(out)?;
    write(out, &lines, &pictures, &mut merged)?;
    Ok(merged)
}

/// That two folders are of one experiment.
fn same_experiment(first: &Earlier, other: &Earlier) -> Result<(), RunError> {
    let (a, b) = (first.run()?, other.run()?);
    let differs = [
        ("the text differs", a.experiment_text != b.experiment_text),
        ("the values of --set differ", a.overrides != b.overrides),
        ("the filters of --only differ", a.only != b.only),
    ];
    match differs.into_iter().find(|(_, differs)| *differs) {
        None => Ok(()),
        Some((what, _)) => Err(input(format!(
            "{} and {} are of different experiments: {what}",
            first.dir.display(),
            other.dir.display()
        ))),
    }
}

/// The cells that are taken of each folder.
pub(super) fn choose(
    parts: &[Earlier],
    units: &[Unit],
    device: Option<&str>,
    merged: &mut Merged,
) -> Result<Vec<Vec<CellRecord>>, RunError> {
    let all: Vec<Holder> = parts.iter().map(Holder::new).collect();
    let mut chosen = vec![Vec::new(); parts.len()];
    let (mut twice, mut elsewhere) = (0, 0);
    for unit in units {
        let holders = all.iter().enumerate();
        let holders = holders.filter_map(|(i, of)| Some((i, *of.cells.get(unit.name.as_str())?)));
        let mut holders: Vec<(usize, &CellRecord)> = holders.collect();
        if let Some(device) = device.filter(|_| unit.measurement.is_timed()) {
            let before = holders.len();
            holders.retain(|(_, cell)| {
                cell.outcome != Outcome::Done || cell.inputs.device.contains(device)
            });
            elsewhere += usize::from(holders.is_empty() && before > 0);
        }
        // What is done comes before what was left out, and that before what failed.
        holders.sort_by_key(|(_, cell)| match cell.outcome {
            Outcome::Done => 0,
            Outcome::LeftOut => 1,
            Outcome::Failed => 2,
        });
        let Some(&(place, cell)) = holders.first() else {
            continue;
        };
        for &(other, record) in &holders[1..] {
            if record.outcome == Outcome::Done && cell.outcome == Outcome::Done {
                twice += 1;
                let fault = contradiction((&all[place], cell), (&all[other], record));
                if let Some(what) = fault {
                    return Err(input(format!(
                        "{} and {} contradict each other on {}: {what}; measure it again, or leave one of them out",
                        parts[place].dir.display(),
                        parts[other].dir.display(),
                        unit.name
                    )));
                }
            }
        }
        chosen[place].push(cell.clone());
    }
    if twice > 0 {
        merged.notes.push(format!(
            "{twice} times a cell was measured in more than one folder: the first one was taken, and the others agree with it"
        ));
    }
    if elsewhere > 0 {
        merged.notes.push(format!(
            "{elsewhere} timed cells were left behind: they were measured on other devices than {}",
            device.unwrap_or_default()
        ));
    }
    Ok(chosen)
}

/// What a folder says of its cells.
struct Holder<'a> {
    cells: BTreeMap<&'a str, &'a CellRecord>,
    sets: HashMap<&'a str, &'a KernelSetRecord>,
    evidence: HashMap<&'a str, Vec<(String, String)>>,
}

impl<'a> Holder<'a> {
    fn new(part: &'a Earlier) -> Self {
        Self {
            cells: part.cells(),
            sets: part.kernel_sets(),
            evidence: evidence_of(part.lines()),
        }
    }

    /// What was found for a cell, by what it is about.
    fn found(&self, cell: &CellRecord) -> BTreeMap<&str, BTreeSet<&str>> {
        let lines = cell.lines.iter();
        let of_cell = lines.filter_map(|line| self.evidence.get(line.as_str()));
        let mut found: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for (about, value) in of_cell.flatten() {
            found.entry(about).or_default().insert(value);
        }
        found
    }
}

/// What two records of one cell differ in that they must not.
fn contradiction(a: (&Holder, &CellRecord), b: (&Holder, &CellRecord)) -> Option<String> {
    if let Some(what) = differing(made_of(a.1, &a.0.sets), made_of(b.1, &b.0.sets)) {
        return Some(format!("{what} that it was measured with differ"));
    }
    let (found_a, found_b) = (a.0.found(a.1), b.0.found(b.1));
    let differ =
        |(about, value): (&&str, _)| found_b.get(about).is_some_and(|other| other != value);
    found_a
        .iter()
        .any(differ)
        .then(|| "figures that no clock is part of differ".to_owned())
}

/// What has to be the same whenever it is measured on one device, by the hash of the lines that have it: device, cell, kind and number,
/// and the value. Nothing of the hash is in it, which tells through which structure an image was rendered: images are equal whichever it was.
fn evidence_of(lines: &[Line]) -> HashMap<&str, Vec<(String, String)>> {
    let mut found: HashMap<&str, Vec<(String, String)>> = HashMap::new();
    // Rounding may differ from device to device.
    let mut place = String::new();
    for line in lines {
        if let Body::Run(run) = &line.body {
            place = super::inputs::place(&run.environment);
        }
        let (kind, value) = match &line.body {
            Body::Error(r) => (
                format!("error {}", r.replicate),
                json!([r.errors, r.image_hash]),
            ),
            Body::Bias(r) => ("bias".to_owned(), json!([r.p_of_all, r.min_p])),
            Body::Stream(r) => (
                format!("stream {:?}", r.dimensions),
                json!([r.star, r.figures]),
            ),
            Body::Coherence(r) => ("coherence".to_owned(), json!(r)),
            Body::Time(r) => ("time".to_owned(), json!([r.image_hash, r.rays])),
            Body::Structure(r) => {
                let counters: Vec<_> = r.timings.iter().map(|t| (t.class, t.counters)).collect();
                (
                    "structure".to_owned(),
                    json!([r.stats.nodes, r.stats.sah_cost, counters]),
                )
            }
            _ => continue,
        };
        let about = format!("{place} {} {kind}", line.key);
        let of_line = found.entry(&line.hash).or_default();
        of_line.push((about, value.to_string()));
    }
    found
}

/// That the clocks of one device speak.
fn check_devices(
    parts: &[Earlier],
    units: &[Unit],
    chosen: &[Vec<CellRecord>],
) -> Result<(), RunError> {
    let timed: BTreeSet<&str> = units
        .iter()
        .filter(|unit| unit.measurement.is_timed())
        .map(|unit| unit.name.as_str())
        .collect();
    let mut devices: BTreeMap<&str, &Path> = BTreeMap::new();
    for (part, cells) in parts.iter().zip(chosen) {
        let cells = cells
            .iter()
            .filter(|cell| cell.outcome == Outcome::Done && timed.contains(cell.unit.as_str()));
        for cell in cells {
            devices.entry(&cell.inputs.device).or_insert(&part.dir);
        }
    }
    if devices.len() < 2 {
        return Ok(());
    }
    let list = devices
        .iter()
        .map(|(device, dir)| format!("{device} ({})", dir.display()));
    Err(input(format!(
        "times of several devices cannot be put into one table: {}; choose one with --device, the timed cells of the others are left behind then",
        list.collect::<Vec<_>>().join("; ")
    )))
}

/// Lines about the plan and warnings, which several folders have.
fn told_once(parts: &[Earlier]) -> Vec<Line> {
    let mut seen = BTreeSet::new();
    let lines = parts.iter().flat_map(|part| part.lines());
    let lines = lines.filter(|line| {
        let text = |record: &SkippedRecord| format!("{}: {}", record.cell, record.reason);
        match &line.body {
            Body::Warning(record) => seen.insert(("warning", text(record))),
            Body::Skipped(record) if line.hash.is_empty() => seen.insert(("skipped", text(record))),
            _ => false,
        }
    });
    lines.cloned().collect()
}

/// How the cells of a plan ended, by the folders that they are taken of.
struct Tally<'a> {
    missing: Vec<&'a str>,
    failed: Vec<&'a str>,
    left_out: usize,
}

impl<'a> Tally<'a> {
    fn new(units: &'a [Unit], chosen: &[Vec<CellRecord>]) -> Self {
        let cells = chosen.iter().flatten();
        let held: HashMap<&str, Outcome> = cells.map(|c| (c.unit.as_str(), c.outcome)).collect();
        let ended = |outcome: Option<Outcome>| {
            let names = units.iter().map(|unit| unit.name.as_str());
            names.filter(move |name| held.get(name).copied() == outcome)
        };
        Self {
            left_out: ended.clone()(Some(Outcome::LeftOut)).count(),
            failed: ended.clone()(Some(Outcome::Failed)).collect(),
            missing: ended(None).collect(),
        }
    }

    /// The cells that no folder holds, and those that failed in all of them, in words.
    fn faults(&self) -> impl Iterator<Item = String> {
        let faults = [("missing", &self.missing), ("failed", &self.failed)].into_iter();
        faults.filter_map(|(what, names)| {
            let (first, others) = names.split_first()?;
            Some(match others.len() {
                0 => format!("1 cell is {what}: {first}"),
                n => format!("{} cells are {what}: {first} and {n} more", n + 1),
            })
        })
    }

    fn tell(&self, merged: &mut Merged) {
        let before = merged.notes.len();
        merged.notes.extend(self.faults());
        merged.incomplete = merged.notes.len() > before;
    }

    /// The last line: times are sums over all parts, cells are those of the joined records. Where cells are missing, the run has not ended.
    fn end(&self, parts: &[Earlier], skipped: &[Skipped]) -> Body {
        let mut sum = FinishedRecord {
            wall_s: 0.0,
            parts_s: BTreeMap::new(),
            overhead_s: 0.0,
            cpu: None,
            failed: self.failed.len(),
            skipped: self.left_out + skipped.iter().map(|s| s.cells).sum::<usize>(),
            load: Default::default(),
        };
        let mut cpu = Vec::new();
        for line in parts.iter().flat_map(|part| part.lines()) {
            match &line.body {
                Body::Finished(finished) => {
                    sum.wall_s += finished.wall_s;
                    sum.overhead_s += finished.overhead_s;
                    cpu.push(finished.cpu);
                    sum.load = finished.load;
                    for (name, seconds) in &finished.parts_s {
                        *sum.parts_s.entry(name.clone()).or_default() += seconds;
                    }
                }
                Body::Interrupted(early) => sum.wall_s += early.wall_s,
                _ => {}
            }
        }
        // Of the whole only where every part has it.
        sum.cpu = (cpu.into_iter().collect::<Option<Vec<_>>>())
            .filter(|parts| !parts.is_empty())
            .map(|parts| CpuTime {
                whole_s: parts.iter().map(|part| part.whole_s).sum(),
                overhead_s: parts.iter().map(|part| part.overhead_s).sum(),
            });
        if self.missing.is_empty() {
            return Body::Finished(sum);
        }
        let reasons = self.faults().take(1);
        let reasons = reasons.chain(parts.iter().filter_map(unfinished));
        Body::Interrupted(InterruptedRecord {
            reason: reasons.collect::<Vec<_>>().join("; "),
            wall_s: sum.wall_s,
        })
    }
}

/// Files of images, each with the folder that it is taken of.
#[derive(Default)]
struct Carried {
    /// PNG files that records name.
    shown: BTreeMap<String, PathBuf>,
    /// What linear images are called that may stand beside them, without the ending.
    linear: BTreeMap<String, PathBuf>,
}

impl Carried {
    fn add(&mut self, line: &Line, dir: &Path) {
        let of_line = Pictures::of(line);
        let linear = of_line.linear.into_iter().chain(of_line.spread);
        for (all, names) in [
            (&mut self.shown, of_line.shown),
            (&mut self.linear, linear.collect()),
        ] {
            for name in names {
                all.entry(name).or_insert_with(|| dir.to_owned());
            }
        }
    }

    /// Copies all of them; how many are named and not there.
    fn write(&self, out: &Path) -> Result<usize, RunError> {
        let linear = self.linear.iter().flat_map(|(stem, dir)| {
            FileFormat::linear().map(move |format| (format!("{stem}.{}", format.ending), dir))
        });
        let linear = linear.filter(|(name, dir)| dir.join(name).is_file());
        let shown = self.shown.iter().map(|(name, dir)| (name.clone(), dir));
        let mut absent = 0;
        for (name, dir) in shown.chain(linear) {
            let target = out.join(&name);
            let Ok(bytes) = fs::read(dir.join(&name)) else {
                absent += 1;
                continue;
            };
            let folder = target.parent().unwrap_or(out);
            fs::create_dir_all(folder).map_err(|e| unwritten(folder, &e))?;
            write_atomic(&target, &bytes).map_err(|e| unwritten(&target, &e))?;
        }
        Ok(absent)
    }
}

fn unwritten(path: &Path, error: &std::io::Error) -> RunError {
    input(format!("cannot write {}: {error}", path.display()))
}

fn write(
    out: &Path,
    lines: &[Line],
    pictures: &Carried,
    merged: &mut Merged,
) -> Result<(), RunError> {
    let records = records_file(out);
    if fs::symlink_metadata(&records).is_ok() {
        return Err(input(format!(
            "{} holds the results of another run; choose another folder with --out",
            records.display()
        )));
    }
    let absent = pictures.write(out)?;
    if absent > 0 {
        merged.notes.push(format!(
            "{absent} pictures that the records name are not in their folders"
        ));
    }
    let text = text_of(lines).map_err(|e| input(format!("a record cannot be written: {e}")))?;
    write_atomic(&records, text.as_bytes()).map_err(|e| unwritten(&records, &e))
}

#[cfg(test)]
#[path = "merge_tests.rs"]
mod tests;

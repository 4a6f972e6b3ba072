//! Records sorted by subject: scene, integrator, sampler.

use super::names::Names;
use super::plot::marker::STRUCTURES;
use super::samplers::MeasuredSampler;
use super::values::Value;
use raystone_core::params::Variant;
use raystone_record::figure::{self, EPO, Figure};
use raystone_record::*;
use raystone_stats::bias::BiasVerdict;
use raystone_stats::comparison::LogFigure;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Deref;

/// Everything a run recorded.
// Many fields: one for each kind of line.
#[derive(Debug, Default)]
pub struct RunData<'a> {
    /// First line, if it was written.
    pub run: Option<&'a RunRecord>,
    /// Last line, if the run ended.
    pub finished: Option<&'a FinishedRecord>,
    /// Last line of a run that was ended early.
    pub interrupted: Option<&'a InterruptedRecord>,
    /// Problems outside the measurements.
    pub warnings: Vec<&'a SkippedRecord>,
    /// Scenes in the order in which they first appear.
    pub scenes: Vec<SceneGroup<'a>>,
    /// Dumped streams.
    pub streams: Vec<Recorded<'a, StreamRecord>>,
    /// Verdicts on integrators.
    pub paths: Vec<Recorded<'a, PathsRecord>>,
    /// Cells of measurements whose figures are readings alone.
    pub measured: Vec<Recorded<'a, MeasuredRecord>>,
    /// Cells left out.
    pub skipped: Vec<&'a SkippedRecord>,
    /// The lines that it was sorted from.
    pub lines: &'a [Line],
    /// Failures without a record of their own kind.
    pub failed: Vec<&'a SkippedRecord>,
    /// The cell that each line belongs to.
    by_line: Cells<'a>,
    /// The last word on each cell; empty in old records.
    pub cells: BTreeMap<&'a str, &'a CellRecord>,
    /// Names of competitors.
    pub names: Names,
    /// Every structure of the run; the index is its look in all plots.
    pub structures: Vec<String>,
    /// Every sampler of the run; the index is its look in all plots.
    pub samplers: Vec<String>,
}

/// The records of one scene.
#[derive(Debug)]
pub struct SceneGroup<'a> {
    /// Name or path.
    pub name: &'a str,
    /// The scene itself.
    pub record: Option<&'a SceneRecord>,
    /// Structures in the order measured.
    pub structures: Vec<Measured<'a, StructureRecord>>,
    /// External ray casters in the order measured.
    pub peers: Vec<Recorded<'a, PeerRecord>>,
    /// Structures that were updated from frame to frame.
    pub animations: Vec<Measured<'a, AnimationRecord>>,
    /// One per integrator, triangle test and box test.
    pub views: Vec<View<'a>>,
}

/// A scene under one integrator, triangle test and box test: images with one reference.
#[derive(Debug)]
pub struct View<'a> {
    /// The common key of its images.
    key: Key,
    /// The integrator, with all that distinguishes this view from others.
    pub name: String,
    /// The fault that the check of the integrator found with single paths.
    pub paths_fault: Option<String>,
    /// The reference image.
    pub reference: Option<Recorded<'a, ReferenceRecord>>,
    /// Samplers in the order in which they first appear.
    pub samplers: Vec<MeasuredSampler<'a>>,
    /// Times of full cells.
    pub times: Vec<Measured<'a, TimeRecord>>,
    /// Coherence of full cells.
    pub coherence: Vec<Measured<'a, CoherenceRecord>>,
}

/// A measurement of a structure, alone or with a sampler; reads like the record.
#[derive(Debug)]
pub struct Measured<'a, T> {
    /// Its subject. With the driver's checks off the structure is another competitor, with a label of its own.
    pub key: Key,
    /// Name of the structure: among all of the scene, or among those that one view was timed with.
    pub structure: String,
    /// Name of the sampler that it was timed with.
    pub sampler: String,
    /// Its kernels and features.
    pub ran: &'a Ran,
    /// Its cell, if a line names it.
    pub cell: Option<&'a CellRecord>,
    /// The record.
    pub body: &'a T,
}

impl<'a, T> Measured<'a, T> {
    /// Returns its figures, from its readings; all of this kind on its scene are measured in turns in the same
    /// rounds.
    pub(crate) fn values(
        &self,
        data: &RunData<'a>,
        kind: &str,
        readings: Vec<Reading>,
    ) -> Vec<Value<'a>> {
        let value = |reading| {
            Value::of_reading(data, &self.key, reading).measured(kind, self.ran, self.cell)
        };
        readings.into_iter().map(value).collect()
    }

    /// Returns its times, round by round; see [`sitting`].
    pub(crate) fn rounds(&self, kind: &str, ms: &[f64]) -> Option<LogFigure> {
        LogFigure::of_rounds(&sitting(kind, &self.key, self.cell), ms)
    }
}

/// Kinds of rounds of their own: structures with the rays of all classes, full cells, compactions.
pub(crate) const RAYS: &str = "rays";
pub(crate) const FULL_CELLS: &str = "full cells";

/// Returns the common name of times that were measured in the same rounds: by one process, on one scene with one triangle
/// test and box test, all of one kind in turns. Empty if unknown: records of older programs do not hold their time, so
/// that their rounds may be those of several runs.
pub(crate) fn sitting(kind: &str, key: &Key, cell: Option<&CellRecord>) -> String {
    let Some(cell) = cell.filter(|cell| cell.run_began_unix_s > 0) else {
        return String::new();
    };
    format!(
        "{kind}\n{}\n{}\n{}",
        cell.run_began_unix_s,
        cell.inputs.device,
        world(key)
    )
}

/// Returns the common name of cells whose rays meet the same triangles.
pub(crate) fn world(key: &Key) -> String {
    [axis::SCENE, axis::TRIANGLE, axis::BOX_TEST]
        .map(|axis| key.label(axis))
        .join("\n")
}

/// The cell that each line belongs to, by the line's hash.
type Cells<'a> = HashMap<&'a str, &'a CellRecord>;

/// Returns the cells of these lines.
fn cells_of<'l>(lines: &'l [Line]) -> Cells<'l> {
    let cells = all_of::<CellRecord>(lines).map(|cell| cell.body);
    let hashes = |cell: &'l CellRecord| cell.lines.iter().map(move |hash| (&**hash, cell));
    cells.flat_map(hashes).collect()
}

impl<T> Deref for Measured<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.body
    }
}

/// Axes that the images of a view share.
const VIEW_AXES: [&str; 4] = [
    axis::SCENE,
    axis::INTEGRATOR,
    axis::TRIANGLE,
    axis::BOX_TEST,
];

/// Axes that distinguish the structures of a scene.
pub(crate) const STRUCTURE_AXES: [&str; 6] = [
    axis::ACCEL,
    axis::KERNELS,
    axis::TRIANGLE,
    axis::BOX_TEST,
    axis::WORKGROUP,
    axis::LOAD,
];

/// Axes that distinguish the samplers of a view.
pub(crate) const SAMPLER_ROW: [&str; 4] = [
    axis::SEQUENCE,
    axis::DECORRELATION,
    axis::KERNELS,
    axis::OFFSET,
];

/// Axes of a sampler's errors, on which an image depends: all but the structure.
pub(crate) const SAMPLER_AXES: [&str; 8] = [
    axis::SCENE,
    axis::INTEGRATOR,
    axis::SEQUENCE,
    axis::DECORRELATION,
    axis::KERNELS,
    axis::TRIANGLE,
    axis::BOX_TEST,
    axis::OFFSET,
];

/// Returns the key of a line; a structure without the driver's checks has another label, and is chosen by the same name.
pub(crate) fn competitor(line: &Line) -> Key {
    let Some(accel) = line.key.get(axis::ACCEL).filter(|_| line.ran.unchecked) else {
        return line.key.clone();
    };
    let unchecked = Variant {
        label: format!("{accel} (unchecked)"),
        ..accel.clone()
    };
    line.key.clone().with_variant(axis::ACCEL, &unchecked)
}

impl<'a> RunData<'a> {
    /// Sorts the lines. Of two lines on the same thing the later one holds.
    pub fn new(lines: &'a [Line]) -> Self {
        let mut data = Self {
            names: Names::new(lines),
            lines,
            by_line: cells_of(lines),
            ..Self::default()
        };
        lines.iter().for_each(|line| data.add(line));
        for reference in all_of(lines) {
            data.refer_to(reference);
        }
        data.doubt_integrators();
        data.name_competitors();
        data.test_biases_together();
        data
    }

    /// Puts one line in its place.
    fn add(&mut self, line: &'a Line) {
        match &line.body {
            Body::Run(record) => {
                // The ends of earlier runs are not those of this one, which resumed them.
                (self.run, self.finished, self.interrupted) = (Some(record), None, None);
            }
            Body::Finished(record) => self.finished = Some(record),
            Body::Interrupted(record) => self.interrupted = Some(record),
            Body::Warning(record) => self.warnings.push(record),
            Body::Skipped(record) => self.skipped.push(record),
            Body::Failed(record) => self.failed.push(record),
            Body::Stream(record) => put(&mut self.streams, line.of(record), |a, b| {
                a.key == b.key && a.dimensions == b.dimensions
            }),
            Body::Measured(record) => put(&mut self.measured, line.of(record), |a, b| {
                a.key == b.key && a.measurement == b.measurement
            }),
            Body::Spectrum(record) => self.sampler(&line.key).spectrum = Some(record),
            Body::Bias(record) => self.sampler(&line.key).bias = Some(record.clone()),
            Body::Scene(record) => self.scene(line.key.label(axis::SCENE)).record = Some(record),
            Body::Animation(record) => {
                let measured = self.of_structure(line, record);
                let scene = self.scene(line.key.label(axis::SCENE));
                put(&mut scene.animations, measured, |a, b| a.key == b.key)
            }
            Body::Structure(record) => {
                let measured = self.of_structure(line, record);
                let scene = self.scene(line.key.label(axis::SCENE));
                put(&mut scene.structures, measured, |a, b| a.key == b.key)
            }
            Body::Peer(record) => {
                let scene = self.scene(line.key.label(axis::SCENE));
                put(&mut scene.peers, line.of(record), |a, b| a.key == b.key)
            }
            Body::Reference(_) | Body::Kernels(_) => {}
            Body::Cell(record) => {
                self.cells.insert(&record.unit, record);
            }
            Body::Paths(record) => put(&mut self.paths, line.of(record), |a, b| a.key == b.key),
            Body::Time(record) => {
                let measured = self.of_cell(line, record);
                let view = self.view(&line.key);
                put(&mut view.times, measured, |a, b| a.key == b.key);
            }
            Body::Coherence(record) => {
                let measured = self.of_cell(line, record);
                let view = self.view(&line.key);
                put(&mut view.coherence, measured, |a, b| a.key == b.key);
            }
            Body::Error(record) => {
                let replicates = &mut self.sampler(&line.key).replicates;
                put(replicates, record, |a, b| a.replicate == b.replicate);
            }
        }
    }

    /// Returns the measurement of a structure alone.
    fn of_structure<T>(&self, line: &'a Line, body: &'a T) -> Measured<'a, T> {
        let key = competitor(line);
        Measured {
            structure: self.names.structure(&key),
            sampler: String::new(),
            ran: &line.ran,
            cell: self.cell_of(&line.hash),
            key,
            body,
        }
    }

    /// Returns the measurement of a full cell.
    fn of_cell<T>(&mut self, line: &'a Line, body: &'a T) -> Measured<'a, T> {
        let key = competitor(line);
        Measured {
            structure: key.label(axis::ACCEL).to_owned(),
            sampler: self.sampler(&line.key).name.clone(),
            ran: &line.ran,
            cell: self.cell_of(&line.hash),
            key,
            body,
        }
    }

    /// Tests the samplers of a run together: each was tested at its share of the run's level; those found biased
    /// release theirs, and the others share the level anew, until no more are found (Holm 1979; the chance that any
    /// sampler without bias is called biased stays below the level).
    fn test_biases_together(&mut self) {
        let views = self.scenes.iter_mut().flat_map(|scene| &mut scene.views);
        let samplers = views.flat_map(|view| &mut view.samplers);
        let biases = samplers.filter_map(|sampler| sampler.bias.as_mut());
        let mut tested: Vec<&mut BiasRecord> = biases.filter(|bias| !bias.by_design).collect();
        loop {
            let is_biased = |bias: &&mut BiasRecord| bias.verdict == BiasVerdict::Biased;
            let found = tested.iter().filter(|bias| is_biased(bias)).count() as f64;
            let is_next = |bias: &&mut BiasRecord| {
                let (Some(p), Some(level)) = (bias.p_of_all, bias.alpha_of_run) else {
                    return false;
                };
                let left = (level / bias.alpha).round() - found;
                bias.verdict == BiasVerdict::NoBiasFound && p <= level / left.max(1.0)
            };
            let Some(next) = tested.iter_mut().find(|bias| is_next(bias)) else {
                return;
            };
            next.verdict = BiasVerdict::Biased;
        }
    }

    /// Assigns a reference to every view that it belongs to. One whose value is known was not rendered, so that it
    /// belongs to every test.
    fn refer_to(&mut self, reference: Recorded<'a, ReferenceRecord>) {
        let scene = self.scene(reference.key.label(axis::SCENE));
        let is_of = |view: &&mut View| {
            let fits = |axis: &str| match reference.key.label(axis) {
                "" => true,
                label => label == view.key.label(axis),
            };
            VIEW_AXES.into_iter().all(fits)
        };
        let mut of_no_view = true;
        for view in scene.views.iter_mut().filter(is_of) {
            view.reference = Some(reference);
            of_no_view = false;
        }
        if of_no_view {
            self.view(reference.key).reference = Some(reference);
        }
    }

    /// Gives views the faults found with single paths of their integrators.
    fn doubt_integrators(&mut self) {
        let views = self.scenes.iter_mut().flat_map(|scene| &mut scene.views);
        for view in views {
            let is_its = |p: &&Recorded<PathsRecord>| {
                p.key.agrees(&view.key, &[axis::SCENE, axis::INTEGRATOR])
            };
            let faults = self.paths.iter().filter(is_its);
            view.paths_fault = faults.filter_map(|p| p.fault.clone()).next();
        }
    }

    fn name_competitors(&mut self) {
        let structures = self.scenes.iter().flat_map(|scene| {
            let measured = scene.structures.iter().map(|s| s.structure.clone());
            measured.chain(scene.views.iter().flat_map(View::timed_structures))
        });
        let of_views = self.views().flat_map(|(_, view)| &view.samplers);
        let of_streams = self.streams.iter().map(|s| self.names.sampler(s.key));
        let samplers = of_views.map(|s| s.name.clone()).chain(of_streams);
        let samplers = without_repeats(samplers.collect());
        self.structures = without_repeats(structures.collect());
        self.samplers = samplers;
    }

    /// Returns the row of a figure in the table; of an undescribed one only the id is known.
    pub fn figure(&self, id: &str) -> Cow<'a, Figure> {
        let from_outside = || self.run.iter().flat_map(|run| &run.figures);
        let unknown = || Figure {
            id: id.to_owned().into(),
            title: id.to_owned().into(),
            ..EPO.clone()
        };
        let known = figure::find(id).or_else(|| from_outside().find(|figure| figure.id == id));
        known.map_or_else(|| Cow::Owned(unknown()), Cow::Borrowed)
    }

    /// Returns the cell that a line with this hash belongs to.
    pub(crate) fn cell_of(&self, hash: &str) -> Option<&'a CellRecord> {
        self.by_line.get(hash).copied()
    }

    /// Returns the look of a structure in plots.
    pub(crate) fn structure_look(&self, name: &str) -> usize {
        STRUCTURES + place(&self.structures, name)
    }

    /// Returns the look of a sampler in plots.
    pub(crate) fn sampler_look(&self, name: &str) -> usize {
        place(&self.samplers, name) % STRUCTURES
    }

    fn scene(&mut self, name: &'a str) -> &mut SceneGroup<'a> {
        let new = || SceneGroup {
            name,
            record: None,
            structures: Vec::new(),
            peers: Vec::new(),
            animations: Vec::new(),
            views: Vec::new(),
        };
        find_or_push(&mut self.scenes, |scene| scene.name == name, new)
    }

    fn view(&mut self, key: &'a Key) -> &mut View<'a> {
        let name = self.names.view(key);
        let new = || View {
            key: key.only(&VIEW_AXES),
            name: name.clone(),
            paths_fault: None,
            reference: None,
            samplers: Vec::new(),
            times: Vec::new(),
            coherence: Vec::new(),
        };
        let views = &mut self.scene(key.label(axis::SCENE)).views;
        let is_it = |view: &View| view.name == name && view.key.agrees(key, &VIEW_AXES);
        find_or_push(views, is_it, new)
    }

    fn sampler(&mut self, key: &'a Key) -> &mut MeasuredSampler<'a> {
        let name = self.names.sampler(key);
        let new = || MeasuredSampler {
            key: key.only(&SAMPLER_AXES),
            name,
            replicates: Vec::new(),
            means: Default::default(),
            bias: None,
            spectrum: None,
        };
        let samplers = &mut self.view(key).samplers;
        find_or_push(samplers, |s| s.key.agrees(key, &SAMPLER_AXES), new)
    }

    /// Returns the cells of one of the measurements whose figures are readings alone.
    pub(crate) fn measured_by(&self, name: &str) -> Vec<Recorded<'a, MeasuredRecord>> {
        let cells = self.measured.iter().filter(|cell| cell.measurement == name);
        cells.copied().collect()
    }

    /// Returns the starts of the runs in which times were measured: several after a run that was resumed, or merged
    /// from parts.
    pub(crate) fn sittings(&self) -> BTreeSet<u64> {
        let cells = all_of::<CellRecord>(self.lines);
        let timed = cells.filter(|cell| !cell.inputs.device.is_empty());
        timed.map(|cell| cell.run_began_unix_s).collect()
    }

    /// Returns every view with its scene.
    pub fn views(&self) -> impl Iterator<Item = (&SceneGroup<'a>, &View<'a>)> {
        self.scenes
            .iter()
            .flat_map(|scene| scene.views.iter().map(move |view| (scene, view)))
    }
}

impl<'a> View<'a> {
    /// Returns the times that may be used.
    pub(crate) fn valid_times(&self) -> impl Iterator<Item = &Measured<'a, TimeRecord>> {
        self.times.iter().filter(|time| time.is_valid())
    }

    /// Returns the names of the structures that were timed, in the order measured.
    pub(crate) fn timed_structures(&self) -> Vec<String> {
        let names = self.times.iter().map(|time| time.structure.clone());
        without_repeats(names.collect())
    }

    /// Returns the time of a cell, unless it failed.
    pub fn time(&self, structure: &str, sampler: &str) -> Option<&Measured<'_, TimeRecord>> {
        self.valid_times()
            .find(|time| time.structure == structure && time.sampler == sampler)
    }

    /// Returns the milliseconds per spp of [`View::time`].
    pub fn ms_per_spp(&self, structure: &str, sampler: &str) -> Option<Interval> {
        self.time(structure, sampler)?.ms_per_spp
    }

    /// Returns the structure under which samplers are compared per second: of those timed with the most samplers the
    /// one with the least geometric mean of the times.
    pub(crate) fn fastest_structure(&self) -> Option<String> {
        let score = |name: &String| {
            let samplers = self.samplers.iter();
            let times = samplers.filter_map(|s| self.ms_per_spp(name, &s.name));
            let logs: Vec<f64> = times.map(|ms| ms.value.ln()).collect();
            (logs.len(), logs.iter().sum::<f64>() / logs.len() as f64)
        };
        let names = self.timed_structures().into_iter();
        let scored = names.map(|name| (score(&name), name));
        scored
            .filter(|((count, _), _)| *count > 0)
            .min_by(|((n, a), _), ((m, b), _)| m.cmp(n).then(a.total_cmp(b)))
            .map(|(_, name)| name)
    }
}

fn place(names: &[String], name: &str) -> usize {
    let mut names = names.iter();
    names.position(|known| known == name).unwrap_or(0)
}

/// Returns the items, each once, in their order.
pub fn without_repeats<T: PartialEq>(items: Vec<T>) -> Vec<T> {
    let mut kept: Vec<T> = Vec::new();
    for item in items {
        if !kept.contains(&item) {
            kept.push(item);
        }
    }
    kept
}

/// Items that have the same key together, in the order of the first of each.
pub(crate) fn grouped<K: PartialEq, T>(
    items: impl IntoIterator<Item = T>,
    key: impl Fn(&T) -> K,
) -> Vec<(K, Vec<T>)> {
    let mut groups: Vec<(K, Vec<T>)> = Vec::new();
    for item in items {
        let key = key(&item);
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, group)) => group.push(item),
            None => groups.push((key, vec![item])),
        }
    }
    groups
}

fn put<T>(list: &mut Vec<T>, item: T, same: impl Fn(&T, &T) -> bool) {
    match list.iter_mut().find(|old| same(old, &item)) {
        Some(old) => *old = item,
        None => list.push(item),
    }
}

fn find_or_push<T>(
    list: &mut Vec<T>,
    is_it: impl Fn(&T) -> bool,
    new: impl FnOnce() -> T,
) -> &mut T {
    let index = list.iter().position(is_it).unwrap_or_else(|| {
        list.push(new());
        list.len() - 1
    });
    &mut list[index]
}

//! Records sorted by what they speak of: scene, integrator, sampler.

use super::format;
use super::samplers::Sampler;
use crate::measure::record::*;
use crate::params::Variant;

/// Everything a run recorded.
#[derive(Debug, Default)]
pub struct RunData<'a> {
    /// First line, if it was written.
    pub run: Option<&'a RunRecord>,
    /// Last line, if the run ended.
    pub finished: Option<&'a FinishedRecord>,
    /// Last line of a run that was ended early.
    pub interrupted: Option<&'a InterruptedRecord>,
    /// What went wrong beside the measuring.
    pub warnings: Vec<&'a SkippedRecord>,
    /// Scenes in the order in which they first appear.
    pub scenes: Vec<SceneGroup<'a>>,
    /// Dumped streams.
    pub streams: Vec<&'a StreamRecord>,
    /// What drawing costs.
    pub costs: Vec<&'a SamplerCostRecord>,
    /// Cells left out.
    pub skipped: Vec<&'a SkippedRecord>,
    /// Cells that failed without a record of their own kind.
    pub failed: Vec<&'a SkippedRecord>,
    /// Every structure of the run; the index is its look in all plots.
    pub structures: Vec<String>,
    /// Every sampler of the run; the index is its look in all plots.
    pub samplers: Vec<String>,
}

/// What was recorded of one scene.
#[derive(Debug)]
pub struct SceneGroup<'a> {
    /// Name or path.
    pub name: &'a str,
    /// The scene itself.
    pub record: Option<&'a SceneRecord>,
    /// Structures in the order measured.
    pub structures: Vec<&'a StructureRecord>,
    /// One per integrator.
    pub views: Vec<View<'a>>,
}

/// A scene under one integrator: images with one reference.
#[derive(Debug)]
pub struct View<'a> {
    /// Label of the integrator.
    pub integrator: &'a str,
    /// The reference image.
    pub reference: Option<&'a ReferenceRecord>,
    /// Samplers in the order in which they first appear.
    pub samplers: Vec<Sampler<'a>>,
    /// Times of full cells.
    pub times: Vec<&'a TimeRecord>,
}

/// Name of a sampler: `sequence × decorrelation`.
pub fn sampler_name(sequence: &Variant, decorrelation: &Variant) -> String {
    format!("{} × {}", sequence.label, decorrelation.label)
}

/// Name of a structure as measured; with the driver's checks off it is another competitor.
pub fn structure_name(accel: &Variant, runtime_checks: bool) -> String {
    if runtime_checks {
        accel.label.clone()
    } else {
        format!("{} (unchecked)", accel.label)
    }
}

/// Name of the structure of a timed cell, without the kernels: they are in the sampler's name, so that
/// the same structure stands in one row whatever kernels traced it.
pub fn timed_structure(time: &TimeRecord) -> String {
    without_kernels(&time.accel, &time.ran, time.runtime_checks)
}

/// [`structure_name`] without the kernels.
pub fn without_kernels(accel: &Variant, ran: &Ran, runtime_checks: bool) -> String {
    let mut accel = accel.clone();
    accel.label = ran.without_kernels(&accel.label).to_owned();
    structure_name(&accel, runtime_checks)
}

impl<'a> RunData<'a> {
    /// Sorts the lines. Of two lines on the same thing the later one holds.
    pub fn new(lines: &'a [Line]) -> Self {
        let mut data = Self::default();
        for line in lines {
            match &line.record {
                Record::Run(record) => data.run = Some(record),
                Record::Finished(record) => data.finished = Some(record),
                Record::Interrupted(record) => data.interrupted = Some(record),
                Record::Warning(record) => data.warnings.push(record),
                Record::Skipped(record) => data.skipped.push(record),
                Record::Failed(record) => data.failed.push(record),
                Record::Stream(record) => put(&mut data.streams, record, |a, b| {
                    a.sequence == b.sequence
                        && a.decorrelation == b.decorrelation
                        && a.dimensions == b.dimensions
                }),
                Record::SamplerCost(record) => put(&mut data.costs, record, |a, b| {
                    a.sequence == b.sequence && a.decorrelation == b.decorrelation
                }),
                Record::Spectrum(record) => {
                    let view = data.view(&record.scene, &record.integrator);
                    let sampler = view.sampler(&record.sequence, &record.decorrelation);
                    sampler.spectrum = Some(record);
                }
                Record::Scene(record) => data.scene(&record.scene).record = Some(record),
                Record::Structure(record) => {
                    put(&mut data.scene(&record.scene).structures, record, |a, b| {
                        a.accel == b.accel && a.runtime_checks == b.runtime_checks
                    })
                }
                Record::Reference(record) => {
                    data.view(&record.scene, &record.integrator).reference = Some(record);
                }
                Record::Time(record) => {
                    let view = data.view(&record.scene, &record.integrator);
                    view.sampler(&record.sequence, &record.decorrelation);
                    put(&mut view.times, record, |a, b| {
                        a.accel == b.accel
                            && a.runtime_checks == b.runtime_checks
                            && a.sequence == b.sequence
                            && a.decorrelation == b.decorrelation
                    });
                }
                Record::Error(record) => {
                    let view = data.view(&record.scene, &record.integrator);
                    let sampler = view.sampler(&record.sequence, &record.decorrelation);
                    put(&mut sampler.replicates, record, |a, b| {
                        a.replicate == b.replicate
                    });
                }
                Record::Bias(record) => {
                    let view = data.view(&record.scene, &record.integrator);
                    view.sampler(&record.sequence, &record.decorrelation).bias = Some(record);
                }
            }
        }
        data.name_competitors();
        data
    }

    fn name_competitors(&mut self) {
        let (mut structures, mut samplers) = (Vec::new(), Vec::new());
        for scene in &self.scenes {
            let measured = scene
                .structures
                .iter()
                .map(|s| structure_name(&s.accel, s.runtime_checks));
            let timed = scene.views.iter().flat_map(View::timed_structures);
            structures.extend(measured.chain(timed));
            samplers.extend(
                scene
                    .views
                    .iter()
                    .flat_map(|view| &view.samplers)
                    .map(|s| s.name.clone()),
            );
        }
        samplers.extend(
            self.streams
                .iter()
                .map(|s| sampler_name(&s.sequence, &s.decorrelation)),
        );
        self.structures = without_repeats(structures);
        self.samplers = without_repeats(samplers);
    }

    /// Look of a structure in plots.
    pub fn structure_look(&self, name: &str) -> usize {
        self.structures
            .iter()
            .position(|known| known == name)
            .unwrap_or(0)
    }

    /// Look of a sampler in plots.
    pub fn sampler_look(&self, name: &str) -> usize {
        self.samplers
            .iter()
            .position(|known| known == name)
            .unwrap_or(0)
    }

    fn scene(&mut self, name: &'a str) -> &mut SceneGroup<'a> {
        let new = || SceneGroup {
            name,
            record: None,
            structures: Vec::new(),
            views: Vec::new(),
        };
        find_or_push(&mut self.scenes, |scene| scene.name == name, new)
    }

    fn view(&mut self, scene: &'a str, integrator: &'a Variant) -> &mut View<'a> {
        let integrator = integrator.label.as_str();
        let new = || View {
            integrator,
            reference: None,
            samplers: Vec::new(),
            times: Vec::new(),
        };
        find_or_push(
            &mut self.scene(scene).views,
            |view| view.integrator == integrator,
            new,
        )
    }

    /// Every view with its scene.
    pub fn views(&self) -> impl Iterator<Item = (&SceneGroup<'a>, &View<'a>)> {
        self.scenes
            .iter()
            .flat_map(|scene| scene.views.iter().map(move |view| (scene, view)))
    }
}

impl<'a> View<'a> {
    fn sampler(&mut self, sequence: &'a Variant, decorrelation: &'a Variant) -> &mut Sampler<'a> {
        let name = sampler_name(sequence, decorrelation);
        let new = || Sampler {
            name: name.clone(),
            replicates: Vec::new(),
            bias: None,
            spectrum: None,
        };
        find_or_push(&mut self.samplers, |sampler| sampler.name == name, new)
    }

    /// Names of the structures that were timed, in the order measured.
    pub fn timed_structures(&self) -> Vec<String> {
        let names = self.times.iter().map(|time| timed_structure(time));
        without_repeats(names.collect())
    }

    /// The time of a cell, unless it failed.
    pub fn time(&self, structure: &str, sampler: &str) -> Option<&'a TimeRecord> {
        let matches = |time: &&&TimeRecord| {
            is_valid_time(time)
                && timed_structure(time) == structure
                && sampler_name(&time.sequence, &time.decorrelation) == sampler
        };
        self.times.iter().find(matches).copied()
    }

    /// Milliseconds per spp of [`View::time`].
    pub fn ms_per_spp(&self, structure: &str, sampler: &str) -> Option<Interval> {
        self.time(structure, sampler)?.ms_per_spp
    }

    /// The structure under which samplers are compared per second: of those timed with the most
    /// samplers the one with the least geometric mean of the times.
    pub fn fastest_structure(&self) -> Option<String> {
        let score = |name: &String| {
            let logs: Vec<f64> = self
                .samplers
                .iter()
                .filter_map(|sampler| self.ms_per_spp(name, &sampler.name))
                .map(|ms| ms.value.ln())
                .collect();
            (logs.len(), logs.iter().sum::<f64>() / logs.len() as f64)
        };
        let scored = self
            .timed_structures()
            .into_iter()
            .map(|name| (score(&name), name));
        scored
            .filter(|((count, _), _)| *count > 0)
            .min_by(|((n, a), _), ((m, b), _)| m.cmp(n).then(a.total_cmp(b)))
            .map(|(_, name)| name)
    }
}

/// Whether a time may be used: the cell ran, and its image is the one all structures give.
pub fn is_valid_time(time: &TimeRecord) -> bool {
    time.failure.is_none() && time.image_equal && time.ms_per_spp.is_some()
}

impl StructureRecord {
    /// Why the structure gets no figures; `None` when it passed the gate.
    pub fn fault(&self) -> Option<String> {
        if let Some(failure) = &self.failure {
            return Some(failure.clone());
        }
        let Some(gate) = &self.gate else {
            return Some("not gated".into());
        };
        if gate.passed {
            return None;
        }
        let wrong: usize = gate.classes.iter().map(|class| class.wrong).sum();
        let rays: usize = gate.classes.iter().map(|class| class.rays).sum();
        let mut faults = Vec::new();
        if wrong > 0 {
            faults.push(format!(
                "{} of {} rays differ",
                format::count(wrong as u64),
                format::count(rays as u64)
            ));
        }
        if gate.brute_force.wrong + gate.oracle.wrong > 0 {
            faults.push("the judge itself is wrong".into());
        }
        faults.extend(gate.structural.iter().cloned());
        faults.extend(gate.kernel_errors.iter().cloned());
        Some(if faults.is_empty() {
            "gate not passed".into()
        } else {
            faults.join("; ")
        })
    }
}

fn without_repeats(names: Vec<String>) -> Vec<String> {
    let mut kept: Vec<String> = Vec::new();
    for name in names {
        if !kept.contains(&name) {
            kept.push(name);
        }
    }
    kept
}

fn put<'a, T>(list: &mut Vec<&'a T>, item: &'a T, same: impl Fn(&T, &T) -> bool) {
    match list.iter_mut().find(|old| same(old, item)) {
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

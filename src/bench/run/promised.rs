//! Records against the experiment that they are of: seeds, samples, rounds, rays and sizes are those that it asks for. The
//! loops that measure count for themselves, so that one replicate too few would look like a smaller experiment.

use raystone_config::{Experiment, REFERENCE_PARTS};
use raystone_record::{
    AnimationRecord, BiasRecord, Body, Cost, ErrorRecord, FrameRecord, Line, ReferenceRecord,
    SpectrumRecord, StreamRecord, StructureRecord, TimeRecord,
};
use std::collections::BTreeMap;

/// Rays of a class over those asked for: they fill a square of tiles.
const RAYS: [f64; 2] = [0.75, 1.35];

/// What an experiment asks for, and the replicates so far.
pub(super) struct Promised {
    experiment: Experiment,
    /// Replicates of each sampler, by the key of their lines.
    replicates: BTreeMap<String, Seen>,
    /// Sum of the levels at which samplers were tested for a bias.
    levels: f64,
}

/// The replicates of a sampler.
#[derive(Clone, Copy, Default)]
struct Seen {
    written: u32,
    randomised: bool,
}

/// A fault unless both are equal.
fn differs<T: PartialEq + std::fmt::Debug>(what: &str, found: T, asked: T) -> Option<String> {
    (found != asked).then(|| format!("{what}: {found:?} in place of {asked:?}"))
}

impl Promised {
    pub(super) fn of(experiment: &Experiment) -> Self {
        Self {
            experiment: experiment.clone(),
            replicates: BTreeMap::new(),
            levels: 0.0,
        }
    }

    /// What a line holds that the experiment does not ask for; `None` if there is nothing.
    pub(super) fn fault(&mut self, line: &Line) -> Option<String> {
        let found = match &line.body {
            Body::Structure(record) => self.structure(record),
            Body::Time(record) => self.time(record),
            Body::Reference(record) => self.reference(record),
            Body::Error(record) => {
                let seen = self.replicates.entry(line.key.to_string()).or_default();
                let place = seen.written;
                seen.written += 1;
                seen.randomised = record.randomised;
                differs("number of a replicate", record.replicate, place)
                    .or_else(|| self.error(record))
            }
            Body::Spectrum(record) => {
                let written = self.replicates.remove(&line.key.to_string());
                self.spectrum(record, written.unwrap_or_default())
            }
            Body::Bias(record) => self.bias(record),
            Body::Stream(record) => self.stream(record),
            Body::Animation(record) => self.animation(record),
            _ => None,
        };
        found.map(|fault| format!("{}: {fault}", line.key))
    }

    /// All samplers that claim to have no bias share the chance of a false alarm.
    fn bias(&mut self, record: &BiasRecord) -> Option<String> {
        let of_run = record.alpha_of_run?;
        if record.p.is_some() && !record.by_design {
            self.levels += record.alpha;
        }
        (self.levels > of_run * (1.0 + 1e-9)).then(|| {
            format!(
                "samplers are tested for a bias at levels of {} together, which were to be {of_run}",
                self.levels
            )
        })
    }

    fn structure(&self, record: &StructureRecord) -> Option<String> {
        let (rounds, rays) = (self.experiment.timing.rounds, self.experiment.timing.rays);
        let rays = f64::from(rays.max(self.experiment.gate.rays));
        record.timings.iter().find_map(|timing| {
            let class = timing.class.name();
            let [least, most] = RAYS.map(|part| part * rays);
            let is_many = (least..=most).contains(&(timing.rays as f64));
            let other = (!is_many).then(|| format!("{} {class} rays of {rays}", timing.rays));
            differs("rounds", timing.ms.len(), rounds as usize).or(other)
        })
    }

    fn time(&self, record: &TimeRecord) -> Option<String> {
        let experiment = &self.experiment;
        let rounds = (record.failure.is_none())
            .then(|| differs("rounds", record.ms.len(), experiment.timing.rounds as usize));
        (rounds.flatten())
            .or_else(|| differs("samples", record.spp, experiment.timing.spp))
            .or_else(|| differs("size", record.resolution, experiment.run.resolution))
    }

    fn animation(&self, record: &AnimationRecord) -> Option<String> {
        let asked = self.experiment.animation;
        let of_classes = |frame: &FrameRecord| {
            let costs = frame.classes.iter().flat_map(|of| of.cost.clone());
            let own = [frame.refit.clone(), frame.rebuild.clone()];
            own.into_iter().chain(costs).collect::<Vec<Cost>>()
        };
        let rounds = self.experiment.timing.rounds as usize;
        let mut costs = record.frames.iter().flat_map(of_classes);
        differs("animation", Some(record.settings), asked)
            .or_else(|| costs.find_map(|cost| differs("rounds", cost.wall_ms.len(), rounds)))
    }

    fn reference(&self, record: &ReferenceRecord) -> Option<String> {
        let parts = REFERENCE_PARTS;
        let asked = (self.experiment.reference.spp / parts).max(1) * parts;
        let rendered = record.exact.is_none() && record.file.is_none();
        rendered.then(|| differs("samples of the reference", record.spp, asked))?
    }

    fn error(&self, record: &ErrorRecord) -> Option<String> {
        let run = &self.experiment.run;
        let seed = run.seed.wrapping_add(record.replicate);
        let asked: Vec<u32> = run.spp.counts().collect();
        let taken: Vec<u32> = record.errors.iter().map(|at| at.spp).collect();
        let samples = match record.stop {
            // Tiles take different numbers, and others may end early.
            Some(rule) if rule.tile.is_some() => None,
            Some(_) => differs(
                "samples",
                taken.as_slice(),
                &asked[..taken.len().min(asked.len())],
            ),
            None if record.errors.is_empty() => None,
            None => differs("samples", taken.as_slice(), &asked[..]),
        };
        differs("seed", record.seed, seed)
            .or_else(|| differs("size", record.resolution, run.resolution))
            .or(samples)
    }

    fn spectrum(&self, record: &SpectrumRecord, seen: Seen) -> Option<String> {
        let run = &self.experiment.run;
        let written = seen.written;
        let asked = if seen.randomised { run.replicates } else { 1 };
        let most = differs("samples", record.spp, run.spp.max());
        differs("replicates", written, asked)
            .or_else(|| differs("images of replicates", record.replicates, written as usize))
            .or(most.filter(|_| self.experiment.stop.is_none()))
    }

    fn stream(&self, record: &StreamRecord) -> Option<String> {
        let asked = &self.experiment.discrepancy;
        let seeds = if record.randomised { asked.seeds } else { 1 };
        let least = 16.min(asked.points);
        let counts = (0..u32::BITS - 1).map(|bit| 1_u32 << bit);
        let counts = counts.filter(|n| (least..=asked.points).contains(n));
        let counts: Vec<usize> = counts.map(|n| n as usize).collect();
        let taken: Vec<usize> = record.star.iter().map(|at| at.n).collect();
        let is_known = asked.pairs.contains(&record.dimensions) == record.named;
        let pair = (!is_known).then(|| format!("dimensions {:?}", record.dimensions));
        differs("seeds", record.seeds, seeds as usize)
            .or_else(|| differs("points", taken, counts))
            .or(pair)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Registries;
    use super::*;
    use raystone_record::{Key, Ran};

    const TEXT: &str = r#"
        [run]
        resolution = [32, 16]
        replicates = 2
        seed = 7
        spp = [1, 4]
        [axes]
        scene = ["cornell-box"]
        accel = ["bvh"]
        sequence = ["pixel-hash"]
        integrator = ["primary"]
        [reference]
        spp = 80
        [timing]
        rounds = 3
    "#;

    fn line(kind: &str, body: serde_json::Value) -> Line {
        let mut body = body;
        body["kind"] = kind.into();
        let body = serde_json::from_value(body).expect("a body");
        Line::new(Key::default(), Ran::default(), body)
    }

    fn replicate(number: u32, seed: u32, spps: &[u32]) -> Line {
        let at = |spp| serde_json::json!({ "spp": spp, "metrics": {}, "without_part": {}, "partial_net": false });
        let errors: Vec<_> = spps.iter().map(at).collect();
        line(
            "error",
            serde_json::json!({
                "randomised": true, "replicate": number, "seed": seed, "resolution": [32, 16], "errors": errors,
                "non_finite_pixels": 0, "image_hash": "", "image": null, "error_map": null,
            }),
        )
    }

    fn spectrum(replicates: usize) -> Line {
        let none = serde_json::Value::Null;
        line(
            "spectrum",
            serde_json::json!({
                "spp": 4, "replicates": replicates, "power": [], "low_frequency": none, "autocorrelation": none, "filtered": [],
            }),
        )
    }

    #[test]
    fn what_an_experiment_does_not_ask_for_is_told() {
        let catalogue = Registries::default().catalogue();
        let experiment = Experiment::parse(TEXT, "text", &[], &catalogue).expect("an experiment");
        let said = |lines: &[Line]| {
            let mut promised = Promised::of(&experiment);
            lines
                .iter()
                .find_map(|line| promised.fault(line))
                .unwrap_or_default()
        };
        let right = [
            replicate(0, 7, &[1, 4]),
            replicate(1, 8, &[1, 4]),
            spectrum(2),
        ];
        assert_eq!(said(&right), "");
        let reference = |spp: u32| {
            let body = serde_json::json!({ "spp": spp, "sampler": "", "seconds": 0, "mse": 0, "image": "", "mean": 0 });
            line("reference", body)
        };
        assert_eq!(said(&[reference(80)]), "");
        let bias = |alpha: f64| {
            let body = serde_json::json!({
                "tiles": 4, "rejected": 0, "alpha": alpha, "alpha_of_run": 0.01, "min_p": 0.5, "p_histogram": [], "p": 0.5,
                "verdict": "no-bias-found",
            });
            line("bias", body)
        };
        assert_eq!(said(&[bias(0.005), bias(0.005)]), "");
        for (lines, part) in [
            (vec![replicate(0, 8, &[1, 4])], "seed"),
            (vec![replicate(1, 8, &[1, 4])], "number of a replicate"),
            (vec![replicate(0, 7, &[1, 8])], "samples"),
            (vec![replicate(0, 7, &[1])], "samples"),
            (
                vec![right[0].clone(), spectrum(1)],
                "replicates: 1 in place of 2",
            ),
            (
                vec![right[0].clone(), right[1].clone(), spectrum(1)],
                "images of replicates",
            ),
            (vec![reference(40)], "samples of the reference"),
            (vec![bias(0.01), bias(0.01)], "levels of 0.02 together"),
        ] {
            assert!(said(&lines).contains(part), "{part}: {}", said(&lines));
        }
    }
}

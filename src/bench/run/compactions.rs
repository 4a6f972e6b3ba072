//! Stream compactions: each is checked word by word, then all are timed in the same rounds.

use super::cost::{Cost, Work};
use super::measurement::{Absent, At, Measurement, Preparation, Prepared};
use crate::compaction::{Bench, Inputs, Load, benched, stream};
use crate::timing::{Measured, Samples};
use raystone_config::{Axis, COMPACTIONS, Cell, Experiment, Plan};
use raystone_gpu::{Elapsed, GpuError, Player};
use raystone_record::Reading;
use raystone_record::figure::{
    COMPACTION_GB_PER_S, COMPACTION_KEPT, COMPACTION_LEAST_BYTES, COMPACTION_MELEMENTS_PER_S,
    COMPACTION_NS, COMPACTION_PASSES, COMPACTION_SCRATCH, Figure,
};
use raystone_stats::rates::millions_per_second;
use std::sync::Arc;

pub(super) struct Compactions;

impl Measurement for Compactions {
    fn name(&self) -> &'static str {
        "compaction"
    }

    fn plural(&self) -> &'static str {
        "compactions"
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        let mut cells = plan.benches_on(&[Axis::Integrator, Axis::Kernels]);
        cells.retain(|cell| cell[Axis::Integrator].name.starts_with(COMPACTIONS));
        cells
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!("{:?}", (experiment.run.seed, experiment.timing))
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        let turn = Work {
            elements: f64::from(Load::of(&cell[Axis::Integrator]).elements),
            ..Work::default()
        };
        Work::kernels(1) + cost.timed(turn)
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let mut streams = Streams {
            at,
            cells,
            player: Arc::new(Player::new(&at.device.gpu)),
            uploaded: Vec::new(),
        };
        Box::new(cells.iter().map(move |cell| {
            let ready = streams.prepare(cell)?;
            Ok(Box::new(ready) as Box<dyn Prepared>)
        }))
    }
}

struct Ready {
    load: Load,
    bench: Bench,
}

impl Measured for Ready {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        self.bench.measure()
    }
}

impl Prepared for Ready {
    fn timed(&self) -> Vec<&dyn Measured> {
        vec![self]
    }

    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let samples = samples.into_iter().next().unwrap_or_default();
        let elements = f64::from(self.load.elements);
        let counted: [(&Figure, f64); 4] = [
            (&COMPACTION_PASSES, f64::from(self.bench.runs)),
            (&COMPACTION_KEPT, f64::from(self.bench.kept_elements)),
            (&COMPACTION_LEAST_BYTES, self.bench.least_bytes() as f64),
            (&COMPACTION_SCRATCH, self.bench.scratch_bytes as f64),
        ];
        let time = (samples.ns_per_item(&COMPACTION_NS, elements)?).of_work(format!(
            "{} elements of {} bytes",
            self.load.elements, self.load.bytes
        ));
        let rates = rates(&samples.ms, elements, self.bench.least_bytes() as f64);
        let counted = counted.map(|(figure, value)| Reading::exact(figure, value));
        Ok([time].into_iter().chain(rates).chain(counted).collect())
    }
}

/// Millions of elements a second, and of thousands of bytes.
pub(super) fn rates(ms: &[f64], elements: f64, bytes: f64) -> impl Iterator<Item = Reading> {
    let figures = [
        (&COMPACTION_MELEMENTS_PER_S, elements),
        (&COMPACTION_GB_PER_S, bytes * 1e-3),
    ];
    let rates = figures.map(|(figure, items)| {
        millions_per_second(ms, items).map(|rate| Reading::new(figure, rate))
    });
    rates.into_iter().flatten()
}

/// Streams of equal kind are prefixes of one: share of survivors, buckets, bytes per element.
type Kind = (u64, u32, u32);

struct Streams<'a> {
    at: &'a At<'a>,
    cells: &'a [Cell],
    player: Arc<Player>,
    uploaded: Vec<(Kind, Arc<Inputs>)>,
}

impl Streams<'_> {
    fn prepare(&mut self, cell: &Cell) -> Result<Ready, Absent> {
        let gpu = self.at.gpu(cell)?;
        let registry = &self.at.registries.compactions;
        let method = benched(registry, &cell[Axis::Integrator]).map_err(Absent::Failed)?;
        let load = Load::of(&cell[Axis::Integrator]);
        if let Some(reason) = method.refusal(gpu) {
            return Err(Absent::Refused(reason));
        }
        let kind = (load.valid.to_bits(), method.buckets(), load.bytes);
        let known = self.uploaded.iter().find(|(known, _)| *known == kind);
        let inputs = match known {
            Some((_, inputs)) => Arc::clone(inputs),
            None => {
                let seed = u64::from(self.at.experiment.run.seed);
                let longest = self.longest(kind).unwrap_or(load.elements);
                let flags = stream::flags(longest, load.valid, method.buckets(), seed);
                let inputs = Arc::new(Inputs::upload(gpu, flags, load.bytes)?);
                self.uploaded.push((kind, Arc::clone(&inputs)));
                inputs
            }
        };
        let bench = Bench::new(&self.player, gpu, method, &inputs, [load.elements; 2])?;
        match bench.judge()? {
            Some(fault) => Err(Absent::Failed(fault)),
            None => Ok(Ready { load, bench }),
        }
    }

    /// Length of the longest stream of a kind, which is uploaded; each cell uses a prefix.
    fn longest(&self, kind: Kind) -> Option<u32> {
        let length = |other: &Cell| {
            let load = Load::of(&other[Axis::Integrator]);
            let method = benched(&self.at.registries.compactions, &other[Axis::Integrator]).ok()?;
            let own = (load.valid.to_bits(), method.buckets(), load.bytes);
            (own == kind).then_some(load.elements)
        };
        self.cells.iter().filter_map(length).max()
    }
}

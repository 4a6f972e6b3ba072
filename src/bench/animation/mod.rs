//! Moving scenes: structures of the first frame are refitted or updated to each further one,
//! against a rebuild. Each frame has a reference tracer, which they must match bit by bit.

mod actor;
mod motion;

pub use actor::{Actor, Taken, Way};
pub(crate) use motion::check as check_known;
pub use motion::moved;

use crate::timing::{Measured, interleave};
use raystone_accel::tracer::count_work;
use raystone_accel::{Ask, BuildLog, RayBatch, Space, Traced, Tracer, TriangleSoup};
use raystone_config::Timing;
use raystone_gpu::{ArithmeticProbe, Elapsed, Gpu, GpuError, Stopwatch};
use raystone_record::fault_text;
use raystone_record::{Cost, CountersPerRay, FrameRays, FrameRecord};
use raystone_render::Stage;
use raystone_verify::gate::{ReferenceTracer, gate, timed_fault};
use raystone_verify::rays::RaySet;
use std::cell::RefCell;

/// A frame and its test setup.
pub(crate) struct Frame<'a> {
    /// Frame number.
    pub number: u32,
    /// Triangles of the first frame.
    pub first: &'a TriangleSoup,
    /// The scene in this frame.
    pub stage: &'a Stage,
    /// Rays with their true hits.
    pub reference: &'a ReferenceTracer,
    /// Arithmetic of the adapter.
    pub probe: &'a ArithmeticProbe,
    /// True to keep the driver's runtime checks in kernels.
    pub runtime_checks: bool,
    /// Timing settings.
    pub timing: &'a Timing,
    /// Seed of the round order.
    pub seed: u64,
}

struct Pair {
    traced: [Traced; 2],
    sah: [Option<f64>; 2],
    judged: usize,
}

/// Moves every structure to a frame, on the device with its kernels: correctness first, then costs
/// in the same rounds. A failure affects only that structure.
pub(crate) fn take_over(
    frame: &Frame,
    actors: &[(&Actor, &Gpu)],
) -> Vec<Result<FrameRecord, String>> {
    let pairs = actors.iter().map(|(actor, gpu)| frame.pair(actor, gpu));
    let mut pairs: Vec<Result<Pair, String>> = pairs.collect();
    let mut timed = Vec::new();
    for (place, (actor, gpu)) in actors.iter().enumerate() {
        let Ok(pair) = &pairs[place] else { continue };
        match frame.timed(place, actor, gpu, pair) {
            Ok(items) => timed.extend(items),
            Err(error) => pairs[place] = Err(error.to_string()),
        }
    }
    let failures: Vec<Option<GpuError>> = match interleave(&timed, frame.timing, frame.seed, || {})
    {
        Ok(samples) => samples.into_iter().map(Result::err).collect(),
        Err((_, error)) => {
            let lost = |_: &Timed| Some(GpuError::Lost(error.to_string()));
            timed.iter().map(lost).collect()
        }
    };
    for (item, failure) in timed.iter().zip(failures) {
        let fault = match failure {
            Some(error) => Some(error.to_string()),
            None => item
                .fault(frame)
                .unwrap_or_else(|error| Some(error.to_string())),
        };
        if let Some(fault) = fault {
            pairs[item.actor] = Err(fault);
        }
    }
    let finish = |(place, pair): (usize, Result<Pair, String>)| {
        let own: Vec<&Timed> = timed.iter().filter(|item| item.actor == place).collect();
        let (actor, gpu) = actors[place];
        frame.record(pair?, actor.ways(), gpu, &own)
    };
    pairs.into_iter().enumerate().map(finish).collect()
}

impl Frame<'_> {
    /// Refits and rebuilds a structure, and checks both. A tree refitted on the host must be
    /// bit-identical to that of the device, and is checked through it.
    fn pair(&self, actor: &Actor, gpu: &Gpu) -> Result<Pair, String> {
        let ways = actor.ways();
        let soup = &self.stage.soup;
        let taken = |way: Way| {
            let mut log = BuildLog::with_gpu(gpu);
            let from = actor.start(way, self.first);
            let taken = from.and_then(|from| actor.take(way, from, soup, &mut log));
            taken.map_err(|e| format!("{way:?}: {e}"))
        };
        let refitted = taken(ways[0])?;
        if ways.contains(&Way::Host) {
            match (&refitted, taken(Way::Host)?) {
                (Taken::Tree(device), Taken::Tree(host)) if device.nodes == host.nodes => {}
                _ => return Err("trees refitted on host and device differ".to_owned()),
            }
        }
        let mut judged = 0;
        let mut of = |taken: Taken, name: &str| {
            let at = |fault: String| format!("{name}: {fault}");
            let built = actor.built(taken, soup).map_err(|e| at(e.to_string()))?;
            built.validate(soup).map_err(|e| at(e.to_string()))?;
            let traced = Traced::upload(gpu, &*built).map_err(|e| at(e.to_string()))?;
            judged = self.gate(gpu, &traced).map_err(at)?;
            Ok::<_, String>((traced, built.stats().sah_cost))
        };
        let refitted = of(refitted, "refitted")?;
        let rebuilt = of(taken(Way::Rebuild)?, "rebuilt")?;
        Ok(Pair {
            traced: [refitted.0, rebuilt.0],
            sah: [refitted.1, rebuilt.1],
            judged,
        })
    }

    /// Checks a structure; returns the number of rays.
    fn gate(&self, gpu: &Gpu, traced: &Traced) -> Result<usize, String> {
        let triangles = &self.stage.buffers.triangles;
        let soup = &self.stage.soup;
        let checks = self.runtime_checks;
        let verdict = gate(
            gpu,
            triangles,
            soup,
            traced,
            self.reference,
            self.probe,
            checks,
        );
        let verdict = verdict.map_err(|e| e.to_string())?;
        let reference = self.reference.of(traced.space);
        if verdict.passed {
            Ok(reference.sets.iter().map(|set| set.rays.len()).sum())
        } else {
            Err(fault_text(&verdict))
        }
    }

    fn sets<'s>(&'s self, traced: &Traced) -> impl Iterator<Item = &'s RaySet> {
        let sets = &self.reference.of(traced.space).sets;
        sets.iter().filter(|set| set.is_timed())
    }

    /// All timed work of a structure: ways, then ray classes, each refitted and rebuilt.
    fn timed<'a>(
        &'a self,
        place: usize,
        actor: &'a Actor<'a>,
        gpu: &'a Gpu,
        pair: &Pair,
    ) -> Result<Vec<Timed<'a>>, GpuError> {
        let new = |work| Timed {
            actor: place,
            work,
            notes: RefCell::default(),
        };
        let ways = actor.ways().iter();
        let take = |way: &Way| new(Work::Take(actor, *way, self, gpu));
        let mut items: Vec<Timed> = ways.map(take).collect();
        for set in self.sets(&pair.traced[0]) {
            for traced in &pair.traced {
                let ask = Ask {
                    coherent: set.is_coherent(),
                    runtime_checks: self.runtime_checks,
                    ..set.query().into()
                };
                let triangles = &self.stage.buffers.triangles;
                let batch = Tracer::new(gpu, triangles, traced, ask)?.batch(&set.rays)?;
                items.push(new(Work::Trace(Box::new(batch), set, traced.space)));
            }
        }
        Ok(items)
    }

    /// The record, from [`Frame::timed`] in order.
    fn record(
        &self,
        pair: Pair,
        ways: &[Way],
        gpu: &Gpu,
        timed: &[&Timed],
    ) -> Result<FrameRecord, String> {
        let cost = |item: &Timed| item.cost(self.timing.rounds as usize);
        let of_way = |way: Way| {
            let place = ways.iter().position(|known| *known == way);
            place
                .and_then(|place| timed.get(place))
                .map(|item| cost(item))
        };
        let mut classes = Vec::new();
        for (set, both) in self
            .sets(&pair.traced[0])
            .zip(timed[ways.len()..].chunks(2))
        {
            let mut counters = [None; 2];
            for (counted, traced) in counters.iter_mut().zip(&pair.traced) {
                let triangles = &self.stage.buffers.triangles;
                let work = count_work(gpu, triangles, traced, set.query(), &set.rays);
                let work = work.map_err(|e| e.to_string())?;
                *counted = work.as_deref().map(CountersPerRay::mean_of);
            }
            classes.push(FrameRays {
                class: set.class,
                rays: set.rays.len(),
                counters,
                cost: [0, 1].map(|place| cost(both[place])),
            });
        }
        Ok(FrameRecord {
            frame: self.number,
            judged: pair.judged,
            refit: of_way(ways[0]).unwrap_or_default(),
            refit_on_host: of_way(Way::Host),
            rebuild: of_way(Way::Rebuild).unwrap_or_default(),
            sah: pair.sah,
            classes,
        })
    }
}

enum Work<'a> {
    /// A structure follows a frame.
    Take(&'a Actor<'a>, Way, &'a Frame<'a>, &'a Gpu),
    /// Traces the rays of a class.
    Trace(Box<RayBatch>, &'a RaySet, Space),
}

/// Timed work of an actor, with its times.
struct Timed<'a> {
    actor: usize,
    work: Work<'a>,
    notes: RefCell<Vec<Elapsed>>,
}

impl Work<'_> {
    /// Times by all clocks, excluding setup and teardown.
    fn run(&self) -> Result<Elapsed, GpuError> {
        match self {
            Self::Trace(batch, ..) => batch.trace(),
            Self::Take(actor, way, frame, gpu) => {
                let failed = |e: raystone_accel::AccelError| GpuError::Driver(e.to_string());
                let mut log = BuildLog::with_gpu(gpu);
                let from = actor.start(*way, frame.first).map_err(failed)?;
                let watch = Stopwatch::start();
                let taken = actor.take(*way, from, &frame.stage.soup, &mut log);
                let elapsed = watch.elapsed();
                drop(taken.map_err(failed)?);
                Ok(elapsed)
            }
        }
    }
}

impl Measured for Timed<'_> {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        let elapsed = self.work.run()?.measured()?;
        self.notes.borrow_mut().push(elapsed);
        Ok(elapsed)
    }
}

/// Cost over the last rounds.
pub(crate) fn last_rounds(notes: &[Elapsed], rounds: usize) -> Cost {
    let kept = &notes[notes.len().saturating_sub(rounds)..];
    Cost {
        processor_ms: kept.iter().filter_map(|n| n.cpu_ms).collect(),
        wall_ms: kept.iter().map(|n| n.wall_ms).collect(),
        passes_ms: kept.iter().filter_map(|n| n.gpu_ms).collect(),
    }
}

impl Timed<'_> {
    fn cost(&self, rounds: usize) -> Cost {
        last_rounds(&self.notes.borrow(), rounds)
    }

    /// Error in the answers of the last round.
    fn fault(&self, frame: &Frame) -> Result<Option<String>, GpuError> {
        let Work::Trace(batch, set, space) = &self.work else {
            return Ok(None);
        };
        timed_fault(
            batch,
            set,
            &frame.stage.soup,
            *space,
            frame.probe.is_exact(),
        )
    }
}

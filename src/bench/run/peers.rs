//! Ray casters of others, traced in the rounds of the structures.

use super::cost::{Cost, Work};
use super::error::RunError;
use super::measurement::{Measurement, Through};
use super::session::{End, Session};
use super::structures::Structures;
use super::world::World;
use crate::peers::{BuiltPeer, PeerBatch};
use crate::timing::{Measured, Samples, Watch};
use raystone_config::{Axis, Cell, Experiment, Plan};
use raystone_gpu::{Elapsed, GpuError};
use raystone_record::{Body, Key, Line, PeerRecord, PeerTiming, Ran};
use raystone_stats::rates::millions_per_second;
use raystone_verify::peer_check::differences;
use raystone_verify::rays::RaySet;

/// Speed of external tracers.
pub(super) struct Peers;

impl Measurement for Peers {
    fn name(&self) -> &'static str {
        "peer"
    }

    fn plural(&self) -> &'static str {
        "external tracers"
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        plan.peers.clone()
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn rounds_of(&self, cell: &Cell) -> (&'static str, Cell) {
        Structures.rounds_of(cell)
    }

    fn settings(&self, experiment: &Experiment, reference_file: &str) -> String {
        Structures.settings(experiment, reference_file)
    }

    fn cost(&self, _: &Cell, cost: &Cost) -> Work {
        cost.timed(Work::rays(cost.experiment.timing.rays)) * cost.ray_classes()
    }

    fn through(&self) -> Through {
        Through::None
    }
}

/// A peer of a world, or why there is none.
pub(super) struct Built<'a> {
    cell: Cell,
    peer: Option<Box<dyn BuiltPeer + 'a>>,
    record: PeerRecord,
}

/// A class of rays through a peer.
pub(super) struct Timed<'a> {
    /// Place among the built.
    place: usize,
    set: &'a RaySet,
    batch: Box<dyn PeerBatch + 'a>,
    watch: Watch,
}

impl Measured for Timed<'_> {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        let elapsed = self.batch.trace()?;
        let answers = self.batch.hits()?;
        self.watch
            .note(blake3::hash(bytemuck::cast_slice(&answers)));
        Ok(elapsed)
    }
}

/// Builds the peers of a world that are not recorded yet.
pub(super) fn build<'a>(session: &mut Session, world: &'a World) -> Vec<Built<'a>> {
    let cells = session.plan.peers.iter().filter(|c| c.is_on(&world.cell));
    let mut cells: Vec<Cell> = cells.cloned().collect();
    cells.retain(|cell| !session.ledger.is_done(&cell.to_string()));
    let mut built = Vec::new();
    for cell in cells {
        session.say(format!("{cell}: build"));
        let kind = session
            .registries
            .peers
            .named("peer", &cell[Axis::Peer].name);
        let peer = kind.and_then(|kind| {
            let build = || kind.build(world.gpu, &world.soup);
            session.clock.time("build", build)
        });
        let mut record = PeerRecord::default();
        match &peer {
            Ok(peer) => (record.about, record.build_ms) = (peer.about(), peer.build_ms()),
            Err(reason) => record.absent = Some(reason.clone()),
        }
        let peer = peer.ok();
        built.push(Built { cell, peer, record });
    }
    built
}

/// The recorded rays in the hands of each peer; who cannot take them is absent.
pub(super) fn batches<'a>(
    built: &'a [Built<'_>],
    world: &'a World,
) -> (Vec<Timed<'a>>, Vec<Option<String>>) {
    let (mut timed, mut refused) = (Vec::new(), vec![None; built.len()]);
    for (place, one) in built.iter().enumerate() {
        let sets = world.reference.sets.iter().filter(|set| set.is_timed());
        for (set, peer) in sets.zip(std::iter::repeat(&one.peer)) {
            match peer.as_ref().map(|peer| peer.batch(set.query(), &set.rays)) {
                Some(Ok(batch)) => timed.push(Timed {
                    place,
                    set,
                    batch,
                    watch: Watch::default(),
                }),
                Some(Err(reason)) => refused[place] = Some(reason),
                None => {}
            }
        }
    }
    (timed, refused)
}

/// What was measured of a class, if its answers are right.
fn timing(
    world: &World,
    timed: &Timed,
    samples: Result<Samples, GpuError>,
) -> Result<Option<PeerTiming>, String> {
    let (set, text) = (timed.set, |error: GpuError| error.to_string());
    let wrong = |reason: String| format!("{} rays: {reason}", set.class.name());
    if let Some(fault) = timed.watch.fault() {
        return Err(wrong(fault));
    }
    let samples = samples.map_err(text)?;
    let hits = timed.batch.hits().map_err(text)?;
    let found = differences(&world.scene, &world.soup, set, &hits).map_err(wrong)?;
    let rate = millions_per_second(&samples.ms, set.rays.len() as f64);
    Ok(rate.map(|mrays_s| PeerTiming {
        class: set.class,
        rays: set.rays.len(),
        ms: samples.ms,
        wall_ms: samples.wall_ms,
        cpu_ms: samples.cpu_ms,
        mrays_s,
        unlike: found.unlike,
        judged: found.judged,
        farthest: found.farthest,
    }))
}

/// What was measured of all classes: the place of the peer, and its figures or what is wrong with it.
pub(super) fn judged(
    world: &World,
    timed: Vec<Timed>,
    samples: Vec<Result<Samples, GpuError>>,
) -> Vec<(usize, Result<Option<PeerTiming>, String>)> {
    let pairs = timed.iter().zip(samples);
    pairs
        .map(|(item, samples)| (item.place, timing(world, item, samples)))
        .collect()
}

/// Writes what was found of each: why it was refused, or all of its classes.
pub(super) fn write(
    session: &mut Session,
    world: &World,
    built: Vec<Built>,
    refused: Vec<Option<String>>,
    found: Vec<(usize, Result<Option<PeerTiming>, String>)>,
) -> Result<(), RunError> {
    let mut found = found.into_iter().peekable();
    for (place, (one, refused)) in built.into_iter().zip(refused).enumerate() {
        let mut record = one.record;
        record.absent = record.absent.or(refused);
        while let Some((_, timing)) = found.next_if(|(of, _)| *of == place) {
            match timing {
                Ok(timing) => record.timings.extend(timing),
                Err(fault) => record.failure = record.failure.or(Some(fault)),
            }
        }
        if record.failure.is_some() || record.absent.is_some() {
            record.timings.clear();
        }
        let end = End {
            failure: record.failure.clone(),
            scene: &world.scene.hash,
            shared: &["peers"],
            ..End::default()
        };
        let line = Line::new(Key::from(&one.cell), Ran::default(), Body::Peer(record));
        session.conclude(&one.cell.to_string(), line, end)?;
    }
    Ok(())
}

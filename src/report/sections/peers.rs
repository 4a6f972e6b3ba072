//! External ray casters beside the structures: times of the processors, ratios, and differences of their answers. They get no verdict.

use super::specs::PEERS;
use crate::data::{RunData, SceneGroup};
use crate::document::*;
use crate::format;
use crate::values::Value;
use raystone_record::figure::{self, Figure};
use raystone_record::{ClassTiming, Interval, PeerRecord, PeerTiming, Recorded, axis};
use raystone_stats::comparison::LogFigure;
use raystone_stats::statistics::median_interval;

const SPEED: &Figure = &figure::PEER_MRAYS_PER_S;
const COST: &Figure = &figure::CPU_NS_PER_RAY;
const RATIO: &Figure = &figure::CPU_OVER_PEER;
const UNLIKE: &Figure = &figure::UNLIKE_JUDGE;
const FARTHEST: &Figure = &figure::FARTHEST_DISTANCE;

fn ns_per_ray(cpu_ms: &[f64], rays: usize) -> Option<Interval> {
    let ns: Vec<f64> = cpu_ms.iter().map(|ms| ms * 1e6 / rays as f64).collect();
    median_interval(&ns)
}

fn of_peer(peer: &Recorded<PeerRecord>, timing: &PeerTiming) -> Vec<Value<'static>> {
    let key = (peer.key.clone()).with(axis::RAYS, timing.class.name());
    let figures = [
        (SPEED, Some(timing.mrays_s)),
        (COST, ns_per_ray(&timing.cpu_ms, timing.rays)),
        (
            UNLIKE,
            Some(Interval::exact(
                timing.unlike as f64 * 1e6 / timing.rays as f64,
            )),
        ),
        (FARTHEST, Some(Interval::exact(timing.farthest))),
    ];
    Value::known(&key, figures)
}

/// Returns the time of the processors for the same rays, over that of the peer.
fn over(ours: &ClassTiming, theirs: &PeerTiming) -> Option<Interval> {
    let [own, base] = [&ours.cpu_ms, &theirs.cpu_ms].map(|ms| LogFigure::of_times(ms));
    let (own, base) = own.zip(base)?;
    Some(own.compared_with(&base).ratio)
}

/// Returns all figures of a scene's peers, and of its structures against them.
pub fn values(scene: &SceneGroup) -> Vec<Value<'static>> {
    let mut values = Vec::new();
    for peer in &scene.peers {
        values.extend(peer.timings.iter().flat_map(|timing| of_peer(peer, timing)));
    }
    if scene.peers.is_empty() {
        return values;
    }
    for structure in scene.structures.iter().filter(|s| s.fault().is_none()) {
        for ours in &structure.timings {
            let key = (structure.key.clone()).with(axis::RAYS, ours.class.name());
            let cost = ns_per_ray(&ours.cpu_ms, ours.rays);
            values.extend(Value::known(&key, [(COST, cost)]));
            for peer in &scene.peers {
                let mut timings = peer.timings.iter();
                let theirs = timings.find(|t| t.class == ours.class && t.rays == ours.rays);
                let same = peer
                    .key
                    .agrees(&structure.key, &[axis::TRIANGLE, axis::BOX_TEST]);
                let ratio = theirs
                    .filter(|_| same)
                    .and_then(|theirs| over(ours, theirs));
                let key = key.clone().with(axis::PEER, peer.key.label(axis::PEER));
                values.extend(Value::known(&key, [(RATIO, ratio)]));
            }
        }
    }
    values
}

/// Describes a peer, or the reason for its absence.
fn told(peer: &Recorded<PeerRecord>) -> String {
    let name = peer.key.label(axis::PEER);
    match (&peer.absent, &peer.failure) {
        (Some(reason), _) => format!("{name} did not run: {reason}."),
        (_, Some(fault)) => format!("{name} has no figures, since its answers are wrong: {fault}."),
        _ => format!(
            "{name}: {}, built in {} ms.",
            peer.about,
            format::number(peer.build_ms)
        ),
    }
}

/// Returns the tables of a scene; nothing without peers.
pub fn blocks(data: &RunData, scene: &SceneGroup) -> Vec<Block> {
    if scene.peers.is_empty() {
        return Vec::new();
    }
    let about = "Ray casters of others answered the same rays in the same rounds. They are no competitors: their hits may differ from ours by \
                 rounding, where the triangle is another the double-precision oracle has to agree (at most 256 rays a class, spread over all that \
                 differ), and one that is wrong gets no figures. Time of the processors is that of all threads together, for which it does not \
                 matter what else the machine does.";
    let mut blocks = vec![
        Block::Heading("Ray casters of others".into()),
        Block::Paragraph(about.into()),
    ];
    blocks.extend(scene.peers.iter().map(|peer| Block::Paragraph(told(peer))));
    let values = values(scene);
    let timings = scene.peers.iter().flat_map(|peer| &peer.timings);
    let bounds = format::median_bounds(timings.map(|timing| timing.cpu_ms.len()));
    let tables = PEERS.map(|table| table.table(&data.names, &values, &[&bounds]));
    blocks.extend(tables.into_iter().filter_map(Table::into_block));
    blocks
}

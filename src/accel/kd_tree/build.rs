//! The builder of `kd-tree`: SAH over all box faces in O(N log N), with event lists that are sorted
//! once and keep their order while cells are split.
//!
//! Source: I. Wald, V. Havran, "On building fast kd-trees for ray tracing, and on doing that in O(N
//! log N)", 2006, algorithms 4 and 5.

use super::{Node, Options};
use crate::bounds::Bounds;
use crate::spatial::{Margin, clip};
use crate::tree::NodeKind;
use crate::tree::grow::{Grown, PARALLEL_GRAIN, grow};
use crate::{AccelError, BuildLog, TriangleSoup};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Limit on references (1 GiB), enforced during the build.
pub(super) const MAX_REFERENCES: u64 = 1 << 28;
/// Batch size with which subtrees update the shared reference count, to avoid contention.
const COUNTED: usize = 1024;
/// Limit on items: indices share a word with the kind of an event.
const MAX_ITEMS: u64 = 1 << 30;

/// Nodes and references in their final order.
pub(super) struct KdTree {
    pub nodes: Vec<Node>,
    pub references: Vec<u32>,
}

/// Builds the tree over `bounds`.
///
/// # Errors
/// More triangles or references than can be indexed.
pub(super) fn build(
    soup: &TriangleSoup,
    bounds: Bounds,
    options: &Options,
    log: &mut BuildLog,
) -> Result<KdTree, AccelError> {
    let count = soup.records.len() as u64;
    AccelError::check_limit("triangles of a kd-tree", count, MAX_ITEMS - 1)?;
    let settings = Settings {
        options,
        kept_if_empty: 1.0 - options.empty_bonus,
        max_depth: match options.max_depth {
            0 => default_depth(soup.records.len()),
            depth => depth,
        },
        margin: options.clip.then(|| Margin::new(&bounds)),
        soup,
        references: AtomicU64::new(0),
    };
    let cell = log.phase("sort", || Region::root(soup, bounds));
    let grown = log.phase("sah-events", || {
        grow(
            cell,
            |cell| cell.items.len(),
            |cell, depth, order| cell.node(depth, &settings, order),
        )
    });
    // Beyond the limit cells are not split, so the full number is unknown.
    let made = (grown.order.len() as u64).min(MAX_REFERENCES + 1);
    AccelError::check_limit("references of a kd-tree, at least", made, MAX_REFERENCES)?;
    let nodes = log.phase("layout", || lay_out(&grown));
    let references = grown.order;
    Ok(KdTree { nodes, references })
}

/// Depth beyond which trees usually stop to improve: 8 + 1.3 log2 N (Havran 2000).
pub(super) fn default_depth(triangles: usize) -> u32 {
    (8.0 + 1.3 * (triangles.max(1) as f64).log2()) as u32
}

struct Settings<'a> {
    options: &'a Options,
    /// Remaining fraction of a split's cost if it cuts off empty space.
    kept_if_empty: f32,
    max_depth: u32,
    /// Set if triangles are clipped.
    margin: Option<Margin>,
    soup: &'a TriangleSoup,
    /// References so far; beyond the limit nothing is split any more.
    references: AtomicU64,
}

struct Item {
    /// Bounds of its part within the cell.
    bounds: Bounds,
    id: u32,
}

#[derive(Clone, Copy, PartialEq)]
enum PlaneKind {
    End,
    Planar,
    Start,
}

/// Start or end of an item's interval on an axis, or both at once.
#[derive(Clone, Copy)]
struct Event {
    position: f32,
    /// Index in the cell, and kind in the two high bits.
    word: u32,
}

impl Event {
    fn new(position: f32, item: u32, kind: PlaneKind) -> Self {
        let word = item | (kind as u32) << 30;
        Self { position, word }
    }

    fn item(self) -> usize {
        (self.word & ((1 << 30) - 1)) as usize
    }

    fn of_item(self, item: u32) -> Self {
        let word = item | (self.word & (3 << 30));
        Self { word, ..self }
    }
}

fn push_events(bounds: &Bounds, axis: usize, item: u32, events: &mut Vec<Event>) {
    let (low, high) = (bounds.min[axis], bounds.max[axis]);
    if low == high {
        events.push(Event::new(low, item, PlaneKind::Planar));
    } else {
        events.push(Event::new(low, item, PlaneKind::Start));
        events.push(Event::new(high, item, PlaneKind::End));
    }
}

/// A cell to be built: its items, and their sorted events along each axis.
struct Region {
    bounds: Bounds,
    items: Vec<Item>,
    events: [Vec<Event>; 3],
}

#[derive(Clone, Copy)]
struct Split {
    axis: usize,
    position: f32,
    /// True if planar items go below.
    planar_below: bool,
    cost: f32,
}

impl Region {
    fn root(soup: &TriangleSoup, bounds: Bounds) -> Self {
        let item = |(id, record): (usize, &crate::triangle::TriangleRecord)| Item {
            bounds: record.bounds(),
            id: id as u32,
        };
        let items: Vec<Item> = soup.records.par_iter().enumerate().map(item).collect();
        let events = [0, 1, 2].map(|axis| {
            let mut events = Vec::with_capacity(2 * items.len());
            for (index, item) in items.iter().enumerate() {
                push_events(&item.bounds, axis, index as u32, &mut events);
            }
            events.par_sort_unstable_by(|a, b| a.position.total_cmp(&b.position));
            events
        });
        Self {
            bounds,
            items,
            events,
        }
    }

    /// The plane that splits the cell, axis and position, and both halves. A leaf appends its list
    /// to `order`; its plane is undefined.
    fn node(
        self,
        depth: u32,
        settings: &Settings,
        order: &mut Vec<u32>,
    ) -> ((usize, f32), Option<[Region; 2]>) {
        let given_up = settings.references.load(Ordering::Relaxed) > MAX_REFERENCES;
        let ends = depth >= settings.max_depth || given_up;
        let split = (!ends).then(|| self.best_split(settings)).flatten();
        let Some(split) = split else {
            let before = order.len() / COUNTED;
            order.extend(self.items.iter().map(|item| item.id));
            let made = order.len() / COUNTED - before;
            if made > 0 {
                let made = (made * COUNTED) as u64;
                settings.references.fetch_add(made, Ordering::Relaxed);
            }
            return ((0, 0.0), None);
        };
        let plane = (split.axis, split.position);
        (plane, Some(self.divide(&split, settings)))
    }

    /// The split of least cost, if cheaper than a leaf.
    fn best_split(&self, settings: &Settings) -> Option<Split> {
        let leaf_cost = settings.options.intersection_cost * self.items.len() as f32;
        let sweep = |axis: usize| self.sweep(axis, settings);
        let best = if self.items.len() > PARALLEL_GRAIN {
            let mut splits = [None; 3];
            splits.par_iter_mut().enumerate().for_each(|(axis, split)| {
                *split = sweep(axis);
            });
            splits
        } else {
            [0, 1, 2].map(sweep)
        };
        let cheaper = |a: Split, b: Split| if b.cost < a.cost { b } else { a };
        let best = best.into_iter().flatten().reduce(cheaper)?;
        (best.cost < leaf_cost).then_some(best)
    }

    /// The best plane along one axis (Wald & Havran, algorithm 5).
    fn sweep(&self, axis: usize, settings: &Settings) -> Option<Split> {
        let (low, high) = (self.bounds.min[axis], self.bounds.max[axis]);
        let extent = self.bounds.extent();
        let (width, depth) = (extent[(axis + 1) % 3], extent[(axis + 2) % 3]);
        let half_area = |length: f32| width * depth + length * (width + depth);
        let scale =
            settings.options.intersection_cost / half_area(high - low).max(f32::MIN_POSITIVE);
        let mut best: Option<Split> = None;
        let (mut below, mut above) = (0, self.items.len() as u32);
        let events = &self.events[axis];
        let mut next = 0;
        while next < events.len() {
            let position = events[next].position;
            let mut kinds = [0; 3];
            while next < events.len() && events[next].position == position {
                kinds[(events[next].word >> 30) as usize] += 1;
                next += 1;
            }
            let [ending, planar, starting] = kinds;
            above -= ending + planar;
            if low < position && position < high {
                let cost_below = scale * half_area(position - low);
                let cost_above = scale * half_area(high - position);
                let mut consider = |below: u32, above: u32, planar_below| {
                    let kept = if below == 0 || above == 0 {
                        settings.kept_if_empty
                    } else {
                        1.0
                    };
                    let tests = cost_below * below as f32 + cost_above * above as f32;
                    let cost = kept * (settings.options.traversal_cost + tests);
                    if best.is_none_or(|b| cost < b.cost) {
                        best = Some(Split {
                            axis,
                            position,
                            planar_below,
                            cost,
                        });
                    }
                };
                consider(below + planar, above, true);
                if planar > 0 {
                    consider(below, above + planar, false);
                }
            }
            below += starting + planar;
        }
        best
    }

    /// Both halves. Items on one side keep their events; the few on both sides get new ones.
    fn divide(self, split: &Split, settings: &Settings) -> [Region; 2] {
        let axis = split.axis;
        let mut bounds = [self.bounds; 2];
        bounds[0].max[axis] = split.position;
        bounds[1].min[axis] = split.position;
        let mut halves = bounds.map(|bounds| Region {
            bounds,
            items: Vec::new(),
            events: [Vec::new(), Vec::new(), Vec::new()],
        });
        let mut fresh: [[Vec<Event>; 3]; 2] = Default::default();
        let mut places = vec![[ELSEWHERE; 2]; self.items.len()];
        for (item, place) in self.items.into_iter().zip(&mut places) {
            let (low, high) = (item.bounds.min[axis], item.bounds.max[axis]);
            let side = if low == high && low == split.position {
                usize::from(!split.planar_below)
            } else if high <= split.position {
                0
            } else if low >= split.position {
                1
            } else {
                for (half, fresh) in halves.iter_mut().zip(&mut fresh) {
                    if let Some(bounds) = part_within(&item, &half.bounds, settings) {
                        let index = half.items.len() as u32;
                        (0..3).for_each(|a| push_events(&bounds, a, index, &mut fresh[a]));
                        let id = item.id;
                        half.items.push(Item { bounds, id });
                    }
                }
                continue;
            };
            place[side] = halves[side].items.len() as u32;
            halves[side].items.push(item);
        }
        let lists = self.events.into_iter().zip(transpose(fresh));
        let distribute = |(events, fresh)| distribute(events, fresh, &places);
        let divided: Vec<[Vec<Event>; 2]> = if places.len() > PARALLEL_GRAIN {
            lists
                .collect::<Vec<_>>()
                .into_par_iter()
                .map(distribute)
                .collect()
        } else {
            lists.map(distribute).collect()
        };
        for (axis, [below, above]) in divided.into_iter().enumerate() {
            halves[0].events[axis] = below;
            halves[1].events[axis] = above;
        }
        halves
    }
}

/// Index of an item that is not in a half, or has new events there.
const ELSEWHERE: u32 = u32::MAX;

/// The box of an item within half a cell; `None` if the half is clearly missed.
fn part_within(item: &Item, half: &Bounds, settings: &Settings) -> Option<Bounds> {
    let by_box = item.bounds.intersection(half);
    let Some(margin) = &settings.margin else {
        return Some(by_box);
    };
    let record = &settings.soup.records[item.id as usize];
    let part = clip(record, half, margin.of(record))?;
    let clipped = by_box.intersection(&part);
    let overlaps = (0..3).all(|a| clipped.min[a] <= clipped.max[a]);
    Some(if overlaps { clipped } else { by_box })
}

fn transpose([below, above]: [[Vec<Event>; 3]; 2]) -> impl Iterator<Item = [Vec<Event>; 2]> {
    below.into_iter().zip(above).map(|(b, a)| [b, a])
}

/// Splits a sorted list by the sides of its items and merges each half with its new events.
fn distribute(
    events: Vec<Event>,
    mut fresh: [Vec<Event>; 2],
    places: &[[u32; 2]],
) -> [Vec<Event>; 2] {
    let mut halves: [Vec<Event>; 2] = Default::default();
    for fresh in &mut fresh {
        fresh.sort_unstable_by(|a, b| a.position.total_cmp(&b.position));
    }
    let mut merged = [0, 0];
    for event in &events {
        let place = places[event.item()];
        for side in 0..2 {
            if place[side] == ELSEWHERE {
                continue;
            }
            let waiting = &fresh[side][merged[side]..];
            let earlier = waiting.iter().take_while(|f| f.position < event.position);
            let before = halves[side].len();
            halves[side].extend(earlier);
            merged[side] += halves[side].len() - before;
            halves[side].push(event.of_item(place[side]));
        }
    }
    for side in 0..2 {
        halves[side].extend(&fresh[side][merged[side]..]);
    }
    halves
}

/// Places the children of each node next to each other.
fn lay_out(grown: &Grown<(usize, f32)>) -> Vec<Node> {
    let mut nodes = vec![Node::EMPTY; grown.nodes.len()];
    let mut places = vec![0; grown.nodes.len()];
    let mut next = 1;
    for (index, ((axis, position), kind)) in grown.nodes.iter().enumerate() {
        nodes[places[index]] = match *kind {
            NodeKind::Leaf { first, count } => Node::leaf(first as usize, count as usize),
            NodeKind::Inner { left, right } => {
                (places[left as usize], places[right as usize]) = (next, next + 1);
                next += 2;
                Node::inner(*axis, *position, next - 2)
            }
        };
    }
    nodes
}

//! The builder of `kd-tree`: SAH over all box faces in O(N log N), with event lists that are sorted
//! once and keep their order while cells are split.
//!
//! Source: I. Wald, V. Havran, "On building fast kd-trees for ray tracing, and on doing that in O(N
//! log N)", 2006, algorithms 4 and 5.

use super::{Node, Options};
use crate::bounds::Bounds;
use crate::polygon::Polygon;
use crate::spatial::Margin;
use crate::tree::NodeKind;
use crate::tree::grow::{Grown, PARALLEL_GRAIN, grow};
use crate::{AccelError, BuildLog, FEWER, TriangleSoup};
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
    AccelError::check_limit("triangles of a kd-tree", count, MAX_ITEMS - 1, FEWER)?;
    let settings = Settings {
        options,
        kept_if_empty: 1.0 - options.empty_bonus,
        max_depth: match options.max_depth {
            0 => default_depth(soup.records.len()),
            depth => depth,
        },
        margins: options.clip.then(|| {
            let margin = Margin::new(&bounds);
            soup.records.par_iter().map(|r| margin.of(r)).collect()
        }),
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
    AccelError::check_limit(
        "references of a kd-tree, at least",
        made,
        MAX_REFERENCES,
        "set `max_depth` lower",
    )?;
    let nodes = log.phase("layout", || lay_out(&grown));
    let references = grown.order;
    Ok(KdTree { nodes, references })
}

/// Depth beyond which trees usually stop to improve: 8 + 1.3 log2 N (Havran 2000).
pub(crate) fn default_depth(triangles: usize) -> u32 {
    (8.0 + 1.3 * (triangles.max(1) as f64).log2()) as u32
}

struct Settings<'a> {
    options: &'a Options,
    /// Remaining fraction of a split's cost if it cuts off empty space.
    kept_if_empty: f32,
    max_depth: u32,
    /// By triangle, scene units; set if they are clipped.
    margins: Option<Vec<f64>>,
    soup: &'a TriangleSoup,
    /// References so far; beyond the limit nothing is split any more.
    references: AtomicU64,
}

#[derive(Clone, Copy)]
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
    /// Items above, those that are cut among them, if nothing is clipped away.
    above: u32,
    cost: f32,
}

impl Split {
    /// Whether all of a box lies below the plane, or all of it above; the plane cuts it if neither.
    fn sides(&self, bounds: &Bounds) -> [bool; 2] {
        let (low, high) = (bounds.min[self.axis], bounds.max[self.axis]);
        let is_planar = (low == self.position) & (high == self.position);
        let is_below = (high <= self.position) & (!is_planar | self.planar_below);
        [is_below, (low >= self.position) & !is_below]
    }
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
            // Counters in registers: in an array each count would wait for the one before.
            let (mut ending, mut planar, mut starting) = (0, 0, 0);
            while next < events.len() && events[next].position == position {
                let kind = events[next].word >> 30;
                ending += u32::from(kind == PlaneKind::End as u32);
                planar += u32::from(kind == PlaneKind::Planar as u32);
                starting += u32::from(kind == PlaneKind::Start as u32);
                next += 1;
            }
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
                            above,
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

    /// Both halves. Items on one side keep their events; the few that are cut get new ones. The half
    /// below takes over the memory of the cell.
    fn divide(mut self, split: &Split, settings: &Settings) -> [Region; 2] {
        let mut bounds = [self.bounds; 2];
        bounds[0].max[split.axis] = split.position;
        bounds[1].min[split.axis] = split.position;
        let mut places = Vec::with_capacity(self.items.len());
        let mut cut = [Vec::new(), Vec::new()];
        // As in `distribute`, an item is written to both lists, one of which counts it. No list is longer than the
        // number of items so far, so nothing is overwritten that is still to come.
        let (mut kept, mut moved) = (0, 0);
        let mut above = vec![Item::NONE; split.above as usize + 1];
        for index in 0..self.items.len() {
            let [is_below, is_above] = split.sides(&self.items[index].bounds);
            if is_below | is_above {
                places.push(if is_below {
                    kept as u32
                } else {
                    moved as u32 | ABOVE
                });
                above[moved] = self.items[index];
                self.items[kept] = self.items[index];
                kept += usize::from(is_below);
                moved += usize::from(is_above);
                continue;
            }
            places.push(CUT);
            let item = self.items[index];
            let parts = item.parts(&self.bounds, split, settings);
            if let Some(part) = parts[0] {
                cut[0].push(kept as u32);
                self.items[kept] = part;
                kept += 1;
            }
            if let Some(part) = parts[1] {
                cut[1].push(moved as u32);
                above[moved] = part;
                moved += 1;
            }
        }
        self.items.truncate(kept);
        above.truncate(moved);
        let below = self.items;
        let divide_events = |(axis, events): (usize, &mut Vec<Event>)| {
            let mut others = Vec::with_capacity(2 * split.above as usize + 1);
            distribute(events, &places, &mut others);
            merge(events, new_events(&below, &cut[0], axis));
            merge(&mut others, new_events(&above, &cut[1], axis));
            others
        };
        let mut others: [Vec<Event>; 3] = Default::default();
        if places.len() > PARALLEL_GRAIN {
            let axes = self.events.par_iter_mut().enumerate();
            let axes = axes.zip(&mut others);
            axes.for_each(|(events, others)| *others = divide_events(events));
        } else {
            let axes = self.events.iter_mut().enumerate().zip(&mut others);
            axes.for_each(|(events, others)| *others = divide_events(events));
        }
        let half = |bounds, items, events| Region {
            bounds,
            items,
            events,
        };
        [
            half(bounds[0], below, self.events),
            half(bounds[1], above, others),
        ]
    }
}

/// Place of an item that is cut: it has new events on both sides.
const CUT: u32 = u32::MAX;
/// Marks a place in the half above.
const ABOVE: u32 = 1 << 31;

impl Item {
    const NONE: Self = Self {
        bounds: Bounds::EMPTY,
        id: 0,
    };

    /// The parts in the halves of a cell; `None` where a half is clearly missed.
    fn parts(&self, cell: &Bounds, split: &Split, settings: &Settings) -> [Option<Item>; 2] {
        let mut halves = [self.bounds; 2];
        halves[0].max[split.axis] = split.position;
        halves[1].min[split.axis] = split.position;
        let Some(margins) = &settings.margins else {
            return halves.map(|bounds| Some(Item { bounds, ..*self }));
        };
        let margin = margins[self.id as usize];
        let inside = Polygon::new(&settings.soup.records[self.id as usize]).clipped(cell, margin);
        [0, 1].map(|half| {
            let sign = [-1.0, 1.0][half];
            let border = f64::from(split.position) - sign * margin;
            let part = inside.cut(split.axis, border, sign).bounds(margin)?;
            let clipped = halves[half].intersection(&part);
            let overlaps = (0..3).all(|a| clipped.min[a] <= clipped.max[a]);
            let bounds = if overlaps { clipped } else { halves[half] };
            Some(Item { bounds, ..*self })
        })
    }
}

/// Sorted events of the items at these places.
fn new_events(items: &[Item], places: &[u32], axis: usize) -> Vec<Event> {
    let mut events = Vec::with_capacity(2 * places.len());
    for &place in places {
        push_events(&items[place as usize].bounds, axis, place, &mut events);
    }
    events.sort_unstable_by(|a, b| a.position.total_cmp(&b.position));
    events
}

/// Keeps the events of items below, and moves those of items above; both stay sorted. Each event is written to
/// both lists, one of which counts it: a branch between them would be guessed wrong every other time.
fn distribute(events: &mut Vec<Event>, places: &[u32], above: &mut Vec<Event>) {
    let (mut kept, mut moved) = (0, 0);
    // One more for what is written and not counted.
    above.resize(above.capacity().max(1), Event::new(0.0, 0, PlaneKind::End));
    for index in 0..events.len() {
        let event = events[index];
        let place = places[event.item()];
        let event = event.of_item(place & !ABOVE);
        events[kept] = event;
        above[moved] = event;
        kept += usize::from(place & ABOVE == 0);
        moved += usize::from(place & ABOVE != 0 && place != CUT);
    }
    events.truncate(kept);
    above.truncate(moved);
}

/// Merges sorted events into a sorted list, from its end, so that each is moved once.
fn merge(events: &mut Vec<Event>, new: Vec<Event>) {
    let mut from = events.len();
    events.extend_from_slice(&new);
    let mut end = events.len();
    for event in new.iter().rev() {
        while from > 0 && events[from - 1].position > event.position {
            end -= 1;
            from -= 1;
            events[end] = events[from];
        }
        end -= 1;
        events[end] = *event;
    }
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

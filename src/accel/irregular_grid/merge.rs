//! Second phase: neighbours merge into one cell if the surface area heuristic improves.
//!
//! Passes along x, y and z alternate. In a pass, a cell may join the next one along the axis if
//! their cross-sections are equal and A(union) · (|union of lists| + 1) ≤ A₁ · (n₁ + 1) +
//! A₂ · (n₂ + 1). Cells that want the next one form chains, split into pairs from their start, so
//! that the result does not depend on the order of work. Rounds continue while they leave fewer
//! than α times the cells.

use super::Partition;
use super::voxels::{Entry, GridCell, Map, is_subset, push_union, union_length};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

const NONE: u32 = u32::MAX;
const UNKNOWN: u32 = u32::MAX - 1;

/// Merges cells, removes the merged ones, and renumbers the rest in the map.
pub(super) fn merge(partition: &mut Partition, alpha: f64) {
    let mut state = State::new(partition);
    let mut pass = 1;
    loop {
        let before = state.alive.len();
        if alpha > 0.0 {
            for axis in 0..3 {
                state.merge_along(axis, pass);
                pass += 1;
            }
        }
        if state.alive.len() as f64 >= alpha * before as f64 {
            break;
        }
    }
    let State {
        alive, mut owner, ..
    } = state;
    renumber(partition, &alive, &mut owner);
}

struct State<'a> {
    map: &'a Map,
    cells: &'a mut Vec<GridCell>,
    pool: &'a mut Vec<u32>,
    voxel: [f32; 3],
    /// Cells that still exist, ascending.
    alive: Vec<u32>,
    /// The cell that each was merged into; itself while it exists.
    owner: Vec<u32>,
    /// Pass of each cell's last change.
    changed: Vec<u32>,
    /// Previous pass along each axis.
    tried: [u32; 3],
    /// Cached neighbour of each cell along each axis.
    neighbours: [Vec<AtomicU32>; 3],
    /// The cell that each one would join in this pass, and `true` if another would join it.
    next: Vec<u32>,
    is_wanted: Vec<bool>,
}

impl<'a> State<'a> {
    fn new(partition: &'a mut Partition) -> Self {
        let count = partition.cells.len();
        Self {
            map: &partition.map,
            cells: &mut partition.cells,
            pool: &mut partition.pool,
            voxel: partition.fine.cell,
            alive: (0..count as u32).collect(),
            owner: (0..count as u32).collect(),
            changed: vec![0; count],
            tried: [0; 3],
            neighbours: [0; 3].map(|_| (0..count).map(|_| AtomicU32::new(UNKNOWN)).collect()),
            next: vec![NONE; count],
            is_wanted: vec![false; count],
        }
    }

    fn merge_along(&mut self, axis: usize, pass: u32) {
        let wish = |&id: &u32| self.wish(id, axis).map(|other| [id, other]);
        let wishes: Vec<[u32; 2]> = self.alive.par_iter().filter_map(wish).collect();
        self.tried[axis] = pass;
        if wishes.is_empty() {
            return;
        }
        let pairs = self.pairs(&wishes);
        let joined: Vec<_> = pairs
            .par_chunks(1024)
            .map(|some| self.unions(some))
            .collect();
        for (some, (lists, new)) in pairs.chunks(1024).zip(joined) {
            let begin = self.pool.len() as u32;
            for (&[left, right], &(first, count)) in some.iter().zip(&lists) {
                let end = self.cells[right as usize].max[axis];
                let cell = &mut self.cells[left as usize];
                cell.max[axis] = end;
                let is_new = first & NEW != 0;
                cell.first = if is_new {
                    begin + (first & !NEW)
                } else {
                    first
                };
                cell.count = count;
                self.owner[right as usize] = left;
                self.changed[left as usize] = pass;
                self.neighbours[axis][left as usize] = AtomicU32::new(UNKNOWN);
            }
            self.pool.extend_from_slice(&new);
        }
        let owner = &self.owner;
        self.alive.retain(|&id| owner[id as usize] == id);
    }

    /// The next cell along `axis` if joining it pays off.
    fn wish(&self, id: u32, axis: usize) -> Option<u32> {
        let slot = &self.neighbours[axis][id as usize];
        let mut other = slot.load(Relaxed);
        if other == UNKNOWN {
            other = self.neighbour(id, axis);
            slot.store(other, Relaxed);
        }
        if other == NONE {
            return None;
        }
        let [here, there] = [id, other].map(|c| self.changed[c as usize]);
        if here.max(there) < self.tried[axis] || self.owner[other as usize] != other {
            return None;
        }
        let [cell, next] = [id, other].map(|c| &self.cells[c as usize]);
        let same_section = (0..3)
            .filter(|&a| a != axis)
            .all(|a| next.max[a] == cell.max[a]);
        (same_section && self.pays(cell, next, axis)).then_some(other)
    }

    /// The next cell at the same low corner otherwise. It has the number that the first phase's map gives the voxel
    /// there, even if it was merged since.
    fn neighbour(&self, id: u32, axis: usize) -> u32 {
        let cell = &self.cells[id as usize];
        let mut voxel = cell.min.map(u32::from);
        voxel[axis] = u32::from(cell.max[axis]);
        if voxel[axis] == self.map.top[axis] << self.map.shift {
            return NONE;
        }
        let other = self.map.cell_at(voxel);
        let begins_here = self.cells[other as usize].min.map(u32::from) == voxel;
        if begins_here { other } else { NONE }
    }

    fn pays(&self, cell: &GridCell, neighbour: &GridCell, axis: usize) -> bool {
        let area = |min: [u16; 3], max: [u16; 3]| {
            let [x, y, z] = [0, 1, 2].map(|a| f32::from(max[a] - min[a]) * self.voxel[a]);
            x * y + y * z + z * x
        };
        let cost = |c: &GridCell| area(c.min, c.max) * (c.count + 1) as f32;
        let apart = cost(cell) + cost(neighbour);
        let mut max = cell.max;
        max[axis] = neighbour.max[axis];
        let whole = area(cell.min, max);
        if whole * (cell.count.max(neighbour.count) + 1) as f32 > apart {
            return false;
        }
        let count = union_length(cell.list(self.pool), neighbour.list(self.pool));
        whole * (count + 1) as f32 <= apart
    }

    fn pairs(&mut self, wishes: &[[u32; 2]]) -> Vec<[u32; 2]> {
        for &[id, other] in wishes {
            self.next[id as usize] = other;
            self.is_wanted[other as usize] = true;
        }
        let mut pairs = Vec::with_capacity(wishes.len());
        for &[head, _] in wishes {
            let mut left = if self.is_wanted[head as usize] {
                NONE
            } else {
                head
            };
            while left != NONE && self.next[left as usize] != NONE {
                let right = self.next[left as usize];
                pairs.push([left, right]);
                left = self.next[right as usize];
            }
        }
        for &[id, other] in wishes {
            self.next[id as usize] = NONE;
            self.is_wanted[other as usize] = false;
        }
        pairs
    }

    /// Offset and length of the union of each pair's lists. If one list contains the other, it is
    /// reused; the rest are new, in the second vector, and marked by [`NEW`].
    fn unions(&self, pairs: &[[u32; 2]]) -> (Vec<(u32, u32)>, Vec<u32>) {
        let mut new = Vec::new();
        let union = |&[left, right]: &[u32; 2]| {
            let [a, b] = [left, right].map(|id| self.cells[id as usize]);
            let (long, short) = if a.count >= b.count { (a, b) } else { (b, a) };
            let [long_list, short_list] = [long, short].map(|c| c.list(self.pool));
            if is_subset(short_list, long_list) {
                return (long.first, long.count);
            }
            let first = new.len() as u32;
            push_union(long_list, short_list, &mut new);
            (first | NEW, new.len() as u32 - first)
        };
        let lists = pairs.iter().map(union).collect();
        (lists, new)
    }
}

/// Marks the offset of a list as one in a task's new lists.
const NEW: u32 = 1 << 31;

fn renumber(partition: &mut Partition, alive: &[u32], owner: &mut [u32]) {
    // An owner may have been merged itself.
    for id in 0..owner.len() {
        let mut root = owner[id];
        while owner[root as usize] != root {
            root = owner[root as usize];
        }
        owner[id] = root;
    }
    let mut number = vec![0u32; owner.len()];
    for (new, &old) in alive.iter().enumerate() {
        number[old as usize] = new as u32;
    }
    partition.map.entries.par_iter_mut().for_each(|word| {
        if let Entry::GridCell(cell) = Map::decode(*word) {
            *word = Map::encode(Entry::GridCell(number[owner[cell as usize] as usize]));
        }
    });
    let cells = &partition.cells;
    partition.cells = alive.par_iter().map(|&id| cells[id as usize]).collect();
}

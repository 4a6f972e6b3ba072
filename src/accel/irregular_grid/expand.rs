//! Third phase: cell boxes grow over neighbours whose lists are subsets of their own, for longer
//! ray jumps. Voxels keep their cells; only the boxes overlap.

use super::Partition;
use super::voxels::{GridCell, is_subset};
use rayon::prelude::*;

/// Grows all boxes `passes` times along each axis. Each step uses the boxes of the previous one.
pub(super) fn expand(partition: &mut Partition, passes: u32) {
    // Two bits per axis: up and down, once blocked, stay blocked, since lists never change.
    let mut blocked = vec![0u8; partition.cells.len()];
    for _ in 0..passes {
        for axis in 0..3 {
            let grown = partition
                .cells
                .par_iter()
                .zip(&mut blocked)
                .map(|(cell, blocked)| grow(partition, cell, axis, blocked))
                .collect();
            partition.cells = grown;
        }
    }
}

fn grow(partition: &Partition, cell: &GridCell, axis: usize, blocked: &mut u8) -> GridCell {
    let mut grown = *cell;
    let [down, up] = [1u8 << (2 * axis), 2 << (2 * axis)];
    if *blocked & down == 0 {
        match reach(partition, cell, axis, false) {
            Some(bound) => grown.min[axis] = bound,
            None => *blocked |= down,
        }
    }
    if *blocked & up == 0 {
        match reach(partition, cell, axis, true) {
            Some(bound) => grown.max[axis] = bound,
            None => *blocked |= up,
        }
    }
    grown
}

/// The possible growth of the box along an axis; `None` if a neighbour lists a triangle that the
/// cell does not, or the grid ends.
fn reach(partition: &Partition, cell: &GridCell, axis: usize, up: bool) -> Option<u16> {
    let map = &partition.map;
    let end = (map.top[axis] << map.shift) as u16;
    let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
    let mut voxel = cell.min.map(u32::from);
    voxel[axis] = if up {
        u32::from(cell.max[axis])
    } else {
        u32::from(cell.min[axis]).checked_sub(1)?
    };
    if up && cell.max[axis] == end {
        return None;
    }
    let own = cell.list(&partition.pool);
    let mut bound = if up { end } else { 0 };
    while voxel[a] < u32::from(cell.max[a]) {
        let mut next = u32::from(cell.max[a]);
        voxel[b] = u32::from(cell.min[b]);
        while voxel[b] < u32::from(cell.max[b]) {
            let neighbour = &partition.cells[map.cell_at(voxel) as usize];
            // A cell that does not hold the voxel ends no search; checks of the grid name it.
            let holds = (0..3)
                .all(|k| (neighbour.min[k].into()..neighbour.max[k].into()).contains(&voxel[k]));
            if !holds || !is_subset(neighbour.list(&partition.pool), own) {
                return None;
            }
            bound = if up {
                bound.min(neighbour.max[axis])
            } else {
                bound.max(neighbour.min[axis])
            };
            next = next.min(u32::from(neighbour.max[a]));
            voxel[b] = u32::from(neighbour.max[b]);
        }
        voxel[a] = next;
    }
    Some(bound)
}

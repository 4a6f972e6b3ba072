//! Invariants of a built octree.

use super::{Built, INNER_SHIFT, LAST, LEAF, RootCell, build};
use crate::spatial::{corners, touches};
use crate::tree::Coverage;
use crate::{AccelError, TriangleSoup};

/// Checks that every block is reached once, and every cell lists the required triangles.
///
/// # Errors
/// The first violation.
pub(super) fn validate(built: &Built, soup: &TriangleSoup) -> Result<(), AccelError> {
    let root = built.space.cell([0; 3], 0);
    for record in &soup.records {
        let inside = root.contains(&record.bounds());
        ensure!(inside, "triangle {} lies outside the tree", record.id);
    }
    if soup.records.is_empty() && built.nodes[0] == 0 && built.references.is_empty() {
        return Ok(());
    }
    let no_triangles = TriangleSoup::default();
    let mut check = Check {
        built,
        soup,
        blocks: Coverage::new(&no_triangles, built.nodes.len() / 8),
        listed: 0,
    };
    check.blocks.node(0)?;
    let all: Vec<u32> = (0..soup.records.len() as u32).collect();
    check.cell(built.nodes[0], [0; 3], 0, &all)?;
    let (listed, all) = (check.listed, built.references.len());
    ensure!(listed == all, "leaves list {listed} of {all} references");
    check.blocks.is_complete()
}

struct Check<'a> {
    built: &'a Built,
    soup: &'a TriangleSoup,
    blocks: Coverage<'a>,
    listed: usize,
}

impl Check<'_> {
    /// Checks a cell, which must list `triangles`.
    fn cell(
        &mut self,
        word: u32,
        position: [u32; 3],
        depth: u32,
        triangles: &[u32],
    ) -> Result<(), AccelError> {
        let here = format!("cell {position:?} at depth {depth}");
        if word & LEAF != 0 {
            let list = self.built.list(word & !LEAF).unwrap_or_default();
            ensure!(
                !list.is_empty(),
                "{here}: its references lie outside the array"
            );
            self.listed += list.len();
            let ids: Vec<u32> = list.iter().map(|r| r & !LAST).collect();
            let ascend = ids.is_sorted_by(|a, b| a < b);
            ensure!(ascend, "{here}: its references do not ascend");
            let last = ids[ids.len() - 1] as usize;
            let exists = last < self.soup.records.len();
            ensure!(exists, "{here}: triangle {last} does not exist");
            for id in triangles {
                let listed = ids.binary_search(id).is_ok();
                ensure!(listed, "{here}: triangle {id} touches it and is not listed");
            }
            return Ok(());
        }
        ensure!(depth <= self.built.depth, "{here}: deeper than the tree");
        let block = (word >> INNER_SHIFT) as usize;
        self.blocks.node(block)?;
        for octant in 0..8 {
            let inside = self.needed(position, depth, octant, triangles);
            if word >> octant & 1 == 1 {
                let child = self.built.nodes[8 * block + octant as usize];
                self.cell(child, RootCell::child(position, octant), depth + 1, &inside)?;
            } else {
                ensure!(
                    inside.is_empty(),
                    "{here}: triangles {inside:?} touch octant {octant}, which is empty"
                );
            }
        }
        Ok(())
    }

    /// The subset of a cell's required triangles that a child must list.
    fn needed(&self, position: [u32; 3], depth: u32, octant: u32, triangles: &[u32]) -> Vec<u32> {
        let space = &self.built.space;
        let middle = space.middle(position, depth);
        let child = space.cell(RootCell::child(position, octant), depth + 1);
        let is_needed = |id: &u32| {
            let record = &self.soup.records[*id as usize];
            build::by_box(&record.bounds(), middle) >> octant & 1 == 1
                && (!self.built.clipped || touches(&corners(record), &child))
        };
        triangles.iter().copied().filter(is_needed).collect()
    }
}

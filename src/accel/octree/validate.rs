//! What must hold of a built octree.

use super::{Built, INNER_SHIFT, LAST, LEAF, RootCell, build};
use crate::accel::spatial::{corners, touches};
use crate::accel::tree::Coverage;
use crate::accel::{AccelError, TriangleSoup};

/// Every block is reached once, and every cell lists the triangles that it must.
///
/// # Errors
/// The first of these that does not hold.
pub(super) fn validate(built: &Built, soup: &TriangleSoup) -> Result<(), AccelError> {
    let root = built.space.cell([0; 3], 0);
    for record in &soup.records {
        AccelError::ensure(root.contains(&record.bounds()), || {
            format!("triangle {} lies outside the tree", record.id)
        })?;
    }
    if soup.records.is_empty() && built.nodes[0] == 0 && built.references.is_empty() {
        return Ok(());
    }
    let no_triangles = TriangleSoup::default();
    let mut walk = Walk {
        built,
        soup,
        blocks: Coverage::new(&no_triangles, built.nodes.len() / 8),
        listed: 0,
    };
    walk.blocks.node(0)?;
    let all: Vec<u32> = (0..soup.records.len() as u32).collect();
    walk.cell(built.nodes[0], [0; 3], 0, &all)?;
    let (listed, all) = (walk.listed, built.references.len());
    AccelError::ensure(listed == all, || {
        format!("leaves list {listed} of {all} references")
    })?;
    walk.blocks.is_complete()
}

/// On the way down.
struct Walk<'a> {
    built: &'a Built,
    soup: &'a TriangleSoup,
    blocks: Coverage<'a>,
    listed: usize,
}

impl Walk<'_> {
    /// A cell, which must list `triangles`.
    fn cell(
        &mut self,
        word: u32,
        position: [u32; 3],
        depth: u32,
        triangles: &[u32],
    ) -> Result<(), AccelError> {
        let ensure = |holds: bool, what: &dyn Fn() -> String| {
            AccelError::ensure(holds, || {
                format!("cell {position:?} at depth {depth}: {}", what())
            })
        };
        if word & LEAF != 0 {
            let list = self.built.list(word & !LEAF).unwrap_or_default();
            ensure(!list.is_empty(), &|| {
                "its references lie outside the array".to_owned()
            })?;
            self.listed += list.len();
            let ids: Vec<u32> = list.iter().map(|r| r & !LAST).collect();
            for id in &ids {
                let exists = (*id as usize) < self.soup.records.len();
                ensure(exists, &|| format!("triangle {id} does not exist"))?;
            }
            let ascend = ids.is_sorted_by(|a, b| a < b);
            ensure(ascend, &|| "its references do not ascend".to_owned())?;
            for id in triangles {
                ensure(ids.binary_search(id).is_ok(), &|| {
                    format!("triangle {id} touches it and is not listed")
                })?;
            }
            return Ok(());
        }
        let is_deeper = depth > self.built.depth;
        ensure(!is_deeper, &|| "deeper than the tree".to_owned())?;
        let block = (word >> INNER_SHIFT) as usize;
        self.blocks.node(block)?;
        for octant in 0..8 {
            let inside = self.needed(position, depth, octant, triangles);
            if word >> octant & 1 == 1 {
                let child = self.built.nodes[8 * block + octant as usize];
                self.cell(child, RootCell::child(position, octant), depth + 1, &inside)?;
            } else if let Some(id) = inside.first() {
                let what = || format!("triangle {id} touches octant {octant}, which is empty");
                ensure(false, &what)?;
            }
        }
        Ok(())
    }

    /// Which of the triangles that a cell must list a child must list, too.
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

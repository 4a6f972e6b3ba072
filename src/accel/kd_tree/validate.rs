//! Invariants of a built kd-tree.

use super::{Built, Content, halves};
use crate::bounds::Bounds;
use crate::spatial::{corners, touches};
use crate::tree::Coverage;
use crate::{AccelError, TriangleSoup};

/// Checks that every node is reached once, every plane lies in its cell, and every leaf lists the
/// required triangles.
///
/// # Errors
/// The first violation.
pub(super) fn validate(built: &Built, soup: &TriangleSoup) -> Result<(), AccelError> {
    for record in &soup.records {
        let inside = built.bounds.contains(&record.bounds());
        ensure!(inside, "triangle {} lies outside the tree", record.id);
    }
    for &id in &built.references {
        let exists = (id as usize) < soup.records.len();
        ensure!(exists, "triangle {id} does not exist");
    }
    let counts = built.nodes.iter().map(|node| match node.content() {
        Content::Leaf { count, .. } => count,
        Content::Inner { .. } => 0,
    });
    let (listed, all) = (counts.sum::<usize>(), built.references.len());
    ensure!(listed == all, "leaves list {listed} of {all} references");
    let no_triangles = TriangleSoup::default();
    let mut check = Check {
        built,
        soup,
        nodes: Coverage::new(&no_triangles, built.nodes.len()),
    };
    let lost = check.lacking(0, &built.bounds, (0..soup.records.len() as u32).collect())?;
    ensure!(
        lost.is_empty(),
        "triangles {lost:?} are missing in leaves that they touch"
    );
    check.nodes.is_complete()
}

struct Check<'a> {
    built: &'a Built,
    soup: &'a TriangleSoup,
    nodes: Coverage<'a>,
}

impl Check<'_> {
    /// Those of `triangles`, which the cell of node `index` must list, that its leaves lack.
    fn lacking(
        &mut self,
        index: usize,
        cell: &Bounds,
        mut triangles: Vec<u32>,
    ) -> Result<Vec<u32>, AccelError> {
        self.nodes.node(index)?;
        let (axis, position, children) = match self.built.nodes[index].content() {
            Content::Leaf { first, count } => {
                let listed = self.built.references.get(first..first + count);
                let ascends = listed.is_some_and(|ids| ids.is_sorted_by(|a, b| a < b));
                ensure!(
                    ascends,
                    "leaf {index}: its references lie outside the array or do not ascend"
                );
                triangles.retain(|id| listed.is_none_or(|ids| ids.binary_search(id).is_err()));
                return Ok(triangles);
            }
            Content::Inner {
                axis,
                position,
                children,
            } => (axis, position, children),
        };
        let inside = cell.min[axis] <= position && position <= cell.max[axis];
        ensure!(inside, "node {index}: its plane lies outside its cell");
        let cells = halves(cell, axis, position);
        let (mut sides, planar) = self.sides(&cells, axis, position, triangles);
        // Planar triangles may be on either side.
        sides.iter_mut().for_each(|side| side.extend(&planar));
        let [below, above] = sides;
        let on_one_side = |id: &u32| planar.binary_search(id).is_ok();
        let lacks_below = self.lacking(children, &cells[0], below)?;
        let lacks_above = self.lacking(children + 1, &cells[1], above)?;
        let (either, mut lost): (Vec<u32>, Vec<u32>) =
            lacks_below.into_iter().partition(on_one_side);
        let (also, rest): (Vec<u32>, Vec<u32>) = lacks_above.into_iter().partition(on_one_side);
        lost.extend(rest);
        lost.extend(either.into_iter().filter(|id| also.contains(id)));
        Ok(lost)
    }

    /// The triangles required below and above a plane, and, ascending, those in it.
    fn sides(
        &self,
        cells: &[Bounds; 2],
        axis: usize,
        position: f32,
        triangles: Vec<u32>,
    ) -> ([Vec<u32>; 2], Vec<u32>) {
        let ([mut below, mut above], mut planar) = ([Vec::new(), Vec::new()], Vec::new());
        for id in triangles {
            let record = &self.soup.records[id as usize];
            let bounds = record.bounds();
            let (low, high) = (bounds.min[axis], bounds.max[axis]);
            if low == position && high == position {
                planar.push(id);
            } else if high <= position {
                below.push(id);
            } else if low >= position {
                above.push(id);
            } else {
                let needed = |cell| !self.built.clipped || touches(&corners(record), cell);
                below.extend(needed(&cells[0]).then_some(id));
                above.extend(needed(&cells[1]).then_some(id));
            }
        }
        planar.sort_unstable();
        ([below, above], planar)
    }
}

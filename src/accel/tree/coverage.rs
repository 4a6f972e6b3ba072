//! The checks of `validate()` for structures over triangles.
//!
//! A triangle may be in several leaves, none of which contains its box T (after spatial splits).
//! Each point of the triangle must then lie in one of their boxes.
//!
//! Where spatial splits cut boxes and not triangles (`spatial_clip = false`), these leaves together
//! even *cover* T, and the theorem of `docs/design.md` holds for any ray. Let the triangle's hit at
//! t be the final answer. On each axis a, the computed slab distances of T's sides bound an
//! interval; let t_a be t clamped into it. The computed distance is monotone in the coordinate, so
//! some coordinate y_a of T, or one arbitrarily close, has the distance t_a. The point y lies in T,
//! hence in some box B of the finite cover, and by monotonicity n(B) ≤ max t_a ≤ max(t, n(T)) and
//! f(B) ≥ min t_a ≥ min(t, f(T)). With t ≤ f(T)(1 + p) and n(T)(1 − p) ≤ t, the four inequalities
//! of the theorem follow for B, and for every box around B. No pad is needed, and nothing is
//! assumed about where in T the hit lies.
//!
//! Where triangles are clipped, the same follows if y lies within the margin of the triangle: it
//! does unless the ray is almost in its plane (`src/accel/spatial.rs`).

use crate::bounds::Bounds;
use crate::polygon::Polygon;
use crate::triangle::TriangleRecord;
use crate::{AccelError, TriangleSoup};

/// An unvisited node, and the box that it must lie in.
pub(super) type Below = (usize, Bounds);

/// State of `validate()`: every node is reached once, and every triangle is in a leaf that contains
/// it or in several that together cover it. More leaves than needed are wasteful (see `references`
/// of the statistics), but no fault.
pub struct Coverage<'a> {
    soup: &'a TriangleSoup,
    nodes: Vec<bool>,
    /// True if a leaf contains the whole triangle.
    contained: Vec<bool>,
    /// Leaves that contain a part of a triangle.
    parts: Vec<(u32, Bounds)>,
}

impl<'a> Coverage<'a> {
    /// Nothing reached yet.
    pub fn new(soup: &'a TriangleSoup, nodes: usize) -> Self {
        Self {
            soup,
            nodes: vec![false; nodes],
            contained: vec![false; soup.records.len()],
            parts: Vec::new(),
        }
    }

    /// Traverses from node 0 and checks that every node is reached once, with at most `most_levels`
    /// levels, and that none is missing. `look` checks a node, given the box around it, and appends
    /// its children with theirs.
    ///
    /// # Errors
    /// The first violated invariant, with the node.
    pub(crate) fn descend(
        mut self,
        most_levels: u32,
        look: impl Fn(&mut Self, usize, &Bounds, &mut Vec<Below>) -> Result<(), AccelError>,
    ) -> Result<(), AccelError> {
        let mut open = vec![(0, Bounds::EVERYTHING, 1)];
        let mut below = Vec::new();
        while let Some((index, around, level)) = open.pop() {
            self.node(index)?;
            ensure!(
                level <= most_levels,
                "node {index}: deeper than {most_levels} levels"
            );
            if index < self.nodes.len() {
                look(&mut self, index, &around, &mut below)
                    .map_err(|e| AccelError::Invalid(format!("node {index}: {e}")))?;
            }
            let deeper = |(child, bounds)| (child, bounds, level + 1);
            open.extend(below.drain(..).map(deeper));
        }
        self.is_complete()
    }

    /// Records that a node is reached.
    ///
    /// # Errors
    /// It does not exist or was reached before.
    pub fn node(&mut self, index: usize) -> Result<(), AccelError> {
        // The root of an empty scene is no node.
        let Some(seen) = self.nodes.get_mut(index) else {
            ensure!(index == 0, "node {index} does not exist");
            return Ok(());
        };
        ensure!(!*seen, "node {index} is reached twice");
        *seen = true;
        Ok(())
    }

    /// Records the triangles of a leaf with these bounds; `None` is a range outside the array.
    ///
    /// # Errors
    /// The range does not exist, or a triangle is wrong, twice in the leaf, or outside it.
    pub fn leaf(
        &mut self,
        triangles: Option<&[TriangleRecord]>,
        bounds: &Bounds,
    ) -> Result<(), AccelError> {
        ensure!(
            triangles.is_some(),
            "a leaf lies outside the triangle array"
        );
        let triangles = triangles.unwrap_or_default();
        for (place, triangle) in triangles.iter().enumerate() {
            let id = triangle.id;
            let scenes = self.soup.records.get(id as usize);
            ensure!(scenes == Some(triangle), "triangle {id} is not the scene's");
            let is_new = triangles[..place].iter().all(|other| other.id != id);
            ensure!(is_new, "triangle {id} is in one leaf twice");
            let own = triangle.bounds();
            if bounds.contains(&own) {
                self.contained[id as usize] = true;
            } else {
                let reaches = meet(bounds, &own);
                ensure!(reaches, "triangle {id} lies outside its leaf's box");
                self.parts.push((id, *bounds));
            }
        }
        Ok(())
    }

    /// Checks that nothing is missing.
    ///
    /// # Errors
    /// A node was not reached, or a triangle is in no leaf, or its leaves do not cover it.
    pub fn is_complete(mut self) -> Result<(), AccelError> {
        self.parts.sort_by_key(|(id, _)| *id);
        for parts in self.parts.chunk_by(|a, b| a.0 == b.0) {
            let id = parts[0].0;
            if self.contained[id as usize] {
                continue;
            }
            let boxes: Vec<Bounds> = parts.iter().map(|(_, bounds)| *bounds).collect();
            let own = Polygon::new(&self.soup.records[id as usize]);
            ensure!(
                covers(&boxes, own),
                "triangle {id} sticks out of its leaf's box, or its {} leaves do not cover it",
                boxes.len()
            );
            self.contained[id as usize] = true;
        }
        let missed = |seen: &[bool]| seen.iter().position(|seen| !seen);
        if let Some(lost) = missed(&self.contained) {
            return Err(AccelError::Invalid(format!(
                "triangle {lost} is in no leaf"
            )));
        }
        if let Some(orphan) = missed(&self.nodes) {
            return Err(AccelError::Invalid(format!(
                "node {orphan} is never reached"
            )));
        }
        Ok(())
    }
}

/// True if two closed boxes have a point in common.
fn meet(a: &Bounds, b: &Bounds) -> bool {
    (0..3).all(|axis| a.min[axis] <= b.max[axis] && b.min[axis] <= a.max[axis])
}

/// True if closed `boxes` together cover `rest`: the parts outside the first one that overlaps it
/// must be covered by the others.
fn covers(boxes: &[Bounds], mut rest: Polygon) -> bool {
    let reaches = |b: &Bounds| {
        (0..3).all(|axis| {
            let at = |corner: &[f64; 3]| corner[axis];
            let (low, high) = (f64::from(b.min[axis]), f64::from(b.max[axis]));
            rest.corners().iter().map(at).any(|x| x <= high)
                && rest.corners().iter().map(at).any(|x| x >= low)
        })
    };
    let Some(first) = boxes.iter().position(reaches) else {
        return false;
    };
    let (cover, others) = (&boxes[first], &boxes[first + 1..]);
    for axis in 0..3 {
        for (border, sign) in [(cover.min[axis], 1.0), (cover.max[axis], -1.0)] {
            let border = f64::from(border);
            let is_outside = |corner: &[f64; 3]| (corner[axis] - border) * sign < 0.0;
            if rest.corners().iter().any(is_outside) {
                if !covers(others, rest.cut(axis, border, -sign)) {
                    return false;
                }
                rest = rest.cut(axis, border, sign);
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures;

    fn soup() -> TriangleSoup {
        fixtures::soup([[[0.0; 3], [4.0, 2.0, 0.0], [0.0, 2.0, 8.0]]])
    }

    fn slab(from: [f32; 3], to: [f32; 3]) -> Bounds {
        Bounds { min: from, max: to }
    }

    fn check(leaves: &[Bounds]) -> Result<(), AccelError> {
        let soup = soup();
        let mut coverage = Coverage::new(&soup, 0);
        for bounds in leaves {
            coverage.leaf(Some(&soup.records), bounds)?;
        }
        coverage.is_complete()
    }

    #[test]
    fn leaves_that_cover_a_triangle_only_together_are_accepted() {
        let low = slab([0.0; 3], [1.5, 2.0, 8.0]);
        let high_near = slab([1.5, 0.0, 0.0], [4.0, 2.0, 3.0]);
        let high_far = slab([1.5, 0.0, 3.0], [4.0, 2.0, 8.0]);
        assert_eq!(check(&[low, high_near, high_far]), Ok(()));
        assert_eq!(check(&[high_far, low, high_near]), Ok(()));
        // A hole of one ulp.
        let moved = slab([1.5_f32.next_up(), 0.0, 0.0], [4.0, 2.0, 3.0]);
        assert!(check(&[low, moved, high_far]).is_err());
        assert!(check(&[low, high_near]).is_err());
        assert!(check(&[low, high_near, low]).is_err());
    }

    #[test]
    fn leaves_need_not_hold_the_corners_of_the_box_that_the_triangle_misses() {
        // Below x = 2 the triangle spans y = 0 to 2, z = 0 to 8; above, y starts at 1, z ends at 4.
        let low = slab([0.0; 3], [2.0, 2.0, 8.0]);
        let high = |y: f32, z: f32| slab([2.0, y, 0.0], [4.0, 2.0, z]);
        assert_eq!(check(&[low, high(1.0, 4.0)]), Ok(()));
        assert_eq!(check(&[high(1.0, 4.0), low]), Ok(()));
        assert!(check(&[low, high(1.0_f32.next_up(), 4.0)]).is_err());
        assert!(check(&[low, high(1.0, 4.0_f32.next_down())]).is_err());
    }

    #[test]
    fn a_triangle_outside_its_leaf_or_twice_in_one_is_refused() {
        let whole = slab([0.0; 3], [4.0, 2.0, 8.0]);
        assert_eq!(check(&[whole]), Ok(()));
        assert!(check(&[]).is_err());
        assert!(check(&[whole, slab([5.0; 3], [9.0; 3])]).is_err());
        // Beside it in one direction only, and touching it.
        for axis in 0..3 {
            let mut beside = whole;
            beside.min[axis] = whole.max[axis].next_up();
            beside.max[axis] += 1.0;
            assert!(check(&[whole, beside]).is_err(), "above, axis {axis}");
            beside.min[axis] = whole.max[axis];
            assert_eq!(check(&[whole, beside]), Ok(()), "axis {axis}");
            beside.min[axis] = -1.0;
            beside.max[axis] = 0.0_f32.next_down();
            assert!(check(&[whole, beside]).is_err(), "below, axis {axis}");
        }
        let soup = soup();
        let twice = [soup.records[0]; 2];
        let mut coverage = Coverage::new(&soup, 0);
        assert!(coverage.leaf(Some(&twice), &whole).is_err());
    }
}

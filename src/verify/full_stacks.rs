//! Stacks as full as they become. Traversals offer entries for a depth that is rounded up, so that the last entries, and the
//! last levels of a restart trail, are reached in few scenes; here a tree is chosen that reaches them, with rays that need
//! every entry on the way.

use crate::gate::{ReferenceTracer, gate};
use crate::rays::RaySet;
use glam::{Vec3, vec3};
use raystone_accel::tree::{NodeKind, Tree, TreeNode};
use raystone_accel::triangle::TriangleRecord;
use raystone_accel::{
    AccelKind, BuildLog, BuiltAccel, Counters, Hit, Intersection, Ray, Traced, TriangleBuffers,
    TriangleSoup, brute_force_hits,
};
use raystone_core::geometry::Triangle;
use raystone_core::params::{ParamValue, Params};
use raystone_gpu::{ArithmeticProbe, Gpu, GpuError};
use raystone_record::{RayClass, fault_text};

/// Parallel triangles in a sheaf: more than fit into leaves of one wide node, so that it is a child with children.
const SHEAF: u32 = 16;
/// Most sheaves in a row.
const MOST_SHEAVES: u32 = 64;
/// Deepest leaf of structures that have a limit of their own: as many levels as the least stack of a kd-tree has entries.
const DEEPEST: i64 = 16;
/// Exponent of two of the distance of the nearest sheaf.
const NEAREST: i32 = -32;
/// Relative error of a distance in f32.
const ROUNDING: f32 = 1e-5;

/// A structure over sheaves of triangles that stand in a row, each twice as far away and as large as the one before. Seen
/// from the origin the deepest subtree is always the nearest, and all others wait.
pub struct FullStack {
    /// The triangles.
    soup: TriangleSoup,
    /// The structure.
    pub built: Box<dyn BuiltAccel>,
    /// Entries that its kernel's stack offers.
    entries: u32,
    /// Entries that a ray to the first triangle of a sheaf needs at most: all rays meet the same boxes.
    held: u32,
    depth: u32,
    rays: Vec<Ray>,
}

impl FullStack {
    /// The row that fills the smallest stack best, or is deepest where several do; `None` for structures without a stack.
    pub fn of(kind: &dyn AccelKind, params: &Params, tests: Intersection) -> Option<Self> {
        let deep = params.0.contains_key("max_depth").then(|| {
            let mut deep = params.clone();
            let deepest = ParamValue::Integer(DEEPEST);
            deep.0.insert("max_depth".to_owned(), deepest);
            deep
        });
        let each = std::iter::once(params).chain(&deep);
        let full = each.filter_map(|params| Self::fullest(kind, params, tests));
        full.max_by_key(|one| (one.held, one.depth))
    }

    fn fullest(kind: &dyn AccelKind, params: &Params, tests: Intersection) -> Option<Self> {
        let mut best: Option<Self> = None;
        for sheaves in 2..=MOST_SHEAVES {
            // Longer rows exceed a limit of the structure, or need another kernel.
            let Some(next) = Self::over(sheaves, kind, params, tests) else {
                break;
            };
            if best
                .as_ref()
                .is_some_and(|best| best.entries != next.entries)
            {
                break;
            }
            let key = |one: &Self| (one.held, one.depth);
            if best.as_ref().is_none_or(|best| key(best) < key(&next)) {
                best = Some(next);
            }
        }
        best
    }

    fn over(
        sheaves: u32,
        kind: &dyn AccelKind,
        params: &Params,
        tests: Intersection,
    ) -> Option<Self> {
        let all = sheaves * SHEAF;
        let records: Vec<TriangleRecord> = (0..all).map(|id| record(id, all)).collect();
        let soup = TriangleSoup::from(records).intersecting(tests);
        let log = &mut BuildLog::default();
        let built = match kind.over_tree() {
            Some(layout) => layout.lay_out(&chain(&soup), &soup, params, log),
            None => kind.build(&soup, params, log),
        };
        let built = built.ok()?;
        let constants = built.buffers().constants;
        let (_, entries) = constants
            .iter()
            .find(|(name, _)| *name == "STACK_ENTRIES")?;
        let rays: Vec<Ray> = (0..all).map(|id| towards(id, all)).collect();
        let mut work = Counters::default();
        let twin = built.cpu_twin(&soup)?;
        for ray in rays.iter().step_by(SHEAF as usize) {
            twin.closest_hit(ray, &mut work);
        }
        drop(twin);
        Some(Self {
            entries: *entries,
            held: work.stack_high_water,
            depth: built.stats().depth.unwrap_or(0),
            rays,
            soup,
            built,
        })
    }

    /// What is wrong with the structure as it was uploaded; `None` if nothing is.
    ///
    /// # Errors
    /// A kernel does not compile, or the device is lost or hangs.
    pub fn fault(
        &self,
        gpu: &Gpu,
        traced: &Traced,
        probe: &ArithmeticProbe,
    ) -> Result<Option<String>, GpuError> {
        if self.held > self.entries {
            let (held, entries) = (self.held, self.entries);
            return Ok(Some(format!(
                "rays need {held} entries of a stack of {entries}"
            )));
        }
        if let Err(fault) = self.built.validate(&self.soup) {
            return Ok(Some(fault.to_string()));
        }
        let truth = brute_force_hits(&self.soup, &self.rays);
        let is_own = |(id, hit): (u32, &Hit)| {
            let distance = distance(id);
            hit.triangle == id && (hit.t - distance).abs() <= ROUNDING * distance
        };
        if !(0..).zip(&truth).all(is_own) {
            return Ok(Some(
                "rays do not meet the triangles that they should".into(),
            ));
        }
        let set = RaySet {
            class: RayClass::Hard,
            rays: self.rays.clone(),
            truth,
            shadow: Vec::new(),
        };
        let reference = ReferenceTracer::of_sets(vec![set]);
        let triangles = TriangleBuffers::upload(gpu, &self.soup)?;
        let verdict = gate(gpu, &triangles, &self.soup, traced, &reference, probe, true)?;
        Ok((!verdict.passed).then(|| fault_text(&verdict)))
    }
}

/// Distance of a triangle along x.
fn distance(id: u32) -> f32 {
    let sheaf = 2.0_f32.powi(NEAREST + (id / SHEAF) as i32);
    sheaf * (1.0 + (id % SHEAF) as f32 / 64.0)
}

/// Legs of a triangle of `all`, in its distance: from 1 to 1.5.
fn legs(id: u32, all: u32) -> f32 {
    1.0 + 0.5 * id as f32 / all as f32
}

fn record(id: u32, all: u32) -> TriangleRecord {
    let leg = distance(id) * legs(id, all);
    let foot = distance(id) * Vec3::X;
    let vertices = [foot, foot + leg * Vec3::Y, foot + leg * Vec3::Z];
    TriangleRecord::new(&Triangle { vertices }, id, 0)
}

/// From the origin through the boxes of all triangles, beyond the long sides of those that are nearer than its own.
fn towards(id: u32, all: u32) -> Ray {
    let aside = 0.5 * legs(id, all) - 0.125 / all as f32;
    Ray::new(Vec3::ZERO, vec3(1.0, aside, aside))
}

/// The tree whose root parts the farthest sheaf from all others, and so on.
fn chain(soup: &TriangleSoup) -> Tree {
    let mut tree = Tree::default();
    let triangles = soup.records.len() as u32;
    tree.order = (0..triangles).collect();
    grow(&mut tree, soup, 0..triangles);
    tree
}

/// Appends the subtree over these triangles.
fn grow(tree: &mut Tree, soup: &TriangleSoup, range: std::ops::Range<u32>) {
    let (first, count) = (range.start, range.end - range.start);
    let boxes = soup.records[first as usize..range.end as usize].iter();
    let boxes = boxes.map(TriangleRecord::bounds);
    let Some(bounds) = boxes.reduce(|all, one| all.union(&one)) else {
        return;
    };
    let root = tree.nodes.len();
    let kind = NodeKind::Leaf { first, count };
    tree.nodes.push(TreeNode { bounds, kind });
    if count > 1 {
        let middle = if count > SHEAF {
            range.end - SHEAF
        } else {
            first + count / 2
        };
        grow(tree, soup, first..middle);
        let right = tree.nodes.len() as u32;
        grow(tree, soup, middle..range.end);
        let left = root as u32 + 1;
        tree.nodes[root].kind = NodeKind::Inner { left, right };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_accel::AccelRegistry;

    fn filled(name: &str, changes: &[(&str, &str)]) -> FullStack {
        let registry = AccelRegistry::default();
        let kind = registry.get(name).expect("a structure");
        let entries = registry.entries();
        let entry = entries.iter().find(|e| e.name == name).expect("an entry");
        let mut params = entry.default_variant().params;
        for (key, value) in changes {
            let value = ParamValue::Name((*value).to_owned());
            params.0.insert((*key).to_owned(), value);
        }
        FullStack::of(kind, &params, Intersection::default()).expect("a stack")
    }

    #[test]
    fn stacks_and_trails_are_filled() {
        // Entries to spare: leaves of pairs of boxes do not wait, and neither do the lowest nodes of wide ones.
        for (name, changes, spare) in [
            ("bvh", &[][..], 1),
            ("bvh", &[("node_bytes", "32")], 0),
            ("kd-tree", &[], 0),
            ("bvh4", &[], 2),
            ("cwbvh", &[], 2),
            ("octree", &[], 1),
            ("object-list", &[], 1),
            ("meta-bvh", &[], 2),
        ] {
            let full = filled(name, changes);
            assert_eq!(full.held + spare, full.entries, "{name} {changes:?}");
        }
        let trail = filled("bvh", &[("traversal", "short-stack")]);
        assert_eq!((trail.held, trail.depth), (trail.entries, 64));
    }

    #[test]
    fn structures_without_a_stack_have_nothing_to_fill() {
        let registry = AccelRegistry::default();
        let kind = registry.get("uniform-grid").expect("a structure");
        let params = Params::default();
        assert!(FullStack::of(kind, &params, Intersection::default()).is_none());
    }
}

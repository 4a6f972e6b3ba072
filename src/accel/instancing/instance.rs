//! Shared parts of the two-level traversals: instances as read by kernels, object-space rays, boxes
//! grown for the ray, and the traversal of one object. CPU version of
//! `kernels/accel/instance.wesl`.

use super::super::bounds::Bounds;
use super::super::bvh::pairs::Pair;
use super::super::intersection::{Intersection, Reciprocal};
use super::super::leaf::{LEAF, leaf_range};
use super::super::ray::{Hit, Ray};
use super::super::triangle::{TriangleRecord, intersect_triangle};
use super::super::twin::Walk;
use super::forest::Forest;
use bytemuck::{Pod, Zeroable};
use raystone_scene::{Instance, Transform};

/// `LEAF` without content: the missing child of a node with one child.
pub(super) const NOTHING: u32 = 0x8000_0000;
/// Flag of an entry whose rays need no transform.
pub(super) const IDENTITY: u32 = 1;

/// An instance, or the part of it below a node of its object: four `vec4<u32>`. The columns of the
/// map to object space and the translation.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct Entry {
    pub x: [f32; 3],
    /// Start node in the object's BVH.
    pub node: u32,
    pub y: [f32; 3],
    /// Scene index of the instance's first triangle.
    pub first_id: u32,
    pub z: [f32; 3],
    pub flags: u32,
    pub offset: [f32; 3],
    /// Index of the instance, for checks.
    pub instance: u32,
}

impl Entry {
    pub(super) fn new(index: u32, instance: &Instance, node: u32) -> Self {
        let Transform { rows } = instance.to_object;
        let column = |c: usize| rows.map(|row| row[c]);
        Self {
            x: column(0),
            node,
            y: column(1),
            first_id: instance.first,
            z: column(2),
            flags: if instance.is_identity() { IDENTITY } else { 0 },
            offset: column(3),
            instance: index,
        }
    }

    pub(super) fn object_ray(&self, ray: &Ray) -> Ray {
        if self.flags & IDENTITY != 0 {
            return *ray;
        }
        let linear = |v: [f32; 3], axis: usize| {
            self.x[axis] * v[0] + self.y[axis] * v[1] + self.z[axis] * v[2]
        };
        Ray {
            origin: [0, 1, 2].map(|axis| linear(ray.origin, axis) + self.offset[axis]),
            direction: [0, 1, 2].map(|axis| linear(ray.direction, axis)),
            ..*ray
        }
    }
}

/// The ray in the object space of an instance. Distances are unchanged.
pub(super) fn object_ray(instance: &Instance, ray: &Ray) -> Ray {
    Entry::new(0, instance, 0).object_ray(ray)
}

/// A ray for the box tests of one level: low planes use one origin and high planes another, which
/// grows every box by their distance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    pub ray: Ray,
    pub inverse: Reciprocal,
    low_origin: [f32; 3],
    high_origin: [f32; 3],
}

/// A level for boxes grown by `growth` per unit of the raised ray origin's largest coordinate.
pub(super) fn level(ray: &Ray, growth: f32, tests: Intersection) -> Level {
    let [x, y, z] = ray.origin.map(f32::abs);
    let grown = growth * x.max(y).max(z);
    Level {
        ray: *ray,
        inverse: tests.inverse(ray.direction),
        low_origin: ray.origin.map(|x| x + grown),
        high_origin: ray.origin.map(|x| x - grown),
    }
}

pub(super) fn object_level(entry: &Entry, ray: &Ray, tests: Intersection) -> Level {
    level(&tests.raised(&entry.object_ray(ray)), 0.0, tests)
}

/// Distance at which the segment up to `t_best` enters the grown and padded box, or `None`.
pub(super) fn enter_grown(level: &Level, bounds: &Bounds, t_best: f32) -> Option<f32> {
    let near = |a: usize| (bounds.min[a] - level.low_origin[a]) * level.inverse[a];
    let far = |a: usize| (bounds.max[a] - level.high_origin[a]) * level.inverse[a];
    let (x1, x2) = (near(0), far(0));
    let (y1, y2) = (near(1), far(1));
    let (z1, z2) = (near(2), far(2));
    let enter = x1.min(x2).max(y1.min(y2)).max(z1.min(z2));
    let exit = x1.max(x2).min(y1.max(y2)).min(z1.max(z2));
    let enter = enter.max(level.ray.t_min);
    (enter <= exit.min(t_best) * level.inverse.pad).then_some(enter)
}

/// Tests the triangles of a leaf; `first_id` converts their ids to those of the scene.
pub(super) fn leaf(
    triangles: &[TriangleRecord],
    reference: u32,
    first_id: u32,
    level: &Level,
    walk: &mut Walk,
) {
    let (first, count) = leaf_range(reference);
    for triangle in &triangles[first..first + count] {
        walk.read(triangle);
        walk.counters.triangle_tests += 1;
        let id = triangle.id + first_id;
        let triangle = TriangleRecord { id, ..*triangle };
        let triangle = (&triangle, walk.masks);
        intersect_triangle(triangle, &level.ray, level.inverse, &mut walk.hit);
    }
}

/// Both children of a node in order of distance, with their entry distances.
pub(super) fn near_and_far(
    (place, node): (u32, &Pair),
    level: &Level,
    walk: &mut Walk,
) -> [(Option<f32>, u32); 2] {
    walk.visit(place as usize, node);
    walk.counters.box_tests += 2;
    let [(left, left_box), (right, right_box)] = node.children();
    let enter_left = enter_grown(level, &left_box, walk.hit.t);
    let enter_right = enter_grown(level, &right_box, walk.hit.t);
    let swap = enter_right.is_some_and(|r| enter_left.is_none_or(|l| r < l));
    if swap {
        [(enter_right, right), (enter_left, left)]
    } else {
        [(enter_left, left), (enter_right, right)]
    }
}

/// True if a child still needs a visit: the near one may have found a hit in the meantime.
pub(super) fn is_open(enter: Option<f32>, level: &Level, hit: &Hit) -> bool {
    enter.is_some_and(|e| e <= hit.t * level.inverse.pad)
}

/// Traces the object below `entry.node`, near child first.
pub(super) fn trace_object(forest: &Forest, entry: &Entry, walk: &mut Walk) {
    let level = object_level(walk.read(entry), &walk.ray, forest.intersection);
    let node = |index: u32| &forest.nodes[index as usize];
    descend(node, entry.node, &level, walk, |reference, walk| {
        leaf(&forest.triangles, reference, entry.first_id, &level, walk);
    });
}

/// The traversal loop of each level in the nested version; `visit` gets the references of leaves.
pub(super) fn descend<'a>(
    node: impl Fn(u32) -> &'a Pair,
    root: u32,
    level: &Level,
    walk: &mut Walk,
    visit: impl Fn(u32, &mut Walk),
) {
    let mut stack = Vec::new();
    let mut current = root;
    loop {
        let children = near_and_far((current, node(current)), level, walk);
        let mut next = NOTHING;
        for (enter, reference) in children {
            if !is_open(enter, level, &walk.hit) || reference == NOTHING {
                continue;
            }
            if reference >= LEAF {
                visit(reference, walk);
                if walk.is_answered() {
                    return;
                }
            } else if next == NOTHING {
                next = reference;
            } else {
                stack.push(reference);
                walk.count_stack(stack.len());
            }
        }
        if next == NOTHING {
            match stack.pop() {
                Some(reference) => next = reference,
                None => return,
            }
        }
        current = next;
    }
}

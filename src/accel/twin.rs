//! Twins: the traversals of kernels in scalar Rust, with the same hits and the same counted work.
//!
//! A structure writes [`Traverse::trace`], the twin of the kernel's `trace`. What all of them begin
//! and end with stands here. Twin of `kernels/accel/query.wesl`.

use super::TriangleSoup;
use super::bounds::Bounds;
use super::intersection::{Reciprocal, enter_box};
use super::mask::Masks;
use super::ray::{Hit, NO_HIT, Ray};
use super::triangle::{TriangleRecord, intersect_triangle};
use super::watch;
use raystone_core::structure::Counters;

/// One ray on its way through a structure, with what is asked and what was found so far.
pub struct Walk<'a> {
    /// The ray as it is traced: see [`super::ray::raised`].
    pub ray: Ray,
    /// What tests need of its direction.
    pub inverse: Reciprocal,
    /// What is cut out of triangles.
    pub masks: Option<&'a Masks>,
    /// Whether any hit is enough.
    pub any: bool,
    /// The nearest hit so far.
    pub hit: Hit,
    /// The work so far.
    pub counters: &'a mut Counters,
}

impl<'a> Walk<'a> {
    /// The way of `ray` through triangles that are met by the tests of `soup`.
    pub fn new(ray: &Ray, any: bool, soup: &'a TriangleSoup, counters: &'a mut Counters) -> Self {
        let tests = soup.intersection;
        let ray = tests.raised(ray);
        Self {
            ray,
            inverse: tests.inverse(ray.direction),
            masks: soup.masks.as_deref(),
            any,
            hit: Hit::miss(&ray),
            counters,
        }
    }

    /// Whether any hit is enough and there is one.
    pub fn is_answered(&self) -> bool {
        self.any && self.hit.triangle != NO_HIT
    }

    /// Counts the visit of a node or cell, given its place among the structure's own, and reads it.
    pub fn visit<'n, N: ?Sized>(&mut self, place: usize, node: &'n N) -> &'n N {
        watch::read(node);
        self.counters.nodes += 1;
        watch::note(watch::Event::Node(place as u32));
        node
    }

    /// Notes that something else is read of what a kernel reads, for the visit or the test that comes next.
    pub fn read<'n, N: ?Sized>(&mut self, what: &'n N) -> &'n N {
        watch::read(what)
    }

    /// Notes how many entries the stack has.
    pub(crate) fn count_stack(&mut self, entries: usize) {
        let highest = &mut self.counters.stack_high_water;
        *highest = (*highest).max(entries as u32);
    }

    /// Distance at which the ray enters a box before the hit so far, or `None`; see `enter_box`.
    pub fn enter(&mut self, bounds: &Bounds) -> Option<f32> {
        self.counters.box_tests += 1;
        enter_box(bounds, &self.ray, self.inverse, self.hit.t)
    }

    /// Tests a triangle.
    pub fn test(&mut self, triangle: &TriangleRecord) {
        self.counters.triangle_tests += 1;
        let triangle = (watch::read(triangle), self.masks);
        intersect_triangle(triangle, &self.ray, self.inverse, &mut self.hit);
    }

    /// Tests the triangles of a list.
    pub(crate) fn test_list(&mut self, soup: &TriangleSoup, ids: &[u32]) {
        for id in watch::each(ids) {
            self.test(&soup.records[id as usize]);
        }
    }
}

/// A structure that can be traversed on the host.
pub trait Traverse: Sync {
    /// Twin of the kernel's `trace`; `soup` is what the structure was built over.
    fn trace(&self, soup: &TriangleSoup, walk: Walk) -> Hit;
}

/// What answers rays on the host.
pub trait CpuTwin: Sync {
    /// Nearest hit, ties decided for the lowest triangle index.
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit;
    /// Whether anything is hit.
    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool;
}

/// A structure with the triangles that it was built over.
pub struct Twin<'a, T>(pub &'a T, pub &'a TriangleSoup);

impl<T: Traverse> CpuTwin for Twin<'_, T> {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        let Self(built, soup) = self;
        built.trace(soup, Walk::new(ray, false, soup, counters))
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        let Self(built, soup) = self;
        let walk = Walk::new(ray, true, soup, counters);
        built.trace(soup, walk).triangle != NO_HIT
    }
}

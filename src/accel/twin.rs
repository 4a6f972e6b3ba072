//! Twins: scalar CPU versions of the kernels' traversals, with the same hits and work counters.
//!
//! A structure implements [`Traverse::trace`], the CPU version of the kernel's `trace`. Their
//! common start and end are here. CPU version of `kernels/accel/query.wesl`.

use super::TriangleSoup;
use super::bounds::{Bounds, enter_box};
use super::intersection::Reciprocal;
use super::mask::Masks;
use super::ray::{Hit, NO_HIT, Ray};
use super::triangle::{TriangleRecord, intersect_triangle};
use super::watch;
use raystone_core::structure::Counters;

/// The state of one ray in a traversal: the query and the result so far.
pub struct Walk<'a> {
    /// The ray as traced: see [`super::ray::raised`].
    pub ray: Ray,
    /// Reciprocal of its direction, for the tests.
    pub inverse: Reciprocal,
    /// Masks that cut holes into triangles.
    pub masks: Option<&'a Masks>,
    /// True if any hit is enough.
    pub any: bool,
    /// The nearest hit so far.
    pub hit: Hit,
    /// The work so far.
    pub counters: &'a mut Counters,
}

impl<'a> Walk<'a> {
    /// The traversal of `ray` through triangles with the tests of `soup`.
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

    /// True if any hit is enough and there is one.
    pub fn is_answered(&self) -> bool {
        self.any && self.hit.triangle != NO_HIT
    }

    /// Counts the visit of a node or cell, given its index in the structure, and reads it.
    pub fn visit<'n, N: ?Sized>(&mut self, place: usize, node: &'n N) -> &'n N {
        watch::read(node);
        self.counters.nodes += 1;
        watch::note(watch::Event::Node(place as u32));
        node
    }

    /// Records an additional read of kernel data, for the next visit or test.
    pub fn read<'n, N: ?Sized>(&mut self, what: &'n N) -> &'n N {
        watch::read(what)
    }

    pub(crate) fn count_stack(&mut self, entries: usize) {
        let highest = &mut self.counters.stack_high_water;
        *highest = (*highest).max(entries as u32);
    }

    /// Distance at which the ray enters a box before the hit so far, or `None`; see `enter_box`.
    pub fn enter(&mut self, bounds: &Bounds) -> Option<f32> {
        self.counters.box_tests += 1;
        let inverse = self.inverse;
        enter_box(bounds, &self.ray, *inverse, inverse.pad, self.hit.t)
    }

    /// Tests a triangle.
    pub fn test(&mut self, triangle: &TriangleRecord) {
        self.counters.triangle_tests += 1;
        let triangle = (watch::read(triangle), self.masks);
        intersect_triangle(triangle, &self.ray, self.inverse, &mut self.hit);
    }

    pub(crate) fn test_list(&mut self, soup: &TriangleSoup, ids: &[u32]) {
        for id in watch::each(ids) {
            self.test(&soup.records[id as usize]);
        }
    }
}

/// A structure that can be traversed on the host.
pub trait Traverse: Sync {
    /// CPU version of the kernel's `trace`; `soup` holds the triangles of the build.
    fn trace(&self, soup: &TriangleSoup, walk: Walk) -> Hit;
}

/// Answers rays on the host.
pub trait CpuTwin: Sync {
    /// Nearest hit; ties go to the lowest triangle index.
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit;
    /// True if anything is hit.
    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool;
}

/// A structure with the triangles it was built from.
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

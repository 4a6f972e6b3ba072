//! Boxes in vector registers, and references: the working data of builders.

use crate::TriangleSoup;
use crate::bounds::Bounds;
use glam::{Vec3A, Vec3Swizzles, Vec4};
use rayon::prelude::*;

/// An axis-aligned box for builders: [`Bounds`] in two vector registers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Box3 {
    pub min: Vec3A,
    pub max: Vec3A,
}

impl Box3 {
    /// Identity of [`Box3::union`].
    pub(super) const EMPTY: Box3 = Box3 {
        min: Vec3A::INFINITY,
        max: Vec3A::NEG_INFINITY,
    };

    pub(super) fn union(self, other: Box3) -> Box3 {
        Box3 {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// The common part; its half area is 0 if there is none.
    pub(super) fn intersection(self, other: Box3) -> Box3 {
        Box3 {
            min: self.min.max(other.min),
            max: self.max.min(other.max),
        }
    }

    pub(super) fn with_point(self, point: Vec3A) -> Box3 {
        self.union(Box3 {
            min: point,
            max: point,
        })
    }

    /// Half the surface area; 0 for an empty box.
    pub(super) fn half_area(self) -> f32 {
        let e = (self.max - self.min).max(Vec3A::ZERO);
        e.dot(e.yzx())
    }

    pub(super) fn longest_axis(self) -> usize {
        (self.max - self.min).max_position()
    }
}

impl From<Bounds> for Box3 {
    fn from(bounds: Bounds) -> Self {
        Box3 {
            min: bounds.min.into(),
            max: bounds.max.into(),
        }
    }
}

impl From<Box3> for Bounds {
    fn from(bounds: Box3) -> Self {
        Bounds {
            min: bounds.min.into(),
            max: bounds.max.into(),
        }
    }
}

/// A triangle in a leaf: its box, or after a spatial split a part of it. 32 bytes.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct Reference {
    pub min: [f32; 3],
    pub id: u32,
    pub max: [f32; 3],
    /// Padding; 1, since arithmetic on tiny numbers is slow on some processors.
    filling: f32,
}

impl Reference {
    pub(super) fn new(bounds: Box3, id: u32) -> Self {
        Self {
            min: bounds.min.into(),
            id,
            max: bounds.max.into(),
            filling: 1.0,
        }
    }

    pub(super) fn bounds(&self) -> Box3 {
        // One load each; the fourth lane is unused.
        let [x, y, z] = self.min;
        let min = Vec4::new(x, y, z, f32::from_bits(self.id));
        let [x, y, z] = self.max;
        let max = Vec4::new(x, y, z, self.filling);
        Box3 {
            min: Vec3A::from_vec4(min),
            max: Vec3A::from_vec4(max),
        }
    }

    /// Twice the centre: sufficient for sorting and binning, without the division.
    pub(super) fn centre(&self) -> Vec3A {
        let Box3 { min, max } = self.bounds();
        min + max
    }

    /// Orders by centre along `axis`, then id: the result does not depend on the input order.
    pub(super) fn compare(&self, other: &Self, axis: usize) -> std::cmp::Ordering {
        let centre = |r: &Self| r.min[axis] + r.max[axis];
        centre(self)
            .total_cmp(&centre(other))
            .then(self.id.cmp(&other.id))
    }
}

pub(super) fn references(soup: &TriangleSoup) -> Vec<Reference> {
    let reference = |record: &crate::triangle::TriangleRecord| {
        Reference::new(record.bounds().into(), record.id)
    };
    soup.records.par_iter().map(reference).collect()
}

pub(super) fn bounds_of(references: &[Reference]) -> Box3 {
    let boxes = references.iter().map(Reference::bounds);
    boxes.fold(Box3::EMPTY, Box3::union)
}

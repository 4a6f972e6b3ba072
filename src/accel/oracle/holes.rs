//! The oracle's interface to holes in triangles.

use super::triangle::Crossing;
use raystone_core::geometry::Triangle;

/// Verdict on the surface at a point of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// Certainly a surface.
    Surface,
    /// Certainly a hole.
    Hole,
    /// Rounding decides.
    Open,
}

/// The weight of a corner, and the possible error of an f32 test's weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weight {
    /// In f64.
    pub value: f64,
    /// Bound on the difference.
    pub error: f64,
}

/// Holes in the triangles of a scene.
pub trait Holes: Sync {
    /// Tests for a surface at the point of a triangle with these weights of its second and third
    /// corners; `None` if the weights are unknown.
    fn cut(&self, triangle: u32, weights: Option<[Weight; 2]>) -> Cut;
}

/// The triangles of a scene, with their holes.
#[derive(Clone, Copy)]
pub struct Surfaces<'a> {
    /// The triangles.
    pub triangles: &'a [Triangle],
    /// `None` if no triangle has holes.
    pub holes: Option<&'a dyn Holes>,
}

impl Surfaces<'_> {
    /// Tests for a surface where a ray crosses a triangle.
    pub(super) fn cut(&self, id: u32, crossing: &Crossing) -> Cut {
        let holes = self.holes;
        holes.map_or(Cut::Surface, |holes| holes.cut(id, crossing.weights()))
    }
}

impl<'a> From<&'a [Triangle]> for Surfaces<'a> {
    fn from(triangles: &'a [Triangle]) -> Self {
        let holes = None;
        Self { triangles, holes }
    }
}

impl<'a> From<&'a Vec<Triangle>> for Surfaces<'a> {
    fn from(triangles: &'a Vec<Triangle>) -> Self {
        Self::from(&triangles[..])
    }
}

impl<'a, const N: usize> From<&'a [Triangle; N]> for Surfaces<'a> {
    fn from(triangles: &'a [Triangle; N]) -> Self {
        Self::from(&triangles[..])
    }
}

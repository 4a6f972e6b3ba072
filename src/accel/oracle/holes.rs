//! What is cut out of triangles, as the oracle asks for it.

use super::triangle::Crossing;
use raystone_core::geometry::Triangle;

/// Whether there is a surface at a point of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// For certain.
    Surface,
    /// There is none for certain.
    Hole,
    /// Rounding decides.
    Open,
}

/// The weight of a corner, and how far that of an f32 test may be from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weight {
    /// In f64.
    pub value: f64,
    /// Bound on the difference.
    pub error: f64,
}

/// Knows what is cut out of triangles.
pub trait Holes: Sync {
    /// Whether there is a surface at the point of a triangle with these weights of its second and third corner; `None` where nothing
    /// is known of the weights.
    fn cut(&self, triangle: u32, weights: Option<[Weight; 2]>) -> Cut;
}

/// The triangles of a scene, with what is cut out of them.
#[derive(Clone, Copy)]
pub struct Surfaces<'a> {
    /// The triangles.
    pub triangles: &'a [Triangle],
    /// `None` if all are whole.
    pub holes: Option<&'a dyn Holes>,
}

impl Surfaces<'_> {
    /// Whether there is a surface where a ray crosses a triangle.
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

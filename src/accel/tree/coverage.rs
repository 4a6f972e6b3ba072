//! What `validate()` of a structure over triangles checks.

use crate::accel::bounds::Bounds;
use crate::accel::triangle::TriangleRecord;
use crate::accel::{AccelError, TriangleSoup};

/// Bookkeeping of `validate()`: every node reached once, every triangle in one leaf that contains it.
pub struct Coverage<'a> {
    soup: &'a TriangleSoup,
    nodes: Vec<bool>,
    triangles: Vec<bool>,
}

impl<'a> Coverage<'a> {
    /// Nothing reached yet.
    pub fn new(soup: &'a TriangleSoup, nodes: usize) -> Self {
        Self {
            soup,
            nodes: vec![false; nodes],
            triangles: vec![false; soup.records.len()],
        }
    }

    /// Notes that a node is reached.
    ///
    /// # Errors
    /// It does not exist or was reached before.
    pub fn node(&mut self, index: usize) -> Result<(), AccelError> {
        match self.nodes.get_mut(index) {
            // The root of an empty scene is no node.
            None if index == 0 => Ok(()),
            None => Err(AccelError::Invalid(format!("node {index} does not exist"))),
            Some(true) => Err(AccelError::Invalid(format!(
                "node {index} is reached twice"
            ))),
            Some(seen) => {
                *seen = true;
                Ok(())
            }
        }
    }

    /// Notes the triangles of a leaf with these bounds; `None` is a range outside the array.
    ///
    /// # Errors
    /// The range does not exist, or a triangle differs from the scene's, is in two leaves, or
    /// sticks out of the leaf's box.
    pub fn leaf(
        &mut self,
        triangles: Option<&[TriangleRecord]>,
        bounds: &Bounds,
    ) -> Result<(), AccelError> {
        let Some(triangles) = triangles else {
            return Err(AccelError::Invalid(
                "a leaf lies outside the triangle array".to_owned(),
            ));
        };
        for triangle in triangles {
            let id = triangle.id;
            if self.soup.records.get(id as usize) != Some(triangle) {
                return Err(AccelError::Invalid(format!(
                    "triangle {id} is not the scene's"
                )));
            }
            if std::mem::replace(&mut self.triangles[id as usize], true) {
                return Err(AccelError::Invalid(format!(
                    "triangle {id} is in two leaves"
                )));
            }
            if !bounds.contains(&triangle.bounds()) {
                return Err(AccelError::Invalid(format!(
                    "triangle {id} sticks out of its leaf's box"
                )));
            }
        }
        Ok(())
    }

    /// Checks that nothing was missed.
    ///
    /// # Errors
    /// A node or triangle was not reached.
    pub fn is_complete(&self) -> Result<(), AccelError> {
        if let Some(lost) = self.triangles.iter().position(|seen| !seen) {
            return Err(AccelError::Invalid(format!(
                "triangle {lost} is in no leaf"
            )));
        }
        match self.nodes.iter().position(|seen| !seen) {
            Some(orphan) => Err(AccelError::Invalid(format!(
                "node {orphan} is never reached"
            ))),
            None => Ok(()),
        }
    }
}

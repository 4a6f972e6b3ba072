//! Objects and instances: scenes of copies of a few objects, placed by affine transforms.
//!
//! The triangles of [`super::SceneData`] remain a flat world-space list: the copies of all
//! instances in order. An [`Assembly`] records their objects, for two-level structures.

use glam::{DMat3, DVec3, Mat4, Vec3};
use raystone_core::geometry::Triangle;
use thiserror::Error;

/// Transforms with a larger condition number (‖A‖ · ‖A⁻¹‖, maximum row sums) are refused: f32
/// rounding alone would move the geometry by its own thickness.
pub(crate) const MAX_CONDITION: f64 = 1_048_576.0;

/// Triangle limit of a scene: indices have 32 bits and the last one means "no hit".
const MAX_TRIANGLES: u64 = u32::MAX as u64;

/// An affine transform: three rows of a 3×4 matrix; the fourth column is the translation.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Transform {
    /// Row by row.
    pub rows: [[f32; 4]; 3],
}

impl Transform {
    /// The identity.
    pub const IDENTITY: Self = Self {
        rows: [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ],
    };

    /// Returns the transform `linear · p + translation`, with `linear` given by its columns.
    pub fn new(columns: [Vec3; 3], translation: Vec3) -> Self {
        let [x, y, z] = columns;
        Self {
            rows: std::array::from_fn(|row| [x[row], y[row], z[row], translation[row]]),
        }
    }

    /// The affine part of a homogeneous matrix.
    pub fn from_matrix(matrix: Mat4) -> Self {
        let [x, y, z, w] = [0, 1, 2, 3].map(|column| matrix.col(column).truncate());
        Self::new([x, y, z], w)
    }

    /// Transforms a point.
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.rows
            .map(|[x, y, z, w]| x * p.x + y * p.y + z * p.z + w)
            .into()
    }

    /// True if every entry is finite.
    pub fn is_finite(&self) -> bool {
        self.rows.as_flattened().iter().all(|x| x.is_finite())
    }

    /// The linear part and the translation in f64.
    pub fn parts(&self) -> (DMat3, DVec3) {
        let row = |r: usize| {
            let [x, y, z, _] = self.rows[r].map(f64::from);
            DVec3::new(x, y, z)
        };
        let linear = DMat3::from_cols(row(0), row(1), row(2)).transpose();
        (
            linear,
            DVec3::from_array(self.rows.map(|r| f64::from(r[3]))),
        )
    }

    /// The inverse, computed in f64 and rounded to f32; not finite if it does not exist.
    pub fn inverse(&self) -> Self {
        let (linear, translation) = self.parts();
        let inverse = linear.inverse();
        let [x, y, z] = [0, 1, 2].map(|column| inverse.col(column).as_vec3());
        Self::new([x, y, z], (-(inverse * translation)).as_vec3())
    }

    /// True if the transform mirrors: counter-clockwise corners turn clockwise, and the front is
    /// the other side (glTF 2.0, 3.7.4). In f64, so that small scales do not give 0.
    pub fn is_mirrored(&self) -> bool {
        self.parts().0.determinant() < 0.0
    }

    /// ‖A‖ · ‖A⁻¹‖ of the linear part, with maximum absolute row sums as norms; 1 for the identity,
    /// at most 3 for a rotation, infinite or NaN if there is no inverse.
    pub fn condition(&self) -> f64 {
        let (linear, _) = self.parts();
        row_sum_norm(linear) * row_sum_norm(linear.inverse())
    }
}

/// Maximum absolute row sum: the norm induced by the maximum norm.
pub fn row_sum_norm(matrix: DMat3) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|column| matrix.col(column).abs());
    (x + y + z).max_element()
}

/// A copy of an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instance {
    /// Index of the object.
    pub object: u32,
    /// Scene index of the copy's first triangle; the others follow in the object's order.
    pub first: u32,
    /// Object-to-world transform.
    pub to_world: Transform,
    /// World-to-object transform, applied to rays.
    pub to_object: Transform,
}

impl Instance {
    /// True if the transform is the identity, so rays need no transform.
    pub fn is_identity(&self) -> bool {
        self.to_world == Transform::IDENTITY
    }
}

/// An invalid transform or object, with its index.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum InstanceError {
    /// The object has no triangles.
    #[error("object {object} has no triangles; leave it out")]
    EmptyObject {
        /// Index of the object.
        object: usize,
    },
    /// The object does not exist.
    #[error("instance {instance} is one of object {object}, but there are {objects} objects")]
    NoSuchObject {
        /// Index of the instance.
        instance: usize,
        /// Index requested.
        object: u32,
        /// Number of objects.
        objects: usize,
    },
    /// The instance does not exist.
    #[error("instance {instance} does not exist: there are {instances}")]
    NoSuchInstance {
        /// Index requested.
        instance: usize,
        /// Number of instances.
        instances: usize,
    },
    /// The transform has a NaN or infinite entry.
    #[error("instance {instance}: its transform has an entry that is not finite; correct it")]
    NotFinite {
        /// Index of the instance.
        instance: usize,
    },
    /// The transform is singular, or nearly so.
    #[error(
        "instance {instance}: its transform cannot be inverted (condition number {condition:.3e}, \
         the limit is {MAX_CONDITION:.3e}); give it a scale that flattens nothing"
    )]
    Singular {
        /// Index of the instance.
        instance: usize,
        /// Its condition number.
        condition: f64,
    },
    /// The scene exceeds the triangle limit.
    #[error(
        "instance {instance}: the scene needs {needed} triangles, the limit is {MAX_TRIANGLES}; \
         use fewer instances or a coarser object"
    )]
    TooManyTriangles {
        /// Index of the instance.
        instance: usize,
        /// Number of triangles including this instance.
        needed: u64,
    },
}

/// Objects in their own space, and their instances. Every triangle of the scene belongs to an
/// instance; a single object is an instance with the identity.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Assembly {
    objects: Vec<Vec<Triangle>>,
    instances: Vec<Instance>,
    triangles: u64,
}

impl Assembly {
    /// Adds an object and returns its index.
    ///
    /// # Errors
    /// [`InstanceError::EmptyObject`].
    pub fn add_object(&mut self, triangles: Vec<Triangle>) -> Result<u32, InstanceError> {
        let object = self.objects.len();
        if triangles.is_empty() {
            return Err(InstanceError::EmptyObject { object });
        }
        self.objects.push(triangles);
        Ok(object as u32)
    }

    /// Appends an instance.
    ///
    /// # Errors
    /// The object does not exist, the transform is invalid, or there are too many triangles.
    pub fn place(&mut self, object: u32, to_world: Transform) -> Result<Instance, InstanceError> {
        let instance = self.instances.len();
        let triangles = self.objects.get(object as usize);
        let triangles = triangles.ok_or(InstanceError::NoSuchObject {
            instance,
            object,
            objects: self.objects.len(),
        })?;
        let needed = self.triangles + triangles.len() as u64;
        if needed > MAX_TRIANGLES {
            return Err(InstanceError::TooManyTriangles { instance, needed });
        }
        let placed = Instance {
            object,
            first: self.triangles as u32,
            to_world,
            to_object: inverse_of(instance, to_world)?,
        };
        self.instances.push(placed);
        self.triangles = needed;
        Ok(placed)
    }

    /// Replaces an instance's transform.
    ///
    /// # Errors
    /// The instance does not exist, or the transform is singular or not finite.
    pub fn move_to(&mut self, instance: usize, to_world: Transform) -> Result<(), InstanceError> {
        let instances = self.instances.len();
        let found = self.instances.get_mut(instance);
        let found = found.ok_or(InstanceError::NoSuchInstance {
            instance,
            instances,
        })?;
        found.to_object = inverse_of(instance, to_world)?;
        found.to_world = to_world;
        Ok(())
    }

    /// Triangles of each object, in its own space.
    pub fn objects(&self) -> &[Vec<Triangle>] {
        &self.objects
    }

    /// The instances, in the order of their triangles in the scene.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// Total number of triangles of all instances.
    pub fn triangles(&self) -> u64 {
        self.triangles
    }

    /// World-space triangles of an instance.
    pub fn copy(&self, instance: &Instance) -> impl Iterator<Item = Triangle> + '_ {
        let to_world = instance.to_world;
        let triangles = self.objects[instance.object as usize].iter();
        triangles.map(move |triangle| Triangle {
            vertices: triangle.vertices.map(|v| to_world.point(v)),
        })
    }
}

fn inverse_of(instance: usize, to_world: Transform) -> Result<Transform, InstanceError> {
    if !to_world.is_finite() {
        return Err(InstanceError::NotFinite { instance });
    }
    let condition = to_world.condition();
    let inverse = to_world.inverse();
    if !(condition <= MAX_CONDITION && inverse.is_finite()) {
        return Err(InstanceError::Singular {
            instance,
            condition,
        });
    }
    Ok(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_object() -> Assembly {
        let mut assembly = Assembly::default();
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let triangle = Triangle { vertices: corners };
        assembly.add_object(vec![triangle; 3]).unwrap();
        assembly
    }

    fn scaled(x: f32, y: f32, z: f32) -> Transform {
        Transform::new([Vec3::X * x, Vec3::Y * y, Vec3::Z * z], Vec3::ONE)
    }

    #[test]
    fn instances_number_their_triangles_one_after_the_other() {
        let mut assembly = one_object();
        for _ in 0..3 {
            assembly.place(0, scaled(2.0, 3.0, -4.0)).unwrap();
        }
        let firsts: Vec<u32> = assembly.instances().iter().map(|i| i.first).collect();
        assert_eq!((firsts, assembly.triangles()), (vec![0, 3, 6], 9));
        let copy = assembly.copy(&assembly.instances()[1]).next().unwrap();
        assert_eq!(copy.vertices[2], Vec3::new(1.0, 4.0, 1.0));
        let back = assembly.instances()[0].to_object.point(copy.vertices[2]);
        assert!((back - Vec3::Y).abs().max_element() < 1e-6);
    }

    #[test]
    fn transforms_that_cannot_be_inverted_and_missing_objects_are_refused_with_their_place() {
        let mut assembly = one_object();
        assembly.place(0, Transform::IDENTITY).unwrap();
        let singular = |t| matches!(t, Err(InstanceError::Singular { instance: 1, .. }));
        assert!(singular(assembly.place(0, scaled(1.0, 0.0, 1.0))));
        assert!(singular(assembly.place(0, scaled(1.0, 1e-7, 1.0))));
        // Invertible, but the inverse exceeds the range of f32.
        assert!(singular(assembly.place(0, scaled(1e-40, 1e-40, 1e-40))));
        let not_finite = assembly.place(0, scaled(f32::NAN, 1.0, 1.0));
        assert_eq!(not_finite, Err(InstanceError::NotFinite { instance: 1 }));
        let missing = assembly.place(4, Transform::IDENTITY).unwrap_err();
        assert!(missing.to_string().contains("object 4"), "{missing}");
        assert!(assembly.move_to(1, Transform::IDENTITY).is_err());
        assert!(assembly.move_to(0, scaled(0.0, 1.0, 1.0)).is_err());
        assert!(assembly.add_object(Vec::new()).is_err());
        assert_eq!(assembly.instances().len(), 1);
    }

    #[test]
    fn ids_beyond_32_bits_are_refused_with_both_numbers() {
        let mut assembly = one_object();
        assembly.triangles = u64::from(u32::MAX) - 2;
        let error = assembly.place(0, Transform::IDENTITY).unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("4294967296") && text.contains("4294967295"),
            "{text}"
        );
    }
}

//! Refractive index and its gradient, where a path is: of a grid, or of a lens of Luneburg. Lengths are in voxels.
//! Kernel: `kernels/media/optics.wesl`.

use crate::Volume;
use glam::{UVec3, Vec3, Vec4, Vec4Swizzles};
use raystone_gpu::{Bindings, Composition, Gpu, GpuError, UniformValues};

/// Refractive index and gradient at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics {
    /// n.
    pub n: f32,
    /// ∇n, per voxel.
    pub gradient: Vec3,
}

/// What bends light.
#[derive(Debug, Clone)]
pub enum Optical {
    /// A grid.
    Grid {
        /// Voxels along each axis.
        size: UVec3,
        /// Gradient and n of each voxel.
        optics: Vec<Vec4>,
    },
    /// The lens of Luneburg (1944), n² = 2 − (r / radius)², around the middle of a box.
    Lens {
        /// The box.
        size: UVec3,
        /// The radius.
        radius: f32,
    },
}

impl Optical {
    /// The refractive index of a volume with its gradient by central differences.
    pub fn of(volume: &Volume) -> Self {
        let size = UVec3::from(volume.resolution);
        let strides = [1, size.x as usize, (size.x * size.y) as usize];
        let n = &volume.refraction;
        let at = |place: usize| {
            let along = [0, 1, 2].map(|axis| {
                let voxel = place / strides[axis] % size[axis] as usize;
                let back = strides[axis] * usize::from(voxel > 0);
                let on = strides[axis] * usize::from(voxel + 1 < size[axis] as usize);
                let width = (back + on) / strides[axis];
                (n[place + on] - n[place - back]) / (width.max(1) as f32)
            });
            Vec3::from(along).extend(n[place])
        };
        let optics = (0..n.len()).map(at).collect();
        Self::Grid { size, optics }
    }

    /// n and its gradient at a position.
    pub fn optics_at(&self, position: Vec3) -> Optics {
        match self {
            Self::Grid { size, optics } => {
                let most = size - 1;
                let local = (position - 0.5).max(Vec3::ZERO).min(most.as_vec3());
                let low = local.as_uvec3();
                let high = (low + 1).min(most);
                let w = local - low.as_vec3();
                let slice = |z| slice_of(*size, optics, low, high, z, w);
                let bottom = slice(low.z);
                let value = bottom + (slice(high.z) - bottom) * w.z;
                Optics {
                    n: value.w,
                    gradient: value.xyz(),
                }
            }
            Self::Lens { size, radius } => {
                let r = position - size.as_vec3() * 0.5;
                let square = radius * radius;
                let n = (2.0 - (r.x * r.x + r.y * r.y + r.z * r.z) / square)
                    .max(1.0)
                    .sqrt();
                Optics {
                    n,
                    gradient: -r / (square * n),
                }
            }
        }
    }

    /// True where a path goes on.
    pub fn holds(&self, position: Vec3) -> bool {
        match self {
            Self::Grid { size, .. } => {
                (position.cmpge(Vec3::ZERO) & position.cmple(size.as_vec3())).all()
            }
            Self::Lens { size, radius } => {
                let r = position - size.as_vec3() * 0.5;
                r.x * r.x + r.y * r.y + r.z * r.z <= radius * radius
            }
        }
    }

    /// A kernel that marches through it.
    pub(crate) fn compose(&self, composition: Composition) -> Composition {
        composition.feature("lens", matches!(self, Self::Lens { .. }))
    }

    /// Adds what kernels read of it, with the side of a voxel in the world.
    ///
    /// # Errors
    /// The grid exceeds what the adapter binds.
    pub(crate) fn bind(
        &self,
        gpu: &Gpu,
        bindings: &mut Bindings,
        voxel: f64,
    ) -> Result<(), GpuError> {
        let (size, radius) = match self {
            Self::Grid { size, optics } => {
                bindings.buffer("optics", &gpu.storage("optics", optics)?);
                (size, 0.0)
            }
            Self::Lens { size, radius } => (size, *radius),
        };
        let optical = UniformValues::new()
            .uvec("size", &size.to_array())
            .f32("radius", radius)
            .f32("voxel", voxel as f32);
        bindings.uniform("optical", optical);
        Ok(())
    }
}

/// The four voxels of a slice.
fn slice_of(size: UVec3, optics: &[Vec4], low: UVec3, high: UVec3, z: u32, w: Vec3) -> Vec4 {
    let rows = [low.y, high.y].map(|y| size.x * (y + size.y * z));
    let at = |place: u32| optics[place as usize];
    let (a, b) = (at(rows[0] + low.x), at(rows[0] + high.x));
    let (c, d) = (at(rows[1] + low.x), at(rows[1] + high.x));
    let near = a + (b - a) * w.x;
    near + (c + (d - c) * w.x - near) * w.y
}

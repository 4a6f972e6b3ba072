//! The axes of the product of cells, each declared once with name, default and meaning.

use std::fmt;
use std::ops::{Index, IndexMut};

macro_rules! axes {
    ($($(#[doc = $doc:literal])+ $axis:ident = $name:literal $(or $default:literal)?;)+) => {
        /// An axis of the product of cells.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Axis {
            $($(#[doc = $doc])+ $axis,)+
        }

        impl Axis {
            /// All axes, in the order of tables and plans.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$axis),+];

            /// The key under `[axes]`, and the name of its parameter section.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$axis => $name,)+
                }
            }

            /// The default; `None` if the experiment must name one.
            pub fn default_name(self) -> Option<&'static str> {
                match self {
                    $(Self::$axis => None$(.or(Some($default)))?,)+
                }
            }

            /// The meaning, for the table of keys.
            pub(crate) fn meaning(self) -> &'static str {
                match self {
                    $(Self::$axis => concat!($($doc),+).trim_ascii(),)+
                }
            }
        }
    };
}

axes! {
    /// Scenes: built-in names, or paths of .obj, .gltf, .glb, .ply or Nori .xml files, relative to the current directory.
    /// Not needed if all integrators are `integrand:*`, `compaction:*`, `stress:*`, `media:*`, `rays:*`, `specular:*` or `cones:*`.
    Scene = "scene";
    /// Acceleration structures. Not needed if all integrators are `integrand:*`, `compaction:*`, `stress:*`, `media:*`, `rays:*`, `specular:*` or `cones:*`.
    Accel = "accel";
    /// Sample sequences. Not needed if all integrators are `compaction:*`, `stress:*`, `media:*`, `rays:*`, `specular:*` or `cones:*`.
    Sequence = "sequence";
    /// How the pixels' sample points are made different.
    Decorrelation = "decorrelation" or "none";
    /// What is computed from the hits.
    Integrator = "integrator" or "path";
    /// Ray-triangle tests, of all structures and of the reference tracer.
    Triangle = "triangle" or "watertight";
    /// Ray-box tests: reciprocal and pad. Hits are proven for `padded-16` alone; the others are there to be measured.
    BoxTest = "box_test" or "padded-16";
    /// How rays that leave a surface are moved off it by integrators. References are always rendered with `error-bound`.
    Offset = "offset" or "error-bound";
    /// How the path tracer is organised on the device. All make the same image to the bit; errors are measured with
    /// `single-kernel`.
    Organisation = "organisation" or "single-kernel";
    /// External tracers, timed with the same rays in the rounds of the structures, and told apart from them.
    Peer = "peer" or "none";
    /// Workgroups of the kernels that trace: so many rays, and pixels of this shape. All give the same hits and images to
    /// the bit.
    Workgroup = "workgroup" or "auto";
    /// Whether kernels read nodes and triangles from storage buffers or as texels of textures. Both give the same hits and
    /// images to the bit.
    Load = "load" or "auto";
    /// Folders whose kernels (`*.wesl`) replace the embedded ones of the same path, or join them, relative to the current
    /// directory; `""` are the embedded ones.
    Kernels = "kernels" or "";
}

impl Axis {
    /// Finds an axis by name.
    pub fn from_name(name: &str) -> Option<Axis> {
        Self::ALL.into_iter().find(|axis| axis.name() == name)
    }

    /// Describes the allowed values.
    pub(crate) fn expected(self) -> String {
        match self {
            Self::Scene => "a list of built-in scenes and paths of models".to_owned(),
            Self::Kernels => {
                "a list of folders with kernels, `\"\"` for the embedded ones".to_owned()
            }
            axis => format!("a list of {axis} names"),
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A value per axis, indexed as `map[axis]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AxisMap<T>([T; Axis::ALL.len()]);

impl<T> AxisMap<T> {
    /// Creates each axis' value with `make`, in order.
    ///
    /// # Errors
    /// The first error of `make`.
    pub(crate) fn try_new<E>(make: impl FnMut(Axis) -> Result<T, E>) -> Result<Self, E>
    where
        T: Default,
    {
        let mut map = Self(std::array::from_fn(|_| T::default()));
        let values = Axis::ALL.into_iter().map(make);
        for (place, value) in map.0.iter_mut().zip(values) {
            *place = value?;
        }
        Ok(map)
    }

    /// All axes with their values.
    pub fn iter(&self) -> impl Iterator<Item = (Axis, &T)> {
        Axis::ALL.into_iter().zip(&self.0)
    }
}

impl<T> Index<Axis> for AxisMap<T> {
    type Output = T;

    fn index(&self, axis: Axis) -> &T {
        &self.0[axis as usize]
    }
}

impl<T> IndexMut<Axis> for AxisMap<T> {
    fn index_mut(&mut self, axis: Axis) -> &mut T {
        &mut self.0[axis as usize]
    }
}

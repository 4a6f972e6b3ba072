//! Workgroups: how many invocations of a tracing kernel start together, and their pixels.
//!
//! The choice affects times, but not hits and images. Kernels for a buffer of rays process them in
//! order, one per invocation; kernels for an image process rectangles of pixels of this shape.
//! Kernels read `GROUP_WIDTH` and `GROUP_HEIGHT` of `package::active::constants`.

use raystone_core::params::{Kinds, Named};
use raystone_gpu::{Composition, Gpu, WORKGROUP_EDGE};

/// A value of the `workgroup` axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Workgroup {
    /// Name used in configurations.
    pub name: &'static str,
    /// One-line description.
    pub description: &'static str,
    /// Invocations across and down; `None`: the best measured shape for adapters of this type.
    edges: Option<[u32; 2]>,
}

/// The values of the `workgroup` axis.
pub type WorkgroupRegistry = Kinds<Workgroup>;

impl Named for Workgroup {
    fn built_in() -> Vec<&'static Self> {
        Self::ALL.iter().collect()
    }

    fn name(&self) -> &'static str {
        self.name
    }

    fn description(&self) -> &'static str {
        self.description
    }
}

impl Default for Workgroup {
    fn default() -> Self {
        Self::ALL[0]
    }
}

impl Workgroup {
    /// All workgroup shapes, the default first.
    pub const ALL: [Self; 7] = [
        Self {
            name: "auto",
            description: "what measured best on adapters of the type: docs/performance.md",
            edges: None,
        },
        Self::row(32, "32", "32 rays, or 32 pixels of a row"),
        Self::row(64, "64", "64 rays, or 64 pixels of a row"),
        Self::row(128, "128", "128 rays, or 128 pixels of a row"),
        Self::row(256, "256", "256 rays, or 256 pixels of a row"),
        Self::square(8, "8x8", "64 rays, or a square of 8 × 8 pixels"),
        Self::square(16, "16x16", "256 rays, or a square of 16 × 16 pixels"),
    ];

    const fn row(lanes: u32, name: &'static str, description: &'static str) -> Self {
        Self {
            name,
            description,
            edges: Some([lanes, 1]),
        }
    }

    const fn square(edge: u32, name: &'static str, description: &'static str) -> Self {
        Self {
            name,
            description,
            edges: Some([edge, edge]),
        }
    }

    /// Its shape on this adapter.
    pub fn shape(&self, gpu: &Gpu) -> GroupShape {
        GroupShape(self.edges.unwrap_or(Self::measured(gpu.is_software())))
    }

    /// 8 × 8 on all adapters: on software adapters no size measured better than another
    /// (docs/performance.md), on others none was measured.
    const fn measured(_is_software: bool) -> [u32; 2] {
        [WORKGROUP_EDGE; 2]
    }
}

/// Invocations of a workgroup, across and down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GroupShape([u32; 2]);

impl Default for GroupShape {
    /// The shape of kernels without a chosen workgroup.
    fn default() -> Self {
        Self([WORKGROUP_EDGE; 2])
    }
}

impl GroupShape {
    /// Number of invocations.
    pub fn lanes(self) -> u32 {
        self.0[0] * self.0[1]
    }

    /// Workgroups that cover this many columns and rows of pixels.
    pub fn over(self, columns: u32, rows: u32) -> [u32; 3] {
        [columns.div_ceil(self.0[0]), rows.div_ceil(self.0[1]), 1]
    }

    /// `composition` with workgroups of this shape.
    #[must_use]
    pub fn activate(self, composition: Composition) -> Composition {
        composition
            .constant("GROUP_WIDTH", self.0[0])
            .constant("GROUP_HEIGHT", self.0[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_config::Axis;

    #[test]
    fn what_an_experiment_says_nothing_of_is_the_default_workgroup() {
        assert_eq!(
            Axis::Workgroup.default_name(),
            Some(Workgroup::default().name)
        );
    }

    #[test]
    fn names_tell_the_shape() {
        for workgroup in &Workgroup::ALL[1..] {
            let [width, height] = workgroup.edges.unwrap();
            let square = format!("{width}x{height}");
            let named = if height == 1 {
                width.to_string()
            } else {
                square
            };
            assert_eq!(workgroup.name, named);
        }
    }

    #[test]
    fn groups_cover_every_pixel_of_an_image_that_they_do_not_divide() {
        let of = |index: usize| GroupShape(Workgroup::ALL[index].edges.unwrap());
        assert_eq!(of(6).over(37, 29), [3, 2, 1]);
        assert_eq!(of(1).over(37, 29), [2, 29, 1]);
        assert_eq!(of(5).over(64, 8), [8, 1, 1]);
        assert_eq!((of(6).lanes(), of(1).lanes()), (256, 32));
    }

    #[test]
    fn a_kernel_that_no_workgroup_was_chosen_for_has_the_default_shape() {
        let chosen = GroupShape::default().activate(Composition::new("x"));
        assert_eq!(
            chosen.clone().completed(),
            Composition::new("x").completed()
        );
        assert_eq!(GroupShape::default().lanes(), raystone_gpu::WORKGROUP_SIZE);
    }
}

//! The registries of structures and of their shared tests: one line each.

use super::intersection::BoxTest;
use super::triangle::{
    BaldwinWeber, Bare, Compensated, MoellerTrumbore, Pluecker, TriangleTest, Watertight,
};
use super::{AccelKind, BruteForce, KdTree, Octree, RopedBvh, UniformGrid};
use raystone_core::params::{Kinds, Named, ParameterSchema, Sources};

/// The values of the `accel` axis.
pub type AccelRegistry = Kinds<dyn AccelKind>;
/// The values of the `triangle` axis.
pub type TriangleRegistry = Kinds<dyn TriangleTest>;
/// The values of the `box_test` axis.
pub type BoxRegistry = Kinds<BoxTest>;

impl Named for dyn AccelKind {
    fn built_in() -> Vec<&'static Self> {
        vec![
            &BruteForce,
            &super::Bvh,
            &RopedBvh,
            &super::Bvh4,
            &super::Cwbvh,
            &UniformGrid,
            &super::TwoLevelGrid,
            &super::IrregularGrid,
            &Octree,
            &KdTree,
            &super::RayHierarchy,
            &super::DivideAndConquer,
            &super::ObjectList,
            &super::MetaBvh,
            &super::Auto,
        ]
    }

    fn name(&self) -> &'static str {
        AccelKind::name(self)
    }

    fn description(&self) -> &'static str {
        AccelKind::description(self)
    }

    fn parameters(&self) -> ParameterSchema {
        AccelKind::parameters(self)
    }

    fn sources(&self) -> Sources {
        AccelKind::sources(self)
    }
}

impl Named for dyn TriangleTest {
    fn built_in() -> Vec<&'static Self> {
        vec![
            &MoellerTrumbore,
            &BaldwinWeber,
            &Pluecker,
            &Watertight,
            &Compensated,
            &Bare,
        ]
    }

    fn name(&self) -> &'static str {
        TriangleTest::name(self)
    }

    fn description(&self) -> &'static str {
        TriangleTest::description(self)
    }

    fn sources(&self) -> Sources {
        TriangleTest::sources(self)
    }
}

//! The registry of structures: one line each.

use super::{AccelKind, BruteForce, KdTree, Octree, RopedBvh, UniformGrid};
use crate::params::Entry;

/// Everything that can be named on the `accel` axis.
#[derive(Clone)]
pub struct AccelRegistry {
    kinds: Vec<&'static dyn AccelKind>,
}

impl Default for AccelRegistry {
    fn default() -> Self {
        Self {
            kinds: vec![
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
                &super::ObjectList,
                &super::MetaBvh,
            ],
        }
    }
}

impl AccelRegistry {
    /// Adds a structure; it replaces one of the same name.
    pub fn register(&mut self, kind: &'static dyn AccelKind) {
        self.kinds.retain(|k| k.name() != kind.name());
        self.kinds.push(kind);
    }

    /// The structure of this name.
    pub fn get(&self, name: &str) -> Option<&'static dyn AccelKind> {
        self.kinds.iter().copied().find(|k| k.name() == name)
    }

    /// All structures.
    pub fn iter(&self) -> impl Iterator<Item = &'static dyn AccelKind> + '_ {
        self.kinds.iter().copied()
    }

    /// Names, descriptions and parameters for parser, help and docs.
    pub fn entries(&self) -> Vec<Entry> {
        self.iter()
            .map(|k| Entry {
                name: k.name().to_owned(),
                description: k.description().to_owned(),
                schema: k.parameters(),
            })
            .collect()
    }
}

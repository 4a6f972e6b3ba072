//! Objects and instances as structures see them.

use super::super::TriangleSoup;
use super::super::triangle::TriangleRecord;
use crate::scene::{Assembly, Instance, Transform, Triangle};
use std::borrow::Cow;

/// Canonical records of each object in its own space, and where the objects stand.
#[derive(Debug, Clone, Default)]
pub struct Placed {
    /// Record `i` of an object has the id `i`; an instance adds its first id.
    pub objects: Vec<TriangleSoup>,
    /// The instances, in the order of their triangles in the scene.
    pub instances: Vec<Instance>,
}

impl Placed {
    /// The records of an assembly. Materials belong to the triangles of the scene: they are 0 here.
    pub fn new(assembly: &Assembly) -> Self {
        let records = |triangles: &Vec<Triangle>| -> TriangleSoup {
            let triangles = triangles.iter().enumerate();
            let record = |(id, t): (usize, &Triangle)| TriangleRecord::new(t, id as u32, 0);
            triangles.map(record).collect::<Vec<_>>().into()
        };
        Self {
            objects: assembly.objects().iter().map(records).collect(),
            instances: assembly.instances().to_vec(),
        }
    }

    /// The instances of a scene; without any, the whole scene as one object where it is.
    pub fn of(soup: &TriangleSoup) -> Cow<'_, Self> {
        if let Some(placed) = &soup.placed {
            return Cow::Borrowed(placed);
        }
        if soup.records.is_empty() {
            return Cow::Owned(Self::default());
        }
        Cow::Owned(Self {
            objects: vec![soup.records.clone().into()],
            instances: vec![Instance {
                object: 0,
                first: 0,
                to_world: Transform::IDENTITY,
                to_object: Transform::IDENTITY,
            }],
        })
    }
}

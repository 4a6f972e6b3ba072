//! Objects and instances for structures.

use super::super::triangle::TriangleRecord;
use super::super::{Ray, TriangleSoup};
use super::instance::object_ray;
use crate::Masks;
use crate::mask::MASKED;
use raystone_core::geometry::Triangle;
use raystone_scene::{Assembly, Instance, Transform};
use std::borrow::Cow;
use std::sync::Arc;

/// Canonical records of each object in its own space, and the instances.
#[derive(Debug, Clone, Default)]
pub struct Placed {
    /// Record `i` of an object has the id `i`; an instance adds its first id.
    pub objects: Vec<TriangleSoup>,
    /// The instances, in the order of their triangles in the scene.
    pub instances: Vec<Instance>,
}

impl Placed {
    /// The records of an assembly. Materials belong to the scene's triangles; they are 0 here.
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

    /// Adds masks through `words`, one per triangle of the scene; `None` if copies of an object
    /// have different holes and so are not copies.
    #[must_use]
    pub fn masked(mut self, masks: &Arc<Masks>, words: &[u32]) -> Option<Self> {
        for instance in &self.instances {
            let object = &mut self.objects[instance.object as usize];
            let own = &words[instance.first as usize..];
            let is_first = object.masks.is_none();
            for (record, word) in object.records.iter_mut().zip(own) {
                let word = if *word >= MASKED { *word } else { 0 };
                if is_first {
                    record.material = word;
                } else if !masks.cut_alike(record.material, word) {
                    return None;
                }
            }
            object.masks = Some(Arc::clone(masks));
        }
        Some(self)
    }

    /// The ray in the object space of an instance. Distances are unchanged.
    pub fn object_ray(&self, instance: &Instance, ray: &Ray) -> Ray {
        object_ray(instance, ray)
    }

    /// Instance and record of a triangle of the scene.
    pub fn locate(&self, id: u32) -> Option<(&Instance, &TriangleRecord)> {
        let after = self.instances.partition_point(|i| i.first <= id);
        let instance = self.instances.get(after.checked_sub(1)?)?;
        let object = self.objects.get(instance.object as usize)?;
        let record = object.records.get((id - instance.first) as usize)?;
        Some((instance, record))
    }
}

/// Objects and instances of any scene.
pub(super) struct View<'a> {
    pub objects: Vec<&'a TriangleSoup>,
    pub instances: Cow<'a, [Instance]>,
}

impl<'a> View<'a> {
    /// The objects of a scene; without instances, the whole scene as one untransformed object.
    pub(super) fn of(soup: &'a TriangleSoup) -> Self {
        if let Some(placed) = &soup.placed {
            return Self {
                objects: placed.objects.iter().collect(),
                instances: Cow::Borrowed(&placed.instances),
            };
        }
        let whole = Instance {
            object: 0,
            first: 0,
            to_world: Transform::IDENTITY,
            to_object: Transform::IDENTITY,
        };
        let parts = usize::from(!soup.records.is_empty());
        Self {
            objects: vec![soup; parts],
            instances: Cow::Owned(vec![whole; parts]),
        }
    }
}

//! The shape of a glTF mesh in the file itself, without animations: morph targets by their weights, skins as their
//! joints stand (glTF 2.0, 3.7.2.2 and 3.7.3).

use super::gltf::{AT_REST, Geometry, Place, transform};
use super::gltf_document::Item;
use glam::{Mat4, Vec3};

/// How a node shows its mesh.
pub(super) struct Pose {
    /// Weights of morph targets; missing ones are 0.
    weights: Vec<f32>,
    /// Transforms of the skin's joints, from mesh to world space.
    joints: Option<Vec<Mat4>>,
    /// True if other nodes may show the mesh in another shape.
    pub is_own: bool,
}

/// What moves the vertices of a primitive to world space.
pub(super) enum Moved {
    /// All alike.
    As(Mat4),
    /// Each by its joints.
    Each(Vec<Mat4>),
}

impl Moved {
    pub(crate) fn of(&self, vertex: usize) -> Mat4 {
        match self {
            Self::As(world) => *world,
            Self::Each(of) => of[vertex],
        }
    }
}

impl Pose {
    /// The transform that says whether the mesh is mirrored.
    pub(crate) fn sides(&self, world: Mat4) -> Mat4 {
        let joints = self.joints.as_ref();
        joints
            .and_then(|joints| joints.first())
            .copied()
            .unwrap_or(world)
    }
}

impl<'a> Geometry<'a> {
    /// The pose of a node's mesh, which stands at rest if its skin cannot be read.
    pub(super) fn pose(&mut self, node: Item<'a>, mesh: Item<'a>, place: Place<'_>) -> Pose {
        let weights = |of: Item<'_>| -> Vec<f32> {
            let weights = of.list("weights");
            weights.map(|w| w.as_number().unwrap_or(0.0)).collect()
        };
        let of_node = weights(node);
        let has_own = !of_node.is_empty();
        let joints = node.get("skin").is_given().then(|| self.joints(node));
        if let Some(None) = joints {
            self.notes.tell(AT_REST, place);
        }
        let joints = joints.flatten();
        Pose {
            weights: if has_own { of_node } else { weights(mesh) },
            is_own: has_own || joints.is_some(),
            joints,
        }
    }

    /// The transforms of a node's joints; `None` if some cannot be read.
    fn joints(&self, node: Item<'a>) -> Option<Vec<Mat4>> {
        let skin = self.document.at("skins", node.index("skin")?)?;
        let nodes: Vec<Item<'a>> = self.document.list("nodes").collect();
        let mut parents = vec![None; nodes.len()];
        for (index, node) in nodes.iter().enumerate() {
            for child in node.list("children").filter_map(Item::as_index) {
                if let Some(parent) = parents.get_mut(child) {
                    *parent = Some(index);
                }
            }
        }
        let world = |joint: Item<'a>| -> Option<Mat4> {
            let mut at = joint.as_index()?;
            let mut world = transform(*nodes.get(at)?);
            // As many steps as there are nodes: they may be children of themselves.
            for _ in 0..nodes.len() {
                let Some(parent) = parents[at] else { break };
                world = transform(nodes[parent]) * world;
                at = parent;
            }
            Some(world)
        };
        let mut joints = skin.list("joints").map(world).collect::<Option<Vec<_>>>()?;
        if let Some(inverse) = skin.get("inverseBindMatrices").given() {
            let inverse = self.data.accessor(inverse.as_index()?).ok()?;
            let inverse = inverse.vectors::<16>().ok()?;
            if inverse.len() < joints.len() {
                return None;
            }
            for (joint, inverse) in joints.iter_mut().zip(&inverse) {
                *joint *= Mat4::from_cols_array(inverse);
            }
        }
        (!joints.is_empty()).then_some(joints)
    }

    /// What moves a primitive's vertices: the node, or the joints of its skin.
    pub(super) fn moved(
        &mut self,
        attributes: Item<'a>,
        (pose, world): (&Pose, Mat4),
        vertices: usize,
        place: Place<'_>,
    ) -> Moved {
        let Some(joints) = &pose.joints else {
            return Moved::As(world);
        };
        match self.blended(attributes, joints, vertices) {
            Some(each) => Moved::Each(each),
            None => {
                self.notes.tell(AT_REST, place);
                Moved::As(world)
            }
        }
    }

    /// The weighted mean of each vertex's joints.
    fn blended(&self, attributes: Item<'a>, joints: &[Mat4], vertices: usize) -> Option<Vec<Mat4>> {
        let mut sums = vec![(Mat4::ZERO, 0.0); vertices];
        for set in 0.. {
            let accessor = |name: &str| attributes.index(&format!("{name}_{set}"));
            let Some(indices) = accessor("JOINTS") else {
                break;
            };
            let indices = self.data.accessor(indices).ok()?.vectors::<4>().ok()?;
            let weights = self.data.accessor(accessor("WEIGHTS")?).ok()?;
            let weights = weights.unit_vectors::<4>().ok()?;
            if indices.len().min(weights.len()) < vertices {
                return None;
            }
            for ((sum, total), (indices, weights)) in
                sums.iter_mut().zip(indices.iter().zip(&weights))
            {
                for (index, weight) in indices.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
                    *sum += *joints.get(*index as usize)? * *weight;
                    *total += *weight;
                }
            }
        }
        // Rounded weights do not add to one.
        let mean = |(sum, total): (Mat4, f32)| (total > 0.0).then(|| sum * total.recip());
        sums.into_iter().map(mean).collect()
    }

    /// Adds the weighted morph targets to the values of an attribute.
    pub(super) fn morph(
        &mut self,
        primitive: Item<'a>,
        (name, values): (&str, &mut [[f32; 3]]),
        pose: &Pose,
        place: Place<'_>,
    ) {
        let targets = primitive.list("targets").zip(&pose.weights);
        for (target, weight) in targets.filter(|(_, weight)| **weight != 0.0) {
            let Some(accessor) = target.get(name).given() else {
                continue;
            };
            let accessor = accessor.as_index().unwrap_or(usize::MAX);
            let moves = self.data.accessor(accessor);
            match moves.and_then(|moves| moves.vectors::<3>()) {
                Ok(moves) => {
                    for (value, by) in values.iter_mut().zip(moves) {
                        *value = (Vec3::from(*value) + *weight * Vec3::from(by)).into();
                    }
                }
                Err(problem) => {
                    let what = format!("`{name}` of morph targets, whose values {problem}");
                    self.notes.unread(what, place);
                }
            }
        }
    }
}

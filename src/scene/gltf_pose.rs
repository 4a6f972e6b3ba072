//! The shape of a glTF mesh in the file itself, without animations: morph targets by their weights, skins as their
//! joints stand (glTF 2.0, 3.7.2.2 and 3.7.3).

use super::gltf::{AT_REST, Geometry, Place, transform};
use super::gltf_data::Values;
use super::gltf_document::Item;
use glam::Mat4;
use std::rc::Rc;

/// How a node shows its mesh.
pub(super) struct Pose {
    /// Weights of morph targets; missing ones are 0.
    weights: Vec<f32>,
    /// Transforms of the skin's joints, from mesh to world space.
    joints: Option<Rc<[Mat4]>>,
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

/// The transforms of all nodes to world space, each below the last parent that names it.
fn worlds(document: Item<'_>) -> Vec<Mat4> {
    let nodes: Vec<Item<'_>> = document.list("nodes").collect();
    let mut parents = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for child in node.list("children").filter_map(Item::as_index) {
            if let Some(parent) = parents.get_mut(child) {
                *parent = Some(index);
            }
        }
    }
    let mut worlds: Vec<Option<Mat4>> = vec![None; nodes.len()];
    let mut is_open = vec![false; nodes.len()];
    for index in 0..nodes.len() {
        // Up to a node that is known, the first, or one that is below itself; then down again.
        let mut path = vec![index];
        while let Some(parent) = parents[path[path.len() - 1]]
            && worlds[path[path.len() - 1]].is_none()
            && !std::mem::replace(&mut is_open[parent], true)
        {
            path.push(parent);
        }
        let mut above = Mat4::IDENTITY;
        for at in path.into_iter().rev() {
            is_open[at] = false;
            above = *worlds[at].get_or_insert_with(|| above * transform(nodes[at]));
        }
    }
    worlds.into_iter().map(Option::unwrap_or_default).collect()
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
    fn joints(&mut self, node: Item<'a>) -> Option<Rc<[Mat4]>> {
        let skin = node.index("skin")?;
        if let Some(known) = self.skins.get(&skin) {
            return known.clone();
        }
        let read = self
            .document
            .at("skins", skin)
            .and_then(|s| self.read_skin(s));
        self.skins.insert(skin, read.clone());
        read
    }

    fn read_skin(&self, skin: Item<'a>) -> Option<Rc<[Mat4]>> {
        let worlds = self.worlds.get_or_init(|| worlds(self.document));
        let world = |joint: Item<'_>| worlds.get(joint.as_index()?).copied();
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
        (!joints.is_empty()).then(|| joints.into())
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
            Some((each, lost)) => {
                if lost {
                    let what = "vertices that have no weights follow the first of their joints";
                    self.notes.tell(what, place);
                }
                Moved::Each(each)
            }
            None => {
                self.notes.tell(AT_REST, place);
                Moved::As(world)
            }
        }
    }

    /// The weighted mean of each vertex's joints, and whether some vertex has no weights: it follows its first joint.
    fn blended(
        &self,
        attributes: Item<'a>,
        joints: &[Mat4],
        vertices: usize,
    ) -> Option<(Vec<Mat4>, bool)> {
        let mut sums = vec![Mat4::ZERO; vertices];
        let mut first = Vec::new();
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
            for (sum, (indices, weights)) in sums.iter_mut().zip(indices.iter().zip(&weights)) {
                for (index, weight) in indices.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
                    *sum += *joints.get(*index as usize)? * *weight;
                }
            }
            if set == 0 {
                first = indices;
            }
        }
        let mut lost = false;
        for (vertex, sum) in sums.iter_mut().enumerate() {
            // The last element is the sum of weights, which are rounded.
            let total = sum.w_axis.w;
            if total > 0.0 {
                *sum *= total.recip();
            } else {
                *sum = *joints.get(first.get(vertex)?[0] as usize)?;
                lost = true;
            }
        }
        Some((sums, lost))
    }

    /// Adds the weighted morph targets to the values of an attribute; both are read alike.
    pub(super) fn morph<const N: usize>(
        &mut self,
        primitive: Item<'a>,
        (name, values): (&str, &mut [[f32; N]]),
        (pose, read): (&Pose, impl Fn(Values) -> Result<Vec<[f32; N]>, String>),
        place: Place<'_>,
    ) {
        let targets = primitive.list("targets").zip(&pose.weights);
        for (target, weight) in targets.filter(|(_, weight)| **weight != 0.0) {
            let Some(accessor) = target.get(name).given() else {
                continue;
            };
            let accessor = accessor.as_index().unwrap_or(usize::MAX);
            let moves = self.data.accessor(accessor);
            match moves.and_then(&read) {
                Ok(moves) => {
                    if moves.len() < values.len() {
                        let what =
                            format!("`{name}` of vertices beyond the last of a morph target stays");
                        self.notes.tell(what, place);
                    }
                    let parts = moves.as_flattened().iter();
                    for (part, by) in values.as_flattened_mut().iter_mut().zip(parts) {
                        *part += *weight * by;
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

//! Node extensions: visibility (`KHR_node_visibility`) and instancing (`EXT_mesh_gpu_instancing`).

use super::gltf_data::Data;
use super::gltf_document::Item;
use glam::{Mat4, Quat, Vec3, Vec4};

const INSTANCING: &str = "EXT_mesh_gpu_instancing";
const VISIBILITY: &str = "KHR_node_visibility";

/// Extensions read here.
pub(super) const OF_NODES: [&str; 2] = [INSTANCING, VISIBILITY];

const READ: [&str; 3] = ["TRANSLATION", "ROTATION", "SCALE"];

pub(super) fn is_visible(node: Item<'_>) -> bool {
    node.extension(VISIBILITY).flag("visible") != Some(false)
}

/// True if the extension lists instances of the node's mesh.
pub(super) fn has_instances(node: Item<'_>) -> bool {
    node.extension(INSTANCING).is_given()
}

/// The transform from mesh to node space of each instance, and the names of unsupported attributes.
///
/// # Errors
/// The unreadable part of the extension, and the reason.
pub(super) fn places(node: Item<'_>, data: &Data<'_>) -> Result<(Vec<Mat4>, Vec<String>), String> {
    let Some(extension) = node.extension(INSTANCING).given() else {
        return Ok((vec![Mat4::IDENTITY], Vec::new()));
    };
    let attributes = extension.get("attributes").given();
    let attributes = attributes.ok_or_else(|| format!("{INSTANCING} has no attributes"))?;
    let problem = |name: &str, problem: String| format!("{name}: its values {problem}");
    let accessor = |name: &str| {
        let Some(index) = attributes.get(name).given() else {
            return Ok(None);
        };
        let values = index
            .as_index()
            .ok_or_else(|| "name no accessor".to_owned());
        let values = values.and_then(|index| data.accessor(index));
        values.map(Some).map_err(|p| problem(name, p))
    };
    let vectors = |name: &str| {
        let vectors = accessor(name)?.map(|values| values.vectors::<3>());
        vectors.transpose().map_err(|p| problem(name, p))
    };
    let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
    let rotations = accessor("ROTATION")?.map(|values| values.unit_vectors::<4>());
    let rotations = rotations.transpose().map_err(|p| problem("ROTATION", p))?;
    let counts = [
        translations.as_ref().map(Vec::len),
        rotations.as_ref().map(Vec::len),
        scales.as_ref().map(Vec::len),
    ];
    let mut counts = counts.into_iter().flatten();
    // Instances that nothing tells apart are one.
    let count = counts.next().unwrap_or(1);
    if let Some(other) = counts.find(|other| *other != count) {
        return Err(format!(
            "{INSTANCING} has attributes of {count} and of {other} instances"
        ));
    }
    let place = |k: usize| {
        let at = |list: &Option<Vec<[f32; 3]>>, default: Vec3| {
            list.as_ref().map_or(default, |list| list[k].into())
        };
        let rotation = match &rotations {
            Some(rotations) => rotation(rotations[k]),
            None => Quat::IDENTITY,
        };
        let (scale, translation) = (at(&scales, Vec3::ONE), at(&translations, Vec3::ZERO));
        Ok(Mat4::from_scale_rotation_translation(
            scale,
            rotation,
            translation,
        ))
    };
    let places = (0..count).map(place).collect::<Result<_, String>>()?;
    let others = attributes.members().map(|(name, _)| name);
    let others = others.filter(|name| !READ.contains(name));
    let others = others.map(|name| format!("`{name}` of instances"));
    Ok((places, others.collect()))
}

/// Quaternions may be rounded; their length means nothing. One of zeros turns nothing, as in a node.
fn rotation(q: [f32; 4]) -> Quat {
    let unit = Vec4::from(q).try_normalize().map(Quat::from_vec4);
    unit.unwrap_or(Quat::IDENTITY)
}

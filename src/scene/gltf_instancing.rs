//! Node extensions: visibility (`KHR_node_visibility`) and instancing (`EXT_mesh_gpu_instancing`).

use super::gltf_accessor::check_data;
use glam::{Mat4, Quat, Vec3, Vec4};
use gltf::accessor::{Accessor, DataType, Dimensions, Item, Iter};

const INSTANCING: &str = "EXT_mesh_gpu_instancing";
const VISIBILITY: &str = "KHR_node_visibility";

/// Extensions read here that the crate does not know.
pub(super) const OF_NODES: [&str; 2] = [INSTANCING, VISIBILITY];

const READ: [&str; 3] = ["TRANSLATION", "ROTATION", "SCALE"];

pub(super) fn is_visible(node: &gltf::Node<'_>) -> bool {
    let extension = node.extension_value(VISIBILITY);
    let visible = extension.and_then(|value| value.get("visible"));
    visible.and_then(serde_json::Value::as_bool).unwrap_or(true)
}

/// True if the extension lists instances of the node's mesh.
pub(super) fn has_instances(node: &gltf::Node<'_>) -> bool {
    node.extension_value(INSTANCING).is_some()
}

/// The transform from mesh to node space of each instance, and the names of unsupported attributes.
///
/// # Errors
/// The unreadable part of the extension, and the reason.
pub(super) fn places(
    node: &gltf::Node<'_>,
    document: &gltf::Document,
    buffers: &[Vec<u8>],
) -> Result<(Vec<Mat4>, Vec<String>), String> {
    let Some(extension) = node.extension_value(INSTANCING) else {
        return Ok((vec![Mat4::IDENTITY], Vec::new()));
    };
    let attributes = extension
        .get("attributes")
        .and_then(serde_json::Value::as_object);
    let attributes = attributes.ok_or_else(|| format!("{INSTANCING} has no attributes"))?;
    let accessor = |name: &str| -> Result<Option<Accessor<'_>>, String> {
        let Some(index) = attributes.get(name) else {
            return Ok(None);
        };
        let number = index.as_u64().and_then(|index| usize::try_from(index).ok());
        let found = number.and_then(|index| document.accessors().nth(index));
        let found = found.ok_or_else(|| format!("{name}: there is no accessor {index}"))?;
        check_data(&found, buffers).map_err(|problem| format!("{name}: its values {problem}"))?;
        Ok(Some(found))
    };
    let [translation, rotation, scale] = READ.map(accessor);
    let (translation, rotation, scale) = (translation?, rotation?, scale?);
    let all = [&translation, &rotation, &scale].into_iter().flatten();
    let mut counts = all.map(Accessor::count).collect::<Vec<_>>().into_iter();
    let count = counts
        .next()
        .ok_or_else(|| format!("{INSTANCING} has neither TRANSLATION nor ROTATION nor SCALE"))?;
    if let Some(other) = counts.find(|other| *other != count) {
        return Err(format!(
            "{INSTANCING} has attributes of {count} and of {other} instances"
        ));
    }
    let vectors = |name: &str, accessor: Option<Accessor<'_>>, default: Vec3| match accessor {
        Some(a) if (a.dimensions(), a.data_type()) == (Dimensions::Vec3, DataType::F32) => {
            read::<[f32; 3]>(&a, buffers).map(|all| all.into_iter().map(Vec3::from).collect())
        }
        Some(_) => Err(format!("{name}: its values are not three 32-bit floats")),
        None => Ok(vec![default; count]),
    };
    let translations = vectors("TRANSLATION", translation, Vec3::ZERO)?;
    let scales = vectors("SCALE", scale, Vec3::ONE)?;
    let rotations = match rotation {
        Some(accessor) => rotations(&accessor, buffers)?,
        None => vec![Quat::IDENTITY; count],
    };
    let parts = scales.into_iter().zip(rotations).zip(translations);
    let places = parts.map(|((s, r), t)| Mat4::from_scale_rotation_translation(s, r, t));
    let others = attributes
        .keys()
        .filter(|name| !READ.contains(&name.as_str()));
    let others = others.map(|name| format!("`{name}` of instances"));
    Ok((places.collect(), others.collect()))
}

/// Unit quaternions, as floats or as integers normalised to −1 to 1.
fn rotations(accessor: &Accessor<'_>, buffers: &[Vec<u8>]) -> Result<Vec<Quat>, String> {
    let problem = || "ROTATION: its values are not four floats or signed integers".to_owned();
    if accessor.dimensions() != Dimensions::Vec4 {
        return Err(problem());
    }
    let values: Vec<[f32; 4]> = match accessor.data_type() {
        DataType::F32 => read::<[f32; 4]>(accessor, buffers)?,
        DataType::I8 => (read::<[i8; 4]>(accessor, buffers)?.into_iter())
            .map(|q| q.map(|x| (f32::from(x) / 127.0).max(-1.0)))
            .collect(),
        DataType::I16 => (read::<[i16; 4]>(accessor, buffers)?.into_iter())
            .map(|q| q.map(|x| (f32::from(x) / 32_767.0).max(-1.0)))
            .collect(),
        _ => return Err(problem()),
    };
    let unit = |q: [f32; 4]| {
        let unit = Vec4::from(q).try_normalize().map(Quat::from_vec4);
        unit.ok_or_else(|| format!("ROTATION: {q:?} is no rotation"))
    };
    values.into_iter().map(unit).collect()
}

fn read<T: Item>(accessor: &Accessor<'_>, buffers: &[Vec<u8>]) -> Result<Vec<T>, String> {
    let data = |buffer: gltf::Buffer<'_>| buffers.get(buffer.index()).map(Vec::as_slice);
    let values = Iter::new(accessor.clone(), data);
    let values = values.ok_or("the values of instances are outside their buffer")?;
    Ok(values.collect())
}

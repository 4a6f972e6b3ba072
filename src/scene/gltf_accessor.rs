//! Checks of glTF accessors, as the crate's readers panic on invalid ones.

use gltf::Semantic;
use gltf::accessor::{Accessor, DataType, Dimensions};
use gltf::buffer::View;

/// Checks every accessor of a primitive that will be read.
///
/// # Errors
/// The unreadable accessor, and the reason.
pub(super) fn check_accessors(
    primitive: &gltf::Primitive<'_>,
    buffers: &[Vec<u8>],
    set: Option<u32>,
) -> Result<(), String> {
    if let Some(positions) = primitive.get(&Semantic::Positions) {
        check_data(&positions, buffers).map_err(|p| format!("its positions {p}"))?;
        if (positions.dimensions(), positions.data_type()) != (Dimensions::Vec3, DataType::F32) {
            return Err("its positions are not three 32-bit floats".to_owned());
        }
    }
    if let Some(indices) = primitive.indices() {
        check_data(&indices, buffers).map_err(|p| format!("its indices {p}"))?;
        let integers = [DataType::U8, DataType::U16, DataType::U32];
        if indices.dimensions() != Dimensions::Scalar || !integers.contains(&indices.data_type()) {
            return Err("its indices are not unsigned integers".to_owned());
        }
    }
    let Some(set) = set else {
        return Ok(());
    };
    if let Some(uvs) = primitive.get(&Semantic::TexCoords(set)) {
        check_data(&uvs, buffers).map_err(|p| format!("its texture coordinates {p}"))?;
        let numbers = [DataType::U8, DataType::U16, DataType::F32];
        if uvs.dimensions() != Dimensions::Vec2 || !numbers.contains(&uvs.data_type()) {
            return Err("its texture coordinates are not pairs of numbers".to_owned());
        }
    }
    Ok(())
}

/// `true` if the primitive's normals can be read; `None` if it has none.
pub(super) fn has_normals(primitive: &gltf::Primitive<'_>, buffers: &[Vec<u8>]) -> Option<bool> {
    let normals = primitive.get(&Semantic::Normals)?;
    let kind = (normals.dimensions(), normals.data_type());
    let is_known = kind == (Dimensions::Vec3, DataType::F32);
    Some(is_known && check_data(&normals, buffers).is_ok())
}

/// `true` if the primitive's first vertex colours can be read; `None` if it has none.
pub(super) fn has_colors(primitive: &gltf::Primitive<'_>, buffers: &[Vec<u8>]) -> Option<bool> {
    let colors = primitive.get(&Semantic::Colors(0))?;
    let is_known = matches!(colors.dimensions(), Dimensions::Vec3 | Dimensions::Vec4)
        && matches!(
            colors.data_type(),
            DataType::U8 | DataType::U16 | DataType::F32
        );
    Some(is_known && check_data(&colors, buffers).is_ok())
}

/// Checks that all elements of an accessor, including sparse replacements, exist.
pub(super) fn check_data(accessor: &Accessor<'_>, buffers: &[Vec<u8>]) -> Result<(), String> {
    let (count, size) = (accessor.count(), accessor.size());
    let view = accessor.view().ok_or("have no buffer view")?;
    check_range(&view, accessor.offset(), count, size, buffers)?;
    let Some(sparse) = accessor.sparse() else {
        return Ok(());
    };
    let replaced = |problem: String| format!("are replaced by some that {problem}");
    let (indices, values) = (sparse.indices(), sparse.values());
    let index_size = indices.index_type().size();
    for (view, offset, size) in [
        (indices.view(), indices.offset(), index_size),
        (values.view(), values.offset(), size),
    ] {
        check_range(&view, offset, sparse.count(), size, buffers).map_err(replaced)?;
    }
    Ok(())
}

/// Checks that `count` elements of `size` bytes lie in their view, and the view in its buffer.
fn check_range(
    view: &View<'_>,
    offset: usize,
    count: usize,
    size: usize,
    buffers: &[Vec<u8>],
) -> Result<(), String> {
    let gaps = count.checked_sub(1).ok_or("are empty")?;
    let stride = view.stride().unwrap_or(size);
    if stride < size {
        return Err(format!("are {size} bytes wide, but {stride} bytes apart"));
    }
    let end = |start: usize, length: usize| start.checked_add(length);
    let last = gaps.checked_mul(stride).and_then(|bytes| end(bytes, size));
    let fits = last.and_then(|bytes| end(offset, bytes));
    let buffer = buffers.get(view.buffer().index()).map_or(0, Vec::len);
    let there = end(view.offset(), view.length()).is_some_and(|end| end <= buffer);
    if there && fits.is_some_and(|end| end <= view.length()) {
        return Ok(());
    }
    let view = view.index();
    Err(format!(
        "are outside their buffer ({count} elements in buffer view {view})"
    ))
}

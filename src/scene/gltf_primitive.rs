//! Primitives of glTF meshes: their triangles, with what their corners have.

use super::gltf::{Geometry, Place};
use super::gltf_data::Values;
use super::gltf_document::Item;
use super::gltf_pose::{Moved, Pose};
use super::material::Material;
use super::normals::of_normals;
use glam::{DMat3, Mat4, Vec2, Vec3};
use raystone_core::geometry::Triangle;

const TRIANGLES: usize = 4;
const STRIP: usize = 5;
const FAN: usize = 6;

impl<'a> Geometry<'a> {
    /// Adds a primitive's triangles, also in mesh space to `own` if it is given.
    pub(super) fn read_primitive(
        &mut self,
        primitive: Item<'a>,
        place: Place<'_>,
        (pose, world): (&Pose, Mat4),
        mut own: Option<&mut Vec<Triangle>>,
    ) -> Result<(), String> {
        let mode = primitive.index("mode").unwrap_or(TRIANGLES);
        if !(TRIANGLES..=FAN).contains(&mode) {
            let what = "primitives of lines or points left out";
            self.notes.tell(what, place);
            return Ok(());
        }
        let attributes = primitive.get("attributes");
        let Some(positions) = attributes.index("POSITION") else {
            let what = "primitives without positions left out";
            self.notes.tell(what, place);
            return Ok(());
        };
        let used = [Some(positions), primitive.index("indices")];
        if used.into_iter().flatten().any(|of| self.data.is_empty(of)) {
            let what = "primitives without vertices left out";
            self.notes.tell(what, place);
            return Ok(());
        }
        let local = self.data.accessor(positions);
        let local = local.and_then(|values| values.vectors::<3>());
        let mut local = local.map_err(|problem| format!("its positions {problem}"))?;
        if local.as_flattened().iter().any(|x| !x.is_finite()) {
            let what = "vertices are not finite: triangles with such a corner are dropped";
            self.notes.tell(what, place);
        }
        let vectors = |values: Values| values.vectors::<3>();
        self.morph(primitive, ("POSITION", &mut local), (pose, vectors), place);
        let moved = self.moved(attributes, (pose, world), local.len(), place);
        let positions: Vec<Vec3> = (local.iter().enumerate())
            .map(|(k, p)| moved.of(k).transform_point3(Vec3::from(*p)))
            .collect();
        let indices = self.read_indices(primitive, positions.len())?;
        let colors = self.read_colors(primitive, pose, positions.len(), place);
        let material = self.material(primitive, !colors.is_empty(), place);
        let set = self.sets.get(material).copied().flatten();
        self.see_attributes(primitive, set, matches!(moved, Moved::Each(_)), place);
        let uvs = self.read_uvs(primitive, pose, set, place);
        let normals = self.read_normals(primitive, pose, &moved, place);
        let counts = [colors.len(), normals.len(), uvs.len()];
        self.see_short(counts, positions.len(), place);
        let uv = |i: u32| uvs.get(i as usize).copied().unwrap_or_default();
        let normal = |i: u32| normals.get(i as usize).copied().unwrap_or_default();
        let color = |i: u32| colors.get(i as usize).copied().unwrap_or(Vec3::ONE);
        for run in indices.iter() {
            if mode == TRIANGLES && run.len() % 3 != 0 {
                let what = "primitives end within a triangle, which is left out";
                self.notes.tell(what, place);
            }
            for_each_face(mode, run, |corners| {
                let vertices = corners.map(|i| positions[i as usize]);
                let normals = (!normals.is_empty()).then(|| corners.map(normal));
                let colors = (!colors.is_empty()).then(|| corners.map(color));
                let (uvs, material) = (corners.map(uv), material as u32);
                self.builder
                    .push_colored(vertices, uvs, normals, colors, material);
                if let Some(own) = &mut own {
                    let vertices = corners.map(|i| local[i as usize].into());
                    own.push(Triangle { vertices });
                }
            });
        }
        Ok(())
    }

    /// The vertices of the faces in order, in one run or, between restarts, in several.
    fn read_indices(&self, primitive: Item<'a>, vertices: usize) -> Result<Vec<Vec<u32>>, String> {
        let Some(accessor) = primitive.get("indices").given() else {
            return Ok(vec![(0..vertices as u32).collect()]);
        };
        let accessor = accessor.as_index().ok_or("its indices name no accessor")?;
        let indices = self.data.accessor(accessor);
        let indices = indices.and_then(|values| values.indices());
        let (indices, restart) = indices.map_err(|problem| format!("its indices {problem}"))?;
        let exists = |index: u32| (index as usize) < vertices;
        // The standard forbids the restart of strips; exporters use it all the same.
        let is_restart = |index: &u32| !exists(*index) && [restart, u32::MAX].contains(index);
        if let Some(index) = (indices.iter()).find(|i| !exists(**i) && !is_restart(i)) {
            return Err(format!(
                "a face refers to vertex {index}, but there are {vertices}"
            ));
        }
        if !indices.iter().any(is_restart) {
            return Ok(vec![indices]);
        }
        Ok(indices.split(is_restart).map(<[u32]>::to_vec).collect())
    }

    /// The file's materials, then one for primitives that name none.
    fn material(&mut self, primitive: Item<'a>, is_colored: bool, place: Place<'_>) -> usize {
        let last = self.sets.len() - 1;
        if let Some(index) = primitive.index("material") {
            if index < last {
                return index;
            }
            let what = "primitives name a material that is not there: drawn without";
            self.notes.tell(what, place);
        }
        // The standard default is white; grey is for surfaces without any colour.
        if is_colored {
            *self.white.get_or_insert(last + 1)
        } else {
            last
        }
    }

    /// Records colours, normals and texture coordinates that do not reach to the last vertex.
    fn see_short(&mut self, counts: [usize; 3], vertices: usize, place: Place<'_>) {
        let names = ["colour", "normal", "texture coordinate"];
        for (name, count) in names.into_iter().zip(counts) {
            if (1..vertices).contains(&count) {
                let what = format!("vertices beyond the last {name} are drawn without");
                self.notes.tell(what, place);
            }
        }
    }

    /// The material that the file has for a primitive.
    fn own_material(&self, primitive: Item<'a>) -> Option<&'a Material> {
        self.materials.get(primitive.index("material")?)
    }

    /// Records attributes that are not read. Skins and morph targets are handled elsewhere; unused
    /// texture coordinates lose nothing, nor do tangents where no texture bends normals.
    fn see_attributes(
        &mut self,
        primitive: Item<'a>,
        set: Option<u32>,
        is_skinned: bool,
        place: Place<'_>,
    ) {
        let used = set.map(|set| format!("TEXCOORD_{set}"));
        let of_skin = |name: &str| name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_");
        let material = self.own_material(primitive);
        let is_bent = material.is_some_and(|own| own.normal_texture.is_some());
        for (name, _) in primitive.get("attributes").members() {
            let is_read = ["POSITION", "NORMAL", "COLOR_0", "TEXCOORD_0"].contains(&name);
            let is_read = is_read || is_skinned && of_skin(name) || name == "TANGENT" && !is_bent;
            if !is_read && used.as_deref() != Some(name) {
                self.notes.unread(format!("`{name}`"), place);
            }
        }
    }

    /// Values of an attribute, which is drawn without if they cannot be read.
    fn read<T>(
        &mut self,
        attributes: Item<'a>,
        name: &str,
        place: Place<'_>,
        read: impl FnOnce(Values) -> Result<Vec<T>, String>,
    ) -> Vec<T> {
        let Some(accessor) = attributes.get(name).given() else {
            return Vec::new();
        };
        let accessor = accessor.as_index().unwrap_or(usize::MAX);
        match self.data.accessor(accessor).and_then(read) {
            Ok(values) => values,
            Err(problem) => {
                let what = format!("`{name}`, whose values {problem}");
                self.notes.unread(what, place);
                Vec::new()
            }
        }
    }

    fn read_uvs(
        &mut self,
        primitive: Item<'a>,
        pose: &Pose,
        set: Option<u32>,
        place: Place<'_>,
    ) -> Vec<Vec2> {
        let Some(set) = set else {
            return Vec::new();
        };
        let name = format!("TEXCOORD_{set}");
        let attributes = primitive.get("attributes");
        if !attributes.get(&name).is_given() {
            let what =
                "primitives lack the texture coordinates of their material: drawn as one texel";
            self.notes.tell(what, place);
        }
        let as_is = self.data.is_quantised();
        let pairs = |values: Values| {
            if as_is {
                values.vectors::<2>()
            } else {
                values.unit_vectors::<2>()
            }
        };
        let mut uvs = self.read(attributes, &name, place, pairs);
        self.morph(primitive, (&name, &mut uvs), (pose, pairs), place);
        uvs.into_iter().map(Vec2::from).collect()
    }

    /// Linear vertex colours, which multiply the base colour; empty if none can be read.
    fn read_colors(
        &mut self,
        primitive: Item<'a>,
        pose: &Pose,
        vertices: usize,
        place: Place<'_>,
    ) -> Vec<Vec3> {
        let rgba = |values: Values| {
            if values.width() == 3 {
                let colors = values.unit_vectors()?.into_iter();
                return Ok(colors.map(|[r, g, b]| [r, g, b, 1.0]).collect());
            }
            values.unit_vectors::<4>()
        };
        let mut colors = self.read(primitive.get("attributes"), "COLOR_0", place, rgba);
        // Opaque materials have no alpha, whatever the colours say.
        let material = self.own_material(primitive);
        let is_cut = material.is_some_and(|own| own.mask.is_some());
        if is_cut && colors.iter().any(|[.., alpha]| *alpha < 1.0) {
            self.notes.unread("alpha of `COLOR_0`", place);
        }
        if (colors.iter().flatten()).any(|x| !(0.0..=1.0).contains(x)) {
            self.notes.unread("`COLOR_0` beyond 0 to 1", place);
        }
        self.morph(primitive, ("COLOR_0", &mut colors), (pose, rgba), place);
        let rgb = |[r, g, b, _]: &[f32; 4]| Vec3::new(*r, *g, *b);
        colors.iter().take(vertices).map(rgb).collect()
    }

    /// World-space normals; empty if none can be read.
    fn read_normals(
        &mut self,
        primitive: Item<'a>,
        pose: &Pose,
        moved: &Moved,
        place: Place<'_>,
    ) -> Vec<Vec3> {
        let attributes = primitive.get("attributes");
        let read = |values: Values| values.vectors::<3>();
        let mut normals = self.read(attributes, "NORMAL", place, read);
        self.morph(primitive, ("NORMAL", &mut normals), (pose, read), place);
        // In f64, so that a small scale does not make it singular.
        let to_world = |world: Mat4| of_normals(DMat3::from_mat4(world.as_dmat4()));
        let turned = |by: DMat3, n: [f32; 3]| {
            let normal = by * Vec3::from(n).as_dvec3();
            normal.normalize_or_zero().as_vec3()
        };
        match moved {
            Moved::As(world) => {
                let by = to_world(*world);
                normals.into_iter().map(|n| turned(by, n)).collect()
            }
            Moved::Each(worlds) => {
                let pairs = normals.into_iter().zip(worlds);
                pairs
                    .map(|(n, world)| turned(to_world(*world), n))
                    .collect()
            }
        }
    }
}

/// Vertex indices of every triangle of a list, strip or fan.
fn for_each_face(mode: usize, indices: &[u32], mut face: impl FnMut([u32; 3])) {
    match mode {
        TRIANGLES => indices.as_chunks::<3>().0.iter().for_each(|c| face(*c)),
        STRIP => indices
            .windows(3)
            .enumerate()
            .for_each(|(k, w)| face([w[0], w[1 + k % 2], w[2 - k % 2]])),
        _ => indices
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .for_each(|w| face([indices[0], w[0], w[1]])),
    }
}

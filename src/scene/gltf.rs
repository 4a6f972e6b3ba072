//! glTF 2.0 and GLB by the `gltf` crate: nodes are flattened into world space. Where nodes share a
//! mesh, the scene also says which triangles are copies of which object.

use super::builder::{Look, SceneBuilder};
use super::error::{self, guarded};
use super::gltf_accessor::{check_accessors, has_normals};
use super::gltf_container;
use super::gltf_files::Files;
use super::gltf_lights;
use super::gltf_material;
use super::texture::decode_all;
use super::{InstanceError, Light, LoadOptions, SceneData, SceneError, Transform};
use crate::geometry::{Camera, Triangle};
use glam::{DMat3, Mat4, Vec2, Vec3};
use gltf::mesh::Mode;
use std::borrow::Cow;
use std::path::Path;

/// Loads a glTF or GLB model: its default scene, with the first camera of it.
///
/// # Errors
/// [`SceneError`] naming the mesh, node or buffer that breaks the rules.
pub(super) fn load(
    path: &Path,
    name: &str,
    options: &LoadOptions,
) -> Result<SceneData, SceneError> {
    let bytes = error::read(path)?;
    guarded(path, || {
        let (json, blob) = gltf_container::split(&bytes).map_err(|(byte, problem)| {
            SceneError::malformed(path, format!("byte {byte}"), problem)
        })?;
        let document = parse(json).map_err(|problem| SceneError::malformed(path, "", problem))?;
        let blob = blob.map(<[u8]>::to_vec);
        drop(bytes);
        let files = Files::new(path, options);
        let buffers = read_buffers(path, &files, &document, blob)?;
        build(path, name, options, &files, &document, &buffers)
    })
}

/// The validated document. The crate's validation looks up the accessors of attributes before it
/// compares their indices with what there is, so that is done here.
fn parse(json: &[u8]) -> Result<gltf::Document, String> {
    let unchecked = gltf::Gltf::from_slice_without_validation(json).map_err(|e| e.to_string())?;
    let root = unchecked.document.into_json();
    let mut required = root.extensions_required.iter();
    if let Some(problem) = required.find_map(|name| compressed(name)) {
        return Err(problem);
    }
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let mut accessors = primitive.attributes.values().map(|index| index.value());
            if let Some(missing) = accessors.find(|index| *index >= root.accessors.len()) {
                let place = format!("meshes[{m}].primitives[{p}].attributes");
                return Err(format!("{place}: there is no accessor {missing}"));
            }
        }
    }
    gltf::Document::from_json(root).map_err(|e| e.to_string())
}

/// What to do about geometry in a coding that is not read here.
fn compressed(extension: &str) -> Option<String> {
    let command = match extension {
        "EXT_meshopt_compression" | "KHR_meshopt_compression" | "MESHOPT_compression" => {
            "gltfpack -i IN -o OUT"
        }
        "KHR_draco_mesh_compression" => "gltf-transform copy IN OUT",
        _ => return None,
    };
    Some(format!(
        "the geometry is compressed with {extension}; decode it first, for instance with `{command}`"
    ))
}

fn build(
    path: &Path,
    name: &str,
    options: &LoadOptions,
    files: &Files,
    document: &gltf::Document,
    buffers: &[Vec<u8>],
) -> Result<SceneData, SceneError> {
    let mut palette = gltf_material::read(files, document, buffers, options.textures);
    let mut geometry = Geometry {
        path,
        buffers,
        sets: &palette.sets,
        builder: SceneBuilder::new(!palette.images.is_empty(), 0),
        camera: None,
        lights: Vec::new(),
        copies: Copies::new(document),
        lines_or_points: 0,
        deformed: 0,
        unread_normals: 0,
    };
    geometry.read_scene(document)?;
    geometry.report_left_out();
    let Geometry {
        mut builder,
        camera,
        lights,
        ..
    } = geometry;
    builder.report.warnings.append(&mut palette.warnings);
    let textures = decode_all(
        &palette.images,
        options.max_texture_size,
        builder.len(),
        &mut palette.materials,
        &mut builder.report,
    );
    let look = Look {
        materials: palette.materials,
        textures,
        camera,
        lights,
        ..Look::default()
    };
    builder.finish(name, look)
}

/// The bytes of every buffer: the binary chunk, a data URI or a file beside the model.
fn read_buffers(
    path: &Path,
    files: &Files,
    document: &gltf::Document,
    mut blob: Option<Vec<u8>>,
) -> Result<Vec<Vec<u8>>, SceneError> {
    document
        .buffers()
        .map(|buffer| {
            let place = format!("buffer {}", buffer.index());
            let error = |problem: String| SceneError::malformed(path, &place, problem);
            let data = match buffer.source() {
                gltf::buffer::Source::Bin => blob
                    .take()
                    .ok_or_else(|| error("the binary chunk is missing".to_owned()))?,
                gltf::buffer::Source::Uri(uri) => files.read(uri).map_err(error)?,
            };
            if data.len() < buffer.length() {
                return Err(error(format!(
                    "{} bytes are announced, {} are there",
                    buffer.length(),
                    data.len()
                )));
            }
            Ok(data)
        })
        .collect()
}

/// Walks the nodes of a scene and gathers triangles and the first camera.
struct Geometry<'a> {
    path: &'a Path,
    buffers: &'a [Vec<u8>],
    /// Of texture coordinates, for each material.
    sets: &'a [Option<u32>],
    builder: SceneBuilder,
    camera: Option<Camera>,
    lights: Vec<Light>,
    /// `None` where no nodes share a mesh, or once a node could not be made an instance.
    copies: Option<Copies>,
    lines_or_points: usize,
    deformed: usize,
    unread_normals: usize,
}

/// Meshes that several nodes use become objects.
struct Copies {
    /// Nodes that use each mesh.
    uses: Vec<usize>,
    /// The object that a mesh became.
    objects: Vec<Option<u32>>,
}

impl Copies {
    fn new(document: &gltf::Document) -> Option<Self> {
        let mut uses = vec![0; document.meshes().len()];
        for mesh in document.nodes().filter_map(|node| node.mesh()) {
            uses[mesh.index()] += 1;
        }
        let shared = uses.iter().any(|n| *n > 1);
        let objects = vec![None; uses.len()];
        shared.then_some(Self { uses, objects })
    }
}

impl<'a> Geometry<'a> {
    fn read_scene(&mut self, document: &'a gltf::Document) -> Result<(), SceneError> {
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        let roots = scene.ok_or_else(|| SceneError::malformed(self.path, "", "it has no scene"))?;
        // An explicit stack and a mark per node: a cycle in a malformed file ends in an error.
        let mut visited = vec![false; document.nodes().len()];
        let mut stack: Vec<_> = roots.nodes().map(|node| (node, Mat4::IDENTITY)).collect();
        stack.reverse();
        while let Some((node, parent)) = stack.pop() {
            if std::mem::replace(&mut visited[node.index()], true) {
                return Err(self.error(&node, "it is reached twice, but nodes must form a tree"));
            }
            let world = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
            self.read_node(&node, world)?;
            let first_child = stack.len();
            stack.extend(node.children().map(|child| (child, world)));
            stack[first_child..].reverse();
        }
        Ok(())
    }

    fn error(&self, node: &gltf::Node<'_>, problem: impl Into<String>) -> SceneError {
        let label = node.name().unwrap_or("unnamed");
        let place = format!("node {} `{label}`", node.index());
        SceneError::malformed(self.path, place, problem)
    }

    fn read_node(&mut self, node: &gltf::Node<'a>, world: Mat4) -> Result<(), SceneError> {
        if let (None, Some(camera)) = (self.camera, node.camera()) {
            self.camera = self.read_camera(&camera, world);
        }
        if let Some(light) = node.light() {
            self.lights.push(gltf_lights::read(&light, world));
        }
        let Some(mesh) = node.mesh() else {
            return Ok(());
        };
        self.deformed += usize::from(node.skin().is_some());
        let before = self.builder.len();
        let mut own = Vec::new();
        for primitive in mesh.primitives() {
            let read = self.read_primitive(&primitive, world, &mut own);
            read.map_err(|problem| {
                let label = mesh.name().unwrap_or("unnamed");
                let place = format!(
                    "mesh {} `{label}`, primitive {}",
                    mesh.index(),
                    primitive.index()
                );
                SceneError::malformed(self.path, place, problem)
            })?;
        }
        if Transform::from_matrix(world).is_mirrored() {
            self.builder.mirror_from(before);
        }
        if self.builder.len() > before {
            self.place(node, mesh.index(), own, world, before);
        }
        Ok(())
    }

    /// Makes the node an instance of its mesh with the triangles `own`, those of which in world space begin
    /// at `before`. What cannot be one leaves the scene without instances.
    fn place(
        &mut self,
        node: &gltf::Node<'a>,
        mesh: usize,
        own: Vec<Triangle>,
        world: Mat4,
        before: usize,
    ) {
        let Some(copies) = &mut self.copies else {
            return;
        };
        let (object, triangles, to_world) = match copies.uses[mesh] > 1 {
            true => (
                &mut copies.objects[mesh],
                own,
                Transform::from_matrix(world),
            ),
            false => {
                let triangles = self.builder.triangles()[before..].to_vec();
                (&mut None, triangles, Transform::IDENTITY)
            }
        };
        let assembly = &mut self.builder.assembly;
        let known = object.map_or_else(|| assembly.add_object(triangles), Ok);
        let placed = known.and_then(|known| assembly.place(*object.insert(known), to_world));
        let problem = match placed {
            Ok(_) if assembly.triangles() == self.builder.len() as u64 => return,
            Ok(_) => "it has triangles that are not finite".to_owned(),
            Err(error) => reason(&error),
        };
        let label = node.name().unwrap_or("unnamed");
        self.copies = None;
        self.builder.assembly = Default::default();
        self.builder.report.warnings.push(format!(
            "node {} `{label}` cannot be an instance ({problem}): the scene is traced as a \
             flat list of triangles",
            node.index()
        ));
    }

    fn read_camera(&mut self, camera: &gltf::Camera<'_>, world: Mat4) -> Option<Camera> {
        let gltf::camera::Projection::Perspective(lens) = camera.projection() else {
            let warning = "an orthographic camera was ignored".to_owned();
            self.builder.report.warnings.push(warning);
            return None;
        };
        // glTF cameras look along -z with y up.
        let eye = world.transform_point3(Vec3::ZERO);
        let forward = world.transform_vector3(Vec3::NEG_Z).normalize_or_zero();
        let found = Camera {
            eye,
            // Far enough that rounding of the target does not turn the view.
            target: eye + forward * eye.length().max(1.0),
            up: world.transform_vector3(Vec3::Y).normalize_or_zero(),
            vertical_fov_degrees: lens.yfov().to_degrees(),
        };
        if let Err(problem) = found.validate() {
            let warning = format!("a camera of the file was ignored: {problem}");
            self.builder.report.warnings.push(warning);
            return None;
        }
        Some(found)
    }

    /// Adds the triangles of a primitive, and to `own` those in the space of the mesh where nodes share one.
    fn read_primitive(
        &mut self,
        primitive: &gltf::Primitive<'a>,
        world: Mat4,
        own: &mut Vec<Triangle>,
    ) -> Result<(), String> {
        let mode = primitive.mode();
        if !matches!(
            mode,
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            self.lines_or_points += 1;
            return Ok(());
        }
        self.deformed += usize::from(primitive.morph_targets().len() > 0);
        let buffers = self.buffers;
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
        // The file's materials, then one for primitives that name none.
        let last = self.sets.len() - 1;
        let material = primitive.material().index().unwrap_or(last);
        let set = self.sets[material];
        check_accessors(primitive, buffers, set)?;
        let local: Vec<Vec3> = reader
            .read_positions()
            .ok_or("its positions are missing or outside their buffer")?
            .map(Vec3::from)
            .collect();
        let positions: Vec<Vec3> = local.iter().map(|p| world.transform_point3(*p)).collect();
        let indices: Cow<'_, [u32]> = match (primitive.indices(), reader.read_indices()) {
            (None, _) => (0..positions.len() as u32).collect(),
            (Some(_), Some(indices)) => indices.into_u32().collect(),
            (Some(_), None) => return Err("its indices are outside their buffer".to_owned()),
        };
        if let Some(index) = indices.iter().find(|i| **i as usize >= positions.len()) {
            return Err(format!(
                "a face refers to vertex {index}, but there are {}",
                positions.len()
            ));
        }
        let read = |set: u32| {
            let uvs = reader.read_tex_coords(set)?.into_f32();
            Some(uvs.map(Vec2::from).collect())
        };
        let uvs: Vec<Vec2> = set.and_then(read).unwrap_or_default();
        let uv = |i: u32| uvs.get(i as usize).copied().unwrap_or_default();
        let normals = self.read_normals(primitive, world);
        let normal = |i: u32| normals.get(i as usize).copied().unwrap_or_default();
        let is_shared = self.copies.is_some();
        for_each_face(mode, &indices, |corners| {
            let vertices = corners.map(|i| positions[i as usize]);
            let normals = (!normals.is_empty()).then(|| corners.map(normal));
            let (uvs, material) = (corners.map(uv), material as u32);
            self.builder.push_corners(vertices, uvs, normals, material);
            if is_shared {
                let vertices = corners.map(|i| local[i as usize]);
                own.push(Triangle { vertices });
            }
        });
        Ok(())
    }

    /// Normals in world space; none where the file has none that can be read.
    fn read_normals(&mut self, primitive: &gltf::Primitive<'a>, world: Mat4) -> Vec<Vec3> {
        match has_normals(primitive, self.buffers) {
            None => return Vec::new(),
            Some(false) => {
                self.unread_normals += 1;
                return Vec::new();
            }
            Some(true) => {}
        }
        let buffers = self.buffers;
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
        // In f64: a small scale must not make it singular.
        let to_world = DMat3::from_mat4(world.as_dmat4()).inverse().transpose();
        let moved = |n: [f32; 3]| (to_world * Vec3::from(n).as_dvec3()).normalize_or_zero();
        let normals = reader.read_normals().into_iter().flatten();
        normals.map(|n| moved(n).as_vec3()).collect()
    }

    fn report_left_out(&mut self) {
        for (count, what) in [
            (
                self.unread_normals,
                "primitives have normals that are not three 32-bit floats in their buffer: drawn flat",
            ),
            (
                self.lines_or_points,
                "primitives of lines or points left out",
            ),
            (
                self.deformed,
                "meshes have a skin or morph targets: shown in their rest shape",
            ),
        ] {
            if count > 0 {
                self.builder.report.warnings.push(format!("{count} {what}"));
            }
        }
    }
}

/// Vertex indices of every triangle of a list, strip or fan.
fn for_each_face(mode: Mode, indices: &[u32], mut face: impl FnMut([u32; 3])) {
    match mode {
        Mode::Triangles => indices.as_chunks::<3>().0.iter().for_each(|c| face(*c)),
        Mode::TriangleStrip => indices
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

/// Why a node cannot be an instance, without the number that only the built-in scenes know.
fn reason(error: &InstanceError) -> String {
    match error {
        InstanceError::NotFinite { .. } => "its transform is not finite".to_owned(),
        InstanceError::Singular { .. } => "its transform cannot be inverted".to_owned(),
        other => other.to_string(),
    }
}

//! Loads glTF 2.0 and GLB with the `gltf` crate, flattening nodes into world space. If nodes share
//! a mesh, the scene also records which triangles are copies of which object.

use super::builder::{Look, SceneBuilder};
use super::error::{self, guarded};
use super::gltf_accessor::{check_accessors, has_colors, has_normals};
use super::gltf_container;
use super::gltf_files::Files;
use super::gltf_instancing;
use super::gltf_lights;
use super::gltf_material;
use super::gltf_unread::{Unread, of_document};
use super::texture::decode_all;
use super::{InstanceError, Light, LoadOptions, Material, SceneData, SceneError, Transform};
use glam::{DMat3, Mat4, Vec2, Vec3};
use gltf::mesh::Mode;
use raystone_core::geometry::{Camera, Triangle};
use std::borrow::Cow;
use std::path::Path;

/// Triangle limit for a node's instances: all are stored, and a small file can list many.
const MOST_TRIANGLES: usize = 100_000_000;

/// Loads the default scene of a glTF or GLB model, with its first camera.
///
/// # Errors
/// [`SceneError`] naming the invalid mesh, node or buffer.
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

/// Parses and validates the document. The crate's validation looks up attribute accessors before
/// checking their indices, so they are checked here first.
fn parse(json: &[u8]) -> Result<gltf::Document, String> {
    let unchecked = gltf::Gltf::from_slice_without_validation(json).map_err(|e| e.to_string())?;
    let mut root = unchecked.document.into_json();
    let mut required = root.extensions_required.iter();
    if let Some(problem) = required.find_map(|name| compressed(name)) {
        return Err(problem);
    }
    // The crate refuses required extensions that it does not know.
    let of_nodes = gltf_instancing::OF_NODES;
    root.extensions_required
        .retain(|name| !of_nodes.contains(&name.as_str()));
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

/// Advice for unsupported geometry compression.
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
    let mut palette = gltf_material::read(files, document, buffers, options);
    let mut geometry = Geometry {
        path,
        buffers,
        sets: &palette.sets,
        builder: SceneBuilder::new(!palette.images.is_empty(), 0),
        camera: None,
        lights: Vec::new(),
        copies: Copies::new(document),
        white: None,
        lines_or_points: 0,
        deformed: 0,
        unread_normals: 0,
        unread: of_document(document),
    };
    geometry.read_scene(document)?;
    geometry.report_left_out();
    let Geometry {
        mut builder,
        camera,
        lights,
        white,
        unread,
        ..
    } = geometry;
    if white.is_some() {
        let plain = Material::diffuse("default, coloured", Vec3::ONE);
        palette.materials.push(plain);
    }
    let unread = unread.warnings(&palette.named);
    builder.report.warnings.extend(unread);
    builder.report.warnings.append(&mut palette.warnings);
    let textures = decode_all(
        &palette.images,
        options.texture_limits(builder.len()),
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

/// Bytes of every buffer: the binary chunk, a data URI or a separate file.
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

/// Walks a scene's nodes, collecting triangles and the first camera.
struct Geometry<'a> {
    path: &'a Path,
    buffers: &'a [Vec<u8>],
    /// Texture coordinate set of each material.
    sets: &'a [Option<u32>],
    builder: SceneBuilder,
    camera: Option<Camera>,
    lights: Vec<Light>,
    /// `None` if no nodes share a mesh, or once a node could not become an instance.
    copies: Option<Copies>,
    /// Material of primitives that have colours but name no material, once there is one.
    white: Option<usize>,
    lines_or_points: usize,
    deformed: usize,
    unread_normals: usize,
    unread: Unread,
}

struct Copies {
    /// Number of nodes using each mesh.
    uses: Vec<usize>,
    /// Object made from each mesh.
    objects: Vec<Option<u32>>,
}

impl Copies {
    fn new(document: &gltf::Document) -> Option<Self> {
        let mut uses = vec![0; document.meshes().len()];
        for node in document.nodes() {
            if let Some(mesh) = node.mesh() {
                // Even a single listed instance counts as one.
                let listed = gltf_instancing::has_instances(&node);
                uses[mesh.index()] += 1 + usize::from(listed);
            }
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
        // Explicit stack and visited marks: a cycle in a malformed file is an error.
        let mut visited = vec![false; document.nodes().len()];
        let roots = roots.nodes().map(|node| (node, Mat4::IDENTITY, true));
        let mut stack: Vec<_> = roots.collect();
        stack.reverse();
        while let Some((node, parent, shown)) = stack.pop() {
            if std::mem::replace(&mut visited[node.index()], true) {
                return Err(self.error(&node, "it is reached twice, but nodes must form a tree"));
            }
            let world = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
            let shown = shown && gltf_instancing::is_visible(&node);
            self.read_camera_of(&node, world);
            if shown {
                self.read_node(&node, world, document)?;
            }
            let first_child = stack.len();
            stack.extend(node.children().map(|child| (child, world, shown)));
            stack[first_child..].reverse();
        }
        Ok(())
    }

    fn error(&self, node: &gltf::Node<'_>, problem: impl Into<String>) -> SceneError {
        let label = node.name().unwrap_or("unnamed");
        let place = format!("node {} `{label}`", node.index());
        SceneError::malformed(self.path, place, problem)
    }

    /// Reads the node's camera; hidden nodes count too.
    fn read_camera_of(&mut self, node: &gltf::Node<'a>, world: Mat4) {
        if let (None, Some(camera)) = (self.camera, node.camera()) {
            self.camera = self.read_camera(&camera, world);
        }
    }

    fn read_node(
        &mut self,
        node: &gltf::Node<'a>,
        world: Mat4,
        document: &'a gltf::Document,
    ) -> Result<(), SceneError> {
        if let Some(light) = node.light() {
            self.lights.push(gltf_lights::read(&light, world));
        }
        let Some(mesh) = node.mesh() else {
            return Ok(());
        };
        self.deformed += usize::from(node.skin().is_some());
        let places = gltf_instancing::places(node, document, self.buffers);
        let (places, others) = places.map_err(|problem| self.error(node, problem))?;
        self.unread.attributes.extend(others);
        for place in &places {
            let before = self.builder.len();
            self.read_mesh(node, &mesh, world * *place)?;
            let each = self.builder.len() - before;
            if each.saturating_mul(places.len()) > MOST_TRIANGLES {
                let problem = format!(
                    "its {} instances of {each} triangles are more than {MOST_TRIANGLES} triangles",
                    places.len()
                );
                return Err(self.error(node, problem));
            }
        }
        Ok(())
    }

    /// Adds a mesh's triangles under this transform, and the node as an instance of it.
    fn read_mesh(
        &mut self,
        node: &gltf::Node<'a>,
        mesh: &gltf::Mesh<'a>,
        world: Mat4,
    ) -> Result<(), SceneError> {
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

    /// Makes the node an instance of its mesh with triangles `own`, whose world-space copies begin
    /// at `before`. If that fails, the scene has no instances.
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
        let (object, triangles, to_world) = if copies.uses[mesh] > 1 {
            (
                &mut copies.objects[mesh],
                own,
                Transform::from_matrix(world),
            )
        } else {
            let triangles = self.builder.triangles()[before..].to_vec();
            (&mut None, triangles, Transform::IDENTITY)
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
            // Far enough that rounding the target does not turn the view.
            target: eye + forward * eye.length().max(1.0),
            up: world.transform_vector3(Vec3::Y).normalize_or_zero(),
            vertical_fov_degrees: lens.yfov().to_degrees(),
        };
        if let Err(problem) = crate::check_camera(&found) {
            let warning = format!("a camera of the file was ignored: {problem}");
            self.builder.report.warnings.push(warning);
            return None;
        }
        Some(found)
    }

    /// Adds a primitive's triangles, also in mesh space to `own` if nodes share the mesh.
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
        let colors = self.read_colors(primitive);
        let material = match primitive.material().index() {
            Some(index) => index,
            // The standard default is white; grey is for surfaces without any colour.
            None if !colors.is_empty() => *self.white.get_or_insert(last + 1),
            None => last,
        };
        let set = self.sets.get(material).copied().flatten();
        self.unread.see(primitive, set);
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
            let color = |i: u32| colors.get(i as usize).copied().unwrap_or(Vec3::ONE);
            let colors = (!colors.is_empty()).then(|| corners.map(color));
            self.builder
                .push_colored(vertices, uvs, normals, colors, material);
            if is_shared {
                let vertices = corners.map(|i| local[i as usize]);
                own.push(Triangle { vertices });
            }
        });
        Ok(())
    }

    /// Linear vertex colours, which multiply the base colour; empty if none can be read.
    fn read_colors(&mut self, primitive: &gltf::Primitive<'a>) -> Vec<Vec3> {
        match has_colors(primitive, self.buffers) {
            None => return Vec::new(),
            Some(false) => {
                let name = "`COLOR_0`, whose values are no colours in their buffer";
                self.unread.attributes.insert(name.to_owned());
                return Vec::new();
            }
            Some(true) => {}
        }
        let buffers = self.buffers;
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
        let colors = reader.read_colors(0).map(|colors| colors.into_rgba_f32());
        let colors: Vec<[f32; 4]> = colors.into_iter().flatten().collect();
        if colors.iter().any(|[.., alpha]| *alpha < 1.0) {
            let name = "alpha of `COLOR_0`".to_owned();
            self.unread.attributes.insert(name);
        }
        if (colors.iter().flatten()).any(|x| !(0.0..=1.0).contains(x)) {
            let name = "`COLOR_0` beyond 0 to 1".to_owned();
            self.unread.attributes.insert(name);
        }
        let rgb = |[r, g, b, _]: &[f32; 4]| Vec3::new(*r, *g, *b);
        colors.iter().map(rgb).collect()
    }

    /// World-space normals; empty if none can be read.
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
        // In f64, so that a small scale does not make it singular.
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

/// Why a node cannot be an instance, without the index that only built-in scenes use.
fn reason(error: &InstanceError) -> String {
    match error {
        InstanceError::NotFinite { .. } => "its transform is not finite".to_owned(),
        InstanceError::Singular { .. } => "its transform cannot be inverted".to_owned(),
        other => other.to_string(),
    }
}

//! Loads glTF 2.0 and GLB, flattening nodes into world space. If nodes share a mesh, the scene also
//! records which triangles are copies of which object.

use super::builder::{Look, SceneBuilder};
use super::error::{self, guarded};
use super::gltf_data::Data;
use super::gltf_document::{self, Item};
use super::gltf_files::Files;
use super::gltf_notes::Notes;
use super::gltf_pose::Pose;
use super::gltf_roots::roots;
use super::texture::{decode_all, forget_unused};
use super::{InstanceError, Light, LoadOptions, Material, SceneData, SceneError, Transform};
use super::{gltf_container, gltf_instancing, gltf_lights, gltf_material};
use glam::{Mat4, Quat, Vec3, Vec4};
use raystone_core::geometry::{Camera, Triangle};
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

/// Triangle limit for a node's instances: all are stored, and a small file can list many.
const MOST_TRIANGLES: usize = 100_000_000;

/// Limit on the nodes walked, as nodes below several others are walked for each of them.
const MOST_NODES: usize = 1_000_000;

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
        let (json, chunk) = gltf_container::split(&bytes).map_err(|(byte, problem)| {
            SceneError::malformed(path, format!("byte {byte}"), problem)
        })?;
        let parsed = gltf_document::parse(json);
        let (document, fault) = parsed.map_err(|p| SceneError::malformed(path, "", p))?;
        let document = Item::new(&document);
        check_version(path, document)?;
        let chunk = chunk.map(<[u8]>::to_vec);
        let file_bytes = bytes.len();
        drop(bytes);
        let files = Files::new(path, options);
        let data = Data::new(&files, document, file_bytes, chunk);
        let mut notes = Notes::default();
        if let Some(version) = later(document) {
            let what = format!("the file is for readers of glTF {version}, and read as 2.0");
            notes.tell(what, String::new);
        }
        if let Some(fault) = fault {
            notes.tell("the text is not JSON, and was read as if it were", || fault);
        }
        build(path, name, options, &files, document, &data, notes)
    })
}

/// glTF 1.0 is another format with the same ending. Its version may be a number, and its parts have names in place of
/// indices.
fn check_version(path: &Path, document: Item<'_>) -> Result<(), SceneError> {
    let named_parts = |key| document.get(key).members().next().is_some();
    let by_names = ["accessors", "meshes", "nodes"]
        .into_iter()
        .any(named_parts);
    let assumed = if by_names { "1.0" } else { "2.0" };
    let given = document.get("asset").get("version");
    let version = given.as_written().unwrap_or_else(|| assumed.to_owned());
    match version.split('.').next() {
        Some("0" | "1") => Err(SceneError::Unsupported {
            path: path.to_owned(),
            place: "asset".to_owned(),
            problem: format!("glTF of version {version}"),
            advice: "export it as glTF 2.0",
        }),
        _ => Ok(()),
    }
}

/// The version that the file asks for, if it is a later 2.x.
fn later(document: Item<'_>) -> Option<String> {
    let least = document.get("asset").get("minVersion").as_written()?;
    let (major, minor) = least.split_once('.')?;
    (major == "2" && minor != "0").then_some(least)
}

fn build(
    path: &Path,
    name: &str,
    options: &LoadOptions,
    files: &Files,
    document: Item<'_>,
    data: &Data<'_>,
    mut notes: Notes,
) -> Result<SceneData, SceneError> {
    let mut palette = gltf_material::read(files, document, data, options);
    notes.see_document(document, &palette.named);
    let mut geometry = Geometry {
        path,
        document,
        data,
        sets: &palette.sets,
        materials: &palette.materials,
        builder: SceneBuilder::new(!palette.images.is_empty(), 0),
        camera: None,
        lights: Vec::new(),
        copies: Copies::new(document),
        white: None,
        notes,
        worlds: OnceCell::new(),
        skins: BTreeMap::new(),
    };
    geometry.read_scene()?;
    let Geometry {
        mut builder,
        camera,
        lights,
        white,
        notes,
        ..
    } = geometry;
    if white.is_some() {
        let plain = Material::diffuse("default, coloured", Vec3::ONE);
        palette.materials.push(plain);
    }
    builder.report.warnings.extend(notes.warnings());
    builder.report.warnings.append(&mut files.others.take());
    builder.report.warnings.append(&mut palette.warnings);
    builder.note_far();
    forget_unused(&mut palette.materials, builder.material_ids());
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

/// Walks a scene's nodes, collecting triangles and the first camera.
pub(super) struct Geometry<'a> {
    path: &'a Path,
    pub document: Item<'a>,
    pub data: &'a Data<'a>,
    /// Texture coordinate set of each material.
    pub sets: &'a [Option<u32>],
    /// Materials of the file, in its order.
    pub materials: &'a [Material],
    pub builder: SceneBuilder,
    camera: Option<Camera>,
    lights: Vec<Light>,
    /// `None` if no nodes share a mesh, or once a node could not become an instance.
    copies: Option<Copies>,
    /// Material of primitives that have colours but name no material, once there is one.
    pub white: Option<usize>,
    pub notes: Notes,
    /// Transforms of all nodes, once a skin asks for them.
    pub worlds: OnceCell<Vec<Mat4>>,
    /// Transforms of the joints of skins that were asked for, if they can be read.
    pub skins: BTreeMap<usize, Option<Rc<[Mat4]>>>,
}

struct Copies {
    /// Number of nodes using each mesh.
    uses: Vec<usize>,
    /// Object made from each mesh.
    objects: Vec<Option<u32>>,
}

impl Copies {
    fn new(document: Item<'_>) -> Option<Self> {
        let mut uses = vec![0; document.list("meshes").len()];
        for node in document.list("nodes") {
            if let Some(uses) = node.index("mesh").and_then(|mesh| uses.get_mut(mesh)) {
                // Even a single listed instance counts as one.
                *uses += 1 + usize::from(gltf_instancing::has_instances(node));
            }
        }
        let shared = uses.iter().any(|n| *n > 1);
        let objects = vec![None; uses.len()];
        shared.then_some(Self { uses, objects })
    }
}

/// Says where something is, for a message.
pub(super) type Place<'a> = &'a dyn Fn() -> String;

/// A step of the walk: into a node under a transform and a rotation, shown or not, or out of it.
enum Step {
    Into(usize, (Mat4, Quat), bool),
    Out(usize),
}

impl<'a> Geometry<'a> {
    fn read_scene(&mut self) -> Result<(), SceneError> {
        let nodes: Vec<Item<'a>> = self.document.list("nodes").collect();
        let roots = roots(self.document, &nodes, &mut self.notes);
        if let Some(mesh) = self.document.at("meshes", 0)
            && !nodes.iter().any(|node| node.get("mesh").is_given())
        {
            let what = "there are meshes, but no node shows one";
            self.notes.tell(what, || mesh.place("mesh", 0));
        }
        let into = |node: &usize| Step::Into(*node, (Mat4::IDENTITY, Quat::IDENTITY), true);
        let mut stack: Vec<Step> = roots.iter().rev().map(into).collect();
        // An explicit stack, so that no depth overflows.
        let mut seen = vec![false; nodes.len()];
        let mut is_open = vec![false; nodes.len()];
        let mut walked = 0;
        while let Some(step) = stack.pop() {
            let (index, (parent, turned), shown) = match step {
                Step::Into(index, parent, shown) => (index, parent, shown),
                Step::Out(index) => {
                    is_open[index] = false;
                    continue;
                }
            };
            let Some(&node) = nodes.get(index) else {
                let what = "nodes that are named but not there are left out";
                self.notes.tell(what, || format!("node {index}"));
                continue;
            };
            let place = || node.place("node", index);
            if is_open[index] {
                let what = "nodes are children of themselves, which is left out";
                self.notes.tell(what, place);
                continue;
            }
            if std::mem::replace(&mut seen[index], true) {
                let what = "nodes are children of several nodes, and drawn below each";
                self.notes.tell(what, place);
            }
            walked += 1;
            if walked > MOST_NODES {
                let problem =
                    format!("with the nodes below several others, more than {MOST_NODES}");
                return Err(self.error(&place(), problem));
            }
            let own = transform(node);
            self.notes.see_transform(node, own, place);
            let world = parent * own;
            let shown = shown && gltf_instancing::is_visible(node);
            let turned = turned * rotation(node);
            self.read_camera_of(node, (world, turned));
            if shown {
                self.read_node(node, &place, world)?;
            }
            is_open[index] = true;
            stack.push(Step::Out(index));
            let first_child = stack.len();
            let children = node.list("children").filter_map(Item::as_index);
            stack.extend(children.map(|child| Step::Into(child, (world, turned), shown)));
            stack[first_child..].reverse();
        }
        Ok(())
    }

    fn error(&self, place: &str, problem: impl Into<String>) -> SceneError {
        SceneError::malformed(self.path, place, problem)
    }

    /// Reads the node's camera; hidden nodes count too.
    fn read_camera_of(&mut self, node: Item<'a>, place: (Mat4, Quat)) {
        let Some(index) = node.index("camera") else {
            return;
        };
        let camera = self.document.at("cameras", index);
        if self.camera.is_none() {
            self.camera = self.read_camera(camera, index, place);
        } else {
            let what = "cameras behind the first are ignored";
            let place = || camera.map_or(format!("camera {index}"), |c| c.place("camera", index));
            self.notes.tell(what, place);
        }
    }

    fn read_light(&mut self, index: usize, world: Mat4, place: Place<'_>) {
        let Some(light) = gltf_lights::read(self.document, index, world) else {
            let what = "lights that are missing or of an unknown type are left out";
            self.notes.tell(what, place);
            return;
        };
        // Named here, by the node: the scene numbers the lights that it has.
        let is_dark = light.power(1.0) == 0.0;
        let problem = light.problem();
        match problem.or_else(|| is_dark.then(|| "its power is 0".to_owned())) {
            Some(problem) => {
                let what = format!("a light is left out: {problem}");
                self.notes.tell(what, place);
            }
            None => {
                self.lights.push(light);
                if gltf_lights::has_range(self.document, index) {
                    self.notes.unread("`range` of lights", place);
                }
            }
        }
    }

    fn read_node(
        &mut self,
        node: Item<'a>,
        place: Place<'_>,
        world: Mat4,
    ) -> Result<(), SceneError> {
        if let Some(index) = gltf_lights::of_node(node) {
            self.read_light(index, world, place);
        }
        let Some(named) = node.get("mesh").given() else {
            return Ok(());
        };
        let index = named.as_index().unwrap_or(usize::MAX);
        let Some(mesh) = self.document.at("meshes", index) else {
            let what = "nodes show a mesh that is not there";
            self.notes.tell(what, place);
            return Ok(());
        };
        let pose = self.pose(node, mesh, &|| mesh.place("mesh", index));
        let places = gltf_instancing::places(node, self.data);
        let (places, others) = places.map_err(|problem| self.error(&place(), problem))?;
        for name in others {
            self.notes.unread(name, place);
        }
        for instance in &places {
            let before = self.builder.len();
            self.read_mesh(place, (mesh, index), &pose, world * *instance)?;
            let each = self.builder.len() - before;
            if each.saturating_mul(places.len()) > MOST_TRIANGLES {
                let problem = format!(
                    "its {} instances of {each} triangles are more than {MOST_TRIANGLES} triangles",
                    places.len()
                );
                return Err(self.error(&place(), problem));
            }
        }
        Ok(())
    }

    /// Adds a mesh's triangles under this transform, and the node as an instance of it.
    fn read_mesh(
        &mut self,
        node: Place<'_>,
        (mesh, index): (Item<'a>, usize),
        pose: &Pose,
        world: Mat4,
    ) -> Result<(), SceneError> {
        let before = self.builder.len();
        let mut own = Vec::new();
        let mut list = self.copies.is_some().then_some(&mut own);
        for (k, primitive) in mesh.list("primitives").enumerate() {
            let place = || format!("{}, primitive {k}", mesh.place("mesh", index));
            if self.is_draco_only(primitive) {
                return Err(SceneError::Unsupported {
                    path: self.path.to_owned(),
                    place: place(),
                    problem: format!("the geometry is compressed with {DRACO}"),
                    advice: "decode it first: `npx @gltf-transform/cli copy IN OUT`",
                });
            }
            self.read_primitive(primitive, &place, (pose, world), list.as_deref_mut())
                .map_err(|problem| self.error(&place(), problem))?;
        }
        if Transform::from_matrix(pose.sides(world)).is_mirrored() {
            self.builder.mirror_from(before);
        }
        if self.builder.len() > before {
            let shared = (!pose.is_own).then_some(own);
            self.place(node, index, shared, world, before);
        }
        Ok(())
    }

    /// True if the primitive has no data besides the compressed one.
    fn is_draco_only(&self, primitive: Item<'_>) -> bool {
        let positions = primitive.get("attributes").index("POSITION");
        let accessor = positions.and_then(|index| self.document.at("accessors", index));
        let is_plain = accessor.is_none_or(|accessor| accessor.get("bufferView").is_given());
        primitive.extension(DRACO).is_given() && !is_plain
    }

    /// Makes the node an instance of its mesh with triangles `own`, whose world-space copies begin
    /// at `before`, or an object of its own if there are none. If that fails, the scene has no instances.
    fn place(
        &mut self,
        node: Place<'_>,
        mesh: usize,
        own: Option<Vec<Triangle>>,
        world: Mat4,
        before: usize,
    ) {
        let Some(copies) = &mut self.copies else {
            return;
        };
        let own = own.filter(|_| copies.uses[mesh] > 1);
        let (object, triangles, to_world) = if let Some(own) = own {
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
        self.copies = None;
        self.builder.assembly = Default::default();
        self.builder.report.warnings.push(format!(
            "{} cannot be an instance ({problem}): the scene is traced as a flat list of \
             triangles",
            node()
        ));
    }

    fn read_camera(
        &mut self,
        camera: Option<Item<'_>>,
        index: usize,
        (world, turned): (Mat4, Quat),
    ) -> Option<Camera> {
        let place = || camera.map_or(format!("camera {index}"), |c| c.place("camera", index));
        let lens = camera.map(|camera| camera.get("perspective"));
        let Some(fov) = lens.and_then(|lens| lens.number("yfov")) else {
            let what = "cameras without a perspective are ignored";
            self.notes.tell(what, place);
            return None;
        };
        // glTF cameras look along -z with y up, and no scale turns them around (glTF 2.0, 3.10.2).
        let eye = world.transform_point3(Vec3::ZERO);
        let forward = turned * Vec3::NEG_Z;
        let found = Camera {
            eye,
            // Far enough that rounding the target does not turn the view.
            target: eye + forward * eye.length().max(1.0),
            up: turned * Vec3::Y,
            vertical_fov_degrees: fov.to_degrees(),
        };
        if let Err(problem) = crate::check_camera(&found) {
            let what = format!("a camera of the file was ignored: {problem}");
            self.notes.tell(what, place);
            return None;
        }
        Some(found)
    }
}

/// The note on meshes with a skin or morph targets.
pub(super) const AT_REST: &str =
    "meshes with a skin or morph targets are shown in their rest shape";

const DRACO: &str = "KHR_draco_mesh_compression";

/// A node's own transform. What is no number is NaN, and drops the triangles below.
pub(super) fn transform(node: Item<'_>) -> Mat4 {
    let given = |value: Option<f32>| value.unwrap_or(f32::NAN);
    if let Some(matrix) = node.numbers::<16>("matrix") {
        return Mat4::from_cols_array(&matrix.map(given));
    }
    let scale = node
        .numbers("scale")
        .map_or(Vec3::ONE, |s| s.map(given).into());
    let translation = node.numbers("translation");
    let translation = translation.map_or(Vec3::ZERO, |t| t.map(given).into());
    Mat4::from_scale_rotation_translation(scale, rotation(node), translation)
}

/// A node's own rotation; that of a matrix is what is left of it without its scale, if anything is.
fn rotation(node: Item<'_>) -> Quat {
    if node.numbers::<16>("matrix").is_some() {
        let (_, turned, _) = transform(node).to_scale_rotation_translation();
        return if turned.is_finite() && turned.length_squared() > 0.0 {
            turned.normalize()
        } else {
            Quat::IDENTITY
        };
    }
    let given = node.numbers("rotation");
    let rotation = given.map_or(Vec4::W, |q| q.map(|x| x.unwrap_or(f32::NAN)).into());
    // Rounded more than a quaternion of f32 is, or not a rotation at all.
    let is_unit = (rotation.length_squared() - 1.0).abs() < 1e-5;
    Quat::from_vec4(match rotation.try_normalize() {
        Some(unit) if !is_unit => unit,
        None if rotation == Vec4::ZERO => Vec4::W,
        _ => rotation,
    })
}

/// Why a node cannot be an instance, without the index that only built-in scenes use.
fn reason(error: &InstanceError) -> String {
    match error {
        InstanceError::NotFinite { .. } => "its transform is not finite".to_owned(),
        InstanceError::Singular { .. } => "its transform cannot be inverted".to_owned(),
        other => other.to_string(),
    }
}

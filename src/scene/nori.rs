//! Scenes of the educational renderer [Nori](https://wjakob.github.io/nori/) (XML with OBJ meshes,
//! here also PLY): transforms, the perspective camera, area emitters and its materials.
//!
//! Nori's camera may be mirrored (a scale of −1 in its transform); ours cannot. The scene is
//! mirrored instead, at the vertical plane through the eye, for the same picture.

use super::builder::{Look, SceneBuilder};
use super::error::{self, guarded};
use super::material::{emitted, reflectance};
use super::mtl::found;
use super::normals::of_normals;
use super::{
    CookTorrance, Fresnel, LoadOptions, MIRROR, Masking, Material, SceneData, SceneError,
    decode_normal, obj, ply,
};
use glam::{DMat3, DMat4, DVec3, DVec4, Vec2, Vec3};
use raystone_core::geometry::Camera;
use raystone_core::text::plain_text_or_latin1;
use roxmltree::{Document, Node, ParsingOptions};
use std::path::Path;

/// Nori's defaults: albedo of `diffuse`, roughness of `microfacet`, indices of BK7 glass and air.
const ALBEDO: f32 = 0.5;
const ALPHA: f32 = 0.1;
const INSIDE_IOR: f32 = 1.5046;
const OUTSIDE_IOR: f32 = 1.000277;
/// Horizontal field of view in degrees, and image size.
const FOV: f64 = 30.0;
const SIZE: [f64; 2] = [1280.0, 720.0];

/// Loads a Nori scene, ignoring the file's integrator and sampler.
///
/// # Errors
/// [`SceneError`]: malformed XML (with its line), a root other than `<scene>`, an invalid number,
/// or a mesh that does not load.
pub(super) fn load(
    path: &Path,
    name: &str,
    options: &LoadOptions,
) -> Result<SceneData, SceneError> {
    let bytes = error::read(path)?;
    guarded(path, || {
        let text = plain_text_or_latin1(bytes);
        let with_types = ParsingOptions {
            allow_dtd: true,
            ..ParsingOptions::default()
        };
        let document = Document::parse_with_options(&text, with_types).map_err(|e| {
            SceneError::malformed(path, format!("line {}", e.pos().row), e.to_string())
        })?;
        let root = document.root_element();
        if !root.has_tag_name("scene") {
            let problem = "the root is no `<scene>`; of XML scenes only those of Nori are read";
            return Err(SceneError::malformed(path, "", problem));
        }
        let has = |tag: &str| root.children().any(|node| node.has_tag_name(tag));
        if has("shape") && !has("mesh") {
            return Err(SceneError::Unsupported {
                path: path.to_owned(),
                place: String::new(),
                problem: "it is a scene of Mitsuba".to_owned(),
                advice: "of XML scenes only those of Nori are; give its meshes as .obj, .gltf or .ply",
            });
        }
        let mut reader = Reader {
            path,
            options,
            builder: SceneBuilder::default(),
            look: Look::default(),
        };
        reader.read(root)?;
        reader.builder.note_far();
        reader.builder.finish(name, reader.look)
    })
}

struct Reader<'a> {
    path: &'a Path,
    options: &'a LoadOptions,
    builder: SceneBuilder,
    look: Look,
}

impl Reader<'_> {
    fn read(&mut self, root: Node<'_, '_>) -> Result<(), SceneError> {
        let camera = root.children().find(|node| node.has_tag_name("camera"));
        // First, as a mirrored camera moves the meshes.
        let mirror = camera.map(|node| self.camera(node)).transpose()?.flatten();
        for node in root.children().filter(Node::is_element) {
            match node.tag_name().name() {
                "mesh" => self.mesh(node, mirror)?,
                "camera" if camera != Some(node) => {
                    self.warn(
                        node,
                        "a scene has one camera, and this is another: left out",
                    );
                }
                "camera" | "integrator" | "sampler" => {}
                "emitter" => {
                    let kind = node.attribute("type").unwrap_or_default();
                    self.warn(
                        node,
                        &format!("the emitter `{kind}` is not known, left out"),
                    );
                }
                other => self.warn(node, &format!("`<{other}>` is not known, left out")),
            }
        }
        Ok(())
    }

    /// Names the children of a node that are neither of these elements nor values of these names, and values given again.
    fn warn_of_others(&mut self, node: Node<'_, '_>, elements: &[&str], values: &[&str]) {
        for name in values {
            let mut given = properties(node, name);
            given.next_back();
            for earlier in given {
                self.warn(
                    earlier,
                    &format!("a later `{name}` counts in place of this one"),
                );
            }
        }
        for child in node.children().filter(Node::is_element) {
            let (element, name) = (child.tag_name().name(), child.attribute("name"));
            let is_value =
                child.has_attribute("value") && name.is_some_and(|n| values.contains(&n));
            if !is_value && !elements.contains(&element) {
                let named = name.map_or(String::new(), |name| format!(" `{name}`"));
                let owner = node.tag_name().name();
                self.warn(
                    child,
                    &format!("`<{element}>`{named} of `<{owner}>` is not read"),
                );
            }
        }
    }

    /// Sets the camera; returns the reflection to apply to the scene if it is mirrored.
    fn camera(&mut self, node: Node<'_, '_>) -> Result<Option<DMat4>, SceneError> {
        if let Some(kind) = node.attribute("type").filter(|kind| *kind != "perspective") {
            self.warn(
                node,
                &format!("the camera `{kind}` is not known; drawn as perspective"),
            );
        }
        // What makes an image of light, and how deep it is, is asked of the run.
        let others = ["transform", "rfilter", "sampler"];
        let values = ["width", "height", "fov", "nearClip", "farClip"];
        self.warn_of_others(node, &others, &values);
        let to_world = self.placement(node)?;
        let [width, height] = ["width", "height"].map(|name| self.number(node, name));
        let (width, height) = (width?.unwrap_or(SIZE[0]), height?.unwrap_or(SIZE[1]));
        let fov = self.number(node, "fov")?.unwrap_or(FOV);
        let half_width = (0.5 * fov.to_radians()).tan();
        let vertical = 2.0 * (half_width * height / width).atan();
        let has_view = fov > 0.0 && fov < 180.0 && width >= 1.0 && height >= 1.0;
        if !has_view || vertical as f32 <= 0.0 {
            let problem = format!(
                "a camera of {width} × {height} pixels with a field of view of {fov}° sees nothing: it takes 0° to 180°"
            );
            return Err(self.broken(node, &problem));
        }
        let [left, up, forward, eye] = to_world.to_cols_array_2d().map(DVec4::from_array);
        let [left, up, forward, eye] = [left, up, forward, eye].map(|v| v.truncate());
        if [left, up, forward]
            .iter()
            .any(|axis| axis.try_normalize().is_none())
        {
            let problem = "the camera's `toWorld` has no directions: the target is at the origin, or `up` is along the view";
            return Err(self.broken(node, problem));
        }
        self.look.camera = Some(Camera {
            eye: eye.as_vec3(),
            // Far enough that rounding the target does not turn the view.
            target: (eye + forward.normalize_or_zero() * eye.length().max(1.0)).as_vec3(),
            up: up.normalize_or_zero().as_vec3(),
            vertical_fov_degrees: vertical.to_degrees() as f32,
        });
        let mirrored = left.cross(up).dot(forward) < 0.0;
        let normal = left.normalize_or_zero();
        let column = |axis: DVec3| (axis - 2.0 * normal * normal.dot(axis)).extend(0.0);
        let shift = 2.0 * normal * normal.dot(eye);
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(column);
        Ok(mirrored.then(|| DMat4::from_cols(x, y, z, shift.extend(1.0))))
    }

    fn mesh(&mut self, node: Node<'_, '_>, mirror: Option<DMat4>) -> Result<(), SceneError> {
        let is_known = |kind: &&str| ["obj", "ply"].contains(kind);
        if let Some(kind) = node.attribute("type").filter(|kind| !is_known(kind)) {
            self.warn(node, &format!("the mesh `{kind}` is not known, left out"));
            return Ok(());
        }
        let file = property(node, "filename")
            .filter(|file| !file.trim().is_empty())
            .ok_or_else(|| self.broken(node, "a mesh without `<string name=\"filename\" …>`"))?;
        let mesh = self.file(node, file)?;
        let to_world = mirror.unwrap_or(DMat4::IDENTITY) * self.placement(node)?;
        self.warn_of_others(node, &["bsdf", "emitter", "transform"], &["filename"]);
        let material = self.material(node, file)?;
        let sky = mesh.daylight.as_ref().map(|sky| sky.note());
        let told = mesh.report.warnings.iter();
        for line in told.filter(|line| Some(*line) != sky.as_ref()) {
            self.warn(node, &format!("`{file}`: {line}"));
        }
        if !mesh.colors.is_empty() {
            self.warn(node, &format!("`{file}` has colours of vertices, left out"));
        }
        let id = self.look.materials.len() as u32;
        self.look.materials.push(material);
        self.builder.reserve(mesh.triangles.len());
        // Reflections reverse the corners, which define the sides of emitters and glass.
        let mirrored = to_world.determinant() < 0.0;
        let to_world_of_normals = of_normals(DMat3::from_mat4(to_world));
        let normals = |index: usize| -> Option<[Vec3; 3]> {
            let words = mesh.normals.get(index)?.map(decode_normal);
            let turned = |n: Option<DVec3>| (to_world_of_normals * n.unwrap_or_default()).as_vec3();
            words.iter().any(Option::is_some).then(|| words.map(turned))
        };
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let moved = |v: Vec3| to_world.transform_point3(v.as_dvec3()).as_vec3();
            let [a, b, c] = triangle.vertices.map(moved);
            let turn = |[a, b, c]: [Vec3; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
            let normals = normals(index).map(turn);
            let uvs = [Vec2::ZERO; 3];
            self.builder.push_corners(turn([a, b, c]), uvs, normals, id);
        }
        Ok(())
    }

    /// Loads the file of a mesh, whose name may be written as on a system with backslashes that ignores case.
    fn file(&mut self, node: Node<'_, '_>, file: &str) -> Result<SceneData, SceneError> {
        let relative = file.trim().replace('\\', "/");
        if Path::new(&relative).is_absolute() && !self.options.allow_outside {
            let problem = format!("`{file}` is an absolute path, which only --allow-outside reads");
            return Err(self.broken(node, &problem));
        }
        let folder = self.path.with_file_name("");
        let named = folder.join(&relative);
        let path = found(&folder, &relative);
        let path = path.ok_or_else(|| self.broken(node, &format!("`{file}` is not there")))?;
        if path != named {
            let what = format!("`{file}` is not there; {} is read", path.display());
            self.warn(node, &what);
        }
        let plain = LoadOptions {
            textures: false,
            ..*self.options
        };
        match super::extension(&path).as_str() {
            "ply" => ply::load(&path, file),
            "gltf" | "glb" | "stl" | "serialized" => {
                let problem = format!("`{file}` is no mesh of Nori: it takes .obj, and .ply here");
                Err(self.broken(node, &problem))
            }
            _ => obj::load(&path, file, &plain),
        }
    }

    fn material(&mut self, mesh: Node<'_, '_>, name: &str) -> Result<Material, SceneError> {
        let mut bsdfs = mesh.children().filter(|node| node.has_tag_name("bsdf"));
        let bsdf = bsdfs.next();
        for another in bsdfs {
            self.warn(
                another,
                "a mesh has one material, and this is another: left out",
            );
        }
        let mut material = match bsdf {
            Some(bsdf) => self.bsdf(bsdf, name)?,
            None => Material::diffuse(name, Vec3::splat(ALBEDO)),
        };
        let mut shines = false;
        for emitter in mesh.children().filter(|n| n.has_tag_name("emitter")) {
            if shines {
                self.warn(
                    emitter,
                    "a mesh has one emitter, and this is another: left out",
                );
                continue;
            }
            if emitter.attribute("type") != Some("area") {
                self.warn(emitter, "an emitter of a mesh that is not `area`, left out");
                continue;
            }
            self.warn_of_others(emitter, &[], &["radiance"]);
            let radiance = self.color(emitter, "radiance")?;
            if radiance.is_none() {
                self.warn(emitter, "an emitter without `radiance` is dark");
            }
            shines = true;
            let radiance = radiance.unwrap_or(Vec3::ZERO);
            material = material.emitting_from_front(emitted(radiance));
        }
        Ok(material)
    }

    fn bsdf(&mut self, node: Node<'_, '_>, name: &str) -> Result<Material, SceneError> {
        let kind = node.attribute("type").unwrap_or_default();
        let values: &[&str] = match kind {
            "diffuse" => &["albedo"],
            "dielectric" => &["intIOR", "extIOR"],
            "microfacet" => &["kd", "alpha", "intIOR", "extIOR"],
            _ => &[],
        };
        if matches!(kind, "diffuse" | "mirror" | "dielectric" | "microfacet") {
            self.warn_of_others(node, &[], values);
        }
        // Other renderers name glasses there, in materials that have no index here.
        let index = |name: &str, default: f32| -> Result<f32, SceneError> {
            let is_read = values.contains(&name);
            let given = is_read.then(|| self.number(node, name)).transpose()?;
            Ok(given.flatten().map_or(default, |v| v as f32))
        };
        let (inside, outside) = (index("intIOR", INSIDE_IOR)?, index("extIOR", OUTSIDE_IOR)?);
        Ok(match kind {
            "diffuse" => {
                let albedo = self.color(node, "albedo")?.unwrap_or(Vec3::splat(ALBEDO));
                Material::diffuse(name, reflectance(albedo))
            }
            "mirror" => Material {
                kind: &MIRROR,
                ..Material::diffuse(name, Vec3::ONE)
            },
            "dielectric" => {
                if inside <= 0.0 || outside <= 0.0 {
                    let problem = format!(
                        "indices of refraction are above 0, and these are {inside} and {outside}"
                    );
                    return Err(self.broken(node, &problem));
                }
                Material::dielectric(name, Vec3::ONE, inside / outside)
            }
            "microfacet" => {
                let base = self.color(node, "kd")?.unwrap_or(Vec3::splat(ALBEDO));
                let alpha = self.number(node, "alpha")?.map_or(ALPHA, |v| v as f32);
                let base = reflectance(base);
                let of = CookTorrance {
                    diffuse: base,
                    specular: Vec3::splat(1.0 - base.max_element()),
                    roughness: alpha,
                    ior: inside / outside,
                    masking: Masking::Smith,
                    fresnel: Fresnel::Exact,
                };
                let material = Material::cook_torrance(name, &of);
                let drawn = material.parameters.get(3).copied().unwrap_or(alpha);
                if drawn != alpha {
                    let what = format!(
                        "an alpha of {alpha} is beyond what is rendered; drawn with {drawn}"
                    );
                    self.warn(node, &what);
                }
                material
            }
            other => {
                self.warn(
                    node,
                    &format!("the material `{other}` is not known; drawn as diffuse"),
                );
                let color = match self.color(node, "albedo")? {
                    Some(color) => Some(color),
                    None => self.color(node, "kd")?,
                };
                Material::diffuse(name, reflectance(color.unwrap_or(Vec3::splat(ALBEDO))))
            }
        })
    }

    /// A node's `toWorld` transform, the last of them; its first entry applies first.
    fn placement(&mut self, node: Node<'_, '_>) -> Result<DMat4, SceneError> {
        let is_it = |n: &Node<'_, '_>| {
            n.has_tag_name("transform") && n.attribute("name").is_none_or(|name| name == "toWorld")
        };
        let mut all = DMat4::IDENTITY;
        for other in node
            .children()
            .filter(|n| n.has_tag_name("transform") && !is_it(n))
        {
            self.warn(other, "a `<transform>` that is not `toWorld` is not read");
        }
        let mut given = node.children().filter(is_it);
        let Some(transform) = given.next_back() else {
            return Ok(all);
        };
        for earlier in given {
            let what = "a later `<transform>` counts in place of this one";
            self.warn(earlier, what);
        }
        for step in transform.children().filter(Node::is_element) {
            let value = |name: &str| self.vector(step, step.attribute(name), name);
            let one = match step.tag_name().name() {
                "translate" => DMat4::from_translation(value("value")?),
                "scale" => DMat4::from_scale(value("value")?),
                "rotate" => {
                    let angle = step
                        .attribute("angle")
                        .unwrap_or_default()
                        .trim()
                        .parse::<f64>();
                    let angle = angle.map_err(|_| self.broken(step, "`angle` is not a number"))?;
                    let axis = value("axis")?.normalize_or_zero();
                    DMat4::from_axis_angle(axis, angle.to_radians())
                }
                "lookat" => look_at(value("origin")?, value("target")?, value("up")?),
                "matrix" => self.matrix(step)?,
                other => {
                    return Err(self.broken(step, &format!("the transform `{other}` is not known")));
                }
            };
            all = one * all;
        }
        Ok(all)
    }

    fn matrix(&self, step: Node<'_, '_>) -> Result<DMat4, SceneError> {
        let numbers = numbers(step.attribute("value").unwrap_or_default());
        let rows = numbers.and_then(|n| <[f64; 16]>::try_from(n).ok());
        let rows = rows.ok_or_else(|| self.broken(step, "a matrix has 16 numbers"))?;
        Ok(DMat4::from_cols_array(&rows).transpose())
    }

    fn vector(
        &self,
        node: Node<'_, '_>,
        text: Option<&str>,
        name: &str,
    ) -> Result<DVec3, SceneError> {
        let three = text
            .and_then(numbers)
            .and_then(|n| <[f64; 3]>::try_from(n).ok());
        let problem = || self.broken(node, &format!("`{name}` is not three numbers"));
        three.map(DVec3::from).ok_or_else(problem)
    }

    fn color(&mut self, node: Node<'_, '_>, name: &str) -> Result<Option<Vec3>, SceneError> {
        let Some(text) = property(node, name) else {
            return Ok(None);
        };
        let color = self.vector(node, Some(text), name)?;
        let drawn = color.as_vec3();
        if !drawn.is_finite() || drawn.min_element() < 0.0 {
            self.warn(
                node,
                &format!("`{name}` of {color} is beyond what is rendered, and taken as 0 there"),
            );
        }
        Ok(Some(drawn))
    }

    fn number(&self, node: Node<'_, '_>, name: &str) -> Result<Option<f64>, SceneError> {
        let parse = |text: &str| {
            let finite = text.trim().parse().ok().filter(|v: &f64| v.is_finite());
            finite.ok_or_else(|| self.broken(node, &format!("`{name}` is not a number")))
        };
        property(node, name).map(parse).transpose()
    }

    fn warn(&mut self, node: Node<'_, '_>, what: &str) {
        let line = line_of(node);
        self.builder
            .report
            .warnings
            .push(format!("line {line}: {what}"));
    }

    fn broken(&self, node: Node<'_, '_>, problem: &str) -> SceneError {
        SceneError::malformed(self.path, format!("line {}", line_of(node)), problem)
    }
}

fn line_of(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

/// Those of a node's children that give property `name` a value: `<float name="fov" value="30"/>`.
fn properties<'a, 'i>(
    node: Node<'a, 'i>,
    name: &str,
) -> impl DoubleEndedIterator<Item = Node<'a, 'i>> {
    node.children()
        .filter(move |n| n.attribute("name") == Some(name) && n.has_attribute("value"))
}

/// The value of property `name`: the last that is given.
fn property<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    properties(node, name).next_back()?.attribute("value")
}

/// Numbers separated by commas or spaces; `None` if one is invalid or not finite.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let words = text.split(|c: char| c == ',' || c.is_whitespace());
    let words = words.filter(|word| !word.is_empty());
    words
        .map(|w| w.parse().ok().filter(|v: &f64| v.is_finite()))
        .collect()
}

/// The matrix with columns left, up, forward and eye.
fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> DMat4 {
    let forward = (target - origin).normalize_or_zero();
    let left = up.normalize_or_zero().cross(forward).normalize_or_zero();
    let up = forward.cross(left);
    let axis = |v: DVec3| v.extend(0.0);
    DMat4::from_cols(axis(left), axis(up), axis(forward), origin.extend(1.0))
}

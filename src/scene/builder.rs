//! Gathers triangles from a loader and turns them into a checked [`SceneData`].

use super::{
    Assembly, Daylight, Framing, GEOMETRIC, InstanceError, Light, LightList, LoadReport, Material,
    SceneData, SceneError, SceneMedium, Texture, Transform, WHITE, decode_color, encode_color,
    mask, normals,
};
use glam::{Vec2, Vec3};
use raystone_core::geometry::{Camera, Triangle};

/// Largest absolute coordinate. Triangle tests multiply up to four coordinate differences, shading squares cross products
/// of edges to find normals and areas, and WGSL leaves overflow undefined: 12 · (2 · 1e9)⁴ stays below the largest f32. So do
/// distances times 1e20, the largest reciprocal of a direction component in the kernels.
pub const MAX_COORDINATE: f32 = 1e9;

/// Reflectance of surfaces whose file gives none.
pub const DEFAULT_ALBEDO: f32 = 0.7;

/// Everything a loader knows about a scene besides its triangles.
#[derive(Default)]
pub(super) struct Look {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub camera: Option<Camera>,
    pub environment: Vec3,
    pub lights: Vec<Light>,
    pub media: Vec<SceneMedium>,
}

impl Look {
    /// A white sky, and a camera at `eye` with a vertical field of view of `fov` degrees.
    pub(crate) fn under_sky(materials: Vec<Material>, eye: Vec3, target: Vec3, fov: f32) -> Self {
        Self {
            materials,
            camera: Some(Camera::upright(eye, target, fov)),
            environment: Vec3::ONE,
            ..Self::default()
        }
    }

    /// Takes the emission from materials whose emissive texture is black: a texture multiplies, and light that no texel
    /// gives must not keep the default sky away.
    fn darken(&mut self) {
        for material in &mut self.materials {
            let texture = material.emission_texture.as_ref();
            let texture = texture.and_then(|used| self.textures.get(used.texture as usize));
            let is_black = |texel: &[u8; 4]| texel[..3] == [0; 3];
            if texture.is_some_and(|texture| texture.texels.iter().all(is_black)) {
                material.emission = Vec3::ZERO;
                material.emission_texture = None;
            }
        }
    }
}

/// Collects triangles, drops those that cannot be traced and counts degenerate ones.
#[derive(Default)]
pub(super) struct SceneBuilder {
    triangles: Vec<Triangle>,
    uvs: Vec<[Vec2; 3]>,
    /// Empty until a triangle has normals other than its own.
    normals: Vec<[u32; 3]>,
    /// Empty until a vertex has a colour other than white.
    colors: Vec<[[u32; 2]; 3]>,
    mirrored: Vec<bool>,
    material_ids: Vec<u32>,
    keep_uvs: bool,
    /// Objects and instances; dropped if they do not cover every triangle.
    pub assembly: Assembly,
    /// The first instance that could not be placed.
    misplaced: Option<InstanceError>,
    /// The reason to refuse the scene, if building found one.
    pub refused: Option<SceneError>,
    pub report: LoadReport,
}

/// Rounding of coordinates that shows, as a fraction of the model's size.
const NOTICEABLE: f32 = 1e-4;

impl SceneBuilder {
    /// `keep_uvs` is true if texture coordinates will be used.
    pub(crate) fn new(keep_uvs: bool, capacity: usize) -> Self {
        Self {
            triangles: Vec::with_capacity(capacity),
            uvs: Vec::with_capacity(if keep_uvs { capacity } else { 0 }),
            material_ids: Vec::with_capacity(capacity),
            keep_uvs,
            ..Self::default()
        }
    }

    pub(crate) fn reserve(&mut self, more: usize) {
        self.triangles.reserve(more);
        self.material_ids.reserve(more);
        self.uvs.reserve(if self.keep_uvs { more } else { 0 });
    }

    pub(crate) fn push(&mut self, vertices: [Vec3; 3], material: u32) {
        self.push_corners(vertices, [Vec2::ZERO; 3], None, material);
    }

    /// Adds a triangle with texture coordinates and optional normals. Drops it if a vertex is not
    /// finite; counts it if its area is zero.
    pub(crate) fn push_corners(
        &mut self,
        vertices: [Vec3; 3],
        uvs: [Vec2; 3],
        normals: Option<[Vec3; 3]>,
        material: u32,
    ) {
        self.push_colored(vertices, uvs, normals, None, material);
    }

    /// [`Self::push_corners`] with optional linear vertex colours, which multiply the base colour.
    pub(crate) fn push_colored(
        &mut self,
        vertices: [Vec3; 3],
        uvs: [Vec2; 3],
        normals: Option<[Vec3; 3]>,
        colors: Option<[Vec3; 3]>,
        material: u32,
    ) {
        if !vertices.iter().all(|v| v.is_finite()) {
            self.report.dropped_non_finite += 1;
            return;
        }
        let triangle = Triangle { vertices };
        self.report.zero_area += usize::from(triangle.has_zero_area());
        let words = normals.map(|n| normals::encode_corners(&triangle, n));
        let words = words.unwrap_or([GEOMETRIC; 3]);
        if !self.normals.is_empty() || words != [GEOMETRIC; 3] {
            self.normals.resize(self.triangles.len(), [GEOMETRIC; 3]);
            self.normals.push(words);
        }
        let words = colors.map_or([WHITE; 3], |c| c.map(encode_color));
        if !self.colors.is_empty() || words != [WHITE; 3] {
            self.colors.resize(self.triangles.len(), [WHITE; 3]);
            self.colors.push(words);
        }
        self.triangles.push(triangle);
        self.material_ids.push(material);
        if self.keep_uvs {
            let finite = |uv: Vec2| if uv.is_finite() { uv } else { Vec2::ZERO };
            self.uvs.push(uvs.map(finite));
        }
    }

    /// Adds the quadrilateral a, b, c, d as triangles abc and acd.
    pub(crate) fn push_quad(&mut self, [a, b, c, d]: [Vec3; 4], material: u32) {
        self.push([a, b, c], material);
        self.push([a, c, d], material);
    }

    /// Adds `edge` × `edge` quadrilaterals between the points of a grid.
    pub(crate) fn push_grid(
        &mut self,
        edge: usize,
        material: u32,
        at: impl Fn(usize, usize) -> Vec3,
    ) {
        for (i, k) in (0..edge).flat_map(|i| (0..edge).map(move |k| (i, k))) {
            let quad = [at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)];
            self.push_quad(quad, material);
        }
    }

    /// Marks the triangles from `first` on as mirrored: their corners turn clockwise.
    pub(crate) fn mirror_from(&mut self, first: usize) {
        self.mirrored.resize(first, false);
        self.mirrored.resize(self.triangles.len(), true);
    }

    /// Adds an object to the assembly; objects are numbered in order of addition.
    pub(crate) fn add_object(&mut self, triangles: Vec<Triangle>) {
        if let Err(error) = self.assembly.add_object(triangles) {
            self.misplaced.get_or_insert(error);
        }
    }

    /// Adds an instance of an object with a single material. If it cannot be placed,
    /// [`SceneBuilder::finish`] fails.
    pub(crate) fn place(&mut self, object: u32, to_world: Transform, material: u32) {
        self.place_textured(object, to_world, material, &[]);
    }

    /// [`Self::place`] with texture coordinates for the object's triangles.
    pub(crate) fn place_textured(
        &mut self,
        object: u32,
        to_world: Transform,
        material: u32,
        uvs: &[[Vec2; 3]],
    ) {
        self.place_looking(object, to_world, |_| material, uvs, &[]);
    }

    /// [`Self::place`] with a material per triangle and vertex colours.
    pub(crate) fn place_looking(
        &mut self,
        object: u32,
        to_world: Transform,
        material: impl Fn(usize) -> u32,
        uvs: &[[Vec2; 3]],
        colors: &[[[u32; 2]; 3]],
    ) {
        match self.assembly.place(object, to_world) {
            Ok(instance) => {
                let first = self.len();
                let copy: Vec<Triangle> = self.assembly.copy(&instance).collect();
                for (id, triangle) in copy.iter().enumerate() {
                    let uvs = uvs.get(id).copied().unwrap_or_default();
                    let colors = colors.get(id).map(|c| c.map(|w| decode_color(w).as_vec3()));
                    let vertices = triangle.vertices;
                    self.push_colored(vertices, uvs, None, colors, material(id));
                }
                if to_world.is_mirrored() {
                    self.mirror_from(first);
                }
            }
            Err(error) => {
                self.misplaced.get_or_insert(error);
            }
        }
    }

    pub(crate) fn into_triangles(self) -> Vec<Triangle> {
        self.triangles
    }

    pub(crate) fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// The material of each triangle.
    pub(crate) fn material_ids(&self) -> &[u32] {
        &self.material_ids
    }

    pub(crate) fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Says that f32 has rounded the coordinates of a file noticeably, if the model lies so far from
    /// the origin, as those of surveyors do.
    pub(crate) fn note_far(&mut self) {
        let corners = || self.triangles.iter().flat_map(|t| t.vertices);
        let all = |f: fn(Vec3, Vec3) -> Vec3| corners().reduce(f).unwrap_or_default();
        let (low, high) = (all(Vec3::min), all(Vec3::max));
        let largest = low.abs().max(high.abs()).max_element();
        let size = (high - low).max_element();
        let step = largest.next_up() - largest;
        if step > NOTICEABLE * size && size > 0.0 {
            self.report.warnings.push(format!(
                "coordinates of up to {largest} are rounded to steps of {step}, and the model is {size} large: subtract an offset from all of them"
            ));
        }
    }

    /// The assembly, if it covers every triangle.
    fn take_assembly(&mut self) -> Option<Assembly> {
        let assembly = std::mem::take(&mut self.assembly);
        let whole = assembly.triangles() == self.triangles.len() as u64;
        (whole && !assembly.instances().is_empty()).then_some(assembly)
    }

    /// Validates the scene, adds a sky and framing if it has no light or camera, and hashes it.
    ///
    /// # Errors
    /// The error in `refused`, [`SceneError::NoTriangles`], [`SceneError::TooLarge`],
    /// [`SceneError::Instance`], and [`SceneError::Camera`] if the scene's own camera sees nothing.
    pub(crate) fn finish(mut self, name: &str, mut look: Look) -> Result<SceneData, SceneError> {
        self.check(name)?;
        if let Some(camera) = &look.camera {
            crate::check_camera(camera)?;
        }
        mask::settle(&mut look.materials, &look.textures);
        look.darken();
        let textured = !look.textures.is_empty();
        let assembly = self.take_assembly();
        if !self.mirrored.is_empty() {
            self.mirrored.resize(self.triangles.len(), false);
        }
        let mut scene = SceneData {
            name: name.to_owned(),
            triangles: self.triangles,
            uvs: if textured { self.uvs } else { Vec::new() },
            normals: self.normals,
            colors: self.colors,
            mirrored: self.mirrored,
            material_ids: self.material_ids,
            materials: look.materials,
            textures: look.textures,
            assembly,
            camera: look.camera,
            environment: look.environment,
            lights: look.lights,
            daylight: None,
            media: look.media,
            framing: None,
            hash: String::new(),
            report: self.report,
        };
        let list = LightList::of(&scene);
        scene.report.warnings.extend(list.problems);
        let unlit = scene.environment == Vec3::ZERO && list.lights.is_empty();
        if unlit || scene.camera.is_none() {
            let framing = Framing::of(&scene);
            if unlit {
                let sky = Daylight::over(&framing);
                scene.report.warnings.push(sky.note());
                scene.environment = Vec3::ONE;
                scene.daylight = Some(sky);
            }
            scene.framing = Some(framing);
        }
        scene.hash = scene.content_hash();
        Ok(scene)
    }

    /// Fails on what was found while building, on a scene without triangles, and on coordinates that are too large.
    fn check(&mut self, name: &str) -> Result<(), SceneError> {
        let owned = || name.to_owned();
        if let Some(error) = self.refused.take() {
            return Err(error);
        }
        if let Some(source) = self.misplaced.take() {
            let name = owned();
            return Err(SceneError::Instance { name, source });
        }
        if self.triangles.is_empty() {
            let reason = match self.report.dropped_non_finite {
                0 if self.report.warnings.is_empty() => "it lists no faces".to_owned(),
                0 => format!(
                    "it lists no faces of three or more corners; {}",
                    self.report.warnings.join("; ")
                ),
                n => {
                    let told = self.report.warnings.iter().map(|line| format!("; {line}"));
                    format!(
                        "all {n} have a NaN or infinite vertex{}",
                        told.collect::<String>()
                    )
                }
            };
            let name = owned();
            return Err(SceneError::NoTriangles { name, reason });
        }
        let magnitude = |triangle: &Triangle| {
            let [a, b, c] = triangle.vertices.map(Vec3::abs);
            a.max(b).max(c).max_element()
        };
        let too_large = |triangle: &Triangle| magnitude(triangle) > MAX_COORDINATE;
        match self.triangles.iter().position(too_large) {
            None => Ok(()),
            Some(first) => Err(SceneError::TooLarge {
                name: owned(),
                triangle: first,
                magnitude: magnitude(&self.triangles[first]),
                limit: MAX_COORDINATE,
            }),
        }
    }
}

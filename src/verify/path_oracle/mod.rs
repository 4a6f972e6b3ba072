//! The oracle for images: what one sample of one pixel must be, in f64.
//!
//! A plain path tracer on the host, written from the section "Formulas" of `docs/shading.md` and from the papers
//! that it names, not from the kernels. It reads the scene as it was loaded, draws the same words as the kernels
//! through the samplers' twins, and finds its hits by testing all triangles near a ray: neither tables that were made for
//! the device nor a structure can mislead it.
//!
//! A ray starts exactly on the surface that it leaves and passes over the triangle there; a shadow ray ends
//! `SHORT` before its light. Offsets, with which kernels have to keep off a surface, are thus no part of the answer.
//!
//! What single precision may do to a path is found by playing it: see [`Rounding`].

pub(crate) mod bsdf;
mod camera;
mod estimator;
pub(crate) mod hits;
pub(crate) mod light;
mod rounding;
mod surface;
pub(crate) mod texture;

pub use bsdf::{
    Bounce, Bsdf, Reflected, around, bounce, choose, colour, cosine_density, cosine_direction,
    diffuse_share, is_above, kept, mirrored, parameter,
};
pub use estimator::Estimator;
pub use light::LightSample;
pub(crate) use rounding::MOST_ROUNDINGS;
pub use rounding::Rounding;
pub use surface::Surface;

use crate::kinds::KindChecks;
use crate::materials::MaterialChecks;
use camera::Lens;
use glam::DVec3;
use hits::{Blocked, Hits, Nearest, Segment};
use light::{Choice, Lights};
use raystone_core::geometry::Camera;
use raystone_render::CountedRays;
use raystone_sampling::{Coordinate, Sampler, to_unit};
use raystone_scene::{Material, SceneData};
use std::fmt;
use texture::Textures;

/// One sample of one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathId {
    /// Column and row, from the top left.
    pub pixel: [u32; 2],
    /// Index of the sample.
    pub sample: u32,
    /// Seed of the replicate.
    pub seed: u32,
}

impl fmt::Display for PathId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.pixel;
        let (sample, seed) = (self.sample, self.seed);
        write!(f, "pixel ({x}, {y}), sample {sample}, seed {seed}")
    }
}

/// A vertex of a path, for people.
#[derive(Debug, Clone, PartialEq)]
pub struct Vertex {
    /// Where.
    pub position: DVec3,
    /// Which triangle.
    pub triangle: u32,
    /// Name of the material.
    pub material: String,
    /// Weight with which radiance that arrives from the next vertex counts, before roulette.
    pub throughput: DVec3,
    /// Radiance that the light sample of this vertex brought, weighted.
    pub direct: DVec3,
}

impl fmt::Display for Vertex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let show = |v: DVec3| format!("({:.7}, {:.7}, {:.7})", v.x, v.y, v.z);
        write!(
            f,
            "{} on triangle {} ({}), throughput {}, direct light ({:.4e}, {:.4e}, {:.4e})",
            show(self.position),
            self.triangle,
            self.material,
            show(self.throughput),
            self.direct.x,
            self.direct.y,
            self.direct.z
        )
    }
}

/// A ray of a path, in the order in which they are traced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathRay {
    /// What it is for.
    pub class: CountedRays,
    /// Bounces before it; of a shadow ray those before the point that it leaves.
    pub depth: u32,
    /// Which of all lights it goes to, where each is sampled; else 0.
    pub light: u32,
    /// Where it begins: on a surface, or in the camera.
    pub origin: DVec3,
    /// Unit normal there; 0 in the camera.
    pub normal: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Its length, scene units.
    pub length: f64,
}

/// A path and what it found.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Radiance, linear RGB.
    pub radiance: DVec3,
    /// Its vertices from the camera on.
    pub vertices: Vec<Vertex>,
    /// All that is traced for it.
    pub rays: Vec<PathRay>,
    /// All decisions: triangles, lobes, lights, what was occluded, where it ended. Paths of one branch differ by rounding
    /// only.
    pub branch: Vec<Decision>,
    /// Of its surfaces those that have another one within rounding.
    pub layers: usize,
}

/// A decision of a path, and what it depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Decision {
    /// Which triangle was met.
    Met(u64),
    /// The same, where rounding alone put it before another.
    MetBefore(u64),
    /// Whether something is in the way.
    Blocked(bool),
    /// A layer of the surface that the ray leaves is in the way, within rounding.
    BlockedByLayer,
    /// A number against a probability, a side, a place in a table.
    Other(u64),
}

/// Why two paths take other branches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Parting {
    /// They met surfaces that lie within rounding of each other.
    Surfaces,
    /// One passed an edge.
    Edge,
    /// Anything else.
    Decision,
}

impl Decision {
    /// What was decided, whatever made it so.
    fn outcome(self) -> (u8, u64) {
        match self {
            Self::Met(triangle) | Self::MetBefore(triangle) => (0, triangle),
            Self::Blocked(is) => (1, is.into()),
            Self::BlockedByLayer => (1, 1),
            Self::Other(what) => (2, what),
        }
    }
}

impl Path {
    /// Where this path and another one part first, if they do.
    pub(crate) fn parting(&self, other: &Self) -> Option<Parting> {
        let longest = self.branch.len().max(other.branch.len());
        let at = |path: &Self, i: usize| path.branch.get(i).copied();
        let part = (0..longest).map(|i| (at(self, i), at(other, i)));
        let part = part
            .into_iter()
            .find(|(a, b)| a.map(Decision::outcome) != b.map(Decision::outcome));
        let by_layer = |of: Option<Decision>| {
            matches!(of, Some(Decision::MetBefore(_) | Decision::BlockedByLayer))
        };
        part.map(|pair| match pair {
            (a, b) if by_layer(a) || by_layer(b) => Parting::Surfaces,
            (Some(Decision::Met(_) | Decision::Blocked(_)), _) => Parting::Edge,
            _ => Parting::Decision,
        })
    }
}

/// A scene as the oracle sees it.
pub struct PathOracle<'a> {
    scene: &'a SceneData,
    hits: Hits<'a>,
    lights: Lights,
    textures: Textures<'a>,
    /// What is known of the kind of each material.
    materials: Vec<&'static MaterialChecks>,
    /// Of the box of all triangles.
    diagonal: f64,
}

/// What is estimated, of which image.
pub struct View<'a> {
    /// What a sample is.
    pub estimator: Estimator,
    /// Where the image is taken from.
    pub camera: Camera,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// What draws the numbers.
    pub sampler: &'a Sampler,
}

impl<'a> PathOracle<'a> {
    /// The oracle of a scene of the program's kinds.
    ///
    /// # Errors
    /// What the scene has that the oracle does not know: nothing can be judged then.
    pub fn new(scene: &'a SceneData) -> Result<Self, String> {
        Self::knowing(scene, &KindChecks::default())
    }

    /// The oracle of a scene of these kinds of materials and lights.
    ///
    /// # Errors
    /// As [`PathOracle::new`].
    pub fn knowing(scene: &'a SceneData, kinds: &KindChecks) -> Result<Self, String> {
        let known = |material: &Material| {
            let kind = material.kind.name;
            (kinds.materials.get(kind)).ok_or_else(|| format!("material `{kind}`"))
        };
        Ok(Self {
            materials: scene
                .materials
                .iter()
                .map(known)
                .collect::<Result<_, _>>()?,
            scene,
            hits: Hits::new(scene),
            lights: Lights::new(scene, &kinds.lights)?,
            textures: Textures::new(scene),
            diagonal: diagonal(scene),
        })
    }

    /// 2 where colours of surfaces come from textures, 1 where light comes from a map, else 0.
    pub(crate) fn texturing(&self) -> usize {
        let mut materials = self.scene.materials.iter();
        match materials.any(|m| m.texture_uses().iter().any(Option::is_some)) {
            true => 2,
            false => usize::from(self.lights.have_map()),
        }
    }

    /// The path of one sample, computed in f64 throughout, or with the roundings of f32 played.
    pub fn trace(&self, view: &View, id: PathId, rounding: Rounding) -> Path {
        let mut walk = Walk {
            id,
            view,
            rounding,
            vertices: Vec::new(),
            rays: Vec::new(),
            branch: Vec::new(),
            layers: 0,
        };
        let radiance = self.estimate(&mut walk);
        Path {
            radiance,
            vertices: walk.vertices,
            rays: walk.rays,
            branch: walk.branch,
            layers: walk.layers,
        }
    }
}

/// f · cos of a material on the plane z = 0 for light that arrives from `from` and leaves towards `out`, both above it; delta lobes
/// are no part of it.
pub(crate) fn scattered(
    checks: &'static MaterialChecks,
    material: &Material,
    out: DVec3,
    from: DVec3,
) -> DVec3 {
    let surface = Surface::flat(checks, material, out);
    let reflected = surface.bsdf().reflect(from, &mut Rounding::none());
    reflected.map_or(DVec3::ZERO, |reflected| reflected.value)
}

fn diagonal(scene: &SceneData) -> f64 {
    let bounds = scene.bounds();
    (bounds.max.as_dvec3() - bounds.min.as_dvec3()).length()
}

/// What a path carries along.
struct Walk<'a> {
    id: PathId,
    view: &'a View<'a>,
    rounding: Rounding,
    vertices: Vec<Vertex>,
    rays: Vec<PathRay>,
    branch: Vec<Decision>,
    layers: usize,
}

impl Walk<'_> {
    /// Notes a ray that is traced after as many bounces as there are vertices but one.
    fn note_ray(&mut self, class: CountedRays, light: usize, ray: &Segment) {
        let closest = [CountedRays::Primary, CountedRays::Bounce].contains(&class);
        let vertices = self.vertices.len() as u32;
        let all_lights =
            matches!(self.view.estimator, Estimator::Path(rules) if rules.choice == Choice::All);
        self.rays.push(PathRay {
            class,
            depth: if closest {
                vertices
            } else {
                vertices.saturating_sub(1)
            },
            light: if all_lights { light as u32 } else { 0 },
            origin: ray.origin,
            normal: ray.normal,
            direction: ray.direction,
            length: ray.length,
        });
    }

    /// The number of a dimension, in [0, 1).
    fn draw(&self, dimension: u32) -> f64 {
        let [x, y] = self.id.pixel;
        f64::from(to_unit(self.view.sampler.sample_u32(Coordinate {
            pixel: y * self.view.size[0] + x,
            sample: self.id.sample,
            dimension,
            seed: self.id.seed,
        })))
    }

    /// The numbers of a dimension and the next.
    fn draw_2d(&self, dimension: u32) -> [f64; 2] {
        [self.draw(dimension), self.draw(dimension + 1)]
    }

    /// Notes a decision.
    fn decide(&mut self, what: u64) {
        self.branch.push(Decision::Other(what));
    }

    /// Notes whether something is in the way.
    fn decide_blocked(&mut self, blocked: Blocked) {
        self.branch.push(match blocked {
            Blocked::ByLayer => Decision::BlockedByLayer,
            _ => Decision::Blocked(blocked == Blocked::Yes),
        });
        self.layers += usize::from(blocked == Blocked::ByLayer);
    }

    /// Notes what a ray has met.
    fn decide_met(&mut self, met: Option<&Nearest>) {
        let triangle = met.map_or(u64::MAX, |met| met.hit.triangle.into());
        self.branch.push(match met {
            Some(met) if met.is_swapped => Decision::MetBefore(triangle),
            _ => Decision::Met(triangle),
        });
        self.layers += usize::from(met.is_some_and(|met| met.is_layered));
    }

    fn lens(&self) -> Lens {
        Lens::new(&self.view.camera, self.view.size)
    }
}

/// Brightness of a colour, as docs/shading.md defines it.
pub(crate) fn luminance(c: DVec3) -> f64 {
    0.212_671 * c.x + 0.715_160 * c.y + 0.072_169 * c.z
}

//! The image oracle: the value of one sample of one pixel, in f64.
//!
//! A plain path tracer on the host, written from the section "Formulas" of `docs/shading.md` and
//! its references, not from the kernels. It reads the scene as loaded, draws the same words as the
//! kernels through the samplers' CPU versions, and finds hits by testing all triangles near a ray:
//! neither device tables nor an acceleration structure can mislead it.
//!
//! A ray starts exactly on the surface that it leaves and skips the triangle there; a shadow ray
//! ends `SHORT` before its light. The offsets that kernels need are thus no part of the answer.
//!
//! The effect of single precision on a path is simulated: see [`Rounding`].

pub(crate) mod bsdf;
mod camera;
mod coloured;
mod connection;
mod estimator;
pub(crate) mod hits;
pub(crate) mod light;
mod media;
mod medium;
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
pub(crate) use camera::Lens;
use glam::DVec3;
use hits::{Blocked, Hits, Nearest, Segment};
use light::{Choice, Lights};
use raystone_core::geometry::Camera;
use raystone_render::CountedRays;
use raystone_sampling::{Coordinate, Sampler, to_unit};
use raystone_scene::{Material, SceneData, SceneMedium};
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

/// A vertex of a path, for reports.
#[derive(Debug, Clone, PartialEq)]
pub struct Vertex {
    /// The position.
    pub position: DVec3,
    /// The triangle index.
    pub triangle: u32,
    /// Name of the material.
    pub material: String,
    /// Weight of radiance arriving from the next vertex, before roulette.
    pub throughput: DVec3,
    /// Weighted radiance of this vertex's light sample.
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

/// A ray of a path, in tracing order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathRay {
    /// The purpose of the ray.
    pub class: CountedRays,
    /// Bounces before it; for a shadow ray, before the point that it leaves.
    pub depth: u32,
    /// Index of its light when all lights are sampled, otherwise 0.
    pub light: u32,
    /// The origin: on a surface, or in the camera.
    pub origin: DVec3,
    /// Unit normal at the origin; 0 in the camera.
    pub normal: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Length, scene units.
    pub length: f64,
}

/// A path and its result.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Radiance, linear RGB.
    pub radiance: DVec3,
    /// Vertices, from the camera on.
    pub vertices: Vec<Vertex>,
    /// All rays traced for it.
    pub rays: Vec<PathRay>,
    /// All decisions: triangles, lobes, lights, occlusion, end. Otherwise paths differ by rounding.
    pub branch: Vec<Decision>,
    /// Number of its surfaces that have another within rounding, or that are there by chance.
    pub layers: usize,
    /// Number of decisions about surfaces that are there by chance.
    pub by_chance: usize,
}

/// A decision of a path, with its inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Decision {
    /// The triangle that was hit.
    Met(u64),
    /// The same, if only rounding or chance put it before another.
    MetBefore(u64),
    /// True if the ray is occluded.
    Blocked(bool),
    /// Occluded, within rounding or by chance, by a layer of the surface that the ray leaves or by a
    /// surface that is partly transparent.
    BlockedByLayer,
    /// A number against a probability, a side, an index into a table.
    Other(u64),
}

/// Why two paths branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Parting {
    /// They hit surfaces within rounding of each other.
    Surfaces,
    /// One passed an edge.
    Edge,
    Decision,
}

impl Decision {
    /// The outcome of the decision, regardless of its cause.
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
    /// The first decision in which the paths differ, if any.
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

/// The oracle of a scene.
pub struct PathOracle<'a> {
    scene: &'a SceneData,
    hits: Hits<'a>,
    lights: Lights,
    textures: Textures<'a>,
    materials: Vec<&'static MaterialChecks>,
    media: Vec<medium::Medium<'a>>,
    /// Coefficients of one of them differ by channel.
    are_coloured: bool,
    diagonal: f64,
}

/// The estimated image.
pub struct View<'a> {
    /// The estimator.
    pub estimator: Estimator,
    /// The camera.
    pub camera: Camera,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// The source of random numbers.
    pub sampler: &'a Sampler,
}

impl<'a> PathOracle<'a> {
    /// The oracle of a scene with the built-in kinds.
    ///
    /// # Errors
    /// The scene has a feature that the oracle does not support, so nothing can be checked.
    pub fn new(scene: &'a SceneData) -> Result<Self, String> {
        Self::knowing(scene, &KindChecks::default())
    }

    /// The oracle of a scene with these kinds of materials and lights.
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
            media: (scene.media.iter().zip(0..))
                .map(|(of, number)| medium::Medium::new(of, number))
                .collect::<Result<_, _>>()?,
            are_coloured: scene.media.iter().any(SceneMedium::is_coloured),
            diagonal: diagonal(scene),
        })
    }

    /// 2 if surface colours come from textures, 1 if light comes from a map, otherwise 0.
    pub(crate) fn texturing(&self) -> usize {
        let mut materials = self.scene.materials.iter();
        if materials.any(|m| m.texture_uses().iter().any(Option::is_some)) {
            2
        } else {
            usize::from(self.lights.have_map())
        }
    }

    /// The path of one sample, computed in f64, or with simulated f32 roundings.
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
            by_chance: walk.rounding.by_chance(),
        }
    }
}

/// f · cos of a material on the plane z = 0 for light arriving from `from` and leaving towards
/// `out`, both above the plane; delta lobes are excluded.
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

/// The state of a path while it is traced.
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
    /// Records a ray. Its depth is that of the last vertex, or of the next one for closest-hit rays.
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

    /// The numbers of this dimension and the next.
    fn draw_2d(&self, dimension: u32) -> [f64; 2] {
        [self.draw(dimension), self.draw(dimension + 1)]
    }

    fn decide(&mut self, what: u64) {
        self.branch.push(Decision::Other(what));
    }

    fn decide_blocked(&mut self, blocked: Blocked) {
        self.branch.push(match blocked {
            Blocked::ByLayer => Decision::BlockedByLayer,
            _ => Decision::Blocked(blocked == Blocked::Yes),
        });
        self.layers += usize::from(blocked == Blocked::ByLayer);
    }

    /// Of a light that is there by chance.
    fn decide_shining(&mut self, is_there: bool) {
        self.branch.push(if is_there {
            Decision::Blocked(false)
        } else {
            Decision::BlockedByLayer
        });
        self.layers += 1;
    }

    fn decide_met(&mut self, met: Option<&Nearest>) {
        let triangle = met.map_or(u64::MAX, |met| met.hit.triangle.into());
        self.branch.push(match met {
            Some(met) if met.is_swapped => Decision::MetBefore(triangle),
            _ => Decision::Met(triangle),
        });
        self.layers += met.map_or(0, |met| met.layers);
    }

    fn lens(&self) -> Lens {
        Lens::new(&self.view.camera, self.view.size)
    }
}

/// Luminance of a colour, as defined in docs/shading.md.
pub(crate) fn luminance(c: DVec3) -> f64 {
    0.212_671 * c.x + 0.715_160 * c.y + 0.072_169 * c.z
}

//! Recorded ray sets: generated once per scene on the host, traced by every structure.
//!
//! The classes follow common practice (Aila & Laine 2009; Meister & Bittner 2022): primary rays in
//! 8×8 tiles; shadow, ambient-occlusion and bounce rays from the first hits in the same order; and
//! chords between random points of the bounding box.

use crate::hard_rays::hard_rays;
use crate::shadow_rays::{Segment, lights_of, other_orders};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use raystone_accel::{Counters, CpuTwin, Hit, NO_HIT, Query, Ray, TriangleSoup};
use raystone_config::Gate;
use raystone_core::geometry::Camera;
use raystone_core::random::Pcg32;
use raystone_record::RayClass;
use raystone_scene::{Bounds, SceneData};

/// Offset of origins from their surface, as a fraction of the scene's diagonal.
const OFFSET: f32 = 1e-5;
/// Length of AO rays as a fraction of the scene's diagonal.
const AO_LENGTH: f32 = 0.1;
const TILE: u32 = 8;

/// Rays of one class with reference answers.
#[derive(Debug, Clone)]
pub struct RaySet {
    /// The ray class.
    pub class: RayClass,
    /// The rays.
    pub rays: Vec<Ray>,
    /// The reference hits.
    pub truth: Vec<Hit>,
    /// For each ray the index of the [`RayClass::Shadow`] ray between the same ends; empty for
    /// classes not derived from it.
    pub shadow: Vec<u32>,
}

impl RaySet {
    pub(super) fn new(class: RayClass, rays: Vec<Ray>, reference: &dyn CpuTwin) -> Self {
        let truth = rays
            .par_iter()
            .map(|ray| reference.closest_hit(ray, &mut Counters::default()))
            .collect();
        Self {
            class,
            rays,
            truth,
            shadow: Vec::new(),
        }
    }

    pub(super) fn hard(soup: &TriangleSoup, reference: &dyn CpuTwin, seed: u64) -> Self {
        Self::new(RayClass::Hard, hard_rays(soup, reference, seed), reference)
    }

    /// The same rays with the answers of another reference.
    pub fn judged_by(&self, reference: &dyn CpuTwin) -> Self {
        Self {
            shadow: self.shadow.clone(),
            ..Self::new(self.class, self.rays.clone(), reference)
        }
    }

    /// True if the class is timed.
    pub fn is_timed(&self) -> bool {
        self.class != RayClass::Hard
    }

    /// True if neighbouring rays take nearly the same path.
    pub fn is_coherent(&self) -> bool {
        self.class == RayClass::Primary
    }

    /// The kind of query: closest or any hit.
    pub fn query(&self) -> Query {
        match self.class {
            RayClass::Shadow
            | RayClass::ShadowReversed
            | RayClass::ShadowClustered
            | RayClass::ShadowReversedClustered
            | RayClass::Ao => Query::Any,
            RayClass::Primary | RayClass::Bounce | RayClass::Chord | RayClass::Hard => {
                Query::Closest
            }
        }
    }

    /// Fraction of the rays that hit something.
    pub fn hit_fraction(&self) -> f64 {
        let hits = self.truth.iter().filter(|h| h.triangle != NO_HIT).count();
        hits as f64 / self.rays.len().max(1) as f64
    }
}

/// Camera rays through the centres of [`primary_pixels`].
pub fn primary_rays(camera: Camera, width: u32, height: u32) -> Vec<Ray> {
    let [forward, right, up] = camera.basis([width, height]);
    let ray = |pixel: u32| {
        let s = 2.0 * ((pixel % width) as f32 + 0.5) / width as f32 - 1.0;
        let t = 1.0 - 2.0 * ((pixel / width) as f32 + 0.5) / height as f32;
        Ray::new(camera.eye, (forward + right * s + up * t).normalize())
    };
    let pixels = primary_pixels(width, height);
    pixels.into_iter().map(ray).collect()
}

/// The pixels of an image in 8×8 tiles, row by row, as `y * width + x`.
pub fn primary_pixels(width: u32, height: u32) -> Vec<u32> {
    let mut pixels = Vec::with_capacity((width * height) as usize);
    for tile_y in (0..height).step_by(TILE as usize) {
        for tile_x in (0..width).step_by(TILE as usize) {
            for y in tile_y..(tile_y + TILE).min(height) {
                pixels.extend((tile_x..(tile_x + TILE).min(width)).map(|x| y * width + x));
            }
        }
    }
    pixels
}

/// Point and unit normal, on the ray's side, of every primary hit.
pub(super) fn surface_points(primary: &RaySet, soup: &TriangleSoup) -> Vec<(Vec3, Vec3)> {
    let hits = primary
        .rays
        .iter()
        .zip(&primary.truth)
        .filter(|(_, h)| h.triangle != NO_HIT);
    hits.filter_map(|(ray, hit)| {
        let record = &soup.records[hit.triangle as usize];
        let [v0, v1, v2] = record.vertices().map(Vec3::from);
        let (e1, e2) = (v0 - v1, v2 - v0);
        let normal =
            (e1.cross(e2).try_normalize()).or_else(|| unit(e1.as_dvec3().cross(e2.as_dvec3())))?;
        let facing = if normal.dot(Vec3::from(ray.direction)) > 0.0 {
            -normal
        } else {
            normal
        };
        Some((v0 - hit.u * e1 + hit.v * e2, facing))
    })
    .collect()
}

/// A ray from a random point of a box through another.
fn chord(bounds: &Bounds, random: &mut Pcg32) -> Ray {
    let mut inside = || {
        let u = Vec3::new(
            random.uniform() as f32,
            random.uniform() as f32,
            random.uniform() as f32,
        );
        bounds.min + u * (bounds.max - bounds.min)
    };
    let from = inside();
    let across = inside() - from;
    let direction = across.try_normalize().or_else(|| unit(across.as_dvec3()));
    Ray::new(from, direction.unwrap_or(Vec3::X))
}

/// A vector of length 1, for those that are so short that their squares are 0 in f32.
fn unit(short: DVec3) -> Option<Vec3> {
    Some(short.try_normalize()?.as_vec3())
}

/// Records all classes with about `settings.rays` rays each, then a fixed number of hard rays.
/// Classes that start on surfaces are missing if no primary ray hits anything.
pub fn record_rays(
    scene: &SceneData,
    soup: &TriangleSoup,
    camera: Camera,
    reference: &dyn CpuTwin,
    settings: &Gate,
    seed: u64,
) -> Vec<RaySet> {
    let side = ((f64::from(settings.rays).sqrt() / f64::from(TILE)).round() as u32).max(1) * TILE;
    let primary = RaySet::new(
        RayClass::Primary,
        primary_rays(camera, side, side),
        reference,
    );
    let bounds = scene.bounds();
    let diagonal = 2.0 * bounds.radius();
    let or_default = |set: f32, default: f32| if set > 0.0 { set } else { default };
    let offset = or_default(settings.offset, OFFSET * diagonal);
    let ao_length = or_default(settings.ao_length, AO_LENGTH * diagonal);
    let mut random = Pcg32::new(seed);
    let points = surface_points(&primary, soup);
    let emitters = scene.emitters();
    let mut sets = vec![];
    if !points.is_empty() {
        let starts = || {
            points
                .iter()
                .cycle()
                .take(primary.rays.len())
                .map(|&(p, n)| (p + n * offset, n))
        };
        let lights = lights_of(scene, &emitters);
        let segments = starts().map(|(surface, _)| {
            let (light, emitter) = light_point(scene, &emitters, &bounds, &mut random);
            Segment {
                surface,
                light,
                number: emitter.map_or(0, |place| lights[place]),
            }
        });
        let segments: Vec<Segment> = segments.collect();
        let shadow = segments.iter().map(Segment::forward).collect();
        let ao = starts()
            .map(|(p, n)| Ray::new(p, cosine_direction(n, &mut random)).between(0.0, ao_length))
            .collect();
        let bounce = starts()
            .map(|(p, n)| Ray::new(p, cosine_direction(n, &mut random)))
            .collect();
        sets.push(RaySet::new(RayClass::Shadow, shadow, reference));
        if settings.shadow_orders {
            sets.extend(other_orders(&segments, reference));
        }
        sets.push(RaySet::new(RayClass::Ao, ao, reference));
        sets.push(RaySet::new(RayClass::Bounce, bounce, reference));
    }
    let chords = (0..primary.rays.len()).map(|_| chord(&bounds, &mut random));
    sets.push(RaySet::new(RayClass::Chord, chords.collect(), reference));
    if soup.intersection.bears_hard_rays() {
        sets.push(RaySet::hard(soup, reference, seed));
    }
    sets.insert(0, primary);
    sets
}

/// A point on a random emissive triangle with its index, or without any on the bounding sphere.
fn light_point(
    scene: &SceneData,
    emitters: &[u32],
    bounds: &Bounds,
    random: &mut Pcg32,
) -> (Vec3, Option<usize>) {
    let (u, v) = (random.uniform() as f32, random.uniform() as f32);
    if emitters.is_empty() {
        let z = 1.0 - 2.0 * u;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let angle = std::f32::consts::TAU * v;
        let direction = Vec3::new(radius * angle.cos(), radius * angle.sin(), z);
        return (bounds.center() + bounds.radius() * direction, None);
    }
    let chosen = random.below(emitters.len());
    let [a, b, c] = scene.triangles[emitters[chosen] as usize].vertices;
    let root = u.sqrt();
    let point = a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v);
    (point, Some(chosen))
}

fn cosine_direction(n: Vec3, random: &mut Pcg32) -> Vec3 {
    let (u, v) = (random.uniform() as f32, random.uniform() as f32);
    let (tangent, bitangent) = n.any_orthonormal_pair();
    let radius = u.sqrt();
    let angle = std::f32::consts::TAU * v;
    (tangent * (radius * angle.cos())
        + bitangent * (radius * angle.sin())
        + n * (1.0 - u).max(0.0).sqrt())
    .normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chords_of_a_box_whose_squares_are_0_in_f32_go_everywhere() {
        let mut random = Pcg32::new(5);
        let bounds = Bounds {
            min: Vec3::ZERO,
            max: Vec3::splat(1e-30),
        };
        for _ in 0..512 {
            let direction = Vec3::from(chord(&bounds, &mut random).direction);
            assert!((direction.length() - 1.0).abs() < 1e-6 && direction != Vec3::X);
        }
    }
}

//! Light over one perfect mirror, as `docs/specular.md` has it: written from the law of reflection (the half vector is along the normal),
//! with derivatives by differences of shots, and over all mirrors in turn. The kernel has Newton's method on the shot itself, derivatives in
//! closed form, and a tree.

use super::bsdf::Bsdf;
use super::estimator::{PathRules, Strategy};
use super::hits::{Blocked, Hit, SHORT, Segment};
use super::light::{Chosen, Place};
use super::surface::Surface;
use super::{LightSample, PathOracle, Walk};
use glam::{DVec2, DVec3};
use raystone_scene::{Light, SceneData, Source, decode_normal};
use std::f64::consts::{PI, TAU};

/// Differences of places on a triangle, in edges, and of directions.
const STEP: f64 = 1e-5;
const ITERATIONS: usize = 40;
/// The half vector's part across the normal at a point of reflection.
const ACROSS: f64 = 1e-11;
/// Distance of two points of reflection that are one, in edges of the triangle.
const SAME: f64 = 1e-3;

/// The vertex before a mirror on a path that connections may know of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Before {
    place: Place,
    density: f64,
    triangle: u32,
    /// Where the path met the mirror.
    met: DVec3,
}

/// A point of reflection.
struct Crossing {
    weights: [f64; 2],
    position: DVec3,
    direction: DVec3,
    near: f64,
    /// Area across the path, at its end, of a solid angle of 1 at its start.
    spread: f64,
}

/// A mirror's triangle.
struct Mirror {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
}

impl Mirror {
    fn at(&self, [u, v]: [f64; 2]) -> (DVec3, DVec3) {
        let mix = |of: [DVec3; 3]| of[0] * (1.0 - u - v) + of[1] * u + of[2] * v;
        (mix(self.corners), mix(self.normals).normalize())
    }

    fn across(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    fn edge(&self) -> f64 {
        let [a, b, c] = self.corners;
        a.distance(b).max(a.distance(c))
    }

    /// Weights of the second and third corner at a point of the triangle's plane.
    fn weights(&self, point: DVec3) -> [f64; 2] {
        let [a, b, c] = self.corners;
        let (across, rest) = (self.across(), point - a);
        let scale = across.length_squared();
        [rest.cross(c - a), (b - a).cross(rest)].map(|part| part.dot(across) / scale)
    }

    /// The half vector's parts across the normal.
    fn bent(&self, weights: [f64; 2], ends: [DVec3; 2]) -> DVec2 {
        let (position, normal) = self.at(weights);
        let half: DVec3 = (ends.iter()).map(|end| (*end - position).normalize()).sum();
        let [x, y] = super::bsdf::basis(normal);
        DVec2::new(half.dot(x), half.dot(y))
    }

    /// Where a ray over it ends in the plane about `end` across `away`; `None` if it misses the triangle's plane.
    fn shot(&self, from: DVec3, direction: DVec3, (end, away): (DVec3, DVec3)) -> Option<DVec3> {
        let across = self.across();
        let t = across.dot(self.corners[0] - from) / across.dot(direction);
        let (position, normal) = self.at(self.weights(from + t * direction));
        let gone = direction - 2.0 * direction.dot(normal) * normal;
        let far = away.dot(end - position) / away.dot(gone);
        far.is_finite().then(|| position + far * gone)
    }

    /// The point that reflects one end to the other, searched from where the flat triangle has it, the middle and the corners.
    fn crossing(&self, ends: [DVec3; 2]) -> Option<Crossing> {
        let [from, end] = ends;
        let across = self.across();
        let heights = ends.map(|end| across.dot(end - self.corners[0]));
        if heights[0] * heights[1] <= 0.0 {
            return None;
        }
        // Of the flat triangle first.
        let feet = [0, 1].map(|k| ends[k] - across * (heights[k] / across.length_squared()));
        let flat = (feet[0] * heights[1] + feet[1] * heights[0]) / (heights[0] + heights[1]);
        let third = 1.0 / 3.0;
        // And where an end is close.
        let [near, far] = ends.map(|end| self.weights(end));
        let flat = self.weights(flat);
        let starts = [
            flat,
            near,
            far,
            [third; 2],
            [0.0; 2],
            [1.0, 0.0],
            [0.0, 1.0],
        ];
        let mut found = starts.iter().filter_map(|start| self.search(*start, ends));
        let weights = found.find(|[u, v]| *u >= 0.0 && *v >= 0.0 && u + v <= 1.0)?;
        let (position, normal) = self.at(weights);
        let direction = (position - from).normalize();
        let facing = across * heights[0].signum();
        let facing_normal = normal * normal.dot(facing).signum();
        if direction.dot(facing_normal) >= 0.0 {
            return None;
        }
        let away = (end - position).normalize();
        let [x, y] = super::bsdf::basis(direction);
        let moved = |by: DVec3| self.shot(from, (direction + by).normalize(), (end, away));
        let by = |axis: DVec3| Some((moved(axis * STEP)? - moved(-axis * STEP)?) / (2.0 * STEP));
        Some(Crossing {
            weights,
            position,
            direction,
            near: position.distance(from),
            spread: away.dot(by(x)?.cross(by(y)?)).abs(),
        })
    }

    /// Newton's method by differences, on the triangle and around it.
    fn search(&self, start: [f64; 2], ends: [DVec3; 2]) -> Option<[f64; 2]> {
        let mut at = DVec2::from_array(start);
        for _ in 0..ITERATIONS {
            let f = |x: DVec2| self.bent(x.to_array(), ends);
            let here = f(at);
            if here.length() < ACROSS {
                return Some(at.to_array());
            }
            let by = |axis: DVec2| (f(at + axis * STEP) - f(at - axis * STEP)) / (2.0 * STEP);
            let jacobian = glam::DMat2::from_cols(by(DVec2::X), by(DVec2::Y));
            let step = jacobian.inverse() * here;
            at -= step * (0.5 / step.length().max(0.5));
            if !at.is_finite() || at.abs().max_element() > 10.0 {
                return None;
            }
        }
        None
    }
}

impl PathOracle<'_> {
    /// The triangle as a mirror, if connections go over it.
    fn mirror(&self, walk: &mut Walk, triangle: u32) -> Option<Mirror> {
        let scene = self.scene;
        let material = &scene.materials[scene.material_ids[triangle as usize] as usize];
        let is_bent = material.normal_texture.is_some() && self.textures.are_mapped();
        if material.kind.name != "mirror" || material.mask.is_some() || is_bent {
            return None;
        }
        let corners = scene.triangles[triangle as usize].vertices;
        let corners = corners.map(|v| v.as_dvec3());
        let [a, b, c] = corners;
        let face = (b - a).cross(c - a).try_normalize()?;
        let is_mirrored = scene.is_mirrored(triangle as usize);
        let face = if is_mirrored { -face } else { face };
        let normals = match scene.normals.get(triangle as usize) {
            Some(words) => words.map(|word| decode_normal(word).unwrap_or(face)),
            None => [face; 3],
        };
        Some(Mirror {
            corners,
            normals: normals.map(|normal| walk.rounding.direction(normal)),
        })
    }

    /// What the path was before the mirror that it has met, if connections know of it.
    pub(super) fn before(
        &self,
        walk: &mut Walk,
        (ray, density): (&Segment, Option<f64>),
        surface: &Surface,
    ) -> Option<Before> {
        self.mirror(walk, surface.triangle)?;
        Some(Before {
            place: ray.place(),
            density: density?,
            triangle: surface.triangle,
            met: surface.position,
        })
    }

    /// Weight of emission found over a mirror at a point of a light, where the area has this cosine.
    pub(super) fn found_over_mirror(
        &self,
        walk: &mut Walk,
        before: &Before,
        (light, end, cosine): (usize, DVec3, f64),
        rules: &PathRules,
    ) -> f64 {
        let Some(mirror) = self.mirror(walk, before.triangle) else {
            return 1.0;
        };
        let end = walk.rounding.point(end, end.abs());
        let found = mirror.crossing([before.place.0, end]);
        let found = found.filter(|c| c.position.distance(before.met) <= SAME * mirror.edge());
        walk.decide(u64::from(found.is_some()));
        let Some(found) = found else {
            return 1.0;
        };
        let share = self.share(light, rules.choice, before.place, &mut walk.rounding);
        let other = share * found.spread / (self.lights.area(self.scene, light) * cosine);
        rules.strategy.found(Some(before.density), || other)
    }

    /// Light of a chosen lamp over all mirrors.
    pub(super) fn over_mirrors(
        &self,
        walk: &mut Walk,
        (surface, bsdf): (&Surface, &dyn Bsdf),
        depth: u32,
        (chosen, point): (&Chosen, [f64; 2]),
        rules: &PathRules,
    ) -> DVec3 {
        let mut sum = DVec3::ZERO;
        let Some(end) = self.lights.target(self.scene, chosen.light, point) else {
            return sum;
        };
        for triangle in 0..self.scene.triangles.len() as u32 {
            let Some(mirror) = self.mirror(walk, triangle) else {
                continue;
            };
            let end = walk.rounding.point(end, end.abs());
            let Some(found) = mirror.crossing([surface.position, end]) else {
                continue;
            };
            walk.decide(u64::from(triangle));
            let light = (chosen, point, end);
            let over = self.over_mirror(walk, (surface, bsdf), (triangle, &found), light, rules);
            if let Some((light, [to, away])) = over {
                // Numbers of the medium that no other shadow ray of the point has.
                let first = self.lights.count() + 2 * chosen.light;
                let passed = self.passes(walk, &to, depth, first)
                    * self.passes(walk, &away, depth, first + 1);
                sum += light * passed;
            }
        }
        sum
    }

    /// Over one of them, but for media, and both parts of the way; `None` if nothing arrives.
    fn over_mirror(
        &self,
        walk: &mut Walk,
        (surface, bsdf): (&Surface, &dyn Bsdf),
        (triangle, found): (u32, &Crossing),
        (chosen, point, end): (&Chosen, [f64; 2], DVec3),
        rules: &PathRules,
    ) -> Option<(DVec3, [Segment; 2])> {
        let direction = walk.rounding.direction(found.direction);
        let left = surface.leave(direction, &mut walk.rounding);
        let hit = Hit {
            triangle,
            distance: found.near,
            weights: found.weights,
        };
        let mirror = self.surface(&left, &hit, &mut walk.rounding);
        let light = self.seen_from(walk, &mirror, (chosen, point, end))?;
        let per_area = found.spread / (light.distance * light.distance);
        let reflected = bsdf.reflect(direction, &mut walk.rounding)?;
        let to = Segment {
            to: Some([triangle; 2]),
            ..ended(left, found.near, direction)
        };
        let blocked = self.shadowed(walk, &to, (chosen.light, false));
        walk.decide_blocked(blocked);
        if blocked != Blocked::No {
            return None;
        }
        let gone = mirror.leave(light.direction, &mut walk.rounding);
        let away = Segment {
            to: light.triangles,
            ..ended(gone, light.distance, light.direction)
        };
        let blocked = self.shadowed(walk, &away, (chosen.light, true));
        walk.decide_blocked(blocked);
        if blocked != Blocked::No {
            return None;
        }
        let own = light.density.unwrap_or(1.0) * per_area;
        let weight = match light.density {
            Some(_) => (rules.strategy).weight(chosen.share * own, reflected.density),
            None => 1.0,
        };
        let value = reflected.value * mirror.base * light.radiance;
        Some((value * (weight / (own * chosen.share)), [to, away]))
    }

    /// That point of the light from the mirror; spheres have them evenly over their area.
    fn seen_from(
        &self,
        walk: &mut Walk,
        mirror: &Surface,
        (chosen, point, end): (&Chosen, [f64; 2], DVec3),
    ) -> Option<LightSample> {
        let Some((centre, radius, radiance)) = self.lights.ball(self.scene, chosen.light) else {
            let (_, light) = self.light_sample(mirror, chosen, point, &mut walk.rounding);
            return light;
        };
        let towards = end - mirror.position;
        let distance = towards.length();
        let direction = towards / distance;
        let outward = (end - centre).dot(direction) / radius;
        let is_outside = mirror.position.distance(centre) > radius;
        let cosine = if is_outside { -outward } else { outward };
        (cosine > 0.0).then(|| LightSample {
            direction,
            distance,
            radiance,
            density: Some(distance * distance / (4.0 * PI * radius * radius * cosine)),
            triangles: None,
        })
    }
}

/// A ray that ends short of a point at this distance from where it starts on its surface.
fn ended(left: Segment, distance: f64, direction: DVec3) -> Segment {
    let towards = left.start + direction * distance - left.origin;
    let distance = towards.length();
    Segment {
        length: distance * (1.0 - SHORT),
        direction: towards / distance,
        ..left
    }
}

impl super::light::Lights {
    /// The sampled point of a light that connections know of.
    fn target(&self, scene: &SceneData, light: usize, [u, v]: [f64; 2]) -> Option<DVec3> {
        if let Some((centre, radius, _)) = self.ball(scene, light) {
            let z = 1.0 - 2.0 * u;
            let ring = (1.0 - z * z).max(0.0).sqrt();
            let (sin, cos) = (TAU * v).sin_cos();
            return Some(centre + radius * DVec3::new(ring * cos, ring * sin, z));
        }
        Some(match self.source(light) {
            Source::Triangle(id) => {
                let [a, b, c] = scene.triangles[id as usize].vertices.map(|v| v.as_dvec3());
                let root = u.sqrt();
                a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v)
            }
            Source::Parallelogram(of) => {
                let [x, y] = of.edges.map(|e| e.as_dvec3());
                of.corner.as_dvec3() + u * x + v * y
            }
            Source::Light(id) => match &scene.lights[id as usize] {
                Light::Point { position, .. }
                | Light::Spot { position, .. }
                | Light::Ies { position, .. } => position.as_dvec3(),
                _ => return None,
            },
        })
    }

    /// Centre, radius and radiance of a sphere.
    fn ball(&self, scene: &SceneData, light: usize) -> Option<(DVec3, f64, DVec3)> {
        let Source::Light(id) = self.source(light) else {
            return None;
        };
        let Light::Sphere {
            center,
            radius,
            radiance,
        } = &scene.lights[id as usize]
        else {
            return None;
        };
        Some((center.as_dvec3(), f64::from(*radius), radiance.as_dvec3()))
    }

    /// Area of a flat light or a sphere.
    fn area(&self, scene: &SceneData, light: usize) -> f64 {
        match self.ball(scene, light) {
            Some((_, radius, _)) => 4.0 * PI * radius * radius,
            None => self.flat_area(light),
        }
    }
}

impl PathRules {
    /// True if vertices are connected with lights over mirrors.
    pub(super) fn connects(&self) -> bool {
        self.is_connected && self.strategy != Strategy::Material
    }
}

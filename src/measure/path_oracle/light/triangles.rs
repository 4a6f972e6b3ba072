//! Emissive triangles, chosen in proportion to area times luminance; points on them evenly.

use super::LightSample;
use crate::measure::path_oracle::luminance;
use crate::measure::path_oracle::rounding::Rounding;
use crate::measure::path_oracle::surface::Surface;
use crate::measure::path_oracle::texture::Textures;
use crate::scene::SceneData;
use glam::DVec3;

pub(super) struct EmissiveTriangles {
    /// Triangle, and the share of the power of all up to it.
    rows: Vec<(u32, f64)>,
    power: f64,
}

impl EmissiveTriangles {
    pub fn new(scene: &SceneData) -> Self {
        let mut rows = Vec::new();
        let mut power = 0.0;
        for (id, triangle) in (0..).zip(&scene.triangles) {
            let material = scene.material_ids[id as usize] as usize;
            let emission = scene.materials[material].emission.as_dvec3();
            let [a, b, c] = triangle.vertices.map(|v| v.as_dvec3());
            let own = 0.5 * (b - a).cross(c - a).length() * luminance(emission);
            if own > 0.0 {
                power += own;
                rows.push((id, power));
            }
        }
        rows.iter_mut().for_each(|(_, sum)| *sum /= power);
        Self { rows, power }
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    pub fn sample(
        &self,
        (scene, textures): (&SceneData, &Textures),
        surface: &Surface,
        choice: f64,
        [u, v]: [f64; 2],
        rounding: &mut Rounding,
    ) -> Option<LightSample> {
        let choice = rounding.share(choice);
        let place = self.rows.partition_point(|(_, sum)| *sum <= choice);
        let (id, _) = *self.rows.get(place).or(self.rows.last())?;
        let material = scene.material_ids[id as usize] as usize;
        let material = &scene.materials[material];
        let radiance = material.emission.as_dvec3();
        let [a, b, c] = scene.triangles[id as usize].vertices.map(|v| v.as_dvec3());
        let root = u.sqrt();
        let point = a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v);
        let terms = a.abs() + b.abs() + c.abs();
        let to_light = rounding.point(point, terms) - surface.seen_from(rounding);
        let distance = to_light.length();
        let direction = to_light / distance;
        let normal = (b - a).cross(c - a).normalize();
        let away = normal.dot(direction);
        if away >= 0.0 && !material.emits_both_sides {
            return None;
        }
        let density = self.over_solid_angle(radiance, distance, away);
        let at = textures.coordinates(id, [root * (1.0 - v), root * v]);
        Some(LightSample {
            direction,
            distance,
            radiance: radiance * textures.colour(material.emission_texture, at),
            density,
            triangle: id,
        })
    }

    /// The share of a triangle in the choice over its area is its luminance over all power.
    fn over_solid_angle(&self, radiance: DVec3, distance: f64, cos: f64) -> f64 {
        luminance(radiance) / self.power * distance * distance / cos.abs()
    }

    pub fn density(&self, emitter: &Surface, distance: f64) -> f64 {
        let cos = emitter.geometric.dot(emitter.out);
        self.over_solid_angle(emitter.material.emission.as_dvec3(), distance, cos)
    }
}

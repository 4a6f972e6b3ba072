//! Surface properties at a hit.

use super::PathOracle;
use super::bsdf::Bsdf;
use super::hits::{Hit, Segment};
use super::rounding::Rounding;
use crate::materials::MaterialChecks;
use glam::DVec3;
use raystone_scene::{Material, decode_color, decode_normal};

/// Roundings of a point between the numbers in the file and a ray that leaves it. A kernel's bound
/// is eight roundings of the point and twice as many of the triangle's extent, by which the ray
/// starts off the surface: see [`raystone_render::offset::position_error`].
const OFFSET: f64 = 8.0;

/// Squared length below which corner normals cancel each other.
const LEAST_SQUARE: f64 = 1e-12;

/// A hit point.
pub struct Surface<'a> {
    /// The triangle index.
    pub triangle: u32,
    /// The position.
    pub position: DVec3,
    /// Direction back along the path.
    pub out: DVec3,
    /// Unit geometric normal on the side of `out`.
    pub geometric: DVec3,
    /// Unit shading normal on that side.
    pub normal: DVec3,
    /// 1 if that is the front of the triangle, otherwise -1.
    pub side: f64,
    /// The material.
    pub material: &'a Material,
    /// Base colour, with texture and vertex colours.
    pub base: DVec3,
    /// Factors of metalness and roughness.
    pub varied: [f64; 2],
    /// Radiance emitted towards `out`.
    pub emission: DVec3,
    pub(super) checks: &'static MaterialChecks,
    /// Ray offset from the surface for one rounding.
    offset: f64,
}

impl<'a> Surface<'a> {
    /// A point of the plane z = 0 seen from its front, without textures.
    pub(super) fn flat(
        checks: &'static MaterialChecks,
        material: &'a Material,
        out: DVec3,
    ) -> Self {
        Self {
            triangle: 0,
            position: DVec3::ZERO,
            out,
            geometric: DVec3::Z,
            normal: DVec3::Z,
            side: 1.0,
            material,
            base: material.base_color.as_dvec3(),
            varied: [1.0; 2],
            emission: DVec3::ZERO,
            checks,
            offset: 0.0,
        }
    }
}

impl<'a> Surface<'a> {
    /// A point in the medium of a scene, which belongs to no surface.
    pub(super) fn nowhere(oracle: &'a PathOracle, position: DVec3, out: DVec3) -> Self {
        let material = &oracle.scene.materials[0];
        Self {
            triangle: u32::MAX,
            position,
            geometric: DVec3::ZERO,
            normal: DVec3::ZERO,
            side: 0.0,
            ..Self::flat(oracle.materials[0], material, out)
        }
    }
}

impl Surface<'_> {
    pub(super) fn bsdf(&self) -> Box<dyn Bsdf + '_> {
        (self.checks.twin)(self)
    }

    /// The ray that leaves in this direction.
    pub(super) fn leave(&self, direction: DVec3, rounding: &mut Rounding) -> Segment {
        let side = direction.dot(self.geometric).signum();
        // A point in a medium has no side.
        let from = (self.side != 0.0).then_some(self.triangle);
        let off = self.geometric * (side * rounding.offset(self.offset));
        Segment {
            origin: self.position + off,
            normal: self.geometric,
            shift: rounding.texel(),
            ..Segment::endless(self.position, direction, from)
        }
    }
}

fn sign(is_positive: bool) -> f64 {
    if is_positive { 1.0 } else { -1.0 }
}

impl PathOracle<'_> {
    pub(super) fn surface(
        &self,
        segment: &Segment,
        hit: &Hit,
        rounding: &mut Rounding,
    ) -> Surface<'_> {
        let corners = self.scene.triangles[hit.triangle as usize].vertices;
        let [a, b, c] = corners.map(|v| v.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let terms = a.abs() + e1.abs() + e2.abs();
        let exact = a + e1 * hit.weights[0] + e2 * hit.weights[1];
        let position = rounding.point(exact, terms);
        let area = e1.cross(e2);
        // The error of a thin triangle's normal scales with edge lengths over height.
        let thinness = e1.length() * e2.length() / area.length();
        let outward = rounding.point(area.normalize(), DVec3::splat(thinness));
        let front = sign(!self.scene.is_mirrored(hit.triangle as usize));
        let outward = front * outward.normalize();
        let out = -segment.direction;
        let side = sign(outward.dot(out) > 0.0);
        let id = self.scene.material_ids[hit.triangle as usize];
        let material = &self.scene.materials[id as usize];
        // For a triangle that is thin, or small at large coordinates, weights err by the error of
        // the point over the height.
        let farthest = (terms + segment.origin.abs()).max_element();
        let [u, v] = hit.weights;
        let weights = [(u, e2), (v, e1)].map(|(w, across)| {
            let error = Rounding::of_weights(farthest * across.length(), area.length());
            rounding.weight(w, error)
        });
        let uv = self.textures.coordinates(hit.triangle, weights);
        let [colours, varied, bent, shining] = material.texture_uses();
        let base = material.base_color.as_dvec3() * self.textures.colour(colours, uv);
        let base = base * self.vertex_color(hit.triangle, weights);
        let varied = self.textures.numbers(varied, uv);
        let emission = material.emission.as_dvec3() * self.textures.colour(shining, uv);
        let geometric = side * outward;
        let mut normal = self.vertex_normal(hit.triangle, weights, outward);
        let turn = normal.dot(geometric) < 0.0;
        if let Some(used) = bent.filter(|_| self.textures.are_mapped()) {
            normal = self.textures.bent(used, hit.triangle, uv, normal);
        }
        normal *= sign(!turn);
        if normal.dot(out) <= 0.0 {
            normal = geometric;
        }
        let reach = geometric.abs().dot(terms) + 2.0 * (e1.abs() + e2.abs()).max_element();
        Surface {
            triangle: hit.triangle,
            position,
            out,
            geometric,
            normal,
            side,
            material,
            base,
            varied: [varied.z, varied.y],
            emission: if material.emits_both_sides || side > 0.0 {
                emission
            } else {
                DVec3::ZERO
            },
            checks: self.materials[id as usize],
            offset: OFFSET * reach,
        }
    }

    /// Interpolated vertex colour; white if there are none.
    fn vertex_color(&self, triangle: u32, [u, v]: [f64; 2]) -> DVec3 {
        let Some(words) = self.scene.colors.get(triangle as usize) else {
            return DVec3::ONE;
        };
        let [a, b, c] = words.map(decode_color);
        a * (1.0 - u - v) + b * u + c * v
    }

    /// Interpolated vertex normal; the triangle's, `outward`, if there are none.
    fn vertex_normal(&self, triangle: u32, [u, v]: [f64; 2], outward: DVec3) -> DVec3 {
        let Some(words) = self.scene.normals.get(triangle as usize) else {
            return outward;
        };
        let [a, b, c] = words.map(|word| decode_normal(word).unwrap_or(outward));
        let sum = a * (1.0 - u - v) + b * u + c * v;
        if sum.length_squared() > LEAST_SQUARE {
            sum.normalize()
        } else {
            outward
        }
    }
}

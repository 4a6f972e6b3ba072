//! Vertex normals: two 16-bit numbers each, octahedral. Twin: `kernels/shading/normals.wesl`.

use super::Transform;
use glam::{DMat3, DVec3, Vec3};
use raystone_core::geometry::Triangle;

/// Marks a corner that uses the triangle's normal. No encoded normal has these bits.
pub const GEOMETRIC: u32 = 0x8000_8000;

const LARGEST: f64 = 32_767.0;
/// Vertex normals with a larger cosine to the face normal are dropped: within a tenth of a degree.
const FLAT: f64 = 1.0 - 1e-6;

/// Two 16-bit numbers, x in the lower half: the direction divided by the sum of its absolute
/// components, with the lower half of the octahedron folded over the upper one (Q. Meyer et al.,
/// "On floating-point normal vectors", 2010). [`GEOMETRIC`] if `normal` is not a direction.
pub fn encode_normal(normal: Vec3) -> u32 {
    let n = normal.as_dvec3();
    let sum = n.abs().element_sum();
    if !(sum > 0.0 && sum.is_finite()) {
        return GEOMETRIC;
    }
    let (x, y) = (n.x / sum, n.y / sum);
    let (x, y) = if n.z < 0.0 {
        (
            (1.0 - y.abs()) * 1.0_f64.copysign(x),
            (1.0 - x.abs()) * 1.0_f64.copysign(y),
        )
    } else {
        (x, y)
    };
    let part = |x: f64| u32::from(((x * LARGEST).round() as i16).cast_unsigned());
    part(x) | part(y) << 16
}

/// Unit direction of [`encode_normal`]'s word; `None` for [`GEOMETRIC`].
pub fn decode_normal(word: u32) -> Option<DVec3> {
    if word == GEOMETRIC {
        return None;
    }
    let part = |bits: u32| f64::from((bits as u16).cast_signed());
    // In integers, so that points of the plane z = 0 stay there.
    let (x, y) = (part(word), part(word >> 16));
    let z = LARGEST - x.abs() - y.abs();
    let sign = |x: f64| if x >= 0.0 { 1.0 } else { -1.0 };
    let (x, y) = if z < 0.0 {
        ((LARGEST - y.abs()) * sign(x), (LARGEST - x.abs()) * sign(y))
    } else {
        (x, y)
    };
    Some(DVec3::new(x, y, z).normalize())
}

/// Encodes a triangle's corner normals; [`GEOMETRIC`] for a normal of zero length, and for all
/// three if they match the face normal.
pub(super) fn encode_corners(triangle: &Triangle, normals: [Vec3; 3]) -> [u32; 3] {
    let [a, b, c] = triangle.vertices.map(Vec3::as_dvec3);
    let face = (b - a).cross(c - a).normalize_or_zero();
    let is_flat = |normal: &Vec3| {
        let unit = normal.as_dvec3().normalize_or_zero();
        unit == DVec3::ZERO || unit.dot(face).abs() >= FLAT
    };
    if face == DVec3::ZERO || normals.iter().all(is_flat) {
        return [GEOMETRIC; 3];
    }
    normals.map(encode_normal)
}

/// The map of normals under a linear map: its inverse transpose, which keeps them perpendicular.
pub(super) fn of_normals(linear: DMat3) -> DMat3 {
    linear.inverse().transpose()
}

/// Re-encodes normals after a body has moved.
pub(super) fn moved(words: [u32; 3], from: &Transform, to: &Transform) -> [u32; 3] {
    // Back by the transpose, then forward.
    let back = from.parts().0.transpose();
    let on = of_normals(to.parts().0);
    words.map(|word| {
        let moved = decode_normal(word).map(|normal| (on * (back * normal)).normalize_or_zero());
        moved.map_or(GEOMETRIC, |normal| encode_normal(normal.as_vec3()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_come_back_within_the_rounding_of_sixteen_bits() {
        for k in 0..2000_u16 {
            let (z, angle) = (1.0 - f32::from(k) / 1000.0, 2.4 * f32::from(k));
            let (sin, cos) = angle.sin_cos();
            let normal = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
            let word = encode_normal(normal);
            assert_ne!(word, GEOMETRIC);
            let back = decode_normal(word).expect("a direction");
            assert!(back.distance(normal.as_dvec3()) < 1e-4, "{normal} {back}");
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for axis in [axis, -axis] {
                assert_eq!(decode_normal(encode_normal(axis)), Some(axis.as_dvec3()));
            }
        }
        for none in [Vec3::ZERO, Vec3::NAN, Vec3::splat(f32::INFINITY)] {
            assert_eq!(encode_normal(none), GEOMETRIC);
        }
    }

    #[test]
    fn normals_of_flat_triangles_are_left_out_whatever_their_sign_and_length() {
        let vertices = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let triangle = Triangle { vertices };
        let flat = [Vec3::Z, -2.0 * Vec3::Z, Vec3::ZERO];
        assert_eq!(encode_corners(&triangle, flat), [GEOMETRIC; 3]);
        let bent = encode_corners(&triangle, [Vec3::Z, Vec3::ONE, Vec3::ZERO]);
        assert_eq!((bent[0], bent[2]), (encode_normal(Vec3::Z), GEOMETRIC));
    }

    #[test]
    fn moved_normals_stay_perpendicular() {
        let to = Transform::new(
            [Vec3::X * 3.0, Vec3::Y, Vec3::new(0.5, 0.0, 1.0)],
            Vec3::ONE,
        );
        let slope = Vec3::new(1.0, 0.0, -1.0);
        let normal = Vec3::new(1.0, 0.0, 1.0);
        let words = moved([encode_normal(normal); 3], &Transform::IDENTITY, &to);
        let along = to.point(slope) - to.point(Vec3::ZERO);
        let found = decode_normal(words[0]).expect("a direction");
        assert!(found.dot(along.as_dvec3()).abs() < 1e-3, "{found}");
        let back = moved(words, &to, &Transform::IDENTITY);
        let back = decode_normal(back[0]).expect("a direction");
        assert!(back.distance(normal.as_dvec3().normalize()) < 2e-4);
    }
}

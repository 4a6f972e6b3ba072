//! Normals of known triangles under known maps, computed anew: rays show where a surface is, and not how it is lit.

use crate::Transform;
use crate::colors::shown;
use crate::known_lights;
use crate::known_scenes;
use crate::normals::{decode_normal, encode_normal, moved, of_normals};
use crate::reduce::{Texels, area_means, reduced};
use glam::{DMat3, DVec3, Vec3, Vec4};

/// Columns of maps: sheared; mirrored and stretched; both, and turned.
const MAPS: [[[f64; 3]; 3]; 3] = [
    [[1.0, 0.0, 0.0], [0.75, 1.0, 0.0], [-0.5, 0.25, 1.0]],
    [[-3.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]],
    [[0.5, 2.0, 0.25], [-1.0, 0.5, 0.75], [0.25, 1.5, -2.0]],
];
/// Edges of triangles from their first corner.
const EDGES: [[[f64; 3]; 2]; 2] = [
    [[1.0, 0.0, 0.5], [0.25, 1.0, 0.0]],
    [[0.0, 1.0, 0.25], [-1.0, 0.5, 1.0]],
];
/// Largest difference of unit vectors, and of those of sixteen bits.
const ROUNDING: f64 = 1e-12;
const OF_WORDS: f64 = 3e-4;
const OF_SINGLE: f64 = 1e-6;

/// Moves the normals, and compares them with those of the moved triangles.
///
/// # Errors
/// A normal is not perpendicular to its triangle, or points to the other side; or a colour is another.
pub fn check() -> Result<(), String> {
    colors()?;
    smaller()?;
    known_scenes::check()?;
    known_lights::check()?;
    for columns in MAPS {
        let map = DMat3::from_cols_array_2d(&columns);
        let columns = columns.map(|column| DVec3::from_array(column).as_vec3());
        let to = Transform::new(columns, Vec3::ONE);
        for edges in EDGES {
            let [along, across] = edges.map(DVec3::from_array);
            let before = along.cross(across).normalize();
            // The corners of a mirrored triangle turn the other way.
            let side = map.determinant().signum();
            let after = side * (map * along).cross(map * across).normalize();
            let word = encode_normal(before.as_vec3());
            let [word, ..] = moved([word; 3], &Transform::IDENTITY, &to);
            let found = (of_normals(map) * before).normalize();
            agree(found, after, ROUNDING)?;
            agree(decode_normal(word).unwrap_or_default(), after, OF_WORDS)?;
        }
    }
    Ok(())
}

/// Grey of the curve and of its straight part, and no more than white, by IEC 61966-2-1.
fn colors() -> Result<(), String> {
    let found = shown(Vec3::new(0.5, 0.03, 1.5)).as_dvec3();
    let expected = DVec3::new(0.214_041_140_482_232_55, 0.03 / 12.92, 1.0);
    let agrees = found.distance(expected) <= OF_SINGLE;
    agrees.then_some(()).ok_or_else(|| {
        format!(
            "the radiance of a known colour is {found}, and should be {expected}: this program lights surfaces wrongly; build it \
             anew, and report what stays wrong"
        )
    })
}

/// Images that are reduced: by IEC 61966-2-1 half of the light of white is byte 188 and a quarter byte 137, half of a number is
/// 127.5, a clear texel has no colour unless nothing reads its alpha, and a row of weight 3 counts three times.
fn smaller() -> Result<(), String> {
    let (black, white, clear) = ([0, 0, 0, 255], [255; 4], [255, 0, 0, 0]);
    let of = |texels: &[[u8; 4]], kind| reduced(texels, [2, 2], [1, 1], kind).concat();
    let rows = area_means(
        [1, 2],
        [1, 1],
        |row| Vec4::splat([1.0, 3.0][row]),
        |row| [1.0, 3.0][row as usize],
    );
    let found = (
        of(&[black, white, white, black], Texels::Colours),
        of(&[white, clear, clear, white], Texels::Colours),
        of(&[black, clear, white, black], Texels::Opaque),
        of(&[black, white, white, black], Texels::Numbers),
        rows[0].x,
    );
    let expected = (
        vec![188, 188, 188, 255],
        vec![255, 255, 255, 128],
        vec![188, 137, 137, 255],
        vec![128, 128, 128, 255],
        2.5,
    );
    (found == expected).then_some(()).ok_or_else(|| {
        format!(
            "known texels are reduced to {found:?}, and should be to {expected:?}: this program shows other textures; build it anew, and \
             report what stays wrong"
        )
    })
}

fn agree(found: DVec3, expected: DVec3, tolerance: f64) -> Result<(), String> {
    let agrees = found.distance(expected) <= tolerance;
    agrees.then_some(()).ok_or_else(|| {
        format!(
            "the normal of a known triangle is {found}, and should be {expected}: this program lights surfaces wrongly; \
             build it anew, and report what stays wrong"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_perpendicular_and_those_of_points_are_not() {
        assert_eq!(check(), Ok(()));
        for columns in MAPS {
            let map = DMat3::from_cols_array_2d(&columns);
            for edges in EDGES {
                let [along, across] = edges.map(DVec3::from_array);
                let before = along.cross(across).normalize();
                let wrong = (map * before).normalize();
                let after = (of_normals(map) * before).normalize();
                assert!(agree(wrong, after, OF_WORDS).is_err(), "{map}");
                assert!(agree(-after, after, OF_WORDS).is_err(), "{map}");
            }
        }
    }
}

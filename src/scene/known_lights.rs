//! Areas and powers of known lights, and weights of a known map: kernels and oracles choose lights by the same list, so
//! a wrong power makes an image noisier and no path wrong, and a wrong area makes both wrong alike.

use crate::known_scenes::{Known, with};
use crate::{EnvironmentMap, Light, LightList, Material, SceneData, Source};
use glam::{Vec3, vec3};
use raystone_core::geometry::Triangle;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_3};
use std::f64::consts::{PI, SQRT_2};
use std::sync::Arc;

/// Luminance of red, green and blue by ITU-R BT.709, which others round to other digits.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];
/// Relative error of a power for these digits.
const OF_DIGITS: f64 = 1e-3;
/// Relative error of an area, and of a sum of single floats.
const ROUNDING: f64 = 1e-5;
/// Half the diagonal of the box around the known triangles, 4 along each axis, squared.
const RADIUS_SQUARED: f64 = 12.0;

/// Lists them.
///
/// # Errors
/// A value is not what it should be: which, and both values.
pub(crate) fn check() -> Result<(), String> {
    let scene = scene()?;
    let list = LightList::of(&scene);
    let found = list.lights.iter().map(|light| [light.area, light.power]);
    let expected = expected();
    if found.len() != expected.len() {
        return wrong(
            "number of lights",
            found.len() as f64,
            expected.len() as f64,
        );
    }
    for ([area, power], (what, its_area, its_power)) in found.zip(expected) {
        agree(what, area, its_area, ROUNDING)?;
        agree(what, power, its_power, OF_DIGITS)?;
    }
    if !matches!(list.lights[0].source, Source::Parallelogram(of) if of.triangles == [0, 1]) {
        return wrong("parallelograms among lights", 0.0, 1.0);
    }
    for (what, found, expected) in weights()? {
        agree(what, found, expected, OF_DIGITS)?;
    }
    Ok(())
}

/// A slanted parallelogram of area |(2, 0, 0) × (1, 0, 3)| = 6, a triangle of area 2 that shines on both sides, a dark one
/// across the box, and a light of each kind.
fn scene() -> Result<SceneData, String> {
    let mut scene = with(&[])?;
    let lamp = |name, radiance, emits_both_sides| Material {
        emits_both_sides,
        ..Material::diffuse(name, Vec3::ZERO).emitting(radiance)
    };
    scene.materials = vec![
        lamp("lamp", vec3(1.0, 2.0, 4.0), false),
        lamp("sheet", vec3(0.0, 5.0, 0.0), true),
        Material::diffuse("dark", Vec3::ONE),
    ];
    let at = [
        [[0.5, 1.0, -1.5], [2.5, 1.0, -1.5], [3.5, 1.0, 1.5]],
        [[0.5, 1.0, -1.5], [3.5, 1.0, 1.5], [1.5, 1.0, 1.5]],
        [[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 5.0, 0.0]],
        [[0.0, 1.0, -2.0], [4.0, 5.0, 2.0], [4.0, 1.0, -2.0]],
    ];
    scene.triangles = at
        .map(|corners| Triangle::from(corners.map(Vec3::from)))
        .to_vec();
    scene.material_ids = vec![0, 0, 1, 2];
    scene.lights = lights()?;
    Ok(scene)
}

/// Not in the order of the list, in which those at infinity are the last.
fn lights() -> Result<Vec<Light>, String> {
    let place = vec3(2.0, 3.0, 0.0);
    let spot = |decay| Light::Spot {
        position: place,
        direction: Vec3::NEG_Y,
        intensity: Vec3::ONE,
        inner: FRAC_PI_3,
        outer: FRAC_PI_2,
        decay,
    };
    Ok(vec![
        Light::Environment {
            map: Arc::new(map(|_| 1.0)?),
            scale: 0.5,
            turn: 1.0,
        },
        Light::Directional {
            direction: Vec3::NEG_Y,
            irradiance: vec3(0.0, 0.0, 7.0),
        },
        spot(true),
        spot(false),
        Light::Point {
            position: place,
            intensity: vec3(3.0, 0.0, 0.0),
        },
        Light::Sphere {
            center: place,
            radius: 0.5,
            radiance: vec3(0.0, 0.0, 2.0),
        },
    ])
}

/// Area and power of each, in the order of the list: π L A of a side; π L 4πr²; 4π I; of a spot 2π (1 − cos 60°) I and a third
/// of 2π cos 60° I, the mean square of its ramp; at infinity what a disk across the scene gets, of the map π · 4π · ½.
fn expected() -> [(&'static str, f64, f64); 8] {
    let [red, green, blue] = LUMINANCE;
    let disk = PI * RADIUS_SQUARED;
    let spot = 2.0 * PI * (0.5 + 0.5 / 3.0);
    let white = red + 2.0 * green + 4.0 * blue;
    [
        ("parallelogram", 6.0, PI * 6.0 * white),
        ("sheet", 2.0, 2.0 * PI * 2.0 * 5.0 * green),
        ("sphere", 0.0, PI * 2.0 * blue * PI),
        ("point", 0.0, 4.0 * PI * 3.0 * red),
        ("spot", 0.0, spot),
        ("spot without decay", 0.0, spot * RADIUS_SQUARED),
        ("parallel light", 0.0, disk * 7.0 * blue),
        ("map", 0.0, disk * 4.0 * PI * 0.5),
    ]
}

/// Four by four texels, by their number.
fn map(radiance: impl Fn(usize) -> f32) -> Result<EnvironmentMap, String> {
    let texels = (0..16).map(|texel| Vec3::splat(radiance(texel))).collect();
    EnvironmentMap::new("a known map", [4, 4], texels, &mut Vec::new()).map_err(|e| e.to_string())
}

/// Of a map that is dark but for a texel of radiance 1 in its second row: linear from middle to middle, the mean over the
/// texel is (3/4)², beside it 3/4 · 1/8 and at a corner of it 1/64. A quarter of a row at a pole has π/2 (1 − √½), of the next
/// one π/2 · √½.
fn weights() -> Result<[Known; 5], String> {
    let weights = map(|texel| f32::from(u8::from(texel == 4)))?.weights();
    let of_row = [PI / 2.0 * (1.0 - SQRT_2 / 2.0), PI / 2.0 * SQRT_2 / 2.0];
    Ok([
        ("weight of a texel", weights[4], 9.0 / 16.0 * of_row[1]),
        ("weight beside it", weights[5], 3.0 / 32.0 * of_row[1]),
        ("weight around the map", weights[7], 3.0 / 32.0 * of_row[1]),
        ("weight at its corner", weights[1], of_row[0] / 64.0),
        ("weight below it", weights[8], 3.0 / 32.0 * of_row[1]),
    ])
}

fn agree(what: &str, found: f64, expected: f64, tolerance: f64) -> Result<(), String> {
    let agrees = (found - expected).abs() <= tolerance * expected.abs();
    if agrees {
        return Ok(());
    }
    wrong(what, found, expected)
}

fn wrong(what: &str, found: f64, expected: f64) -> Result<(), String> {
    Err(format!(
        "the area, power or share of a known light ({what}) is {found}, and should be {expected}: this program chooses lights \
         wrongly; build it anew, and report what stays wrong"
    ))
}

#[cfg(test)]
mod tests {
    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(super::check(), Ok(()));
    }
}

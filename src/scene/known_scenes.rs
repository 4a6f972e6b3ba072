//! Known scenes and texts, read anew before anything is rendered: kernels and oracles start from the same scene, and say
//! nothing of what a file or a parameter means.

use crate::ies::IesProfile;
use crate::known_files;
use crate::material::reflectance_of_ior;
use crate::mtl_statements::{Definition, read};
use crate::tally::Unread;
use crate::{LoadOptions, SceneData, load};
use glam::{DVec3, Vec3};
use raystone_core::params::{ParamValue, Params, Variant};
use raystone_core::random::Pcg32;

/// A value by name, and what it should be.
pub(crate) type Known = (&'static str, f64, f64);

/// Relative error of sums in f32.
const ROUNDING: f64 = 1e-5;

/// Of 50 cd times a multiplier of 2.5 and a ballast of 0.8, straight down twice as much as to the sides, all around.
const LUMINAIRE: &str =
    "IESNA:LM-63-2002\nTILT=NONE\n1 1000 2.5 3 1 1 2 0 0 0\n0.8 1 40\n0 90 180\n0\n100 50 50\n";
/// A quarter of a luminaire, in planes at 0°, 30° and 90°: what is not measured is its mirror image.
const QUARTER: &str = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 2 3 1 2 0 0 0\n1 1 40\n0 90\n0 30 90\n5 10\n5 20\n5 40\n";
const LIBRARY: &str = "newmtl a\nTr .25\nNs 30\nnewmtl b\nd .25\nNi 1.5\nKd .1 .2 .3\n";

/// Reads them.
///
/// # Errors
/// A value is not what it should be: which, and both values.
pub(crate) fn check() -> Result<(), String> {
    let all = luminaire()?
        .into_iter()
        .chain(quarter()?)
        .chain(library())
        .chain(direction())
        .chain(parameters()?)
        .chain(known_files::values()?);
    for (what, found, expected) in all {
        let agrees = (found - expected).abs() <= ROUNDING * expected.abs().max(1.0);
        if !agrees {
            return Err(format!(
                "the {what} of a known scene is {found}, and should be {expected}: this program reads scenes wrongly; build \
                 it anew, and report what stays wrong"
            ));
        }
    }
    Ok(())
}

/// Its intensities, and its flux: 2π ∫ I sin θ dθ, of 100 below the sides 4π · 100, and what is straight down beyond them
/// 2π · 100 (1 − 2 / π), since ∫ (1 − 2θ/π) sin θ dθ from 0 to π / 2 is 1 − 2 / π.
fn luminaire() -> Result<[Known; 4], String> {
    let profile = IesProfile::parse("a known luminaire", LUMINAIRE).map_err(|e| e.to_string())?;
    let at = |x: f64, y: f64, z: f64| profile.intensity(DVec3::new(x, y, z).normalize());
    let tau = std::f64::consts::TAU;
    Ok([
        // Straight down is the luminaire's z axis.
        ("greatest intensity", at(0.0, 0.0, 1.0), 200.0),
        ("intensity of a side", at(1.0, 0.0, 0.0), 100.0),
        (
            "factor of a luminaire",
            f64::from(profile.candela[2]),
            100.0,
        ),
        (
            "flux of a luminaire",
            profile.lumens(),
            tau * (200.0 + 100.0 * (1.0 - 2.0 / std::f64::consts::PI)),
        ),
    ])
}

/// To the sides, at these angles.
fn quarter() -> Result<[Known; 6], String> {
    let profile = IesProfile::parse("a quarter", QUARTER).map_err(|e| e.to_string())?;
    let at = |degrees: f64| {
        let (y, x) = degrees.to_radians().sin_cos();
        profile.intensity(DVec3::new(x, y, 0.0))
    };
    let of = |(degrees, expected)| ("intensity of a mirrored side", at(degrees), expected);
    Ok([
        (30.0, 20.0),
        (150.0, 20.0),
        (180.0, 10.0),
        (210.0, 20.0),
        (270.0, 40.0),
        (345.0, 15.0),
    ]
    .map(of))
}

/// Materials of a library: `Tr` is what `d` lacks, and a lobe's exponent n has a Beckmann roughness of √(2 / (n + 2)),
/// of which glTF's is the root.
fn library() -> Vec<Known> {
    let materials = read(LIBRARY, &mut Unread::default());
    let of = |name: &str, value: fn(&Definition) -> Option<f32>| {
        let found = materials.iter().find(|material| material.name == name);
        found.and_then(value).map_or(f64::NAN, f64::from)
    };
    vec![
        ("opacity of `Tr`", of("a", |m| m.source.opacity), 0.75),
        ("opacity of `d`", of("b", |m| m.source.opacity), 0.25),
        ("roughness of `Ns`", of("a", |m| m.source.roughness), 0.5),
        ("index of `Ni`", of("b", |m| m.source.ior), 1.5),
        ("blue of `Kd`", of("b", |m| m.diffuse.map(|c| c[2])), 0.3),
        (
            "reflectance of glass",
            f64::from(reflectance_of_ior(1.5)),
            0.04,
        ),
    ]
}

pub(crate) fn with(parameters: &[(&str, ParamValue)]) -> Result<SceneData, String> {
    let parameters = parameters
        .iter()
        .map(|(name, value)| ((*name).to_owned(), value.clone()));
    let variant = Variant {
        name: "single-triangle".to_owned(),
        params: Params(parameters.collect()),
        ..Variant::default()
    };
    load(&variant, &LoadOptions::default()).map_err(|e| e.to_string())
}

/// Power of the lamps of a scene, but for a factor: emission times area.
fn power(scene: &SceneData) -> f64 {
    let of = |k: usize| {
        let emission = scene.materials[scene.material_ids[k] as usize].emission;
        let [a, b, c] = scene.triangles[k].vertices.map(Vec3::as_dvec3);
        0.5 * (b - a).cross(c - a).length() * f64::from(emission.x)
    };
    (0..scene.triangles.len()).map(of).sum()
}

/// How far from the middle of an image, along the axis that it fills, the vertices of a scene without a camera are.
fn filled() -> Result<f64, String> {
    const ASPECT: f32 = 1.5;
    let mut scene = with(&[])?;
    (scene.camera, scene.framing) = (None, None);
    let camera = scene.view(ASPECT);
    let eye = camera.eye.as_dvec3();
    let forward = (camera.target.as_dvec3() - eye).normalize();
    let right = forward.cross(camera.up.as_dvec3()).normalize();
    let up = right.cross(forward);
    let half = (0.5 * f64::from(camera.vertical_fov_degrees).to_radians()).tan();
    let place = |v: Vec3| {
        let to = v.as_dvec3() - eye;
        let [x, y] = [right, up].map(|axis| (to.dot(axis) / to.dot(forward) / half).abs());
        y.max(x / f64::from(ASPECT))
    };
    let vertices = scene.triangles.iter().flat_map(|t| t.vertices);
    Ok(vertices.map(place).fold(0.0, f64::max))
}

/// A direction of the generator in the author's example (pcg32-demo, seed 42, stream 54), whose second and third words are 0x7b47f409 and
/// 0xba1d3330: z = 2 · 0x7b47f409 / 2³² − 1, turned by 0xba1d3330 / 2³² of a circle.
fn direction() -> [Known; 3] {
    let mut random = Pcg32::with_stream(42, 54);
    random.next_u32();
    let found = random.direction();
    [
        ("x of a random direction", found.x, -0.143_862_827_904),
        ("y of a random direction", found.y, -0.988_910_681_546),
        ("z of a random direction", found.z, -0.036_866_660_696),
    ]
}

/// What parameters of every scene do.
fn parameters() -> Result<[Known; 9], String> {
    let lamps = |count: i64| with(&[("hung_lamps", ParamValue::Integer(count))]);
    let [one, eight] = [power(&lamps(1)?), power(&lamps(8)?)];
    let number = ParamValue::Number;
    let fog = with(&[
        ("medium", ParamValue::Name("constant".to_owned())),
        ("scattering", number(0.75)),
        ("absorption", number(0.25)),
        (
            "more_media",
            ParamValue::Name("{ medium = 'constant', scattering = 0.5 }".to_owned()),
        ),
    ])?;
    let beside = fog.media.get(1).map(|medium| &medium.volume.scattering);
    let volume = fog.media.first().map(|medium| &medium.volume);
    let first = |of: Option<&Vec<f32>>| {
        of.and_then(|all| all.first())
            .map_or(f64::NAN, |x| f64::from(*x))
    };
    let copies = with(&[("copies", ParamValue::Integer(3))])?;
    let placed = copies.assembly.as_ref().map(|a| a.instances());
    let place = |k: usize| Some(placed?.get(k)?.to_world.point(Vec3::ZERO));
    let apart = place(0)
        .zip(place(1))
        .map(|(a, b)| f64::from(a.distance(b)));
    let single = with(&[])?;
    let its = copies
        .material_ids
        .iter()
        .filter(|id| **id == single.material_ids[0]);
    Ok([
        ("part of an image that a scene fills", filled()?, 0.9),
        ("power of eight hung lamps", eight / one, 1.0),
        (
            "number of triangles with eight lamps",
            lamps(8)?.triangles.len() as f64,
            17.0,
        ),
        (
            "scattering of a medium",
            first(volume.map(|v| &v.scattering)),
            0.75,
        ),
        (
            "absorption of a medium",
            first(volume.map(|v| &v.absorption)),
            0.25,
        ),
        ("scattering of a medium beside it", first(beside), 0.5),
        // Corners turn at √½ about its middle, and a fiftieth is between.
        (
            "distance of copies",
            apart.unwrap_or(f64::NAN),
            1.02 * std::f64::consts::SQRT_2,
        ),
        ("copies of a material", its.count() as f64, 3.0),
        (
            "number of triangles of copies",
            copies.triangles.len() as f64,
            5.0,
        ),
    ])
}

#[cfg(test)]
mod tests {
    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(super::check(), Ok(()));
    }
}

//! Built-in scenes with their defaults against what is known of them: kernels, oracles and all structures start from the same
//! triangles, and say nothing of a wall that stands elsewhere or has another colour.

use raystone_core::params::Variant;
use raystone_scene::{LoadOptions, SceneData, builtin_scenes, load};

/// Triangles; sums over them of the area, of the area times x + 2y + 3z of the middle, and of red + 2 green + 3 blue of colour and
/// emission; and x + 2y + 3z of the eye.
type Sums = [f64; 6];

/// By hand: the lamp of the Cornell box has 130 × 105 mm² of (18.4, 15.6, 8), so 13,650 · 73.6, and the eye of its data is at
/// (278, 273, −800); the furnace is a unit cube of ½ that emits ½; the lamp of `lamp` is a unit square of 10 over 4 × 4 of ½. The others were computed once by another program from the
/// meshes that `raystone export --to mitsuba` writes.
const KNOWN: [(&str, Sums); 15] = [
    (
        "cornell-box",
        [
            38.0,
            1_920_695.7,
            3.377_228_61e9,
            6_158_370.87,
            1_004_640.0,
            -1576.0,
        ],
    ),
    (
        "displaced-sphere",
        [
            100_000.0,
            16.212_369_2,
            -0.335_950_122,
            68.091_950_7,
            0.0,
            12.0,
        ],
    ),
    (
        "instances",
        [
            20_480.0,
            19.668_398_9,
            58.666_136_4,
            59.129_187_6,
            0.0,
            11.8,
        ],
    ),
    ("furnace-box", [12.0, 6.0, 18.0, 18.0, 18.0, 1.7]),
    (
        "triangle-soup",
        [
            10_000.0,
            3.803_274_88,
            11.353_208_3,
            11.007_103_7,
            0.0,
            11.8,
        ],
    ),
    (
        "city",
        [59_688.0, 29_844.0, 201_148.0, 75_268.32, 0.0, 378.160_009],
    ),
    (
        "hairball",
        [
            60_000.0,
            16.065_359_2,
            -0.262_757_984,
            39.174_855_2,
            0.0,
            9.9,
        ],
    ),
    ("lamp", [4.0, 17.0, 4.0, 48.0, 60.0, 12.4]),
    ("fog", [58.0, 208.64, 170.176, 709.28, 24.959_998_9, 23.1]),
    (
        "caustics",
        [
            484.0,
            11.489_829_9,
            7.397_663_99,
            40.431_581_5,
            38.197_183_3,
            10.0,
        ],
    ),
    (
        "many-lights",
        [
            498.0,
            479.791_583,
            271.646_053,
            1_425.192_33,
            459.458_99,
            62.0,
        ],
    ),
    (
        "single-triangle",
        [1.0, 0.866_025_404, 1.732_050_81, 2.598_076_21, 0.0, 12.0],
    ),
    (
        "far-corners",
        [9132.0, 1_181.785_54, -205_361.21, 2_910.931_91, 0.0, 15.7],
    ),
    (
        "white-furnace",
        [3968.0, 12.541_153_5, 0.0, 75.246_921_1, 0.0, 9.0],
    ),
    (
        "teapot-in-a-stadium",
        [
            37_040.0,
            175_217_755.0,
            101_791_258_000.0,
            439_604_342.0,
            0.0,
            33.9,
        ],
    ),
];
/// Difference of a sum, as a part of that of all absolute terms: single floats, by sines of any library.
const ROUNDING: f64 = 1e-5;
const OF: [&str; 6] = [
    "number of triangles",
    "area",
    "moment of the area",
    "colour",
    "emission",
    "place of the eye",
];

/// What is wrong with a scene; `None` if nothing is, or nothing is known of it.
pub(super) fn fault(variant: &Variant, scene: &SceneData) -> Option<String> {
    let (_, known) = (KNOWN.iter()).find(|(name, _)| *name == variant.label)?;
    let (found, sizes) = sums(scene);
    let wrong = (0..known.len()).find(|k| {
        let agrees = (found[*k] - known[*k]).abs() <= ROUNDING * sizes[*k];
        !agrees
    })?;
    Some(format!(
        "the {} of the built-in scene `{}` is {}, and should be {}: figures on it mean nothing; build the program anew, and \
         report what stays wrong",
        OF[wrong], variant.label, found[wrong], known[wrong]
    ))
}

/// Triangles of a scene up to which it is loaded before any is asked for.
const SMALL: f64 = 1000.0;

/// Loads the small ones of them.
///
/// # Errors
/// What is wrong with one.
pub(super) fn check() -> Result<(), String> {
    let small = KNOWN.iter().filter(|(_, sums)| sums[0] < SMALL);
    small.into_iter().try_for_each(|(name, _)| {
        let (variant, scene) = default(name)?;
        fault(&variant, &scene).map_or(Ok(()), Err)
    })
}

fn default(name: &str) -> Result<(Variant, SceneData), String> {
    let entry = builtin_scenes()
        .into_iter()
        .find(|entry| entry.name == name);
    let variant = entry
        .ok_or_else(|| format!("there is no scene `{name}`"))?
        .default_variant();
    let scene = load(&variant, &LoadOptions::default()).map_err(|e| e.to_string())?;
    Ok((variant, scene))
}

/// The sums, and those of absolute terms.
fn sums(scene: &SceneData) -> (Sums, Sums) {
    let weigh = |v: glam::DVec3| v.x + 2.0 * v.y + 3.0 * v.z;
    let (mut found, mut sizes) = ([0.0; 6], [0.0; 6]);
    let mut add = |k: usize, term: f64| {
        found[k] += term;
        sizes[k] += term.abs();
    };
    for (triangle, id) in scene.triangles.iter().zip(&scene.material_ids) {
        let [a, b, c] = triangle.vertices.map(|v| v.as_dvec3());
        let area = 0.5 * (b - a).cross(c - a).length();
        let material = &scene.materials[*id as usize];
        add(0, 1.0);
        add(1, area);
        add(2, area * weigh((a + b + c) / 3.0));
        add(3, area * weigh(material.base_color.as_dvec3()));
        add(4, area * weigh(material.emission.as_dvec3()));
    }
    if let Some(camera) = scene.camera {
        add(5, weigh(camera.eye.as_dvec3()));
    }
    (found, sizes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_scenes_are_as_known_and_one_that_is_changed_is_told() {
        for (name, _) in KNOWN {
            let (variant, mut scene) = default(name).expect("a scene");
            assert_eq!(fault(&variant, &scene), None);
            // The walls of the stadium are thousands of units long, and its sums as much larger.
            let moved = if name == "teapot-in-a-stadium" {
                1e6
            } else {
                1.0
            };
            scene.triangles[0].vertices[1].z += moved;
            assert!(fault(&variant, &scene).is_some(), "{name}");
        }
    }
}

//! Selection frequency of lights and map texels over all draws, against their probability.

use super::density::{CHOSEN, images, probing};
use super::lamp;
use glam::Vec3;
use raystone::gpu::{Gpu, KernelLibrary};
use raystone::random::Pcg32;
use raystone::scene::{EnvironmentMap, Light, SceneData};
use std::sync::Arc;

/// Number of possible draws, in images of 2²⁰ pixels.
const VALUES: usize = 1 << 24;
const EDGE: u32 = 1 << 10;
const SEEDS: [u32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Points above and below a floor, some ten thousand times as bright as others.
fn points(count: usize, directional: usize) -> SceneData {
    let mut random = Pcg32::new(17);
    let mut scene = lamp("point");
    let mut intensity = move || Vec3::splat(random.uniform().powi(8).max(1e-7) as f32);
    scene.lights = (0..directional)
        .map(|_| Light::Directional {
            direction: Vec3::NEG_Y,
            irradiance: intensity(),
        })
        .collect();
    let mut random = Pcg32::new(18);
    let point = |_| Light::Point {
        position: (3.0 * random.in_cube()).as_vec3(),
        intensity: intensity(),
    };
    scene.lights.extend((0..count).map(point));
    scene
}

/// The fault in a choice among these lights, if any.
pub fn fault_of_lights(gpu: &Gpu, choice: usize, scene: SceneData, never: bool) -> Option<String> {
    let lights = scene.lights.len();
    let (mut found, mut said) = (vec![0_usize; lights], vec![None; lights]);
    let (mut told, mut others) = (Vec::new(), None);
    images(gpu, scene, &CHOSEN[choice], EDGE, 1, &SEEDS, |image| {
        if told.is_empty() {
            told = image[..lights].iter().map(|pixel| pixel[2]).collect();
        }
        for [light, probability, _] in image.iter().filter(|pixel| pixel[1] > 0.0) {
            found[*light as usize] += 1;
            let before = said[*light as usize].replace(*probability);
            if before.is_some_and(|before| before != *probability) {
                others = Some(format!("light {light}: {before:?} and {probability}"));
            }
        }
    });
    if others.is_some() {
        return others;
    }
    let mut wrong = Vec::new();
    for (light, count) in found.iter().enumerate() {
        let exact = *count as f32 / VALUES as f32;
        let stated = [told[light], said[light].unwrap_or_default()];
        if stated != [exact; 2] || (*count == 0 && !never) {
            wrong.push(format!(
                "light {light}: chosen by {exact}, said to be {stated:?}"
            ));
        }
    }
    if let Some(first) = wrong.first() {
        let all = wrong.len();
        return Some(format!("{all} of {lights} lights, the first: {first}"));
    }
    None
}

/// The fault in the choice of texels of a map whose rows differ by a factor of a million, if any.
pub fn fault_of_texels(gpu: &Gpu) -> Option<String> {
    let [width, height] = [300, 1000];
    let mut random = Pcg32::new(3);
    let texels = (0..width * height).map(|k| {
        let row = if k / width % 3 == 1 { 1e-6 } else { 1.0 };
        Vec3::splat((row * random.uniform().powi(6)) as f32)
    });
    let map = EnvironmentMap::new(
        "map",
        [width as u32, height as u32],
        texels.collect(),
        &mut Vec::new(),
    );
    let mut scene = lamp("point");
    scene.lights = vec![Light::Environment {
        map: Arc::new(map.expect("a map")),
        scale: 1.0,
        turn: 0.0,
    }];
    let (mut rows, mut columns) = (vec![0.0; height], vec![0.0; width]);
    let mut stated = Vec::new();
    images(gpu, scene, &CHOSEN[POWER], EDGE, 1, &SEEDS, |image| {
        for [row, column, _] in image {
            rows[*row as usize] += 1.0 / VALUES as f64;
            columns[*column as usize] += 1.0 / VALUES as f64;
        }
        let texels = &image[..width * height];
        stated = texels.iter().map(|pixel| f64::from(pixel[2])).collect();
    });
    let differs = |a: f64, b: f64| (a / b - 1.0).abs() > 1e-6;
    for (row, found) in rows.iter().enumerate() {
        let said: f64 = stated[row * width..][..width].iter().sum();
        if *found == 0.0 || differs(*found, said) {
            return Some(format!("row {row}: chosen by {found}, said to be {said}"));
        }
    }
    let middle = height / 2;
    for (column, found) in columns.iter().enumerate() {
        let said = stated[middle * width + column] / rows[middle];
        if *found == 0.0 || differs(*found, said) {
            return Some(format!(
                "column {column}: chosen by {found}, said to be {said}"
            ));
        }
    }
    None
}

/// By power, uniformly, by a tree.
const POWER: usize = 0;
const EVENLY: usize = 1;
const TREE: usize = 2;

#[test]
fn every_light_is_chosen_by_exactly_as_many_values_as_its_probability_says() {
    let gpu = probing(KernelLibrary::default());
    let fault = |choice, scene, never| fault_of_lights(&gpu, choice, scene, never);
    assert_eq!(fault(POWER, points(100_000, 0), false), None);
    assert_eq!(fault(EVENLY, points(1999, 1), false), None);
    // Those below the floor cannot light it.
    assert_eq!(fault(TREE, points(300, 3), true), None);
    assert_eq!(fault(TREE, points(0, 3), false), None);
}

#[test]
fn every_texel_of_a_map_is_chosen_as_often_as_its_probability_says() {
    assert_eq!(fault_of_texels(&probing(KernelLibrary::default())), None);
}

#[test]
fn choices_that_differ_from_their_probability_are_seen() {
    let tree = |from: &str, to: &str| {
        let kernels = crate::support::kernels_with("shading/light/tree", &[(from, to)]);
        fault_of_lights(&probing(kernels), TREE, points(40, 1), true)
    };
    // The position within a part, rescaled to a 24-bit number and reused.
    let again = tree(
        "units = part;\n            links = left;",
        "rest = u32(f32(rest) / f32(part) * f32(units));\n            units = part;\n            links = left;",
    );
    assert!(again.is_some());
    let kernels = crate::support::kernels_with(
        "shading/light/environment",
        &[(
            "let number = unit_number(u);",
            "let number = unit_number(u) & ~4095u;",
        )],
    );
    assert!(fault_of_texels(&probing(kernels)).is_some());
}

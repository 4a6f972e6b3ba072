//! Faults planted in the kernels of lights, and the checks that must detect them.

use super::{density, environment, files, irradiance, means};
use crate::support::*;
use density::probing;

/// The check that detects a fault.
enum Seen {
    /// Irradiance below this lamp, with this strategy.
    Irradiance(&'static str, &'static str),
    Density(&'static str),
    Environment,
    Flux,
    /// The mean with this choice of lights.
    Mean(&'static str, &'static str),
}

use Seen::{Density, Environment, Flux, Irradiance, Mean};

const FAULTS: &[(&str, &str, &str, Seen)] = &[
    (
        "flat",
        "light.a.xyz + point.x * light.b.xyz",
        "light.a.xyz + point.x * point.x * light.b.xyz",
        Irradiance("rectangle", "light"),
    ),
    (
        "flat",
        "squared / (cos_light * point.area)",
        "1.004 * squared / (cos_light * point.area)",
        Irradiance("rectangle", "light"),
    ),
    (
        "flat",
        "let front = -dot(point.normal, direction);",
        "let front = dot(point.normal, direction);",
        Irradiance("rectangle", "light"),
    ),
    (
        "flat",
        "distance * distance / (light.a.w *",
        "distance * distance / (2.0 * light.a.w *",
        Density("rectangle"),
    ),
    (
        "flat",
        "let root = sqrt(point.x);",
        "let root = point.x;",
        Irradiance("disk", "light"),
    ),
    (
        "flat",
        "let v = root * point.y;",
        "let v = point.x * point.y;",
        Irradiance("disk", "light"),
    ),
    (
        "table",
        "low = middle + 1u;",
        "low = middle + 2u;",
        Density("disk"),
    ),
    (
        "table",
        "if (row.x < triangle)",
        "if (row.x > triangle)",
        Density("disk"),
    ),
    (
        "sphere",
        "return sin2 / (1.0 + sqrt(1.0 - sin2));",
        "return 0.5 * sin2;",
        Irradiance("sphere", "light"),
    ),
    (
        "sphere",
        "let x = point.x * height;",
        "let x = point.x * point.x * height;",
        Density("sphere"),
    ),
    (
        "sphere",
        "let sin2 = x * (2.0 - x);",
        "let sin2 = x;",
        Density("sphere"),
    ),
    (
        "sphere",
        "return 1.0 / (TWO_PI * cap_height(radius * radius / squared));",
        "return 0.95 / (TWO_PI * cap_height(radius * radius / squared));",
        Density("several spheres"),
    ),
    (
        "sphere",
        "(sphere.w * sphere.w - dot(beside, beside))",
        "(1.1 * sphere.w * sphere.w - dot(beside, beside))",
        Density("sphere"),
    ),
    (
        "sphere",
        "if (k != light && t > 0.0",
        "if (t > 0.0",
        Irradiance("sphere", "light"),
    ),
    (
        "delta",
        "intensity / squared",
        "intensity / distance",
        Irradiance("point", "light"),
    ),
    (
        "delta",
        "towards / distance,\n        distance,\n        intensity",
        "towards / distance,\n        distance,\n        1.01 * intensity",
        Irradiance("point", "light"),
    ),
    (
        "delta",
        "        1.0,\n        true,\n        Ray(origin, 0.0, position - origin, 1.0)",
        "        1.0,\n        false,\n        Ray(origin, 0.0, position - origin, 1.0)",
        Irradiance("point", "mis-balance"),
    ),
    (
        "delta",
        "Ray(origin, 0.0, position - origin, 1.0)",
        "Ray(origin, 0.0, origin - position, 1.0e30)",
        Irradiance("point", "light"),
    ),
    (
        "delta",
        "step * step * decay",
        "step * decay",
        Irradiance("spot", "light"),
    ),
    (
        "delta",
        "let cosine = -dot(found.direction, light.c.xyz);",
        "let cosine = dot(found.direction, light.c.xyz);",
        Irradiance("spot", "light"),
    ),
    (
        "delta",
        "found.distance * found.distance, 1.0, light",
        "1.0, found.distance * found.distance, light",
        Irradiance("spot", "light"),
    ),
    (
        "delta",
        "(cosine - light.a.w) / max(light.b.w - light.a.w",
        "(cosine - light.b.w) / max(light.b.w - light.a.w",
        Irradiance("spot", "light"),
    ),
    (
        "delta",
        "let direction = -light.a.xyz;",
        "let direction = light.a.xyz;",
        Irradiance("directional", "light"),
    ),
    (
        "delta",
        "FAR, light.b.xyz, 1.0, true",
        "FAR, 0.99 * light.b.xyz, 1.0, true",
        Irradiance("directional", "light"),
    ),
    (
        "delta",
        "FAR, light.b.xyz, 1.0, true",
        "FAR, light.b.xyz, 1.0, false",
        Irradiance("directional", "mis-balance"),
    ),
    (
        "delta",
        "FAR, light.b.xyz, 1.0, true",
        "FAR, light.b.xyz, 0.0, true",
        Irradiance("directional", "light"),
    ),
    ("environment", "fract(x)", "0.5 * fract(x)", Environment),
    (
        "environment",
        "angle_of(d.x, -d.z)",
        "angle_of(-d.x, -d.z)",
        Environment,
    ),
    (
        "environment",
        "place.x + f32(map.x) - 0.5",
        "place.x + f32(map.x)",
        Environment,
    ),
    (
        "environment",
        "if (place < own.x)",
        "if (true)",
        Density("environment"),
    ),
    (
        "environment",
        "let drop = 2.0 * edge * edge + down.along",
        "let drop = 2.0 * edge * edge + 0.8 * down.along",
        Environment,
    ),
    (
        "environment",
        "        chosen / angle,\n",
        "        1.03 * chosen / angle,\n",
        Environment,
    ),
    (
        "environment",
        "return chosen / texel_angle(y, map.x, map.y);",
        "return 1.05 * chosen / texel_angle(y, map.x, map.y);",
        Density("environment"),
    ),
    (
        "ies",
        "mix(profile_word(left + row.low), profile_word(left + row.high), row.along)",
        "profile_word(left + row.low)",
        Flux,
    ),
    ("ies", "horizontal + 6.2831855", "-horizontal", Flux),
    (
        "ies",
        "const DEGREES: f32 = 57.29578;",
        "const DEGREES: f32 = 57.0;",
        Flux,
    ),
    (
        "ies",
        "if (!(row.is_inside && column.is_inside))",
        "if (false)",
        Flux,
    ),
    (
        "ies",
        "vertical = angle_of(d.y, d.z);",
        "vertical = atan2(d.y, length(d.xz));",
        Flux,
    ),
    (
        "choice",
        "return LightChoice(low,",
        "return LightChoice(0u,",
        Density("several spheres"),
    ),
    (
        "choice",
        "return LightChoice(index, even_share(index))",
        "return LightChoice(index, 1.01 * even_share(index))",
        Density("several spheres"),
    ),
    (
        "choice",
        "@if(all_lights || !many_lights) return 1.0;",
        "@if(all_lights || !many_lights) return 0.5;",
        Mean("uniform", "all"),
    ),
    (
        "choice",
        "return LightChoice(found.light, unit_share(found.units));",
        "return LightChoice(found.light, unit_share(found.units) * 2.0);",
        Mean("tree", "one"),
    ),
    (
        "tree",
        "units -= part;",
        "units = part;",
        Density("several spheres"),
    ),
    ("tree", "rest -= part;", "", Density("several spheres")),
    (
        "tree",
        "select(units - part, part, is_left)",
        "select(part, units - part, is_left)",
        Density("several spheres"),
    ),
    (
        "tree",
        "let towards = 0.5 * (low.xyz + high.xyz) - position;",
        "let towards = position - 0.5 * (low.xyz + high.xyz);",
        Density("several spheres"),
    ),
];

#[test]
fn every_planted_fault_is_seen() {
    let right = means::right();
    let mut missed = Vec::new();
    for (file, from, to, seen) in faults_in_turn("faults of lights", FAULTS) {
        let gpu = probing(kernels_with(
            &format!("shading/light/{file}"),
            &[(from, to)],
        ));
        let found = match seen {
            Irradiance(lamp, strategy) => irradiance::fault(&gpu, lamp, strategy),
            Density(scene) => density::fault(&gpu, scene),
            Environment => environment::fault(&gpu),
            Flux => files::fault(&gpu),
            Mean(choice, lights) => means::fault(&gpu, choice, lights, &right),
        };
        match found {
            Some(text) => println!("{file}: `{to}`: {text}"),
            None => missed.push(format!("{file}: `{to}`")),
        }
    }
    assert!(
        FAULTS.len() > 40 && missed.is_empty(),
        "not seen: {missed:#?}"
    );
}

#[test]
fn a_map_that_rays_and_samples_mirror_alike_is_seen() {
    let mirrored = [
        ("angle_of(d.x, -d.z)", "angle_of(-d.x, -d.z)"),
        ("sin(around) * sine, 1.0", "-sin(around) * sine, 1.0"),
    ];
    let gpu = probing(kernels_with("shading/light/environment", &mirrored));
    let found = environment::fault_of_directions(&gpu);
    assert!(found.is_some_and(|text| text.starts_with("[1] turned by 0")));
}

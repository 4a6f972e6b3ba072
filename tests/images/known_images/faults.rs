//! Faults planted in kernels, and the image that reveals each.

use super::seen;
use crate::support::faults_in_turn;
use raystone::gpu::KernelLibrary;

/// File, texts with replacements, and the image that reveals it.
struct Fault {
    file: &'static str,
    changes: &'static [(&'static str, &'static str)],
    image: &'static str,
}

const fn fault(
    file: &'static str,
    changes: &'static [(&'static str, &'static str)],
    image: &'static str,
) -> Fault {
    Fault {
        file,
        changes,
        image,
    }
}

const PATH: &str = "integrator/path";
const FLAT: &str = "shading/light/flat";
const TEXTURE: &str = "shading/texture";

/// Planted in an ordinary test run.
const SOME: [Fault; 5] = [
    fault(
        FLAT,
        &[("point.error + ROUNDING_FROM_AFAR * distance", "point.error")],
        "ball of facets",
    ),
    fault(
        "shading/hemisphere",
        &[
            (
                "let radius = sqrt(u.x);",
                "let radius = sqrt(u.x * (2.0 - u.x));",
            ),
            ("sqrt(1.0 - u.x)", "1.0 - u.x"),
        ],
        "occlusion",
    ),
    fault(
        PATH,
        &[(
            "light.pdf *= probability;",
            "light.pdf *= 1.02 * probability;",
        )],
        "wide lamp",
    ),
    fault(
        "shading/light/delta",
        &[("intensity / squared", "intensity / distance")],
        "points and spots",
    ),
    fault(
        TEXTURE,
        &[("let position = inside *", "let position = inside.yx *")],
        "textures",
    ),
];

const OTHERS: [Fault; 38] = [
    fault(
        PATH,
        &[("throughput /= survival;", "throughput *= 0.99 / survival;")],
        "furnace, eight bounces",
    ),
    fault(
        PATH,
        &[(
            "return mis_weight(own, other);",
            "return 1.005 * mis_weight(own, other);",
        )],
        "ceiling",
    ),
    fault(
        PATH,
        &[(
            "let weighted = density / (light.pdf + competing);",
            "let weighted = 1.005 * density / (light.pdf + competing);",
        )],
        "small lamp",
    ),
    fault(
        PATH,
        &[(
            "return select(less * less, 1.0, own >= other)",
            "return select(less, 1.0, own >= other)",
        )],
        "wide lamp, power heuristic",
    ),
    fault(
        PATH,
        &[("if (depth == MAX_DEPTH)", "if (depth + 1u >= MAX_DEPTH)")],
        "furnace, two bounces",
    ),
    fault(
        PATH,
        &[("if (any_hit(light.shadow))", "if (false)")],
        "occluded lamp",
    ),
    fault(
        PATH,
        &[(
            "if (sphere_blocks(light.shadow, index)) { return vec3<f32>(0.0); }",
            "if (sphere_blocks(light.shadow, 77u)) { return vec3<f32>(0.0); }",
        )],
        "sphere lights",
    ),
    fault(
        PATH,
        &[(
            "if (!(is_positive(density) && is_positive(light.pdf)))",
            "if (!(density > 0.02 && is_positive(light.pdf)))",
        )],
        "grazing lamps",
    ),
    fault(
        PATH,
        &[(
            "result += limited(throughput * emission * weight, depth);",
            "result += limited(throughput * emission, depth);",
        )],
        "wide lamp",
    ),
    fault(
        PATH,
        &[
            (
                "let survival = min(max(max(next.weight.x",
                "let survival = 0.98 * min(max(max(next.weight.x",
            ),
            ("throughput /= survival;", "throughput /= survival + 0.01;"),
        ],
        "furnace, five bounces by albedo",
    ),
    fault(
        PATH,
        &[(
            "light_sample_of(k, surface, r2_moved(point, k))",
            "light_sample_of(k, surface, r2_moved(point, k).xx)",
        )],
        "unequal lamps, all",
    ),
    fault(
        FLAT,
        &[("cos_light > 1e-6", "cos_light > 0.05")],
        "grazing lamps",
    ),
    fault(
        FLAT,
        &[("if (front < 0.0 && !point.both_sides)", "if (front < 0.0)")],
        "sides of lamps",
    ),
    fault(
        FLAT,
        &[("if (front < 0.0 && !point.both_sides)", "if (false)")],
        "sides of lamps",
    ),
    fault(
        FLAT,
        &[("let root = sqrt(point.x);", "let root = point.x;")],
        "triangles",
    ),
    fault(
        FLAT,
        &[(
            "return distance * distance / (light.a.w",
            "return distance / (light.a.w",
        )],
        "wide lamp",
    ),
    fault(
        "shading/material",
        &[("if (kind != a.w && !from_front)", "if (false)")],
        "sides of lamps",
    ),
    fault(
        "shading/light/choice",
        &[(
            "return LightChoice(low, bitcast<f32>(shading_row(frame.first_light + 4u * low).w));",
            "return LightChoice(low, 1.0 / f32(frame.lights));",
        )],
        "unequal lamps",
    ),
    fault(
        "shading/light/choice",
        &[(
            "return LightChoice(index, even_share(index));",
            "return LightChoice(index, 1.01 * even_share(index));",
        )],
        "unequal lamps, chosen evenly",
    ),
    fault(
        "shading/light/tree",
        &[(
            "return TreeChoice(links.y, units);",
            "return TreeChoice(links.y, units + units / 100u);",
        )],
        "unequal lamps, by a tree",
    ),
    fault(
        "shading/light/tree",
        &[("probability *= left;", "probability *= 0.99 * left;")],
        "unequal lamps, by a tree",
    ),
    fault(
        "shading/light/delta",
        &[(
            "found.radiance *= step * step * decay;",
            "found.radiance *= step * decay;",
        )],
        "points and spots",
    ),
    fault(
        "shading/light/delta",
        &[(
            "select(found.distance * found.distance, 1.0, light.c.w > 0.0)",
            "1.0",
        )],
        "points and spots",
    ),
    fault(
        "shading/light/delta",
        &[(
            "let direction = -light.a.xyz;",
            "let direction = light.a.xyz;",
        )],
        "far and measured lights",
    ),
    fault(
        "shading/light/ies",
        &[(
            "horizontal = angle_of(d.y, d.x);",
            "horizontal = angle_of(d.x, d.y);",
        )],
        "far and measured lights",
    ),
    fault(
        "shading/light/sphere",
        &[(
            "        1.0 / (TWO_PI * height),",
            "        1.01 / (TWO_PI * height),",
        )],
        "sphere lights, by the light",
    ),
    fault(
        "shading/light/environment",
        &[(
            "return chosen / texel_angle(",
            "return 1.02 * chosen / texel_angle(",
        )],
        "map",
    ),
    fault(
        "shading/light/sky",
        &[("0.12 + 0.38", "0.12 + 0.39")],
        "sky",
    ),
    fault(
        "shading/bsdf/mirror",
        &[(
            "surface.material.base_color, 1.0",
            "0.99 * surface.material.base_color, 1.0",
        )],
        "mirrors",
    ),
    fault(
        "shading/bsdf/dielectric",
        &[(
            "2.0 * reflectance / (1.0 + reflectance)",
            "2.0 * reflectance",
        )],
        "glass",
    ),
    fault(
        "shading/bsdf/dielectric",
        &[("if (u.x < reflectance)", "if (u.x < 0.95 * reflectance)")],
        "glass",
    ),
    fault(
        "shading/bsdf/principled",
        &[("(1.0 + before) / (1.0 + both)", "1.0 / (1.0 + both)")],
        "materials",
    ),
    fault(
        "shading/bsdf/lobes",
        &[("let density = p * first", "let density = 1.01 * p * first")],
        "materials",
    ),
    fault(
        TEXTURE,
        &[("vec2<f32>(place.yz) - 0.5", "vec2<f32>(place.yz) - 0.4")],
        "textures",
    ),
    fault(TEXTURE, &[("2.0 * fract(0.5 * x)", "fract(x)")], "textures"),
    fault(
        "shading/normals",
        &[("scale * mapped.y", "-scale * mapped.y")],
        "normals",
    ),
    fault(
        "integrator/position_error",
        &[("4.7683716e-7", "4.7683716e-3")],
        "occluded lamp",
    ),
    fault(
        "integrator/ao",
        &[(
            "direction, frame.ao_radius",
            "direction, 1.01 * frame.ao_radius",
        )],
        "occlusion",
    ),
];

/// True if the image reveals the fault; panics if it was not planted.
fn is_seen(fault: &Fault) -> bool {
    let library = KernelLibrary::default();
    let mut text = library.text(fault.file).expect("a known module").to_owned();
    for (from, to) in fault.changes {
        assert_eq!(text.matches(from).count(), 1, "`{from}` in {}", fault.file);
        text = text.replace(from, to);
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join(fault.file).with_extension("wesl");
    std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
    std::fs::write(&file, text).expect("a kernel file");
    let views = seen(Some(folder.path()), &[fault.image]);
    let first = views.iter().find_map(|view| view.fault.as_ref());
    println!(
        "{} {:?} by {}: {first:?}",
        fault.file, fault.changes[0].1, fault.image
    );
    // A kernel that does not compile reveals nothing.
    first.is_some_and(|fault| !fault.contains("not rendered"))
}

fn missed<'a>(faults: impl IntoIterator<Item = &'a Fault>) -> Vec<&'static str> {
    let missed = faults.into_iter().filter(|fault| !is_seen(fault));
    missed.map(|fault| fault.changes[0].1).collect()
}

#[test]
fn some_planted_faults_show_in_their_images() {
    let some = faults_in_turn("faults of known images", &SOME);
    assert_eq!(missed(some), [] as [&str; 0]);
}

#[test]
#[ignore = "a minute: forty faults; `cargo test --release --test images -- --ignored known_images`"]
fn all_planted_faults_show_in_their_images() {
    assert_eq!(missed(OTHERS.iter()), [] as [&str; 0]);
}

//! Faults of lights, placed textures and sums that single paths show.

use super::{row, text};
use crate::{Check, Mutant, Plant, Subject};

const fn fault(name: &'static str, what: &'static str, plant: Plant) -> Mutant {
    row(name, what, plant, Subject::Paths, Check::Paths)
}

pub const MUTANTS: &[Mutant] = &[
    fault(
        "map-density-two-percent",
        "the density of directions into the map is a fiftieth too large",
        text(
            "shading/light/environment",
            "return chosen / texel_angle(y, map.x, map.y);",
            "return 1.02 * chosen / texel_angle(y, map.x, map.y);",
        ),
    ),
    fault(
        "map-turned-the-other-way",
        "the map is turned clockwise",
        text(
            "shading/light/environment",
            "return vec3<f32>(turn.x * v.x + turn.y * v.z, v.y, turn.x * v.z - turn.y * v.x);",
            "return vec3<f32>(turn.x * v.x - turn.y * v.z, v.y, turn.x * v.z + turn.y * v.x);",
        ),
    ),
    fault(
        "map-without-sine",
        "texels have the same solid angle in all rows",
        text(
            "shading/light/environment",
            "* sin((2.0 * f32(row) + 1.0) * half) * sin(half);",
            "* sin(half);",
        ),
    ),
    fault(
        "map-weight-half-a-percent",
        "light samples of the map are weighted half a percent off",
        text(
            "shading/lights",
            "* environment_density(load_light(last), direction);",
            "* 1.005 * environment_density(load_light(last), direction);",
        ),
    ),
    fault(
        "luminaire-angles-exchanged",
        "the angles of type B are those about another axis",
        text(
            "shading/light/ies",
            "vertical = angle_of(d.y, d.z);",
            "vertical = angle_of(d.x, d.z);",
        ),
    ),
    fault(
        "luminaire-nearest",
        "intensities are those of the nearest angle",
        text(
            "shading/light/ies",
            "let along = select(saturate((x - a) / (b - a)), 0.0, low == high);",
            "let along = round(select(saturate((x - a) / (b - a)), 0.0, low == high));",
        ),
    ),
    fault(
        "tree-probability-a-percent",
        "lights of the tree are chosen less often than they are weighted for",
        text(
            "shading/light/tree",
            "return TreeChoice(links.y, units);",
            "return TreeChoice(links.y, units + units / 100u);",
        ),
    ),
    fault(
        "tree-drops-oblique-lights",
        "nodes that shine past the point at an angle count for nothing",
        text(
            "shading/light/tree",
            "if (!is_inside && cos_emitted < cone.w) {",
            "if (!is_inside && cos_emitted < cone.w + 0.3) {",
        ),
    ),
    fault(
        "spot-falls-off-linearly",
        "the edge of a spot is a linear step",
        text(
            "shading/light/delta",
            "found.radiance *= step * step * decay;",
            "found.radiance *= step * decay;",
        ),
    ),
    fault(
        "sphere-density-a-percent",
        "the density of directions to spheres is a hundredth too large",
        text(
            "shading/light/sphere",
            "    return 1.0 / (TWO_PI * cap_height(radius * radius / squared));",
            "    return 1.01 / (TWO_PI * cap_height(radius * radius / squared));",
        ),
    ),
    fault(
        "later-samples-darker",
        "samples after the first of a dispatch are a hundredth too dark",
        text(
            "integrator/render",
            "sum += vec4<f32>(radiance(vec2<u32>(x, y), &sampler), 1.0);",
            "sum += vec4<f32>(radiance(vec2<u32>(x, y), &sampler) * select(1.0, 0.99, i > 0u), 1.0);",
        ),
    ),
    fault(
        "green-of-normal-maps-turned",
        "y of normal maps points up",
        text(
            "shading/normals",
            "let bitangent = select(across, -across, dot(across, along_v) > 0.0);",
            "let bitangent = select(-across, across, dot(across, along_v) > 0.0);",
        ),
    ),
    fault(
        "colours-of-corners-exchanged",
        "the colour of a vertex has the weight of another",
        text(
            "shading/colors",
            "+ hit.u * corner_color(at + 2u)",
            "+ hit.u * corner_color(at + 4u)",
        ),
    ),
    fault(
        "hits-moved-twice",
        "the offset of a ray is added to its hit, and not taken out",
        text(
            "shading/surface",
            "let offset = ray.origin - start;",
            "let offset = start - ray.origin;",
        ),
    ),
];

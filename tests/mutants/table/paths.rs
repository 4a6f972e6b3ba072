//! Faults of integrators and shading that single paths show: small ones, and those of features that few scenes have.

use super::{row, text, texts};
use crate::{Check, Mutant, Plant, Subject};

const fn fault(name: &'static str, what: &'static str, plant: Plant) -> Mutant {
    row(name, what, plant, Subject::Paths, Check::Paths)
}

/// A text of the path tracer.
const fn path(
    name: &'static str,
    what: &'static str,
    from: &'static str,
    to: &'static str,
) -> Mutant {
    fault(name, what, text("integrator/path", from, to))
}

pub const MUTANTS: &[Mutant] = &[
    path(
        "throughput-five-percent",
        "every bounce is a twentieth too bright",
        "throughput *= next.weight;",
        "throughput *= 1.05 * next.weight;",
    ),
    path(
        "throughput-half-percent",
        "every bounce is half a percent too dark",
        "throughput *= next.weight;",
        "throughput *= 0.995 * next.weight;",
    ),
    path(
        "roulette-weight-099",
        "survivors of roulette are a hundredth too dark",
        "throughput /= survival;",
        "throughput *= 0.99 / survival;",
    ),
    path(
        "roulette-a-bounce-late",
        "roulette begins a bounce late",
        "if (depth >= ROULETTE_DEPTH)",
        "if (depth > ROULETTE_DEPTH)",
    ),
    path(
        "roulette-keeps-more",
        "paths survive more often than they are weighted for",
        "if (sample_1d(sampler) >= survival)",
        "if (sample_1d(sampler) >= survival + 0.02)",
    ),
    path(
        "roulette-forgets-the-medium",
        "roulette ends paths in glass more often",
        "medium *= next.medium;",
        "",
    ),
    path(
        "weights-half-a-percent-off",
        "the balance heuristic favours one side by half a percent",
        "return own / (own + other);",
        "return own / (own + 1.005 * other);",
    ),
    path(
        "power-without-square",
        "the power heuristic has the exponent 1",
        "return select(less * less, 1.0, own >= other) / (1.0 + less * less);",
        "return select(less, 1.0, own >= other) / (1.0 + less);",
    ),
    path(
        "limit-on-the-first-bounce",
        "direct light is clamped, too",
        "depth > 0u && most > limit",
        "most > limit",
    ),
    path(
        "last-bounce-without-emission",
        "emission that the last ray meets is left out",
        "*result += limited(throughput * emission * weight, depth);",
        "if (depth < MAX_DEPTH) { *result += limited(throughput * emission * weight, depth); }",
    ),
    path(
        "emission-after-mirrors-weighted",
        "emission behind a delta lobe has the weight of a direction that light samples find",
        "density = select(next.pdf, 0.0, next.is_delta);",
        "density = next.pdf;",
    ),
    path(
        "light-of-the-bounce-before",
        "light points are drawn from the dimensions of bounce 0",
        "(*sampler).dimension = at_bounce(depth, LIGHT_POINT);",
        "(*sampler).dimension = at_bounce(0u, LIGHT_POINT);",
    ),
    path(
        "direction-from-light-dimensions",
        "directions are drawn from the dimensions of light points",
        "(*sampler).dimension = at_bounce(depth, DIRECTION);",
        "(*sampler).dimension = at_bounce(depth, LIGHT_POINT);",
    ),
    path(
        "deep-light-lost",
        "no light is sampled from the fifth vertex on",
        "if (!bsdf_is_delta(surface)) {",
        "if (!bsdf_is_delta(surface) && depth < 4u) {",
    ),
    path(
        "deep-sky-lost",
        "rays that leave after five bounces bring nothing",
        "*result += limited(throughput * escaped_radiance(ray.direction) * weight, depth);",
        "if (depth < 5u) { *result += limited(throughput * escaped_radiance(ray.direction) * weight, depth); }",
    ),
    path(
        "grazing-rays-end",
        "bounces that leave near the horizon are dropped",
        "if (!is_positive(brightest)) {",
        "if (!is_positive(brightest) || abs(dot(next.direction, surface.normal)) < 0.05) {",
    ),
    path(
        "bright-samples-cut",
        "single contributions above 20 are cut off",
        "return result;",
        "return min(result, vec3<f32>(20.0));",
    ),
    path(
        "dark-paths-cut",
        "paths end where less than a fiftieth is left",
        "if (!is_positive(brightest)) {",
        "if (!(brightest > 0.02)) {",
    ),
    fault(
        "occlusion-uniform",
        "rays of ambient occlusion are uniform over the hemisphere",
        text(
            "integrator/ao",
            "let direction = sample_cosine(sample_2d(sampler), surface.shading);",
            "let u = sample_2d(sampler); let direction = sample_cosine(vec2<f32>(u.x * (2.0 - u.x), u.y), surface.shading);",
        ),
    ),
    fault(
        "occlusion-radius-a-percent",
        "rays of ambient occlusion are a fiftieth too long",
        text(
            "integrator/ao",
            "direction, frame.ao_radius",
            "direction, 1.02 * frame.ao_radius",
        ),
    ),
    fault(
        "occlusion-of-the-next-bounce",
        "directions of ambient occlusion are drawn from another bounce",
        text(
            "integrator/ao",
            "at_bounce(0u, DIRECTION)",
            "at_bounce(1u, DIRECTION)",
        ),
    ),
    fault(
        "primary-without-cosine",
        "primary visibility does not shade",
        text(
            "integrator/primary",
            "abs(dot(surface.normal, ray.direction))",
            "sqrt(abs(dot(surface.normal, ray.direction)))",
        ),
    ),
    fault(
        "primary-without-emission",
        "lamps do not shine in primary visibility",
        text("integrator/primary", " + surface.material.emission", ""),
    ),
    fault(
        "draws-clamped",
        "no number above 0.9 is drawn",
        text(
            "sampling/sampler",
            "return to_unit(x);",
            "return min(to_unit(x), 0.9);",
        ),
    ),
    fault(
        "draws-of-sixteen-bits",
        "numbers have sixteen bits",
        text(
            "sampling/sampler",
            "return f32(x >> 8u) * 5.9604645e-8;",
            "return f32(x >> 16u) / 65536.0;",
        ),
    ),
    fault(
        "draws-a-dimension-late",
        "two numbers are drawn from dimensions one apart from the right ones",
        text(
            "sampling/dimensions",
            "const DIRECTION: u32 = 0u;",
            "const DIRECTION: u32 = 1u;",
        ),
    ),
    fault(
        "pixels-off-by-half",
        "samples lie in the first half of their pixel",
        text(
            "integrator/frame",
            "vec2<f32>(pixel) + sample_2d(sampler)",
            "vec2<f32>(pixel) + 0.5 * sample_2d(sampler)",
        ),
    ),
    fault(
        "aspect-ignored",
        "the height of the image counts as its width",
        text(
            "integrator/frame",
            "vec2<f32>(f32(frame.width), f32(frame.height))",
            "vec2<f32>(f32(frame.width), f32(frame.width))",
        ),
    ),
    fault(
        "cosine-density-half-again",
        "the density of cosine directions is half as large again",
        text(
            "shading/bsdf/diffuse",
            "return max(dot(surface.shading.normal, direction), 0.0) * INVERSE_PI;",
            "return max(dot(surface.shading.normal, direction), 0.0) * 1.5 * INVERSE_PI;",
        ),
    ),
    fault(
        "cosine-density-a-percent",
        "the density of cosine directions is a hundredth too large",
        text(
            "shading/bsdf/diffuse",
            "return max(dot(surface.shading.normal, direction), 0.0) * INVERSE_PI;",
            "return max(dot(surface.shading.normal, direction), 0.0) * 1.01 * INVERSE_PI;",
        ),
    ),
    fault(
        "grazing-light-lost",
        "light below three degrees is lost",
        text(
            "shading/bsdf/diffuse",
            "return max(dot(surface.shading.normal, direction), 0.0) * INVERSE_PI;",
            "return max(dot(surface.shading.normal, direction) - 0.05, 0.0) * INVERSE_PI;",
        ),
    ),
    fault(
        "azimuth-three-quarters",
        "directions leave out a quarter of the turn",
        text(
            "shading/hemisphere",
            "let angle = TWO_PI * u.y;",
            "let angle = 0.75 * TWO_PI * u.y;",
        ),
    ),
    fault(
        "height-of-directions",
        "directions are steeper than they should be",
        text(
            "shading/hemisphere",
            "sqrt(1.0 - u.x)",
            "sqrt(1.0 - 0.98 * u.x)",
        ),
    ),
    fault(
        "basis-left-handed",
        "one axis of the basis is turned round",
        text("shading/basis", "-sign * n.x)", "sign * n.x)"),
    ),
    fault(
        "side-inverted",
        "inside and outside of glass are exchanged",
        text(
            "shading/surface",
            "select(-1.0, 1.0, from_outside)",
            "select(1.0, -1.0, from_outside)",
        ),
    ),
    fault(
        "mirrored-fronts-forgotten",
        "mirrored triangles have the fronts of the others",
        text("shading/sides", "& 1u) != 0u", "& 1u) == 2u"),
    ),
    fault(
        "glossy-light-behind-lost",
        "what a glossy surface reflects behind itself is lost",
        text(
            "shading/bsdf",
            "if (!is_positive(other.pdf)) { return own; }",
            "if (is_positive(other.pdf)) { return own; }",
        ),
    ),
    fault(
        "shadow-of-the-offset",
        "rays start ten thousand times too far from their surface",
        text(
            "integrator/position_error",
            "return POSITION_ERROR *",
            "return 10000.0 * POSITION_ERROR *",
        ),
    ),
    fault(
        "offset-a-hundredfold",
        "rays start a hundred times too far from their surface",
        text(
            "integrator/position_error",
            "return POSITION_ERROR *",
            "return 100.0 * POSITION_ERROR *",
        ),
    ),
    fault(
        "next-ray-a-little-inside",
        "bounced rays begin a hundredth along",
        texts(
            "integrator/path",
            "ray = Ray(leave(surface, next.direction), 0.0,",
            "ray = Ray(leave(surface, next.direction), 0.05,",
            1,
        ),
    ),
    fault(
        "emission-of-the-frame-thrice",
        "lamps are three times as bright in the camera",
        path_text(
            "throughput * emission * weight",
            "throughput * emission * weight * select(1.0, 3.0, depth == 0u)",
        ),
    ),
    fault(
        "first-bounce-full-weight",
        "emission that the first bounce finds has full weight",
        path_text(
            "weight = found_weight(density, light_pdf(leaving, surface, hit));",
            "if (depth > 1u) { weight = found_weight(density, light_pdf(leaving, surface, hit)); }",
        ),
    ),
];

const fn path_text(from: &'static str, to: &'static str) -> Plant {
    text("integrator/path", from, to)
}

//! Faults of integrators and shading.

use super::{row, text};
use crate::{Check, Mutant, Subject};

const IMAGES: Subject = Subject::Integrators;

pub const MUTANTS: &[Mutant] = &[
    row(
        "pdf-forgotten",
        "the density of a light sample is left over area",
        text(
            "shading/light/triangles",
            "let density = light_density(emission) * squared / cos_light;",
            "let density = light_density(emission);",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "cosine-missing",
        "direct light does not fall off with the angle to the surface",
        text(
            "shading/bsdf/diffuse",
            "return max(dot(surface.shading.normal, direction), 0.0) * INVERSE_PI;",
            "return select(0.0, INVERSE_PI, dot(surface.shading.normal, direction) > 0.0);",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "direct-light-counted-twice",
        "emission that a ray finds has full weight besides next-event estimation",
        text(
            "integrator/path",
            "weight = mis_weight(density, light_pdf(surface, hit.t));",
            "weight = 1.0;",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "weights-do-not-add-up",
        "one of two weights is that of the power heuristic",
        text(
            "integrator/path",
            "weight = mis_weight(density, light_pdf(surface, hit.t));",
            "let other = light_pdf(surface, hit.t); weight = density * density / (density * density + other * other);",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "roulette-without-weight",
        "paths that survive roulette do not stand for those that do not",
        text("integrator/path", "throughput /= survival;", ""),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "albedo-squared",
        "a surface reflects its colour twice",
        text(
            "integrator/path",
            "throughput *= next.weight;",
            "throughput *= next.weight * next.weight;",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "albedo-missing-in-direct-light",
        "direct light is reflected by white",
        text(
            "integrator/path",
            "return bsdf_eval(surface, light.direction) * light.radiance *",
            "return light.radiance *",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "shadow-ray-inverted",
        "occluded lights shine and free ones do not",
        text(
            "integrator/path",
            "if (any_hit(light.shadow))",
            "if (!any_hit(light.shadow))",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "no-shadow-rays",
        "no light is occluded: right in a convex box only",
        text(
            "integrator/path",
            "if (any_hit(light.shadow))",
            "if (false)",
        ),
        IMAGES,
        Check::ThinWalls,
    ),
    row(
        "one-bounce-short",
        "paths end a bounce early",
        text(
            "integrator/path",
            "if (depth == MAX_DEPTH)",
            "if (depth + 1u == MAX_DEPTH)",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "bounces-share-dimensions",
        "every bounce draws the same numbers",
        text(
            "sampling/dimensions",
            "FIRST_BOUNCE + bounce * PER_BOUNCE + purpose",
            "FIRST_BOUNCE + purpose",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "light-points-bunched",
        "points of a light are denser at one corner",
        text(
            "shading/light/triangles",
            "let root = sqrt(point.x);",
            "let root = point.x;",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "first-light-only",
        "only the first light is ever chosen",
        text(
            "shading/light/triangles",
            "    return low;\n",
            "    return 0u;\n",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "directions-bunched",
        "directions are denser around the normal than their density says",
        text(
            "shading/hemisphere",
            "let radius = sqrt(u.x);",
            "let radius = u.x;",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "normal-on-the-far-side",
        "the normal points away from the ray",
        text(
            "shading/surface",
            "dot(inward, ray.direction) > 0.0",
            "dot(inward, ray.direction) < 0.0",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "position-mirrored-in-the-triangle",
        "the point of a hit is that of other barycentrics",
        text(
            "shading/surface",
            "v0 - hit.u * e1 + hit.v * e2",
            "v0 + hit.u * e1 + hit.v * e2",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "offset-inwards",
        "rays start below their surface",
        text(
            "shading/surface",
            "dot(direction, surface.normal) < 0.0",
            "dot(direction, surface.normal) > 0.0",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "offset-sixteenfold",
        "rays start sixteen times as far from their surface",
        text(
            "integrator/offset/error_bound",
            "let step = n * distance;",
            "let step = n * (16.0 * distance);",
        ),
        IMAGES,
        Check::ThinWalls,
    ),
    row(
        "position-error-thousandfold",
        "the bound of a point's error is a thousand times too large",
        text(
            "integrator/position_error",
            "return POSITION_ERROR *",
            "return 1000.0 * POSITION_ERROR *",
        ),
        IMAGES,
        Check::ThinWalls,
    ),
    row(
        "offset-along-another-axis",
        "rays start beside their surface instead of above it",
        text(
            "integrator/offset/error_bound",
            "let step = n * distance;",
            "let step = n.yzx * distance;",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "offset-of-the-other-side",
        "rays start behind their surface",
        text(
            "integrator/offset/error_bound",
            "let step = n * distance;",
            "let step = -n * distance;",
        ),
        IMAGES,
        Check::Furnace,
    ),
    row(
        "shadow-rays-start-far-off",
        "only shadow rays start too far from their surface",
        text(
            "shading/light/triangles",
            "let origin = offset_point(surface.position, surface.normal, surface.error);",
            "let origin = offset_point(surface.position, surface.normal, 64.0 * surface.error);",
        ),
        IMAGES,
        Check::ThinWalls,
    ),
    row(
        "occlusion-rays-start-far-off",
        "only rays of ambient occlusion start too far from their surface",
        text(
            "integrator/ao",
            "Ray(leave(surface, direction),",
            "Ray(surface.position + 64.0 * (leave(surface, direction) - surface.position),",
        ),
        IMAGES,
        Check::ThinWalls,
    ),
    row(
        "camera-upside-down",
        "the image stands on its head",
        text(
            "integrator/frame",
            "1.0 - 2.0 * position.y",
            "2.0 * position.y - 1.0",
        ),
        IMAGES,
        Check::Bias,
    ),
    row(
        "occlusion-inverted",
        "occluded rays are white",
        text(
            "integrator/ao",
            "select(1.0, 0.0, occluded)",
            "select(0.0, 1.0, occluded)",
        ),
        IMAGES,
        Check::Occlusion,
    ),
    row(
        "occlusion-without-end",
        "rays of ambient occlusion have no end",
        text(
            "integrator/ao",
            "direction, frame.ao_radius",
            "direction, 1e30",
        ),
        IMAGES,
        Check::Occlusion,
    ),
];

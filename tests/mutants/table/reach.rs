//! Faults that show only where scenes are large, small, deep or seldom: far ends of rays, borders of masks, surfaces
//! within a light, the last entries of stacks.

use super::words::*;
use super::{row, structure, text};
use crate::subject::Changes;
use crate::{Check, Mutant, Plant, Subject};

const fn path(name: &'static str, what: &'static str, plant: Plant) -> Mutant {
    row(name, what, plant, Subject::Paths, Check::Paths)
}

const fn half_a_stack(
    name: &'static str,
    of: &'static str,
    changes: Changes,
    seen: Check,
) -> Mutant {
    row(
        name,
        "the stack has half of its entries",
        Plant::Built {
            part: "STACK_ENTRIES",
            change: halve_the_stack,
        },
        structure(of, changes),
        seen,
    )
}

pub const MUTANTS: &[Mutant] = &[
    path(
        "limit-not-for-balls",
        "what a path finds of a ball of light has no limit",
        text(
            "integrator/path",
            "limited(throughput * load_light(ball.light).b.xyz * weight, depth)",
            "throughput * load_light(ball.light).b.xyz * weight",
        ),
    ),
    path(
        "limit-not-for-the-sky",
        "what a path finds beyond the scene has no limit",
        text(
            "integrator/path",
            "limited(throughput * escaped_radiance(ray.direction) * weight, depth)",
            "throughput * escaped_radiance(ray.direction) * weight",
        ),
    ),
    path(
        "normals-turned-one-way",
        "a map of normals that is mirrored on its surface is taken for one that is not",
        text(
            "shading/normals",
            "let turn = sign(d1.x * d2.y - d1.y * d2.x);",
            "let turn = 1.0;",
        ),
    ),
    path(
        "map-of-a-power-of-two",
        "of as many rows or columns as a power of two the parts are half as large",
        text(
            "shading/light/environment",
            "countLeadingZeros(count - 1u) - 8u",
            "countLeadingZeros(count) - 8u",
        ),
    ),
    path(
        "rows-wrap-like-columns",
        "a mask wraps in v as it does in u",
        text("accel/mask", "image.z >> 2u", "image.z & 3u"),
    ),
    path(
        "cutoff-is-a-hole",
        "an alpha that equals the cutoff is no surface",
        text(
            "accel/mask",
            "return alpha < image.w",
            "return alpha <= image.w",
        ),
    ),
    path(
        "masks-mirrored-a-texel-late",
        "the mirrored half of a mask lies a texel farther",
        text(
            "accel/mask",
            "min(there, 2 * size - 1 - there)",
            "min(min(there, 2 * size - there), size - 1)",
        ),
    ),
    path(
        "masks-clamped-a-texel-early",
        "beyond the border of a mask is the last texel but one",
        text(
            "accel/mask",
            "clamp(at, 0, size - 1)",
            "clamp(at, 0, max(size - 2, 0))",
        ),
    ),
    path(
        "rays-end-at-1000",
        "rays of the camera and bounced ones end at 1000 units",
        text(
            "integrator/frame",
            "const FAR: f32 = 1.0e30;",
            "const FAR: f32 = 1000.0;",
        ),
    ),
    path(
        "bounces-end-at-5000",
        "bounced rays end at 5000 units",
        text(
            "integrator/path",
            "0.0, next.direction, FAR)",
            "0.0, next.direction, 5000.0)",
        ),
    ),
    path(
        "shadow-rays-end-at-1000",
        "nothing blocks the light of lamps from farther than 1000 units",
        text(
            "shading/light/flat",
            "Ray(origin, 0.0, end - origin, 1.0),",
            "Ray(origin, 0.0, end - origin, min(1.0, 1000.0 / length(end - origin))),",
        ),
    ),
    path(
        "shadow-rays-of-spheres-end-at-1000",
        "nothing blocks the light of spheres from farther than 1000 units",
        text(
            "shading/light/sphere",
            "shadow_ray(surface, distance * direction),",
            "shadow_ray(surface, min(distance, 1000.0) * direction),",
        ),
    ),
    path(
        "occlusion-ends-at-1000",
        "rays of ambient occlusion have 1000 units at most",
        text(
            "integrator/ao",
            "direction, frame.ao_radius)",
            "direction, min(frame.ao_radius, 1000.0))",
        ),
    ),
    path(
        "bounces-begin-a-little-late",
        "bounced rays begin a hundred-thousandth of a unit along",
        text(
            "integrator/path",
            "next.direction), 0.0, next.direction",
            "next.direction), 1e-5, next.direction",
        ),
    ),
    path(
        "dark-within-a-sphere",
        "a sphere does not light what is within",
        text(
            "shading/light/sphere",
            "        let z = 1.0 - 2.0 * point.x;\n",
            "        let z = 1.0 - 2.0 * point.x;\n        if (z < 2.0) { return dark(); }\n",
        ),
    ),
    path(
        "sphere-grazed-from-within",
        "the density of points that are seen at an angle from within a sphere is too small",
        text(
            "shading/light/sphere",
            "max(cos_light, 1e-6)",
            "max(cos_light, 0.99)",
        ),
    ),
    path(
        "sphere-not-met-from-within",
        "a ray that begins within a sphere does not meet it",
        text(
            "shading/light/sphere",
            "select(middle + sqrt(half), near, near > 0.0)",
            "near",
        ),
    ),
    path(
        "all-lights-but-the-last",
        "where all lights are sampled the last one is not",
        text(
            "integrator/path",
            "k < frame.lights; k++",
            "k + 1u < frame.lights; k++",
        ),
    ),
    row(
        "traced-to-1000",
        "no structure looks farther than 1000 units",
        text(
            "accel/query",
            "return trace(raised(ray), false);",
            "var near = raised(ray);\n    near.t_max = min(near.t_max, 1000.0);\n    return trace(near, false);",
        ),
        structure("kd-tree", &[]),
        Check::Lattice,
    ),
    half_a_stack("half-a-stack", "bvh", &[], Check::Gate),
    half_a_stack("half-a-stack-of-four", "bvh4", &[], Check::Lattice),
    half_a_stack("half-a-stack-of-octants", "octree", &[], Check::Gate),
    half_a_stack("half-a-stack-of-instances", "meta-bvh", &[], Check::Gate),
];

//! Faults of two-level structures.

use super::words::*;
use super::{built, row, structure, text};
use crate::{Check, Mutant, Subject};

const LIST: Subject = structure("object-list", &[]);
const META: Subject = structure("meta-bvh", &[]);
const NESTED: Subject = structure("meta-bvh", &[("loop", "nested")]);

pub const MUTANTS: &[Mutant] = &[
    row(
        "last-instance-forgotten",
        "the loop over instances ends one short",
        text(
            "accel/object_list",
            "i < limits.elements; i++",
            "i + 1u < limits.elements; i++",
        ),
        LIST,
        Check::Lattice,
    ),
    row(
        "world-box-too-small",
        "the world box of the last instance is cut",
        built("the last world box", shrink_last_box),
        LIST,
        Check::Gate,
    ),
    row(
        "direction-normalised",
        "rays are normalised in the object's space, so that distances are others",
        text(
            "accel/instance",
            "return Ray(origin, ray.t_min, direction, ray.t_max);",
            "return Ray(origin, ray.t_min, normalize(direction), ray.t_max);",
        ),
        LIST,
        Check::Gate,
    ),
    row(
        "translation-forgotten",
        "rays are turned and scaled into the object's space, not moved",
        text("accel/instance", " + entry.offset;", ";"),
        LIST,
        Check::Gate,
    ),
    row(
        "index-of-the-object",
        "hits name the triangle of the object, not that of the scene",
        text("accel/instance", "record.v0.w += first_id;", ""),
        META,
        Check::Gate,
    ),
    row(
        "far-instance-dropped",
        "the far child is not pushed",
        text("accel/meta_bvh", "push(&stack, children.far);", ""),
        META,
        Check::Lattice,
    ),
    row(
        "world-not-restored",
        "behind an object the ray stays in the object's space",
        text("accel/meta_bvh", "                here = world;\n", ""),
        META,
        Check::Gate,
    ),
    row(
        "first-instance-id-kept",
        "all instances count their triangles from the same index",
        text("accel/meta_bvh", "first_id = entry.first_id;", ""),
        META,
        Check::Gate,
    ),
    row(
        "identity-taken-for-granted",
        "no ray is transformed",
        text("accel/instance", "(entry.z.w & IDENTITY) != 0u", "true"),
        NESTED,
        Check::Gate,
    ),
    row(
        "far-instance-not-visited",
        "only the near child is visited",
        text("accel/meta_bvh_nested", "side < 2u", "side < 1u"),
        NESTED,
        Check::Gate,
    ),
    row(
        "object-left-too-early",
        "the far child of an object's node is not pushed",
        text("accel/instance", "push(&stack, children.far);", ""),
        NESTED,
        Check::Lattice,
    ),
    row(
        "ray-not-raised-in-an-object",
        "in an object's space a component of a direction may be 0",
        text(
            "accel/meta_bvh",
            "level(raised(object_ray(entry, ray)), 0.0)",
            "level(object_ray(entry, ray), 0.0)",
        ),
        META,
        Check::Gate,
    ),
    row(
        "unmoved-copy-taken-for-its-object",
        "rays into copies without a translation are not transformed",
        text(
            "accel/instance",
            "(entry.z.w & IDENTITY) != 0u",
            "entry.offset.x == 0.0 && entry.offset.y == 0.0",
        ),
        META,
        Check::Gate,
    ),
];

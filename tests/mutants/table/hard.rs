//! Faults that show only next to zero, in long tables, in deep trees, for the last entries of stacks, for far
//! origins, and in a second dispatch.

use super::{row, structure, text};
use crate::{Check, Mutant, Subject};

const BRUTE: Subject = structure("brute-force", &[]);
const BVH: Subject = structure("bvh", &[]);
const BOXES: Subject = structure("bvh", &[("node_bytes", "32")]);
const LARGE_LEAVES: Subject = structure("bvh", &[("leaf_size", "31"), ("min_leaf_size", "31")]);
const INDEXED: Subject = structure("bvh", &[("triangles", "indexed")]);
const PARENT: Subject = structure("bvh", &[("traversal", "parent-pointer")]);
const OCTANTS: Subject = structure("bvh", &[("traversal", "octant-roped")]);
const WIDE4: Subject = structure("bvh4", &[]);
const WIDE8: Subject = structure("cwbvh", &[]);
const UNIFORM: Subject = structure("uniform-grid", &[]);
const SKIPPING: Subject = structure("uniform-grid", &[("skip", "chebyshev")]);
const TWO_LEVEL: Subject = structure("two-level-grid", &[]);
const IRREGULAR: Subject = structure("irregular-grid", &[]);
const OCTREE: Subject = structure("octree", &[]);
const KD: Subject = structure("kd-tree", &[]);
const LIST: Subject = structure("object-list", &[]);
const META: Subject = structure("meta-bvh", &[]);

pub const MUTANTS: &[Mutant] = &[
    // Triangles that are seen edge-on.
    row(
        "edge-on-too-soon",
        "triangles are edge-on at twice the limit",
        text(
            "accel/triangle/watertight",
            "const EDGE_ON: f32 = 5.9604645e-8;",
            "const EDGE_ON: f32 = 1.1920929e-7;",
        ),
        BVH,
        Check::Gate,
    ),
    row(
        "edge-on-too-late",
        "triangles are edge-on at half the limit",
        text(
            "accel/triangle/watertight",
            "const EDGE_ON: f32 = 5.9604645e-8;",
            "const EDGE_ON: f32 = 2.9802322e-8;",
        ),
        BVH,
        Check::Gate,
    ),
    // Zero components and −0.
    row(
        "grid-walks-back-at-zero",
        "where a component is 0 the walk leaves by the plane behind",
        text(
            "accel/uniform_grid",
            "let forward = inverse >= vec3<f32>(0.0);",
            "let forward = (inverse >= vec3<f32>(0.0)) & (inverse < vec3<f32>(1e12));",
        ),
        UNIFORM,
        Check::Lattice,
    ),
    row(
        "parts-walk-back-at-zero",
        "where a component is 0 the walk leaves by the plane behind",
        text(
            "accel/two_level_grid",
            "let forward = inverse >= vec3<f32>(0.0);",
            "let forward = (inverse >= vec3<f32>(0.0)) & (inverse < vec3<f32>(1e12));",
        ),
        TWO_LEVEL,
        Check::Lattice,
    ),
    row(
        "boxes-walk-back-at-zero",
        "where a component is 0 the walk leaves by the plane behind",
        text(
            "accel/irregular_grid",
            "let forward = inverse >= vec3<f32>(0.0);",
            "let forward = (inverse >= vec3<f32>(0.0)) & (inverse < vec3<f32>(1e12));",
        ),
        IRREGULAR,
        Check::Lattice,
    ),
    row(
        "grid-walks-forward-at-minus-zero",
        "where a component is −0 the walk leaves by the plane ahead",
        text(
            "accel/uniform_grid",
            "let forward = inverse >= vec3<f32>(0.0);",
            "let forward = (inverse >= vec3<f32>(0.0)) | (inverse < vec3<f32>(-1e12));",
        ),
        UNIFORM,
        Check::Lattice,
    ),
    row(
        "wide-planes-of-minus-zero",
        "where a component is −0 near planes are taken for far ones",
        text(
            "accel/bvh4",
            "let backward = inverse < vec3<f32>(0.0);",
            "let backward = (inverse < vec3<f32>(0.0)) & (inverse > vec3<f32>(-1e12));",
        ),
        WIDE4,
        Check::Lattice,
    ),
    row(
        "wide-octant-of-minus-zero",
        "where a component is −0 near planes are taken for far ones",
        text(
            "accel/cwbvh",
            "let backward = inverse < vec3<f32>(0.0);",
            "let backward = (inverse < vec3<f32>(0.0)) & (inverse > vec3<f32>(-1e12));",
        ),
        WIDE8,
        Check::Lattice,
    ),
    row(
        "kd-side-of-minus-zero",
        "where a component is −0 the far side of a plane is taken for the near one",
        text(
            "accel/kd_tree",
            "let side = u32(slope < 0.0);",
            "let side = u32(slope < 0.0 && abs(slope) < 1e19);",
        ),
        KD,
        Check::Gate,
    ),
    row(
        "octree-mirror-of-minus-zero",
        "where a component is −0 the octant is not mirrored",
        text(
            "accel/octree",
            "let mirror = vec3<u32>(inverse < vec3<f32>(0.0));",
            "let mirror = vec3<u32>((inverse < vec3<f32>(0.0)) & (inverse > vec3<f32>(-1e12)));",
        ),
        OCTREE,
        Check::Lattice,
    ),
    // Long tables.
    row(
        "second-row-of-texels",
        "what lies beyond the first row of texels is read from the first",
        text("common/texels", "index >> ROW_SHIFT)", "0u)"),
        WIDE4,
        Check::Gate,
    ),
    row(
        "third-row-of-texels",
        "what lies beyond the second row of texels is read from the second",
        text(
            "common/texels",
            "index >> ROW_SHIFT)",
            "min(index >> ROW_SHIFT, 1u))",
        ),
        WIDE8,
        Check::Gate,
    ),
    row(
        "row-of-texels-one-short",
        "the last texel of a row is taken for the first of the next",
        text(
            "common/texels",
            "return vec2<u32>(index & ROW_MASK, index >> ROW_SHIFT);",
            "return vec2<u32>(select(index & ROW_MASK, 0u, (index & ROW_MASK) == ROW_MASK), index >> ROW_SHIFT);",
        ),
        WIDE4,
        Check::Gate,
    ),
    row(
        "first-triangle-of-13-bits",
        "leaves behind the 8192nd triangle are looked for before it",
        text(
            "accel/leaf",
            "const FIRST_MASK: u32 = 0x03ffffffu;",
            "const FIRST_MASK: u32 = 0x00001fffu;",
        ),
        INDEXED,
        Check::Gate,
    ),
    row(
        "child-of-11-bits",
        "nodes behind the 2048th are looked for before it",
        text(
            "accel/bvh/boxes",
            "const CHILD_MASK: u32 = 0x1fffffffu;",
            "const CHILD_MASK: u32 = 0x000007ffu;",
        ),
        BOXES,
        Check::Gate,
    ),
    row(
        "wide-child-of-9-bits",
        "nodes behind the 512th are looked for before it",
        text(
            "accel/cwbvh",
            "const INDEX_MASK: u32 = 0x00ffffffu;",
            "const INDEX_MASK: u32 = 0x000001ffu;",
        ),
        WIDE8,
        Check::Gate,
    ),
    row(
        "wide-child-of-10-bits",
        "nodes behind the 1024th are looked for before it",
        text(
            "accel/bvh4",
            "const INDEX_MASK: u32 = 0x00ffffffu;",
            "const INDEX_MASK: u32 = 0x000003ffu;",
        ),
        WIDE4,
        Check::Gate,
    ),
    row(
        "skipping-start-of-13-bits",
        "lists behind the 8192nd reference are looked for before it",
        text(
            "accel/uniform_grid",
            "const START_MASK: u32 = 0x01ffffffu;",
            "const START_MASK: u32 = 0x00001fffu;",
        ),
        SKIPPING,
        Check::Lattice,
    ),
    row(
        "leaf-of-sixteen-and-more",
        "leaves of more than fifteen triangles lose sixteen",
        text(
            "accel/leaf",
            "const COUNT_MASK: u32 = 31u;",
            "const COUNT_MASK: u32 = 15u;",
        ),
        LARGE_LEAVES,
        Check::Lattice,
    ),
    row(
        "leaf-of-the-largest-size",
        "a leaf of 31 triangles loses the last one",
        text(
            "accel/leaf",
            "((reference >> COUNT_SHIFT) & COUNT_MASK)",
            "min((reference >> COUNT_SHIFT) & COUNT_MASK, 30u)",
        ),
        LARGE_LEAVES,
        Check::Lattice,
    ),
    // Deep trees.
    row(
        "octree-stack-wraps",
        "the ninth level of the octree replaces the first on the stack",
        text(
            "accel/octree",
            "stack[entries] = open;",
            "stack[entries & 7u] = open;",
        ),
        OCTREE,
        Check::Gate,
    ),
    row(
        "kd-stack-wraps",
        "the ninth cell that waits replaces the first",
        text(
            "accel/kd_tree",
            "waiting[entries] = far;",
            "waiting[entries & 7u] = far;",
        ),
        KD,
        Check::Gate,
    ),
    row(
        "octant-of-z-above-the-axes",
        "ropes of the four upper octants are those of the lower",
        text("accel/bvh/octant_roped", "2u + (octant >> 2u)", "2u"),
        OCTANTS,
        Check::Lattice,
    ),
    row(
        "parent-of-a-late-node",
        "from nodes behind the 2048th the way up leads to the root",
        text(
            "accel/bvh/pairs",
            "return node_words(4u * node + 1u).w;",
            "return select(node_words(4u * node + 1u).w, 0u, node > 2048u);",
        ),
        PARENT,
        Check::Gate,
    ),
    // Instances.
    row(
        "world-boxes-do-not-grow",
        "boxes of instances are not grown for origins far away",
        text(
            "accel/object_list",
            "level(ray, instancing.growth)",
            "level(ray, -instancing.growth)",
        ),
        LIST,
        Check::Gate,
    ),
    row(
        "upper-boxes-do-not-grow",
        "boxes above instances are not grown for origins far away",
        text(
            "accel/meta_bvh",
            "level(ray, instancing.growth)",
            "level(ray, -instancing.growth)",
        ),
        META,
        Check::Gate,
    ),
    row(
        "object-without-its-start",
        "inside an object hits before t_min count",
        text(
            "accel/instance",
            "return Ray(origin, ray.t_min, direction, ray.t_max);",
            "return Ray(origin, 0.0, direction, ray.t_max);",
        ),
        LIST,
        Check::Gate,
    ),
    row(
        "level-returns-too-late",
        "an object is left only when the whole stack is empty",
        text(
            "accel/meta_bvh",
            "if (stack.held == floor) {",
            "if (stack.held == floor && floor == 0u) {",
        ),
        META,
        Check::Gate,
    ),
    // Batches.
    row(
        "last-workgroup-dropped",
        "rays of the last workgroup are not traced if it is not full",
        text(
            "integrator/trace_rays",
            "if (item >= ray_total()) {",
            "if (item >= ray_total() || (ray_total() > 64u && (item | 63u) >= ray_total())) {",
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "second-row-of-workgroups",
        "workgroups beyond the first row trace the rays of the first",
        text(
            "integrator/trace_rays",
            "let item = id.x + id.y * groups.x * LANES;",
            "let item = id.x;",
        ),
        BVH,
        Check::Gate,
    ),
    row(
        "too-short-is-a-ray",
        "a direction may be as short as it likes",
        text(
            "integrator/trace_rays",
            "&& direction >= bitcast<u32>(SMALLEST_DIRECTION)",
            "",
        ),
        BVH,
        Check::Gate,
    ),
    row(
        "rays-of-a-later-slice",
        "a dispatch that does not begin with the first ray begins with it all the same",
        text(
            "integrator/trace_rays",
            "let ray = load_ray(index);",
            "let ray = load_ray(select(index, item, batch.first > 512u));",
        ),
        BRUTE,
        Check::Lattice,
    ),
    row(
        "second-dispatch-traces-nothing",
        "a ray that was traced before keeps what stands in the buffer",
        text(
            "integrator/trace_rays",
            "    let ray = load_ray(index);",
            "    if (index == 77u && atomicAdd(&package::common::errors::status[15], 1u) > 0u) { return; }\n    let ray = load_ray(index);",
        ),
        BVH,
        Check::Gate,
    ),
    row(
        "grid-entered-before-t-min",
        "the walk begins where the ray enters the grid, before its segment: slower, and no other answer",
        text(
            "accel/irregular_grid",
            "inverse, ray.t_min, ray.t_max);",
            "inverse, 0.0, ray.t_max);",
        ),
        IRREGULAR,
        Check::Work,
    ),
];

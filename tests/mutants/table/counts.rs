//! Faults of counts: rays, and the work that they take. Answers are right with all of them.

use super::{row, structure, text};
use crate::{Check, Mutant, Subject};

const SINGLE: Subject = Subject::Organised("single-kernel");
const WAVES: Subject = Subject::Organised("wavefront");
const BVH: Subject = structure("bvh", &[]);
const WIDE: Subject = structure("cwbvh", &[]);

pub const MUTANTS: &[Mutant] = &[
    row(
        "primary-rays-counted-twice",
        "primary rays count twice",
        text(
            "common/ray_counts",
            "ray_counts[kind]++;",
            "ray_counts[kind] += select(1u, 2u, kind == RAY_PRIMARY);",
        ),
        SINGLE,
        Check::Counts,
    ),
    row(
        "shadow-rays-counted-twice",
        "shadow rays count twice",
        text(
            "common/ray_counts",
            "ray_counts[kind]++;",
            "ray_counts[kind] += select(1u, 2u, kind == RAY_SHADOW);",
        ),
        SINGLE,
        Check::Counts,
    ),
    row(
        "occlusion-rays-counted-twice",
        "rays of ambient occlusion count twice",
        text(
            "common/ray_counts",
            "ray_counts[kind]++;",
            "ray_counts[kind] += select(1u, 2u, kind == RAY_AO);",
        ),
        SINGLE,
        Check::Counts,
    ),
    row(
        "bounced-rays-counted-twice",
        "bounced rays count twice",
        text(
            "common/ray_counts",
            "ray_counts[kind]++;",
            "ray_counts[kind] += select(1u, 2u, kind == RAY_BOUNCE);",
        ),
        SINGLE,
        Check::Counts,
    ),
    row(
        "counts-added-twice",
        "an invocation adds its counts twice",
        text(
            "common/ray_counts",
            "let before = atomicAdd(&status[1u + 2u * total], count);",
            "let before = atomicAdd(&status[1u + 2u * total], 2u * count);",
        ),
        SINGLE,
        Check::Counts,
    ),
    row(
        "live-paths-end-at-three-bounces",
        "paths are counted as if none bounced four times",
        text(
            "common/ray_counts",
            "live_counts[min(depth, DEPTHS - 1u)]++;",
            "live_counts[min(depth, 3u)]++;",
        ),
        SINGLE,
        Check::Counts,
    ),
    row(
        "live-paths-a-bounce-late",
        "paths are counted one bounce later",
        text(
            "common/ray_counts",
            "live_counts[min(depth, DEPTHS - 1u)]++;",
            "live_counts[min(depth + 1u, DEPTHS - 1u)]++;",
        ),
        SINGLE,
        Check::Counts,
    ),
    row(
        "unsent-rays-counted-as-shadow-rays",
        "light samples without a ray count as shadow rays",
        text(
            "integrator/path",
            "@if(ray_counts) count_ray(RAY_SKIPPED);",
            "@if(ray_counts) count_ray(RAY_SHADOW);",
        ),
        SINGLE,
        Check::Counts,
    ),
    row(
        "queued-rays-counted-twice",
        "each ray of a path counts twice in queues",
        text(
            "organisation/shade",
            "@if(ray_counts) count_path_ray(stored.path.depth);",
            "@if(ray_counts) count_path_ray(stored.path.depth); @if(ray_counts) count_path_ray(stored.path.depth);",
        ),
        WAVES,
        Check::Counts,
    ),
    row(
        "nodes-counted-twice",
        "every node counts twice",
        text(
            "common/counters",
            "counters.nodes++;",
            "counters.nodes += 2u;",
        ),
        BVH,
        Check::Work,
    ),
    row(
        "box-tests-counted-twice",
        "every box test counts twice",
        text(
            "common/counters",
            "counters.box_tests++;",
            "counters.box_tests += 2u;",
        ),
        BVH,
        Check::Work,
    ),
    row(
        "wide-box-tests-counted-twice",
        "every test of a wide node counts twice",
        text(
            "common/counters",
            "counters.box_tests += tests;",
            "counters.box_tests += 2u * tests;",
        ),
        WIDE,
        Check::Work,
    ),
    row(
        "triangle-tests-counted-twice",
        "every triangle test counts twice",
        text(
            "common/counters",
            "counters.triangle_tests++;",
            "counters.triangle_tests += 2u;",
        ),
        WIDE,
        Check::Work,
    ),
    row(
        "stack-counted-one-high",
        "the stack counts an entry too many",
        text(
            "common/counters",
            "max(counters.stack_high_water, entries)",
            "max(counters.stack_high_water, entries + 1u)",
        ),
        BVH,
        Check::Work,
    ),
    row(
        "tests-of-boxes-and-triangles-exchanged",
        "box tests stand for triangle tests",
        text(
            "integrator/trace_rays",
            "vec4<u32>(counters.nodes, counters.box_tests, counters.triangle_tests,",
            "vec4<u32>(counters.nodes, counters.triangle_tests, counters.box_tests,",
        ),
        BVH,
        Check::Work,
    ),
];

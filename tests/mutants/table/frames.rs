//! Faults of images that small pictures do not show: many pixels, borders of dispatches, full queues.

use super::{row, text};
use crate::{Check, Mutant, Subject};

const SINGLE: Subject = Subject::Organised("single-kernel");
const REGEN: Subject = Subject::Organised("regeneration");
const KERNELS: Subject = Subject::Organised("multi-kernel");
const WAVES: Subject = Subject::Organised("wavefront");

pub const MUTANTS: &[Mutant] = &[
    row(
        "pixels-beyond-16-bits-repeat",
        "pixel 65536 draws what the first one draws",
        text(
            "integrator/render",
            "let pixel = y * frame.width + x;",
            "let pixel = (y * frame.width + x) & 0xffffu;",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "upper-pixels-darker",
        "pixels from 32768 on are a hundredth too dark",
        text(
            "integrator/render",
            "radiance(vec2<u32>(x, y), &sampler)",
            "radiance(vec2<u32>(x, y), &sampler) * select(1.0, 0.99, pixel >= 32768u)",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "last-column-like-its-neighbour",
        "the last column shows the one before",
        text(
            "integrator/render",
            "radiance(vec2<u32>(x, y), &sampler)",
            "radiance(vec2<u32>(min(x, frame.width - 2u), y), &sampler)",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "last-row-like-its-neighbour",
        "the last row shows the one before",
        text(
            "integrator/render",
            "radiance(vec2<u32>(x, y), &sampler)",
            "radiance(vec2<u32>(x, min(y, frame.height - 2u)), &sampler)",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "last-column-dropped",
        "the last column takes no samples",
        text(
            "integrator/render",
            "let is_outside = x >= frame.width || id.y",
            "let is_outside = x + 1u >= frame.width || id.y",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "last-workgroup-dark",
        "the last workgroup is black",
        text(
            "integrator/render",
            "radiance(vec2<u32>(x, y), &sampler)",
            "radiance(vec2<u32>(x, y), &sampler) * select(1.0, 0.0, x / 8u == (frame.width - 1u) / 8u && y / 8u == (frame.height - 1u) / 8u)",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "last-lane-of-a-row-doubled",
        "the last column of each workgroup shows the one before",
        text(
            "integrator/render",
            "radiance(vec2<u32>(x, y), &sampler)",
            "radiance(vec2<u32>(x - select(0u, 1u, (x & 7u) == 7u), y), &sampler)",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "corner-dark",
        "the last pixel is a thousandth too dark",
        text(
            "integrator/render",
            "radiance(vec2<u32>(x, y), &sampler)",
            "radiance(vec2<u32>(x, y), &sampler) * select(1.0, 0.999, pixel + 1u == frame.width * frame.height)",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "pixels-numbered-in-their-slice",
        "each slice draws from pixel 0 on",
        text(
            "integrator/render",
            "let pixel = y * frame.width + x;",
            "let pixel = id.y * frame.width + x;",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "slices-look-from-the-top",
        "each slice shows the first rows",
        text(
            "integrator/render",
            "radiance(vec2<u32>(x, y), &sampler)",
            "radiance(vec2<u32>(x, id.y), &sampler)",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "samples-numbered-in-their-slice",
        "each dispatch draws from sample 0 on",
        text("integrator/render", "frame.first_sample + i", "i"),
        SINGLE,
        Check::Frames,
    ),
    row(
        "samples-numbered-in-their-block",
        "sample 256 draws what the first one draws",
        text(
            "integrator/render",
            "frame.first_sample + i",
            "((frame.first_sample + i) & 255u)",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "fourth-sample-repeated",
        "the fourth sample of a dispatch is the third",
        text(
            "integrator/render",
            "frame.first_sample + i",
            "frame.first_sample + min(i, 2u)",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "wide-images-cut",
        "images are as wide as 256 pixels",
        text(
            "integrator/frame",
            "vec2<f32>(f32(frame.width), f32(frame.height))",
            "vec2<f32>(f32(min(frame.width, 256u)), f32(frame.height))",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "high-images-cut",
        "images are as high as 250 pixels",
        text(
            "integrator/frame",
            "vec2<f32>(f32(frame.width), f32(frame.height))",
            "vec2<f32>(f32(frame.width), f32(min(frame.height, 250u)))",
        ),
        SINGLE,
        Check::Frames,
    ),
    row(
        "full-queue-one-short",
        "of exactly full queues the last slot stays empty",
        text(
            "organisation/generate",
            "if (slot >= begun)",
            "if (slot + select(0u, 1u, begun == batch.capacity) >= begun)",
        ),
        WAVES,
        Check::Frames,
    ),
    row(
        "full-queue-refused",
        "a queue that is exactly full counts as too short",
        text(
            "organisation/plan",
            "if (live > batch.capacity)",
            "if (live >= batch.capacity)",
        ),
        WAVES,
        Check::Frames,
    ),
    row(
        "last-path-never-begins",
        "the last path in line gets no slot",
        text(
            "organisation/finish",
            "if (next < batch.total)",
            "if (next + 1u < batch.total)",
        ),
        WAVES,
        Check::Frames,
    ),
    row(
        "last-path-begun-twice",
        "the last path in line is the one before",
        text(
            "organisation/finish",
            "stored = new_slot(next);",
            "stored = new_slot(min(next, batch.total - 2u));",
        ),
        WAVES,
        Check::Frames,
    ),
    row(
        "late-paths-begin-darker",
        "paths that waited for a slot are a hundredth too dark",
        text(
            "organisation/finish",
            "stored = new_slot(next);",
            "stored = new_slot(next); stored.path.throughput *= 0.99;",
        ),
        WAVES,
        Check::Frames,
    ),
    row(
        "queued-slices-look-from-the-top",
        "each slice shows the first rows",
        text(
            "organisation/paths",
            "frame.first_row + pixel / frame.width",
            "pixel / frame.width",
        ),
        WAVES,
        Check::Frames,
    ),
    row(
        "queued-samples-all-the-first",
        "all samples of a dispatch are its first",
        text(
            "organisation/paths",
            "frame.first_sample + number % frame.samples",
            "frame.first_sample",
        ),
        WAVES,
        Check::Frames,
    ),
    row(
        "queued-seed-of-the-upper-half",
        "rows from 128 on draw with another seed",
        text(
            "organisation/paths",
            "0u, frame.seed)",
            "0u, frame.seed + pixel.y / 128u)",
        ),
        WAVES,
        Check::Frames,
    ),
    row(
        "last-column-added-from-its-neighbour",
        "results of the last column are those of the one before",
        text(
            "organisation/accumulate",
            "results[(id.y * frame.width + id.x)",
            "results[(id.y * frame.width + min(id.x, frame.width - 2u))",
        ),
        KERNELS,
        Check::Frames,
    ),
    row(
        "first-result-added-again",
        "every sample of a dispatch adds its first result",
        text(
            "organisation/accumulate",
            "* frame.samples + i]",
            "* frame.samples]",
        ),
        KERNELS,
        Check::Frames,
    ),
    row(
        "regenerated-pixels-in-their-slice",
        "each slice draws from pixel 0 on",
        text(
            "organisation/regeneration",
            "let pixel = row * frame.width + id.x;",
            "let pixel = id.y * frame.width + id.x;",
        ),
        REGEN,
        Check::Frames,
    ),
    row(
        "regenerated-samples-in-their-block",
        "sample 256 draws what the first one draws",
        text(
            "organisation/regeneration",
            "frame.first_sample + done, 0u",
            "(frame.first_sample + done) & 255u, 0u",
        ),
        REGEN,
        Check::Frames,
    ),
    row(
        "paths-sorted-by-other-octants",
        "the bits of x and y are exchanged in the octant of a sorted path: the same images in other times",
        text(
            "organisation/ray_keys",
            "vec3<u32>(1u, 2u, 4u)",
            "vec3<u32>(2u, 1u, 4u)",
        ),
        WAVES,
        Check::Frames,
    ),
    row(
        "sorted-paths-without-y",
        "of the place of a sorted path the cell along y falls onto that along x: the same images in other times",
        text(
            "organisation/ray_keys",
            "(spread(cell.y) << 1u)",
            "spread(cell.y)",
        ),
        WAVES,
        Check::Frames,
    ),
    row(
        "hits-sorted-by-triangles",
        "hits are sorted by their triangles, not by their materials: the same images in other times",
        text(
            "organisation/material_keys",
            "min(met_material(triangle), 0xfffdu)",
            "min(triangle, 0xfffdu)",
        ),
        WAVES,
        Check::Frames,
    ),
];

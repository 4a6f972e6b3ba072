//! Faults of narrow kinds: ends of maps and luminaires, an order of decoding and filtering, narrow facets, places in queues.

use super::{row, text};
use crate::{Check, Mutant, Plant, Subject};

const WAVEFRONT: Subject = Subject::Organised("wavefront");

const fn path(name: &'static str, what: &'static str, plant: Plant) -> Mutant {
    row(name, what, plant, Subject::Paths, Check::Paths)
}

const fn queue(name: &'static str, what: &'static str, plant: Plant) -> Mutant {
    row(name, what, plant, WAVEFRONT, Check::Frames)
}

pub const MUTANTS: &[Mutant] = &[
    path(
        "map-below-the-last-row",
        "straight down a map is read half a row too high",
        text(
            "shading/light/environment",
            "f32(map.y - 1u));",
            "f32(map.y) - 1.5);",
        ),
    ),
    path(
        "wide-map-cut",
        "columns of a map from the 1024th on are the first ones",
        text(
            "shading/light/environment",
            "texels + y * map.x + x).xyz",
            "texels + y * map.x + (x & 1023u)).xyz",
        ),
    ),
    path(
        "luminaire-of-two-columns-is-axial",
        "two horizontal angles are taken for one that stands for all",
        text(
            "shading/light/ies",
            "let axial = head.z == 1u;",
            "let axial = head.z <= 2u;",
        ),
    ),
    path(
        "luminaire-column-of-another-length",
        "the column after is looked for by the number of columns, not of rows",
        text(
            "shading/light/ies",
            "+ column.high * head.y",
            "+ column.high * head.z",
        ),
    ),
    path(
        "colours-decoded-after-the-filter",
        "texels are mixed as they are encoded, and the mixture is decoded",
        text(
            "shading/texture",
            "return bilinear(at, uv, true);",
            "return decode_srgb(bilinear(at, uv, false));",
        ),
    ),
    path(
        "pane-with-one-inner-reflection",
        "a pane reflects light inside itself once",
        text(
            "shading/bsdf/dielectric",
            "reflectance = 2.0 * reflectance / (1.0 + reflectance);",
            "reflectance = 2.0 * reflectance - reflectance * reflectance;",
        ),
    ),
    path(
        "facets-never-narrow",
        "facets are no narrower than those of roughness 0.1",
        text(
            "shading/bsdf/principled",
            "return max(roughness * roughness, 0.001);",
            "return max(roughness * roughness, 0.01);",
        ),
    ),
    queue(
        "answer-of-another-shadow-ray",
        "a path is lit by the shadow ray in the place of its own slot",
        text(
            "organisation/finish",
            "answers[batch.capacity + stored.shadow].x",
            "answers[batch.capacity + place].x",
        ),
    ),
    queue(
        "last-live-path-forgotten",
        "after a compaction one path less is alive than was kept",
        text(
            "organisation/plan",
            "let live = kept_count[0];",
            "let live = max(kept_count[0], 1u) - 1u;",
        ),
    ),
    queue(
        "shadow-rays-counted-on",
        "the next bounce puts its shadow rays behind those of the last",
        text(
            "organisation/plan",
            "    atomicStore(&counts[SHADOWS], 0u);\n    write_groups(live);",
            "    write_groups(live);",
        ),
    ),
];

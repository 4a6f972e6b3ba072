//! Faults of connections over mirrors that single paths show.

use super::{row, text, texts};
use crate::{Check, Mutant, Plant, Subject};

const fn fault(name: &'static str, what: &'static str, plant: Plant) -> Mutant {
    row(name, what, plant, Subject::Paths, Check::Paths)
}

pub const MUTANTS: &[Mutant] = &[
    fault(
        "specular-spread-two-percent",
        "the area that a solid angle lights over a mirror is a fiftieth too large",
        text(
            "integrator/connection",
            "let spread = abs(across_of(shot)) *",
            "let spread = 1.02 * abs(across_of(shot)) *",
        ),
    ),
    fault(
        "specular-spread-half-percent",
        "that area is half a percent too small",
        text(
            "integrator/connection",
            "let spread = abs(across_of(shot)) *",
            "let spread = 0.995 * abs(across_of(shot)) *",
        ),
    ),
    fault(
        "specular-spread-without-distance",
        "that area lacks a factor of the distance to the mirror",
        text(
            "integrator/connection",
            "shot.near * shot.near / abs(",
            "shot.near / abs(",
        ),
    ),
    fault(
        "specular-spread-without-cosine",
        "that area lacks the cosine at the mirror",
        text(
            "integrator/connection",
            "/ abs(dot(shot.direction, mirror.across))",
            "/ length(mirror.across)",
        ),
    ),
    fault(
        "specular-curvature-halved",
        "normals of mirrors change half as fast as they do",
        text(
            "integrator/connection",
            "let bent = (turn",
            "let bent = 0.5 * (turn",
        ),
    ),
    fault(
        "specular-curvature-not-of-unit-length",
        "the change of interpolated normals keeps its part along them",
        text(
            "integrator/connection",
            "(turn - n * dot(n, turn)) / size",
            "turn / size",
        ),
    ),
    fault(
        "specular-normals-exchanged",
        "the normals of two corners of a mirror are exchanged",
        text(
            "integrator/connection",
            "let n1 = decode_normal(table_word(at + 1u), face)",
            "let n1 = decode_normal(table_word(at + 2u), face)",
        ),
    ),
    fault(
        "specular-way-to-the-mirror-free",
        "nothing blocks the way to the mirror",
        text(
            "integrator/connection",
            "if (any_hit(leg)) {",
            "if (false) {",
        ),
    ),
    fault(
        "specular-way-to-the-light-free",
        "nothing blocks the way from the mirror to the light",
        text(
            "integrator/connection",
            "if (any_hit(light.shadow)) {",
            "if (false) {",
        ),
    ),
    fault(
        "specular-found-by-both",
        "light found over a mirror by chance counts in full although connections find it",
        text(
            "integrator/path",
            "if (other > 0.0) { return found_weight(before.density, other); }",
            "",
        ),
    ),
    fault(
        "specular-holed-mirrors-connect",
        "paths over mirrors that are left out are weighted as if connections found them",
        text("integrator/connection", "& 1u) != 0u;", "& 1u) != 2u;"),
    ),
    fault(
        "specular-without-tint",
        "connections leave out the mirror's colour",
        text(
            "integrator/connection",
            "* mirror_sample(mirror).weight *",
            "*",
        ),
    ),
    fault(
        "specular-weights-one-sided",
        "connections are weighted as if the material found half as much",
        text(
            "integrator/connection",
            "let competing = select(min(density / light.pdf, 1e18)",
            "let competing = select(min(0.5 * density / light.pdf, 1e18)",
        ),
    ),
    fault(
        "specular-tree-prunes-too-much",
        "bounds of mirrors leave out how large they are",
        text("integrator/connection", "+ arc + MARGIN", "+ MARGIN"),
    ),
    fault(
        "specular-tree-skips-one",
        "the node after those left out is left out",
        text(
            "integrator/connection",
            "node = links.x;",
            "node = links.x + 1u;",
        ),
    ),
    fault(
        "specular-choice-forgotten",
        "connections forget how probable the light was",
        text(
            "integrator/connection",
            "light.pdf *= probability * found.spread",
            "light.pdf *= found.spread",
        ),
    ),
    fault(
        "specular-a-bounce-too-long",
        "connections go a bounce beyond the last",
        texts(
            "integrator/path",
            "if (depth + 2u <= MAX_DEPTH)",
            "if (depth + 1u <= MAX_DEPTH)",
            2,
        ),
    ),
    fault(
        "specular-half-a-sphere",
        "the area of a sphere light is taken for half of it",
        text(
            "integrator/connection",
            "let pdf = distance * distance / (2.0 * TWO_PI",
            "let pdf = distance * distance / (TWO_PI",
        ),
    ),
    fault(
        "specular-one-step",
        "the search for a point of reflection ends after one step",
        text(
            "integrator/connection",
            "const STEPS: u32 = 10u;",
            "const STEPS: u32 = 1u;",
        ),
    ),
    fault(
        "specular-density-of-the-mirror",
        "the density of the direction to the mirror is doubled",
        text(
            "integrator/path",
            "{ known = density; }",
            "{ known = 2.0 * density; }",
        ),
    ),
    fault(
        "specular-cosine-at-the-light-forgotten",
        "weights of light found over a mirror lack the cosine there",
        text(
            "integrator/connection",
            "found.spread / (area * max(cosine, 1e-6))",
            "found.spread / area",
        ),
    ),
    row(
        "specular-fog-before-the-mirror-clear",
        "connections lose no light in the medium on the way to the mirror",
        text(
            "integrator/connection",
            "transmittance(leg, frame.lights + 2u * index) * ",
            "",
        ),
        Subject::Media,
        Check::Media,
    ),
];

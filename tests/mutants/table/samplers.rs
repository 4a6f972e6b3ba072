//! Faults of sequences and decorrelations.

use super::words::*;
use super::{row, text};
use crate::subject::Changes;
use crate::{Check, Mutant, Plant, Subject};

pub const fn sampler(
    sequence: &'static str,
    changes: Changes,
    decorrelation: &'static str,
) -> Subject {
    Subject::Sampler {
        sequence,
        changes,
        decorrelation,
    }
}

const HASH: Subject = sampler("pixel-hash", &[], "none");
const SOBOL: Subject = sampler("sobol", &[], "none");
const HALTON: Subject = sampler("halton", &[], "cranley-patterson");
const FAURE: Subject = sampler("halton", &[("digits", "faure")], "none");
const OWEN: Subject = sampler("sobol", &[], "owen-hash");
const SHARED: Subject = sampler("pixel-hash", &[("seeding", "sample")], "none");
const SPARSE: Subject = sampler("pixel-hash", &[("seeding", "sparse")], "none");

pub const MUTANTS: &[Mutant] = &[
    row(
        "shift-reused-for-two-dimensions",
        "both dimensions of a pair get the same shift",
        text(
            "sampling/hash",
            "keyed_hash(pixel_number(s), s.dimension)",
            "keyed_hash(pixel_number(s), s.dimension >> 1u)",
        ),
        HALTON,
        Check::Stream,
    ),
    row(
        "seed-dropped",
        "all seeds draw the same",
        text("sampling/hash", "pcg_hash(s.seed), s.pixel", "0u, s.pixel"),
        OWEN,
        Check::Stream,
    ),
    row(
        "shared-seed-by-column",
        "the seed of all pixels still depends on the pixel",
        text("sampling/seeding", "return 0u;", "return pixel & 1u;"),
        SHARED,
        Check::Stream,
    ),
    row(
        "sparse-seed-of-a-whole-tile",
        "all pixels of a tile share a seed, and not one of eight in each direction",
        text("sampling/seeding", " + at % stride", ""),
        SPARSE,
        Check::Stream,
    ),
    row(
        "sparse-seed-of-neighbours",
        "the pixels that share a seed lie side by side",
        text("sampling/seeding", "seeding == SPARSE", "seeding > 9u"),
        SPARSE,
        Check::Stream,
    ),
    row(
        "owen-key-not-added",
        "the key of a scramble only scales",
        text("sampling/owen", "    x += key;\n", ""),
        OWEN,
        Check::Stream,
    ),
    row(
        "owen-bits-not-reversed",
        "digits are scrambled from the wrong end",
        text(
            "sampling/owen",
            "reverseBits(scramble_reversed(reverseBits(x), key))",
            "scramble_reversed(x, key)",
        ),
        OWEN,
        Check::Stream,
    ),
    row(
        "jitter-clamped",
        "a shift beyond 0 stops there, where it should wrap",
        text(
            "sampling/micro_jitter",
            "CLAMP == 1u && up < down && moved > x",
            "up < down && moved > x",
        ),
        sampler("sobol", &[], "micro-jitter"),
        Check::Stream,
    ),
    row(
        "bits-set-instead-of-flipped",
        "a digital shift sets bits",
        text(
            "sampling/digital_shift",
            "x ^ dimension_number(s)",
            "x | dimension_number(s)",
        ),
        sampler("sobol", &[], "digital-shift"),
        Check::Stream,
    ),
    row(
        "strata-in-one-order",
        "all pairs of dimensions visit their strata in the same order",
        text(
            "sampling/jittered",
            "keyed_hash(pixel_number(s) ^ PAIR_KEY, s.dimension >> 1u)",
            "keyed_hash(pixel_number(s) ^ PAIR_KEY, 0u)",
        ),
        sampler("jittered", &[], "none"),
        Check::Stream,
    ),
    row(
        "rows-for-columns",
        "both coordinates of a stratum are its column",
        text(
            "sampling/jittered",
            "i = stratum / columns;",
            "i = stratum % columns;",
        ),
        sampler("jittered", &[], "none"),
        Check::Stream,
    ),
    row(
        "stratum-half-filled",
        "points lie in the lower half of their stratum",
        text(
            "sampling/jittered",
            "mul_high(random, width)",
            "mul_high(random >> 1u, width)",
        ),
        sampler("jittered", &[], "none"),
        Check::Stream,
    ),
    row(
        "matrix-of-another-column",
        "the diagonal of the random matrix is one column late",
        text(
            "sampling/linear_scramble",
            ">> 1u)) >> column",
            ">> 1u)) >> (column + 1u)",
        ),
        sampler("sobol", &[], "linear-scramble"),
        Check::Stream,
    ),
    row(
        "matrix-without-shift",
        "digits are scrambled and not shifted",
        text("sampling/linear_scramble", "var y = key;", "var y = 0u;"),
        sampler("sobol", &[], "linear-scramble"),
        Check::Stream,
    ),
    row(
        "jitter-without-shift",
        "of two decorrelations only the small one is left",
        text(
            "sampling/cranley_patterson_micro_jitter",
            "x + dimension_number(s) + mul_high",
            "x + mul_high",
        ),
        sampler("halton", &[], "cranley-patterson-micro-jitter"),
        Check::Stream,
    ),
    row(
        "jitter-shared-by-samples",
        "the jitter of each sample is that of the pixel",
        text(
            "sampling/hash",
            "keyed_hash(dimension_number(s), s.sample)",
            "keyed_hash(dimension_number(s), 0u)",
        ),
        sampler("halton", &[], "cranley-patterson-micro-jitter"),
        Check::Stream,
    ),
    row(
        "index-offset-of-the-dimension",
        "the point is not the same one in all dimensions",
        text(
            "sampling/index_offset",
            "s.sample + mul_high(pixel_number(s), OFFSETS)",
            "s.sample + s.dimension + mul_high(pixel_number(s), OFFSETS)",
        ),
        sampler("halton", &[], "index-offset"),
        Check::Stream,
    ),
    row(
        "mask-transposed",
        "rows and columns of the dither mask are exchanged",
        text(
            "sampling/blue_noise",
            "return y * size + x;",
            "return x * size + y;",
        ),
        sampler("sobol", &[], "blue-noise"),
        Check::Stream,
    ),
    row(
        "radius-turned",
        "the first number of a pair is moved, not the angle",
        text(
            "sampling/disc_rotation",
            "(s.dimension & 1u) == 0u",
            "(s.dimension & 1u) == 1u",
        ),
        sampler("hammersley", &[], "disc-rotation"),
        Check::Stream,
    ),
    row(
        "pixel-hash-without-pixel",
        "all pixels draw the same",
        text(
            "sampling/pixel_hash",
            "strided(hash(s.seed), s.pixel)",
            "strided(hash(s.seed), 0u)",
        ),
        HASH,
        Check::Stream,
    ),
    row(
        "sample-off-by-one",
        "the first point is left out",
        text(
            "sampling/sampler",
            "point.sample = index(own);",
            "point.sample = index(own) + 1u;",
        ),
        SOBOL,
        Check::Stream,
    ),
    row(
        "digits-not-permuted",
        "permuted digits are plain ones",
        text("sampling/halton", "PERMUTED == 1u", "PERMUTED == 2u"),
        FAURE,
        Check::Stream,
    ),
    row(
        "one-base-for-all",
        "every dimension but the first takes the first base",
        text(
            "sampling/hammersley",
            "BASES + 2u * (s.dimension - 1u)",
            "BASES",
        ),
        sampler("hammersley", &[], "disc-rotation"),
        Check::Stream,
    ),
    row(
        "lattice-in-natural-order",
        "a lattice is not drawn in the order of van der Corput",
        text(
            "sampling/rank1_lattice",
            "reverseBits(s.sample)",
            "s.sample",
        ),
        sampler("rank1-lattice", &[], "cranley-patterson"),
        Check::Stream,
    ),
    row(
        "table-of-one-dimension",
        "both dimensions of a pair read the first number",
        text("sampling/pmj02", "(s.dimension & 1u)", "(s.dimension & 0u)"),
        sampler("pmj02", &[], "none"),
        Check::Stream,
    ),
    row(
        "wrong-column",
        "the matrices of dimensions overlap",
        text("sampling/sobol", "s.dimension * 32u", "s.dimension * 31u"),
        SOBOL,
        Check::Stream,
    ),
    row(
        "scrambles-shared-by-dimensions",
        "two of four dimensions are scrambled alike",
        text(
            "sampling/owen_sobol",
            "lanes[s.dimension & 3u]",
            "lanes[s.dimension & 1u]",
        ),
        sampler("owen-sobol", &[], "none"),
        Check::Stream,
    ),
    row(
        "float-reaches-one",
        "all 32 bits are rounded into the float",
        text(
            "sampling/sampler",
            "f32(x >> 8u) * 5.9604645e-8",
            "f32(x) * 2.3283064e-10",
        ),
        HASH,
        Check::Integrand,
    ),
    row(
        "pair-of-one-number",
        "both numbers of a pair are the same",
        text("sampling/sampler", "let y = sample_1d(s);", "let y = x;"),
        OWEN,
        Check::Integrand,
    ),
    row(
        "first-sample-repeated",
        "every sample of a pixel is the first one",
        text(
            "integrator/render",
            "frame.first_sample + i",
            "frame.first_sample",
        ),
        HASH,
        Check::Integrand,
    ),
    row(
        "wrong-direction-number",
        "kernel and twin read a direction number that stands one column too late",
        Plant::Table {
            part: "a direction number of dimension 1",
            change: repeat_direction_number,
        },
        SOBOL,
        Check::Known,
    ),
    row(
        "digit-permuted-to-another's",
        "kernel and twin read a permutation with a digit twice",
        Plant::Table {
            part: "the permutation of base 3",
            change: repeat_digit,
        },
        FAURE,
        Check::Known,
    ),
    row(
        "lattice-on-the-diagonal",
        "kernel and twin read a generating vector with twice the same component",
        Plant::Table {
            part: "the generating vector",
            change: repeat_component,
        },
        sampler("rank1-lattice", &[], "cranley-patterson"),
        Check::Discrepancy,
    ),
    row(
        "point-twice-in-the-table",
        "kernel and twin read a table with the first point twice and the second never",
        Plant::Table {
            part: "the second point",
            change: repeat_point,
        },
        sampler("pmj02", &[], "none"),
        Check::Known,
    ),
];

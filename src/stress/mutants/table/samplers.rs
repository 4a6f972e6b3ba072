//! Faults of sequences and decorrelations.

use super::words::*;
use super::{row, text};
use crate::stress::mutants::subject::Changes;
use crate::stress::mutants::{Check, Mutant, Plant, Subject};

const fn sampler(sequence: &'static str, changes: Changes, decorrelation: &'static str) -> Subject {
    Subject::Sampler {
        sequence,
        changes,
        decorrelation,
    }
}

const HASH: Subject = sampler("pixel-hash", &[], "none");
const SOBOL: Subject = sampler("sobol", &[], "none");
const HALTON: Subject = sampler("halton", &[], "cranley-patterson");
const PLAIN: Subject = sampler("halton", &[("digits", "plain")], "none");
const FAURE: Subject = sampler("halton", &[("digits", "faure")], "none");
const OWEN: Subject = sampler("sobol", &[], "owen-hash");

pub(super) const MUTANTS: &[Mutant] = &[
    row(
        "shift-reused-for-two-dimensions",
        "both dimensions of a pair get the same shift",
        text(
            "sampling/hash",
            "pcg_hash(s.dimension + pixel_number(s))",
            "pcg_hash((s.dimension >> 1u) + pixel_number(s))",
        ),
        HALTON,
        Check::Stream,
    ),
    row(
        "seed-dropped",
        "all seeds draw the same",
        text("sampling/hash", "s.pixel + pcg_hash(s.seed)", "s.pixel"),
        OWEN,
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
            "hash(s.pixel + hash(s.seed))",
            "hash(hash(s.seed))",
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
        Check::Discrepancy,
    ),
    row(
        "digit-permuted-to-another's",
        "kernel and twin read a permutation with a digit twice",
        Plant::Table {
            part: "the permutation of base 3",
            change: repeat_digit,
        },
        FAURE,
        Check::Discrepancy,
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
        Check::Discrepancy,
    ),
    row(
        "dimensions-end-at-32",
        "every dimension beyond 32 draws what dimension 32 draws",
        text(
            "sampling/sobol",
            "s.dimension * 32u",
            "min(s.dimension, 32u) * 32u",
        ),
        SOBOL,
        Check::Stream,
    ),
    row(
        "samples-repeat-from-256",
        "sample 256 is the first one again, and so on",
        text(
            "sampling/sampler",
            "point.sample = index(own);",
            "point.sample = index(own) & 255u;",
        ),
        HASH,
        Check::Stream,
    ),
    row(
        "samples-end-at-65536",
        "the bits of the index above the sixteenth are ignored",
        text(
            "sampling/radical_inverse",
            "var rest = n;",
            "var rest = n & 0xffffu;",
        ),
        PLAIN,
        Check::Stream,
    ),
    row(
        "points-repeat-from-4096",
        "a table of points is read up to its 4096th",
        text(
            "sampling/pmj02",
            "s.sample & last",
            "s.sample & min(last, 4095u)",
        ),
        sampler("pmj02", &[], "none"),
        Check::Stream,
    ),
    row(
        "lattice-of-4096",
        "a lattice begins again at its 4096th point",
        text(
            "sampling/rank1_lattice",
            "reverseBits(s.sample)",
            "reverseBits(s.sample & 4095u)",
        ),
        sampler("rank1-lattice", &[], "cranley-patterson"),
        Check::Stream,
    ),
    row(
        "odd-pixels-like-even-ones",
        "neighbours by two draw the same",
        text(
            "sampling/hash",
            "pcg_hash(s.pixel +",
            "pcg_hash((s.pixel & 0xfffffffeu) +",
        ),
        HALTON,
        Check::Stream,
    ),
    row(
        "upper-half-of-the-seed-ignored",
        "seeds that differ in their upper half alone draw the same",
        text(
            "sampling/hash",
            "pcg_hash(s.seed)",
            "pcg_hash(s.seed & 0xffffu)",
        ),
        sampler("sobol", &[], "digital-shift"),
        Check::Stream,
    ),
    row(
        "seed-s-top-bit-ignored",
        "a seed of 2^31 and more draws as a smaller one",
        text(
            "sampling/pixel_hash",
            "hash(s.seed)",
            "hash(s.seed & 0x7fffffffu)",
        ),
        HASH,
        Check::Stream,
    ),
    row(
        "pixel-s-upper-bits-ignored",
        "pixels from 16384 on draw as the first ones",
        text(
            "sampling/pixel_hash",
            "hash(s.pixel + ",
            "hash((s.pixel & 0x3fffu) + ",
        ),
        HASH,
        Check::Stream,
    ),
    row(
        "bases-end-at-dimension-30",
        "every dimension beyond 30 takes the base of dimension 30",
        text(
            "sampling/halton",
            "2u * s.dimension",
            "2u * min(s.dimension, 30u)",
        ),
        FAURE,
        Check::Stream,
    ),
    row(
        "bases-shifted-beyond-20",
        "dimensions beyond 20 take the base of the one before",
        text(
            "sampling/hammersley",
            "(s.dimension - 1u)",
            "(s.dimension - select(1u, 2u, s.dimension > 20u))",
        ),
        sampler("hammersley", &[], "disc-rotation"),
        Check::Stream,
    ),
    row(
        "quotient-rounded-from-256",
        "i / N is wrong in its last digits from sample 256 on",
        text(
            "sampling/hammersley",
            "s.sample * sequence_word(2u) / count",
            "min(s.sample, 255u) * sequence_word(2u) / count",
        ),
        sampler("hammersley", &[], "disc-rotation"),
        Check::Stream,
    ),
    row(
        "column-20-skipped",
        "sample 2^16 and beyond take the direction number that follows theirs",
        text(
            "sampling/sobol",
            "        column++;\n",
            "        column += select(1u, 2u, column % 32u == 15u);\n",
        ),
        SOBOL,
        Check::Stream,
    ),
    row(
        "lanes-repeat-from-16",
        "dimension 16 is scrambled like the first one",
        text(
            "sampling/owen_sobol",
            "(s.dimension >> 2u) ^",
            "((s.dimension >> 2u) & 3u) ^",
        ),
        sampler("owen-sobol", &[], "none"),
        Check::Stream,
    ),
    row(
        "mask-ends-at-its-border",
        "pixels beyond the first tile take the column at its border",
        text(
            "sampling/blue_noise",
            "(s.pixel % width +",
            "(min(s.pixel % width, 63u) +",
        ),
        sampler("sobol", &[], "blue-noise"),
        Check::Stream,
    ),
    row(
        "mask-same-for-late-dimensions",
        "from dimension 16 on all dimensions are shifted alike",
        text(
            "sampling/blue_noise",
            "tile_index(s, MASK_SIZE, s.dimension)",
            "tile_index(s, MASK_SIZE, min(s.dimension, 16u))",
        ),
        sampler("sobol", &[], "blue-noise"),
        Check::Stream,
    ),
    row(
        "second-row-wrong",
        "the second row of the mask is taken for the first",
        text(
            "sampling/blue_noise",
            "(s.pixel / width +",
            "(select(s.pixel / width, 0u, s.pixel / width == 1u) +",
        ),
        sampler("sobol", &[], "blue-noise"),
        Check::Stream,
    ),
    row(
        "late-angles-not-turned",
        "discs of late bounces are not turned",
        text(
            "sampling/disc_rotation",
            "(s.dimension & 1u) == 0u",
            "(s.dimension & 1u) == 0u || s.dimension > 31u",
        ),
        sampler("hammersley", &[], "disc-rotation"),
        Check::Stream,
    ),
    row(
        "offset-forgotten-in-late-samples",
        "from sample 4096 on pixels begin at the first point",
        text(
            "sampling/index_offset",
            "return s.sample + ",
            "return s.sample + select(1u, 0u, s.sample >= 4096u) * ",
        ),
        sampler("halton", &[], "index-offset"),
        Check::Stream,
    ),
    row(
        "one-sample-drops-its-last-bit",
        "a sample of all ones in 12 bits draws the one before",
        text(
            "sampling/owen_hash",
            "owen_scramble(s.sample,",
            "owen_scramble(s.sample - select(0u, 1u, s.sample == 4095u),",
        ),
        OWEN,
        Check::Stream,
    ),
    row(
        "late-direction-number-repeated",
        "kernel and twin read a direction number twice that sample 32768 needs first",
        Plant::Table {
            part: "a direction number of dimension 20",
            change: repeat_late_direction_number,
        },
        SOBOL,
        Check::Discrepancy,
    ),
    row(
        "late-digit-permuted-to-another's",
        "kernel and twin read a permutation of base 127 with a digit twice",
        Plant::Table {
            part: "the permutation of base 127",
            change: repeat_late_digit,
        },
        FAURE,
        Check::Discrepancy,
    ),
    row(
        "late-base-twice",
        "kernel and twin take the same base in two late dimensions",
        Plant::Table {
            part: "the base of dimension 40",
            change: repeat_late_base,
        },
        FAURE,
        Check::Discrepancy,
    ),
    row(
        "late-components-equal",
        "kernel and twin read a generating vector with twice the same component, late",
        Plant::Table {
            part: "component 19 of the generating vector",
            change: repeat_late_component,
        },
        sampler("rank1-lattice", &[], "cranley-patterson"),
        Check::Discrepancy,
    ),
    row(
        "set-for-two-pairs",
        "kernel and twin read the same points for the first pair of dimensions and the ninth",
        Plant::Table {
            part: "the ninth set of points",
            change: repeat_set,
        },
        sampler("pmj02", &[], "none"),
        Check::Discrepancy,
    ),
];

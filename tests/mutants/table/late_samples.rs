//! Faults of sequences and decorrelations that show only late: in high dimensions, for high numbers of samples,
//! for seeds and pixels with many bits.

use super::samplers::sampler;
use super::words::*;
use super::{row, text};
use crate::{Check, Mutant, Plant, Subject};

const HASH: Subject = sampler("pixel-hash", &[], "none");
const SOBOL: Subject = sampler("sobol", &[], "none");
const HALTON: Subject = sampler("halton", &[], "cranley-patterson");
const PLAIN: Subject = sampler("halton", &[("digits", "plain")], "none");
const FAURE: Subject = sampler("halton", &[("digits", "faure")], "none");
const OWEN: Subject = sampler("sobol", &[], "owen-hash");

pub const MUTANTS: &[Mutant] = &[
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
            "pcg_hash(s.seed), s.pixel",
            "pcg_hash(s.seed), s.pixel & 0xfffffffeu",
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
            "strided(hash(s.seed), s.pixel)",
            "strided(hash(s.seed), s.pixel & 0x3fffu)",
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
        "count-ends-at-4096",
        "i / N grows no more from sample 4096 on",
        text(
            "sampling/hammersley",
            "s.sample * sequence_word(1u)",
            "min(s.sample, 4095u) * sequence_word(1u)",
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
        Check::Known,
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
        Check::Known,
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

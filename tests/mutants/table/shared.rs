//! Faults that stand in a sampler's kernel and in its twin alike, so that words still agree.

use super::row;
use super::samplers::sampler;
use super::words::*;
use crate::plant::Elsewhere;
use crate::{Check, Mutant, Plant, Subject};
use raystone::sampling::Coordinate;

const POINT: &str = "    return decorrelate(sequence(point), own);";

/// The sequence draws elsewhere.
const fn sequence(to: &'static str, twin: Elsewhere) -> Plant {
    Plant::Both {
        from: POINT,
        to,
        twin: [Some(twin), None],
    }
}

/// The decorrelation shifts and scrambles as if elsewhere.
const fn decorrelation(to: &'static str, twin: Elsewhere) -> Plant {
    Plant::Both {
        from: "    point.sample = index(own);",
        to,
        twin: [None, Some(twin)],
    }
}

const fn known(name: &'static str, what: &'static str, plant: Plant, subject: Subject) -> Mutant {
    row(name, what, plant, subject, Check::Known)
}

const fn table(part: &'static str, change: fn(&mut [u32]) -> usize) -> Plant {
    Plant::Table { part, change }
}

const SOBOL: Subject = sampler("sobol", &[], "none");
const HASH: Subject = sampler("pixel-hash", &[], "none");
const OWEN: Subject = sampler("owen-sobol", &[], "none");

/// Dimensions of bounce 4 and later.
const LATE: u32 = 26;

pub const MUTANTS: &[Mutant] = &[
    known(
        "two-dimensions-one-scramble",
        "two dimensions share a scramble",
        decorrelation(
            "    own.dimension &= 0xfffffffeu;\n    point.sample = index(own);",
            |c| Coordinate {
                dimension: c.dimension & !1,
                ..c
            },
        ),
        sampler("sobol", &[], "owen-hash"),
    ),
    known(
        "two-dimensions-one-shift",
        "two dimensions share a shift",
        decorrelation(
            "    own.dimension &= 0xfffffffeu;\n    point.sample = index(own);",
            |c| Coordinate {
                dimension: c.dimension & !1,
                ..c
            },
        ),
        sampler("halton", &[], "cranley-patterson"),
    ),
    known(
        "late-dimensions-one-shift",
        "dimensions from the 33rd on share a shift",
        decorrelation(
            "    own.dimension = min(own.dimension, 32u);\n    point.sample = index(own);",
            |c| Coordinate {
                dimension: c.dimension.min(32),
                ..c
            },
        ),
        sampler("sobol", &[], "digital-shift"),
    ),
    known(
        "two-dimensions-one-matrix",
        "two dimensions share a random matrix",
        decorrelation(
            "    own.dimension &= 0xfffffffeu;\n    point.sample = index(own);",
            |c| Coordinate {
                dimension: c.dimension & !1,
                ..c
            },
        ),
        sampler("sobol", &[], "linear-scramble"),
    ),
    known(
        "late-masks-alike",
        "dimensions from the 17th on are shifted by one mask",
        decorrelation(
            "    own.dimension = min(own.dimension, 16u);\n    point.sample = index(own);",
            |c| Coordinate {
                dimension: c.dimension.min(16),
                ..c
            },
        ),
        sampler("sobol", &[], "blue-noise"),
    ),
    known(
        "sobol-a-dimension-late",
        "from bounce 4 on Sobol draws from the dimension that follows",
        sequence(
            "    point.dimension += select(0u, 1u, point.dimension >= 26u && point.dimension < 47u);\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                dimension: c.dimension + u32::from((LATE..47).contains(&c.dimension)),
                ..c
            },
        ),
        SOBOL,
    ),
    known(
        "halton-a-dimension-early",
        "from bounce 4 on bases are those of the dimension before",
        sequence(
            "    point.dimension -= select(0u, 1u, point.dimension >= 26u);\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                dimension: c.dimension - u32::from(c.dimension >= LATE),
                ..c
            },
        ),
        sampler("halton", &[], "none"),
    ),
    known(
        "hammersley-a-dimension-early",
        "from bounce 4 on bases are those of the dimension before",
        sequence(
            "    point.dimension -= select(0u, 1u, point.dimension >= 26u);\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                dimension: c.dimension - u32::from(c.dimension >= LATE),
                ..c
            },
        ),
        sampler("hammersley", &[], "none"),
    ),
    known(
        "lattice-a-dimension-late",
        "from bounce 4 on components are those of the dimension that follows",
        sequence(
            "    point.dimension += select(0u, 1u, point.dimension >= 26u && point.dimension < 47u);\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                dimension: c.dimension + u32::from((LATE..47).contains(&c.dimension)),
                ..c
            },
        ),
        sampler("rank1-lattice", &[], "cranley-patterson"),
    ),
    known(
        "owen-dimensions-repeat",
        "dimensions from bounce 4 on are those before",
        sequence(
            "    point.dimension %= 26u;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                dimension: c.dimension % LATE,
                ..c
            },
        ),
        OWEN,
    ),
    known(
        "x-and-y-exchanged",
        "both numbers of a point change places",
        sequence(
            "    point.dimension ^= 1u;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                dimension: c.dimension ^ 1,
                ..c
            },
        ),
        sampler("pmj02", &[], "none"),
    ),
    known(
        "strata-of-all-pairs-alike",
        "all pairs of dimensions visit their strata in the order of the first",
        sequence(
            "    point.dimension &= 1u;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                dimension: c.dimension & 1,
                ..c
            },
        ),
        sampler("jittered", &[], "none"),
    ),
    known(
        "seeds-in-pairs",
        "seeds 2k and 2k + 1 are one",
        sequence(
            "    point.seed >>= 1u;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                seed: c.seed >> 1,
                ..c
            },
        ),
        HASH,
    ),
    known(
        "seeds-of-owen-in-pairs",
        "seeds 2k and 2k + 1 are one",
        sequence(
            "    point.seed >>= 1u;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                seed: c.seed >> 1,
                ..c
            },
        ),
        OWEN,
    ),
    known(
        "seeds-of-shifts-in-pairs",
        "seeds 2k and 2k + 1 are one",
        decorrelation(
            "    own.seed >>= 1u;\n    point.sample = index(own);",
            |c| Coordinate {
                seed: c.seed >> 1,
                ..c
            },
        ),
        sampler("halton", &[], "cranley-patterson"),
    ),
    known(
        "seeds-above-two-to-the-31",
        "the highest bit of a seed is ignored",
        decorrelation(
            "    own.seed &= 0x7fffffffu;\n    point.sample = index(own);",
            |c| Coordinate {
                seed: c.seed & 0x7fff_ffff,
                ..c
            },
        ),
        sampler("sobol", &[], "owen-hash"),
    ),
    known(
        "one-seed-for-jitter",
        "jitter is that of seed 0",
        decorrelation("    own.seed = 0u;\n    point.sample = index(own);", |c| {
            Coordinate { seed: 0, ..c }
        }),
        sampler("halton", &[], "micro-jitter"),
    ),
    known(
        "pixels-in-pairs",
        "neighbours in a row draw the same",
        sequence(
            "    point.pixel &= 0xfffffffeu;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                pixel: c.pixel & !1,
                ..c
            },
        ),
        HASH,
    ),
    known(
        "pixels-of-owen-in-pairs",
        "neighbours in a row draw the same",
        sequence(
            "    point.pixel &= 0xfffffffeu;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                pixel: c.pixel & !1,
                ..c
            },
        ),
        OWEN,
    ),
    known(
        "pixels-of-shifts-in-pairs",
        "neighbours in a row share a shift",
        decorrelation(
            "    own.pixel >>= 1u;\n    point.sample = index(own);",
            |c| Coordinate {
                pixel: c.pixel >> 1,
                ..c
            },
        ),
        sampler("halton", &[], "cranley-patterson"),
    ),
    known(
        "rows-of-64-pixels",
        "pixels 64 apart share a shift",
        decorrelation(
            "    own.pixel &= 63u;\n    point.sample = index(own);",
            |c| Coordinate {
                pixel: c.pixel & 63,
                ..c
            },
        ),
        sampler("sobol", &[], "digital-shift"),
    ),
    known(
        "offsets-in-pairs",
        "neighbours begin at the same point",
        decorrelation(
            "    own.pixel >>= 1u;\n    point.sample = index(own);",
            |c| Coordinate {
                pixel: c.pixel >> 1,
                ..c
            },
        ),
        sampler("halton", &[], "index-offset"),
    ),
    known(
        "angles-in-pairs",
        "neighbours turn their discs alike",
        decorrelation(
            "    own.pixel >>= 1u;\n    point.sample = index(own);",
            |c| Coordinate {
                pixel: c.pixel >> 1,
                ..c
            },
        ),
        sampler("hammersley", &[], "disc-rotation"),
    ),
    known(
        "samples-in-pairs",
        "samples 2k and 2k + 1 are one",
        sequence(
            "    point.sample >>= 1u;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                sample: c.sample >> 1,
                ..c
            },
        ),
        HASH,
    ),
    known(
        "first-point-left-out",
        "the sequence begins with its second point",
        sequence(
            "    point.sample += 1u;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                sample: c.sample + 1,
                ..c
            },
        ),
        sampler("rank1-lattice", &[], "cranley-patterson"),
    ),
    known(
        "steps-of-another-sample",
        "points are those of the sample after the next",
        sequence(
            "    point.sample += 2u;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                sample: c.sample.wrapping_add(2),
                ..c
            },
        ),
        sampler("r2", &[], "none"),
    ),
    known(
        "samples-exchanged",
        "every other two samples change places",
        sequence(
            "    point.sample ^= 1u;\n    return decorrelate(sequence(point), own);",
            |c| Coordinate {
                sample: c.sample ^ 1,
                ..c
            },
        ),
        SOBOL,
    ),
    known(
        "jitter-of-the-first-sample",
        "all samples have the jitter of the first",
        decorrelation(
            "    own.sample = 0u;\n    point.sample = index(own);",
            |c| Coordinate { sample: 0, ..c },
        ),
        sampler("halton", &[], "cranley-patterson-micro-jitter"),
    ),
    known(
        "joe-kuo-row-wrong",
        "kernel and twin read a direction number of dimension 30 with one bit flipped",
        table("a direction number of dimension 30", flip_a_direction_bit),
        SOBOL,
    ),
    known(
        "joe-kuo-rows-exchanged",
        "kernel and twin read the rows of two late dimensions in the other order",
        table(
            "the direction numbers of dimensions 40 and 41",
            exchange_rows,
        ),
        SOBOL,
    ),
    known(
        "prime-wrong",
        "kernel and twin take a larger prime in a late dimension",
        table("the base of dimension 41", take_a_larger_prime),
        sampler("halton", &[("digits", "plain")], "none"),
    ),
    known(
        "late-digits-exchanged",
        "kernel and twin exchange two digits of a late permutation",
        table("the permutation of base 101", exchange_digits),
        sampler("halton", &[("digits", "faure")], "none"),
    ),
    known(
        "step-a-little-longer",
        "kernel and twin take a step that is a ten-millionth too long",
        table("the step of dimension 1", lengthen_step),
        sampler("r2", &[], "none"),
    ),
    known(
        "count-one-more",
        "kernel and twin divide by one more",
        table("the part of a whole", divide_by_one_more),
        sampler("hammersley", &[], "none"),
    ),
];

//! Every key of an experiment file: the one table that the parser, its messages, the defaults and
//! `docs/experiments.md` are made from.

use std::fmt;

/// An axis of the product of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Axis {
    /// What is traced.
    Scene,
    /// The acceleration structure.
    Accel,
    /// The sample sequence.
    Sequence,
    /// How pixels are decorrelated.
    Decorrelation,
    /// What is computed from the hits.
    Integrator,
    /// The ray–triangle test of structures and judge.
    Triangle,
    /// The ray–box test of structures.
    BoxTest,
    /// How rays are moved off the surface that they leave.
    Offset,
    /// How the path tracer is organised on the device.
    Organisation,
    /// Ray casters of others that are measured beside the structures.
    Peer,
    /// The workgroups in which kernels trace.
    Workgroup,
    /// The kernels that all this runs with.
    Kernels,
}

impl Axis {
    /// All axes, in the order of tables and plans.
    pub const ALL: [Axis; 12] = [
        Axis::Scene,
        Axis::Accel,
        Axis::Sequence,
        Axis::Decorrelation,
        Axis::Integrator,
        Axis::Triangle,
        Axis::BoxTest,
        Axis::Offset,
        Axis::Organisation,
        Axis::Peer,
        Axis::Workgroup,
        Axis::Kernels,
    ];

    /// The key under `[axes]`, and the name of the section with parameters.
    pub const fn name(self) -> &'static str {
        match self {
            Axis::Scene => "scene",
            Axis::Accel => "accel",
            Axis::Sequence => "sequence",
            Axis::Decorrelation => "decorrelation",
            Axis::Integrator => "integrator",
            Axis::Triangle => "triangle",
            Axis::BoxTest => "box_test",
            Axis::Offset => "offset",
            Axis::Organisation => "organisation",
            Axis::Peer => "peer",
            Axis::Workgroup => "workgroup",
            Axis::Kernels => "kernels",
        }
    }

    /// The axis of this name.
    pub fn from_name(name: &str) -> Option<Axis> {
        Self::ALL.into_iter().find(|axis| axis.name() == name)
    }

    /// What stands on the axis where an experiment says nothing of it; nothing if it has to.
    pub fn default_name(self) -> Option<&'static str> {
        let default = find("axes", self.name())?.default?;
        Some(default.trim_matches(['[', ']', '"']))
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What values a key takes. Ranges include both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ValueKind {
    /// Any text but the empty one.
    Text,
    /// `true` or `false`.
    Flag,
    /// An integer.
    Integer {
        /// Least value.
        min: i64,
        /// Greatest value.
        max: i64,
    },
    /// A power of two.
    PowerOfTwo {
        /// Least value.
        min: i64,
        /// Greatest value.
        max: i64,
    },
    /// One of these words.
    Word(&'static [&'static str]),
    /// Two integers.
    IntegerPair {
        /// Least value of each.
        min: i64,
        /// Greatest value of each.
        max: i64,
    },
    /// A table `{ pow2 = [lo, hi] }`, all powers of two from 2^lo to 2^hi, or a list of ascending numbers.
    Counts {
        /// Greatest exponent.
        max_exponent: i64,
    },
    /// A table `{ relmse = x, confidence = p }`.
    StopRule,
    /// Pairs of different dimensions.
    DimensionPairs {
        /// Greatest dimension.
        max: i64,
    },
    /// A real number.
    Number {
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// Three finite numbers.
    Vector,
    /// A name of this axis.
    Name(Axis),
    /// One name or a list of names of this axis.
    Names(Axis),
    /// One pattern or a list of patterns for this axis.
    Patterns(Axis),
}

impl fmt::Display for ValueKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text => write!(f, "a text that is not empty"),
            Self::Flag => write!(f, "true or false"),
            Self::Integer { min, max } => write!(f, "an integer in [{min}, {max}]"),
            Self::PowerOfTwo { min, max } => write!(f, "a power of two in [{min}, {max}]"),
            Self::Word(words) => write!(f, "one of \"{}\"", words.join("\", \"")),
            Self::IntegerPair { min, max } => {
                write!(f, "a list of two integers in [{min}, {max}]")
            }
            Self::Counts { max_exponent } => {
                write!(
                    f,
                    "a table {{ pow2 = [lo, hi] }} with 0 <= lo <= hi <= {max_exponent}, or a list of ascending \
                     integers in [1, {}]",
                    1_i64 << max_exponent
                )
            }
            Self::StopRule => write!(
                f,
                "a table {{ relmse = x, confidence = p }} with x > 0 and 0.5 <= p < 1, and perhaps tile = n, a multiple of 8 in [8, 512]"
            ),
            Self::DimensionPairs { max } => {
                write!(f, "a list of pairs of different dimensions in [0, {max}]")
            }
            Self::Number { min, max } => write!(f, "a number in [{min}, {max}]"),
            Self::Vector => write!(f, "a list of three finite numbers"),
            Self::Name(axis) => write!(f, "the name of one {axis}"),
            Self::Names(Axis::Scene) => {
                write!(f, "a list of built-in scenes and paths of models")
            }
            Self::Names(Axis::Kernels) => {
                write!(
                    f,
                    "a list of folders with kernels, `\"\"` for the embedded ones"
                )
            }
            Self::Names(axis) => write!(f, "a list of {axis} names"),
            Self::Patterns(axis) => write!(f, "one {axis} pattern or a list of them"),
        }
    }
}

/// One key of an experiment file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyRow {
    /// Section that the key stands in.
    pub section: &'static str,
    /// Name of the key.
    pub name: &'static str,
    /// Allowed values.
    pub kind: ValueKind,
    /// Default as TOML text; a key without one must be given where its section is used.
    pub default: Option<&'static str>,
    /// What it means, with its unit.
    pub meaning: &'static str,
}

impl KeyRow {
    /// The dotted path, as messages and `--set` write it.
    pub fn path(&self) -> String {
        format!("{}.{}", self.section, self.name)
    }
}

const fn key(
    section: &'static str,
    name: &'static str,
    kind: ValueKind,
    default: Option<&'static str>,
    meaning: &'static str,
) -> KeyRow {
    KeyRow {
        section,
        name,
        kind,
        default,
        meaning,
    }
}

const fn integer(min: i64, max: i64) -> ValueKind {
    ValueKind::Integer { min, max }
}

const SEED: ValueKind = integer(0, u32::MAX as i64);

/// All keys, in the order of the documentation. Parameters of registry entries (`[accel.NAME]` and
/// so on) are not here: they come from the registries.
#[rustfmt::skip]
pub const KEYS: &[KeyRow] = &[
    key("run", "name", ValueKind::Text, None, "Name of the run in the report; without it, the name of the file."),
    key("run", "replicates", integer(1, 1024), Some("16"), "Independent seeds per randomised sampler; the unit of every interval of an error."),
    key("run", "seed", SEED, Some("1"), "Seed of the first replicate."),
    key("run", "resolution", ValueKind::IntegerPair { min: 16, max: 8192 }, Some("[192, 144]"), "Width and height of every image, pixels."),
    key("run", "spp", ValueKind::Counts { max_exponent: 16 }, Some("{ pow2 = [0, 5] }"), "Samples per pixel at which the error is taken: 2^lo, …, 2^hi, or those listed, `[1, 3, 10]`."),
    key("run", "stop", ValueKind::StopRule, None, "Ends a sampler at one of these numbers of samples where its relMSE is below x with probability p, or each tile of n × n pixels on its own; without it, each takes them all."),
    key("run", "runtime_checks", ValueKind::Flag, Some("true"), "Keep the bounds checks and loop bounds that the driver layer adds to kernels."),
    key("axes", "scene", ValueKind::Names(Axis::Scene), None, "Scenes: built-in names, or paths of .obj, .gltf, .glb, .ply or Nori .xml files, relative to the current directory. Not needed if all integrators are `integrand:*` or `compaction:*`."),
    key("axes", "accel", ValueKind::Names(Axis::Accel), None, "Acceleration structures. Not needed if all integrators are `integrand:*` or `compaction:*`."),
    key("axes", "sequence", ValueKind::Names(Axis::Sequence), None, "Sample sequences. Not needed if all integrators are `compaction:*`."),
    key("axes", "decorrelation", ValueKind::Names(Axis::Decorrelation), Some("[\"none\"]"), "How the pixels' sample points are made different."),
    key("axes", "integrator", ValueKind::Names(Axis::Integrator), Some("[\"path\"]"), "What is computed from the hits."),
    key("axes", "triangle", ValueKind::Names(Axis::Triangle), Some("[\"watertight\"]"), "Ray-triangle tests, of all structures and of the judge."),
    key("axes", "box_test", ValueKind::Names(Axis::BoxTest), Some("[\"padded-16\"]"), "Ray-box tests: reciprocal and pad. Hits are proven for `padded-16` alone; the others are there to be measured."),
    key("axes", "offset", ValueKind::Names(Axis::Offset), Some("[\"error-bound\"]"), "How rays that leave a surface are moved off it by integrators. References are always rendered with `error-bound`."),
    key("axes", "organisation", ValueKind::Names(Axis::Organisation), Some("[\"single-kernel\"]"), "How the path tracer is organised on the device. All make the same image to the bit; errors are measured with `single-kernel`."),
    key("axes", "peer", ValueKind::Names(Axis::Peer), Some("[\"none\"]"), "Ray casters of others, timed with the same rays in the rounds of the structures, and told apart from them."),
    key("axes", "workgroup", ValueKind::Names(Axis::Workgroup), Some("[\"auto\"]"), "Workgroups of the kernels that trace: so many rays, and pixels of this shape. All give the same hits and images to the bit."),
    key("axes", "kernels", ValueKind::Names(Axis::Kernels), Some("[\"\"]"), "Folders whose kernels (`*.wesl`) replace the embedded ones of the same path, or join them, relative to the current directory; `\"\"` are the embedded ones."),
    key("camera", "eye", ValueKind::Vector, None, "Position of the pinhole, scene units."),
    key("camera", "target", ValueKind::Vector, None, "Point that projects to the centre of the image, scene units."),
    key("camera", "up", ValueKind::Vector, Some("[0, 1, 0]"), "Up direction; not parallel to the viewing direction."),
    key("camera", "fov", ValueKind::Number { min: 1.0, max: 179.0 }, Some("40"), "Vertical field of view, degrees."),
    key("exclude", "scene", ValueKind::Patterns(Axis::Scene), None, "Cells of these scenes …"),
    key("exclude", "accel", ValueKind::Patterns(Axis::Accel), None, "… with these structures …"),
    key("exclude", "sequence", ValueKind::Patterns(Axis::Sequence), None, "… these sequences …"),
    key("exclude", "decorrelation", ValueKind::Patterns(Axis::Decorrelation), None, "… these decorrelations …"),
    key("exclude", "integrator", ValueKind::Patterns(Axis::Integrator), None, "… these integrators …"),
    key("exclude", "triangle", ValueKind::Patterns(Axis::Triangle), None, "… these triangle tests …"),
    key("exclude", "box_test", ValueKind::Patterns(Axis::BoxTest), None, "… these box tests …"),
    key("exclude", "offset", ValueKind::Patterns(Axis::Offset), None, "… these offsets …"),
    key("exclude", "organisation", ValueKind::Patterns(Axis::Organisation), None, "… these organisations …"),
    key("exclude", "peer", ValueKind::Patterns(Axis::Peer), None, "… these peers …"),
    key("exclude", "workgroup", ValueKind::Patterns(Axis::Workgroup), None, "… these workgroups …"),
    key("exclude", "kernels", ValueKind::Patterns(Axis::Kernels), None, "… and these kernels are left out."),
    key("include", "scene", ValueKind::Patterns(Axis::Scene), None, "Cells of these scenes …"),
    key("include", "accel", ValueKind::Patterns(Axis::Accel), None, "… with these structures …"),
    key("include", "sequence", ValueKind::Patterns(Axis::Sequence), None, "… these sequences …"),
    key("include", "decorrelation", ValueKind::Patterns(Axis::Decorrelation), None, "… these decorrelations …"),
    key("include", "integrator", ValueKind::Patterns(Axis::Integrator), None, "… these integrators …"),
    key("include", "triangle", ValueKind::Patterns(Axis::Triangle), None, "… these triangle tests …"),
    key("include", "box_test", ValueKind::Patterns(Axis::BoxTest), None, "… these box tests …"),
    key("include", "offset", ValueKind::Patterns(Axis::Offset), None, "… these offsets …"),
    key("include", "organisation", ValueKind::Patterns(Axis::Organisation), None, "… these organisations …"),
    key("include", "peer", ValueKind::Patterns(Axis::Peer), None, "… these peers …"),
    key("include", "workgroup", ValueKind::Patterns(Axis::Workgroup), None, "… these workgroups …"),
    key("include", "kernels", ValueKind::Patterns(Axis::Kernels), None, "… and these kernels are kept, though an exclude takes them out."),
    key("reference", "spp", integer(2, 1 << 24), Some("16384"), "Samples per pixel of the reference image, both halves together."),
    key("reference", "sequence", ValueKind::Name(Axis::Sequence), Some("\"pixel-hash\""), "Sequence of the reference, with its default parameters."),
    key("reference", "decorrelation", ValueKind::Name(Axis::Decorrelation), Some("\"none\""), "Decorrelation of the reference, with its default parameters."),
    key("reference", "seed", SEED, Some("9001"), "What the seeds of the reference's parts are hashed from; none of them may be a replicate's."),
    key("reference", "file", ValueKind::Text, None, "An image (.exr, .hdr, .pfm, .npy) of the run's resolution to compare with in place of a rendered one, relative to the current directory; its own noise is not known."),
    key("timing", "rounds", integer(3, 1000), Some("9"), "Timed rounds; each times every cell of a scene once, in random order."),
    key("timing", "spp", integer(1, 1024), Some("1"), "Samples per pixel of each timed render."),
    key("timing", "min_warmup_ms", integer(0, 60_000), Some("100"), "Least warm-up of a kernel before it is timed, milliseconds."),
    key("timing", "max_warmup_ms", integer(0, 600_000), Some("2000"), "Warm-up ends here even if the rate is not stable yet, milliseconds."),
    key("timing", "rays", integer(1024, 1 << 24), Some("65536"), "Rays per class and dispatch."),
    key("timing", "orders", ValueKind::Flag, Some("false"), "Whether full cells are also rendered in one pass, in 16 blocks and in the 256 passes of a quad-tree, and the time to the first picture without a gap is taken; at most 256 samples."),
    key("gate", "rays", integer(256, 1 << 24), Some("32768"), "Rays per class that every structure must answer as the judge does."),
    key("gate", "brute_force_tests", integer(0, 1_000_000_000_000), Some("2_000_000_000"), "Ray-triangle tests spent on checking the judge itself against brute force (at least 2,000 rays are)."),
    key("gate", "oracle_rays", integer(0, 1 << 20), Some("2048"), "Rays of the judge that the double-precision oracle decides again."),
    key("gate", "ao_length", ValueKind::Number { min: 0.0, max: 1e16 }, Some("0"), "Length of recorded AO rays, scene units; 0 is a tenth of the scene's diagonal."),
    key("gate", "offset", ValueKind::Number { min: 0.0, max: 1e16 }, Some("0"), "How far rays that start on a surface are moved off it, scene units; 0 is 1e-5 of the scene's diagonal."),
    key("gate", "shadow_orders", ValueKind::Flag, Some("false"), "Whether shadow rays are recorded in three more classes: from the light, light by light, and both."),
    key("discrepancy", "points", ValueKind::PowerOfTwo { min: 2, max: 65_536 }, Some("4096"), "Star discrepancy is taken at N = 2, 4, 8, … up to this many points."),
    key("discrepancy", "pairs", ValueKind::DimensionPairs { max: 255 }, Some("[[0, 1], [2, 3], [4, 5], [0, 2], [1, 3], [2, 4]]"), "Pairs of dimensions of the path's table; the worst of all pairs that the integrators draw is measured as well."),
    key("discrepancy", "seeds", integer(1, 1024), Some("8"), "Seeds measured where the stream is randomised."),
    key("coherence", "resolution", ValueKind::IntegerPair { min: 16, max: 8192 }, None, "Width and height of the image whose rays are looked at, pixels; without it, `run.resolution`."),
    key("coherence", "spp", ValueKind::Counts { max_exponent: 16 }, None, "Samples per pixel that samplers are made for; without it, those of `run.spp`."),
    key("coherence", "groups", integer(1, 4096), Some("4"), "Groups of warps that the model of coherence looks at, spread over the image; each has an L1 of its own. Without a section `[coherence]` nothing is modelled."),
    key("coherence", "warps", integer(1, 256), Some("8"), "Warps of a group: neighbours in the order of workgroups, with one L1."),
    key("coherence", "warp", ValueKind::IntegerPair { min: 1, max: 8 }, Some("[8, 4]"), "Width and height of the pixels of a warp, divisors of 8: workgroups of the image kernel are 8 × 8 pixels, and their lanes are numbered by rows."),
    key("coherence", "samples", integer(1, 1024), Some("2"), "Samples of each pixel, spread over all of them."),
    key("coherence", "rule", ValueKind::Word(&["loop", "if-if"]), Some("\"loop\""), "How a turn of a warp goes on after a visit: until no lane has a triangle to test, as kernels are written, or with one test."),
    key("coherence", "line_bytes", ValueKind::PowerOfTwo { min: 16, max: 4096 }, Some("128"), "Bytes of a cache line."),
    key("coherence", "l1_kib", integer(1, 1 << 20), Some("128"), "Size of each group's L1, KiB."),
    key("coherence", "l1_ways", integer(0, 1024), Some("0"), "Its associativity; 0: fully associative. The line that was used longest ago goes (LRU)."),
    key("coherence", "l2_kib", integer(1, 1 << 20), Some("51200"), "Size of the L2 of all groups, KiB."),
    key("coherence", "l2_ways", integer(0, 1024), Some("16"), "Its associativity."),
    key("animation", "motion", ValueKind::Word(&["deform", "instances"]), Some("\"deform\""), "What moves from frame to frame: vertices in a wave, or instances, each straight on. Without a section `[animation]` nothing does."),
    key("animation", "frames", integer(2, 1024), Some("9"), "Frames, the scene as it was loaded being the first. In each, the tree of the first is refitted, and built anew by its own builder."),
    key("animation", "amplitude", ValueKind::Number { min: 0.0, max: 10.0 }, Some("0.05"), "Amplitude of the wave, or the way of each instance until the last frame, in radii of the scene."),
    key("animation", "wavelength", ValueKind::Number { min: 0.01, max: 100.0 }, Some("1"), "Wavelength of the wave, in radii of the scene."),
];

/// Sections that may be absent altogether; their defaults apply only when they are used.
pub(crate) const OPTIONAL_SECTIONS: &[&str] =
    &["camera", "exclude", "include", "coherence", "animation"];

/// The row of a key, if there is one.
pub fn find(section: &str, name: &str) -> Option<&'static KeyRow> {
    KEYS.iter()
        .find(|key| key.section == section && key.name == name)
}

/// Names of all sections: those of [`KEYS`], and one per axis with the parameters of its entries.
pub fn sections() -> Vec<&'static str> {
    let mut sections: Vec<_> = KEYS.iter().map(|key| key.section).collect();
    sections.dedup();
    sections.extend(Axis::ALL.map(Axis::name));
    sections
}

/// Names of the keys of one section.
pub(crate) fn names_in(section: &str) -> Vec<&'static str> {
    KEYS.iter()
        .filter(|key| key.section == section)
        .map(|key| key.name)
        .collect()
}

/// The table of all keys in Markdown, as `docs/experiments.md` holds it.
pub fn reference_table() -> String {
    let mut text = String::from("| Key | Value | Default | Meaning |\n|---|---|---|---|\n");
    for key in KEYS {
        let default = key.default.map_or("–".to_owned(), |d| format!("`{d}`"));
        text += &format!(
            "| `{}` | {} | {default} | {} |\n",
            key.path(),
            key.kind,
            key.meaning
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_key_stands_twice_and_sections_are_contiguous() {
        let paths: BTreeSet<_> = KEYS.iter().map(KeyRow::path).collect();
        assert_eq!(paths.len(), KEYS.len());
        let sections = sections();
        let distinct: BTreeSet<_> = sections.iter().collect();
        assert_eq!(distinct.len(), sections.len());
    }

    #[test]
    fn axes_are_found_by_name() {
        for axis in Axis::ALL {
            assert_eq!(Axis::from_name(axis.name()), Some(axis));
            assert!(find("axes", axis.name()).is_some());
            assert!(find("exclude", axis.name()).is_some());
            assert!(find("include", axis.name()).is_some());
        }
        assert_eq!(Axis::from_name("sampler"), None);
    }
}

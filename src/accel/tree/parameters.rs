//! Parameters of all builders.

use super::reference::Box3;
use crate::params::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};

/// Below this depth splits are by SAH, beyond it by the median, so that depth stays below
/// `SAH_DEPTH + log2(references) + 1` whatever the input.
pub(super) const SAH_DEPTH: u32 = 48;
/// Most bins on an axis.
pub(super) const MAX_BINS: usize = 32;

/// Names of the builders, in the order of [`Builder`].
const BUILDERS: &[&str] = &[
    "binned",
    "sweep",
    "longest-axis-sweep",
    "sbvh",
    "ploc",
    "ploc-reinsertion",
];

/// How the tree comes about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Builder {
    Binned,
    Sweep,
    LongestAxisSweep,
    Sbvh,
    Ploc,
    PlocReinsertion,
}

/// Presets of the crate obvhs, from fast to slow.
const PRESETS: &[&str] = &[
    "fastest",
    "very-fast",
    "fast",
    "medium",
    "slow",
    "very-slow",
];

/// The parameters as builders read them.
#[derive(Debug, Clone)]
pub(super) struct Settings {
    pub builder: Builder,
    pub leaf_size: usize,
    pub min_leaf_size: usize,
    pub traversal_cost: f32,
    pub intersection_cost: f32,
    pub bins: usize,
    pub sweep_bins_from: usize,
    pub spatial_alpha: f32,
    pub spatial_bins: usize,
    /// Index into the presets of obvhs.
    pub preset: usize,
    pub reinsertion: u32,
    pub reinsertion_share: f32,
}

impl Settings {
    pub fn new(params: &Params) -> Self {
        let index = |name: &str, names: &[&str]| {
            let chosen = params.name(name);
            names.iter().position(|n| *n == chosen).unwrap_or(0)
        };
        let builder = match index("builder", BUILDERS) {
            1 => Builder::Sweep,
            2 => Builder::LongestAxisSweep,
            3 => Builder::Sbvh,
            4 => Builder::Ploc,
            5 => Builder::PlocReinsertion,
            _ => Builder::Binned,
        };
        let leaf_size = params.integer("leaf_size") as usize;
        Self {
            builder,
            leaf_size,
            min_leaf_size: (params.integer("min_leaf_size") as usize).min(leaf_size),
            traversal_cost: params.number("traversal_cost") as f32,
            intersection_cost: params.number("intersection_cost") as f32,
            bins: params.integer("bins") as usize,
            sweep_bins_from: params.integer("sweep_bins_from") as usize,
            spatial_alpha: params.number("spatial_alpha") as f32,
            spatial_bins: params.integer("spatial_bins") as usize,
            preset: index("ploc_preset", PRESETS),
            reinsertion: params.integer("reinsertion") as u32,
            reinsertion_share: params.number("reinsertion_share") as f32,
        }
    }

    /// Whether no subtree over these references can be cheaper than a leaf, decided without
    /// building one: each reference lies in some leaf at least as large as itself.
    pub fn must_be_leaf(&self, bounds: Box3, areas: impl ExactSizeIterator<Item = f32>) -> bool {
        let count = areas.len();
        if count <= self.min_leaf_size.max(1) {
            return true;
        }
        // Reinsertion wants leaves of one triangle; those that do not pay are merged after it.
        if count > self.leaf_size || self.reinsertion > 0 {
            return false;
        }
        let least: f32 = areas.sum();
        self.intersection_cost * (count as f32 * bounds.half_area() - least)
            <= self.traversal_cost * bounds.half_area()
    }
}

/// Parameters that all structures over this tree share.
pub fn tree_parameters() -> ParameterSchema {
    let number = |name, description, default, min, max| Parameter {
        name,
        description,
        default: ParamValue::Number(default),
        range: ParamRange::Number { min, max },
    };
    let integer = |name, description, default, min, max| Parameter {
        name,
        description,
        default: ParamValue::Integer(default),
        range: ParamRange::Integer { min, max },
    };
    let choice = |name, description, default: &str, names| Parameter {
        name,
        description,
        default: ParamValue::Name(default.to_owned()),
        range: ParamRange::Choice(names),
    };
    vec![
        choice(
            "builder",
            "binned SAH (Wald 2007); sweep: SAH at every triangle of three axes; \
             longest-axis-sweep: of the longest axis (Dufay 2017); sbvh: spatial splits (Stich et \
             al. 2009); ploc: bottom-up (Meister & Bittner 2018, crate obvhs), also with obvhs' \
             reinsertion",
            "binned",
            BUILDERS,
        ),
        integer("leaf_size", "most triangles in a leaf", 4, 1, 31),
        integer(
            "min_leaf_size",
            "nodes of at most so many triangles become leaves whatever they cost (Dufay 2017: 6)",
            1,
            1,
            31,
        ),
        number(
            "traversal_cost",
            "SAH cost of visiting an inner node",
            1.0,
            0.01,
            100.0,
        ),
        number(
            "intersection_cost",
            "SAH cost of testing a triangle",
            1.0,
            0.01,
            100.0,
        ),
        integer(
            "bins",
            "bins on an axis for object splits (binned, sbvh, large nodes of sweep)",
            12,
            2,
            MAX_BINS as i64,
        ),
        integer(
            "sweep_bins_from",
            "nodes of so many triangles are split at borders of bins only (sweep); the largest value \
             for a sweep everywhere",
            128,
            2,
            1 << 31,
        ),
        number(
            "spatial_alpha",
            "least overlap of an object split, in areas of the root, that makes sbvh try a spatial \
             one (sbvh; Stich et al. 2009: 1e-5)",
            1e-3,
            0.0,
            1.0,
        ),
        integer(
            "spatial_bins",
            "bins on an axis for spatial splits (sbvh)",
            32,
            2,
            256,
        ),
        choice(
            "ploc_preset",
            "preset of obvhs (ploc, ploc-reinsertion)",
            "medium",
            PRESETS,
        ),
        integer(
            "reinsertion",
            "rounds of reinsertion after any builder (Meister & Bittner 2018)",
            0,
            0,
            64,
        ),
        number(
            "reinsertion_share",
            "share of the nodes, largest first, that a round tries to reinsert",
            0.2,
            0.0,
            1.0,
        ),
    ]
}

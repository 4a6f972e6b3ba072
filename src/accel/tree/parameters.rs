//! Parameters of all builders.

use super::parallel::{self, Method};
use super::reference::Box3;
use raystone_core::parameters;

/// Maximum neighbours examined on either side in clustering, as in the kernel `nearest`.
pub(super) const LARGEST_RADIUS: u32 = 32;
pub(super) const MAX_BINS: usize = 32;

parameters! {
    /// Parameters that all structures over this tree share.
    pub struct TreeParameters {
        /// binned SAH (Wald 2007); sweep: SAH at every triangle of three axes; longest-axis-sweep: of
        /// the longest axis (Dufay 2017); sbvh: spatial splits (Stich et al. 2009); ploc: bottom-up
        /// (Meister & Bittner 2018, crate obvhs), also with obvhs' reinsertion; lbvh: the radix tree over
        /// Morton codes (Karras 2012); host-*, device-*: a tree that is made (and collapsed) on the device, or
        /// the same to the bit on the host; auto: by the table of
        /// advice
        builder: Builder = Builder::Binned;
        /// most triangles in a leaf
        leaf_size: usize = 4, in 1..=31;
        /// nodes of at most so many triangles become leaves whatever they cost (Dufay 2017: 6)
        min_leaf_size: usize = 1, in 1..=31;
        /// SAH cost of visiting an inner node
        traversal_cost: f32 = 1.0, in 0.01..=100.0;
        /// SAH cost of testing a triangle
        intersection_cost: f32 = 1.0, in 0.01..=100.0;
        /// bins on an axis for object splits (binned, sbvh, large nodes of sweep)
        bins: usize = 12, in 2..=MAX_BINS;
        /// nodes of so many triangles are split at borders of bins only (sweep); the largest value for a
        /// sweep everywhere
        sweep_bins_from: usize = 128, in 2..=1 << 31;
        /// least overlap of an object split, in areas of the root, that makes sbvh try a spatial one
        /// (sbvh; Stich et al. 2009: 1e-5)
        spatial_alpha: f32 = 1e-3, in 0.0..=1.0;
        /// bins on an axis for spatial splits (sbvh)
        spatial_bins: usize = 32, in 2..=256;
        /// spatial splits cut triangles, as in the paper; without it the boxes of triangles, whose hits are
        /// proved for any ray; objects with instances always (sbvh)
        spatial_clip: bool = true;
        /// preset of obvhs (ploc, ploc-reinsertion)
        ploc_preset: Preset = Preset::Medium;
        /// Morton codes of 60 bits instead of 30 (host-*, device-*)
        long_codes: bool = false;
        /// neighbours on either side that a cluster looks at (host-ploc, device-ploc)
        search_radius: u32 = 14, in 1..=LARGEST_RADIUS;
        /// rounds of reinsertion after any builder (Meister & Bittner 2018)
        reinsertion: u32 = 0, in 0..=64;
        /// share of the nodes, largest first, that a round tries to reinsert
        reinsertion_share: f32 = 0.2, in 0.0..=1.0;
    }

    /// How the tree comes about.
    pub enum Builder {
        /// Binned SAH.
        Binned = "binned",
        /// SAH at every triangle of three axes.
        Sweep = "sweep",
        /// SAH at every triangle of the longest axis.
        LongestAxisSweep = "longest-axis-sweep",
        /// Spatial splits.
        Sbvh = "sbvh",
        /// Bottom-up.
        Ploc = "ploc",
        /// Bottom-up, then obvhs' reinsertion.
        PlocReinsertion = "ploc-reinsertion",
        /// Radix tree over Morton codes, on the host.
        HostLbvh = "host-lbvh",
        /// Radix tree over Morton codes, on the device.
        DeviceLbvh = "device-lbvh",
        /// Clustering along the curve of Morton codes, on the host.
        HostPloc = "host-ploc",
        /// Clustering along the curve of Morton codes, on the device.
        DevicePloc = "device-ploc",
        /// The builder that the table of advice expects to cost least on the scene.
        Auto = "auto",
    }

    /// Presets of the crate obvhs.
    pub(crate) enum Preset {
        Fastest = "fastest",
        VeryFast = "very-fast",
        Fast = "fast",
        Medium = "medium",
        Slow = "slow",
        VerySlow = "very-slow",
    }
}

impl TreeParameters {
    /// The same with single-triangle leaves, for structures that merge leaves themselves.
    #[must_use]
    pub(crate) fn with_single_leaves(&self) -> Self {
        Self {
            leaf_size: 1,
            ..self.clone()
        }
    }

    /// Settings of the builders that can run on a device.
    pub(super) fn parallel(&self, method: Method) -> parallel::Settings {
        parallel::Settings {
            method,
            long_codes: self.long_codes,
        }
    }

    pub(super) fn clustering(&self) -> Method {
        Method::Ploc {
            radius: self.search_radius,
        }
    }

    /// Settings for the device, if it is to build.
    pub(crate) fn on_device(&self) -> Option<parallel::Settings> {
        match self.builder {
            Builder::DeviceLbvh => Some(self.parallel(Method::Lbvh)),
            Builder::DevicePloc => Some(self.parallel(self.clustering())),
            _ => None,
        }
    }

    /// Maximum triangles of a node that becomes a leaf at any cost.
    pub(super) fn least_leaf(&self) -> usize {
        self.min_leaf_size.min(self.leaf_size)
    }

    /// True if no subtree over these references can be cheaper than a leaf, decided without
    /// building one: each reference lies in some leaf at least as large as itself.
    pub(super) fn must_be_leaf(
        &self,
        bounds: Box3,
        areas: impl ExactSizeIterator<Item = f32>,
    ) -> bool {
        let count = areas.len();
        if count <= self.least_leaf().max(1) {
            return true;
        }
        // Reinsertion wants leaves of one triangle; unprofitable ones are merged after it.
        if count > self.leaf_size || self.reinsertion > 0 {
            return false;
        }
        let least: f32 = areas.sum();
        self.intersection_cost * (count as f32 * bounds.half_area() - least)
            <= self.traversal_cost * bounds.half_area()
    }
}

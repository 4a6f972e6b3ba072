//! Lane refill: an invocation of the batch kernel that finishes a ray starts its next one, instead
//! of waiting for the longest ray of its vector.
//!
//! T. Aila, S. Laine, "Understanding the efficiency of ray traversal on GPUs", HPG 2009, §4
//! ("persistent threads", "replacing terminated rays"), here without atomics: each workgroup has
//! its own run of rays, and each invocation a share of it. Kernel:
//! `kernels/integrator/trace_rays.wesl`; a refillable structure exports `Traversal`, `begin` and
//! `advance` in addition to `trace`.

use raystone_core::parameters;

parameters! {
    /// How the batch kernel hands rays to its invocations.
    pub struct RefillParameters {
        /// whether an invocation begins its next ray as soon as it is done with one; auto: on software
        /// adapters, unless neighbouring rays are alike (primary rays)
        refill: Refill = Refill::Auto;
        /// most rays that an invocation answers, one after the other, where it is refilled
        rays_per_lane: u32 = 64, in 1..=4096;
    }

    /// When invocations are refilled.
    pub(crate) enum Refill {
        None = "none",
        /// Where measurements show a gain.
        Auto = "auto",
        Always = "always",
    }
}

/// Minimum workgroups of a dispatch, if it has enough rays: rays per invocation are reduced to
/// reach it. It is enough for the cores of a software adapter.
const LEAST_GROUPS: u32 = 16;

impl RefillParameters {
    /// For structures that cannot be refilled.
    pub const NONE: Self = Self {
        refill: Refill::None,
        rays_per_lane: 1,
    };

    /// True if invocations are refilled, for coherent rays or others.
    pub(super) fn applies(&self, coherent: bool, software: bool) -> bool {
        match self.refill {
            Refill::None => false,
            Refill::Auto => software && !coherent,
            Refill::Always => true,
        }
    }

    /// Invocations for this many rays, in workgroups of `of_group`.
    pub(super) fn lanes(&self, rays: u32, of_group: u32) -> u32 {
        let few = rays / (LEAST_GROUPS * of_group);
        rays.div_ceil(few.clamp(1, self.rays_per_lane))
    }
}

/// Most rays of an invocation, rays, invocations of a workgroup, and invocations: no fewer than sixteen workgroups have, where there are as many rays.
const LANES: [[u32; 4]; 10] = [
    [64, 0, 64, 0],
    [64, 63, 64, 63],
    [64, 2047, 64, 2047],
    [64, 2048, 64, 1024],
    [64, 1 << 16, 64, 1024],
    [64, 1 << 20, 64, 1 << 14],
    [1, 1 << 20, 64, 1 << 20],
    [4096, u32::MAX, 64, 1 << 20],
    [64, 2048, 32, 512],
    [64, 2048, 256, 2048],
];

/// Hands known rays to invocations; where nothing is asked for, those are refilled on software alone, and not for rays that are alike.
///
/// # Errors
/// They are handed out otherwise: times are those of another kernel, or of fewer invocations.
pub(crate) fn check() -> Result<(), String> {
    let rule = |refill, rays_per_lane| RefillParameters {
        refill,
        rays_per_lane,
    };
    let kinds = [Refill::None, Refill::Auto, Refill::Always];
    let found = kinds.map(|refill| {
        [[false, false], [false, true], [true, false], [true, true]]
            .map(|[alike, software]| rule(refill, 64).applies(alike, software))
    });
    let expected = [[false; 4], [false, true, false, false], [true; 4]];
    let is_other = |[most, rays, of_group, lanes]: &&[u32; 4]| {
        rule(Refill::Auto, *most).lanes(*rays, *of_group) != *lanes
    };
    let other = LANES.iter().find(is_other);
    if found == expected && other.is_none() {
        return Ok(());
    }
    Err(format!(
        "known invocations are refilled otherwise ({found:?}) or are others than in {other:?}: this program times other kernels \
         than it says; build it anew, and report what stays wrong"
    ))
}

#[cfg(test)]
mod tests {
    #[test]
    fn rays_that_are_alike_are_left_alone_and_few_rays_keep_their_workgroups() {
        assert_eq!(super::check(), Ok(()));
    }
}

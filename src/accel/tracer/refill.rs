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

#[cfg(test)]
mod tests {
    use super::*;

    fn refill(rays_per_lane: u32) -> RefillParameters {
        RefillParameters {
            refill: Refill::Auto,
            rays_per_lane,
        }
    }

    #[test]
    fn rays_that_are_alike_and_other_adapters_are_left_alone() {
        let all = [(false, false), (false, true), (true, false), (true, true)];
        let of = |refill: Refill| {
            let parameters = RefillParameters {
                refill,
                rays_per_lane: 64,
            };
            all.map(|(coherent, software)| parameters.applies(coherent, software))
        };
        assert_eq!(of(Refill::None), [false; 4]);
        assert_eq!(of(Refill::Auto), [false, true, false, false]);
        assert_eq!(of(Refill::Always), [true; 4]);
    }

    #[test]
    fn a_dispatch_of_few_rays_keeps_its_workgroups() {
        assert_eq!(refill(64).lanes(0, 64), 0);
        assert_eq!(refill(64).lanes(63, 64), 63);
        assert_eq!(refill(64).lanes(2047, 64), 2047);
        assert_eq!(refill(64).lanes(2048, 64), 1024);
        assert_eq!(refill(64).lanes(1 << 16, 64), 1024);
        assert_eq!(refill(64).lanes(1 << 20, 64), 1 << 14);
        assert_eq!(refill(1).lanes(1 << 20, 64), 1 << 20);
        assert_eq!(refill(4096).lanes(u32::MAX, 64), 1 << 20);
        assert_eq!(refill(64).lanes(2048, 32), 512);
        assert_eq!(refill(64).lanes(2048, 256), 2048);
    }
}

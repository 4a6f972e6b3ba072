//! Coherence of consecutive rays in a buffer, one per lane, as external tracers process them.

use super::trace::trace_of;
use super::{Machine, Memory, Pass, Warp, run_groups};
use rayon::prelude::*;
use raystone_accel::{CpuTwin, Query, Ray};
use raystone_config::Coherence;
use raystone_record::Tallies;

/// Tallies (for class 0) of the machine of `settings` for each of several groups spread over these
/// rays; a group is [`Coherence::warps`] consecutive warps. The last warp may have idle lanes.
///
/// # Errors
/// As [`trace_of`].
pub fn of_rays(
    rays: &[Ray],
    query: Query,
    (twin, memory): (&dyn CpuTwin, &Memory),
    settings: &Coherence,
) -> Result<Vec<Tallies>, String> {
    let lanes = (settings.warp[0] * settings.warp[1]) as usize;
    let warp = |rays: &[Ray]| -> Result<Warp, String> {
        let traces = rays
            .par_iter()
            .map(|ray| trace_of(twin, memory, ray, query).map(Some));
        let mut pass = Pass {
            class: 0,
            lanes: traces.collect::<Result<_, _>>()?,
        };
        pass.lanes.resize(lanes, None);
        Ok(Warp { passes: vec![pass] })
    };
    let groups = first_warps(rays.len().div_ceil(lanes), settings).into_iter();
    let groups = groups.map(|first| {
        let from = &rays[first * lanes..];
        let of_group = from.chunks(lanes).take(settings.warps as usize);
        of_group.map(warp).collect::<Result<Vec<_>, _>>()
    });
    let groups = groups.collect::<Result<Vec<_>, _>>()?;
    Ok(run_groups(&Machine::new(settings), &groups))
}

/// First warp of each group among `all`: adjacent if they cover all, else evenly spread.
fn first_warps(all: usize, settings: &Coherence) -> Vec<usize> {
    let [groups, warps] = [settings.groups, settings.warps].map(|n| n as usize);
    let whole = all.div_ceil(warps);
    let place = |group: usize| {
        if groups < whole {
            group * whole / groups * warps
        } else {
            group * warps
        }
    };
    (0..groups.min(whole)).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_config::Rule;

    #[test]
    fn groups_hold_each_warp_once_where_they_hold_all_and_lie_apart_where_not() {
        let of = |groups, warps| Coherence {
            resolution: [16, 16],
            spp: vec![1],
            groups,
            warps,
            warp: [8, 4],
            samples: 1,
            rule: Rule::Loop,
            line_bytes: 128,
            l1_kib: 1,
            l1_ways: 0,
            l2_kib: 1,
            l2_ways: 0,
        };
        assert_eq!(first_warps(32, &of(4, 8)), [0, 8, 16, 24]);
        assert_eq!(first_warps(32, &of(100, 8)), [0, 8, 16, 24]);
        assert_eq!(first_warps(64, &of(4, 8)), [0, 16, 32, 48]);
        assert_eq!(first_warps(60, &of(3, 8)), [0, 16, 40]);
        assert_eq!(first_warps(0, &of(3, 8)), [0; 0]);
    }
}

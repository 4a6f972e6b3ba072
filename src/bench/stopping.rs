//! When a sampler has taken enough samples for an error that was asked for.
//!
//! A rule that looks at an estimate again and again and stops when it is small stops when it is small by chance: the
//! error that it then reports is too small, and the claim is wrong more often than one look would have it. Two
//! things bound that. It looks only at the powers of two of an experiment, a handful of times, and at the upper end of
//! an interval whose chance to miss is shared out among the looks (Bonferroni): whatever the looks have in
//! common, a cell is ended with its true error above the target with a probability of at most 1 − confidence. The error figure of the
//! cell itself is the mean over its replicates as always: where the target is met with room, stopping tells nothing
//! of it; where it is met by a hair, it is too small by at most about the half width of that interval.

use raystone_config::StopRule;
use raystone_record::ErrorRecord;
use raystone_record::replicates::Replicates;
use raystone_stats::comparison::LogFigure;
use raystone_stats::heavy_tails::is_heavy;

/// What the metric that the rule looks at begins with.
const METRIC: &str = "relmse-unbiased/";

/// Whether an error is below the target of a rule, looked at `looks` times at most.
pub fn is_met(rule: &StopRule, error: &LogFigure, looks: usize) -> bool {
    let chance = (1.0 - rule.confidence) / looks.max(1) as f64;
    error.upper(chance) <= rule.relmse
}

/// Whether the mean error of these replicates at `spp` is. That of a single one never is: of its spread nothing is
/// known; nor is an error that the reference does not resolve, or one whose interval is not to be trusted.
pub(crate) fn is_met_by(
    rule: &StopRule,
    replicates: &[&ErrorRecord],
    spp: u32,
    looks: usize,
) -> bool {
    let all = Replicates(replicates);
    let errors = replicates.iter().flat_map(|r| &r.errors);
    let mut ids = errors.flat_map(|e| e.metrics.keys());
    let Some(id) = ids
        .find(|id| id.starts_with(METRIC))
        .filter(|_| all.have_spread())
    else {
        return false;
    };
    let error = all.log_figure(id, |without| Some(all.mean(id, spp, without)?.ln()));
    let trusted = |error: &LogFigure| {
        let tail = all.tail(spp);
        !tail.is_some_and(|tail| is_heavy(tail, error.interval()))
    };
    error.is_some_and(|error| is_met(rule, &error, looks) && trusted(&error))
}

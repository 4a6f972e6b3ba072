//! Decides when a sampler has enough samples for a requested error.
//!
//! A rule that repeatedly checks an estimate and stops when it is small stops when it is small by
//! chance: the reported error is too small, and the claim is wrong more often than after a single
//! check. Two measures bound that. It checks only at the powers of two of an experiment, a handful
//! of times, and uses the upper end of an interval whose error probability is divided among the
//! checks (Bonferroni): however they depend on each other, a cell ends with its true error above
//! the target with a probability of at most 1 − confidence. The cell's error figure is the mean
//! over its replicates as always: if the target is met with room, stopping has no effect on it; if
//! barely, it is too small by at most about half the width of that interval.

use raystone_config::StopRule;
use raystone_record::ErrorRecord;
use raystone_record::replicates::Replicates;
use raystone_stats::comparison::LogFigure;
use raystone_stats::heavy_tails::is_heavy;

/// Prefix of the metric used by the rule.
const METRIC: &str = "relmse-unbiased/";

/// True if an error is below the target of a rule that checks at most `looks` times.
pub fn is_met(rule: &StopRule, error: &LogFigure, looks: usize) -> bool {
    let chance = (1.0 - rule.confidence) / looks.max(1) as f64;
    error.upper(chance) <= rule.relmse
}

/// True if the mean error of these replicates at `spp` is below the target. Never true for a single
/// replicate, whose spread is unknown, an unresolved error, or an unreliable interval.
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

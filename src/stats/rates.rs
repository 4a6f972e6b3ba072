//! Rates from times.

use crate::interval::Interval;
use crate::statistics::median_interval;

/// `samples` minus the cost of an empty measurement; at least a hundredth of it, for finite rates.
pub fn without_overhead(samples: &[f64], empty: f64) -> Vec<f64> {
    samples
        .iter()
        .map(|ms| (ms - empty).max(0.01 * ms))
        .collect()
}

/// True if most rounds take no longer than an empty one does, within a hundredth: it cannot be taken off them.
pub fn is_hidden(samples: &[f64], empty: f64) -> bool {
    let hidden = samples.iter().filter(|ms| **ms - empty <= 0.01 * **ms);
    2 * hidden.count() > samples.len()
}

/// Rate in millions per second from milliseconds for `items`, median with interval.
pub fn millions_per_second(ms: &[f64], items: f64) -> Option<Interval> {
    let rates: Vec<f64> = ms.iter().map(|ms| items / ms * 1e-3).collect();
    median_interval(&rates)
}

/// Checks a rate in millions per second by hand: `items` over the times next to the middle of these.
/// Returns what is wrong, or `None`.
pub fn rate_fault(rate: &Interval, items: f64, ms: &[f64]) -> Option<String> {
    let mut sorted = ms.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (short, long) = (
        sorted.get((ms.len().max(1) - 1) / 2)?,
        sorted.get(ms.len() / 2)?,
    );
    let [least, most] = [long, short].map(|ms| items / 1000.0 / ms);
    let rounding = 1e-9 * most;
    let is_right = (least - rounding..=most + rounding).contains(&rate.value);
    (!is_right).then(|| {
        format!(
            "a rate of {} million a second is not that of {items} in {short} to {long} ms",
            rate.value
        )
    })
}

/// Checks rounds above an empty measurement by their sum. Returns what is wrong, or `None`.
pub fn overhead_fault(samples: &[f64], empties: &[f64], above: &[f64]) -> Option<String> {
    let mut sorted = empties.to_vec();
    sorted.sort_by(f64::total_cmp);
    let empty = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let least: f64 = samples.iter().sum::<f64>() - empty * samples.len() as f64;
    // Rounds that are hardly longer than an empty one are cut off, and add at most a hundredth each.
    let room = 0.01 * samples.iter().filter(|ms| 0.99 * **ms < empty).sum::<f64>();
    let cut: f64 = samples.iter().map(|ms| (empty - ms).max(0.0)).sum();
    let found: f64 = above.iter().sum();
    let rounding = 1e-9 * samples.iter().sum::<f64>();
    let is_right = (least - rounding..=least + cut + room + rounding).contains(&found);
    (!is_right).then(|| {
        format!(
            "rounds of {samples:?} ms are reported as {above:?} ms, where an empty one takes {empty} ms"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_measurement_that_is_not_taken_off_is_told() {
        for (samples, empty) in [
            (&[2.0, 1.0, 4.0][..], 0.5),
            (&[2.0, 0.4, 4.0], 0.5),
            (&[0.501, 3.0], 0.5),
        ] {
            let above = without_overhead(samples, empty);
            let empties = [empty, 0.0, 2.0];
            assert_eq!(
                overhead_fault(samples, &empties, &above),
                None,
                "{samples:?}"
            );
            let twice = without_overhead(&above, empty);
            let longest = without_overhead(samples, 2.0);
            for wrong in [samples, &twice, &longest] {
                let found = overhead_fault(samples, &empties, wrong);
                assert!(found.is_some(), "{samples:?} {wrong:?}");
            }
        }
    }

    #[test]
    fn an_empty_round_cannot_be_taken_off_rounds_that_are_no_longer() {
        for (samples, empty, hidden) in [
            (&[0.40, 0.42, 0.45, 0.37, 4.9][..], 0.45, true),
            (&[0.40, 4.2, 4.5, 0.37, 4.9], 0.45, false),
            (&[0.4545, 0.4545, 0.4545], 0.45, true),
            (&[0.46, 0.46, 0.46], 0.45, false),
            (&[0.3], 0.0, false),
            // Half of them are longer.
            (&[0.40, 4.2, 4.5, 0.37], 0.45, false),
        ] {
            assert_eq!(is_hidden(samples, empty), hidden, "{samples:?} {empty}");
        }
    }

    #[test]
    fn rates_that_count_twice_are_told() {
        for ms in [&[2.0, 1.0, 4.0][..], &[1.0, 2.0, 2.02, 4.0], &[5.0]] {
            let rate = millions_per_second(ms, 6e4).unwrap();
            assert_eq!(rate_fault(&rate, 6e4, ms), None);
            assert!(rate_fault(&rate, 3e4, ms).is_some());
            assert!(rate_fault(&rate, 6.1e4, ms).is_some());
            let halved: Vec<f64> = ms.iter().map(|ms| ms / 2.0).collect();
            assert!(rate_fault(&rate, 6e4, &halved).is_some());
        }
    }
}

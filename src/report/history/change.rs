//! Change points of a series: the hierarchical divisive method of Matteson and James (2014), "A Nonparametric
//! Approach for Multiple Change Point Analysis of Multivariate Data", Journal of the American Statistical Association
//! 109(505). It assumes only that runs are independent.

use raystone_core::random::Pcg32;

/// Least number of runs of a level: a single run is an outlier, not a level.
const LEAST_LEVEL: usize = 3;
/// Number of permutations of a test.
const PERMUTATIONS: usize = 499;

/// With fewer runs even the clearest change has a p-value above 0.05: of seven the three lowest lie at either end in
/// 2 of 35 orders; of eight the four lowest in 2 of 70.
pub(crate) const LEAST_RUNS: usize = 8;

/// Returns the starts of all levels after the first, each with the p-value of its permutation test. The best split of
/// all parts is repeated until one is not significant at `level`.
pub(crate) fn e_divisive(values: &[f64], level: f64) -> Vec<(usize, f64)> {
    let mut random = Pcg32::new(0x5eed);
    let mut found: Vec<(usize, f64)> = Vec::new();
    if values.len() < LEAST_RUNS {
        return found;
    }
    loop {
        let mut bounds: Vec<usize> = vec![0];
        bounds.extend(found.iter().map(|(at, _)| *at));
        bounds.push(values.len());
        let Some((statistic, at)) = best_of_parts(values, &bounds) else {
            return found;
        };
        let mut shuffled = values.to_vec();
        let mut as_extreme = 1;
        for _ in 0..PERMUTATIONS {
            for part in bounds.windows(2) {
                shuffle(&mut shuffled[part[0]..part[1]], &mut random);
            }
            let other = best_of_parts(&shuffled, &bounds);
            // Equal sets in another order differ by rounding.
            let is_as_extreme = |(other, _): (f64, usize)| other >= statistic * (1.0 - 1e-9);
            as_extreme += usize::from(other.is_some_and(is_as_extreme));
        }
        let p = as_extreme as f64 / (PERMUTATIONS + 1) as f64;
        if p > level {
            return found;
        }
        found.push((at, p));
        found.sort_by_key(|(at, _)| *at);
    }
}

/// Returns statistic and place of the best split of any part; `None` if all are too short.
fn best_of_parts(values: &[f64], bounds: &[usize]) -> Option<(f64, usize)> {
    let parts = bounds.windows(2).filter_map(|part| {
        let (statistic, at) = best_split(&values[part[0]..part[1]])?;
        Some((statistic, part[0] + at))
    });
    parts.max_by(|a, b| a.0.total_cmp(&b.0))
}

/// Returns the split with the greatest energy distance: nm/(n+m) times twice the mean distance between the sides less
/// the mean distances within them (equations 5 and 6, exponent 1).
fn best_split(values: &[f64]) -> Option<(f64, usize)> {
    let sum_to = |k: usize, others: &[f64]| -> f64 {
        others.iter().map(|other| (values[k] - other).abs()).sum()
    };
    let all = values.len();
    let (mut between, mut left) = (0.0, 0.0);
    let mut right: f64 = (0..all).map(|k| sum_to(k, &values[k + 1..])).sum();
    let mut best: Option<(f64, usize)> = None;
    for n in 1..all {
        let (moved, m) = (n - 1, all - n);
        let (to_left, to_right) = (sum_to(moved, &values[..moved]), sum_to(moved, &values[n..]));
        between += to_right - to_left;
        left += to_left;
        right -= to_right;
        if n < LEAST_LEVEL || m < LEAST_LEVEL {
            continue;
        }
        let pairs = |count: usize| (count * (count - 1)) as f64 / 2.0;
        let (n_, m_) = (n as f64, m as f64);
        let distance = 2.0 * between / (n_ * m_) - left / pairs(n) - right / pairs(m);
        let statistic = n_ * m_ / (n_ + m_) * distance;
        if best.is_none_or(|(most, _)| statistic > most) {
            best = Some((statistic, n));
        }
    }
    best.filter(|(statistic, _)| *statistic > 0.0)
}

/// Shuffles by Fisher and Yates.
fn shuffle(values: &mut [f64], random: &mut Pcg32) {
    for i in (1..values.len()).rev() {
        values.swap(i, random.below(i + 1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(random: &mut Pcg32, n: usize, level: f64) -> Vec<f64> {
        // A sum of four is near enough to a normal number.
        let one = |random: &mut Pcg32| (0..4).map(|_| random.uniform()).sum::<f64>() - 2.0;
        (0..n).map(|_| level + one(random)).collect()
    }

    #[test]
    fn the_statistic_is_that_of_the_definition() {
        let values = [1.0, 4.0, 2.0, 9.0, 8.0, 11.0];
        let mean = |a: &[f64], b: &[f64]| {
            let pairs = a.iter().flat_map(|x| b.iter().map(move |y| (x - y).abs()));
            pairs.sum::<f64>()
        };
        let (a, b) = values.split_at(3);
        // Of three values there are three pairs, and the double sum counts each twice.
        let distance = 2.0 * mean(a, b) / 9.0 - mean(a, a) / 6.0 - mean(b, b) / 6.0;
        let (statistic, at) = best_split(&values).unwrap();
        assert_eq!(at, 3);
        assert!((statistic - 1.5 * distance).abs() < 1e-12);
    }

    #[test]
    fn levels_without_a_change_are_left_alone_as_often_as_is_said() {
        let mut random = Pcg32::new(7);
        let series = 200;
        let alarms = (0..series)
            .filter(|_| !e_divisive(&noise(&mut random, 16, 10.0), 0.05).is_empty())
            .count();
        // Of 200 at 5 %, 10 are expected; 20 or more have a chance of 0.3 %.
        assert!(alarms < 20, "{alarms} of {series}");
        assert!(e_divisive(&[3.0; 20], 0.05).is_empty());
    }

    #[test]
    fn steps_are_found_where_they_are() {
        // Apart from the steps, one level in twenty is split by chance.
        let (mut exact, mut both) = (0, 0);
        for seed in 0..40 {
            let mut random = Pcg32::new(seed);
            let mut values = noise(&mut random, 10, 0.0);
            values.extend(noise(&mut random, 10, 6.0));
            values.extend(noise(&mut random, 10, 2.0));
            let found = e_divisive(&values, 0.05);
            let found: Vec<usize> = found.iter().map(|(at, _)| *at).collect();
            exact += usize::from(found == [10, 20]);
            both += usize::from(found.contains(&10) && found.contains(&20));
        }
        // Of 40, chance may miss or move a step; 8 or more false splits have a chance of 0.1 %.
        assert!(both >= 38 && exact >= 32, "{both}, {exact}");
        // One outlier is not a level.
        let alarms = (0..40).filter(|seed| {
            let mut outlier = noise(&mut Pcg32::new(*seed), 20, 0.0);
            outlier[12] = 50.0;
            !e_divisive(&outlier, 0.05).is_empty()
        });
        let alarms = alarms.count();
        assert!(alarms <= 8, "{alarms}");
    }

    #[test]
    fn eight_runs_are_enough_and_seven_are_not() {
        let step =
            |n: usize| (0..n).map(move |i| f64::from(u8::from(i >= n / 2)) + 1e-3 * i as f64);
        assert_eq!(
            e_divisive(&step(LEAST_RUNS).collect::<Vec<_>>(), 0.05).len(),
            1
        );
        assert!(e_divisive(&step(LEAST_RUNS - 1).collect::<Vec<_>>(), 0.05).is_empty());
    }
}

//! Alias tables: a number in [0, 1) chooses one of n in constant time (A. Walker 1977; M. Vose, "A linear algorithm for
//! generating random numbers with a given distribution", 1991).

/// Up to `threshold` of the n-th part of the unit interval that belongs to an entry it is chosen, else its `alias`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AliasEntry {
    pub threshold: f32,
    pub alias: u32,
}

/// Entries that choose in proportion to the weights, which are finite and not negative. Where all are 0, all are alike.
pub(super) fn alias_table(weights: &[f64]) -> Vec<AliasEntry> {
    let total: f64 = weights.iter().sum();
    let count = weights.len() as f64;
    let mut part: Vec<f64> = weights
        .iter()
        .map(|w| if total > 0.0 { w / total * count } else { 1.0 })
        .collect();
    let mut table: Vec<AliasEntry> = (0..weights.len() as u32)
        .map(|alias| AliasEntry {
            threshold: 1.0,
            alias,
        })
        .collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) =
        (0..weights.len()).partition(|i| part[*i] < 1.0);
    while let (Some(low), Some(&high)) = (small.pop(), large.last()) {
        table[low] = AliasEntry {
            threshold: part[low] as f32,
            alias: high as u32,
        };
        part[high] -= 1.0 - part[low];
        if part[high] < 1.0 {
            large.pop();
            small.push(high);
        }
    }
    // What is left over is 1 but for rounding. An entry without weight must not be chosen all the same.
    for left in small {
        if weights[left] == 0.0 && total > 0.0 {
            let heaviest = weights.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
            table[left] = AliasEntry {
                threshold: 0.0,
                alias: heaviest.map_or(0, |(i, _)| i as u32),
            };
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;

    #[test]
    fn every_entry_is_chosen_as_often_as_its_weight_says() {
        let mut random = Pcg32::new(9);
        for count in [1, 2, 3, 17, 1000] {
            let mut weights: Vec<f64> = (0..count).map(|_| random.uniform().powi(6)).collect();
            weights[0] = if count > 1 { 0.0 } else { 2.0 };
            let total: f64 = weights.iter().sum();
            let mut found = vec![0.0; count];
            for (i, entry) in alias_table(&weights).iter().enumerate() {
                found[i] += f64::from(entry.threshold);
                found[entry.alias as usize] += 1.0 - f64::from(entry.threshold);
            }
            for (found, weight) in found.iter().zip(&weights) {
                let expected = weight / total * count as f64;
                assert!(
                    (found - expected).abs() < 1e-6 * count as f64,
                    "{found}, {expected}"
                );
                assert!(*weight > 0.0 || *found == 0.0);
            }
        }
        let alike = AliasEntry {
            threshold: 1.0,
            alias: 0,
        };
        assert_eq!(alias_table(&[0.0, 0.0])[0], alike);
    }
}

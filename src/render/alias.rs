//! Alias tables: one number chooses one of n in constant time (A. Walker 1977; M. Vose, "A linear
//! algorithm for generating random numbers with a given distribution", 1991), here in integers: the
//! number of parts is a power of two, so the upper bits of a value are the part and the lower ones
//! the position in it.

use super::units::UNITS;

/// The first `threshold` values of a part choose its own index, the others `alias`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AliasEntry {
    pub threshold: u32,
    pub alias: u32,
}

/// Parts of a table with this many choices.
pub(super) fn alias_parts(count: usize) -> usize {
    count.next_power_of_two()
}

/// A table in which each choice has `units` values, which sum to [`UNITS`].
pub(super) fn alias_table(units: &[u32]) -> Vec<AliasEntry> {
    let parts = alias_parts(units.len());
    let size = UNITS / parts as u32;
    let mut left = units.to_vec();
    left.resize(parts, 0);
    let mut table: Vec<AliasEntry> = (0..parts as u32)
        .map(|alias| AliasEntry {
            threshold: size,
            alias,
        })
        .collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) =
        (0..parts).partition(|i| left[*i] < size);
    while let (Some(low), Some(&high)) = (small.pop(), large.last()) {
        table[low] = AliasEntry {
            threshold: left[low],
            alias: high as u32,
        };
        left[high] -= size - left[low];
        if left[high] < size {
            large.pop();
            small.push(high);
        }
    }
    table
}

/// Makes the table of a half, an eighth and three eighths, and of one that is never chosen.
///
/// # Errors
/// A choice has more or fewer values than it should.
pub(super) fn check() -> Result<(), String> {
    let units = [UNITS / 2, UNITS / 8, 0, 3 * (UNITS / 8)];
    let mut found = [0; 4];
    for (own, entry) in alias_table(&units).into_iter().enumerate() {
        found[own] += entry.threshold;
        found[entry.alias as usize] += UNITS / 4 - entry.threshold;
    }
    (found == units).then_some(()).ok_or_else(|| {
        format!(
            "the choices of a known table have {found:?} values, and should have {units:?}: this program chooses lights wrongly; build it \
             anew, and report what stays wrong"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::units::shared_out;
    use super::*;
    use raystone_core::random::Pcg32;

    #[test]
    fn every_entry_has_as_many_of_all_values_as_it_should() {
        let mut random = Pcg32::new(9);
        for count in [1, 2, 3, 17, 1000, 100_000] {
            let mut weights: Vec<f64> = (0..count).map(|_| random.uniform().powi(12)).collect();
            weights[0] = if count > 1 { 0.0 } else { 2.0 };
            let units = shared_out(&weights);
            let table = alias_table(&units);
            let size = UNITS as usize / table.len();
            let mut found = vec![0_u32; table.len()];
            for value in 0..UNITS as usize {
                let (part, place) = (value / size, value % size);
                let own = place < table[part].threshold as usize;
                found[if own {
                    part
                } else {
                    table[part].alias as usize
                }] += 1;
            }
            assert_eq!(found[..count], units);
        }
    }
}

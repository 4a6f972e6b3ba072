//! Compensated sums.

/// Number of independent additions.
pub(super) const LANES: usize = 8;

/// A sum with the rounding errors of its additions in a second number (Neumaier's variant of
/// Kahan's sum, with Knuth's error-free addition), in independent lanes.
#[derive(Clone, Copy)]
pub(super) struct Sum {
    total: [f64; LANES],
    error: [f64; LANES],
}

impl Sum {
    pub(crate) fn new() -> Self {
        Self {
            total: [0.0; LANES],
            error: [0.0; LANES],
        }
    }

    /// Adds a number to every lane.
    #[inline]
    pub(crate) fn add(&mut self, terms: &[f64; LANES]) {
        for (i, &term) in terms.iter().enumerate() {
            let total = self.total[i];
            let sum = total + term;
            let kept = sum - total;
            self.error[i] += (total - (sum - kept)) + (term - kept);
            self.total[i] = sum;
        }
    }

    pub(crate) fn add_one(&mut self, term: f64) {
        let mut terms = [0.0; LANES];
        terms[0] = term;
        self.add(&terms);
    }

    /// The sum of all lanes in two parts: the rounded sum, and the rounding error.
    pub(crate) fn parts(&self) -> [f64; 2] {
        let mut all = Self::new();
        for part in self.total.iter().chain(&self.error) {
            all.add_one(*part);
        }
        [all.total[0], all.error[0]]
    }

    /// The sum, rounded once.
    pub(crate) fn value(&self) -> f64 {
        let [total, error] = self.parts();
        total + error
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_between_large_ones_are_kept() {
        let terms = [1e17, 3.0, -1e17, 2.0];
        let mut sum = Sum::new();
        terms.iter().for_each(|&t| sum.add_one(t));
        assert_eq!(sum.value(), 5.0);
        assert_ne!(terms.iter().sum::<f64>(), 5.0);
    }
}

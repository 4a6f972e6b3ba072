//! The summary, readings and jumps of known searches, computed anew before any is shown.

use crate::judge::{Judged, summary};
use crate::measure;
use crate::newton::{CAPPED, SINGULAR};

/// A search that ended well, by its number from 1 to 100.
fn search(number: u32) -> Judged {
    Judged {
        iterations: number,
        status: 0,
        nearest: 0.5,
        shortest: f64::from(number) / 100.0,
        cosine: 0.5,
        share: 1.0,
        at: [0.0; 2],
    }
}

/// Summarises them.
///
/// # Errors
/// A figure is not what it should be: which, and both values.
pub fn check() -> Result<(), String> {
    let mut all: Vec<Judged> = (1..=100).map(search).collect();
    // Ten wrong ones, which the shortest path is among; five were not finished, two could make no step.
    for one in &mut all[..10] {
        (one.nearest, one.shortest, one.share) = (3.0, 3.0, 0.5);
    }
    for one in &mut all[..5] {
        (one.status, one.cosine) = (CAPPED, 0.9);
    }
    for one in &mut all[5..7] {
        (one.status, one.cosine) = (SINGULAR, 0.1);
    }
    let found = summary(&all);
    for (what, found, expected) in [
        ("mean of iterations", found.iterations, 50.5),
        ("mean in the middle", found.middle.unwrap_or(f64::NAN), 3.0),
        (
            "mean at the silhouette",
            found.silhouette.unwrap_or(f64::NAN),
            6.5,
        ),
        ("99 % of iterations", found.high, 99.0),
        ("most iterations", found.most, 100.0),
        ("share that is wrong", found.wrong, 0.1),
        ("share of other points", found.other, 0.1),
        // Of 0.11 to 1.00 and ten times 3 nine tenths do not exceed 1.
        ("error of nine tenths", found.error, 1.0),
        ("share that was cut short", found.capped, 0.05),
        ("share without a step", found.singular, 0.02),
        ("share of points", found.points, 0.95),
    ] {
        let agrees = (found - expected).abs() <= 1e-12 * expected;
        if !agrees {
            return Err(format!(
                "the {what} of known searches is {found}, and should be {expected}: this program shows wrong figures; \
                 build it anew, and report what stays wrong"
            ));
        }
    }
    measure::known::check()
}

#[cfg(test)]
mod tests {
    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(super::check(), Ok(()));
    }
}

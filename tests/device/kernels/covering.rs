//! A small set of rows that covers every pair of choices: pairwise covering (D. Cohen, S. Dalal, M.
//! Fredman, G. Patton, "The AETG system", 1997). Composition faults nearly always depend on one or
//! two choices; the full product would only repeat them.

use crate::support::Pcg;
use std::collections::BTreeSet;

pub type Choice = (usize, usize);

/// Rows with one level per factor, such that any two levels of two factors that do not clash share
/// a row. `levels` holds the number of levels per factor. Free levels are random, so many
/// combinations of three and more occur, too.
///
/// # Panics
/// If clashes prevent filling a row.
pub fn pairwise(levels: &[usize], clash: impl Fn(Choice, Choice) -> bool) -> Vec<Vec<usize>> {
    let mut random = Pcg::new(levels.len() as u64);
    let mut left = pairs(levels, &clash);
    // Factors with many levels first: their pairs determine the number of rows.
    let mut order: Vec<usize> = (0..levels.len()).collect();
    order.sort_by_key(|factor| std::cmp::Reverse(levels[*factor]));
    let mut rows = Vec::new();
    while let Some(&(a, b)) = left.first() {
        let mut row: Vec<Choice> = vec![a, b];
        for &factor in order.iter().filter(|f| ![a.0, b.0].contains(f)) {
            let fits = |level: &usize| row.iter().all(|other| !clash((factor, *level), *other));
            let gain = |level: &usize| {
                let new = row
                    .iter()
                    .filter(|o| left.contains(&sorted((factor, *level), **o)));
                new.count()
            };
            let fitting = (0..levels[factor]).filter(fits);
            let best = fitting.max_by_key(|level| (gain(level), random.next_u32()));
            let best = best.unwrap_or_else(|| panic!("no level of factor {factor} fits {row:?}"));
            row.push((factor, best));
        }
        row.sort_unstable();
        for (index, a) in row.iter().enumerate() {
            for b in &row[index + 1..] {
                left.remove(&(*a, *b));
            }
        }
        rows.push(row.into_iter().map(|(_, level)| level).collect());
    }
    rows
}

pub fn pairs(
    levels: &[usize],
    clash: impl Fn(Choice, Choice) -> bool,
) -> BTreeSet<(Choice, Choice)> {
    let all: Vec<Choice> = (levels.iter().enumerate())
        .flat_map(|(factor, count)| (0..*count).map(move |level| (factor, level)))
        .collect();
    let mut pairs = BTreeSet::new();
    for (index, a) in all.iter().enumerate() {
        let others = all[index + 1..]
            .iter()
            .filter(|b| b.0 != a.0 && !clash(*a, **b));
        pairs.extend(others.map(|b| (*a, *b)));
    }
    pairs
}

fn sorted(a: Choice, b: Choice) -> (Choice, Choice) {
    (a.min(b), a.max(b))
}

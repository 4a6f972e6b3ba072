//! Projections on every pair of dimensions, on every dimension, and what pixels and seeds have in common.

use super::*;
use raystone::discrepancy::star_2d;

/// Dimensions whose pairs are looked at: a path's pixel position and its first three bounces.
const DIMENSIONS: u32 = 20;
const POINTS: u32 = 1024;
/// Bounds of every pair: 1024 random points have a D* of about 0.04, and 0.25 ± 0.014 of them in a quadrant.
const MOST_STAR: f64 = 0.12;
const LEAST_QUADRANT: f64 = 0.10;
/// Pixels and seeds: first and last pixels, rows and columns, large numbers.
const PLACES: [[u32; 2]; 4] = [
    [0, 0],
    [WIDTH + 1, 1],
    [100 * WIDTH - 1, 9001],
    [77 * WIDTH + 64, 0xdead_beef],
];

/// What cannot keep the bounds by its nature: how its label begins, the worst D* that was measured, and why.
const BY_NATURE: [(&str, f64, &str); 0] = [];

/// Every pair of a sequence and a decorrelation that is accepted, with each of their parameters at its
/// default and in turn at others.
fn all_samplers(samples: u32, dimensions: u32) -> Vec<Sampler> {
    let registry = SamplerRegistry::default();
    let all = |entries: &[Entry]| -> Vec<Variant> { entries.iter().flat_map(variants).collect() };
    let (sequences, decorrelations) = (
        all(&registry.sequence_entries()),
        all(&registry.decorrelation_entries()),
    );
    let mut out = Vec::new();
    for sequence in &sequences {
        let entry = registry.sequences().find(|s| s.name() == sequence.name);
        let facts = entry.expect("registered").facts(&sequence.params);
        let dimensions = facts.dimensions.unwrap_or(dimensions).min(dimensions);
        for decorrelation in &decorrelations {
            match registry.sampler(sequence, decorrelation, &demand(samples, dimensions)) {
                Ok(sampler) => out.push(sampler),
                Err(SamplerError::Pair { .. }) => {}
                Err(error) => panic!("{error}"),
            }
        }
    }
    assert!(out.len() >= 150, "{} samplers", out.len());
    out
}

/// The words of one pixel, dimension by dimension.
fn columns(sampler: &Sampler, [pixel, seed]: [u32; 2], samples: u32) -> Vec<Vec<u32>> {
    let word = |sample, dimension| {
        sampler.sample_u32(Coordinate {
            pixel,
            sample,
            dimension,
            seed,
        })
    };
    let column = |dimension| (0..samples).map(|i| word(i, dimension)).collect();
    (0..sampler.demand.dimensions).map(column).collect()
}

/// D* if it is more than `bound`, which a grid of 64 × 64 cells tells of most sets: it misses less than two
/// cells.
fn star_beyond(xs: &[u32], ys: &[u32], bound: f64) -> Option<f64> {
    const CELLS: usize = 64;
    let n = xs.len() as f64;
    let mut counts = [[0_u32; CELLS]; CELLS];
    for (x, y) in xs.iter().zip(ys) {
        counts[(x >> 26) as usize][(y >> 26) as usize] += 1;
    }
    let mut below = [0_u32; CELLS];
    let mut worst = 0.0_f64;
    for (i, column) in counts.iter().enumerate() {
        let mut sum = 0;
        for (j, count) in column.iter().enumerate() {
            below[j] += count;
            sum += below[j];
            let area = ((i + 1) * (j + 1)) as f64 / (CELLS * CELLS) as f64;
            worst = worst.max((f64::from(sum) / n - area).abs());
        }
    }
    if worst + 2.0 / CELLS as f64 <= bound {
        return None;
    }
    let points: Vec<[f64; 2]> = xs
        .iter()
        .zip(ys)
        .map(|(x, y)| [unit(*x), unit(*y)])
        .collect();
    let star = star_2d(&points).expect("points in the square");
    (star > bound).then_some(star)
}

fn least_quadrant(xs: &[u32], ys: &[u32]) -> f64 {
    let mut counts = [0_u32; 4];
    for (x, y) in xs.iter().zip(ys) {
        counts[(x >> 31 << 1 | y >> 31) as usize] += 1;
    }
    f64::from(counts.into_iter().min().unwrap_or(0)) / xs.len() as f64
}

/// The worst D* beyond the bound and the emptiest quadrant below its bound, over all pairs.
fn faults_of_pairs(columns: &[Vec<u32>]) -> Vec<(f64, String)> {
    let mut faults = Vec::new();
    for (i, xs) in columns.iter().enumerate() {
        for (j, ys) in columns.iter().enumerate().skip(i + 1) {
            if let Some(star) = star_beyond(xs, ys, MOST_STAR) {
                faults.push((star, format!("D* of dimensions {i} and {j} is {star:.4}")));
            }
            let share = least_quadrant(xs, ys);
            if share < LEAST_QUADRANT {
                let text = format!("a quadrant of dimensions {i} and {j} holds {share:.3}");
                faults.push((1.0 - share, text));
            }
        }
    }
    faults.sort_by(|a, b| b.0.total_cmp(&a.0));
    faults
}

/// Pixels and seeds at which a sampler is looked at: one is enough where all draw the same.
fn places(sampler: &Sampler) -> &'static [[u32; 2]] {
    if sampler.is_random() {
        &PLACES
    } else {
        &PLACES[1..2]
    }
}

#[test]
fn no_pair_of_dimensions_is_locked_together_in_any_sampler() {
    let samplers = all_samplers(POINTS, DIMENSIONS);
    let mut wrong = Vec::new();
    let mut excused = Vec::new();
    for sampler in &samplers {
        let label = sampler.label();
        for &place in places(sampler) {
            let faults = faults_of_pairs(&columns(sampler, place, POINTS));
            let Some((worst, text)) = faults.first() else {
                continue;
            };
            let known = BY_NATURE.iter().position(|(l, ..)| label.starts_with(l));
            match known {
                Some(k) if *worst <= BY_NATURE[k].1 => excused.push(k),
                _ => wrong.push(format!(
                    "{label}, {place:?}: {text}; {} faults",
                    faults.len()
                )),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for (k, (label, ..)) in BY_NATURE.iter().enumerate() {
        assert!(
            excused.contains(&k),
            "{label} keeps the bounds: take it off the list"
        );
    }
}

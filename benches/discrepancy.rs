//! Speed of the exact star discrepancy and of the mean-square ones: `cargo bench -p raystone-benches --bench discrepancy`.
//!
//! Targets on one core: 2-D 10⁵ points 0.2 s, 10⁶ points 2.5 s; 3-D 4096 points 1.0 s; 4-D 1024 points
//! 1.5 s; 6-D 128 points 0.5 s.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use raystone::discrepancy::{Budget, PointSet, Quadratic, quadratic, star};
use std::hint::black_box;

fn radical_inverse(base: u64, mut i: u64) -> f64 {
    let (mut value, mut scale) = (0u64, 1u64);
    while i > 0 {
        value = value * base + i % base;
        scale *= base;
        i /= base;
    }
    value as f64 / scale as f64
}

fn halton(dim: usize, n: u64) -> PointSet {
    let bases = [2, 3, 5, 7, 11, 13];
    let point = |i| {
        bases[..dim]
            .iter()
            .map(move |&base| radical_inverse(base, i))
    };
    let coordinates = (0..n).flat_map(point).collect();
    PointSet::new(dim, coordinates).expect("Halton points lie in the unit cube")
}

fn exact_star(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("star");
    group.sample_size(10);
    for (dim, n) in [
        (2, 4096),
        (2, 100_000),
        (2, 1_000_000),
        (3, 4096),
        (4, 1024),
        (5, 256),
        (6, 128),
    ] {
        let points = halton(dim, n);
        group.bench_function(BenchmarkId::new(format!("{dim}d"), n), |bencher| {
            bencher.iter(|| {
                let found = star(black_box(&points), &Budget::seconds(600.0));
                assert!(found.value().is_some(), "out of time");
                found
            });
        });
    }
    group.finish();
}

fn mean_square(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("mean square");
    group.sample_size(10);
    for kind in [
        Quadratic::L2Star,
        Quadratic::Centered,
        Quadratic::WrapAround,
        Quadratic::Mixture,
        Quadratic::Average,
    ] {
        let points = halton(2, 4096);
        group.bench_function(format!("{kind:?} 2d 4096"), |bencher| {
            bencher.iter(|| quadratic(black_box(&points), kind, &Budget::seconds(600.0)));
        });
    }
    group.finish();
}

criterion_group!(benches, exact_star, mean_square);
criterion_main!(benches);

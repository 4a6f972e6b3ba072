//! Point sets, and reference measures straight from the definition.

use raystone::discrepancy::{Budget, PointSet};
use raystone::random::Pcg32;

pub fn ample() -> Budget {
    Budget::seconds(600.0)
}

pub fn pairs(points: &PointSet) -> Vec<[f64; 2]> {
    points.points().map(|p| [p[0], p[1]]).collect()
}

pub fn radical_inverse(base: u64, mut i: u64) -> f64 {
    let (mut value, mut scale) = (0u64, 1u64);
    while i > 0 {
        value = value * base + i % base;
        scale *= base;
        i /= base;
    }
    value as f64 / scale as f64
}

/// Halton points in up to 8 dimensions.
pub fn halton_in(dim: usize, first: u64, n: u64) -> PointSet {
    let bases = [2, 3, 5, 7, 11, 13, 17, 19];
    let point = |i| bases[..dim].iter().map(move |&b| radical_inverse(b, i));
    PointSet::new(dim, (first..first + n).flat_map(point).collect()).unwrap()
}

pub fn halton(first: u64, n: u64) -> Vec<[f64; 2]> {
    let point = |i| [radical_inverse(2, i), radical_inverse(3, i)];
    (first..first + n).map(point).collect()
}

pub fn hammersley(n: u64) -> Vec<[f64; 2]> {
    let point = |i| [i as f64 / n as f64, radical_inverse(2, i)];
    (0..n).map(point).collect()
}

/// Direction numbers of Joe & Kuo (2008) for dimensions 2 to 6: degree, polynomial, first numbers.
const JOE_KUO: [(usize, u32, &[u32]); 5] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
];

fn directions(dim: usize) -> [u32; 32] {
    let mut v = std::array::from_fn(|j| 1 << (31 - j));
    let Some(&(degree, polynomial, first)) = dim.checked_sub(1).map(|d| &JOE_KUO[d]) else {
        return v;
    };
    for j in 0..32 {
        v[j] = if j < degree {
            first[j] << (31 - j)
        } else {
            let terms = (1..degree).filter(|k| polynomial >> (degree - 1 - k) & 1 == 1);
            terms.fold(v[j - degree] ^ v[j - degree] >> degree, |acc, k| {
                acc ^ v[j - k]
            })
        };
    }
    v
}

/// Sobol' points in natural order, in up to 6 dimensions.
pub fn sobol_in(dim: usize, n: u32) -> PointSet {
    let directions: Vec<_> = (0..dim).map(directions).collect();
    let coordinate = |i: u32, v: &[u32; 32]| {
        let bits = (0..32).filter(|j| i >> j & 1 == 1);
        f64::from(bits.fold(0, |acc, j| acc ^ v[j])) / 2f64.powi(32)
    };
    let all = (0..n).flat_map(|i| directions.iter().map(move |v| coordinate(i, v)));
    PointSet::new(dim, all.collect()).unwrap()
}

pub fn sobol(n: u32) -> Vec<[f64; 2]> {
    pairs(&sobol_in(2, n))
}

/// Random points; few levels cause ties and coordinates 0 and 1, and some points are repeated.
pub fn random_in(dim: usize, n: usize, levels: usize, random: &mut Pcg32) -> PointSet {
    let mut all: Vec<f64> = Vec::new();
    for i in 0..n {
        if i > 0 && random.below(8) == 0 {
            let again = random.below(i) * dim;
            all.extend_from_within(again..again + dim);
        } else {
            all.extend((0..dim).map(|_| random.below(levels + 1) as f64 / levels as f64));
        }
    }
    PointSet::new(dim, all).unwrap()
}

/// Both counts at every corner of the grid of coordinates and 1, straight from the definition.
pub fn star_by_definition(points: &PointSet) -> f64 {
    let n = points.len() as f64;
    let axes: Vec<Vec<f64>> = (0..points.dim())
        .map(|d| {
            let mut axis: Vec<f64> = points.points().map(|p| p[d]).collect();
            axis.push(1.0);
            axis.sort_unstable_by(f64::total_cmp);
            axis.dedup();
            axis
        })
        .collect();
    let corners: usize = axes.iter().map(Vec::len).product();
    let mut worst = 0.0f64;
    for mut index in 0..corners {
        let corner: Vec<f64> = axes
            .iter()
            .map(|axis| {
                let c = axis[index % axis.len()];
                index /= axis.len();
                c
            })
            .collect();
        let volume: f64 = corner.iter().product();
        let all = |less: fn(&f64, &f64) -> bool| {
            let inside = |p: &&[f64]| p.iter().zip(&corner).all(|(a, b)| less(a, b));
            points.points().filter(inside).count() as f64 / n
        };
        worst = worst.max(volume - all(f64::lt)).max(all(f64::le) - volume);
    }
    worst
}

/// The extreme discrepancy of pairs, from the definition.
pub fn extreme_by_definition(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let axis = |d: usize| points.iter().map(move |p| p[d]).chain([0.0, 1.0]);
    let mut worst = 0.0f64;
    for (x0, x1) in axis(0).flat_map(|a| axis(0).map(move |b| (a, b))) {
        for (y0, y1) in axis(1).flat_map(|a| axis(1).map(move |b| (a, b))) {
            if x0 > x1 || y0 > y1 {
                continue;
            }
            let area = (x1 - x0) * (y1 - y0);
            let open = |p: &&[f64; 2]| x0 < p[0] && p[0] < x1 && y0 < p[1] && p[1] < y1;
            let closed = |p: &&[f64; 2]| x0 <= p[0] && p[0] <= x1 && y0 <= p[1] && p[1] <= y1;
            let few = area - points.iter().filter(open).count() as f64 / n;
            let many = points.iter().filter(closed).count() as f64 / n - area;
            worst = worst.max(few).max(many);
        }
    }
    worst
}

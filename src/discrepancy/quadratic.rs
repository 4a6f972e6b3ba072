//! Discrepancies in the mean square: double sums of a kernel.
//!
//! Each has the form (Hickernell 1998, "A generalized discrepancy and quadrature error bound", eq. 3.1)
//!
//! ```text
//! D² = m^d − 2/N Σ_i Π_k h(x_ik) + 1/N² Σ_i Σ_j Π_k K(x_ik, x_jk),   h = ∫ K dy,   m = ∫ h dx
//! ```
//!
//! Its terms are near 1 and cancel to about N⁻². So N² D² is summed, with integer weights; each
//! product carries its rounding error, and sums are compensated. With coordinates of at most 24
//! bits the factors themselves are exact.

use super::sum::{LANES, Sum};
use super::{Budget, DiscrepancyError, Measure, PointSet};

/// A discrepancy in the mean square.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quadratic {
    /// Boxes `[0, y)`: the star discrepancy's mean square (Warnock 1972).
    L2Star,
    /// Boxes from y to the nearest corner of the cube (Hickernell 1998, eq. 4.7).
    Centered,
    /// Boxes on the torus (Hickernell 1998, "Lattice rules: how well do they measure up?", eq. 4.17).
    WrapAround,
    /// Mixture (Zhou, Fang & Ning 2013, "Mixture discrepancy for quasi-random point sets").
    Mixture,
    /// Root of the mean square of L2-star over all 2^d reflections of the origin (Clément, Kirk, Owen
    /// & Rusch 2025, "On the optimization of discrepancy measures", arXiv 2508.04926).
    Average,
}

/// Squared discrepancy of a set of points, at least 0.
///
/// Cost: N² d / 2 kernels.
///
/// # Errors
/// The budget is spent first.
pub fn quadratic(
    points: &PointSet,
    kind: Quadratic,
    budget: &Budget,
) -> Result<f64, DiscrepancyError> {
    match kind {
        Quadratic::L2Star => square(points, &L2Star, budget),
        Quadratic::Centered => square(points, &Centered, budget),
        Quadratic::WrapAround => square(points, &WrapAround, budget),
        Quadratic::Mixture => square(points, &Mixture, budget),
        Quadratic::Average => square(points, &Average, budget),
    }
}

/// One factor of a kernel, scaled so that all its constants are short binary fractions: a rounded
/// 4/3 would be wrong in the same direction in every term. `z` is `|x - 1/2|`, passed so that it is
/// computed once.
trait Kernel {
    const KIND: Quadratic;
    const SCALE: f64;
    /// ∫∫ K
    const MEAN: f64;
    /// ∫ K dy
    fn mean(&self, x: f64, z: f64) -> f64;
    fn pair(&self, a: [f64; 2], b: [f64; 2]) -> f64;
}

struct L2Star;
struct Centered;
struct WrapAround;
struct Mixture;
struct Average;

impl Kernel for L2Star {
    const KIND: Quadratic = Quadratic::L2Star;
    const SCALE: f64 = 3.0;
    const MEAN: f64 = 1.0;
    fn mean(&self, x: f64, _: f64) -> f64 {
        1.5 * (1.0 - x * x)
    }
    #[inline]
    fn pair(&self, [x, _]: [f64; 2], [y, _]: [f64; 2]) -> f64 {
        3.0 - 3.0 * if x > y { x } else { y }
    }
}

impl Kernel for Centered {
    const KIND: Quadratic = Quadratic::Centered;
    const SCALE: f64 = 0.75;
    const MEAN: f64 = 13.0 / 16.0;
    fn mean(&self, _: f64, z: f64) -> f64 {
        0.75 + 0.375 * (z - z * z)
    }
    #[inline]
    fn pair(&self, [x, zx]: [f64; 2], [y, zy]: [f64; 2]) -> f64 {
        0.75 + 0.375 * ((zx + zy) - (x - y).abs())
    }
}

impl Kernel for WrapAround {
    const KIND: Quadratic = Quadratic::WrapAround;
    const SCALE: f64 = 0.75;
    const MEAN: f64 = 1.0;
    fn mean(&self, _: f64, _: f64) -> f64 {
        1.0
    }
    #[inline]
    fn pair(&self, [x, _]: [f64; 2], [y, _]: [f64; 2]) -> f64 {
        let distance = (x - y).abs();
        1.125 - 0.75 * (distance * (1.0 - distance))
    }
}

impl Kernel for Mixture {
    const KIND: Quadratic = Quadratic::Mixture;
    const SCALE: f64 = 0.75;
    const MEAN: f64 = 19.0 / 16.0;
    fn mean(&self, _: f64, z: f64) -> f64 {
        1.25 - 0.1875 * (z + z * z)
    }
    #[inline]
    fn pair(&self, [x, zx]: [f64; 2], [y, zy]: [f64; 2]) -> f64 {
        let distance = (x - y).abs();
        1.40625 - 0.1875 * (zx + zy) - distance * (0.5625 - 0.375 * distance)
    }
}

impl Kernel for Average {
    const KIND: Quadratic = Quadratic::Average;
    const SCALE: f64 = 3.0;
    const MEAN: f64 = 1.0;
    fn mean(&self, x: f64, _: f64) -> f64 {
        0.75 + 1.5 * x * (1.0 - x)
    }
    #[inline]
    fn pair(&self, [x, _]: [f64; 2], [y, _]: [f64; 2]) -> f64 {
        1.5 - 1.5 * (x - y).abs()
    }
}

fn square<K: Kernel>(
    points: &PointSet,
    kernel: &K,
    budget: &Budget,
) -> Result<f64, DiscrepancyError> {
    let name = Measure::Quadratic(K::KIND).name();
    let n = points.len() as f64;
    let columns: Vec<Column> = (0..points.dim()).map(|d| Column::new(points, d)).collect();
    let mut singles = Sum::new();
    let mut diagonal = Sum::new();
    let mut pairs = Sum::new();
    let add = |sum: &mut Sum, [product, error]: [f64; 2]| {
        sum.add_one(product);
        sum.add_one(error);
    };
    for i in 0..points.len() {
        if i % 64 == 0 {
            budget.check(name)?;
        }
        let at = |c: &Column| [c.x[i], c.z[i]];
        let means = columns.iter().map(at).map(|[x, z]| kernel.mean(x, z));
        add(&mut singles, accurate_product(means));
        let own = columns.iter().map(at).map(|c| kernel.pair(c, c));
        add(&mut diagonal, accurate_product(own));
        add_row(kernel, &columns, i, &mut pairs);
    }
    let mean = accurate_product(columns.iter().map(|_| K::MEAN));
    let mut all = Sum::new();
    for (parts, weight) in [
        (mean, n * n),
        (singles.parts(), -2.0 * n),
        (diagonal.parts(), 1.0),
        (pairs.parts(), 2.0),
    ] {
        for part in parts {
            add(&mut all, exact_product(part, weight));
        }
    }
    let square = all.value() / (n * n) / K::SCALE.powi(points.dim() as i32);
    if !square.is_finite() {
        return Err(DiscrepancyError::NotDefined {
            measure: name,
            reason: format!(
                "is beyond the range of numbers in {} dimensions",
                points.dim()
            ),
        });
    }
    // A set may be perfect up to rounding.
    Ok(square.max(0.0))
}

/// A product of factors and its rounding error. The errors of coordinates that are multiples of the
/// same power of two have a common sign, and would add up.
fn accurate_product(factors: impl Iterator<Item = f64>) -> [f64; 2] {
    factors.fold([1.0, 0.0], |[product, error], factor| {
        let [next, lost] = exact_product(product, factor);
        [next, error * factor + lost]
    })
}

/// A product and its rounding error (Dekker 1971, with Veltkamp's splitting). A fused multiply-add
/// gives the same, but is a slow function call on the baseline targets of most builds.
#[inline]
fn exact_product(a: f64, b: f64) -> [f64; 2] {
    let product = a * b;
    let ([a, a_low], [b, b_low]) = (halves(a), halves(b));
    let error = ((a * b - product) + a * b_low + a_low * b) + a_low * b_low;
    [product, error]
}

/// A number as the sum of two with half as many digits.
#[inline]
fn halves(x: f64) -> [f64; 2] {
    let scaled = 134_217_729.0 * x;
    let high = scaled - (scaled - x);
    [high, x - high]
}

/// One coordinate of all points, and its distance from 1/2.
struct Column {
    x: Vec<f64>,
    z: Vec<f64>,
}

impl Column {
    fn new(points: &PointSet, dim: usize) -> Self {
        let x = points.column(dim);
        let z = x.iter().map(|x| (x - 0.5).abs()).collect();
        Self { x, z }
    }
}

/// Adds the kernel of point `i` with every later point.
fn add_row<K: Kernel>(kernel: &K, columns: &[Column], i: usize, sum: &mut Sum) {
    let n = columns[0].x.len();
    let blocks = (n - i - 1) / LANES;
    for block in 0..blocks {
        let from = i + 1 + block * LANES;
        let (mut product, mut error) = ([1.0; LANES], [0.0; LANES]);
        for column in columns {
            let own = [column.x[i], column.z[i]];
            let (x, z) = (&column.x[from..from + LANES], &column.z[from..from + LANES]);
            for lane in 0..LANES {
                let factor = kernel.pair(own, [x[lane], z[lane]]);
                let [next, lost] = exact_product(product[lane], factor);
                error[lane] = error[lane] * factor + lost;
                product[lane] = next;
            }
        }
        sum.add(&product);
        sum.add(&error);
    }
    for j in i + 1 + blocks * LANES..n {
        let factor = |c: &Column| kernel.pair([c.x[i], c.z[i]], [c.x[j], c.z[j]]);
        let [product, error] = accurate_product(columns.iter().map(factor));
        sum.add_one(product);
        sum.add_one(error);
    }
}

//! Points by importance: three ways to warp the square so that their density follows a map of cells.

use raystone_core::parameters;

parameters! {
    /// How the square is warped by a map of importance.
    pub enum Warp {
        /// not at all
        None = "none",
        /// a row by the marginal, then a column by its own distribution (Pharr & Humphreys 2004)
        Inversion = "inversion",
        /// one table of cells with an alias each (Walker 1974); the second coordinate is kept
        Alias = "alias",
        /// halves of the square, again and again (Clarberg et al. 2005)
        Hierarchical = "hierarchical",
    }
}

/// A density that is constant on `side`² cells of the unit square, a power of two.
#[derive(Debug, Clone)]
pub struct ImportanceMap {
    side: usize,
    /// Shares of all, by rows.
    share: Vec<f64>,
    alias: Vec<(f64, usize)>,
}

impl ImportanceMap {
    /// A map with these values above 0, x fastest.
    ///
    /// # Errors
    /// There are no side² of them with a side that is a power of two, or one is not a number above 0.
    pub fn new(values: Vec<f64>) -> Result<Self, String> {
        let side = values.len().isqrt();
        if side * side != values.len() || !side.is_power_of_two() {
            return Err(format!(
                "{} values are no square map of a power of two",
                values.len()
            ));
        }
        if let Some(at) = values.iter().position(|v| !(v.is_finite() && *v > 0.0)) {
            return Err(format!(
                "cell {at} of the map has {}: it has to be above 0",
                values[at]
            ));
        }
        let sum: f64 = values.iter().sum();
        let share: Vec<f64> = values.iter().map(|v| v / sum).collect();
        let alias = alias_table(&share);
        Ok(Self { side, share, alias })
    }

    /// Density at a point, relative to that of the uniform square.
    pub fn density(&self, [x, y]: [f64; 2]) -> f64 {
        let cell = |c: f64| ((c * self.side as f64) as usize).min(self.side - 1);
        self.share[cell(x) + self.side * cell(y)] * self.share.len() as f64
    }

    /// The greatest density, relative to that of the uniform square.
    pub fn greatest(&self) -> f64 {
        self.share.iter().fold(0.0, |a: f64, b| a.max(*b)) * self.share.len() as f64
    }

    /// The point to which a way of warping takes a point.
    pub fn warped(&self, warp: Warp, at: [f64; 2]) -> [f64; 2] {
        match warp {
            Warp::None => at,
            Warp::Inversion => self.inverted(at),
            Warp::Alias => self.aliased(at),
            Warp::Hierarchical => self.halved(at),
        }
    }

    /// The point to which a way of warping takes a point, and how dense points are there that were even: as dense as before
    /// where they stay.
    pub fn sent(&self, warp: Warp, at: [f64; 2]) -> ([f64; 2], f64) {
        let to = self.warped(warp, at);
        match warp {
            Warp::None => (to, 1.0),
            _ => (to, self.density(to)),
        }
    }

    fn row(&self, y: usize) -> &[f64] {
        &self.share[y * self.side..(y + 1) * self.side]
    }

    fn inverted(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let rows = (0..self.side).map(|y| self.row(y).iter().sum());
        let (y, within_y) = found(rows, v);
        let row = self.row(y);
        let total: f64 = row.iter().sum();
        let (x, within_x) = found(row.iter().map(|share| share / total), u);
        [x as f64 + within_x, y as f64 + within_y].map(|c| c / self.side as f64)
    }

    fn aliased(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let scaled = u * self.share.len() as f64;
        let cell = (scaled as usize).min(self.share.len() - 1);
        let rest = scaled - cell as f64;
        let (keep, other) = self.alias[cell];
        let (cell, within) = if rest < keep {
            (cell, rest / keep)
        } else {
            (other, (rest - keep) / (1.0 - keep))
        };
        let (x, y) = (cell % self.side, cell / self.side);
        let inside = |within: f64| within.min(1.0 - f64::EPSILON);
        [x as f64 + inside(within), y as f64 + v].map(|c| c / self.side as f64)
    }

    fn halved(&self, [mut u, mut v]: [f64; 2]) -> [f64; 2] {
        let (mut x, mut y, mut size) = (0, 0, self.side);
        while size > 1 {
            let half = size / 2;
            let quarter = |dx: usize, dy: usize| self.sum_of(x + dx * half, y + dy * half, half);
            let (low, high) = (quarter(0, 0) + quarter(1, 0), quarter(0, 1) + quarter(1, 1));
            let (up, rest) = split(v, low / (low + high));
            v = rest;
            let (left, right) = (quarter(0, up), quarter(1, up));
            let (on, rest) = split(u, left / (left + right));
            u = rest;
            (x, y, size) = (x + on * half, y + up * half, half);
        }
        [x as f64 + u, y as f64 + v].map(|c| c / self.side as f64)
    }

    fn sum_of(&self, x: usize, y: usize, size: usize) -> f64 {
        (y..y + size)
            .map(|y| self.row(y)[x..x + size].iter().sum::<f64>())
            .sum()
    }
}

/// The half that a number falls into, the lower with this share, and its place within.
fn split(u: f64, share: f64) -> (usize, f64) {
    let below = |rest: f64| rest.clamp(0.0, 1.0 - f64::EPSILON);
    if u < share {
        (0, below(u / share))
    } else {
        (1, below((u - share) / (1.0 - share)))
    }
}

/// The entry that a number falls into, of shares that sum to 1, and its place within.
fn found(shares: impl Iterator<Item = f64>, u: f64) -> (usize, f64) {
    let (mut from, mut last) = (0.0, (0, 0.0));
    for (place, share) in shares.enumerate() {
        let within = ((u - from) / share).clamp(0.0, 1.0 - f64::EPSILON);
        last = (place, within);
        from += share;
        if u < from {
            break;
        }
    }
    last
}

/// For each entry the share of it that is kept, and the entry that takes the rest (Vose 1991).
fn alias_table(share: &[f64]) -> Vec<(f64, usize)> {
    let count = share.len();
    let mut left: Vec<f64> = share.iter().map(|s| s * count as f64).collect();
    let mut table: Vec<(f64, usize)> = (0..count).map(|i| (1.0, i)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..count).partition(|i| left[*i] < 1.0);
    while let (Some(less), Some(&more)) = (small.pop(), large.last()) {
        table[less] = (left[less], more);
        left[more] -= 1.0 - left[less];
        if left[more] < 1.0 {
            large.pop();
            small.push(more);
        }
    }
    table
}

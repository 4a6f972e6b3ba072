//! Generates progressive multi-jittered (0, 2) points.
//!
//! Source: P. Christensen, A. Kensler, C. Kilpatrick, "Progressive multi-jittered sample
//! sequences", EGSR 2018, for the order of the cells; M. Pharr, "Efficient generation of points
//! that satisfy two-dimensional elementary intervals", JCGT 8(1), 2019, for choosing the digits of
//! x and y separately.

use raystone_core::random::SplitMix64;

/// Elementary intervals of area 2^-m that contain a point: bit column · rows + row of shape k,
/// which has 2^k columns and 2^(m−k) rows.
struct Occupancy {
    m: u32,
    shapes: Vec<Vec<bool>>,
}

/// The first `bits` bits of a fraction of 2³².
fn leading(x: u32, bits: u32) -> u32 {
    if bits == 0 { 0 } else { x >> (32 - bits) }
}

impl Occupancy {
    fn new(m: u32, points: &[[u32; 2]]) -> Self {
        let shapes = vec![vec![false; 1 << m]; m as usize + 1];
        let mut out = Self { m, shapes };
        points.iter().for_each(|point| out.insert(*point));
        out
    }

    fn cell(&self, columns: u32, [x, y]: [u32; 2]) -> usize {
        let rows = self.m - columns;
        (leading(x, columns) << rows | leading(y, rows)) as usize
    }

    fn insert(&mut self, point: [u32; 2]) {
        for columns in 0..=self.m {
            let cell = self.cell(columns, point);
            self.shapes[columns as usize][cell] = true;
        }
    }

    fn is_free(&self, columns: u32, point: [u32; 2]) -> bool {
        !self.shapes[columns as usize][self.cell(columns, point)]
    }
}

/// A point in the cell of `corner`, given its first `x_bits` and `y_bits` digits (m together).
///
/// The interval of x's first k + 1 digits and y's first m − k − 1 depends on no later digit of
/// either, so the digits are chosen one after the other. Its two halves came from two intervals
/// with one point each, so one of them is always free.
fn place(occupied: &Occupancy, corner: [u32; 2], x_bits: u32, random: &mut SplitMix64) -> [u32; 2] {
    let m = occupied.m;
    let mut point = corner;
    for axis in [0, 1] {
        let first = if axis == 0 { x_bits } else { m - x_bits };
        let below = |bits: u32| u32::MAX.checked_shr(bits).unwrap_or(0);
        let mut digits = corner[axis] & !below(first);
        for bit in first..m {
            let columns = if axis == 0 { bit + 1 } else { m - bit - 1 };
            let set = 0x8000_0000 >> bit;
            let with = |digits| {
                let mut at = corner;
                at[axis] = digits;
                at
            };
            let free = [digits, digits | set].map(|d| occupied.is_free(columns, with(d)));
            let choose_set = match free {
                [true, true] => random.next_u32() >> 31 == 1,
                [zero, _] => !zero,
            };
            digits |= u32::from(choose_set) * set;
        }
        point[axis] = digits | random.next_u32() & below(m);
    }
    point
}

/// Nested uniform shuffle: randomly swaps the halves of every block, down to single points.
fn shuffle(block: &mut [[u32; 2]], random: &mut SplitMix64) {
    if block.len() < 2 {
        return;
    }
    let (first, second) = block.split_at_mut(block.len() / 2);
    if random.next_u32() >> 31 == 1 {
        first.swap_with_slice(second);
    }
    shuffle(first, random);
    shuffle(second, random);
}

/// The points of one pair of dimensions, to be combined with those of other pairs at the same
/// index.
///
/// In the generator's order the index modulo 4 determines the quadrant, since each added point is
/// opposite another: two sets in that order leave half of the quadrants of (x, x') empty. So the
/// order is shuffled within each block from 2^k to 2^(k+1), which preserves every prefix of 2^m
/// points. A set for fewer points is a prefix of one for more.
///
/// Source: the nested uniform shuffle of A. Helmer, P. Christensen, A. Kensler, "Stochastic
/// generation of (t, s) sample sequences", EGSR 2021. Shuffling all indices at once by hashing
/// needs sequences whose every aligned block is a net; here only prefixes are.
pub(super) fn shuffled_points(count: u32, seed: u32) -> Vec<[u32; 2]> {
    let mut points = pmj02_points(count, seed);
    let mut random = SplitMix64(u64::from(seed) << 32 | 1);
    let mut first = 1;
    while first < points.len() {
        shuffle(&mut points[first..2 * first], &mut random);
        first *= 2;
    }
    points
}

/// Adds a point in the quadrant `turned` away from that of point `i`, whose cell has `bits` digits.
fn add_beside(
    points: &mut Vec<[u32; 2]>,
    i: usize,
    turned: [u32; 2],
    bits: u32,
    occupied: &mut Occupancy,
    random: &mut SplitMix64,
) {
    let corner = [points[i][0] ^ turned[0], points[i][1] ^ turned[1]];
    let point = place(occupied, corner, bits, random);
    occupied.insert(point);
    points.push(point);
}

/// `count` points (a power of two), of which every prefix of 2^m is a (0, m, 2)-net in base 2.
fn pmj02_points(count: u32, seed: u32) -> Vec<[u32; 2]> {
    let mut random = SplitMix64(u64::from(seed) << 32);
    let mut points = vec![[random.next_u32(), random.next_u32()]];
    let mut k = 0;
    // From 4^k points to 4^(k+1): first into the opposite quadrant of each point's cell, then into
    // either of the two left, finally opposite those.
    while points.len() < count as usize {
        let half = 0x8000_0000 >> k;
        let before = points.len();
        let mut occupied = Occupancy::new(2 * k + 1, &points);
        for i in 0..before {
            add_beside(&mut points, i, [half; 2], k + 1, &mut occupied, &mut random);
        }
        if points.len() == count as usize {
            break;
        }
        let mut occupied = Occupancy::new(2 * k + 2, &points);
        for i in 0..before {
            let turned = match random.next_u32() >> 31 {
                1 => [half, 0],
                _ => [0, half],
            };
            add_beside(&mut points, i, turned, k + 1, &mut occupied, &mut random);
        }
        for i in 2 * before..3 * before {
            add_beside(&mut points, i, [half; 2], k + 1, &mut occupied, &mut random);
        }
        k += 1;
    }
    points
}

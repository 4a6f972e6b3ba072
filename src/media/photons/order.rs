//! Orders of the list.

use raystone_core::parameters;
use raystone_core::random::Pcg32;

parameters! {
    /// The order of a list of points.
    pub enum Order {
        /// as the set has them
        Natural = "natural",
        /// by rows of receiving cells
        Row = "row",
        /// by columns
        Column = "column",
        /// along Morton's curve
        Morton = "morton",
        /// along Hilbert's curve
        Hilbert = "hilbert",
        /// places with their bits reversed
        BitReversed = "bit-reversed",
        /// at random
        Shuffle = "shuffle",
    }
}

/// The points in an order, over `cells`² receiving cells; those of a cell stay as they were.
pub fn ordered(mut points: Vec<[f64; 2]>, order: Order, cells: u32, seed: u64) -> Vec<[f64; 2]> {
    let cell = |p: &[f64; 2]| p.map(|c| cell_of(c, cells));
    match order {
        Order::Natural => {}
        Order::Row => points.sort_by_key(|p| {
            let [x, y] = cell(p);
            (y, x)
        }),
        Order::Column => points.sort_by_key(cell),
        Order::Morton => points.sort_by_key(|p| {
            let [x, y] = cell(p);
            spread(x) | spread(y) << 1
        }),
        Order::Hilbert => {
            let side = cells.next_power_of_two();
            points.sort_by_key(|p| along_hilbert(side, cell(p)));
        }
        Order::BitReversed => {
            let bits = points.len().next_power_of_two().trailing_zeros();
            let place = |i: u32| (i.reverse_bits() >> (32 - bits)) as usize;
            let places = (0..1_u32 << bits).map(place);
            points = places
                .filter_map(|place| points.get(place).copied())
                .collect();
        }
        Order::Shuffle => {
            let mut random = Pcg32::new(seed);
            for last in (1..points.len()).rev() {
                points.swap(last, random.below(last + 1));
            }
        }
    }
    points
}

/// The cell of a coordinate in [0, 1).
pub(crate) fn cell_of(coordinate: f64, cells: u32) -> u32 {
    ((coordinate * f64::from(cells)) as u32).min(cells - 1)
}

/// A zero between any two of the lower 16 bits.
fn spread(x: u32) -> u32 {
    (0..16).map(|bit| (x >> bit & 1) << (2 * bit)).sum()
}

/// Place of a cell on Hilbert's curve over `side`² cells, a power of two.
fn along_hilbert(side: u32, [mut x, mut y]: [u32; 2]) -> u64 {
    let (mut place, mut half) = (0, side / 2);
    while half > 0 {
        let [right, up] = [x, y].map(|c| u32::from(c & half > 0));
        place += u64::from(half) * u64::from(half) * u64::from((3 * right) ^ up);
        if up == 0 {
            if right == 1 {
                (x, y) = (side - 1 - x, side - 1 - y);
            }
            (x, y) = (y, x);
        }
        half /= 2;
    }
    place
}

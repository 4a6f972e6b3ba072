//! Boxes with eight bits per plane on the plane grid of their node. CPU version of
//! `kernels/accel/wide.wesl`.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, "Efficient incoherent ray traversal on GPUs through
//! compressed wide BVHs", HPG 2017, sections 3.1 and 4.1.
//!
//! A plane lies at `low + q · 2^e` for an integer q in 0..256. `low` is a multiple of `2^e`, and
//! `e` is so large that all planes are multiples of `2^e` below `2^24 · 2^e`: they are floats,
//! their decoding is exact on any adapter, and a box of planes contains the original box by integer
//! arithmetic ([`Quantisation::new`]).
//!
//! **No hit is lost.** The proof in `docs/design.md` requires that the computed distances of a box
//! B enclose those of every coordinate in it: n(B) ≤ d(y) ≤ f(B) with `d(y) = (y − origin) ·
//! inverse` as computed. Decoding planes and calling `slab` would give that by monotonicity.
//! Kernels save the decoding: with `s = 2^e · inverse` (exact) and `b = (low − origin) · inverse`
//! they compute `q · s + (b ∓ slack)`. Let u = 2⁻²⁴ and M = |b| + 256 |s|, which bounds |q · s| +
//! |b|. The two roundings of b, those of the product, of slack and of the two sums move the result
//! by less than 5uM, and those of d(y) by less than 2u(1 + u) times a distance that grows with y:
//! at the plane of B, it is below 3uM. With `slack ≥ 16uM(1 − 4u)` ([`FRAME_PAD`] = 16u) a factor
//! of two remains. Both sides use the same reciprocal, so its own error does not matter.

use super::WideChild;
use crate::bounds::Bounds;
use crate::intersection::Reciprocal;

/// Relative slack of the distances to quantised planes, 2⁻²⁰.
pub(super) const FRAME_PAD: f32 = 9.536_743e-7;
pub(super) const PLANES: f32 = 256.0;

/// Quanta are at least 2⁻⁶⁰: their distances stay far from denormals.
const LEAST_EXPONENT: i32 = -60;
const BIAS: i32 = 127;
const MANTISSA: i32 = 24;

/// The planes of a node: position of the first one, and their spacing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Quantisation {
    /// First plane on each axis.
    pub low: [f32; 3],
    /// Biased exponents of the plane spacing.
    pub exponents: [u8; 3],
}

impl Quantisation {
    /// The quantisation of a node with these children, and the planes of each slot at the minimum
    /// and the maximum of each axis; zeros without children.
    pub(crate) fn of_children<const WIDTH: usize>(
        children: &[WideChild],
    ) -> (Self, [[[u8; WIDTH]; 3]; 2]) {
        let present = || children.iter().enumerate().filter(|(_, c)| !c.is_nothing());
        let around = present().fold(Bounds::EMPTY, |b, (_, child)| b.union(&child.bounds));
        let mut planes = [[[0; WIDTH]; 3]; 2];
        if present().next().is_none() {
            let nothing = Self {
                low: [0.0; 3],
                exponents: [0; 3],
            };
            return (nothing, planes);
        }
        let quantisation = Self::new(&around);
        for (slot, child) in present() {
            let Planes { low, high } = quantisation.around(&child.bounds);
            for axis in 0..3 {
                planes[0][axis][slot] = low[axis];
                planes[1][axis][slot] = high[axis];
            }
        }
        (quantisation, planes)
    }

    /// The box of a slot of a node with this first plane and these exponents.
    pub(crate) fn slot_bounds<const WIDTH: usize>(
        low: [f32; 3],
        exponents: u32,
        [lows, highs]: [&[[u8; WIDTH]; 3]; 2],
        slot: usize,
    ) -> Bounds {
        let [x, y, z, _] = exponents.to_le_bytes();
        let exponents = [x, y, z];
        Self { low, exponents }.bounds(&Planes {
            low: lows.map(|q| q[slot]),
            high: highs.map(|q| q[slot]),
        })
    }
}

/// Quantises a known box: 255 planes, one, two and half a unit apart, of which others are named by their numbers.
///
/// # Errors
/// Planes lie elsewhere: both numbers.
pub(crate) fn check() -> Result<(), String> {
    let whole = Bounds {
        min: [0.0; 3],
        max: [255.0, 510.0, 127.5],
    };
    let part = Bounds {
        min: [10.0, 10.0, 10.0],
        max: [19.5, 21.0, 20.0],
    };
    // The same, a thousandth as large, and far from the origin: 2¹² is 2²² planes away.
    let far = |bounds: &Bounds| Bounds {
        min: bounds.min.map(|x| 4096.0 + x / 1024.0),
        max: bounds.max.map(|x| 4096.0 + x / 1024.0),
    };
    let planes = |whole, part| Quantisation::new(whole).around(part);
    let found = [planes(&whole, &part), planes(&far(&whole), &far(&part))];
    let expected = [
        Planes {
            low: [10, 5, 20],
            high: [20, 11, 40],
        },
        Planes {
            low: [10, 5, 10],
            high: [20, 11, 20],
        },
    ];
    (found == expected).then_some(()).ok_or_else(|| {
        format!(
            "a known box has the planes {found:?}, and should have {expected:?}: boxes of wide nodes are larger than they need \
             to be; build this program anew, and report what stays wrong"
        )
    })
}

/// A box by plane numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Planes {
    pub low: [u8; 3],
    pub high: [u8; 3],
}

impl Quantisation {
    /// The finest quantisation that covers `bounds`.
    pub(crate) fn new(bounds: &Bounds) -> Self {
        let mut grid = Self {
            low: [0.0; 3],
            exponents: [0; 3],
        };
        for axis in 0..3 {
            let (low, high) = (bounds.min[axis], bounds.max[axis]);
            let largest = low.abs().max(high.abs());
            let extent = f64::from(high) - f64::from(low);
            let by_extent = (extent / 255.0).log2().floor().max(-200.0) as i32;
            let by_size = exponent(largest) + 2 - MANTISSA;
            let mut e = by_extent.max(by_size).max(LEAST_EXPONENT);
            // Exact: scaling by powers of two, and integers below 2^24.
            let plane = |x: f32, e: i32| f64::from(x) * 2.0_f64.powi(-e);
            while plane(high, e).ceil() - plane(low, e).floor() > 255.0 {
                e += 1;
            }
            grid.low[axis] = (plane(low, e).floor() * 2.0_f64.powi(e)) as f32;
            grid.exponents[axis] = (e + BIAS) as u8;
        }
        grid
    }

    /// The smallest box of planes around `bounds`, which must lie between them.
    pub(crate) fn around(&self, bounds: &Bounds) -> Planes {
        let mut planes = Planes::default();
        for axis in 0..3 {
            let scale = 2.0_f64.powi(BIAS - i32::from(self.exponents[axis]));
            let plane = |x: f32| f64::from(x) * scale;
            let first = plane(self.low[axis]);
            planes.low[axis] = (plane(bounds.min[axis]).floor() - first) as u8;
            planes.high[axis] = (plane(bounds.max[axis]).ceil() - first) as u8;
        }
        planes
    }

    /// The box between planes, in the arithmetic of kernels.
    pub(crate) fn bounds(&self, planes: &Planes) -> Bounds {
        let at = |axis: usize, number: u8| {
            self.low[axis]
                + f32::from(number) * f32::from_bits(u32::from(self.exponents[axis]) << 23)
        };
        Bounds {
            min: std::array::from_fn(|axis| at(axis, planes.low[axis])),
            max: std::array::from_fn(|axis| at(axis, planes.high[axis])),
        }
    }

    /// The exponents in kernel layout, a byte each; the highest byte is `top`.
    pub(crate) fn exponent_word(&self, top: u8) -> u32 {
        let [x, y, z] = self.exponents;
        u32::from_le_bytes([x, y, z, top])
    }
}

/// Exponent of the leading bit; for denormals that of the smallest normal number.
fn exponent(x: f32) -> i32 {
    ((x.to_bits() >> 23 & 255) as i32 - BIAS).max(1 - BIAS)
}

/// Distances along a ray to a node's planes: `q · scale + near` on entry, `+ far` on exit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaneDistances {
    scale: [f32; 3],
    near: [f32; 3],
    far: [f32; 3],
    pad: f32,
}

/// The frame of a node with first plane `low` and biased exponents in the bytes of `exponents`.
pub(crate) fn frame(
    low: [f32; 3],
    exponents: u32,
    origin: [f32; 3],
    inverse: Reciprocal,
) -> PlaneDistances {
    let biased = exponents.to_le_bytes();
    let mut frame = PlaneDistances {
        scale: [0.0; 3],
        near: [0.0; 3],
        far: [0.0; 3],
        pad: inverse.pad,
    };
    for axis in 0..3 {
        let scale = f32::from_bits(u32::from(biased[axis]) << 23) * inverse[axis];
        let base = (low[axis] - origin[axis]) * inverse[axis];
        let slack = (base.abs() + scale.abs() * PLANES) * FRAME_PAD;
        frame.scale[axis] = scale;
        frame.near[axis] = base - slack;
        frame.far[axis] = base + slack;
    }
    frame
}

fn bytes(word: u32) -> [f32; 4] {
    word.to_le_bytes().map(f32::from)
}

/// Distances of a plane of four boxes.
fn planes(word: u32, scale: f32, base: f32) -> [f32; 4] {
    bytes(word).map(|q| q * scale + base)
}

/// The later of two distances by integer comparison; of two negative ones possibly the earlier.
fn later(a: f32, b: f32) -> f32 {
    f32::from_bits((a.to_bits() as i32).max(b.to_bits() as i32) as u32)
}

/// The earlier of two distances; of two negative ones possibly the later.
fn earlier(a: f32, b: f32) -> f32 {
    f32::from_bits((a.to_bits() as i32).min(b.to_bits() as i32) as u32)
}

/// Entry distances of four boxes with these near planes on the three axes.
pub(crate) fn enter_four(near: [u32; 3], frame: &PlaneDistances, t_min: f32) -> [f32; 4] {
    let distances: [_; 3] =
        std::array::from_fn(|axis| planes(near[axis], frame.scale[axis], frame.near[axis]));
    std::array::from_fn(|i| {
        let [x, y, z] = distances.map(|d| d[i]);
        later(later(later(x, y), z), t_min.abs())
    })
}

/// Exit distances, padded: a box is entered if it is not exited before it is entered.
pub(crate) fn leave_four(far: [u32; 3], frame: &PlaneDistances, t_best: f32) -> [f32; 4] {
    let distances: [_; 3] =
        std::array::from_fn(|axis| planes(far[axis], frame.scale[axis], frame.far[axis]));
    std::array::from_fn(|i| {
        let [x, y, z] = distances.map(|d| d[i]);
        earlier(earlier(earlier(x, y), z), t_best) * frame.pad
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Intersection;
    use crate::bounds::slab;
    use crate::ray::Ray;
    use raystone_core::random::Pcg32;

    /// Numbers of all sizes and both signs, including zero and neighbours of powers of two.
    fn number(random: &mut Pcg32) -> f32 {
        let magnitude = 10.0_f64.powf(20.0 * random.uniform() - 10.0) as f32;
        let signed = if random.below(2) == 0 {
            magnitude
        } else {
            -magnitude
        };
        match random.below(8) {
            0 => 0.0,
            1 => f32::from_bits(signed.to_bits() & 0xff80_0000),
            2 => f32::from_bits((signed.to_bits() & 0xff80_0000) - 1),
            _ => signed,
        }
    }

    fn random_box(random: &mut Pcg32) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for axis in 0..3 {
            let a = number(random);
            let b = match random.below(4) {
                0 => a,
                1 => a.next_up(),
                2 => a + number(random),
                _ => number(random),
            };
            (bounds.min[axis], bounds.max[axis]) = (a.min(b), a.max(b));
        }
        bounds
    }

    /// A box inside `around`.
    fn part(around: &Bounds, random: &mut Pcg32) -> Bounds {
        let mut bounds = *around;
        for axis in 0..3 {
            let mut at = || {
                let (low, high) = (around.min[axis], around.max[axis]);
                let x = f64::from(low) + (f64::from(high) - f64::from(low)) * random.uniform();
                (x as f32).clamp(low, high)
            };
            let (a, b) = (at(), at());
            (bounds.min[axis], bounds.max[axis]) = (a.min(b), a.max(b));
        }
        bounds
    }

    #[test]
    fn decoded_boxes_contain_what_they_were_made_for_and_decoding_is_exact() {
        let mut random = Pcg32::new(1);
        for _ in 0..20_000 {
            let whole = random_box(&mut random);
            let grid = Quantisation::new(&whole);
            for inner in [whole, part(&whole, &mut random)] {
                let planes = grid.around(&inner);
                let decoded = grid.bounds(&planes);
                assert!(
                    decoded.contains(&inner),
                    "{inner:?} in {grid:?}: {decoded:?}"
                );
                for axis in 0..3 {
                    let quantum = 2.0_f64.powi(i32::from(grid.exponents[axis]) - BIAS);
                    let exact = f64::from(grid.low[axis]) + f64::from(planes.high[axis]) * quantum;
                    assert_eq!(f64::from(decoded.max[axis]), exact);
                    // No looser than a quantum; the difference from a denormal would be rounded.
                    assert!(
                        exact - quantum < f64::from(inner.max[axis]),
                        "{inner:?}: {grid:?}"
                    );
                }
            }
        }
    }

    /// Number of quantised boxes that are entered later or exited earlier than a box inside them.
    fn narrower(pad: f32) -> usize {
        let mut random = Pcg32::new(2);
        let mut wrong = 0;
        for _ in 0..20_000 {
            let whole = random_box(&mut random);
            let inner = part(&whole, &mut random);
            let grid = Quantisation::new(&whole);
            let planes = grid.around(&inner);
            let mut vector = || std::array::from_fn(|_| number(&mut random));
            let tests = Intersection::default();
            let ray = tests.raised(&Ray::new(vector(), vector()));
            let inverse = tests.inverse(ray.direction);
            let mut frame = frame(grid.low, grid.exponent_word(0), ray.origin, inverse);
            for (axis, inverse) in inverse.iter().enumerate() {
                let base = (grid.low[axis] - ray.origin[axis]) * inverse;
                let slack = (base.abs() + frame.scale[axis].abs() * PLANES) * pad;
                (frame.near[axis], frame.far[axis]) = (base - slack, base + slack);
            }
            let word = |far: bool| -> [u32; 3] {
                std::array::from_fn(|axis| {
                    let high = (inverse[axis] < 0.0) != far;
                    u32::from(if high { planes.high } else { planes.low }[axis])
                })
            };
            let (enter, leave) = slab(&inner, &ray, *inverse);
            let quantised_enter = enter_four(word(false), &frame, 0.0)[0];
            let quantised_leave = leave_four(word(true), &frame, 1e30)[0];
            // Boxes behind the origin are exited before 0, whatever the exact distance.
            if quantised_enter > enter.max(0.0)
                || (leave >= 0.0 && quantised_leave < leave.min(1e30) * inverse.pad)
            {
                wrong += 1;
            }
        }
        wrong
    }

    #[test]
    fn distances_to_planes_enclose_those_of_what_lies_between() {
        assert_eq!(narrower(FRAME_PAD), 0);
        assert!(
            narrower(0.0) > 10,
            "without slack nothing goes wrong: the test is blunt"
        );
    }
}

//! Boxes with corners stored as integers in the order of the floats: minimum and maximum are exact
//! and independent of order, including signs of zero and denormals. CPU version of
//! `kernels/accel/tree/parallel/boxes.wesl`.

use crate::bounds::Bounds;
use crate::triangle::TriangleRecord;

/// An axis-aligned box; see `ordered`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OrderedBox {
    /// Minimum corner.
    pub low: [u32; 3],
    /// Maximum corner.
    pub high: [u32; 3],
}

const SIGN: u32 = 0x8000_0000;

impl OrderedBox {
    /// Identity of [`join`].
    pub(crate) const NOTHING: Self = Self {
        low: [u32::MAX; 3],
        high: [0; 3],
    };
}

impl From<&TriangleRecord> for OrderedBox {
    fn from(record: &TriangleRecord) -> Self {
        let corner = |vertex: [f32; 3]| {
            let key = vertex.map(|x| ordered(x.to_bits()));
            Self {
                low: key,
                high: key,
            }
        };
        let [a, b, c] = record.vertices().map(corner);
        join(join(a, b), c)
    }
}

impl From<OrderedBox> for Bounds {
    fn from(ordered: OrderedBox) -> Self {
        Self {
            min: ordered.low.map(number),
            max: ordered.high.map(number),
        }
    }
}

/// The bits of a float as an integer with the same order.
pub(crate) fn ordered(bits: u32) -> u32 {
    if bits >= SIGN { !bits } else { bits ^ SIGN }
}

/// The float of such an integer.
pub fn number(key: u32) -> f32 {
    f32::from_bits(if key >= SIGN { key ^ SIGN } else { !key })
}

pub(crate) fn join(a: OrderedBox, b: OrderedBox) -> OrderedBox {
    OrderedBox {
        low: std::array::from_fn(|axis| a.low[axis].min(b.low[axis])),
        high: std::array::from_fn(|axis| a.high[axis].max(b.high[axis])),
    }
}

pub(crate) fn doubled_centre(around: OrderedBox) -> [f32; 3] {
    std::array::from_fn(|axis| number(around.low[axis]) + number(around.high[axis]))
}

/// Half the surface area. No common factor in the products: kernel compilers would merge them.
pub(crate) fn half_area(low: [f32; 3], high: [f32; 3]) -> f32 {
    let [x, y, z] = std::array::from_fn(|axis| high[axis] - low[axis]);
    x * (y + z) + y * z
}

//! Leaves: runs of triangles, either as copies of their records in leaf order (one memory access
//! range per leaf) or as indices into the canonical buffer (less memory). CPU version of
//! `kernels/accel/leaf.wesl`.

use super::bounds::Bounds;
use super::tree::Coverage;
use super::triangle::TriangleRecord;
use super::twin::Walk;
use super::watch;
use super::{AccelError, FEWER, NamedWords, TriangleSoup};

/// Marks a leaf reference; bits 26–30 hold its count, bits 0–25 its first index.
pub(crate) const LEAF: u32 = 0x8000_0000;
/// Bit position of the count in a leaf reference.
pub(crate) const COUNT_SHIFT: u32 = 26;
/// Maximum triangles in a leaf.
pub(crate) const COUNT_MASK: u32 = 31;
/// Largest first index.
pub(crate) const FIRST_MASK: u32 = 0x03ff_ffff;

pub(crate) fn leaf_reference(first: u32, count: u32) -> u32 {
    LEAF | count << COUNT_SHIFT | first
}

/// First index and number of triangles of a leaf.
pub(crate) fn leaf_range(reference: u32) -> (usize, usize) {
    (
        (reference & FIRST_MASK) as usize,
        (reference >> COUNT_SHIFT & COUNT_MASK) as usize,
    )
}

/// The triangles of all leaves, leaf by leaf.
#[derive(Debug, Clone)]
pub(crate) enum Leaves {
    Gathered(Vec<TriangleRecord>),
    Indexed(Vec<u32>),
}

impl Leaves {
    /// Lays out the triangles listed in `order`.
    ///
    /// # Errors
    /// More entries than a reference can address, with both numbers.
    pub(crate) fn new(
        soup: &TriangleSoup,
        order: &[u32],
        indexed: bool,
    ) -> Result<Self, AccelError> {
        AccelError::check_limit(
            "triangles in the leaves",
            order.len() as u64,
            FIRST_MASK,
            FEWER,
        )?;
        let record = |&id: &u32| soup.records[id as usize];
        Ok(if indexed {
            Self::Indexed(order.to_vec())
        } else {
            Self::Gathered(order.iter().map(record).collect())
        })
    }

    /// Features of kernels that read these leaves.
    pub(crate) fn features(&self) -> &'static [&'static str] {
        match self {
            Self::Gathered(_) => &[],
            Self::Indexed(_) => &["indexed_triangles"],
        }
    }

    pub(crate) fn words(&self) -> NamedWords<'_> {
        match self {
            Self::Gathered(records) => NamedWords::new("leaf_triangles", records),
            Self::Indexed(indices) => NamedWords::new("leaf_indices", indices),
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Gathered(records) => size_of_val(&records[..]),
            Self::Indexed(indices) => size_of_val(&indices[..]),
        }
    }

    /// Records the triangles of the leaf `reference`, which must lie in `bounds`.
    ///
    /// # Errors
    /// The leaf is outside the array, or the error of [`Coverage::leaf`].
    pub(crate) fn cover(
        &self,
        coverage: &mut Coverage,
        soup: &TriangleSoup,
        reference: u32,
        bounds: &Bounds,
    ) -> Result<(), AccelError> {
        let (first, count) = leaf_range(reference);
        match self {
            Self::Gathered(records) => coverage.leaf(records.get(first..first + count), bounds),
            Self::Indexed(indices) => {
                let record = |&id: &u32| soup.records.get(id as usize).copied();
                let records: Option<Vec<TriangleRecord>> = indices
                    .get(first..first + count)
                    .and_then(|ids| ids.iter().map(record).collect());
                coverage.leaf(records.as_deref(), bounds)
            }
        }
    }
}

/// The leaves of a structure with the triangles they were built from.
#[derive(Clone, Copy)]
pub(crate) struct LeafReader<'a> {
    pub leaves: &'a Leaves,
    pub soup: &'a TriangleSoup,
}

impl LeafReader<'_> {
    pub(crate) fn load_leaf_triangle(&self, place: usize) -> &TriangleRecord {
        match self.leaves {
            Leaves::Gathered(records) => &records[place],
            Leaves::Indexed(indices) => &self.soup.records[*watch::read(&indices[place]) as usize],
        }
    }

    pub(crate) fn test_leaf(self, reference: u32, walk: &mut Walk) {
        let (first, count) = leaf_range(reference);
        for place in first..first + count {
            walk.test(self.load_leaf_triangle(place));
        }
    }
}

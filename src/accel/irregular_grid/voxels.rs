//! Voxels and cells while an irregular grid is built.

/// Marks an entry as a block index.
const BLOCK: u32 = 1 << 31;

/// A box of voxels with a list of triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct GridCell {
    pub min: [u16; 3],
    /// One past the highest voxel.
    pub max: [u16; 3],
    /// Index of its list in the pool.
    pub first: u32,
    pub count: u32,
}

impl GridCell {
    /// The cell's list, triangles ascending.
    pub(super) fn list<'a>(&self, pool: &'a [u32]) -> &'a [u32] {
        &pool[self.first as usize..(self.first + self.count) as usize]
    }
}

/// A cube of entries, 2^`log` along each axis, x fastest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Block {
    pub first: u32,
    /// log2 of the entries along an axis.
    pub log: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Entry {
    GridCell(u32),
    Block(u32),
}

/// The cell of each voxel: one entry per top cell, each a cell or a block of entries.
#[derive(Debug, Clone, Default)]
pub(super) struct Map {
    /// Top cells along each axis.
    pub top: [u32; 3],
    /// A top cell has 2^`shift` voxels along each axis.
    pub shift: u32,
    /// Entries of the top cells, then of the blocks.
    pub entries: Vec<u32>,
    pub blocks: Vec<Block>,
}

impl Map {
    pub(super) fn encode(entry: Entry) -> u32 {
        match entry {
            Entry::GridCell(cell) => cell,
            Entry::Block(block) => block | BLOCK,
        }
    }

    pub(super) fn decode(word: u32) -> Entry {
        if word & BLOCK == 0 {
            Entry::GridCell(word)
        } else {
            Entry::Block(word & !BLOCK)
        }
    }

    pub(super) fn top_cells(&self) -> usize {
        self.top.iter().map(|&n| n as usize).product()
    }

    pub(super) fn cell_at(&self, voxel: [u32; 3]) -> u32 {
        let mut shift = self.shift;
        let [x, y, z] = voxel.map(|v| v >> shift);
        let mut word = self.entries[((z * self.top[1] + y) * self.top[0] + x) as usize];
        while let Entry::Block(number) = Self::decode(word) {
            let Block { first, log } = self.blocks[number as usize];
            shift -= log;
            let [x, y, z] = voxel.map(|v| (v >> shift) & ((1 << log) - 1));
            word = self.entries[(first + (((z << log) + y) << log) + x) as usize];
        }
        word
    }
}

/// True if every entry of `part` is in `whole`; both ascend.
pub(super) fn is_subset(part: &[u32], whole: &[u32]) -> bool {
    if part.len() > whole.len() {
        return false;
    }
    let mut rest = whole.iter();
    part.iter()
        .all(|id| rest.by_ref().find(|other| *other >= id) == Some(id))
}

pub(super) fn union_length(a: &[u32], b: &[u32]) -> usize {
    let (mut i, mut k, mut common) = (0, 0, 0);
    while i < a.len() && k < b.len() {
        let (p, q) = (a[i], b[k]);
        common += usize::from(p == q);
        i += usize::from(p <= q);
        k += usize::from(q <= p);
    }
    a.len() + b.len() - common
}

/// Appends the union of two ascending lists.
pub(super) fn push_union(a: &[u32], b: &[u32], out: &mut Vec<u32>) {
    let (mut i, mut k) = (0, 0);
    while i < a.len() && k < b.len() {
        let (p, q) = (a[i], b[k]);
        out.push(p.min(q));
        i += usize::from(p <= q);
        k += usize::from(q <= p);
    }
    out.extend_from_slice(&a[i..]);
    out.extend_from_slice(&b[k..]);
}

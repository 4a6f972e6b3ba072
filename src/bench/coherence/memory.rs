//! Maps reads of a host twin, whose arrays have the device's layout, to device memory.

use raystone_accel::watch::Read;
use raystone_accel::{BuiltAccel, TriangleSoup};

/// Alignment of arrays in bytes.
const ALIGNMENT: u64 = 256;

/// A contiguous device read by one lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Fetch {
    /// First address, with all arrays laid out consecutively.
    pub first: u64,
    /// Number of bytes, at least one.
    pub bytes: u32,
}

impl Fetch {
    /// Indices of the cache lines touched.
    pub fn lines(self, line_bytes: u64) -> impl Iterator<Item = u64> {
        let last = self.first + u64::from(self.bytes.max(1)) - 1;
        self.first / line_bytes..=last / line_bytes
    }
}

/// An array, or part of one, on host and device.
#[derive(Debug, Clone, Copy)]
struct Part {
    array: usize,
    host: usize,
    bytes: usize,
    /// Device address of its first byte.
    device: u64,
}

/// The arrays that traversals of a structure read, in one address space.
#[derive(Debug, Clone)]
pub struct Memory {
    arrays: Vec<(&'static str, u64)>,
    parts: Vec<Part>,
}

impl Memory {
    /// The arrays of a structure and of its triangles.
    ///
    /// # Errors
    /// The triangle test reads words that are not on the host.
    pub fn new(built: &dyn BuiltAccel, soup: &TriangleSoup) -> Result<Self, String> {
        let test = soup.intersection.triangle;
        let (own, record) = (
            test.bytes(),
            size_of_val(&soup.records[..]) / soup.records.len().max(1),
        );
        if !soup.records.is_empty() && own as usize != record {
            return Err(format!(
                "the triangle test `{}` reads {own} bytes a triangle, of which twins keep {record}",
                test.name()
            ));
        }
        let triangles: &[u32] = bytemuck::cast_slice(&soup.records);
        let mut arrays = built.twin_arrays();
        arrays.push(("triangles", vec![triangles]));
        Ok(Self::of(&arrays))
    }

    /// Builds the address space of these arrays, part by part.
    pub fn of(arrays: &[(&'static str, Vec<&[u32]>)]) -> Self {
        let mut memory = Self {
            arrays: Vec::new(),
            parts: Vec::new(),
        };
        let mut next = 0_u64;
        for (index, (name, parts)) in arrays.iter().enumerate() {
            memory.arrays.push((name, next));
            for words in parts {
                let bytes = size_of_val(*words);
                memory.parts.push(Part {
                    array: index,
                    host: words.as_ptr() as usize,
                    bytes,
                    device: next,
                });
                next += bytes as u64;
            }
            next = next.next_multiple_of(ALIGNMENT);
        }
        memory
    }

    /// The device fetch that corresponds to a read of the twin.
    ///
    /// # Errors
    /// It reads memory outside the device's arrays.
    pub(crate) fn fetch(&self, read: Read) -> Result<Fetch, String> {
        let inside = |part: &&Part| {
            let end = part.host + part.bytes;
            part.host <= read.address && read.address + read.bytes as usize <= end
        };
        let part = self.parts.iter().find(inside);
        let part = part.ok_or("its twin reads what is in none of the arrays of the device")?;
        Ok(Fetch {
            first: part.device + (read.address - part.host) as u64,
            bytes: read.bytes,
        })
    }

    /// Name of the array in which a fetch begins, and the offset in bytes.
    pub fn place(&self, fetch: Fetch) -> (&'static str, u64) {
        let before = self.parts.iter().filter(|part| part.device <= fetch.first);
        let array = before.map(|part| part.array).max().unwrap_or(0);
        let (name, first) = self.arrays.get(array).copied().unwrap_or_default();
        (name, fetch.first - first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(words: &[u32]) -> Read {
        Read::of(words)
    }

    #[test]
    fn an_address_tells_array_and_byte_across_the_parts_of_an_array() {
        let (nodes, top, leaves) = ([0_u32; 40], [0_u32; 8], [0_u32; 12]);
        let memory = Memory::of(&[("nodes", vec![&nodes, &top]), ("leaves", vec![&leaves])]);
        let at = |words: &[u32]| memory.fetch(read(words)).map(|f| (f.first, f.bytes));
        assert_eq!(at(&nodes[4..8]), Ok((16, 16)));
        assert_eq!(at(&top[1..2]), Ok((164, 4)));
        // The next array begins at the next multiple of 256.
        assert_eq!(at(&leaves[3..6]), Ok((268, 12)));
        let place = |words: &[u32]| memory.place(memory.fetch(read(words)).unwrap());
        assert_eq!(place(&top[1..2]), ("nodes", 164));
        assert_eq!(place(&leaves[3..6]), ("leaves", 12));
        let elsewhere = [0_u32; 2];
        assert!(memory.fetch(read(&elsewhere)).is_err());
    }

    #[test]
    fn a_fetch_touches_every_line_that_it_has_a_byte_in() {
        let lines = |first, bytes| Fetch { first, bytes }.lines(128).collect::<Vec<_>>();
        assert_eq!(lines(0, 128), [0]);
        assert_eq!(lines(127, 1), [0]);
        assert_eq!(lines(120, 9), [0, 1]);
        assert_eq!(lines(256, 257), [2, 3, 4]);
    }
}

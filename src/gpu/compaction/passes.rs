//! What a compaction reads and writes, and the passes that it is made of.

use crate::{
    Bindings, Composition, Gpu, GpuError, Groups, Pairs, RadixSort, Recording, Storage,
    UniformValues, WORKGROUP_SIZE, grid_of,
};

/// What of a stream stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stays {
    /// Every bucket.
    All,
    /// This one alone; its elements are in the first then.
    Bucket(u32),
    /// So many buckets, each in a part of its own of [`Stream::kept`], with room for [`Stream::capacity`] elements; the words of
    /// [`Stream::count`] tell how many are in each. For methods that [keep them apart](super::Compaction::keeps_apart).
    Apart(u32),
}

/// A stream on the device, and where it is compacted to.
#[derive(Debug, Clone)]
pub struct Stream {
    /// Elements that the buffers have room for.
    pub capacity: u32,
    /// Bytes of an element, a multiple of 4.
    pub element_bytes: u32,
    /// One word: elements that there are, at most [`Stream::capacity`].
    pub length: Storage,
    /// A word per element: 0 for a hole, else its bucket, from 1 on.
    pub flags: Storage,
    /// Which of the buckets.
    pub stays: Stays,
    /// The elements.
    pub elements: Storage,
    /// What stays; as large as [`Stream::elements`], and another buffer.
    pub kept: Storage,
    /// One word: elements that stay.
    pub count: Storage,
}

impl Stream {
    /// A kernel that sees the elements as what they have fewest of, `vec4`s where whole ones fit, else words, and the flags as
    /// those of the bucket that stays.
    pub fn seen_by(&self, kernel: Composition) -> Composition {
        let wide = self.element_bytes.is_multiple_of(16);
        let cells = self.element_bytes / if wide { 16 } else { 4 };
        let kernel = kernel.constant("CELLS", cells).feature("wide_cells", wide);
        match self.stays {
            Stays::Bucket(bucket) => kernel
                .constant("BUCKET", bucket)
                .feature("one_bucket", true),
            Stays::All | Stays::Apart(_) => kernel,
        }
    }

    fn bindings(&self) -> Bindings {
        let mut bindings = Bindings::new();
        bindings
            .buffer("stream_length", &self.length)
            .buffer("flags", &self.flags)
            .buffer("elements", &self.elements)
            .buffer("kept", &self.kept)
            .buffer("kept_count", &self.count);
        bindings
    }
}

/// Where a method writes down its passes.
pub struct Passes<'a> {
    gpu: &'a Gpu,
    recording: &'a mut Recording,
    /// What is compacted.
    pub stream: &'a Stream,
    /// Kernels that were recorded.
    pub runs: u32,
    /// Bytes of the buffers between passes.
    pub scratch_bytes: u64,
}

impl<'a> Passes<'a> {
    /// Passes over `stream` at the end of `recording`.
    pub fn new(gpu: &'a Gpu, recording: &'a mut Recording, stream: &'a Stream) -> Self {
        Self {
            gpu,
            recording,
            stream,
            runs: 0,
            scratch_bytes: 0,
        }
    }

    /// A buffer of so many words that is needed between passes. All recordings of a player share it.
    pub fn scratch(&mut self, name: &str, words: u64) -> Storage {
        self.scratch_bytes += 4 * words;
        Storage::scratch(&format!("compaction {name}"), 4 * words)
    }

    /// Sets the count to 0, for those who add to it.
    pub(crate) fn clear_count(&mut self) {
        self.recording.clear(&self.stream.count);
    }

    /// Runs `compaction/NAME`, which sees the stream and what is `further` bound, in so many workgroups.
    ///
    /// # Errors
    /// The kernel does not compose or compile.
    pub fn run(
        &mut self,
        kernel: Composition,
        further: &Bindings,
        workgroups: u32,
    ) -> Result<(), GpuError> {
        let kernel = self.stream.seen_by(kernel);
        let pipeline = self.gpu.pipeline(&kernel, true)?;
        let bindings = self.stream.bindings().merged(further);
        let name = kernel.entry.rsplit('/').next().unwrap_or_default();
        self.recording
            .run(name, &pipeline, &bindings, grid_of(workgroups));
        self.runs += 1;
        Ok(())
    }

    /// The same for a kernel of an invocation per item.
    ///
    /// # Errors
    /// As [`Passes::run`].
    pub fn run_for(
        &mut self,
        kernel: Composition,
        further: &Bindings,
        items: u32,
    ) -> Result<(), GpuError> {
        self.run(kernel, further, items.div_ceil(WORKGROUP_SIZE))
    }

    /// Sorts pairs of words by the lowest `bits` of the keys, and tells where they are then: see [`RadixSort::record`].
    ///
    /// # Errors
    /// A kernel does not compose or compile.
    pub fn sort(&mut self, pairs: &Pairs, bits: u32) -> Result<Pairs, GpuError> {
        let sort = RadixSort::new(self.gpu)?;
        self.runs += RadixSort::passes(bits);
        self.scratch_bytes += RadixSort::scratch_bytes(pairs.count);
        Ok(sort.record(self.recording, pairs, bits))
    }
}

impl Passes<'_> {
    /// Records what turns the count into workgroups of [`WORKGROUP_SIZE`] invocations, for a kernel of an invocation per
    /// element that stays: nothing is run where none does.
    ///
    /// # Errors
    /// The kernel does not compose or compile.
    pub fn groups_of_kept(&mut self) -> Result<Groups, GpuError> {
        let groups = self.scratch("groups", 4);
        let mut bindings = Bindings::new();
        bindings.buffer("groups", &groups);
        self.run(kernel("dispatch"), &bindings, 1)?;
        Ok(Groups::Indirect(groups, 0))
    }
}

/// A kernel of this folder.
pub(super) fn kernel(name: &str) -> Composition {
    Composition::new(&format!("compaction/{name}"))
}

/// Some buffers and one uniform of words.
pub(super) fn bound(
    buffers: &[(&str, &Storage)],
    (uniform, words): (&str, &[(&str, u32)]),
) -> Bindings {
    let mut bindings = Bindings::new();
    for (name, storage) in buffers {
        bindings.buffer(name, *storage);
    }
    let values = words.iter();
    let values = values.fold(UniformValues::new(), |v, (name, word)| v.u32(name, *word));
    bindings.uniform(uniform, values);
    bindings
}

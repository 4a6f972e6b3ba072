//! Input and output of a compaction, and its passes.

use crate::{
    Bindings, Composition, Gpu, GpuError, Groups, Pairs, RadixSort, Recording, Storage,
    UniformValues, WORKGROUP_SIZE, grid_of,
};

/// The selected buckets of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stays {
    /// Every bucket.
    All,
    /// Only this one, which becomes the first bucket.
    Bucket(u32),
    /// This many buckets, each in its own part of [`Stream::kept`] of [`Stream::capacity`]
    /// elements; the words of [`Stream::count`] hold their lengths. For methods that [keep them
    /// apart](super::Compaction::keeps_apart).
    Apart(u32),
}

/// A stream on the device, and the target of its compaction.
#[derive(Debug, Clone)]
pub struct Stream {
    /// Capacity of the buffers in elements.
    pub capacity: u32,
    /// Bytes per element, a multiple of 4.
    pub element_bytes: u32,
    /// One word: number of elements, at most [`Stream::capacity`].
    pub length: Storage,
    /// A word per element: 0 for a hole, otherwise its bucket, from 1.
    pub flags: Storage,
    /// The selected buckets.
    pub stays: Stays,
    /// The elements.
    pub elements: Storage,
    /// The output; as large as [`Stream::elements`], and a separate buffer.
    pub kept: Storage,
    /// One word: number of output elements.
    pub count: Storage,
}

impl Stream {
    /// The kernel with the widest possible element type, `vec4`s if they fit, otherwise words, and
    /// with flags for the selected bucket.
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

/// Recorder of a method's passes.
pub struct Passes<'a> {
    gpu: &'a Gpu,
    recording: &'a mut Recording,
    /// The stream to compact.
    pub stream: &'a Stream,
    /// Kernels recorded so far.
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

    /// A buffer of this many words for use between passes. All recordings of a player share it.
    pub fn scratch(&mut self, name: &str, words: u64) -> Storage {
        self.scratch_bytes += 4 * words;
        Storage::scratch(&format!("compaction {name}"), 4 * words)
    }

    /// Sets the count to 0, for kernels that add to it.
    pub(crate) fn clear_count(&mut self) {
        self.recording.clear(&self.stream.count);
    }

    /// Runs `compaction/NAME` with the bindings of the stream and `further`.
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

    /// The same for a kernel with one invocation per item.
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

    /// Sorts pairs of words by the lowest `bits` of the keys: see [`RadixSort::record`].
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
    /// Records the conversion of the count to workgroups of [`WORKGROUP_SIZE`] invocations, for a
    /// kernel with one invocation per output element; none for an empty output.
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

pub(super) fn kernel(name: &str) -> Composition {
    Composition::new(&format!("compaction/{name}"))
}

/// Bindings of some buffers and one uniform of words.
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

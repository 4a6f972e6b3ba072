//! Stream compaction: checked word by word, then timed in interleaved rounds.
//!
//! There are no hand-written expected results per method: the flags determine the surviving
//! elements. Before each turn the count is set to a wrong value and the survivors are erased; after
//! it, outside the timed part, the device computes two checksums of the survivors to compare.

pub mod stream;

use crate::timing::Measured;
use raystone_config::COMPACTIONS;
use raystone_core::parameters;
use raystone_core::params::{Entry, Parameters as _, Variant};
use raystone_gpu::compaction::{Compaction, CompactionRegistry, Order, Passes, Stays, Stream};
use raystone_gpu::{
    Bindings, Composition, Elapsed, Gpu, GpuError, Player, Recording, Storage, grid_of,
};
use std::sync::Arc;

parameters! {
    /// What is compacted.
    pub(crate) struct Load {
        /// elements of the stream
        elements: u32 = 1 << 20, in 1..=1 << 24;
        /// share of elements that stay, each drawn by itself
        valid: f64 = 0.5, in 0.0..=1.0;
        /// bytes of an element, a multiple of 4
        bytes: u32 = 16, in 4..=64;
    }
}

/// Compactions as named on the integrator axis: stream parameters come before their own.
pub(crate) fn benches(registry: &CompactionRegistry) -> impl Iterator<Item = Entry> {
    registry.0.entries().into_iter().map(|entry| Entry {
        name: format!("{COMPACTIONS}{}", entry.name),
        description: entry.description,
        schema: Load::schema().into_iter().chain(entry.schema).collect(),
    })
}

impl Load {
    /// The stream of a variant of [`benches`], with defaults for missing parameters.
    pub(crate) fn of(variant: &Variant) -> Self {
        Self::read(&variant.params).unwrap_or_default()
    }
}

/// The method of a variant of [`benches`].
///
/// # Errors
/// It is not registered, or has other parameters.
pub(crate) fn benched(
    registry: &CompactionRegistry,
    variant: &Variant,
) -> Result<Arc<dyn Compaction>, String> {
    let mut method = variant.clone();
    method.name = variant.name.trim_start_matches(COMPACTIONS).to_owned();
    let of_stream = Load::schema();
    let is_own = |name: &String| of_stream.iter().all(|parameter| parameter.name != name);
    method.params.0.retain(|name, _| is_own(name));
    registry.configured(&method)
}

/// Workgroup size of the checksum kernel.
const DIGEST_LANES: u32 = 256;
/// Count before a method has run.
const NOT_COUNTED: u32 = 0xdead_beef;

/// Streams on the device, the longest of each kind; shorter ones are prefixes.
pub struct Inputs {
    /// Host copy of the flags.
    pub flags: Vec<u32>,
    flags_there: Storage,
    elements: Storage,
    bytes: u32,
}

impl Inputs {
    /// Uploads flags, and elements of `bytes` bytes each.
    ///
    /// # Errors
    /// They exceed the adapter's binding limit, or are not whole words.
    pub fn upload(gpu: &Gpu, flags: Vec<u32>, bytes: u32) -> Result<Self, GpuError> {
        if bytes == 0 || !bytes.is_multiple_of(4) {
            let text = format!("an element of {bytes} bytes has no whole words of 4 bytes");
            return Err(GpuError::Kernel(text));
        }
        let elements = stream::elements(flags.len() as u32, bytes);
        Ok(Self {
            flags_there: (&gpu.storage("flags", &flags)?).into(),
            elements: (&gpu.storage("elements", &elements)?).into(),
            flags,
            bytes,
        })
    }
}

/// A recorded stream compaction that can be checked and timed repeatedly.
pub struct Bench {
    player: Arc<Player>,
    method: Arc<dyn Compaction>,
    flags: Vec<u32>,
    bytes: u32,
    /// Invalidates the method's outputs.
    prepare: Recording,
    compact: Recording,
    /// Computes the count and two checksums of the survivors.
    look: Recording,
    kept: Storage,
    digest: [u32; 2],
    /// Number of surviving elements.
    pub kept_elements: u32,
    /// Number of kernel dispatches.
    pub runs: u32,
    /// Total size of intermediate buffers.
    pub scratch_bytes: u64,
    /// What the method says of both and does not record.
    other_sizes: Option<String>,
}

/// See [`Bench::least_bytes`]: of so many flags, for survivors of so many bytes each.
pub(crate) fn least_bytes(order: Order, flags: u64, [bytes, kept]: [u64; 2]) -> u64 {
    let read = match order {
        Order::WithHoles => 0,
        _ => 4 * flags,
    };
    read + 2 * bytes * kept
}

/// Bytes by which scratch may differ from what a method says: buffers of few words are rounded up, and a single element needs fewer.
const FEW: u64 = 64;

/// What a method says of its dispatches and scratch, and does not record.
fn other_sizes(recording: &Recording, runs: u32, scratch_bytes: u64) -> Option<String> {
    let is_own = |name: &str| !name.starts_with("kept ");
    let found = (
        recording.run_count() as u32,
        recording.scratch_bytes(is_own),
    );
    let agrees = found.0 == runs && found.1.abs_diff(scratch_bytes) <= FEW;
    (!agrees).then(|| {
        format!(
            "it has (kernels, bytes) {found:?}, and says {:?}",
            (runs, scratch_bytes)
        )
    })
}

impl Bench {
    /// Records `method` over the first `length` elements of the inputs, with room for `capacity`.
    ///
    /// # Errors
    /// A kernel does not compose or compile, or a buffer exceeds the adapter's binding limit.
    pub fn new(
        player: &Arc<Player>,
        gpu: &Gpu,
        method: Arc<dyn Compaction>,
        inputs: &Inputs,
        [length, capacity]: [u32; 2],
    ) -> Result<Self, GpuError> {
        let bytes = inputs.bytes;
        let kept_bytes = u64::from(capacity.max(1)) * u64::from(bytes);
        let stream = Stream {
            capacity,
            element_bytes: bytes,
            length: (&gpu.storage("stream_length", &[length])?).into(),
            flags: inputs.flags_there.clone(),
            stays: Stays::All,
            elements: inputs.elements.clone(),
            kept: Storage::scratch(&format!("kept {kept_bytes}"), kept_bytes),
            count: Storage::scratch("kept count", 4),
        };
        let mut compact = Recording::new();
        let mut passes = Passes::new(gpu, &mut compact, &stream);
        method.record(&mut passes)?;
        let (runs, scratch_bytes) = (passes.runs, passes.scratch_bytes);
        let flags = inputs.flags[..length as usize].to_vec();
        let expected = stream::expected(&flags, &*method);
        let not_counted: Storage = (&gpu.storage("not counted", &[NOT_COUNTED; 4])?).into();
        let mut prepare = Recording::new();
        prepare
            .copy(&not_counted, &stream.count)
            .clear(&stream.kept);
        // Nothing is compacted in fewer steps than are said.
        let other_sizes = if flags.is_empty() {
            None
        } else {
            other_sizes(&compact, runs, scratch_bytes)
        };
        Ok(Self {
            player: Arc::clone(player),
            look: look(gpu, &stream)?,
            kept: stream.kept,
            digest: stream::digest(&expected, bytes),
            kept_elements: expected.len() as u32,
            method,
            flags,
            bytes,
            prepare,
            other_sizes,
            compact,
            runs,
            scratch_bytes,
        })
    }

    /// Minimum memory traffic of any method in bytes: flags once, survivors read and written once.
    pub fn least_bytes(&self) -> u64 {
        least_bytes(
            self.method.order(),
            self.flags.len() as u64,
            [self.bytes, self.kept_elements].map(u64::from),
        )
    }

    /// Checks the method's output word by word; returns the first error, if any.
    ///
    /// # Errors
    /// The device cannot execute it.
    pub fn judge(&self) -> Result<Option<String>, GpuError> {
        self.player.play(&self.prepare)?;
        self.player.play(&self.compact)?;
        let mut look = self.look.clone();
        let played = self.player.play(look.download("kept", &self.kept))?;
        let count = played.download::<u32>("count")?[0];
        let kept: Vec<u32> = played.download("kept")?;
        let found = (count, &kept[..]);
        let fault = stream::fault(&self.flags, self.bytes, &*self.method, found);
        // The checksums that check every turn must agree.
        let sums: Vec<u32> = played.download("digest")?;
        let fault = fault.or_else(|| self.differs(count, &sums));
        Ok(fault.or_else(|| self.other_sizes.clone()))
    }

    fn differs(&self, count: u32, sums: &[u32]) -> Option<String> {
        let ordered = self.method.order() != Order::Any;
        let equal = sums[0] == self.digest[0] && (!ordered || sums[1] == self.digest[1]);
        (count != self.kept_elements || !equal).then(|| {
            format!(
                "a turn left {count} elements with the sums {sums:?}, not {} with {:?}",
                self.kept_elements, self.digest
            )
        })
    }
}

/// Records the count and two checksums over the survivors.
fn look(gpu: &Gpu, stream: &Stream) -> Result<Recording, GpuError> {
    let digest = Storage::scratch("digest", 16);
    let kernel = Composition::new("compaction/digest").constant("SCAN_LANES", DIGEST_LANES);
    let kernel = stream.seen_by(kernel);
    let mut bindings = Bindings::new();
    bindings
        .buffer("kept", &stream.kept)
        .buffer("kept_count", &stream.count)
        .buffer("digest", &digest);
    let groups = grid_of(stream.capacity.div_ceil(DIGEST_LANES));
    let mut recording = Recording::new();
    recording
        .clear(&digest)
        .run("digest", &gpu.pipeline(&kernel, true)?, &bindings, groups)
        .download("digest", &digest)
        .download("count", &stream.count);
    Ok(recording)
}

impl Measured for Bench {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        self.player.play(&self.prepare)?;
        let elapsed = self.player.play(&self.compact)?.elapsed();
        let played = self.player.play(&self.look)?;
        let count = played.download::<u32>("count")?[0];
        let sums: Vec<u32> = played.download("digest")?;
        match self.differs(count, &sums) {
            Some(fault) => Err(GpuError::Kernels(fault)),
            None => Ok(elapsed),
        }
    }
}

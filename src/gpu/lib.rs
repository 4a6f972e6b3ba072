//! The GPU: adapter choice, device, kernel composition, pipelines, buffers, timestamps.
//!
//! Everything is bound *by name*: naga reflects the composed kernel, and each buffer is bound to
//! the variable of the same name, so no binding number, struct offset or size is written twice.
#![warn(missing_docs)]

mod adapter;
mod bindings;
mod buffers;
mod clock;
pub mod compaction;
mod compose;
mod diagnose;
mod kernel_errors;
mod load_probe;
mod pipeline;
mod player;
mod probe;
mod raster;
mod recording;
mod slices;
mod sort;
mod uniform;
mod wait;

#[cfg(target_family = "wasm")]
pub use adapter::open_in_browser;
pub use adapter::{
    AdapterChoice, AdapterSummary, Gpu, RawDevice, adapters, device_type, is_software,
    limits_of_runs, open,
};
pub use bindings::{Bindings, Storage, TEXELS};
pub use clock::{Elapsed, Stopwatch};
pub use compose::{ComposedKernel, Composition, KernelLibrary};
pub(crate) use kernel_errors::LOOPS_CUT;
pub use kernel_errors::{KERNEL_ERRORS, kernel_errors};
pub use pipeline::{Pipeline, TEXELS_PER_ROW, WORKGROUP_EDGE, WORKGROUP_SIZE};
pub use player::{Player, check_span};
pub use probe::{ArithmeticProbe, probe_arithmetic, probe_arithmetic_async, probe_clock_step};
pub use raster::Raster;
pub use recording::{Groups, Played, Recording, grid_of, groups_for};
pub use slices::{MOST_SLICE_MS, Slices, slow_slice};
pub use sort::{Pairs, RadixSort, check_sizes, fault_of_sort};
pub use uniform::UniformValues;
pub use wait::wait_for;

use thiserror::Error;

/// Errors between a kernel's text and its results on the host.
#[derive(Debug, Error)]
pub enum GpuError {
    /// No adapter answers.
    #[error(
        "no GPU adapter answers on this machine. Install a driver (Debian: `scripts/install-driver`) or set WGPU_BACKEND=gl; `raystone doctor` tells what was tried"
    )]
    NoAdapter,
    /// The requested adapter does not exist.
    #[error("no adapter matches `{asked}`; there are: {known}")]
    UnknownAdapter {
        /// The requested name.
        asked: String,
        /// The available adapters.
        known: String,
    },
    /// The adapter refuses a device with the required limits.
    #[error("adapter `{adapter}` gives no device: {cause}")]
    NoDevice {
        /// Adapter name.
        adapter: String,
        /// The driver's message.
        cause: String,
    },
    /// A kernel does not compose, parse or validate; the text names file and line.
    #[error("{0}")]
    Kernel(String),
    /// A kernel needs a buffer that was not provided.
    #[error(
        "kernel `{kernel}` binds `{binding}`, but no buffer of that name was given; there are: {known}"
    )]
    Unbound {
        /// Entry module.
        kernel: String,
        /// Variable name in the kernel.
        binding: String,
        /// Names of the provided buffers.
        known: String,
    },
    /// A buffer is larger than the adapter can bind.
    #[error("buffer `{name}` needs {needed} bytes, but this adapter binds at most {limit}")]
    TooLarge {
        /// Buffer name.
        name: String,
        /// Bytes needed.
        needed: u64,
        /// The adapter's limit.
        limit: u64,
    },
    /// A kernel binds more buffers than the adapter allows, because arrays have several parts.
    #[error(
        "kernel `{kernel}` needs {needed} storage buffers for a scene of this size, but this adapter binds at most {limit}"
    )]
    TooManyBuffers {
        /// Entry module.
        kernel: String,
        /// Storage buffers of the kernel.
        needed: u64,
        /// The adapter's limit.
        limit: u64,
    },
    /// A step of a recording needs more workgroups than the adapter supports.
    #[error(
        "step `{step}` asks for {groups:?} workgroups, but this adapter runs at most {limit} in each direction"
    )]
    TooManyGroups {
        /// Name of the step.
        step: String,
        /// Workgroups in x, y, z.
        groups: [u32; 3],
        /// The adapter's limit.
        limit: u32,
    },
    /// A workgroup of a kernel is larger than the adapter supports.
    #[error(
        "kernel `{kernel}` has workgroups with {needed} {what}, but this adapter runs at most {limit}: choose a smaller one on the axis `workgroup`"
    )]
    WorkgroupTooLarge {
        /// Entry module.
        kernel: String,
        /// The exceeded quantity.
        what: &'static str,
        /// The required number.
        needed: u64,
        /// The adapter's limit.
        limit: u64,
    },
    /// The driver ended loops early, so results are wrong.
    #[error(
        "this driver ends loops in silence once an invocation's loops together took {limit} turns, and here they need more: fewer triangles, another structure or a newer driver help (`raystone doctor`)"
    )]
    LoopsCut {
        /// [`Gpu::loop_limit`].
        limit: u32,
    },
    /// The driver ends loops early, undetected by kernels.
    #[error(
        "adapter `{adapter}` ends loops early ({turns} of {wanted} turns) in a way that kernels cannot notice: nothing it computes can be trusted; install another driver"
    )]
    LoopsUnsound {
        /// Adapter name.
        adapter: String,
        /// Iterations done.
        turns: u32,
        /// Iterations requested.
        wanted: u32,
    },
    /// Kernels raised the error word.
    #[error("wrong on the device: {0}")]
    Kernels(String),
    /// An image with pixels that did not take all their samples.
    #[error(
        "{wrong} pixels did not take the {wanted} samples of this block; the first is ({x}, {y}), which took {taken}"
    )]
    Samples {
        /// Number of such pixels.
        wrong: usize,
        /// Samples requested since the last sum was added on the host.
        wanted: u32,
        /// Column of the first such pixel.
        x: u32,
        /// Its row.
        y: u32,
        /// Its samples.
        taken: f32,
    },
    /// Validation or out-of-memory error from the driver.
    #[error("the driver refused: {0}")]
    Driver(String),
    /// A clock ran backwards during a measurement.
    #[error(
        "a clock of the device or of the processors ran backwards in every try, or reported more time than had passed, so that there is no time: update the driver, or measure on another machine"
    )]
    Clock,
    /// The device is lost.
    #[error("the device was lost: {0}")]
    Lost(String),
    /// Work did not finish in time.
    #[error("the device did not finish within {seconds} s")]
    Timeout {
        /// Time waited.
        seconds: u64,
    },
}

impl GpuError {
    /// True if driver or adapter cannot run the request, without a fault: the cell is left out.
    pub fn is_refusal(&self) -> bool {
        matches!(self, Self::LoopsCut { .. } | Self::WorkgroupTooLarge { .. })
    }
}

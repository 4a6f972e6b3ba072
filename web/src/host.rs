//! What a measurement needs of the page around it.

use raystone_gpu::{Gpu, GpuError, KernelLibrary};
use raystone_record::Line;

/// Why there is no device, to someone who has a browser and no shell.
pub(crate) fn no_device(error: &GpuError) -> String {
    match error {
        GpuError::NoAdapter => {
            "the browser offers no adapter any more: reload the page, or start the browser anew"
                .to_owned()
        }
        other => other.to_string(),
    }
}

/// The page, or a test.
pub trait Host {
    /// Opens a device; a lost one is followed by another.
    ///
    /// # Errors
    /// There is none.
    fn open(&self, kernels: KernelLibrary) -> impl Future<Output = Result<Gpu, GpuError>>;

    /// Returns when the page may go on: one in the background waits.
    fn allowed(&self) -> impl Future<Output = ()>;

    /// Takes a record.
    fn write(&self, line: &Line);

    /// Shows what is being done, and the share of the work that is behind.
    fn say(&self, what: &str, share: f64);

    /// The browser, as it names itself.
    fn browser(&self) -> Option<String>;
}

//! Places of faults: texts of kernels, the output of builders, tables of samplers.

use crate::CheckError;
use raystone::accel::StructureStats;
use raystone::accel::{AccelError, BuiltAccel, GpuBuffers, Space, TriangleSoup};
use raystone::gpu::KernelLibrary;
use raystone::sampling::{Sampler, SamplerTable};
use std::path::Path;

/// The place of a fault.
#[derive(Debug, Clone, Copy)]
pub enum Plant {
    /// Nowhere: the control.
    Nothing,
    /// A kernel: every `from` becomes `to`.
    Kernel {
        /// Module, without `.wesl`.
        file: &'static str,
        /// The original text.
        from: &'static str,
        /// Its replacement.
        to: &'static str,
        /// Its number of occurrences.
        times: usize,
    },
    /// The output of a builder for the GPU.
    Built {
        /// Description of the changed part.
        part: &'static str,
        /// Changes it, and returns the number of places changed.
        change: fn(&mut GpuBuffers) -> usize,
    },
    /// The table of a sampler, which kernel and twin both read.
    Table {
        /// Description of the changed part.
        part: &'static str,
        /// Changes the words (header included), and returns the number of words changed.
        change: fn(&mut [u32]) -> usize,
    },
}

impl Plant {
    /// Describes the place in few words.
    pub fn place(&self) -> String {
        match self {
            Self::Nothing => "nowhere".to_owned(),
            Self::Kernel { file, .. } => format!("kernels/{file}.wesl"),
            Self::Built { part, .. } => format!("builder: {part}"),
            Self::Table { part, .. } => format!("table: {part}"),
        }
    }

    /// Returns module and text of the changed kernel, if a kernel is changed.
    ///
    /// # Errors
    /// The text to be replaced does not occur as often as it should.
    pub fn changed_text(
        &self,
        library: &KernelLibrary,
    ) -> Result<Option<(&'static str, String)>, CheckError> {
        let Self::Kernel {
            file,
            from,
            to,
            times,
        } = self
        else {
            return Ok(None);
        };
        let stale = |found: String| {
            CheckError::Stale(format!(
                "`{from}` should stand {times} times in kernels/{file}.wesl, {found}"
            ))
        };
        let text = library.text(file);
        let text = text.ok_or_else(|| stale("but there is no such kernel".to_owned()))?;
        match text.matches(from).count() {
            found if found == *times => Ok(Some((file, text.replace(from, to)))),
            found => Err(stale(format!("but stands {found} times"))),
        }
    }

    /// The kernels with the fault, through an override folder that is written for it.
    ///
    /// # Errors
    /// The fault is stale, or the folder cannot be written.
    pub fn library(&self, folder: &Path) -> Result<KernelLibrary, CheckError> {
        self.library_over(&KernelLibrary::default(), folder)
    }

    /// [`Plant::library`] on top of kernels that are changed already.
    ///
    /// # Errors
    /// As [`Plant::library`].
    pub fn library_over(
        &self,
        library: &KernelLibrary,
        folder: &Path,
    ) -> Result<KernelLibrary, CheckError> {
        let Some((file, text)) = self.changed_text(library)? else {
            return Ok(library.clone());
        };
        let path = folder.join(format!("{file}.wesl"));
        let parent = path.parent().unwrap_or(folder);
        let written = std::fs::create_dir_all(parent).and_then(|()| std::fs::write(&path, text));
        let unwritten = |e| CheckError::Other(format!("cannot write {}: {e}", path.display()));
        written.map_err(unwritten)?;
        Ok(library.clone().with_folder(folder)?)
    }

    /// `sampler` with the fault in its table.
    ///
    /// # Errors
    /// There is nothing left to change.
    pub fn in_table(&self, mut sampler: Sampler) -> Result<Sampler, CheckError> {
        if let Self::Table { part, change } = self {
            let mut words = sampler.table.words().to_vec();
            if change(&mut words) == 0 {
                return Err(CheckError::Stale(format!("no {part} is left to change")));
            }
            let (sequence, decorrelation) = words.split_at(words[0] as usize);
            let (width, sequence) = sequence[1..].split_last().unwrap_or((&0, &[]));
            sampler.table = SamplerTable::new(sequence, *width, decorrelation);
        }
        Ok(sampler)
    }
}

/// A built structure that hands out something else than it built.
pub struct Faulty<'a> {
    inner: &'a dyn BuiltAccel,
    plant: &'a Plant,
}

impl<'a> Faulty<'a> {
    /// `inner` with the fault.
    ///
    /// # Errors
    /// There is nothing left to change.
    pub fn new(inner: &'a dyn BuiltAccel, plant: &'a Plant) -> Result<Self, CheckError> {
        if let Plant::Built { part, change } = plant {
            let mut buffers = inner.buffers();
            if change(&mut buffers) == 0 {
                return Err(CheckError::Stale(format!("no {part} is left to change")));
            }
        }
        Ok(Self { inner, plant })
    }
}

impl BuiltAccel for Faulty<'_> {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.inner.validate(soup)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let mut buffers = self.inner.buffers();
        if let Plant::Built { change, .. } = self.plant {
            change(&mut buffers);
        }
        buffers
    }

    fn divisible(&self) -> &'static [&'static str] {
        self.inner.divisible()
    }

    fn stats(&self) -> StructureStats {
        self.inner.stats()
    }

    fn space(&self) -> Space {
        self.inner.space()
    }
}

//! Places of faults: texts of kernels, the output of builders, tables of samplers.

use crate::CheckError;
use raystone::accel::StructureStats;
use raystone::accel::{AccelError, Access, BuiltAccel, GpuBuffers, Space, TriangleSoup};
use raystone::gpu::KernelLibrary;
use raystone::sampling::{
    Coordinate, Decorrelation, Demand, Facts, Partner, Sampler, SamplerTable, Seeding, Sequence,
};
use std::path::Path;
use std::sync::Arc;

/// Coordinates at which a faulty sampler draws in place of those asked for.
pub type Elsewhere = fn(Coordinate) -> Coordinate;

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
    /// A kernel of samplers, and the twin in the same way.
    Both {
        /// What stands in `sampling/sampler`, once.
        from: &'static str,
        /// What takes its place.
        to: &'static str,
        /// Where the twin's sequence and decorrelation draw.
        twin: [Option<Elsewhere>; 2],
    },
    /// The table of a sampler, which kernel and twin both read.
    Table {
        /// Description of the changed part.
        part: &'static str,
        /// Changes the words (header included), and returns the number of words changed.
        change: fn(&mut [u32]) -> usize,
    },
}

/// The kernel through which all draws go.
const SAMPLER: &str = "sampling/sampler";

/// A sequence or decorrelation that draws elsewhere.
struct Moved<T: ?Sized> {
    inner: Arc<T>,
    draws: Elsewhere,
}

impl Sequence for Moved<dyn Sequence> {
    fn seeding(&self) -> Seeding {
        self.inner.seeding()
    }

    fn facts(&self) -> Facts {
        self.inner.facts()
    }

    fn table(&self, demand: &Demand) -> Vec<u32> {
        self.inner.table(demand)
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        self.inner.constants()
    }

    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32 {
        self.inner.sequence(table, (self.draws)(at))
    }
}

impl Decorrelation for Moved<dyn Decorrelation> {
    fn kernel(&self) -> Option<&'static str> {
        self.inner.kernel()
    }

    fn seeding(&self) -> Seeding {
        self.inner.seeding()
    }

    fn is_random(&self) -> bool {
        self.inner.is_random()
    }

    fn is_unbiased(&self) -> bool {
        self.inner.is_unbiased()
    }

    fn by_count(&self) -> bool {
        self.inner.by_count()
    }

    fn by_width(&self) -> bool {
        self.inner.by_width()
    }

    fn limits(&self) -> [Option<u32>; 2] {
        self.inner.limits()
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        self.inner.refusal(partner)
    }

    fn table(&self, partner: &Partner, demand: &Demand) -> Result<Vec<u32>, String> {
        self.inner.table(partner, demand)
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        self.inner.constants()
    }

    fn index(&self, table: &SamplerTable, at: Coordinate) -> u32 {
        self.inner.index(table, (self.draws)(at))
    }

    fn decorrelate(&self, x: u32, table: &SamplerTable, at: Coordinate) -> u32 {
        self.inner.decorrelate(x, table, (self.draws)(at))
    }
}

impl Plant {
    /// Describes the place in few words.
    pub fn place(&self) -> String {
        match self {
            Self::Nothing => "nowhere".to_owned(),
            Self::Kernel { file, .. } => format!("kernels/{file}.wesl"),
            Self::Built { part, .. } => format!("builder: {part}"),
            Self::Both { .. } => format!("{SAMPLER} and twin"),
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
        let (file, from, to, times) = match self {
            Self::Kernel {
                file,
                from,
                to,
                times,
            } => (*file, *from, *to, *times),
            Self::Both { from, to, .. } => (SAMPLER, *from, *to, 1),
            _ => return Ok(None),
        };
        let stale = |found: String| {
            CheckError::Stale(format!(
                "`{from}` should stand {times} times in kernels/{file}.wesl, {found}"
            ))
        };
        let text = library.text(file);
        let text = text.ok_or_else(|| stale("but there is no such kernel".to_owned()))?;
        match text.matches(from).count() {
            found if found == times => Ok(Some((file, text.replace(from, to)))),
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

    /// `sampler` with the fault in its table, or in its twin.
    ///
    /// # Errors
    /// There is nothing left to change.
    pub fn in_sampler(&self, mut sampler: Sampler) -> Result<Sampler, CheckError> {
        if let Self::Table { part, change } = self {
            let mut words = sampler.table.words().to_vec();
            if change(&mut words) == 0 {
                return Err(CheckError::Stale(format!("no {part} is left to change")));
            }
            let (sequence, decorrelation) = words.split_at(words[0] as usize);
            let (width, sequence) = sequence[1..].split_last().unwrap_or((&0, &[]));
            sampler.table = SamplerTable::new(sequence, *width, decorrelation);
        }
        if let Self::Both { twin, .. } = *self {
            if let Some(draws) = twin[0] {
                let inner = sampler.sequence;
                sampler.sequence = Arc::new(Moved { inner, draws });
            }
            if let Some(draws) = twin[1] {
                let inner = sampler.decorrelation;
                sampler.decorrelation = Arc::new(Moved { inner, draws });
            }
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

    fn access(&self) -> Access {
        self.inner.access()
    }

    fn stats(&self) -> StructureStats {
        self.inner.stats()
    }

    fn space(&self) -> Space {
        self.inner.space()
    }
}

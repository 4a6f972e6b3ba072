//! All registries together.

use crate::accel::AccelRegistry;
use crate::config::{Catalogue, SamplerCell};
use crate::gpu::KernelLibrary;
use crate::integrator::IntegratorRegistry;
use crate::measure::figure::FigureRegistry;
use crate::params::Variant;
use crate::sampling::SamplerRegistry;

/// Everything that can be named.
#[derive(Clone, Default)]
pub struct Registries {
    /// Structures.
    pub accel: AccelRegistry,
    /// Sequences and decorrelations.
    pub samplers: SamplerRegistry,
    /// Integrators.
    pub integrators: IntegratorRegistry,
    /// Figures beside those of the crate.
    pub figures: FigureRegistry,
}

impl Registries {
    /// Names, descriptions and parameters for the parser, lists and docs.
    pub fn catalogue(&self) -> Catalogue {
        Catalogue {
            scene: crate::scene::builtin_scenes(),
            accel: self.accel.entries(),
            sequence: self.samplers.sequence_entries(),
            decorrelation: self.samplers.decorrelation_entries(),
            integrator: self.integrators.entries(),
        }
    }

    /// Modules that a folder of kernels may bring for what is registered, beside those of the program.
    pub fn kernels(&self) -> Vec<String> {
        self.accel.iter().flat_map(|kind| kind.kernels()).collect()
    }

    /// The kernels of the program, and those that came with what was registered.
    pub fn library(&self) -> KernelLibrary {
        let sequences = self.samplers.sequences.defaults().map(|s| s.sources());
        let decorrelations = self.samplers.decorrelations.defaults();
        let decorrelations = decorrelations.map(|d| d.sources());
        let integrators = self.integrators.iter().map(|i| i.sources());
        let structures = self.accel.iter().map(|kind| kind.sources());
        let samplers = sequences.chain(decorrelations);
        let sources = samplers.chain(integrators).chain(structures);
        let sources: Vec<_> = sources.flatten().copied().collect();
        KernelLibrary::default().with_sources(&sources)
    }

    /// Whether seeds change what this pair draws.
    ///
    /// # Errors
    /// Why the pair makes no sense, in words.
    pub fn is_randomised(
        &self,
        sequence: &Variant,
        decorrelation: &Variant,
    ) -> Result<bool, String> {
        let random = self.samplers.is_random(sequence, decorrelation);
        random.map_err(|e| e.to_string())
    }

    /// Whether the mean over seeds of what this sampler estimates is claimed to be the integral.
    pub fn is_unbiased(&self, cell: &SamplerCell) -> bool {
        (self.samplers).is_unbiased(&cell.sequence, &cell.decorrelation)
    }
}

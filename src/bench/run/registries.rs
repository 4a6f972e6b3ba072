//! All registries together.

use super::units::MeasurementRegistry;
use crate::compaction::benches;
use crate::figure_registry::FigureRegistry;
use crate::peers::PeerRegistry;
use raystone_accel::{
    AccelRegistry, BoxRegistry, Intersection, TriangleRegistry, Workgroup, WorkgroupRegistry,
};
use raystone_config::{Axis, Catalogue, Cell};
use raystone_core::params::Variant;
use raystone_gpu::KernelLibrary;
use raystone_gpu::compaction::CompactionRegistry;
use raystone_render::{
    ConfiguredIntegrator, IntegratorRegistry, OffsetRegistry, OrganisationRegistry, RayOffset,
};
use raystone_sampling::SamplerRegistry;
use raystone_verify::kinds::KindChecks;

/// Everything that can be named.
#[derive(Clone, Default)]
pub struct Registries {
    /// Structures.
    pub accel: AccelRegistry,
    /// Sequences and decorrelations.
    pub samplers: SamplerRegistry,
    /// Integrators.
    pub integrators: IntegratorRegistry,
    /// Ray–triangle tests.
    pub triangles: TriangleRegistry,
    /// Ray–box tests.
    pub boxes: BoxRegistry,
    /// Offsets of rays that leave a surface.
    pub offsets: OffsetRegistry,
    /// Organisations of the path tracer.
    pub organisations: OrganisationRegistry,
    /// Ray casters of others.
    pub peers: PeerRegistry,
    /// Workgroups of kernels that trace.
    pub workgroups: WorkgroupRegistry,
    /// Compactions of streams.
    pub compactions: CompactionRegistry,
    /// What checks know of the kinds of materials and lights.
    pub kinds: KindChecks,
    /// What is measured.
    pub measurements: MeasurementRegistry,
    /// Figures of structures beside those of the crate.
    pub figures: FigureRegistry,
}

impl Registries {
    /// Names, descriptions and parameters for the parser, lists and docs.
    pub fn catalogue(&self) -> Catalogue {
        let mut catalogue = Catalogue::default();
        catalogue[Axis::Scene] = raystone_scene::builtin_scenes();
        catalogue[Axis::Accel] = self.accel.entries();
        catalogue[Axis::Sequence] = self.samplers.sequence_entries();
        catalogue[Axis::Decorrelation] = self.samplers.decorrelation_entries();
        let integrators = self.integrators.entries().into_iter();
        catalogue[Axis::Integrator] = integrators.chain(benches(&self.compactions)).collect();
        catalogue[Axis::Triangle] = self.triangles.entries();
        catalogue[Axis::BoxTest] = self.boxes.entries();
        catalogue[Axis::Offset] = self.offsets.entries();
        catalogue[Axis::Organisation] = self.organisations.0.entries();
        catalogue[Axis::Peer] = self.peers.entries();
        catalogue[Axis::Workgroup] = self.workgroups.entries();
        self.measurements
            .iter()
            .for_each(|m| m.declare(&mut catalogue));
        catalogue
    }

    /// How the rays of a cell meet triangles and boxes.
    ///
    /// # Errors
    /// A test is not registered.
    pub fn intersection(&self, cell: &Cell) -> Result<Intersection, String> {
        let [triangle, box_test] = [Axis::Triangle, Axis::BoxTest].map(|axis| &cell[axis].name);
        Ok(Intersection {
            triangle: self.triangles.named("triangle test", triangle)?,
            box_test: *self.boxes.named("box test", box_test)?,
        })
    }

    /// How the rays of a cell leave surfaces.
    ///
    /// # Errors
    /// The offset is not registered.
    pub fn offset(&self, cell: &Cell) -> Result<RayOffset, String> {
        (self.offsets.named("offset", &cell[Axis::Offset].name)).copied()
    }

    /// In which workgroups the rays of a cell are traced; the default where it does not say.
    ///
    /// # Errors
    /// The workgroup is not registered.
    pub fn workgroup(&self, cell: &Cell) -> Result<Workgroup, String> {
        match cell.get(Axis::Workgroup) {
            Some(variant) => self.workgroups.named("workgroup", &variant.name).copied(),
            None => Ok(Workgroup::default()),
        }
    }

    /// What a cell computes per sample, as the cell organises it; by a single kernel where it does not matter.
    ///
    /// # Errors
    /// A name or a parameter is unknown, or the integrator cannot be organised so.
    pub fn integrator(&self, cell: &Cell) -> Result<ConfiguredIntegrator, String> {
        let integrator = self.integrators.configured(&cell[Axis::Integrator]);
        let integrator = integrator.map_err(|e| e.to_string())?;
        match cell.get(Axis::Organisation) {
            Some(by) => integrator.organised(self.organisations.configured(by)?),
            None => Ok(integrator),
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
        let samplers = sequences.chain(decorrelations).flatten().copied();
        let others = (self.integrators.sources())
            .chain(self.accel.sources())
            .chain(self.triangles.sources())
            .chain(self.offsets.sources());
        let sources: Vec<_> = samplers.chain(others).collect();
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
    pub fn is_unbiased(&self, cell: &Cell) -> bool {
        let claimed =
            (self.samplers).is_unbiased(&cell[Axis::Sequence], &cell[Axis::Decorrelation]);
        let integrator = self.integrators.configured(&cell[Axis::Integrator]);
        claimed
            && self.offset(cell).is_ok_and(|offset| offset.is_unbiased)
            && integrator.is_ok_and(|integrator| !integrator.facts.is_biased)
    }
}

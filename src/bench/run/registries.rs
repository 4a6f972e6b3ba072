//! All registries together.

use super::units::MeasurementRegistry;
use crate::compaction::benches;
use crate::figure_registry::FigureRegistry;
use crate::peers::PeerRegistry;
use raystone_accel::{
    AccelRegistry, BoxRegistry, Intersection, Load, LoadRegistry, TriangleRegistry, Workgroup,
    WorkgroupRegistry,
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

/// All registries.
#[derive(Clone, Default)]
pub struct Registries {
    /// Structures.
    pub accel: AccelRegistry,
    /// Sequences and decorrelations.
    pub samplers: SamplerRegistry,
    /// Integrators.
    pub integrators: IntegratorRegistry,
    /// Ray-triangle tests.
    pub triangles: TriangleRegistry,
    /// Ray-box tests.
    pub boxes: BoxRegistry,
    /// Ray offsets at surfaces.
    pub offsets: OffsetRegistry,
    /// Organisations of the path tracer.
    pub organisations: OrganisationRegistry,
    /// External tracers.
    pub peers: PeerRegistry,
    /// Workgroups of tracing kernels.
    pub workgroups: WorkgroupRegistry,
    /// How kernels read nodes and triangles.
    pub loads: LoadRegistry,
    /// Stream compactions.
    pub compactions: CompactionRegistry,
    /// Checks of material and light kinds.
    pub kinds: KindChecks,
    /// Measurements.
    pub measurements: MeasurementRegistry,
    /// Additional figures of structures.
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
        catalogue[Axis::Load] = self.loads.entries();
        self.measurements
            .iter()
            .for_each(|m| m.declare(&mut catalogue));
        catalogue
    }

    /// The triangle and box tests of a cell.
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

    /// The ray offset of a cell.
    ///
    /// # Errors
    /// The offset is not registered.
    pub fn offset(&self, cell: &Cell) -> Result<RayOffset, String> {
        (self.offsets.named("offset", &cell[Axis::Offset].name)).copied()
    }

    /// The workgroup of a cell, or the default.
    ///
    /// # Errors
    /// The workgroup is not registered.
    pub fn workgroup(&self, cell: &Cell) -> Result<Workgroup, String> {
        match cell.get(Axis::Workgroup) {
            Some(variant) => self.workgroups.named("workgroup", &variant.name).copied(),
            None => Ok(Workgroup::default()),
        }
    }

    /// The load path of a cell, or the default.
    ///
    /// # Errors
    /// The load path is not registered.
    pub fn load(&self, cell: &Cell) -> Result<Load, String> {
        match cell.get(Axis::Load) {
            Some(variant) => self.loads.named("load path", &variant.name).copied(),
            None => Ok(Load::default()),
        }
    }

    /// Why nothing is rendered with the triangle test of a cell, if so.
    ///
    /// # Errors
    /// The test is not registered.
    pub(super) fn unfit_for_images(&self, cell: &Cell) -> Result<Option<String>, String> {
        let Some(test) = cell.get(Axis::Triangle) else {
            return Ok(None);
        };
        let is_exact = self
            .triangles
            .named("triangle test", &test.name)?
            .is_exact();
        Ok((!is_exact).then(|| {
            format!("the triangle test {test} is not exact: structures are timed with it on recorded rays, and nothing is rendered")
        }))
    }

    /// The integrator of a cell in its organisation; a single kernel if that does not matter.
    ///
    /// # Errors
    /// A name or parameter is unknown, the integrator does not support the organisation, or the triangle test is not exact.
    pub fn integrator(&self, cell: &Cell) -> Result<ConfiguredIntegrator, String> {
        if let Some(reason) = self.unfit_for_images(cell)? {
            return Err(reason);
        }
        let integrator = self.integrators.configured(&cell[Axis::Integrator]);
        let integrator = integrator.map_err(|e| e.to_string())?;
        match cell.get(Axis::Organisation) {
            Some(by) => integrator.organised(self.organisations.configured(by)?),
            None => Ok(integrator),
        }
    }

    /// Additional module names that a kernel folder may contain, for registered kinds.
    pub fn kernels(&self) -> Vec<String> {
        self.accel.iter().flat_map(|kind| kind.kernels()).collect()
    }

    /// The program's kernels plus those of registered kinds.
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

    /// True if seeds change the samples of this pair.
    ///
    /// # Errors
    /// Why the pair is incompatible.
    pub fn is_randomised(
        &self,
        sequence: &Variant,
        decorrelation: &Variant,
    ) -> Result<bool, String> {
        let random = self.samplers.is_random(sequence, decorrelation);
        random.map_err(|e| e.to_string())
    }

    /// True if this sampler's estimate claims to be unbiased over seeds.
    pub fn is_unbiased(&self, cell: &Cell) -> bool {
        let claimed =
            (self.samplers).is_unbiased(&cell[Axis::Sequence], &cell[Axis::Decorrelation]);
        let integrator = self.integrators.configured(&cell[Axis::Integrator]);
        claimed
            && self.offset(cell).is_ok_and(|offset| offset.is_unbiased)
            && integrator.is_ok_and(|integrator| !integrator.facts.is_biased)
    }
}

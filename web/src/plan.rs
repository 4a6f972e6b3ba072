//! What there is to measure: the experiment of the page, read against the registries that it needs.

use raystone_accel::{
    AccelRegistry, BoxRegistry, Intersection, LoadRegistry, TriangleRegistry, WorkgroupRegistry,
};
use raystone_config::{Axis, Catalogue, Cell, Experiment, NO_PEER, Plan};
use raystone_core::params::Entry;
use raystone_gpu::KernelLibrary;
use raystone_render::{IntegratorRegistry, OffsetRegistry, OrganisationRegistry};
use raystone_sampling::SamplerRegistry;

/// The experiment, embedded.
pub const EXPERIMENT: &str = include_str!("../../experiments/web.toml");
/// Its name in records.
pub const FILE: &str = "experiments/web.toml";

/// The registries of a measurement of structures.
#[derive(Default)]
pub struct Registries {
    /// Structures.
    pub accel: AccelRegistry,
    triangles: TriangleRegistry,
    boxes: BoxRegistry,
}

impl Registries {
    /// Names and parameters for the parser.
    fn catalogue(&self, samplers: &SamplerRegistry) -> Catalogue {
        let mut catalogue = Catalogue::default();
        catalogue[Axis::Scene] = raystone_scene::builtin_scenes();
        catalogue[Axis::Accel] = self.accel.entries();
        catalogue[Axis::Sequence] = samplers.sequence_entries();
        catalogue[Axis::Decorrelation] = samplers.decorrelation_entries();
        catalogue[Axis::Integrator] = IntegratorRegistry::default().entries();
        catalogue[Axis::Triangle] = self.triangles.entries();
        catalogue[Axis::BoxTest] = self.boxes.entries();
        catalogue[Axis::Offset] = OffsetRegistry::default().entries();
        catalogue[Axis::Organisation] = OrganisationRegistry::default().0.entries();
        catalogue[Axis::Workgroup] = WorkgroupRegistry::default().entries();
        // A browser has no other tracers.
        catalogue[Axis::Peer] = vec![Entry {
            name: NO_PEER.to_owned(),
            description: String::new(),
            schema: Vec::new(),
        }];
        catalogue[Axis::Load] = LoadRegistry::default().entries();
        catalogue
    }

    /// The experiment with `overrides` (`section.key=value`), and its cells among those that `only` (`axis=pattern`) names.
    ///
    /// # Errors
    /// An override or a filter is wrong.
    pub fn plan(
        &self,
        overrides: &[String],
        only: &[String],
    ) -> Result<(Experiment, Plan), String> {
        let samplers = SamplerRegistry::default();
        let catalogue = self.catalogue(&samplers);
        let experiment = Experiment::parse(EXPERIMENT, FILE, overrides, &catalogue);
        let experiment = experiment.map_err(|e| e.to_string())?;
        let is_random = |sequence: &_, decorrelation: &_| {
            let random = samplers.is_random(sequence, decorrelation);
            random.map_err(|e| e.to_string())
        };
        let plan = Plan::new(&experiment, only, is_random).map_err(|e| e.to_string())?;
        Ok((experiment, plan))
    }

    /// The tests of a world.
    pub(crate) fn intersection(&self, cell: &Cell) -> Result<Intersection, String> {
        let [triangle, box_test] = [Axis::Triangle, Axis::BoxTest].map(|axis| &cell[axis].name);
        Ok(Intersection {
            triangle: self.triangles.named("triangle test", triangle)?,
            box_test: *self.boxes.named("box test", box_test)?,
        })
    }

    /// The kernels that structures and tests bring.
    pub fn library(&self) -> KernelLibrary {
        let sources = self
            .accel
            .sources()
            .into_iter()
            .chain(self.triangles.sources());
        KernelLibrary::default().with_sources(&sources.collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_measures_every_structure_on_some_scene_and_renders_nothing() {
        let registries = Registries::default();
        let (experiment, plan) = registries.plan(&[], &[]).unwrap();
        assert_eq!(experiment.name, "web");
        for kind in registries.accel.iter() {
            let on = |cell: &&Cell| cell[Axis::Accel].name == kind.name();
            assert!(
                plan.structures.iter().any(|cell| on(&cell)),
                "{}",
                kind.name()
            );
        }
        assert!(plan.samplers.is_empty() && plan.times.is_empty() && plan.streams.is_empty());
    }
}

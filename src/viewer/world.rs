//! The scene on the device.

use super::motion::{Follower, Pose};
use raystone_accel::{BuildLog, BuiltAccel, StructureStats, Traced, TriangleSoup};
use raystone_bench::run::{Registries, RunError, RunOptions, load_options, table_bytes};
use raystone_config::{Axis, Cell};
use raystone_gpu::{Gpu, probe_arithmetic_async};
use raystone_render::Stage;
use raystone_scene::{self as scene, SceneData};
use std::sync::Arc;

pub(crate) struct World {
    /// See [`Cell::WORLD`].
    pub cell: Cell,
    /// In its pose.
    pub stage: Stage,
    /// As it was loaded.
    pub still: Arc<SceneData>,
    pub pose: Pose,
    pub followers: Vec<Follower>,
}

/// A structure on the device, with its figures.
#[derive(Clone)]
pub(crate) struct Structure {
    pub cell: Cell,
    pub traced: Traced,
    pub stats: StructureStats,
}

impl World {
    /// Loads a scene and uploads it.
    pub(crate) async fn load(
        gpu: &Gpu,
        registries: &Registries,
        cell: &Cell,
        allow_outside: bool,
    ) -> Result<Self, RunError> {
        let options = RunOptions {
            allow_outside,
            ..RunOptions::default()
        };
        let options = load_options(&options, table_bytes(&gpu.limits));
        let loaded = scene::load(&cell[Axis::Scene], &options);
        let loaded = loaded.map_err(|e| RunError::Input(e.to_string()))?;
        let tests = registries.intersection(cell).map_err(RunError::Input)?;
        let kept = tests.kept_by(&probe_arithmetic_async(gpu).await?);
        kept.map_err(RunError::Input)?;
        let mut stage = Stage::new(gpu, loaded, tests)?;
        stage.soup = TriangleSoup::default().intersecting(tests);
        Ok(Self {
            cell: cell.on(&Cell::WORLD),
            still: Arc::clone(&stage.scene),
            stage,
            pose: Pose::default(),
            followers: Vec::new(),
        })
    }

    /// Its triangles for structures, made anew: the stage's own were given up for their memory.
    pub(crate) fn soup(&self) -> TriangleSoup {
        TriangleSoup::new(&self.stage.scene).intersecting(self.stage.soup.intersection)
    }

    /// Objects that can be dragged: instances, if there are several.
    pub(crate) fn objects(&self) -> usize {
        let assembly = self.still.assembly.as_ref();
        let instances = assembly.map_or(0, |assembly| assembly.instances().len());
        if instances > 1 { instances } else { 0 }
    }

    /// Builds and uploads the structure of a cell.
    pub(crate) fn build(&self, registries: &Registries, cell: &Cell) -> Result<Structure, String> {
        let soup = self.soup();
        let built = self.built(registries, cell, &soup)?;
        self.upload(registries, cell, &*built)
    }

    /// Builds the structure of a cell over these triangles.
    pub(crate) fn built(
        &self,
        registries: &Registries,
        cell: &Cell,
        soup: &TriangleSoup,
    ) -> Result<Box<dyn BuiltAccel>, String> {
        let accel = &cell[Axis::Accel];
        let kind = registries.accel.named("structure", &accel.name)?;
        let gpu = &self.stage.gpu;
        let built = kind.build(soup, &accel.params, &mut BuildLog::with_gpu(gpu));
        let built = built.map_err(|e| e.to_string())?;
        let valid = built.validate(soup);
        valid.map_err(|fault| format!("{accel} is not valid: {fault}"))?;
        Ok(built)
    }

    /// Uploads the structure of a cell.
    pub(crate) fn upload(
        &self,
        registries: &Registries,
        cell: &Cell,
        built: &dyn BuiltAccel,
    ) -> Result<Structure, String> {
        let gpu = &self.stage.gpu;
        let traced = Traced::upload(gpu, built).map_err(|e| e.to_string())?;
        let (workgroup, load) = (registries.workgroup(cell)?, registries.load(cell)?);
        let traced = traced
            .in_workgroups(gpu, &workgroup)
            .and_then(|traced| traced.loading(gpu, &load));
        Ok(Structure {
            cell: cell.on(&Cell::STRUCTURE),
            traced: traced.map_err(|e| e.to_string())?,
            stats: built.stats(),
        })
    }
}

//! Trees of the first frame of a room whose balls move.

use super::ready::{BUILDS, tracer_of};
use super::world::World;
use crate::run::{Absent, At};
use crate::timed_rays::TimedRays;
use raystone_accel::{AccelError, BuildLog, BuiltAccel, Space};
use raystone_config::{Axis, Cell};
use raystone_verify::rays::RaySet;
use std::time::Instant;

/// A tree of the first frame, its boxes fitted to the triangles as they have moved.
pub(super) struct Refitted {
    pub rays: TimedRays,
    pub space: Space,
    /// What fitting and laying out took, the fastest of some.
    pub ms: f64,
}

impl Refitted {
    /// `None` for a structure that is no layout of one binary tree, and where nothing has moved.
    pub(super) fn new(
        at: &At,
        cell: &Cell,
        world: &World,
        set: &RaySet,
    ) -> Result<Option<Self>, Absent> {
        let gpu = at.gpu(cell)?;
        let text = |error: AccelError| Absent::Failed(error.to_string());
        let accel = &cell[Axis::Accel];
        let structure = at.registries.accel.named("structure", &accel.name);
        let structure = structure.map_err(Absent::Failed)?;
        let (Some(over), Some(first)) = (structure.over_tree(), &world.first) else {
            return Ok(None);
        };
        let (soup, params) = (&world.soup, &accel.params);
        let log = || BuildLog::with_gpu(gpu);
        let of_first = over.tree(first, params, &mut log()).map_err(text)?;
        let mut fastest: Option<(f64, Box<dyn BuiltAccel>)> = None;
        for _ in 0..BUILDS {
            let mut tree = of_first.clone();
            let start = Instant::now();
            tree.refit(soup).map_err(text)?;
            let built = over
                .lay_out(&tree, soup, params, &mut log())
                .map_err(text)?;
            let ms = start.elapsed().as_secs_f64() * 1e3;
            if fastest.as_ref().is_none_or(|(least, _)| ms < *least) {
                fastest = Some((ms, built));
            }
        }
        let Some((ms, built)) = fastest else {
            return Ok(None);
        };
        built.validate(soup).map_err(text)?;
        let tracer = tracer_of(at, gpu, (&*built, soup), set)?;
        Ok(Some(Self {
            rays: TimedRays::new(tracer.batch(&set.rays)?),
            space: built.space(),
            ms,
        }))
    }
}

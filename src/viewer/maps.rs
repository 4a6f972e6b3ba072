//! Maps: what the first ray of each pixel costs, and how often its paths bounce.

use super::cycles::{Cycles, Host};
use super::done::Step;
use super::side::{Lens, Renderers};
use super::world::{Structure, World};
use raystone_accel::{Counters, Query};
use raystone_bench::run::Registries;
use raystone_config::{Axis, Cell, Follow, Map};
use raystone_core::clock::Instant;
use raystone_gpu::{Gpu, GpuError};
use raystone_verify::rays::{primary_pixels, primary_rays};
use std::sync::Arc;

/// Samples per pixel whose bounces are counted.
pub(crate) const BOUNCE_SPP: u32 = 16;
/// Milliseconds of the model between two looks at who watches.
const MODEL_MS: f64 = 50.0;

/// The work of the first ray of every pixel, of an image of this size; `None` if the structure does not count.
pub(crate) struct MapOfWork {
    pub size: [u32; 2],
    pub work: Option<Vec<Counters>>,
}

/// A value of every pixel, row by row; or why there are none.
pub(crate) type Values = Result<Vec<f32>, String>;

/// The values of an image of this size.
pub(crate) struct PixelMap {
    pub size: [u32; 2],
    pub values: Values,
    /// Samples per pixel that are counted.
    pub spp: u32,
}

/// The maps of an image that are there.
#[derive(Clone, Default)]
pub(crate) struct Maps {
    pub work: Option<Arc<MapOfWork>>,
    pub bounces: Option<Arc<PixelMap>>,
    pub cycles: Option<Arc<PixelMap>>,
}

impl MapOfWork {
    /// The work of every pixel, row by row; `None` if it is not counted.
    fn values(&self, value: impl Fn(&Counters) -> u32) -> Option<Vec<f32>> {
        let work = self.work.as_ref()?;
        let pixels = primary_pixels(self.size[0], self.size[1]);
        let mut values = vec![0.0; work.len()];
        for (pixel, counters) in pixels.into_iter().zip(work) {
            values[pixel as usize] = value(counters) as f32;
        }
        Some(values)
    }
}

impl PixelMap {
    fn of(size: [u32; 2], values: Values, spp: u32) -> Arc<Self> {
        Arc::new(Self { size, values, spp })
    }
}

impl Maps {
    /// Whether this map is there, or the reason why it is not.
    pub(crate) fn has(&self, map: Map) -> bool {
        match map {
            Map::None => true,
            Map::Bounces => self.bounces.is_some(),
            Map::Cycles => self.cycles.is_some(),
            _ => self.work.is_some(),
        }
    }

    /// Size and values, row by row, or why there are none; `None` until it is counted.
    pub(crate) fn values(&self, map: Map) -> Option<([u32; 2], Values)> {
        let of_pixels = |map: &Arc<PixelMap>| (map.size, map.values.clone());
        let value: fn(&Counters) -> u32 = match map {
            Map::None => return None,
            Map::Bounces => return self.bounces.as_ref().map(of_pixels),
            Map::Cycles => return self.cycles.as_ref().map(of_pixels),
            Map::Nodes => |c| c.nodes,
            Map::BoxTests => |c| c.box_tests,
            Map::Triangles => |c| c.triangle_tests,
            Map::Steps => |c| c.nodes + c.triangle_tests,
            Map::Stack => |c| c.stack_high_water,
        };
        let work = self.work.as_ref()?;
        let values = work.values(value);
        Some((
            work.size,
            values.ok_or("it does not count its work".to_owned()),
        ))
    }
}

/// What counts the maps of an image.
pub(crate) struct Counting<'g> {
    pub maps: Maps,
    bounces: Renderers<'g>,
    /// Samples of a pixel whose bounces are counted; 0 if that has to begin anew.
    bounced: u32,
    /// The structure on the host; at the first use of the model.
    host: Option<Result<Host, String>>,
    modelled: Option<Cycles>,
}

/// What a map is counted for.
#[derive(Clone, Copy)]
pub(crate) struct Counted<'a> {
    pub registries: &'a Registries,
    pub world: &'a World,
    pub cell: &'a Cell,
    pub structure: &'a Structure,
    pub lens: &'a Lens,
    /// The image is so many times coarser.
    pub by: u32,
    pub map: Map,
    pub follow: Follow,
}

impl<'g> Counting<'g> {
    pub(crate) fn new(gpu: &'g Gpu, cell: Cell) -> Self {
        Self {
            maps: Maps::default(),
            bounces: Renderers::counting_bounces(gpu, cell),
            bounced: 0,
            host: None,
            modelled: None,
        }
    }

    /// Forgets what was counted, for another camera.
    pub(crate) fn restart(&mut self) {
        self.maps = Maps::default();
        self.bounced = 0;
        self.modelled = None;
    }

    /// Does a piece of what the wanted map needs; `None` if it is there.
    pub(crate) async fn count(
        &mut self,
        of: Counted<'_>,
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<Step>, GpuError> {
        let size = of.lens.divided(of.by);
        match of.map {
            Map::None => Ok(None),
            Map::Bounces => self.count_bounces(of, size, stop).await,
            Map::Cycles => Ok(self.model(of, size, stop)),
            _ => {
                if self.maps.work.as_ref().is_some_and(|map| map.size == size) {
                    return Ok(None);
                }
                let rays = primary_rays(of.lens.camera, size[0], size[1]);
                let (stage, traced) = (&of.world.stage, &of.structure.traced);
                let work = stage
                    .count_work_async(traced, Query::Closest, &rays)
                    .await?;
                self.maps.work = Some(Arc::new(MapOfWork { size, work }));
                Ok(Some(Step::Shown))
            }
        }
    }

    /// One sample of a coarse image, [`BOUNCE_SPP`] of a whole one: twice as many each time.
    async fn count_bounces(
        &mut self,
        of: Counted<'_>,
        size: [u32; 2],
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<Step>, GpuError> {
        let most = match of.by {
            1 => BOUNCE_SPP.min(of.lens.spp),
            _ => 1,
        };
        let known = self.maps.bounces.as_ref();
        let known =
            known.filter(|map| map.size == size && (map.spp >= most || map.values.is_err()));
        if known.is_some() {
            return Ok(None);
        }
        let with = (of.registries, of.world, of.structure);
        let renderer = match self.bounces.at(of.by, of.lens, with) {
            Ok(renderer) => renderer,
            Err(reason) => {
                self.maps.bounces = Some(PixelMap::of(size, Err(reason), 0));
                return Ok(Some(Step::Shown));
            }
        };
        let is_begun =
            self.bounced > 0 && (self.maps.bounces.as_ref()).is_some_and(|map| map.size == size);
        let done = if is_begun { self.bounced } else { 0 };
        if done == 0 {
            renderer.look_async(of.lens.camera).await?;
        }
        let count = done.max(1).min(most - done);
        let seed = of.lens.seed;
        self.bounced = 0;
        if !renderer
            .add_samples_until_async((done, count), seed, stop)
            .await?
        {
            return Ok(Some(Step::Stopped));
        }
        self.bounced = done + count;
        let image = renderer.image_async().await?;
        let values = image.pixels.iter().map(|[bounces, ..]| *bounces).collect();
        self.maps.bounces = Some(PixelMap::of(size, Ok(values), self.bounced));
        Ok(Some(Step::Shown))
    }

    fn model(&mut self, of: Counted, size: [u32; 2], stop: &dyn Fn() -> bool) -> Option<Step> {
        if self
            .maps
            .cycles
            .as_ref()
            .is_some_and(|map| map.size == size)
        {
            return None;
        }
        match self.model_on(of, size, stop) {
            Ok(None) if stop() => return Some(Step::Stopped),
            Ok(None) => return Some(Step::Worked),
            Ok(Some(values)) => self.maps.cycles = Some(PixelMap::of(size, Ok(values), 1)),
            Err(reason) => self.maps.cycles = Some(PixelMap::of(size, Err(reason), 0)),
        }
        self.modelled = None;
        Some(Step::Shown)
    }

    /// The model goes on for [`MODEL_MS`]; the values once it is done.
    fn model_on(
        &mut self,
        of: Counted,
        size: [u32; 2],
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<Vec<f32>>, String> {
        if of.follow == Follow::Refit && of.world.pose.is_moved() {
            return Err(
                "the model has the structure that is built anew, and this one was refitted: have it rebuilt"
                    .to_owned(),
            );
        }
        let new = || Host::new(of.world, of.registries, of.cell);
        let host = self
            .host
            .get_or_insert_with(new)
            .as_ref()
            .map_err(Clone::clone)?;
        let modelled = self.modelled.take().filter(|begun| begun.size == size);
        let mut modelled = modelled.unwrap_or_else(|| Cycles::new(of.lens.camera, size));
        let clock = Instant::now();
        while !stop() && clock.elapsed().as_secs_f64() * 1e3 < MODEL_MS {
            if !modelled.add_band(host)? {
                return Ok(Some(modelled.values));
            }
        }
        self.modelled = Some(modelled);
        Ok(None)
    }
}

/// Why a map is not there, in a sentence.
pub(crate) fn absence(cell: &Cell, reason: &str) -> String {
    format!("{}: {reason}: there is no map", cell[Axis::Accel])
}

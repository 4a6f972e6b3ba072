//! One of the images on screen: first coarse, then sample by sample.

use super::done::Step;
use super::maps::{Counted, Counting};
use super::motion::SideTimes;
use super::reference::Flip;
use super::world::{Structure, World};
use raystone_bench::run::{Estimator, Registries};
use raystone_config::{Axis, Cell, Follow, Map};
use raystone_core::clock::Instant;
use raystone_core::geometry::Camera;
use raystone_core::structure::{RAY_QUERIES, TRACED_CLASSES};
use raystone_gpu::{Gpu, GpuError};
use raystone_image::Image;
use raystone_render::Renderer;
use raystone_stats::metrics::Reference;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// Milliseconds of a slice: a window on the same device waits no longer.
const SLICE_MS: f64 = 30.0;
/// Milliseconds that a coarse image may take.
const COARSE_MS: f64 = 50.0;
/// Milliseconds of samples that are added at a time.
const STEP_MS: f64 = 100.0;
/// Time between two readings of an image, milliseconds.
const REFRESH_MS: f64 = 150.0;
/// Width over that of the first coarse image of all.
const COARSEST: u32 = 16;
/// Samples whose time is kept.
const HISTORY: usize = 240;

/// What every image shares while the camera, the size and the seed stay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lens {
    pub camera: Camera,
    pub size: [u32; 2],
    pub seed: u32,
    pub spp: u32,
}

impl Lens {
    /// The size of an image that is this many times coarser.
    pub(crate) fn divided(&self, by: u32) -> [u32; 2] {
        self.size.map(|edge| edge.div_ceil(by))
    }
}

/// Renderers of a cell at several sizes, which share their compiled kernels.
pub(crate) struct Renderers<'g> {
    gpu: &'g Gpu,
    cell: Cell,
    /// By width over that of the renderer.
    by_size: BTreeMap<u32, Renderer<'g>>,
    /// Images are how often paths bounce.
    counts_bounces: bool,
}

impl<'g> Renderers<'g> {
    pub(crate) fn new(gpu: &'g Gpu, cell: Cell) -> Self {
        Self {
            gpu,
            cell,
            by_size: BTreeMap::new(),
            counts_bounces: false,
        }
    }

    /// Renderers whose images are the mean number of bounces of each pixel's paths.
    pub(crate) fn counting_bounces(gpu: &'g Gpu, cell: Cell) -> Self {
        Self {
            counts_bounces: true,
            ..Self::new(gpu, cell)
        }
    }

    /// The renderer of an image that is this many times coarser; compiled at its first use.
    pub(crate) fn at(
        &mut self,
        by: u32,
        lens: &Lens,
        (registries, world, structure): (&Registries, &World, &Structure),
    ) -> Result<&mut Renderer<'g>, String> {
        if !self.by_size.contains_key(&by) {
            let size = lens.divided(by);
            let mut estimator = Estimator::of(registries, &self.cell, lens.spp, size[0])?;
            if self.counts_bounces {
                estimator.integrator = estimator.integrator.counting_bounces();
            }
            if let Some(reason) = estimator.integrator.refusal(&structure.traced) {
                return Err(format!("{}: {reason}", self.cell[Axis::Accel]));
            }
            let job = estimator.image(size, lens.camera, true);
            let renderer = Renderer::new(
                self.gpu,
                &world.stage.buffers,
                &structure.traced,
                &job,
                true,
            );
            let renderer = renderer.map_err(|e| e.to_string())?;
            self.by_size.insert(by, renderer.in_slices_of(SLICE_MS));
        }
        let renderer = self.by_size.get_mut(&by);
        renderer.ok_or_else(|| "there is no renderer".to_owned())
    }

    fn whole(&self) -> Option<&Renderer<'g>> {
        self.by_size.get(&1)
    }
}

/// How fast an image goes on.
#[derive(Debug, Default)]
pub(crate) struct Pace {
    /// Samples of pixels per millisecond, as last seen.
    rate: Option<f64>,
    /// Milliseconds of each sample of all pixels, the last ones.
    pub history: VecDeque<f32>,
    /// Rays of each traced class since the start.
    pub rays: [u64; TRACED_CLASSES],
    /// Milliseconds of all samples that the rays are of.
    pub rays_ms: f64,
    /// Milliseconds in which the structure followed the last move of the scene.
    pub update_ms: f64,
}

/// An image on screen.
pub(crate) struct Side<'g> {
    pub cell: Cell,
    /// `None` of an image that could not be made.
    pub structure: Option<Structure>,
    pub renderers: Renderers<'g>,
    pub lens: Lens,
    /// The next image is this many times coarser; 1 once all samples count.
    by: u32,
    /// Samples of the whole image were given up midway.
    is_torn: bool,
    pub image: Option<Arc<Image>>,
    pub counting: Counting<'g>,
    pub flip: Option<Flip>,
    /// Samples per pixel of the whole image.
    pub done: u32,
    /// Samples per pixel of the image that is shown; 0 of a coarse one.
    pub shown: u32,
    read: Option<Instant>,
    pub pace: Pace,
    /// Why there is no more to come.
    pub fault: Option<String>,
}

impl<'g> Side<'g> {
    pub(crate) fn new(
        gpu: &'g Gpu,
        cell: &Cell,
        structure: Result<Structure, String>,
        lens: Lens,
    ) -> Self {
        let (structure, fault) = match structure {
            Ok(structure) => (Some(structure), None),
            Err(reason) => (None, Some(reason)),
        };
        Self {
            cell: cell.clone(),
            structure,
            renderers: Renderers::new(gpu, cell.clone()),
            lens,
            by: COARSEST,
            is_torn: true,
            image: None,
            counting: Counting::new(gpu, cell.clone()),
            flip: None,
            done: 0,
            shown: 0,
            read: None,
            pace: Pace::default(),
            fault,
        }
    }

    /// Begins anew with this lens; the size and the samples are those of before.
    pub(crate) fn restart(&mut self, lens: Lens) {
        self.lens = lens;
        self.by = self.first_coarse();
        self.is_torn = true;
        self.counting.restart();
        self.flip = None;
        (self.done, self.shown) = (0, 0);
        self.pace.rays = [0; TRACED_CLASSES];
        self.pace.rays_ms = 0.0;
    }

    /// Begins anew over a scene that moved, with the structure that took so long to follow it. What was shown stays until then.
    pub(crate) fn follow(&mut self, structure: Result<Structure, String>, update_ms: f64) {
        let gpu = self.renderers.gpu;
        self.renderers = Renderers::new(gpu, self.cell.clone());
        self.counting = Counting::new(gpu, self.cell.clone());
        self.restart(self.lens);
        self.pace.update_ms = update_ms;
        match structure {
            Ok(structure) => (self.structure, self.fault) = (Some(structure), None),
            Err(reason) => self.fault = Some(reason),
        }
    }

    /// Leaves out coarse images: those of before are as good.
    pub(crate) fn skip_coarse(&mut self) {
        self.by = 1;
    }

    /// What the samples so far took, and following the scene before.
    pub(crate) fn times(&self) -> SideTimes {
        let stages = self
            .renderers
            .whole()
            .map_or_else(BTreeMap::new, Renderer::stages);
        let queries = RAY_QUERIES.iter().filter_map(|query| stages.get(*query));
        let traced: Vec<f64> = queries.copied().collect();
        SideTimes {
            update_ms: self.pace.update_ms,
            render_ms: self.spent_ms(),
            trace_ms: (!traced.is_empty()).then(|| traced.iter().sum()),
        }
    }

    /// How much coarser the first image has to be, so that it takes no longer than [`COARSE_MS`].
    fn first_coarse(&self) -> u32 {
        let Some(rate) = self.pace.rate else {
            return COARSEST;
        };
        let pixels = f64::from(self.lens.size[0]) * f64::from(self.lens.size[1]);
        let fits = |by: &u32| pixels / f64::from(by * by) <= rate * COARSE_MS;
        [1, 2, 4, 8].into_iter().find(fits).unwrap_or(COARSEST)
    }

    pub(crate) fn is_coarse(&self) -> bool {
        self.by > 1
    }

    pub(crate) fn is_finished(&self) -> bool {
        self.fault.is_some() || (self.done >= self.lens.spp && !self.is_coarse())
    }

    /// Milliseconds of all samples so far.
    pub(crate) fn spent_ms(&self) -> f64 {
        let whole = self.renderers.whole();
        whole
            .filter(|_| !self.is_torn)
            .map_or(0.0, |r| r.spent().ms())
    }

    /// The renderer of an image that is this many times coarser; `None` with a fault noted.
    fn renderer(
        &mut self,
        by: u32,
        (registries, world): (&Registries, &World),
    ) -> Option<&mut Renderer<'g>> {
        let with = (registries, world, self.structure.as_ref()?);
        match self.renderers.at(by, &self.lens, with) {
            Ok(renderer) => Some(renderer),
            Err(reason) => {
                self.fault = Some(reason);
                None
            }
        }
    }

    /// Compiles its kernels, before any of them is waited for.
    pub(crate) fn compile(&mut self, with: (&Registries, &World)) {
        self.renderer(1, with);
    }

    /// A coarse image, and the map that is wanted.
    pub(crate) async fn refine(
        &mut self,
        with: (&Registries, &World),
        (map, follow): (Map, Follow),
        stop: &dyn Fn() -> bool,
    ) -> Result<Step, GpuError> {
        if !self.coarse(with, stop).await? {
            return Ok(Step::Stopped);
        }
        if self.fault.is_none() {
            while let Some(Step::Worked) = self.count(with, (map, follow), stop).await? {}
        }
        Ok(Step::Shown)
    }

    /// Samples for all pixels, and the image if it is time to and `shows` it.
    pub(crate) async fn accumulate(
        &mut self,
        with: (&Registries, &World),
        shows: bool,
        stop: &dyn Fn() -> bool,
    ) -> Result<Step, GpuError> {
        if !self.add(with, stop).await? {
            return Ok(Step::Stopped);
        }
        Ok(if shows && self.refresh().await? {
            Step::Shown
        } else {
            Step::Worked
        })
    }

    /// Renders a coarse image; the next one is finer.
    async fn coarse(
        &mut self,
        with: (&Registries, &World),
        stop: &dyn Fn() -> bool,
    ) -> Result<bool, GpuError> {
        let (by, lens) = (self.by, self.lens);
        let Some(renderer) = self.renderer(by, with) else {
            return Ok(true);
        };
        renderer.look_async(lens.camera).await?;
        if !renderer
            .add_samples_until_async((0, 1), lens.seed, stop)
            .await?
        {
            return Ok(false);
        }
        let (image, ms) = (renderer.image_async().await?, renderer.spent().ms());
        self.image = Some(Arc::new(image));
        self.shown = 0;
        let [width, height] = lens.divided(by).map(f64::from);
        self.pace.rate = Some(width * height / ms.max(0.1));
        self.by = by / 4;
        Ok(true)
    }

    /// Adds samples to all pixels, as many as take about [`STEP_MS`]; `false` if `stop` said so.
    async fn add(
        &mut self,
        with: (&Registries, &World),
        stop: &dyn Fn() -> bool,
    ) -> Result<bool, GpuError> {
        let lens = self.lens;
        self.by = 1;
        let (is_torn, done) = if self.is_torn {
            (true, 0)
        } else {
            (false, self.done)
        };
        let last = f64::from(self.pace.history.back().copied().unwrap_or(STEP_MS as f32));
        let fitting = (STEP_MS / last.max(0.01)).clamp(1.0, 64.0) as u32;
        let count = fitting.min(lens.spp - done);
        let Some(renderer) = self.renderer(1, with) else {
            return Ok(true);
        };
        if is_torn {
            renderer.look_async(lens.camera).await?;
        }
        let before = renderer.spent().ms();
        let whole = renderer
            .add_samples_until_async((done, count), lens.seed, stop)
            .await?;
        let each = (renderer.spent().ms() - before) / f64::from(count);
        self.is_torn = !whole;
        if !whole {
            return Ok(false);
        }
        self.done = done + count;
        let pixels = f64::from(lens.size[0]) * f64::from(lens.size[1]);
        self.pace.rate = Some(pixels / each.max(0.01));
        self.pace.history.extend((0..count).map(|_| each as f32));
        let old = self.pace.history.len().saturating_sub(HISTORY);
        self.pace.history.drain(..old);
        Ok(true)
    }

    /// Reads the image back if it is time to; `true` if there is another one to show.
    pub(crate) async fn refresh(&mut self) -> Result<bool, GpuError> {
        let is_due = self
            .read
            .is_none_or(|read| read.elapsed().as_secs_f64() * 1e3 >= REFRESH_MS);
        let is_last = self.done == self.lens.spp;
        let is_first = self.shown == 0;
        if self.is_torn || self.done == self.shown || !(is_due || is_last || is_first) {
            return Ok(false);
        }
        let Some(renderer) = self.renderers.whole() else {
            return Ok(false);
        };
        self.image = Some(Arc::new(renderer.image_async().await?));
        let counts = renderer.ray_counts_async().await?;
        self.pace.rays = std::array::from_fn(|class| counts[class]);
        self.pace.rays_ms = renderer.spent().ms();
        self.shown = self.done;
        self.read = Some(Instant::now());
        Ok(true)
    }

    /// Compares what is shown with a reference that was read then, if it is time to; `true` if there is a new figure.
    pub(crate) fn compare(
        &mut self,
        (reference, read): &(Reference, Instant),
        is_last: bool,
    ) -> bool {
        let of = (self.shown, *read);
        let known = self.flip.as_ref();
        let is_last = is_last && self.is_finished();
        let is_due = self.shown > 0 && known.is_none_or(|flip| flip.is_due(of, is_last));
        let Some(image) = self.image.as_deref().filter(|_| is_due) else {
            return false;
        };
        self.flip = Some(Flip::new(image, reference, of));
        true
    }

    /// Does a piece of the map that is wanted, for an image as coarse as the one that is shown; `None` if it is there.
    pub(crate) async fn count(
        &mut self,
        (registries, world): (&Registries, &World),
        (map, follow): (Map, Follow),
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<Step>, GpuError> {
        let Some(structure) = &self.structure else {
            return Ok(None);
        };
        let by = if self.is_coarse() { self.by * 4 } else { 1 };
        let of = Counted {
            registries,
            world,
            cell: &self.cell,
            structure,
            lens: &self.lens,
            by,
            map,
            follow,
        };
        self.counting.count(of, stop).await
    }
}

//! Cones as a measurement: `cones:primary` and `cones:reflected` on the axis of integrators, which need no scene of the
//! experiment.

use crate::check;
use crate::cone::Mirror;
use crate::device::{Tracer, overlaps};
use crate::figures::*;
use crate::sample::{Crossing, DIMENSIONS, MOST, POWERS, budget, crossing, sampled, shimmer};
use crate::scene::Place;
use crate::ties::fault_of_ties;
use crate::trace::{Blend, Found};
use crate::world::{Keep, Picture as Traced, View, World};
use glam::DVec3;
use raystone_bench::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Registries, Work};
use raystone_bench::timing::{Measured, Samples};
use raystone_config::{Axis, CONES, Catalogue, Cell, Experiment, Plan};
use raystone_core::parameters;
use raystone_core::params::{Entry, Parameters as _};
use raystone_gpu::{Elapsed, Gpu, GpuError, probe_arithmetic};
use raystone_image::{Image, Picture, tone_map};
use raystone_record::figure::Figure;
use raystone_record::{Note, Reading};
use raystone_sampling::{Demand, Sampler};
use std::sync::Arc;

/// Replicates of a sampler that gives others for other seeds.
const REPLICATES: u32 = 2;
/// Samples a pixel on average, of adaptive sampling.
const SPENT: u32 = 16;
/// Triangles whose overlaps are checked on each device.
const CHECKED: usize = 4096;
/// How often a pixel is repeated in the page's picture.
const MAGNIFIED: u32 = 6;

parameters! {
    /// What a reflected cone is as wide as.
    enum Footprint {
        /// in the plane of incidence, where it is wider: the thesis's
        Incidence = "incidence",
        /// the geometric mean of its two widths
        Mean = "mean",
    }

    /// what both have
    struct Kept {
        /// layers that are kept, the nearest
        layers: u32 = 50, in 1..=256;
        /// how layers hide each other
        blend: Blend = Blend::Saturate;
        /// the least part of a cone that is a layer
        cut: f64 = 0.0, in 0.0..=0.5;
        /// cones along each side of the picture
        side: u32 = 32, in 4..=64;
        /// pixels along each side of the picture that the cones are those of, evenly chosen
        resolution: u32 = 256, in 4..=4096;
        /// samples a pixel of the reference
        samples: u32 = 2048, in 16..=65536;
        /// pictures while the eye turns by a pixel, of which the reference is one each; 1: it does not move
        frames: u32 = 1, in 1..=16;
        /// whether errors of the sampler are measured; the cone's time is, if not
        sampled: bool = true;
    }

    /// pictures by cones from the eye, one a pixel (Roger 2008, chapter 5): their bias against distributed rays, and the samples with which samplers are as good
    struct Primary {
        /// scene
        place: Place = Place::Checker;
        /// what is kept of a cone, and measured
        kept: Kept;
    }

    /// pictures by cones off a mirror with a lobe, one a pixel (Roger 2008, chapter 5): their bias against distributed rays, and the samples with which samplers are as good
    struct Reflected {
        /// scene
        place: Place = Place::Checker;
        /// mirror
        mirror: Mirror = Mirror::Sphere;
        /// half-angle of its lobe in radians
        gloss: f64 = 0.0, in 0.0..=0.4;
        /// what a reflected cone is as wide as
        footprint: Footprint = Footprint::Incidence;
        /// what is kept of a cone, and measured
        kept: Kept;
    }
}

/// Either of them.
struct Load {
    view: View,
    keep: Keep,
    frames: u32,
    is_sampled: bool,
}

impl Load {
    fn of(cell: &Cell) -> Option<Self> {
        let variant = &cell[Axis::Integrator];
        match variant.name.strip_prefix(CONES)? {
            "primary" => {
                let own = Primary::from_checked(&variant.params);
                Some(Self::new(own.place, None, &own.kept))
            }
            "reflected" => {
                let own = Reflected::from_checked(&variant.params);
                let mut load = Self::new(own.place, Some(own.mirror), &own.kept);
                load.view.gloss = own.gloss;
                load.keep.is_mean = own.footprint == Footprint::Mean;
                Some(load)
            }
            _ => None,
        }
    }

    fn new(place: Place, mirror: Option<Mirror>, kept: &Kept) -> Self {
        Self {
            view: View {
                place,
                mirror,
                gloss: 0.0,
                side: kept.side,
                resolution: kept.resolution,
                samples: kept.samples,
                turned: 0.0,
            },
            keep: Keep {
                layers: kept.layers,
                blend: kept.blend,
                cut: kept.cut,
                is_mean: false,
            },
            frames: kept.frames,
            is_sampled: kept.sampled,
        }
    }
}

/// Adds the measurement.
///
/// # Errors
/// It is there already.
pub fn register(registries: &mut Registries) -> Result<(), String> {
    registries.measurements.add(&Cones)
}

struct Cones;

impl Measurement for Cones {
    fn name(&self) -> &'static str {
        "cones"
    }

    fn plural(&self) -> &'static str {
        "pictures by cones"
    }

    fn figures(&self) -> &'static [Figure] {
        &FIGURES
    }

    fn declare(&self, catalogue: &mut Catalogue) {
        let entry = |name: &str, about: &str, schema| Entry {
            name: format!("{CONES}{name}"),
            description: about.to_owned(),
            schema,
        };
        catalogue[Axis::Integrator].extend([
            entry("primary", Primary::ABOUT, Primary::schema()),
            entry("reflected", Reflected::ABOUT, Reflected::schema()),
        ]);
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        let own = [Axis::Integrator, Axis::Kernels];
        let sampled = [&own[..], &[Axis::Sequence, Axis::Decorrelation]].concat();
        let cells = [(own.to_vec(), false), (sampled, true)].into_iter();
        let cells = cells.flat_map(|(axes, is_sampled)| {
            let cells = plan.benches_on(&axes).into_iter();
            cells.filter(move |cell| {
                Load::of(cell).is_some_and(|load| load.is_sampled == is_sampled)
            })
        });
        cells.collect()
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!("{:?} {:?}", experiment.run.seed, experiment.timing)
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        let Some(load) = Load::of(cell) else {
            return Work::kernels(0);
        };
        let pixels = load.view.side * load.view.side;
        // Rays on the host, of which a processor traces about a million a second.
        let rays = if load.is_sampled {
            REPLICATES * 2 * MOST
        } else {
            load.view.samples
        };
        let rays = rays + (load.frames - 1) * load.view.samples;
        let host = Work::other(1e-6 * f64::from(pixels) * f64::from(rays));
        if load.is_sampled {
            return host;
        }
        Work::kernels(2) + cost.timed(Work::rays(64 * pixels)) + host
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let mut worlds: Vec<Arc<World>> = Vec::new();
        Box::new(cells.iter().map(move |cell| {
            at.say(cell.to_string());
            let absent = || Absent::Failed("there are no such cones".to_owned());
            let load = Load::of(cell).ok_or_else(absent)?;
            contradiction(&load).map_or(Ok(()), |reason| Err(Absent::Refused(reason)))?;
            let frames = (0..load.frames).map(|frame| {
                let turned = f64::from(frame) / f64::from(load.frames);
                let view = View {
                    turned,
                    ..load.view
                };
                if let Some(world) = worlds.iter().find(|world| world.view == view) {
                    return Arc::clone(world);
                }
                let world = Arc::new(World::new(view, u64::from(at.experiment.run.seed)));
                worlds.push(Arc::clone(&world));
                world
            });
            let frames: Vec<Arc<World>> = frames.collect();
            Ok(Box::new(Ready::new(at, cell, &load, &frames)?) as Box<dyn Prepared>)
        }))
    }
}

/// Why parameters contradict each other; the reason says what to change.
fn contradiction(load: &Load) -> Option<String> {
    let reason = if load.view.resolution < load.view.side {
        "`resolution` is that of the whole picture: give at least `side`"
    } else if load.keep.is_mean && load.view.mirror != Some(Mirror::Sphere) {
        "off a plane a cone is as wide in both directions: leave `footprint` out"
    } else if load.keep.blend == Blend::Lobe && load.view.mirror.is_none() {
        "from the eye a cone has no lobe: leave `blend = \"lobe\"` out"
    } else if load.keep.blend == Blend::Level && load.keep.cut > 0.0 {
        "with `blend = \"level\"` a cone has its axis only, and nothing is cut: leave `cut` out"
    } else {
        return None;
    };
    Some(reason.to_owned())
}

/// The sampler of a cell, for each power of two where its points depend on their number.
fn samplers(at: &At, cell: &Cell, side: u32) -> Result<Vec<Sampler>, Absent> {
    let pair = cell.get(Axis::Sequence).zip(cell.get(Axis::Decorrelation));
    let missing = || {
        Absent::Refused(
            "errors of samplers need `axes.sequence`: give one, or `sampled = false`".to_owned(),
        )
    };
    let (sequence, decorrelation) = pair.ok_or_else(missing)?;
    let of = |samples: u32| {
        let demand = Demand {
            samples: Some(samples),
            dimensions: DIMENSIONS,
            width: Some(side),
        };
        let registry = &at.registries.samplers;
        let sampler = registry.sampler(sequence, decorrelation, &demand);
        sampler.map_err(|error| Absent::Refused(error.to_string()))
    };
    let last = of(MOST)?;
    if last.by_count() {
        return (0..POWERS).map(|k| of(1 << k)).collect();
    }
    Ok(vec![last])
}

/// A picture by cones that was checked, and what is known beside it.
struct Ready {
    picture: Arc<Traced>,
    world: Arc<World>,
    /// Mean square of the cone's error, and that at silhouettes.
    floor: f64,
    edge_floor: f64,
    /// Variance over frames of the error of the cone, or of the sampler.
    shimmer: Option<f64>,
    /// Mean squares of a sampler's errors, and of its adaptive and even pictures.
    errors: Option<Errors>,
    area: Option<f64>,
    tracer: Option<Tracer>,
}

struct Errors {
    powers: Vec<f64>,
    /// At silhouettes.
    edges: Vec<f64>,
    /// Over that with as many samples everywhere.
    adaptive: Option<f64>,
}

impl Ready {
    fn new(at: &At, cell: &Cell, load: &Load, frames: &[Arc<World>]) -> Result<Self, Absent> {
        let gpu = at.gpu(cell)?;
        let world = &frames[0];
        let picture = world.picture(gpu, &load.keep)?;
        let colours = picture.colours();
        let mut ready = Self {
            picture,
            world: Arc::clone(world),
            floor: world.truth.error(&colours),
            edge_floor: world
                .truth
                .error_where(&colours, |pixel| world.edges[pixel]),
            shimmer: None,
            errors: None,
            area: None,
            tracer: None,
        };
        if load.is_sampled {
            let samplers = samplers(at, cell, load.view.side)?;
            let seed = at.experiment.run.seed;
            ready.errors = Some(Errors::new(world, &samplers, seed));
            ready.shimmer = shimmer_of(frames, |world| {
                let all = sampled(&world.lens(), &samplers, world.pixels(), seed, None);
                Ok(all.powers[SPENT.trailing_zeros() as usize].clone())
            })?;
        } else {
            ready.shimmer = shimmer_of(frames, |world| {
                Ok(world.picture(gpu, &load.keep)?.colours())
            })?;
            ready.area = Some(area_off(gpu, at.experiment.run.seed)?);
            ready.tracer = Some(world.tracer(gpu, &load.keep)?);
        }
        Ok(ready)
    }

    /// Whether the reference knows the cone's error: it exceeds what is left of the reference's own.
    fn is_resolved(&self) -> bool {
        self.floor > 0.1 * self.world.truth.noise()
    }

    /// The same of silhouettes, if there are any.
    fn is_resolved_at_edges(&self) -> bool {
        self.edge_floor
            > 0.1
                * self
                    .world
                    .truth
                    .noise_where(|pixel| self.world.edges[pixel])
    }
}

/// The variance of errors over frames, if there are several.
fn shimmer_of(
    frames: &[Arc<World>],
    picture: impl Fn(&World) -> Result<Vec<DVec3>, Absent>,
) -> Result<Option<f64>, Absent> {
    if frames.len() < 2 {
        return Ok(None);
    }
    let pictures = frames.iter();
    let pictures = pictures.map(|world| Ok((&world.truth, picture(world)?)));
    let pictures: Vec<_> = pictures.collect::<Result<_, Absent>>()?;
    Ok(Some(shimmer(&pictures)))
}

/// What the device is off quadrature in overlaps of random triangles, where it also has to know the first of equally near ones.
fn area_off(gpu: &Gpu, seed: u32) -> Result<f64, Absent> {
    if let Some(fault) = fault_of_ties(gpu)? {
        return Err(Absent::Failed(fault));
    }
    let triangles = check::triangles(CHECKED, seed.into());
    let found = overlaps(gpu, &triangles)?;
    let is_exact = probe_arithmetic(gpu)?.is_exact();
    check::overlaps(&triangles, &found, is_exact).map_err(Absent::Failed)
}

impl Errors {
    fn new(world: &World, samplers: &[Sampler], seed: u32) -> Self {
        let lens = world.lens();
        let is_curved = world.view.mirror == Some(Mirror::Sphere);
        let budget = is_curved.then(|| budget(&world.magnified(), SPENT));
        let is_random = samplers.iter().all(Sampler::is_random);
        let replicates = if is_random { REPLICATES } else { 1 };
        let mut powers = vec![0.0; POWERS];
        let mut edges = vec![0.0; POWERS];
        let mut adaptive = None;
        for replicate in 0..replicates {
            let seed = seed.wrapping_add(replicate);
            let all = sampled(&lens, samplers, world.pixels(), seed, budget.as_deref());
            for (k, picture) in all.powers.iter().enumerate() {
                let at_edges = world.truth.error_where(picture, |pixel| world.edges[pixel]);
                powers[k] += world.truth.error(picture) / f64::from(replicates);
                edges[k] += at_edges / f64::from(replicates);
            }
            if let Some(picture) = &all.adaptive {
                let error = world.truth.error(picture) / f64::from(replicates);
                adaptive = Some(adaptive.unwrap_or(0.0) + error);
            }
        }
        let even = powers[SPENT.trailing_zeros() as usize];
        let ratio = adaptive.filter(|square| *square > 0.0 && even > 0.0);
        Self {
            adaptive: ratio.map(|square| (square / even).sqrt()),
            powers,
            edges,
        }
    }
}

/// How layers cover cones.
pub(crate) struct Covering {
    /// Layers, mean.
    pub(crate) mean: f64,
    /// The greatest number of 99 % of the cones.
    pub(crate) of_99: f64,
    /// Part that none covers, mean.
    pub(crate) open: f64,
}

/// The number of layers that a cone meets, and the part that those kept cover.
pub(crate) fn layers_of(pixel: &Found<f32>) -> (u32, f32) {
    (pixel.counts[0], pixel.covered)
}

/// Of each cone the number of layers, and the part that they cover.
pub(crate) fn covering(mut cones: Vec<(u32, f32)>) -> Covering {
    cones.sort_unstable_by_key(|cone| cone.0);
    let count = cones.len() as f64;
    let place = (0.99 * count).ceil() as usize;
    let mean = |of: fn(&(u32, f32)) -> f64| cones.iter().map(of).sum::<f64>() / count;
    Covering {
        mean: mean(|cone| cone.0.into()),
        of_99: cones
            .get(place.saturating_sub(1))
            .map_or(0.0, |cone| cone.0.into()),
        open: mean(|cone| 1.0 - f64::from(cone.1)),
    }
}

impl Measured for Ready {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        match &self.tracer {
            Some(tracer) => Ok(tracer.trace()?.1),
            None => Ok(Elapsed::default()),
        }
    }
}

/// The root of a mean square, which may be no positive number where the reference cannot tell it from 0.
fn root(square: f64) -> Option<f64> {
    (square > 0.0).then(|| square.sqrt())
}

impl Prepared for Ready {
    fn timed(&self) -> Vec<&dyn Measured> {
        match self.tracer {
            Some(_) => vec![self],
            None => Vec::new(),
        }
    }

    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let mut values = [None; FIGURES.len()];
        if self.is_resolved() {
            values[BIAS] = root(self.floor);
        }
        if self.is_resolved_at_edges() {
            values[EDGE_BIAS] = root(self.edge_floor);
        }
        values[SHIMMER] = self.shimmer.and_then(root);
        if let Some(errors) = &self.errors {
            for (value, square) in values.iter_mut().zip(&errors.powers) {
                *value = root(*square);
            }
            values[CROSSING] = match self.crossing(errors) {
                Some(Crossing::At(samples)) => Some(samples),
                _ => None,
            };
            values[EDGE_CROSSING] = match self.edge_crossing(errors) {
                Some(Crossing::At(samples)) => Some(samples),
                _ => None,
            };
            values[ADAPTIVE] = errors.adaptive;
        } else {
            let found = &self.picture.found;
            let of_cones = covering(found.iter().map(layers_of).collect());
            let edges = self.world.edges.iter().filter(|edge| **edge).count();
            values[EDGES] = Some(edges as f64 / found.len() as f64);
            values[LAYERS] = Some(of_cones.mean);
            values[LAYERS_99] = Some(of_cones.of_99);
            values[OPEN] = Some(of_cones.open);
            // Where something is open in every pixel, none was compared closely.
            let apart = self.picture.apart.colour;
            values[APART] = (apart > 0.0).then_some(apart);
            values[AREA] = self.area;
        }
        let mut readings = Reading::known(FIGURES.iter().zip(values));
        if let Some(samples) = samples.into_iter().next() {
            let pixels = f64::from(self.world.pixels());
            readings.push(samples.ns_per_item(&FIGURES[TIME], pixels)?);
        }
        Ok(readings)
    }

    fn notes(&self) -> Vec<Note> {
        let note = |what: &str, text: String| Note {
            at: Default::default(),
            what: what.to_owned(),
            text,
        };
        let mut notes = Vec::new();
        if !self.is_resolved() {
            notes.push(note(
                "bias",
                "the reference cannot tell the cone's error from 0: give more `samples`".to_owned(),
            ));
        }
        if let Some(errors) = &self.errors
            && self.crossing(errors) == Some(Crossing::Beyond)
        {
            notes.push(note(
                "crossing",
                format!("with {MOST} samples the sampler is not yet as good as the cone"),
            ));
        }
        notes
    }

    fn picture(&self) -> Option<Picture> {
        page_picture(&self.picture.colours(), &self.world)
    }
}

impl Ready {
    fn crossing(&self, errors: &Errors) -> Option<Crossing> {
        self.is_resolved()
            .then(|| crossing(&errors.powers, self.floor))
    }

    fn edge_crossing(&self, errors: &Errors) -> Option<Crossing> {
        self.is_resolved_at_edges()
            .then(|| crossing(&errors.edges, self.edge_floor))
    }
}

/// The picture by cones, that by rays, and what they differ, four times, about grey; `None` where they are no picture.
fn page_picture(cones: &[DVec3], world: &World) -> Option<Picture> {
    let side = world.view.side;
    let truth = world.truth.mean();
    let differ = |k: usize| (cones[k] - truth[k]) * 4.0 + 0.214;
    let wide = 3 * side * MAGNIFIED;
    let mut pixels = Vec::new();
    for row in 0..side * MAGNIFIED {
        for column in 0..wide {
            let (part, x) = (column / (side * MAGNIFIED), column % (side * MAGNIFIED));
            let k = (row / MAGNIFIED * side + x / MAGNIFIED) as usize;
            let colour = [cones[k], truth[k], differ(k)][part as usize];
            pixels.push(colour.max(DVec3::ZERO).as_vec3().to_array());
        }
    }
    let image = Image::new(wide, side * MAGNIFIED, pixels).ok()?;
    Some(tone_map(&image, 1.0))
}

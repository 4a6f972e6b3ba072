//! The reference that errors are taken against, while it is being accumulated.

use super::side::{Lens, Renderers};
use super::world::{Structure, World};
use raystone_bench::run::Registries;
use raystone_config::{Axis, Cell, Reference};
use raystone_core::clock::Instant;
use raystone_core::params::Variant;
use raystone_gpu::{Gpu, GpuError};
use raystone_image::Image;
use raystone_sampling::hash::pcg_hash;
use raystone_stats::metrics::{self, measure_those};

/// The metric that is free of the reference's own noise.
const METRIC: &str = "relmse-unbiased/eps=1e-2/v1";
/// What a person sees of the difference.
const FLIP: &str = "flip/tone-mapped/ppd=67/v1";
/// Share of the time that FLIP may take while images go on.
const FLIP_SHARE: f64 = 0.1;

/// Two halves of a reference with seeds of their own, so that its noise cancels in the error.
pub(crate) struct Accumulated<'g> {
    /// What it is made of, without the sampler.
    pub cell: Cell,
    pub settings: Reference,
    pub lens: Lens,
    halves: [Half<'g>; 2],
    structure: Structure,
}

struct Half<'g> {
    renderers: Renderers<'g>,
    seed: u32,
    done: u32,
    is_torn: bool,
}

/// The axes that an image's mean depends on: not the sampler, nor what leaves hits equal to the bit.
pub(crate) fn judged(cell: &Cell) -> Cell {
    let axes = [Axis::Scene, Axis::Triangle, Axis::BoxTest, Axis::Integrator];
    cell.on(&axes)
}

impl<'g> Accumulated<'g> {
    /// The reference of an image of this cell, through its structure.
    pub(crate) fn new(
        gpu: &'g Gpu,
        cell: &Cell,
        structure: Structure,
        settings: &Reference,
        lens: Lens,
    ) -> Self {
        // The sampler and the offset of references, as in runs.
        let offset = Axis::Offset.default_name().unwrap_or_default();
        let of_half = (cell.clone())
            .with(Axis::Sequence, &settings.sequence)
            .with(Axis::Decorrelation, &settings.decorrelation)
            .with(Axis::Offset, &Variant::plain(offset));
        let seed = pcg_hash(settings.seed);
        let half = |seed| Half {
            renderers: Renderers::new(gpu, of_half.clone()),
            seed,
            done: 0,
            is_torn: true,
        };
        Self {
            cell: judged(cell),
            settings: settings.clone(),
            lens: Lens {
                spp: (settings.spp / 2).max(1),
                ..lens
            },
            halves: [half(seed), half(seed.wrapping_add(1))],
            structure,
        }
    }

    /// Samples per pixel of both halves together.
    pub(crate) fn spp(&self) -> u32 {
        self.halves.iter().map(|half| half.done).sum()
    }

    pub(crate) fn is_finished(&self) -> bool {
        self.halves.iter().all(|half| half.done >= self.lens.spp)
    }

    /// Adds a sample to the half that has fewer; `false` if `stop` said so.
    pub(crate) async fn add(
        &mut self,
        (registries, world): (&Registries, &World),
        stop: &dyn Fn() -> bool,
    ) -> Result<bool, String> {
        let lens = self.lens;
        let is_behind = self.halves[1].done < self.halves[0].done;
        let half = &mut self.halves[usize::from(is_behind)];
        let with = (registries, world, &self.structure);
        let renderer = half.renderers.at(1, &lens, with)?;
        let text = |error: GpuError| error.to_string();
        if half.is_torn {
            renderer.look_async(lens.camera).await.map_err(text)?;
            (half.done, half.is_torn) = (0, false);
        }
        if !renderer
            .add_samples_until_async((half.done, 1), half.seed, stop)
            .await
            .map_err(text)?
        {
            half.is_torn = true;
            return Ok(false);
        }
        half.done += 1;
        Ok(true)
    }

    /// The images of both halves; `None` while one has no sample.
    pub(crate) async fn images(
        &mut self,
        with: (&Registries, &World),
    ) -> Result<Option<metrics::Reference>, String> {
        if self
            .halves
            .iter()
            .any(|half| half.done == 0 || half.is_torn)
        {
            return Ok(None);
        }
        let (lens, structure) = (self.lens, &self.structure);
        let mut images: Vec<Image> = Vec::new();
        for half in &mut self.halves {
            let renderer = half.renderers.at(1, &lens, (with.0, with.1, structure))?;
            images.push(renderer.image_async().await.map_err(|e| e.to_string())?);
        }
        let reference = metrics::Reference::from_parts(images);
        reference.map(Some).map_err(|e| e.to_string())
    }
}

/// relMSE of an image, free of the reference's own noise.
pub(crate) fn error_of(image: &Image, reference: &metrics::Reference) -> Option<f64> {
    measure(METRIC, image, reference)
}

fn measure(id: &str, image: &Image, reference: &metrics::Reference) -> Option<f64> {
    let report = measure_those(image, reference, |metric| metric.id == id);
    report.ok()?.metrics.get(id).copied()
}

/// FLIP of an image, with what it is of.
pub(crate) struct Flip {
    pub value: Option<f64>,
    /// Samples per pixel of the image, and when the reference was read.
    of: (u32, Instant),
    taken: Instant,
    took_s: f64,
}

impl Flip {
    pub(crate) fn new(image: &Image, reference: &metrics::Reference, of: (u32, Instant)) -> Self {
        let clock = Instant::now();
        Self {
            value: measure(FLIP, image, reference),
            of,
            took_s: clock.elapsed().as_secs_f64(),
            taken: Instant::now(),
        }
    }

    /// Whether it is of something else than what is shown, and enough time has passed, or nothing else will come.
    pub(crate) fn is_due(&self, of: (u32, Instant), is_last: bool) -> bool {
        let pause = self.took_s / FLIP_SHARE;
        self.of != of && (is_last || self.taken.elapsed().as_secs_f64() >= pause)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_metric_exists_and_tells_two_images_apart() {
        let image = |v: f32| Image::new(2, 1, vec![[v; 3]; 2]).unwrap();
        let reference = metrics::Reference::from_parts(vec![image(1.0), image(1.0)]).unwrap();
        assert_eq!(error_of(&image(1.0), &reference), Some(0.0));
        let error = error_of(&image(1.5), &reference).unwrap();
        assert!((error - 0.25 / 1.01).abs() < 1e-9, "{error}");
        let (first, second) = ((1, Instant::now()), (2, Instant::now()));
        let flip = |v: f32| Flip::new(&image(v), &reference, first);
        assert_eq!(flip(1.0).value, Some(0.0));
        assert!(flip(1.5).value > Some(0.01));
        let slow = Flip {
            took_s: 60.0,
            ..flip(1.0)
        };
        let due = [(first, true), (second, false), (second, true)];
        let due = due.map(|(of, is_last)| slow.is_due(of, is_last));
        assert_eq!(due, [false, false, true]);
    }
}

//! The passes that a change of input asks for, run in turn.

use super::bending;
use super::light::{Photon, photons};
use super::marched::{Counting, Marched, Through};
use super::{Grid, Mirror, Piloted, Pipeline, PipelineError, ViewRay};
use crate::adaptive::{Adaptive, Filter, Pilots, Smoother, importance};
use crate::photons::{Points, point_set};
use crate::scatter::{Adding, Strategy};
use crate::tracking::albedo;
use glam::Vec3;
use raystone_gpu::{Bindings, Elapsed, GpuError, Recording, Storage, UniformValues, groups_for};

impl Pipeline {
    /// Photons to the grid of radiance, after pilots where there are any; and to the smooth grid.
    pub(super) fn run_photons(
        &mut self,
        passes: &mut Vec<String>,
    ) -> Result<Elapsed, PipelineError> {
        let gpu = self.player.gpu().clone();
        let (points, pilots) = match self.adaptive {
            None => (self.points.clone(), None),
            Some(adaptive) => {
                let piloted = self.run_pilots(&adaptive, passes)?;
                let warped = |(point, density): &([f64; 2], f64)| {
                    let (at, times) = piloted.map.sent(adaptive.warp, *point);
                    (at, times * density)
                };
                (self.points.iter().map(warped).collect(), Some(piloted))
            }
        };
        let photons = self.photons_of(&points)?;
        let counting = if self.smoothing.filter.counts() {
            Counting::Weights
        } else {
            Counting::None
        };
        let adding = Adding {
            directed: self.is_directed(),
            ..self.adding
        };
        let through = Through {
            crosses: self.leaves_unread(),
            missed: (self.generality.missed && self.bending.is_none()).then_some(&points),
            ..self.through()
        };
        let marched = Marched::record(&gpu, through, adding, &photons, counting)?;
        let played = self.play(&marched.passes, passes)?;
        let tallies = marched.scatter.checked(marched.scatter.tallies(&played)?)?;
        let smooth = match self.smoothing.filter {
            Filter::None => None,
            _ => Some(self.run_smooth(&marched, passes)?),
        };
        self.grid = Some(Grid {
            marched,
            tallies,
            photons,
            smooth,
            pilots,
        });
        Ok(played.elapsed())
    }

    pub(super) fn through(&self) -> Through<'_> {
        Through {
            medium: &self.medium,
            bending: self.bending.as_ref(),
            general: self.generality.extinction,
            crosses: false,
            missed: None,
        }
    }

    fn photons_of(&self, points: &[([f64; 2], f64)]) -> Result<Vec<Photon>, PipelineError> {
        let found = photons((&self.volume, &self.medium), &self.source, points)?;
        if found.is_empty() {
            return Err(PipelineError::Dark(points.len()));
        }
        Ok(found)
    }

    /// Pilots to a coarse grid, and the map of importance that follows.
    fn run_pilots(
        &self,
        adaptive: &Adaptive,
        passes: &mut Vec<String>,
    ) -> Result<Piloted, PipelineError> {
        let points = point_set(Points::Jitter, adaptive.pilots, adaptive.seed);
        let points = points.map_err(PipelineError::Importance)?;
        let points: Vec<_> = points.into_iter().map(|point| (point, 1.0)).collect();
        let photons = self.photons_of(&points)?;
        let counting = Counting::Origins {
            cells: adaptive.cells,
            map: adaptive.pilots,
        };
        // Their grid is small, so that a strategy of few collisions would count for little.
        let adding = Adding::new(Strategy::Fixed64, 0);
        let gpu = self.player.gpu();
        let marched = Marched::record(gpu, self.through(), adding, &photons, counting)?;
        let played = self.play(&marched.passes, passes)?;
        let tallies = marched.scatter.checked(marched.scatter.tallies(&played)?)?;
        let radiance: Vec<[f32; 8]> = self.downloaded(&marched.scatter.radiance)?;
        let counts: Vec<[u32; 5]> = match &marched.counts {
            Some(counts) => self.downloaded(counts)?,
            None => Vec::new(),
        };
        let cell = |([count, x, y, xx, yy], sums): ([u32; 5], [f32; 8])| Pilots {
            count,
            sum: [x, y],
            squares: [xx, yy],
            radiance: sums[..3].iter().map(|v| f64::from(*v)).sum(),
        };
        let cells: Vec<Pilots> = counts.into_iter().zip(radiance).map(cell).collect();
        let map = importance(adaptive, &cells).map_err(PipelineError::Importance)?;
        Ok(Piloted {
            photons,
            deposits: tallies.deposits,
            cells,
            map,
            passes: marched.passes,
        })
    }

    /// The grid of radiance to a smooth one.
    fn run_smooth(
        &self,
        marched: &Marched,
        passes: &mut Vec<String>,
    ) -> Result<(Smoother, Recording), PipelineError> {
        let status = Storage::scratch("status", 64);
        let mut recording = Recording::new();
        recording.clear(&status);
        let smoother = Smoother::record(
            self.player.gpu(),
            &mut recording,
            self.medium.resolution,
            &self.smoothing,
            &marched.scatter.radiance,
            marched.counts.as_ref().map(|counts| (counts, marched.unit)),
        )?;
        recording.download("status", &status);
        self.play(&recording, passes)?;
        Ok((smoother, recording))
    }

    /// The grid of radiance to the image.
    pub(super) fn run_view(&mut self, passes: &mut Vec<String>) -> Result<Elapsed, PipelineError> {
        let gpu = self.player.gpu().clone();
        let Some(grid) = &self.grid else {
            return Err(PipelineError::Dark(self.points.len()));
        };
        let rays: Vec<[[f32; 4]; 3]> = self.view.iter().flatten().copied().collect();
        let count = rays.len() as u32;
        if rays.is_empty() {
            self.image = vec![Vec3::ZERO; self.view.len()];
            self.view_steps = 0;
            return Ok(Elapsed::default());
        }
        let values = UniformValues::new()
            .u32("count", count)
            .f32("albedo", albedo(&self.volume)?)
            .u32("phase_kind", self.volume.phase.kind)
            .f32("anisotropy", self.volume.phase.anisotropy)
            .f32(
                "density",
                self.medium.size_of_voxel().element_product().recip() as f32,
            );
        let [image, status] = [("image", u64::from(count) * 16), ("status", 64)]
            .map(|(name, bytes)| Storage::scratch(name, bytes));
        let mut bindings: Bindings = crate::upload::bindings(&self.medium, &gpu)?;
        bindings
            .uniform("gather", values)
            .buffer("rays", &gpu.storage("rays", &rays)?)
            .buffer("radiance", grid.gathered())
            .buffer("image", &image)
            .buffer("status", &status);
        let is_mirrored = self.mirror.is_some() || self.generality.mirror;
        if let Some(bending) = &self.bending {
            bending.bind(&gpu, &mut bindings)?;
            self.mirror.unwrap_or(Mirror::NONE).bind(&mut bindings);
        }
        let kernel = bending::kernel("gather", self.bending.as_ref())
            .with("structure", self.medium.structure.module())
            .feature("general", self.generality.extinction)
            .feature("mirror", is_mirrored && self.bending.is_some())
            .feature("step_empty", self.generality.empty);
        let mut recording = Recording::new();
        recording
            .clear(&status)
            .run(
                "gather",
                &gpu.pipeline(&kernel, true)?,
                &bindings,
                groups_for(count),
            )
            .download("image", &image)
            .download("status", &status);
        let played = self.play(&recording, passes)?;
        let found: Vec<[f32; 4]> = played.download("image")?;
        self.view_steps = found.iter().map(|[.., steps]| *steps as u64).sum();
        let mut found = found.into_iter();
        let pixel = |ray: &ViewRay| match ray {
            // A ray beside the medium sees nothing.
            None => Vec3::ZERO,
            Some(_) => found
                .next()
                .map_or(Vec3::ZERO, |[r, g, b, _]| Vec3::new(r, g, b)),
        };
        self.image = self.view.iter().map(pixel).collect();
        self.view_passes = recording;
        Ok(played.elapsed())
    }

    pub(super) fn play(
        &self,
        recording: &Recording,
        passes: &mut Vec<String>,
    ) -> Result<raystone_gpu::Played, GpuError> {
        let played = self.player.play(recording)?;
        self.player
            .gpu()
            .check_error_word(played.download::<u32>("status")?[0])?;
        passes.extend(played.runs.iter().map(|(name, _)| name.clone()));
        Ok(played)
    }
}

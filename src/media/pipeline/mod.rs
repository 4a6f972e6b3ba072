//! Light that is scattered once, by photons: marched by a structure, added to a grid of radiance, and gathered along the
//! rays of a view (the reference pipeline of Pfeuti 2009). Kernels: `kernels/media/photons.wesl`, `kernels/media/gather.wesl`
//! and those of [`crate::scatter`].

mod light;

pub use light::{Photon, Source, photons};

use crate::rays::SegmentRay;
use crate::scatter::{Adding, Scatter, ScatterError, Tallies};
use crate::tracking::{TrackingError, albedo};
use crate::{Bounds, Medium, Phase, Volume};
use glam::{DVec3, Vec3};
use raystone_gpu::{
    Bindings, Composition, Elapsed, Gpu, GpuError, Player, Recording, Storage, UniformValues,
    groups_for,
};

/// Reasons why photons give no image.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// A light that cannot send photons.
    #[error("{0}")]
    Light(String),
    /// Nothing of the light meets the medium.
    #[error("no photon of {0} meets the medium: turn the light towards it")]
    Dark(usize),
    /// The medium is not one that photons are scattered in here.
    #[error(transparent)]
    Medium(#[from] TrackingError),
    /// Energy cannot be added.
    #[error(transparent)]
    Scatter(#[from] ScatterError),
    /// A kernel does not run.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// The first pass that has to run again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Dirty {
    Photons,
    View,
    Nothing,
}

/// A ray of a view, where it meets the medium.
type ViewRay = Option<[[f32; 4]; 3]>;

/// What photons leave for the view.
struct Grid {
    scatter: Scatter,
    tallies: Tallies,
    photons: Vec<Photon>,
    passes: Recording,
}

/// The passes with what they leave for each other.
pub struct Pipeline {
    player: Player,
    volume: Volume,
    medium: Medium,
    adding: Adding,
    source: Source,
    points: Vec<([f64; 2], f64)>,
    view: Vec<ViewRay>,
    grid: Option<Grid>,
    view_passes: Recording,
    image: Vec<Vec3>,
    dirty: Dirty,
}

/// An image, and what it took.
#[derive(Debug, Clone)]
pub struct Rendered {
    /// Radiance in red, green and blue for each ray of the view.
    pub image: Vec<Vec3>,
    /// Names of the passes that ran, in order.
    pub passes: Vec<String>,
    /// What was counted when photons last ran.
    pub tallies: Tallies,
    /// Time of the passes that ran, as (photons to grid, view).
    pub elapsed: [Option<Elapsed>; 2],
}

impl Pipeline {
    /// Photons of a light through a medium, from points of the unit square with their densities; no view yet.
    ///
    /// # Errors
    /// The volume is bounded by a sphere or has no albedo of its own.
    pub fn new(
        gpu: &Gpu,
        (volume, medium): (&Volume, &Medium),
        adding: Adding,
        source: Source,
        points: Vec<([f64; 2], f64)>,
    ) -> Result<Self, PipelineError> {
        fits(volume)?;
        Ok(Self {
            player: Player::new(gpu),
            volume: volume.clone(),
            medium: medium.clone(),
            adding,
            source,
            points,
            view: Vec::new(),
            grid: None,
            view_passes: Recording::new(),
            image: Vec::new(),
            dirty: Dirty::Photons,
        })
    }

    /// Another light: photons run again.
    pub fn set_source(&mut self, source: Source) {
        self.source = source;
        self.touch(Dirty::Photons);
    }

    /// Other points of the light's square: photons run again.
    pub fn set_points(&mut self, points: Vec<([f64; 2], f64)>) {
        self.points = points;
        self.touch(Dirty::Photons);
    }

    /// Another medium, in which photons run again; rays of the view are those of the old box, so it needs a new one.
    ///
    /// # Errors
    /// As [`Pipeline::new`].
    pub fn set_medium(&mut self, volume: &Volume, medium: &Medium) -> Result<(), PipelineError> {
        fits(volume)?;
        (self.volume, self.medium) = (volume.clone(), medium.clone());
        self.view.clear();
        self.touch(Dirty::Photons);
        Ok(())
    }

    /// Another phase function: photons do not turn, so that the view alone runs again.
    pub fn set_phase(&mut self, phase: Phase) {
        self.volume.phase = phase;
        self.touch(Dirty::View);
    }

    /// Rays of a view: origins and directions of length 1.
    pub fn set_view(&mut self, rays: &[(DVec3, DVec3)]) {
        let words = |(origin, direction): &(DVec3, DVec3)| -> ViewRay {
            let of = SegmentRay::new(&self.volume, &self.medium, *origin, *direction)?;
            let vector = |v: Vec3, last: f32| [v.x, v.y, v.z, last];
            Some([
                vector(of.ray.origin, of.to),
                vector(of.ray.direction, 0.0),
                vector(direction.as_vec3(), 0.0),
            ])
        };
        self.view = rays.iter().map(words).collect();
        self.touch(Dirty::View);
    }

    fn touch(&mut self, dirty: Dirty) {
        self.dirty = self.dirty.min(dirty);
    }

    /// The photons of the last image that ran them.
    pub fn photons(&self) -> &[Photon] {
        self.grid.as_ref().map_or(&[], |grid| &grid.photons)
    }

    /// The grid of radiance: six sums for each voxel, as [`crate::scatter::scatter_list`] returns them.
    ///
    /// # Errors
    /// The device fails.
    pub fn radiance(&self) -> Result<Vec<[f32; 6]>, PipelineError> {
        let Some(grid) = &self.grid else {
            return Ok(Vec::new());
        };
        let mut recording = Recording::new();
        recording.download("radiance", &grid.scatter.radiance);
        let played = self.player.play(&recording)?;
        let words = played.download::<[f32; 8]>("radiance")?;
        let sums = words
            .iter()
            .take(self.medium.field.len())
            .map(|[r, g, b, _, x, y, z, _]| [*r, *g, *b, *x, *y, *z]);
        Ok(sums.collect())
    }

    /// Bytes of what photons write to and what is made of it, without the grid of sums.
    pub fn bytes(&self) -> u64 {
        self.grid.as_ref().map_or(0, |grid| grid.scatter.bytes())
    }

    /// Runs the passes whose input changed, and returns the image.
    ///
    /// # Errors
    /// The light sends no photon into the medium, sums went round or a list was too short, or the device fails.
    pub fn render(&mut self) -> Result<Rendered, PipelineError> {
        let mut passes = Vec::new();
        let mut elapsed = [None; 2];
        if self.dirty <= Dirty::Photons {
            elapsed[0] = Some(self.run_photons(&mut passes)?);
        }
        if self.dirty <= Dirty::View {
            elapsed[1] = Some(self.run_view(&mut passes)?);
        }
        self.dirty = Dirty::Nothing;
        Ok(Rendered {
            image: self.image.clone(),
            passes,
            tallies: self
                .grid
                .as_ref()
                .map_or_else(Tallies::default, |grid| grid.tallies),
            elapsed,
        })
    }

    /// Plays the passes of photons once more, or those of the view, for their time alone.
    ///
    /// # Errors
    /// The device fails.
    pub fn replay(&self, view: bool) -> Result<Elapsed, GpuError> {
        let passes = match &self.grid {
            Some(grid) if !view => &grid.passes,
            _ => &self.view_passes,
        };
        Ok(self.play(passes, &mut Vec::new())?.elapsed())
    }

    /// Photons to the grid of radiance.
    fn run_photons(&mut self, passes: &mut Vec<String>) -> Result<Elapsed, PipelineError> {
        let gpu = self.player.gpu().clone();
        let photons = photons((&self.volume, &self.medium), &self.source, &self.points)?;
        let brightest = photons.iter().map(|p| p.energy.max_element());
        let brightest = brightest.fold(0.0, f32::max);
        if photons.is_empty() || brightest <= 0.0 {
            return Err(PipelineError::Dark(self.points.len()));
        }
        // No way through a voxel is longer than its diagonal; rounding may make it a little so.
        let longest = self.medium.size_of_voxel().length() * 1.001;
        let cells = self.medium.field.len() as u32;
        let scatter = Scatter::new(&gpu, self.adding, cells, brightest * longest as f32)?;
        let words: Vec<_> = photons.iter().map(Photon::words).collect();
        let status = Storage::scratch("status", 64);
        let mut bindings = self.medium.bindings(&gpu)?;
        scatter.bind(&mut bindings);
        let count = photons.len() as u32;
        bindings
            .uniform("photons", UniformValues::new().u32("count", count))
            .buffer("list", &gpu.storage("photons", &words)?)
            .buffer("status", &status);
        let kernel =
            Composition::new("media/photons").with("structure", self.medium.structure.module());
        let pipeline = gpu.pipeline(&scatter.compose(kernel), true)?;
        let mut recording = Recording::new();
        recording.clear(&status);
        scatter.record_before(&mut recording);
        recording.run("photons", &pipeline, &bindings, groups_for(count));
        scatter.record_after(&mut recording);
        recording.download("status", &status);
        let played = self.play(&recording, passes)?;
        let tallies = scatter.checked(scatter.tallies(&played)?)?;
        self.grid = Some(Grid {
            scatter,
            tallies,
            photons,
            passes: recording,
        });
        Ok(played.elapsed())
    }

    /// The grid of radiance to the image.
    fn run_view(&mut self, passes: &mut Vec<String>) -> Result<Elapsed, PipelineError> {
        let gpu = self.player.gpu().clone();
        let Some(Grid { scatter, .. }) = &self.grid else {
            return Err(PipelineError::Dark(self.points.len()));
        };
        let rays: Vec<[[f32; 4]; 3]> = self.view.iter().flatten().copied().collect();
        let count = rays.len() as u32;
        if rays.is_empty() {
            self.image = vec![Vec3::ZERO; self.view.len()];
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
        let mut bindings: Bindings = self.medium.bindings(&gpu)?;
        bindings
            .uniform("gather", values)
            .buffer("rays", &gpu.storage("rays", &rays)?)
            .buffer("radiance", &scatter.radiance)
            .buffer("image", &image)
            .buffer("status", &status);
        let kernel =
            Composition::new("media/gather").with("structure", self.medium.structure.module());
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
        let mut found = played.download::<[f32; 4]>("image")?.into_iter();
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

    fn play(
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

fn fits(volume: &Volume) -> Result<(), TrackingError> {
    if volume.bounds != Bounds::Box {
        return Err(TrackingError::Unfit("fills its box"));
    }
    albedo(volume).map(|_| ())
}

/// Rays of a pinhole camera of `side`² pixels at a position, which looks at a point with this tangent of half its angle;
/// x fastest, from the upper left.
pub fn camera(position: DVec3, at: DVec3, tangent: f64, side: u32) -> Vec<(DVec3, DVec3)> {
    let forward = (at - position).normalize();
    let up = if forward.y.abs() > 0.99 {
        DVec3::X
    } else {
        DVec3::Y
    };
    let right = forward.cross(up).normalize();
    let up = right.cross(forward);
    let ray = |pixel: u32| {
        let [x, y] = [pixel % side, pixel / side]
            .map(|c| (2.0 * (f64::from(c) + 0.5) / f64::from(side) - 1.0) * tangent);
        (position, (forward + right * x - up * y).normalize())
    };
    (0..side * side).map(ray).collect()
}

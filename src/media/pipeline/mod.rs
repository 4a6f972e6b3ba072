//! Light that is scattered once, by photons: marched by a structure, added to a grid of radiance, and gathered along the
//! rays of a view (the reference pipeline of Pfeuti 2009). Kernels: `kernels/media/photons.wesl`, `kernels/media/gather.wesl`,
//! those of `kernels/media/curved/` where an index bends light, and those of [`crate::scatter`].

mod bending;
mod left;
mod light;
mod marched;
pub(crate) mod oracle;
mod passes;
pub(crate) mod ways;

pub use bending::Mirror;
pub use light::{Photon, Source, photons};

use crate::adaptive::{Adaptive, Filter, Pilots, Smoother, Smoothing};
use crate::photons::ImportanceMap;
use crate::rays::SegmentRay;
use crate::scatter::{Adding, ScatterError, Tallies};
use crate::tracking::{TrackingError, albedo};
use crate::{Bounds, Medium, Phase, Volume, phase};
use bending::Bending;
use glam::{DVec3, Vec3};
use marched::Marched;
use raystone_gpu::{Elapsed, Gpu, GpuError, Player, Recording, Storage};

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
    /// A medium that bends light has voxels that are no cubes.
    #[error(
        "voxels of a refractive medium have to be cubes, and these are {0}: give its box sides like its resolution"
    )]
    Voxels(DVec3),
    /// A number of the map of importance is not allowed.
    #[error("{0}")]
    Importance(String),
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
    marched: Marched,
    tallies: Tallies,
    photons: Vec<Photon>,
    /// The smooth grid with its passes, if there is one.
    smooth: Option<(Smoother, Recording)>,
    /// Of an adaptive pipeline.
    pilots: Option<Piloted>,
}

/// What pilots leave for photons.
struct Piloted {
    photons: Vec<Photon>,
    deposits: u64,
    cells: Vec<Pilots>,
    map: ImportanceMap,
    passes: Recording,
}

impl Grid {
    /// What the view gathers.
    fn gathered(&self) -> &Storage {
        match &self.smooth {
            Some((smoother, _)) => &smoother.smoothed,
            None => &self.marched.scatter.radiance,
        }
    }
}

/// What is done though the medium does not ask for it: what generality costs. By default nothing of it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Generality {
    /// σ is read where it is known to be the same.
    pub extinction: bool,
    /// Ways are those of a medium that bends light.
    pub curves: bool,
    /// Rays of the view step through voxels in which nothing scatters, and do not cross regions of them at once.
    pub empty: bool,
    /// Photons that miss the medium are in the list as well, where ways are straight.
    pub missed: bool,
    /// Photons leave energy in voxels that no view reads, too, where ways are straight and nothing is smoothed: those from which, and from
    /// whose neighbours, nothing is scattered.
    pub unread: bool,
    /// The view looks for a mirror where there is none, where ways are curved.
    pub mirror: bool,
    /// Directions of light are summed where the phase function is isotropic, and so does not ask for them.
    pub directions: bool,
}

/// Passes that can be timed on their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Pilots to their grid.
    Pilots,
    /// Photons to the grid of radiance.
    Photons,
    /// That to a smooth one.
    Smooth,
    /// The grid to the image.
    View,
    /// All of them, one after the other.
    All,
}

/// The passes with what they leave for each other.
// Many fields: what the passes read, and what each leaves until something before it changes.
pub struct Pipeline {
    player: Player,
    volume: Volume,
    medium: Medium,
    bending: Option<Bending>,
    adding: Adding,
    source: Source,
    points: Vec<([f64; 2], f64)>,
    adaptive: Option<Adaptive>,
    smoothing: Smoothing,
    generality: Generality,
    mirror: Option<Mirror>,
    view: Vec<ViewRay>,
    grid: Option<Grid>,
    view_passes: Recording,
    image: Vec<Vec3>,
    /// Steps of all rays of the view.
    view_steps: u64,
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
    /// Photons of a light through a medium, from points of the unit square with their densities; no view yet. Where the index
    /// of the volume is not the same everywhere, photons and rays of the view are refracted.
    ///
    /// # Errors
    /// The volume is bounded by a sphere or has no albedo of its own, or it is refractive and its voxels are no cubes.
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
            bending: Bending::of(volume, medium, false)?,
            adding,
            source,
            points,
            adaptive: None,
            smoothing: Smoothing::default(),
            generality: Generality {
                directions: true,
                unread: true,
                ..Generality::default()
            },
            mirror: None,
            view: Vec::new(),
            grid: None,
            view_passes: Recording::new(),
            image: Vec::new(),
            view_steps: 0,
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

    /// Points by a map of importance from pilots, or as they are: photons run again.
    pub fn set_adaptive(&mut self, adaptive: Option<Adaptive>) {
        self.adaptive = adaptive;
        self.touch(Dirty::Photons);
    }

    /// Another way to smooth the grid of radiance: photons run again, since some count what crosses a voxel.
    pub fn set_smoothing(&mut self, smoothing: Smoothing) {
        self.smoothing = smoothing;
        self.touch(Dirty::Photons);
    }

    /// What is done though the medium does not ask for it. Photons run again. Before, directions are summed whatever the phase function
    /// is, so that another one needs the view alone, and all voxels have their sums.
    ///
    /// # Errors
    /// Ways are to be curved, and voxels are no cubes.
    pub fn set_generality(&mut self, generality: Generality) -> Result<(), PipelineError> {
        self.bending = Bending::of(&self.volume, &self.medium, generality.curves)?;
        self.generality = generality;
        self.touch(Dirty::Photons);
        Ok(())
    }

    /// Whether photons leave directions, which a phase function that is not isotropic asks for.
    pub fn is_directed(&self) -> bool {
        self.generality.directions || self.volume.phase.kind != phase::ISOTROPIC
    }

    /// Whether voxels that no view reads may lack their sums.
    pub fn leaves_unread(&self) -> bool {
        let straight = self.bending.is_none() && self.smoothing.filter == Filter::None;
        straight && !self.generality.unread
    }

    /// Another medium, in which photons run again; rays of the view are those of the old box, so it needs a new one.
    ///
    /// # Errors
    /// As [`Pipeline::new`].
    pub fn set_medium(&mut self, volume: &Volume, medium: &Medium) -> Result<(), PipelineError> {
        fits(volume)?;
        self.bending = Bending::of(volume, medium, self.generality.curves)?;
        (self.volume, self.medium) = (volume.clone(), medium.clone());
        self.view.clear();
        self.touch(Dirty::Photons);
        Ok(())
    }

    /// Another phase function: photons do not turn, so that the view alone runs again, unless it asks for directions that
    /// were left out.
    pub fn set_phase(&mut self, phase: Phase) {
        let was_directed = self.is_directed();
        self.volume.phase = phase;
        self.touch(if self.is_directed() && !was_directed {
            Dirty::Photons
        } else {
            Dirty::View
        });
    }

    /// A mirror in a medium that bends light: the view runs again. In others there is none.
    pub fn set_mirror(&mut self, mirror: Option<Mirror>) {
        self.mirror = mirror;
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

    /// Forgets that something changed: a fault that tests plant.
    #[cfg(test)]
    pub(crate) fn forget(&mut self) {
        self.dirty = Dirty::Nothing;
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

    /// Plays passes once more, for their time alone.
    ///
    /// # Errors
    /// The device fails.
    pub fn replay(&self, part: Part) -> Result<Elapsed, GpuError> {
        let all = [Part::Pilots, Part::Photons, Part::Smooth, Part::View];
        let mut sum = Elapsed::default();
        for (place, part) in all
            .into_iter()
            .filter(|one| part == *one || part == Part::All)
            .filter_map(|part| self.passes_of(part))
            .enumerate()
        {
            let elapsed = self.play(part, &mut Vec::new())?.elapsed();
            if place == 0 {
                sum = elapsed;
            } else {
                sum += elapsed;
            }
        }
        Ok(sum)
    }

    /// The passes of one kind, if they are there.
    fn passes_of(&self, part: Part) -> Option<&Recording> {
        let grid = self.grid.as_ref()?;
        match part {
            Part::Photons => Some(&grid.marched.passes),
            Part::Pilots => grid.pilots.as_ref().map(|pilots| &pilots.passes),
            Part::Smooth => grid.smooth.as_ref().map(|(_, passes)| passes),
            Part::View => Some(&self.view_passes),
            Part::All => None,
        }
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

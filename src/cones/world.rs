//! What cells are measured on: a scene with an eye and a mirror, the picture that distributed rays converge to, and
//! pictures by cones that were checked.

use crate::check::{self, Apart};
use crate::cone::{Camera, Mirror, cone_of};
use crate::device::Tracer;
use crate::oracle::Oracle;
use crate::rays::{Lens, Rays};
use crate::sample::{Truth, silhouettes};
use crate::scene::{BACKGROUND, Patch, Place, patches};
use crate::trace::{Blend, DIRECTIONS, Found, Given};
#[cfg(test)]
use crate::{lobe::lobe_table, scene::tile_levels, trace::Tracing};
use glam::DVec3;
use rayon::prelude::*;
use raystone_bench::run::Absent;
use raystone_gpu::Gpu;
use raystone_specular::real::V3;
use std::f64::consts::PI;
use std::sync::{Arc, Mutex, PoisonError};

/// The eye, which looks at the origin.
const EYE: DVec3 = DVec3::new(4.0, 0.0, 0.3);
/// Angles that the picture spans, in degrees: that of a scene, and that of a mirror which fills it.
const WIDE: f64 = 45.0;
const NARROW: f64 = 29.5;

/// What is seen, by cones or by rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct View {
    pub(crate) place: Place,
    pub(crate) mirror: Option<Mirror>,
    /// Half-angle of the mirror's lobe in radians.
    pub(crate) gloss: f64,
    /// Cones along each side, and pixels along each side of the picture from which they are taken.
    pub(crate) side: u32,
    pub(crate) resolution: u32,
    /// Samples of the reference.
    pub(crate) samples: u32,
    /// How far the eye is turned to the right, in pixels of the whole picture.
    pub(crate) turned: f64,
}

/// What is kept of a cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Keep {
    pub(crate) layers: u32,
    pub(crate) blend: Blend,
    pub(crate) cut: f64,
    pub(crate) is_mean: bool,
}

impl View {
    /// The camera, its numbers rounded to f32, so that both kinds have the same.
    fn camera(&self, is_mean: bool) -> Camera<f32> {
        let degrees = match self.mirror {
            Some(Mirror::Sphere) => NARROW,
            _ => WIDE,
        };
        let half = 0.5 * f64::from(self.resolution);
        let distance = half / (0.5 * degrees.to_radians()).tan();
        let ahead = -EYE.normalize();
        let aside = ahead.cross(DVec3::Z).normalize();
        let (sine, cosine) = (self.turned / distance).atan().sin_cos();
        let [forward, right] = [ahead * cosine + aside * sine, aside * cosine - ahead * sine];
        Camera {
            eye: V3::of(EYE),
            right: V3::of(right),
            up: V3::of(right.cross(forward)),
            forward: V3::of(forward),
            distance: distance as f32,
            stride: (f64::from(self.resolution) / f64::from(self.side)) as f32,
            side: self.side,
            mirror: self.mirror.map_or(0, Mirror::word),
            gloss: self.gloss.tan() as f32,
            is_mean,
        }
    }
}

/// The same camera in f64.
pub(crate) fn double(camera: &Camera<f32>) -> Camera<f64> {
    let vector = |v: V3<f32>| V3::of(v.f64());
    Camera {
        eye: vector(camera.eye),
        right: vector(camera.right),
        up: vector(camera.up),
        forward: vector(camera.forward),
        distance: camera.distance.into(),
        stride: camera.stride.into(),
        side: camera.side,
        mirror: camera.mirror,
        gloss: camera.gloss.into(),
        is_mean: camera.is_mean,
    }
}

/// Directions of masks, evenly in the unit disk (Vogel 1979).
pub(crate) fn directions() -> Vec<[f32; 2]> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let each = (0..DIRECTIONS).map(|k| {
        let radius = ((f64::from(k) + 0.5) / f64::from(DIRECTIONS)).sqrt();
        let (sine, cosine) = (golden * f64::from(k)).sin_cos();
        [(radius * cosine) as f32, (radius * sine) as f32]
    });
    each.collect()
}

/// A picture by cones that agrees with the oracle.
#[derive(Clone)]
pub(crate) struct Picture {
    pub(crate) found: Vec<Found<f32>>,
    pub(crate) apart: Apart,
}

impl Picture {
    pub(crate) fn colours(&self) -> Vec<DVec3> {
        self.found.iter().map(|pixel| pixel.colour.f64()).collect()
    }
}

/// A view with all that its cells share.
pub(crate) struct World {
    pub(crate) view: View,
    pub(crate) patches: Vec<Patch<f32>>,
    rays: Rays,
    pub(crate) truth: Truth,
    /// Of each pixel, whether it is at a silhouette.
    pub(crate) edges: Vec<bool>,
    pictures: Mutex<Vec<(Keep, Arc<Picture>)>>,
}

impl World {
    pub(crate) fn new(view: View, seed: u64) -> Self {
        let patches = patches(view.place);
        let rays = Rays::new(&patches);
        let lens = Lens::new(double(&view.camera(false)), &rays);
        let truth = Truth::new(&lens, view.side * view.side, view.samples, seed);
        let edges = silhouettes(&lens, view.side * view.side);
        Self {
            view,
            patches,
            rays,
            truth,
            edges,
            pictures: Mutex::default(),
        }
    }

    pub(crate) fn pixels(&self) -> u32 {
        self.view.side * self.view.side
    }

    pub(crate) fn lens(&self) -> Lens<'_> {
        Lens::new(double(&self.view.camera(false)), &self.rays)
    }

    /// How much wider than the pixel's the cone of each pixel is.
    pub(crate) fn magnified(&self) -> Vec<f64> {
        let camera = double(&self.view.camera(false));
        let lens = self.lens();
        let each =
            (0..self.pixels()).map(|pixel| cone_of(&camera, pixel).tangent / lens.pixel(pixel).1);
        each.collect()
    }

    pub(crate) fn given(&self, keep: &Keep) -> Given<f32> {
        Given {
            camera: self.view.camera(keep.is_mean),
            background: V3::of(BACKGROUND),
            // An axis meets one.
            most: if keep.blend == Blend::Level {
                1
            } else {
                keep.layers
            },
            cut: keep.cut as f32,
            blend: keep.blend.word(),
        }
    }

    pub(crate) fn tracer(&self, gpu: &Gpu, keep: &Keep) -> Result<Tracer, Absent> {
        let given = self.given(keep);
        Ok(Tracer::new(gpu, &given, &self.patches, &directions())?)
    }

    /// What the twin finds.
    #[cfg(test)]
    pub(crate) fn by_twin(&self, keep: &Keep) -> Vec<Found<f32>> {
        let given = self.given(keep);
        let tracing = Tracing {
            given: &given,
            patches: &self.patches,
            directions: &directions(),
            texels: &tile_levels(),
            lobes: lobe_table(),
        };
        let each = (0..self.pixels()).into_par_iter();
        each.map(|pixel| tracing.trace_cone(pixel)).collect()
    }

    /// What the oracle expects.
    pub(crate) fn by_oracle(&self, keep: &Keep) -> Vec<crate::oracle::Expected> {
        self.of_oracle(keep, |oracle, pixel| oracle.pixel(pixel))
    }

    /// How many triangles may be cut with each cone, at least and at most.
    pub(crate) fn cut_by_oracle(&self, keep: &Keep) -> Vec<[u32; 2]> {
        self.of_oracle(keep, |oracle, pixel| oracle.cut(pixel))
    }

    /// What the oracle says of each pixel.
    fn of_oracle<T: Send>(&self, keep: &Keep, of: impl Fn(&Oracle, u32) -> T + Sync) -> Vec<T> {
        let own = self.given(keep);
        let given = Given {
            camera: double(&own.camera),
            background: V3::of(own.background.f64()),
            most: own.most,
            cut: f64::from(own.cut),
            blend: own.blend,
        };
        let patches: Vec<Patch<f64>> = self.patches.iter().map(Patch::double).collect();
        let directions: Vec<[f64; 2]> = directions().iter().map(|d| d.map(f64::from)).collect();
        let oracle = Oracle {
            given: &given,
            patches: &patches,
            directions: &directions,
            lens: self.lens(),
        };
        let each = (0..self.pixels()).into_par_iter();
        each.map(|pixel| of(&oracle, pixel)).collect()
    }

    /// The picture by cones, checked; cells share it.
    pub(crate) fn picture(&self, gpu: &Gpu, keep: &Keep) -> Result<Arc<Picture>, Absent> {
        let known = |all: &[(Keep, Arc<Picture>)]| {
            let same = all.iter().find(|(other, _)| other == keep);
            same.map(|(_, picture)| Arc::clone(picture))
        };
        let mut pictures = self.pictures.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(picture) = known(&pictures) {
            return Ok(picture);
        }
        let (found, _) = self.tracer(gpu, keep)?.trace()?;
        let most = self.given(keep).most;
        check::counted(&found, most, self.patches.len()).map_err(Absent::Failed)?;
        check::cut(&found, &self.cut_by_oracle(keep)).map_err(Absent::Failed)?;
        let apart = check::near(&found, &self.by_oracle(keep)).map_err(Absent::Failed)?;
        let picture = Arc::new(Picture { found, apart });
        pictures.push((*keep, Arc::clone(&picture)));
        Ok(picture)
    }
}

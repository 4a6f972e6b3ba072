//! A medium of a scene, in f64: from `docs/media.md`, "In the path tracer".
//!
//! Regions and their bounds are read from the structure, since numbers are drawn by them: many would be right. That they
//! hold is checked wherever the medium is read; a bound that does not makes the path no number, which no kernel gives.

use super::bsdf::{Bounce, Bsdf, Reflected, around};
use super::hits::Segment;
use super::rounding::Rounding;
use super::surface::Surface;
use super::{PathOracle, Vertex, Walk};
use glam::{DVec2, DVec3, IVec3, UVec3};
use raystone_sampling::to_unit;
use raystone_scene::SceneMedium;
use raystone_volume::medium::Region;
use raystone_volume::{Phase, Straight, Volume, phase};
use std::f64::consts::TAU;

// Purposes of numbers beside the sampler's.
pub(super) const FLIGHT: u32 = 0;
pub(super) const SURVIVAL: u32 = 1;
pub(super) const LAST_FLIGHT: u32 = 2;
pub(super) const TO_LIGHT: u32 = 3;

/// A medium's purposes are beyond 2 to this power times its number.
const PURPOSE_BITS: u32 = 28;

/// How far a region is entered before it is asked for, in voxels.
const WITHIN: f64 = 1e-9;

/// What halves keep of a share.
const OF_HALF: f64 = 1.0 / 1024.0;
const LEAST_HALF: f64 = 1.0 / 16384.0;

/// A volume with the structure whose regions kernels ask for.
pub(super) struct Medium<'a> {
    pub(super) volume: &'a Volume,
    pub(super) straight: Straight,
    /// σ_s and σ of each voxel, as kernels read them, per scene unit.
    field: Vec<DVec2>,
    /// What σ_s and σ_a of each channel are multiplied by.
    pub(super) tints: [DVec3; 2],
    /// Which of the scene's media it is.
    pub(super) number: u32,
}

/// Where a ray is scattered.
pub(super) struct Flight {
    pub(super) distance: f64,
    /// What it multiplies the throughput by.
    pub(super) albedo: DVec3,
    /// By which of the scene's media.
    pub(super) medium: u32,
}

/// What a ray meets in one medium.
#[derive(Default)]
pub(super) struct Alone {
    /// The first collision.
    pub(super) scattered: Option<Flight>,
    /// Where collisions before it were none, and what each multiplies the throughput by.
    pub(super) none: Vec<(f64, DVec3)>,
}

/// Numbers of a purpose at a vertex of a path: a hash of all that they depend on.
pub(super) struct Numbers {
    key: u32,
    drawn: u32,
}

/// The PCG permutation of a word (M. Jarzynski, M. Olano 2020).
fn permuted(x: u32) -> u32 {
    let state = x.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Number x of the progression of a key.
fn keyed(key: u32, x: u32) -> u32 {
    let stride = key.wrapping_mul(0x9e37_79b1) | 1;
    permuted(key.wrapping_add(x.wrapping_mul(stride)))
}

impl Numbers {
    /// For a purpose of one of the scene's media.
    pub(super) fn new(walk: &Walk, depth: u32, (purpose, medium): (u32, u32)) -> Self {
        let [x, y] = walk.id.pixel;
        let seed = permuted(walk.id.seed ^ 0x6d65_6469);
        let pixel = y * walk.view.size[0] + x;
        let of = [
            pixel,
            walk.id.sample,
            depth,
            purpose + (medium << PURPOSE_BITS),
        ];
        Self {
            key: of.into_iter().fold(seed, keyed),
            drawn: 0,
        }
    }

    pub(super) fn next(&mut self) -> f64 {
        self.drawn += 1;
        to_unit(keyed(self.key, self.drawn)).into()
    }
}

/// Mean free paths up to a collision. A device's logarithm errs absolutely near 1.
pub(super) fn depth_of(number: f64, rounding: &mut Rounding) -> f64 {
    let depth = -(1.0 - number).ln();
    let moved = rounding.number(depth) + 8.0 * rounding.share(0.0);
    moved.max(0.0)
}

impl<'a> Medium<'a> {
    /// The medium of this number, if what kernels read of it is what the scene has.
    pub(super) fn new(of: &'a SceneMedium, number: u32) -> Result<Self, String> {
        let volume = &of.volume;
        let straight = Straight::new(volume, &of.structure).map_err(|e| e.to_string())?;
        let density = f64::from(straight.density);
        let shares = straight.medium.field.iter().map(|word| {
            let halves = [*word & 0xffff, *word >> 16].map(half_value);
            DVec2::from(halves) * density
        });
        let field: Vec<DVec2> = shares.collect();
        for (place, found) in field.iter().enumerate() {
            let [scattered, absorbed] =
                [&volume.scattering, &volume.absorption].map(|grid| f64::from(grid[place]));
            let true_ones = DVec2::new(scattered, scattered + absorbed);
            let room = true_ones * OF_HALF + LEAST_HALF * density;
            if (*found - true_ones).abs().cmpgt(room).any() {
                return Err(format!(
                    "a medium whose voxel {place} scatters and takes away {true_ones}, and is read as {found}"
                ));
            }
        }
        Ok(Self {
            volume,
            straight,
            field,
            tints: of.tints.map(|tint| tint.as_dvec3()),
            number,
        })
    }

    /// σ_s and σ at a position in voxels, trilinearly between their middles.
    pub(super) fn at(&self, position: DVec3) -> DVec2 {
        let size = UVec3::from(self.volume.resolution).as_ivec3();
        let low = (position - 0.5).floor();
        let share = position - 0.5 - low;
        let mut sum = DVec2::ZERO;
        for k in 0..8 {
            let corner = IVec3::new(k & 1, k >> 1 & 1, k >> 2);
            let voxel = (low.as_ivec3() + corner).clamp(IVec3::ZERO, size - 1);
            let place = voxel.x + size.x * (voxel.y + size.y * voxel.z);
            let weight = [0, 1, 2].map(|a| {
                if corner[a] == 1 {
                    share[a]
                } else {
                    1.0 - share[a]
                }
            });
            sum += weight.into_iter().product::<f64>() * self.field[place as usize];
        }
        sum
    }

    fn voxels(&self) -> DVec3 {
        UVec3::from(self.volume.resolution).as_dvec3() / (self.volume.high - self.volume.low)
    }

    /// Calls `visit` with each region that a ray passes before `end`, and where it enters and leaves it, until it returns
    /// true.
    pub(super) fn regions(
        &self,
        ray: &Segment,
        end: f64,
        mut visit: impl FnMut(&Region, [f64; 2]) -> bool,
    ) {
        let Some([mut t, last]) = self.volume.clip(ray.origin, ray.direction) else {
            return;
        };
        let last = last.min(end);
        let origin = self.in_voxels(ray, 0.0);
        let direction = ray.direction * self.voxels();
        let within = WITHIN / direction.abs().max_element();
        let most = UVec3::from(self.volume.resolution) - 1;
        while t < last {
            let voxel = (origin + direction * (t + within)).max(DVec3::ZERO);
            let region = self
                .straight
                .medium
                .region_of(voxel.as_uvec3().min(most), &mut 0);
            let exit = [0, 1, 2].map(|a| {
                let plane = if direction[a] > 0.0 {
                    region.high[a]
                } else {
                    region.low[a]
                };
                let border = if direction[a] > 0.0 { most[a] + 1 } else { 0 };
                if direction[a] == 0.0 || plane == border {
                    f64::INFINITY
                } else {
                    (f64::from(plane) - origin[a]) / direction[a]
                }
            });
            let exit = exit.into_iter().fold(last, f64::min).max(t + within);
            if visit(&region, [t, exit]) {
                return;
            }
            t = exit;
        }
    }

    pub(super) fn in_voxels(&self, ray: &Segment, t: f64) -> DVec3 {
        (ray.origin + ray.direction * t - self.volume.low) * self.voxels()
    }

    /// Least and greatest σ of a region, per scene unit.
    fn bounds(&self, region: &Region) -> [f64; 2] {
        let density = f64::from(self.straight.density);
        region
            .sigma
            .to_array()
            .map(|share| f64::from(share) * density)
    }
}

/// A half float that is 0 or normal.
fn half_value(bits: u32) -> f64 {
    if bits == 0 {
        return 0.0;
    }
    f64::from(1024 + (bits & 1023)) * 2.0_f64.powi((bits >> 10) as i32 - 25)
}

/// True if a bound holds, but for rounding.
fn holds(value: f64, [least, most]: [f64; 2]) -> bool {
    value >= least * (1.0 - 1e-6) && value <= most * (1.0 + 1e-6)
}

impl Medium<'_> {
    /// Where this medium alone scatters a ray first before `end`, by delta tracking: `first` is the number of the first
    /// collision that there may be.
    pub(super) fn flight(
        &self,
        walk: &mut Walk,
        (ray, end): (&Segment, f64),
        first: f64,
        mut numbers: Numbers,
    ) -> Alone {
        let mut left = depth_of(first, &mut walk.rounding);
        let mut found = None;
        self.regions(ray, end, |region, [enter, exit]| {
            let [least, most] = self.bounds(region);
            let mut t = enter;
            if most <= 0.0 {
                return false;
            }
            loop {
                let step = walk.rounding.number(left / most);
                if t + step >= exit {
                    left = (left - (exit - t) * most).max(0.0);
                    break;
                }
                t += step;
                let there = self.at(self.in_voxels(ray, t));
                let share = walk.rounding.number(there.y / most);
                let collides = least == most || numbers.next() < share;
                walk.decide(collides.into());
                if collides {
                    let albedo = if holds(there.y, [least, most]) {
                        there.x / there.y
                    } else {
                        f64::NAN
                    };
                    found = Some(Flight {
                        distance: t,
                        albedo: DVec3::splat(albedo),
                        medium: self.number,
                    });
                    return true;
                }
                left = depth_of(numbers.next(), &mut walk.rounding);
            }
            false
        });
        Alone {
            scattered: found,
            none: Vec::new(),
        }
    }

    /// What this medium lets pass along a shadow ray, by residual-ratio tracking.
    pub(super) fn passes(&self, walk: &mut Walk, ray: &Segment, mut numbers: Numbers) -> DVec3 {
        let mut result = 1.0;
        let mut collisions = 0;
        self.regions(ray, ray.length, |region, [enter, exit]| {
            let [least, most] = self.bounds(region);
            result *= (-least * (exit - enter)).exp();
            if most > least {
                let rest = most - least;
                let mut t = enter + depth_of(numbers.next(), &mut walk.rounding) / rest;
                while t < exit {
                    collisions += 1;
                    let there = self.at(self.in_voxels(ray, t)).y;
                    let is_bounded = holds(there, [least, most]);
                    let there = walk.rounding.number(there);
                    result *= if is_bounded {
                        ((most - there) / rest).clamp(0.0, 1.0)
                    } else {
                        f64::NAN
                    };
                    t += depth_of(numbers.next(), &mut walk.rounding) / rest;
                }
            }
            false
        });
        walk.decide(collisions);
        DVec3::splat(walk.rounding.number(result))
    }
}

impl PathOracle<'_> {
    /// The point where a ray is scattered, noted in the place of the surface behind it.
    pub(super) fn scattered(
        &self,
        walk: &mut Walk,
        ray: &Segment,
        depth: u32,
        at: &Flight,
    ) -> Surface<'_> {
        let position = ray.origin + ray.direction * at.distance;
        let terms = ray.origin.abs() + (ray.direction * at.distance).abs();
        let position = walk.rounding.point(position, terms);
        walk.vertices.truncate(depth as usize);
        walk.vertices.push(Vertex {
            position,
            triangle: u32::MAX,
            material: "the medium".to_owned(),
            throughput: DVec3::ONE,
            direct: DVec3::ZERO,
        });
        Surface::nowhere(self, position, -ray.direction)
    }

    /// How light is scattered at a point of the medium that a path has come to in this direction.
    pub(super) fn phase(&self, surface: &Surface, medium: u32) -> PhaseTwin {
        let medium = self.media.get(medium as usize);
        PhaseTwin {
            phase: medium.map_or(Phase::ISOTROPIC, |medium| medium.volume.phase),
            before: -surface.out,
        }
    }
}

/// A phase function as that which scatters: its value is its density.
pub(super) struct PhaseTwin {
    phase: Phase,
    /// Direction of travel before.
    before: DVec3,
}

impl PhaseTwin {
    /// Below this anisotropy Henyey and Greenstein's function counts as isotropic.
    const LEAST: f64 = 0.001;

    fn density(&self, cosine: f64) -> f64 {
        let g = f64::from(self.phase.anisotropy);
        let shape = match self.phase.kind {
            phase::SCHLICK => (1.0 - g * g) / (1.0 - g * cosine).powi(2),
            phase::HENYEY_GREENSTEIN if g.abs() >= Self::LEAST => {
                (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine).powf(1.5)
            }
            _ => 1.0,
        };
        shape / (2.0 * TAU)
    }

    /// The cosine below which a share u of the light goes.
    fn cosine(&self, u: f64) -> f64 {
        let g = f64::from(self.phase.anisotropy);
        let even = 2.0 * u - 1.0;
        match self.phase.kind {
            phase::SCHLICK => (g + even) / (1.0 + g * even),
            phase::HENYEY_GREENSTEIN if g.abs() >= Self::LEAST => {
                let b = (1.0 - g * g) / (1.0 + g * even);
                (1.0 + g * g - b * b) / (2.0 * g)
            }
            _ => even,
        }
    }
}

impl Bsdf for PhaseTwin {
    fn sample(&self, [u, v]: [f64; 2], rounding: &mut Rounding) -> Option<Bounce> {
        let cosine = self.cosine(u).clamp(-1.0, 1.0);
        let cosine = rounding.share(cosine).clamp(-1.0, 1.0);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (sin, cos) = (TAU * v).sin_cos();
        let local = DVec3::new(sine * cos, sine * sin, cosine);
        let direction = rounding.direction(around(self.before, local));
        Some(Bounce {
            direction,
            weight: DVec3::ONE,
            density: Some(self.density(direction.dot(self.before))),
            medium: 1.0,
        })
    }

    fn evaluate(&self, direction: DVec3, rounding: &mut Rounding) -> Option<Reflected> {
        let density = rounding.number(self.density(direction.dot(self.before)));
        Some(Reflected {
            value: DVec3::splat(density),
            density,
        })
    }
}

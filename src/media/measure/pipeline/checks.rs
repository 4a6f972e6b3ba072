//! What a pipeline has to pass before it is timed, each against something that is not the device: the power of its
//! photons, what they leave in each voxel, the energy that is lost on their way, the image of that grid, and the image
//! against a quadrature of single scattering.

use super::LAMP;
use crate::adaptive::{Adaptive, Filter, Pilots, SmoothCell, Smoothed, Smoothing};
use crate::photons::{Points, point_set};
use crate::pipeline::oracle::{Fields, Left, cell_place, crossed_by, left_by, power_into, seen_by};
use crate::pipeline::ways::{Steps, Ways};
use crate::pipeline::{Mirror, Pipeline, Rendered, Source};
use crate::tracking::{Light, single_scattering};
use crate::{Medium, Volume};
use glam::{DVec3, Vec3};
use raystone_bench::run::Absent;

/// Intervals of the quadrature along a ray in a uniform medium; in others so many for each voxel along an axis.
const STEPS: u32 = 512;
const STEPS_PER_VOXEL: u32 = 4;
/// A voxel's sum of floats may be off by the rounding of each of its additions.
const FLOAT: f64 = 1.2e-7;
/// Of each deposit: its exponential, its products.
const PRODUCTS: f64 = 1e-5;
/// Of all crossings of voxels: how many may be slivers that one side alone has.
const SLIVER: f64 = 1e-3;
/// Of a smooth voxel, as a part of the largest.
const SMOOTH: f64 = 1e-5;
/// Of all energy: what rounding leaves on average.
const ENERGY: f64 = 2e-5;
/// Of a pixel, as a part of the brightest: positions between voxels, phase function, exponentials.
const PIXEL: f64 = 1e-4;
/// The power of a set of m² photons may be off by so many of the m on its border.
const BORDER: f64 = 6.0;
/// Steps of ways that stand for the exact ones, in voxels …
const SHORT: f64 = 0.125;
/// … and how much of all energy may be in other voxels by the pipeline's own.
const BENT: f64 = 0.02;
/// Of the points of photons in f64.
const SEED: u64 = 77;
/// RMSE of an image, relative: beside what the grid blurs, so much over the root of the photons that go through a voxel's
/// cross-section, of random points and of others, …
const NOISE: [f64; 2] = [0.6, 0.2];
/// … and so much times the share of energy that is dropped.
const DROPPED: f64 = 6.0;
/// Photons through the cross-section of a voxel from which even points are more even there than random ones.
const EVEN: f64 = 2.0;
/// A smoothed grid blurs this much more, and a pyramid so much more again.
const WIDE: f64 = 3.0;

/// What a pipeline is judged by.
#[derive(Clone, Copy)]
pub(super) struct Judge<'a> {
    pub(super) volume: &'a Volume,
    pub(super) medium: &'a Medium,
    pub(super) source: &'a Source,
    pub(super) rays: &'a [(DVec3, DVec3)],
    /// Radiance of each ray for an intensity of 1, by the quadrature.
    pub(super) truth: &'a [f64],
    /// Voxels along each axis.
    pub(super) side: u32,
    /// What the grid blurs: an RMSE, relative.
    pub(super) blur: f64,
    /// True if points are more even than random ones.
    pub(super) even: bool,
    /// Half a unit of whole numbers, 0 for floats.
    pub(super) unit: f64,
    /// How the grid is smoothed.
    pub(super) smoothing: Smoothing,
    /// How pilots make a map, if they do.
    pub(super) adaptive: Option<Adaptive>,
    /// True if ways are those of a medium that bends light, whether it does or not.
    pub(super) curved: bool,
    /// What reflects a sky.
    pub(super) mirror: Option<Mirror>,
}

/// What the checks found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Judged {
    /// Dropped energy as a part of all deposits.
    pub(super) dropped: f64,
    /// RMSE of the image, as a part of its mean.
    pub(super) rmse: f64,
    /// Its mean error, as a part of its mean.
    pub(super) bias: f64,
}

/// The quadrature of single scattering along each ray, of a lamp of intensity 1.
pub(super) fn truth_of(
    volume: &Volume,
    medium: &Medium,
    lamp: DVec3,
    rays: &[(DVec3, DVec3)],
) -> Vec<f64> {
    use rayon::prelude::*;
    let fields = Fields::new(medium);
    let steps = match fields.uniform {
        Some(_) => STEPS,
        None => (STEPS_PER_VOXEL * medium.resolution.max_element()).clamp(64, STEPS),
    };
    let sigma = |x: DVec3| medium.exact_at(medium.in_voxels(x))[1];
    let depth = |a: DVec3, b: DVec3| fields.depth_between(volume, a, b);
    let radiance = |(origin, direction): &(DVec3, DVec3)| {
        let light = Light {
            origin: *origin,
            direction: *direction,
            point: lamp,
            intensity: 1.0,
            background: 0.0,
        };
        // A ray beside the medium sees nothing.
        single_scattering(volume, &light, steps, sigma, depth).unwrap_or(0.0)
    };
    rays.par_iter().map(radiance).collect()
}

/// Radiance along each ray of a lamp of intensity 1 where light is refracted: photons of a jittered set, so many along each axis,
/// by short steps to a grid, and rays by such steps through it, all in f64.
pub(super) fn refracted_truth(
    volume: &Volume,
    medium: &Medium,
    rays: &[(DVec3, DVec3)],
    photons: u32,
    mirror: Option<Mirror>,
) -> Result<Vec<f64>, Absent> {
    let source = Source::Point {
        position: LAMP,
        intensity: Vec3::ONE,
    };
    let points = point_set(Points::Jitter, photons, SEED).map_err(Absent::Failed)?;
    let points: Vec<_> = points.into_iter().map(|point| (point, 1.0)).collect();
    let photons = crate::pipeline::photons((volume, medium), &source, &points)?;
    let fields = Fields::new(medium);
    let ways = Ways::of(volume, medium, Steps::Short(SHORT)).map(|ways| ways.with(mirror));
    let left = left_by(&fields, ways.as_ref(), &photons);
    let radiance: Vec<_> = left
        .sums
        .iter()
        .map(|sums| sums.map(|v| v as f32))
        .collect();
    let seen = seen_by(&fields, ways.as_ref(), volume, &radiance, rays);
    let seen = seen.map_err(|error| Absent::Failed(error.to_string()))?;
    Ok(seen.into_iter().map(|light| light.x).collect())
}

impl Judge<'_> {
    /// Runs all checks.
    ///
    /// # Errors
    /// The first thing that is wrong: what, where, by how much.
    pub(super) fn check(&self, pipeline: &Pipeline, found: &Rendered) -> Result<Judged, String> {
        let fields = Fields::new(self.medium);
        let ways = if self.curved {
            Some(Ways::through(self.volume, self.medium, Steps::Regions))
        } else {
            Ways::of(self.volume, self.medium, Steps::Regions)
        };
        let ways = ways.map(|ways| ways.with(self.mirror));
        let ways = ways.as_ref();
        let mut left = left_by(&fields, ways, pipeline.photons());
        if !pipeline.is_directed() {
            left.sums.iter_mut().for_each(|sums| sums[3..].fill(0.0));
        }
        self.check_pilots((&fields, ways), pipeline)?;
        self.check_power(pipeline)?;
        let mut radiance = pipeline.radiance().map_err(|error| error.to_string())?;
        if pipeline.leaves_unread() {
            self.forget_unread(&mut left, &mut radiance);
        }
        self.check_voxels(&left, &radiance, found.tallies.drops > 0)?;
        let kept: f64 = radiance.iter().map(|sums| energy_of(&sums[..3])).sum();
        self.check_energy((&fields, &left), kept, found)?;
        self.check_counts(pipeline, &left)?;
        let gathered = pipeline.gathered().map_err(|error| error.to_string())?;
        self.check_smooth(pipeline, &radiance, &gathered)?;
        self.check_view((&fields, ways), &gathered, &found.image)?;
        if found.tallies.drops == 0 {
            self.check_ways(&fields, pipeline, &radiance)?;
        }
        let dropped = found.tallies.dropped / (kept + found.tallies.dropped);
        self.check_image(pipeline, &found.image, dropped)
    }

    /// Leaves voxels that no view reads out of what is compared: those within whose 5³ neighbours σ is 0.
    fn forget_unread(&self, left: &mut Left, radiance: &mut [[f32; 6]]) {
        let mut pairs = self.medium.dilated();
        self.medium.dilate(&mut pairs);
        for (place, pair) in pairs.iter().enumerate() {
            if pair.sigma.y == 0.0 {
                left.sums[place] = [0.0; 6];
                radiance[place] = [0.0; 6];
                left.unread += left.counts[place];
            }
        }
    }

    /// The power of all photons, against the solid angle of the box.
    fn check_power(&self, pipeline: &Pipeline) -> Result<(), String> {
        let Some(expected) = power_into(self.volume, self.source) else {
            return Ok(());
        };
        let energies = || pipeline.photons().iter().map(|p| p.energy.as_dvec3());
        let power: DVec3 = energies().sum();
        // As many photons of one power would be as even as these.
        let squares: f64 = energies().map(|e| e.element_sum().powi(2)).sum();
        let effective = power.element_sum().powi(2) / squares;
        let slack = BORDER / effective.sqrt();
        let off = power / expected - 1.0;
        if !off.to_array().into_iter().any(|off| beyond(off, slack)) {
            return Ok(());
        }
        let off = off.abs().max_element();
        Err(format!(
            "photons carry a power of {power:.5} where the lamp sends {expected:.5} into the box, {off:.2e} of it beside a slack of {slack:.2e}"
        ))
    }

    /// Each voxel's sums, against f64. Where energy is dropped, a voxel has at most that.
    fn check_voxels(
        &self,
        left: &Left,
        radiance: &[[f32; 6]],
        is_dropped: bool,
    ) -> Result<(), String> {
        let pairs = left.sums.iter().zip(radiance).enumerate();
        for (place, (exact, found)) in pairs {
            let deposits = f64::from(left.counts[place]);
            let rounded = exact[..3].iter().fold(0.0, |a: f64, b| a.max(*b));
            let slack = left.slack[place]
                + deposits.max(1.0) * (self.unit + FLOAT * rounded)
                + PRODUCTS * rounded;
            for (channel, (exact, found)) in exact.iter().zip(found).enumerate() {
                let off = f64::from(*found) - exact;
                let is_wrong = if is_dropped {
                    channel < 3 && off > slack
                } else {
                    off.abs() > slack
                };
                if is_wrong || off.is_nan() {
                    let voxel = crate::volume::voxel_at(self.volume.resolution, place);
                    return Err(format!(
                        "voxel {voxel:?}, sum {channel}: photons left {found:e} where planes in f64 say {exact:e}, a slack of {slack:.1e}"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Energy that photons lose on their way: Φ (1 − exp(−∫ σ)) of each, which σ times what they leave sums to where σ is
    /// the same everywhere; and what is left in all voxels, with what was dropped.
    fn check_energy(
        &self,
        (fields, left): (&Fields, &Left),
        kept: f64,
        found: &Rendered,
    ) -> Result<(), String> {
        let all = kept + found.tallies.dropped;
        let check = |what: &str, found: f64, exact: f64, slack: f64| {
            let off = (found - exact).abs() / exact;
            if off <= slack {
                return Ok(());
            }
            Err(format!(
                "{what} is {found:e} where it has to be {exact:e}: {off:.2e} of it beside a slack of {slack:.1e}"
            ))
        };
        let deposits: f64 = left.counts.iter().map(|n| f64::from(*n)).sum();
        let sums: f64 = left
            .sums
            .iter()
            .map(|sums| sums[..3].iter().sum::<f64>())
            .sum();
        let slack = ENERGY + 3.0 * deposits * self.unit / sums;
        check("energy in all voxels", all, sums, slack)?;
        if let Some(sigma) = fields.uniform {
            check("energy lost in the fog", sigma * all, left.lost, slack)?;
        }
        // Some, all or none of those in voxels that no view reads.
        let counted = found.tallies.deposits as f64;
        let expected = counted.clamp(deposits - f64::from(left.unread), deposits);
        check(
            "the number of deposits",
            counted,
            expected,
            1e-3 + 8.0 / deposits,
        )
    }

    /// Pilots in each of their cells, with the places they came from and the energy they left, against f64.
    fn check_pilots(
        &self,
        (fields, ways): (&Fields, Option<&Ways>),
        pipeline: &Pipeline,
    ) -> Result<(), String> {
        let (Some(adaptive), Some((photons, cells, _))) = (&self.adaptive, pipeline.pilots())
        else {
            return Ok(());
        };
        let exact = crossed_by(self.medium, ways, photons, adaptive.cells, adaptive.pilots);
        let map = f64::from(adaptive.pilots);
        let sums = [
            ("number", 1.0),
            ("columns", map),
            ("rows", map),
            ("squares of columns", map * map),
            ("squares of rows", map * map),
        ];
        for (channel, (what, one)) in sums.into_iter().enumerate() {
            let found = |cell: &Pilots| {
                let [[x, y], [xx, yy]] = [cell.sum, cell.squares];
                u64::from([cell.count, x, y, xx, yy][channel])
            };
            let pairs = exact.iter().zip(cells);
            let off: u64 = pairs
                .map(|(exact, cell)| exact[channel].abs_diff(found(cell)))
                .sum();
            let all: u64 = exact.iter().map(|exact| exact[channel]).sum();
            if off as f64 > SLIVER * all as f64 + 8.0 * one {
                return Err(format!(
                    "the {what} of pilots in all cells are {off} beside those of f64, whose sum is {all}"
                ));
            }
        }
        let left = left_by(fields, ways, photons);
        let mut energies = vec![0.0; cells.len()];
        for (place, sums) in left.sums.iter().enumerate() {
            let voxel = crate::volume::voxel_at(self.volume.resolution, place).into();
            let cell = cell_place(self.medium, voxel, adaptive.cells);
            energies[cell] += sums[..3].iter().sum::<f64>();
        }
        let largest = energies.iter().fold(0.0, |a: f64, b| a.max(*b));
        let pairs = energies.iter().zip(cells).enumerate();
        let worst = pairs
            .map(|(place, (exact, cell))| (place, exact, cell.radiance))
            .find(|(_, exact, found)| beyond(*found - **exact, SLIVER * largest));
        let Some((place, exact, found)) = worst else {
            return Ok(());
        };
        Err(format!(
            "pilots left {found:e} in cell {place} of their grid where planes in f64 say {exact:e}"
        ))
    }

    /// Photons that crossed each voxel and their weights, against f64.
    fn check_counts(&self, pipeline: &Pipeline, left: &Left) -> Result<(), String> {
        let counts = pipeline.counts().map_err(|error| error.to_string())?;
        let mut all = [0.0; 4];
        for (place, (count, weight)) in counts.iter().enumerate() {
            let exact = [f64::from(left.visits[place]), left.weights[place]];
            all[0] += (f64::from(*count) - exact[0]).abs();
            all[1] += exact[0];
            all[2] += (weight - exact[1]).abs();
            all[3] += exact[1];
        }
        for (what, [off, exact]) in [("number", [all[0], all[1]]), ("weights", [all[2], all[3]])] {
            if off > SLIVER * exact + 8.0 {
                return Err(format!(
                    "the {what} of photons in all voxels are {off} beside those of f64, whose sum is {exact}"
                ));
            }
        }
        Ok(())
    }

    /// The smooth grid against the same in f64: each voxel by the level that the device chose, and that level, but for voxels where
    /// rounding decides.
    fn check_smooth(
        &self,
        pipeline: &Pipeline,
        radiance: &[[f32; 6]],
        gathered: &[([f32; 6], u32)],
    ) -> Result<(), String> {
        if self.smoothing.filter == Filter::None {
            return Ok(());
        }
        let counts = pipeline.counts().map_err(|error| error.to_string())?;
        let cell = |(place, sums): (usize, &[f32; 6])| {
            let (count, weight) = counts.get(place).copied().unwrap_or_default();
            SmoothCell {
                sums: sums.map(f64::from),
                count: f64::from(count),
                weight: weight / f64::from(count.max(1)),
            }
        };
        let finest = radiance.iter().enumerate().map(cell).collect();
        let smooth = Smoothed::new(self.medium.resolution, &self.smoothing, finest);
        let largest = radiance
            .as_flattened()
            .iter()
            .fold(0.0, |a: f32, b| a.max(*b));
        let mut others = 0;
        for (voxel, (sums, level)) in smooth.voxels().zip(gathered) {
            if *level > smooth.most() {
                return Err(format!(
                    "voxel {voxel} is smoothed by level {level}, which is none"
                ));
            }
            let exact = smooth.fetched(*level, voxel);
            others += usize::from(smooth.level_of(voxel) != *level);
            let slack = SMOOTH * f64::from(largest);
            let mut pairs = exact.iter().zip(sums);
            if pairs.any(|(a, b)| beyond(a - f64::from(*b), slack)) {
                return Err(format!(
                    "voxel {voxel} is smoothed to {sums:?} where level {level} has {exact:?} in f64"
                ));
            }
        }
        // Where no light is, differences of rounding decide.
        if others as f64 > 0.01 * gathered.len() as f64 {
            return Err(format!(
                "{others} of {} voxels were smoothed by another level than in f64",
                gathered.len()
            ));
        }
        Ok(())
    }

    /// The image of the grid that the device has, against the same in f64.
    fn check_view(
        &self,
        (fields, ways): (&Fields, Option<&Ways>),
        gathered: &[([f32; 6], u32)],
        image: &[Vec3],
    ) -> Result<(), String> {
        let radiance: Vec<[f32; 6]> = gathered.iter().copied().map(|(sums, _)| sums).collect();
        let exact = seen_by(fields, ways, self.volume, &radiance, self.rays);
        let exact = exact.map_err(|error| error.to_string())?;
        let brightest = exact.iter().fold(0.0, |a: f64, b| a.max(b.max_element()));
        let slack = PIXEL * brightest;
        let is_off = |(_, (found, exact)): &(usize, (&Vec3, &DVec3))| {
            let off = found.as_dvec3() - **exact;
            off.to_array().into_iter().any(|off| beyond(off, slack))
        };
        let mut pixels = image.iter().zip(&exact).enumerate();
        let Some((pixel, (found, wanted))) = pixels.find(is_off) else {
            return Ok(());
        };
        let off = (found.as_dvec3() - *wanted).abs().max_element();
        Err(format!(
            "pixel {pixel} of the view is {found} where the grid in f64 gives {wanted:.6}, {:.2e} of the brightest beside a slack of {PIXEL:.0e}",
            off / brightest
        ))
    }

    /// What photons left along curved ways against the same by short steps without a structure: of all energy, how much is in
    /// other voxels.
    fn check_ways(
        &self,
        fields: &Fields,
        pipeline: &Pipeline,
        radiance: &[[f32; 6]],
    ) -> Result<(), String> {
        let Some(ways) = Ways::of(self.volume, self.medium, Steps::Short(SHORT)) else {
            return Ok(());
        };
        let left = left_by(fields, Some(&ways), pipeline.photons());
        let (mut off, mut all) = (0.0, 0.0);
        for (exact, found) in left.sums.iter().zip(radiance) {
            for (exact, found) in exact[..3].iter().zip(found) {
                off += (f64::from(*found) - exact).abs();
                all += exact;
            }
        }
        if off <= BENT * all {
            return Ok(());
        }
        Err(format!(
            "{:.2e} of all energy is in other voxels than by steps of {SHORT} voxels in f64, beside a slack of {BENT:.0e}",
            off / all
        ))
    }

    /// The image against the quadrature of single scattering, within what the voxels blur, and what the number of photons
    /// leaves to chance.
    fn check_image(
        &self,
        pipeline: &Pipeline,
        image: &[Vec3],
        dropped: f64,
    ) -> Result<Judged, String> {
        let Source::Point { intensity, .. } = *self.source else {
            return Err("there is no quadrature for a beam".to_owned());
        };
        let [rmse, bias] = errors(self.truth, intensity.as_dvec3(), image);
        let side = f64::from(self.side);
        // As many photons of one power would be as even as these.
        let powers = || {
            pipeline
                .photons()
                .iter()
                .map(|p| f64::from(p.energy.element_sum()))
        };
        let effective = powers().sum::<f64>().powi(2) / powers().map(|p| p * p).sum::<f64>();
        let through = effective / (side * side);
        let wide = match self.smoothing.filter {
            Filter::None => 1.0,
            Filter::Blur => WIDE,
            Filter::Constant => WIDE.powi(self.smoothing.level as i32 + 1),
            // The widest cell that a rule may choose.
            _ => WIDE * WIDE,
        };
        let are_even = self.even && through >= EVEN;
        let noise = NOISE[usize::from(are_even)] / through.sqrt();
        let slack = self.blur * wide + noise + DROPPED * dropped;
        if rmse <= slack && bias.abs() <= slack {
            return Ok(Judged {
                dropped,
                rmse,
                bias,
            });
        }
        Err(format!(
            "the image has an RMSE of {rmse:.3e} and a mean error of {bias:.3e} of its mean from the quadrature of single scattering, where voxels and photons allow {slack:.2e}"
        ))
    }
}

/// Whether a difference is larger than it may be, or none.
fn beyond(off: f64, slack: f64) -> bool {
    off.is_nan() || off.abs() > slack
}

fn energy_of(sums: &[f32]) -> f64 {
    sums.iter().map(|value| f64::from(*value)).sum()
}

/// RMSE and mean error of an image, both as parts of its mean, from radiances for an intensity of 1.
pub(super) fn errors(truth: &[f64], intensity: DVec3, image: &[Vec3]) -> [f64; 2] {
    let (mut square, mut off, mut mean) = (0.0, 0.0, 0.0);
    for (found, exact) in image.iter().zip(truth) {
        let exact = intensity * *exact;
        let error = found.as_dvec3() - exact;
        square += error.length_squared();
        off += error.element_sum();
        mean += exact.element_sum();
    }
    let count = 3.0 * image.len() as f64;
    [(square / count).sqrt() * count / mean, off / mean]
}

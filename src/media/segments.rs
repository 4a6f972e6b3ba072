//! Rays walked through a medium: optical depth, steps, fetches, and a digest of all segments.
//! Kernel: `kernels/media/segments.wesl`.

use crate::medium::Medium;
use crate::rays::SegmentRay;
use crate::walk::{
    MediumRay, Segment, begin_walk, depth_of_segment, is_inside, leave, medium_segment,
};
use raystone_gpu::{
    Bindings, Composition, Elapsed, Gpu, GpuError, Player, Recording, Storage, UniformValues,
    groups_for,
};

/// What one ray found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Walked {
    /// ∫ σ dt.
    pub depth: f32,
    /// Segments.
    pub steps: u32,
    /// Words and pairs read of the structure, where they are counted.
    pub fetches: u32,
    /// A word for all segments, where they are counted.
    pub digest: u32,
}

impl From<[u32; 4]> for Walked {
    fn from([depth, steps, fetches, digest]: [u32; 4]) -> Self {
        let depth = f32::from_bits(depth);
        Self {
            depth,
            steps,
            fetches,
            digest,
        }
    }
}

/// A word for all that a segment says.
fn digest_of(digest: u32, segment: &Segment) -> u32 {
    let region = &segment.region;
    let packed = |v: glam::UVec3| v.x | v.y << 10 | v.z << 20;
    let words = [
        // A zero may come with either sign.
        if segment.exit == 0.0 {
            0
        } else {
            segment.exit.to_bits()
        },
        packed(region.low),
        packed(region.high),
        region.n.x.to_bits(),
        region.n.y.to_bits(),
        region.sigma.x.to_bits(),
        region.sigma.y.to_bits(),
        u32::from(region.homogeneous),
    ];
    words.into_iter().fold(digest, mixed)
}

fn mixed(digest: u32, word: u32) -> u32 {
    digest.rotate_left(5) ^ word.wrapping_mul(0x9e37_79b1)
}

/// More steps than this are a fault: a step leaves a voxel on one axis at least, and no axis is gone back.
fn step_fuse(medium: &Medium) -> u32 {
    medium.resolution.element_sum() + 3
}

/// Walks a ray, and hands over each segment with the distance where it begins.
pub fn walk_ray(
    medium: &Medium,
    ray: &SegmentRay,
    mut see: impl FnMut(f32, &MediumRay, &Segment),
) -> Walked {
    let (mut walk, end) = (begin_walk(medium, &ray.ray, ray.from), ray.to);
    let (ray, mut walked) = (&ray.ray, Walked::default());
    while walk.t < end && is_inside(medium, &walk) && walked.steps < step_fuse(medium) {
        let segment = medium_segment(medium, ray, &walk, end, &mut walked.fetches);
        see(walk.t, ray, &segment);
        walked.depth += depth_of_segment(medium, ray, &walk, &segment);
        walked.digest = digest_of(walked.digest, &segment);
        walk = leave(medium, ray, &walk, segment.region.low, segment.region.high);
        walked.steps += 1;
    }
    walked
}

/// Rays and a medium on the device.
pub struct Walker {
    recording: Recording,
    player: Player,
    count: u32,
}

impl Walker {
    /// Uploads them and compiles the kernel, which counts fetches and takes digests if `counted`.
    ///
    /// # Errors
    /// An array exceeds what the adapter binds, or the kernel does not compile.
    pub fn new(
        gpu: &Gpu,
        medium: &Medium,
        rays: &[SegmentRay],
        counted: bool,
    ) -> Result<Self, GpuError> {
        let count = rays.len() as u32;
        let composition = Composition::new("media/segments")
            .with("structure", medium.structure.module())
            .feature("counters", counted);
        let words: Vec<[f32; 8]> = rays.iter().map(SegmentRay::words).collect();
        let [walked, status] = [("walked", u64::from(count) * 16), ("status", 64)]
            .map(|(name, bytes)| Storage::scratch(name, bytes));
        let mut bindings: Bindings = crate::upload::bindings(medium, gpu)?;
        let segments = UniformValues::new()
            .u32("count", count)
            .u32("step_fuse", step_fuse(medium));
        bindings
            .uniform("segments", segments)
            .buffer("rays", &gpu.storage("rays", &words)?)
            .buffer("walked", &walked)
            .buffer("status", &status);
        let mut recording = Recording::new();
        recording
            .clear(&status)
            .run(
                "segments",
                &gpu.pipeline(&composition, true)?,
                &bindings,
                groups_for(count),
            )
            .download("walked", &walked)
            .download("status", &status);
        Ok(Self {
            recording,
            player: Player::new(gpu),
            count,
        })
    }

    /// Number of rays.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Walks all rays.
    ///
    /// # Errors
    /// A kernel raised the error word, or the device is lost.
    pub fn walk(&self) -> Result<(Vec<Walked>, Elapsed), GpuError> {
        let played = self.player.play(&self.recording)?;
        let status = played.download::<u32>("status")?;
        self.player.gpu().check_error_word(status[0])?;
        let walked = played.download::<[u32; 4]>("walked")?;
        let walked = walked.into_iter().map(Walked::from).collect();
        Ok((walked, played.elapsed()))
    }
}

/// How far an optical depth may be from the twin's: compilers may sum in another order.
const DEPTH_SLACK: f64 = 1e-5;

/// The first ray whose answer on the device is not that of the scalar twin: steps, fetches and digest to the bit.
pub fn first_difference(medium: &Medium, rays: &[SegmentRay], found: &[Walked]) -> Option<String> {
    use rayon::prelude::*;
    let differs = |(i, (ray, found)): (usize, (&SegmentRay, &Walked))| {
        let twin = walk_ray(medium, ray, |_, _, _| ());
        let text = || format!("ray {i}, {ray:?}: {found:?} where the twin has {twin:?}");
        let off = f64::from(twin.depth - found.depth).abs();
        let near = off <= DEPTH_SLACK * (1.0 + f64::from(twin.depth));
        let depth = twin.depth;
        (!near || twin != Walked { depth, ..*found }).then(text)
    };
    let pairs = rays.par_iter().zip(found).enumerate();
    pairs.find_map_first(differs)
}

/// What is wrong with the segments of a ray, judged in f64: gaps, an exit elsewhere than at the border of its region,
/// or a position where n or σ is beside its bounds.
pub fn wrong_segment(medium: &Medium, ray: &SegmentRay, samples: u32) -> Option<String> {
    let (mut wrong, mut last) = (None, ray.from);
    let extent = medium.resolution.max_element() as f32;
    walk_ray(medium, ray, |from, of, segment| {
        let region = &segment.region;
        let (o, d) = (of.origin.as_dvec3(), of.direction.as_dvec3());
        let forward = d.cmpgt(glam::DVec3::ZERO);
        let planes = glam::UVec3::select(forward, region.high, region.low);
        let border = glam::UVec3::select(forward, medium.resolution, glam::UVec3::ZERO);
        let distances = (planes.as_dvec3() - o) / d;
        let inner = planes.cmpne(border);
        let distances = glam::DVec3::select(inner, distances, glam::DVec3::splat(1e30));
        let border = distances
            .min_element()
            .clamp(from.into(), ray.to.max(from).into());
        // A distance is right to the rounding of its difference and product.
        let slack = 4e-7 * f64::from(extent + of.origin.abs().max_element())
            / f64::from(of.direction.abs().max_element());
        let off = (border - f64::from(segment.exit)).abs();
        // Along an axis that the ray hardly moves on, distances to its planes are as uncertain as the plane is near.
        let at_exit = (o + d * f64::from(segment.exit))
            .max(region.low.as_dvec3())
            .min(region.high.as_dvec3());
        let beside = (at_exit - (o + d * f64::from(segment.exit)))
            .abs()
            .max_element();
        if from > last + slack as f32 {
            wrong.get_or_insert(format!("a gap from {last} to {from} before {segment:?}"));
        } else if off > slack && beside > 1e-3 {
            wrong.get_or_insert(format!("{segment:?} leaves {off} beside its border"));
        }
        for k in 0..samples {
            let part = (f64::from(k) + 0.5) / f64::from(samples);
            let t = f64::from(from) + part * f64::from(segment.exit - from);
            let [n, sigma] = medium.exact_at(o + d * t);
            let holds = |v: f64, b: glam::Vec2| {
                v >= f64::from(b.x) * (1.0 - 1e-12) && v <= f64::from(b.y) * (1.0 + 1e-12)
            };
            if !holds(n, region.n) || !holds(sigma, region.sigma) {
                wrong.get_or_insert(format!("at {t} n is {n} and σ {sigma}, beside {segment:?}"));
            }
        }
        last = segment.exit;
    });
    wrong
}

/// ∫ σ dt of a ray in f64, voxel by voxel without a structure.
pub fn exact_depth(medium: &Medium, ray: &SegmentRay) -> f64 {
    let (o, d) = (ray.ray.origin.as_dvec3(), ray.ray.direction.as_dvec3());
    let (from, to) = (f64::from(ray.from), f64::from(ray.to));
    // All planes through middles of voxels; the grid's own planes are ends of the ray.
    let mut cuts = vec![from, to];
    for axis in 0..3 {
        let plane = |k: u32| (f64::from(k) + 0.5 - o[axis]) / d[axis];
        cuts.extend(
            (0..medium.resolution[axis])
                .map(plane)
                .filter(|t| *t > from && *t < to),
        );
    }
    cuts.sort_by(f64::total_cmp);
    let sigma = |t: f64| medium.exact_at(o + d * t)[1];
    let piece = |ends: &[f64]| {
        let (middle, half) = ((ends[0] + ends[1]) / 2.0, (ends[1] - ends[0]) / 2.0);
        let offset = half / 3.0_f64.sqrt();
        half * (sigma(middle - offset) + sigma(middle + offset))
    };
    cuts.windows(2).map(piece).sum()
}

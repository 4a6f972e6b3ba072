//! The rays that lanes trace: those of single paths, generated from the sampler's words by the
//! image oracle, which knows the integrators ([`raystone_verify::path_oracle`]).
//!
//! They are computed in f64 and rounded to f32 once. If system sines differ in the last bit, a ray
//! differs only if that bit decides its rounding, about once in 10⁸ numbers.

use super::trace::{Trace, trace_of};
use super::{Memory, Pass, Warp};
use glam::DVec3;
use rayon::prelude::*;
use raystone_accel::{CpuTwin, Query, Ray};
use raystone_render::{CountedRays, RAY_COUNT_CLASSES};
use raystone_sampling::paired;
use raystone_verify::path_oracle::{self, PathId, PathOracle, PathRay, Rounding};
use std::collections::BTreeMap;
use std::fmt;

/// Edge of the image kernel's workgroup, pixels.
pub const WORKGROUP: u32 = 8;

/// The golden ratio minus 1, and a half, as fractions of 2³².
const GOLDEN: u32 = 0x9e37_79b9;
const HALF: u32 = 0x8000_0000;

/// Offset of rays from their surface, as a fraction of the scene's diagonal.
const OFFSET: f64 = 1e-5;

/// Shadow rays end at this fraction of the distance, short of their light.
const BEFORE_LIGHT: f64 = 0.9999;

/// Purpose and depth of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RayClass {
    /// Number of bounces before.
    pub depth: u32,
    /// Purpose.
    pub rays: CountedRays,
}

impl RayClass {
    const KINDS: [CountedRays; 4] = [
        CountedRays::Primary,
        CountedRays::Bounce,
        CountedRays::Shadow,
        CountedRays::Ao,
    ];

    /// Encodes the class, as a mark of passes; classes traced earlier have lower words.
    pub fn word(self) -> u32 {
        let kind = Self::KINDS.iter().position(|kind| *kind == self.rays);
        self.depth * 4 + kind.unwrap_or_default() as u32
    }

    /// Decodes [`Self::word`].
    pub fn of_word(word: u32) -> Self {
        Self {
            depth: word / 4,
            rays: Self::KINDS[word as usize % 4],
        }
    }
}

/// Prints `primary`, `bounce 1`, `shadow 0` (from the first point), …
impl fmt::Display for RayClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = RAY_COUNT_CLASSES[self.rays as usize];
        match self.rays {
            CountedRays::Primary | CountedRays::Ao => f.write_str(name),
            _ => write!(f, "{name} {}", self.depth),
        }
    }
}

/// Pixels of a warp's lanes; `None` outside the image.
pub type Pixels = Vec<Option<[u32; 2]>>;

/// The warps of several groups. Each group is a sequence of consecutive warps, in the order of
/// workgroups and of lanes within them. The first warps are spread over the image, evenly by rows
/// and within them by the golden ratio. If the groups cover the image, each warp occurs once. A
/// warp has `[width, height]` lanes, which divide the edges of a workgroup. The pixels of
/// neighbouring lanes lie `stride` apart: see [`paired`].
pub fn groups_of(
    size: [u32; 2],
    warp: [u32; 2],
    [groups, warps]: [u32; 2],
    stride: u32,
) -> Vec<Vec<Pixels>> {
    let blocks = size.map(|edge| edge.div_ceil(WORKGROUP * stride) * stride);
    let of_block = warp.map(|edge| WORKGROUP / edge);
    let per_block = of_block[0] * of_block[1];
    let all = blocks[0] * blocks[1] * per_block;
    let lane = |number: u32, lane: u32| {
        let (block, within) = (number / per_block, number % per_block);
        let corner = [
            block % blocks[0] * WORKGROUP + within % of_block[0] * warp[0],
            block / blocks[0] * WORKGROUP + within / of_block[0] * warp[1],
        ];
        let place = [corner[0] + lane % warp[0], corner[1] + lane / warp[0]];
        let pixel = paired(place, stride);
        (pixel[0] < size[0] && pixel[1] < size[1]).then_some(pixel)
    };
    let pixels = |number| (0..warp[0] * warp[1]).map(|l| lane(number, l)).collect();
    let first = |group: u32| {
        if u64::from(groups) * u64::from(warps) >= u64::from(all) {
            group.saturating_mul(warps).min(all)
        } else {
            let share =
                |fraction: u32, of: u32| ((u64::from(fraction) * u64::from(of)) >> 32) as u32;
            let column = share(group.wrapping_mul(GOLDEN).wrapping_add(HALF), blocks[0]);
            let row = (2 * u64::from(group) + 1) * u64::from(blocks[1]) / (2 * u64::from(groups));
            (row as u32 * blocks[0] + column) * per_block
        }
    };
    let group = |index| {
        let first = first(index);
        (first..(first + warps).min(all)).map(pixels).collect()
    };
    (0..groups).map(group).collect()
}

/// The source of rays.
pub struct View<'a> {
    /// The path oracle.
    pub oracle: &'a PathOracle<'a>,
    /// The image.
    pub image: &'a path_oracle::View<'a>,
    /// Diagonal of the scene, scene units.
    pub diagonal: f64,
    /// Sample indices.
    pub samples: &'a [u32],
    /// Replicate seed.
    pub seed: u32,
}

/// Position among a warp's passes: sample, bounces before, any-hit flag, and light.
type Place = (u32, u32, bool, u32);

/// The rays of a pass, by lane.
#[derive(Debug, Clone, PartialEq)]
pub struct RayPass {
    /// Their class.
    pub class: RayClass,
    /// Their query.
    pub query: Query,
    /// One ray per lane, or `None`.
    pub lanes: Vec<Option<Ray>>,
}

/// The rays of groups of warps, as passes of each warp.
pub struct Rays {
    /// By group and warp; the warps of a group have the same passes.
    pub groups: Vec<Vec<Vec<RayPass>>>,
    /// Number of paths.
    pub paths: u64,
}

impl Rays {
    /// Generates the rays of these pixels.
    pub fn new(view: &View, groups: &[Vec<Pixels>]) -> Self {
        let rays = groups.par_iter().map(|group| of_group(view, group));
        let pixels = groups.iter().flatten().flatten().flatten().count();
        Self {
            groups: rays.collect(),
            paths: (pixels * view.samples.len()) as u64,
        }
    }

    /// Traces the rays through a structure.
    ///
    /// # Errors
    /// As [`trace_of`].
    pub fn through(&self, twin: &dyn CpuTwin, memory: &Memory) -> Result<Vec<Vec<Warp>>, String> {
        let lane = |query, ray: &Option<Ray>| -> Result<Option<Trace>, String> {
            ray.map(|ray| trace_of(twin, memory, &ray, query))
                .transpose()
        };
        let pass = |pass: &RayPass| -> Result<Pass, String> {
            let lanes = pass.lanes.iter().map(|ray| lane(pass.query, ray));
            Ok(Pass {
                class: pass.class.word(),
                lanes: lanes.collect::<Result<_, _>>()?,
            })
        };
        let warp = |passes: &Vec<RayPass>| -> Result<Warp, String> {
            let passes = passes.iter().map(pass).collect::<Result<_, _>>()?;
            Ok(Warp { passes })
        };
        let group = |warps: &Vec<Vec<RayPass>>| warps.par_iter().map(warp).collect();
        self.groups.par_iter().map(group).collect()
    }
}

fn of_group(view: &View, warps: &[Pixels]) -> Vec<Vec<RayPass>> {
    // Passes with any active lane; the group's other lanes wait.
    let mut classes: BTreeMap<Place, RayClass> = BTreeMap::new();
    let mut rays: Vec<Vec<BTreeMap<Place, Ray>>> = Vec::new();
    for pixels in warps {
        let lane = |pixel: &Option<[u32; 2]>| pixel.map_or_else(Vec::new, |p| of_pixel(view, p));
        let lanes: Vec<_> = pixels.par_iter().map(lane).collect();
        for (place, class, _) in lanes.iter().flatten() {
            classes.insert(*place, *class);
        }
        let by_place = |lane: Vec<(Place, RayClass, Ray)>| {
            lane.into_iter()
                .map(|(place, _, ray)| (place, ray))
                .collect()
        };
        rays.push(lanes.into_iter().map(by_place).collect());
    }
    let of_warp = |lanes: Vec<BTreeMap<Place, Ray>>| {
        let pass = |(place, class): (&Place, &RayClass)| RayPass {
            class: *class,
            query: if place.2 { Query::Any } else { Query::Closest },
            lanes: lanes.iter().map(|lane| lane.get(place).copied()).collect(),
        };
        classes.iter().map(pass).collect()
    };
    rays.into_iter().map(of_warp).collect()
}

fn of_pixel(view: &View, pixel: [u32; 2]) -> Vec<(Place, RayClass, Ray)> {
    let mut rays = Vec::new();
    for (number, &sample) in (0..).zip(view.samples) {
        let id = PathId {
            pixel,
            sample,
            seed: view.seed,
        };
        let path = view.oracle.trace(view.image, id, Rounding::none());
        rays.extend(path.rays.iter().map(|ray| {
            let class = RayClass {
                depth: ray.depth,
                rays: ray.class,
            };
            let is_any = matches!(ray.class, CountedRays::Shadow | CountedRays::Ao);
            let place = (number, ray.depth, is_any, ray.light);
            (place, class, for_structure(ray, view.diagonal))
        }));
    }
    rays
}

/// The ray in f32, offset from the surface it leaves.
fn for_structure(ray: &PathRay, diagonal: f64) -> Ray {
    let side = ray.direction.dot(ray.normal).signum();
    let origin = ray.origin + ray.normal * (side * OFFSET * diagonal);
    let length = match ray.class {
        CountedRays::Shadow => ray.length * BEFORE_LIGHT,
        _ => ray.length,
    };
    Ray::new(origin.as_vec3(), ray.direction.as_vec3()).between(0.0, length as f32)
}

/// A ray that is reflected by a floor and one that goes through it start on the side to which they go, 10⁻⁵ of the diagonal off.
///
/// # Errors
/// They start elsewhere.
pub(crate) fn check_origins() -> Result<(), String> {
    let height_of = |down: f64| {
        let ray = PathRay {
            class: CountedRays::Bounce,
            depth: 0,
            light: 0,
            origin: DVec3::new(1.0, 2.0, 0.0),
            normal: DVec3::Z,
            direction: DVec3::new(0.6, 0.0, -0.8 * down),
            length: 3.0,
        };
        for_structure(&ray, 1000.0).origin[2]
    };
    let heights = [-1.0, 1.0].map(height_of);
    let is_right = (heights[0] - 0.01).abs() < 1e-6 && (heights[1] + 0.01).abs() < 1e-6;
    is_right.then_some(()).ok_or_else(|| {
        format!(
            "known rays off a floor and through it start at heights {heights:?} and should at 0.01 and -0.01: this program \
             models other rays than it traces; build it anew, and report what stays wrong"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_have_the_pixels_that_the_image_kernel_gives_them() {
        // Workgroups of 8 × 8: a warp of 32 is the upper or lower half of one.
        let all = groups_of([20, 8], [8, 4], [1, 6], 1);
        assert_eq!((all.len(), all[0].len()), (1, 6));
        assert_eq!(all[0][0][0], Some([0, 0]));
        assert_eq!(all[0][0][31], Some([7, 3]));
        assert_eq!(all[0][1][0], Some([0, 4]));
        assert_eq!(all[0][2][9], Some([9, 1]));
        // The third workgroup extends beyond the image by four columns.
        assert_eq!(all[0][4].iter().flatten().count(), 16);
        assert_eq!(all[0][4][3..5], [Some([19, 0]), None]);
        // Another shape of the same size gives other neighbours.
        assert_eq!(groups_of([20, 8], [4, 8], [1, 6], 1)[0][0][4], Some([0, 1]));
    }

    #[test]
    fn groups_are_spread_over_the_image_and_hold_each_warp_once_where_they_hold_all() {
        let groups = groups_of([64, 64], [8, 4], [4, 2], 1);
        assert!(groups.iter().all(|group| group.len() == 2));
        let first: Vec<_> = groups.iter().map(|group| group[0][0]).collect();
        // Rows 1, 3, 5, 7 of workgroups; columns ½, ½ + φ, … of eight, fractional parts.
        let corners = [[32, 8], [0, 24], [40, 40], [16, 56]];
        assert_eq!(first, corners.map(Some));
        for (count, stride) in [([4, 32], 1), ([3, 50], 1), ([200, 1], 1), ([4, 32], 8)] {
            let all: Vec<_> = groups_of([64, 64], [8, 4], count, stride).concat();
            let pixels: std::collections::BTreeSet<_> = all.iter().flatten().flatten().collect();
            assert_eq!((all.len(), pixels.len()), (128, 64 * 64), "{count:?}");
        }
        // Sparse: lanes lie eight pixels apart, and an image ending within a tile is still covered.
        let sparse = groups_of([80, 8], [8, 4], [1, 256], 8).concat();
        assert_eq!(sparse[0][..3], [Some([0, 0]), Some([8, 0]), Some([16, 0])]);
        let pixels: std::collections::BTreeSet<_> = sparse.iter().flatten().flatten().collect();
        assert_eq!(pixels.len(), 80 * 8);
    }

    #[test]
    fn a_class_is_known_by_its_word() {
        for rays in RayClass::KINDS {
            let class = RayClass { depth: 3, rays };
            assert_eq!(RayClass::of_word(class.word()), class);
        }
        let shadow = RayClass {
            depth: 2,
            rays: CountedRays::Shadow,
        };
        assert_eq!(shadow.to_string(), "shadow 2");
    }
}

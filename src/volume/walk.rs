//! The walk of a straight ray through a medium, from region to region of a structure.
//! Kernel: `kernels/volume/walk.wesl`.

use crate::medium::{Medium, Region, unpack_halves};
use glam::{BVec3, DVec3, IVec3, UVec3, Vec2, Vec3};

/// Components of directions are at least this part of the longest, so that their reciprocals are finite.
const LEAST_COMPONENT: f64 = 1e-12;

/// A ray in voxels; distances are in the length that its direction had in the world.
#[derive(Debug, Clone, Copy)]
pub struct MediumRay {
    /// Where it begins, in voxels.
    pub origin: Vec3,
    /// Its direction, in voxels.
    pub direction: Vec3,
    /// Reciprocals of the direction.
    pub inverse: Vec3,
}

impl MediumRay {
    /// A ray of the world. Components of its direction that are 0 are raised.
    pub fn new(medium: &Medium, origin: DVec3, direction: DVec3) -> Self {
        let along = medium.difference_in_voxels(direction);
        let least = along.abs().max_element() * LEAST_COMPONENT;
        let raised = |c: f64| {
            if c.abs() < least {
                least.copysign(c)
            } else {
                c
            }
        };
        let direction = DVec3::from(along.to_array().map(raised)).as_vec3();
        Self {
            origin: medium.in_voxels(origin).as_vec3(),
            direction,
            inverse: 1.0 / direction,
        }
    }
}

/// The voxel that a ray is in, and how far it came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walk {
    /// The voxel; beside the grid once the ray has left it.
    pub voxel: IVec3,
    /// Distance from the origin.
    pub t: f32,
}

/// What a ray is told of the way before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Distance up to which the bounds hold.
    pub exit: f32,
    /// The region that is left there.
    pub region: Region,
}

/// A walk that begins at distance `t`, in the nearest voxel.
pub fn begin_walk(medium: &Medium, ray: &MediumRay, t: f32) -> Walk {
    let most = (medium.resolution - 1).as_vec3();
    let place = (ray.origin + ray.direction * t).floor();
    let voxel = place.max(Vec3::ZERO).min(most).as_ivec3();
    Walk { voxel, t }
}

/// True until the walk has left the grid.
pub fn is_inside(medium: &Medium, walk: &Walk) -> bool {
    walk.voxel.as_uvec3().cmplt(medium.resolution).all()
}

/// The longest way from here, up to `end`, in which the structure's bounds hold. `fetches` counts what is read.
pub fn medium_segment(
    medium: &Medium,
    ray: &MediumRay,
    walk: &Walk,
    end: f32,
    fetches: &mut u32,
) -> Segment {
    let region = medium.region_of(walk.voxel.as_uvec3(), fetches);
    let exit = exits(medium, ray, region.low, region.high).min_element();
    let exit = exit.max(walk.t).min(end.max(walk.t));
    Segment { exit, region }
}

/// Farther than any plane.
const FAR: f32 = 1e30;

/// Distances to the planes of a box before the ray. The grid's own planes are left by the end of the ray, which the host
/// knows better for rays that lie in them.
fn exits(medium: &Medium, ray: &MediumRay, low: UVec3, high: UVec3) -> Vec3 {
    let forward = ray.direction.cmpgt(Vec3::ZERO);
    let planes = UVec3::select(forward, high, low);
    let border = UVec3::select(forward, medium.resolution, UVec3::ZERO);
    let distances = (planes.as_vec3() - ray.origin) * ray.inverse;
    Vec3::select(planes.cmpeq(border), Vec3::splat(FAR), distances)
}

/// Beyond a box: across the planes that are left first, and along the others only forward and not out of the box.
pub fn leave(medium: &Medium, ray: &MediumRay, walk: &Walk, low: UVec3, high: UVec3) -> Walk {
    let forward = ray.direction.cmpgt(Vec3::ZERO);
    let next = exits(medium, ray, low, high);
    let exit = next.min_element();
    let place = (ray.origin + ray.direction * exit).floor();
    let inside = place
        .max(low.as_vec3())
        .min((high - 1).as_vec3())
        .as_ivec3();
    let select = |mask: BVec3, a: IVec3, b: IVec3| IVec3::select(mask, a, b);
    let onward = select(forward, walk.voxel.max(inside), walk.voxel.min(inside));
    let beyond = select(forward, high.as_ivec3(), low.as_ivec3() - 1);
    Walk {
        voxel: select(next.cmpeq(Vec3::splat(exit)), beyond, onward),
        t: walk.t.max(exit),
    }
}

/// n and σ at a position in voxels, trilinearly between the middles of voxels.
pub fn field_at(medium: &Medium, position: Vec3) -> Vec2 {
    let most = (medium.resolution - 1).as_vec3();
    let local = (position - 0.5).max(Vec3::ZERO).min(most);
    let low = local.as_uvec3();
    let high = (low + 1).min(medium.resolution - 1);
    let w = local - low.as_vec3();
    let bottom = mix_4(medium, low, high, low.z, w);
    bottom + (mix_4(medium, low, high, high.z, w) - bottom) * w.z
}

/// The four voxels of a slice.
fn mix_4(medium: &Medium, low: UVec3, high: UVec3, z: u32, w: Vec3) -> Vec2 {
    let a = voxel_value(medium, UVec3::new(low.x, low.y, z));
    let b = voxel_value(medium, UVec3::new(high.x, low.y, z));
    let c = voxel_value(medium, UVec3::new(low.x, high.y, z));
    let d = voxel_value(medium, UVec3::new(high.x, high.y, z));
    let near = a + (b - a) * w.x;
    near + (c + (d - c) * w.x - near) * w.y
}

fn voxel_value(medium: &Medium, voxel: UVec3) -> Vec2 {
    unpack_halves(medium.fetch_field(medium.voxel_index(voxel)))
}

/// ∫ σ dt over [from, to], within the voxel: between the planes through voxels' middles σ is a cubic polynomial, which
/// Gauss's rule of two points integrates exactly.
pub fn depth_in_voxel(medium: &Medium, ray: &MediumRay, voxel: IVec3, from: f32, to: f32) -> f32 {
    let t = (voxel.as_vec3() + 0.5 - ray.origin) * ray.inverse;
    let t = t.max(Vec3::splat(from)).min(Vec3::splat(to));
    let [first, last] = [t.min_element(), t.max_element()];
    let middle = t.x.min(t.y).max(t.x.max(t.y).min(t.z));
    depth_of_piece(medium, ray, from, first)
        + depth_of_piece(medium, ray, first, middle)
        + depth_of_piece(medium, ray, middle, last)
        + depth_of_piece(medium, ray, last, to)
}

/// Half the distance between both points, of half an interval: 1 / √3.
const GAUSS: f32 = 0.577_350_26;

fn depth_of_piece(medium: &Medium, ray: &MediumRay, from: f32, to: f32) -> f32 {
    let half = (to - from) * 0.5;
    if half <= 0.0 {
        return 0.0;
    }
    let middle = from + half;
    let a = field_at(medium, ray.origin + ray.direction * (middle - GAUSS * half)).y;
    let b = field_at(medium, ray.origin + ray.direction * (middle + GAUSS * half)).y;
    half * (a + b)
}

/// ∫ σ dt over a segment: at once where σ is constant, else voxel by voxel.
pub fn depth_of_segment(medium: &Medium, ray: &MediumRay, walk: &Walk, segment: &Segment) -> f32 {
    if segment.region.sigma.x == segment.region.sigma.y {
        return segment.region.sigma.x * (segment.exit - walk.t);
    }
    let mut depth = 0.0;
    let mut at = *walk;
    while at.t < segment.exit && is_inside(medium, &at) {
        let voxel = at.voxel.as_uvec3();
        let next = leave(medium, ray, &at, voxel, voxel + 1);
        depth += depth_in_voxel(medium, ray, at.voxel, at.t, next.t.min(segment.exit));
        at = next;
    }
    depth
}

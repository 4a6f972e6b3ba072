//! Shadow rays from the other end, and grouped by light: the same segments in other directions and
//! another order.
//!
//! Lights are chosen at random, so neighbouring shadow rays go to different ones. A. Dufay (thesis,
//! Bordeaux 2017, section 3.6, and a filed patent) traces them from the light to the surface,
//! grouped by light, so that the lanes of a warp start at the same place; he could not measure a
//! gain. The set of segments, and so the image, does not change. The cost of grouping, a compaction
//! by light, is measured separately: `compaction:radix-sort`.

use crate::rays::RaySet;
use glam::Vec3;
use raystone_accel::{CpuTwin, NO_HIT, Ray};
use raystone_record::RayClass;
use raystone_scene::{LightList, SceneData, Source};
use std::collections::BTreeMap;

/// Fraction of the way at which a shadow ray ends, so that it does not hit its light.
const BEFORE_LIGHT: f32 = 0.9999;

/// A segment from a surface to a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// End near the surface, scene units.
    pub surface: Vec3,
    /// End on the light, scene units.
    pub light: Vec3,
    /// Index of the light.
    pub number: u32,
}

impl Segment {
    /// The ray from the surface, which ends just before the light.
    pub(crate) fn forward(&self) -> Ray {
        Ray::new(self.surface, self.light - self.surface).between(0.0, BEFORE_LIGHT)
    }

    /// The ray from the light, which begins just off it.
    pub(crate) fn reversed(&self) -> Ray {
        Ray::new(self.light, self.surface - self.light).between(1.0 - BEFORE_LIGHT, 1.0)
    }
}

/// For each triangle, the index of the light that it is, or is half of: see [`LightList`].
pub(super) fn lights_of(scene: &SceneData, emitters: &[u32]) -> Vec<u32> {
    let mut numbers = BTreeMap::new();
    for (number, light) in (0..).zip(LightList::of(scene).lights) {
        match light.source {
            Source::Triangle(triangle) => drop(numbers.insert(triangle, number)),
            Source::Parallelogram(formed) => {
                numbers.extend(formed.triangles.map(|triangle| (triangle, number)));
            }
            Source::Light(_) => {}
        }
    }
    let number = |triangle| numbers.get(triangle).copied().unwrap_or(u32::MAX);
    emitters.iter().map(number).collect()
}

/// The indices of segments, stably grouped by light.
pub fn by_light(segments: &[Segment]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..segments.len() as u32).collect();
    order.sort_by_key(|place| segments[*place as usize].number);
    order
}

/// The three classes derived from [`RayClass::Shadow`].
pub(super) fn other_orders(segments: &[Segment], reference: &dyn CpuTwin) -> Vec<RaySet> {
    let as_they_are: Vec<u32> = (0..segments.len() as u32).collect();
    let clustered = by_light(segments);
    let set = |class, order: &[u32], ray: fn(&Segment) -> Ray| {
        let rays = order.iter().map(|place| ray(&segments[*place as usize]));
        RaySet {
            shadow: order.to_vec(),
            ..RaySet::new(class, rays.collect(), reference)
        }
    };
    vec![
        set(RayClass::ShadowReversed, &as_they_are, Segment::reversed),
        set(RayClass::ShadowClustered, &clustered, Segment::forward),
        set(
            RayClass::ShadowReversedClustered,
            &clustered,
            Segment::reversed,
        ),
    ]
}

/// Number of rays in a set whose answer differs from that of the shadow ray between the same ends;
/// `None` for a set not derived from shadow rays.
pub fn unlike_shadow(set: &RaySet, sets: &[RaySet]) -> Option<usize> {
    let shadow = sets.iter().find(|other| other.class == RayClass::Shadow)?;
    let is_hit = |set: &RaySet, place: usize| set.truth[place].triangle != NO_HIT;
    let differs =
        |(place, of): &(usize, &u32)| is_hit(set, *place) != is_hit(shadow, **of as usize);
    (!set.shadow.is_empty()).then(|| set.shadow.iter().enumerate().filter(differs).count())
}

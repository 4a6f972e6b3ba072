//! What is no ray at all: a number that is none, an endless one, a direction that is too short. A structure answers it with nothing.

use crate::rays::RaySet;
use raystone_accel::{Hit, NO_HIT, Ray};
use raystone_record::ClassVerdict;

/// The first ray that hits something, made none in each way.
pub(crate) fn no_rays(set: &RaySet) -> Vec<Ray> {
    let hits = set.rays.iter().zip(&set.truth);
    let Some((ray, _)) = hits.into_iter().find(|(_, hit)| hit.triangle != NO_HIT) else {
        return Vec::new();
    };
    let with = |change: &dyn Fn(&mut Ray)| {
        let mut ray = *ray;
        change(&mut ray);
        ray
    };
    let mut rays = vec![
        with(&|ray| ray.t_min = f32::NAN),
        with(&|ray| ray.t_max = f32::NAN),
        with(&|ray| ray.direction = [0.0; 3]),
        // Where it would hit, if it were one.
        with(&|ray| {
            let longest = ray.direction.map(f32::abs).into_iter().fold(0.0, f32::max);
            ray.direction = ray.direction.map(|x| x / longest * 1e-17);
        }),
    ];
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            rays.push(with(&|ray| ray.origin[axis] = number));
            rays.push(with(&|ray| ray.direction[axis] = number));
        }
    }
    rays
}

/// Counts those that were answered with a hit, or not at all, among the wrong rays.
pub(crate) fn note(class: &mut ClassVerdict, rays: &[Ray], hits: &[Hit], found: &[Option<bool>]) {
    for (place, ray) in rays.iter().enumerate() {
        let hit = hits.get(place).map(|hit| hit.triangle);
        if hit == Some(NO_HIT) && found.get(place) == Some(&Some(false)) {
            continue;
        }
        class.wrong += 1;
        class.first_wrong.get_or_insert_with(|| {
            format!(
                "{ray}, which is no ray | structure {hit:?}, any hit {:?}",
                found.get(place)
            )
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_record::RayClass;

    #[test]
    fn none_of_them_is_a_ray_and_each_must_be_answered_with_nothing() {
        let ray = Ray::new(glam::Vec3::ZERO, glam::Vec3::Y);
        let set = RaySet {
            class: RayClass::Hard,
            rays: vec![ray],
            truth: vec![Hit {
                triangle: 7,
                ..Hit::miss(&ray)
            }],
            shadow: Vec::new(),
        };
        let rays = no_rays(&set);
        assert_eq!(rays.len(), 22);
        assert!(ray.is_ray() && rays.iter().all(|ray| !ray.is_ray()));
        let wrong = |hits: &[Hit], found: Option<bool>| {
            let mut class = ClassVerdict {
                class: set.class,
                rays: 1,
                wrong: 0,
                ties: 0,
                first_wrong: None,
            };
            note(&mut class, &rays[..1], hits, &[found]);
            class.wrong
        };
        let miss = Hit::miss(&rays[0]);
        assert_eq!(wrong(&[miss], Some(false)), 0);
        let wrongs = [
            wrong(&set.truth, Some(false)),
            wrong(&[miss], Some(true)),
            wrong(&[miss], None),
            wrong(&[], Some(false)),
        ];
        assert_eq!(wrongs, [1; 4]);
    }
}

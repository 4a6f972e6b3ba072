//! What a lobe sends through a part of a cone, which is as wide as the pixel's cone and the lobe together: a table of
//! its mean density over disks (Roger 2008, section 5.3, F). Kernel: `kernels/cones/lobe.wesl`.
//!
//! Directions off a mirror are sums of one that is uniform over the pixel's reflected cone and one that is uniform over
//! the lobe. Across the cone both are disks, of radii a and 1 − a, and their density at a distance is the overlap of the
//! two disks that far apart. The thesis fills its table by random directions; here it is an integral.

use crate::disk::c;
use raystone_specular::real::Real;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Radii of disks, from 0 to 1.
pub(crate) const SIZES: u32 = 17;
/// Distances of their middles from the axis, from 0 to 1.
pub(crate) const PLACES: u32 = 17;
/// Parts of the cone's width that are the narrower's, from 0 to 1/2.
pub(crate) const PARTS: u32 = 9;
/// Circles about the axis that an integral takes.
const CIRCLES: u32 = 512;

/// The table.
static TABLE: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let step = |k: u32, count: u32| f64::from(k) / f64::from(count - 1);
    let mut table = Vec::with_capacity((SIZES * PLACES * PARTS) as usize);
    for part in 0..PARTS {
        for place in 0..PLACES {
            for size in 0..SIZES {
                let narrow = 0.5 * step(part, PARTS);
                let mean = mean_density(step(size, SIZES), step(place, PLACES), narrow);
                table.push(mean as f32);
            }
        }
    }
    table
});

/// Densities over that of a cone in which all directions weigh alike: sizes by places by parts.
pub fn lobe_table() -> &'static [f32] {
    &TABLE
}

/// Area in which two disks overlap whose middles are this far apart.
fn lens(a: f64, b: f64, apart: f64) -> f64 {
    let (narrow, wide) = (a.min(b), a.max(b));
    if apart >= a + b || narrow <= 0.0 {
        return 0.0;
    }
    if apart <= wide - narrow {
        return PI * narrow * narrow;
    }
    let half = |r: f64, other: f64| {
        let cosine = (apart * apart + r * r - other * other) / (2.0 * apart * r);
        r * r * cosine.clamp(-1.0, 1.0).acos()
    };
    let kite = (a + b - apart) * (apart + a - b) * (apart - a + b) * (apart + a + b);
    half(a, b) + half(b, a) - 0.5 * kite.max(0.0).sqrt()
}

/// The density at a distance from the axis, over the uniform one; `narrow` is the radius of the lesser disk.
fn density(distance: f64, narrow: f64) -> f64 {
    let wide = 1.0 - narrow;
    if narrow <= 0.0 {
        return f64::from(u8::from(distance <= 1.0));
    }
    lens(narrow, wide, distance) / (PI * (narrow * wide).powi(2))
}

/// Its mean over what a disk has in common with the cone.
fn mean_density(radius: f64, place: f64, narrow: f64) -> f64 {
    let within = lens(radius, 1.0, place);
    if narrow <= 0.0 {
        return 1.0;
    }
    if within <= 0.0 {
        return density(place, narrow);
    }
    let (from, to) = ((place - radius).abs(), (place + radius).min(1.0));
    // Circles about the axis that lie in the disk as a whole, then their parts.
    let whole = (radius - place).max(0.0);
    let ring = |from: f64, to: f64, angle: &dyn Fn(f64) -> f64| -> f64 {
        let step = (to - from) / f64::from(CIRCLES);
        let middles = (0..CIRCLES).map(|k| from + (f64::from(k) + 0.5) * step);
        middles
            .map(|t| density(t, narrow) * t * angle(t) * step)
            .sum()
    };
    let part = |t: f64| {
        let cosine = (t * t + place * place - radius * radius) / (2.0 * t * place);
        2.0 * cosine.clamp(-1.0, 1.0).acos()
    };
    let inner = ring(0.0, whole, &|_| 2.0 * PI);
    let outer = if place > 0.0 {
        ring(from, to, &part)
    } else {
        0.0
    };
    (inner + outer) / within
}

fn at_node<T: Real>(lobes: &[T], size: u32, place: u32, part: u32) -> T {
    lobes[((part * PLACES + place) * SIZES + size) as usize]
}

/// The node at or before a place on a line of so many, and what is beyond it.
fn before<T: Real>(at: T, count: u32) -> (u32, T) {
    let low = (at.f64() as u32).min(count - 2);
    (low, at - T::of(f64::from(low)))
}

/// Between the nodes next to a size.
fn along_sizes<T: Real>(lobes: &[T], size: T, place: u32, part: u32) -> T {
    let (low, beyond) = before(size, SIZES);
    let a = at_node(lobes, low, place, part);
    a + (at_node(lobes, low + 1, place, part) - a) * beyond
}

/// Between those next to a place.
fn along_places<T: Real>(lobes: &[T], size: T, place: T, part: u32) -> T {
    let (low, beyond) = before(place, PLACES);
    let a = along_sizes(lobes, size, low, part);
    a + (along_sizes(lobes, size, low + 1, part) - a) * beyond
}

/// The mean density over a disk of this share of the cone, whose middle is this far from the axis, in radii; the narrower
/// of pixel and lobe has this part of the cone's width, up to a half.
pub(crate) fn lobe_weight<T: Real>(lobes: &[T], share: T, distance: T, part: T) -> T {
    let last = |count: u32| T::of(f64::from(count - 1));
    let one = c::<T>(1.0);
    let size = share.min(one).sqrt() * last(SIZES);
    let place = distance.min(one) * last(PLACES);
    let (low, beyond) = before((c::<T>(2.0) * part).min(one) * last(PARTS), PARTS);
    let a = along_places(lobes, size, place, low);
    a + (along_places(lobes, size, place, low + 1) - a) * beyond
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;

    /// A point of the unit disk.
    fn point(random: &mut Pcg32) -> [f64; 2] {
        loop {
            let at = [random.signed(), random.signed()];
            if at[0].hypot(at[1]) <= 1.0 {
                return at;
            }
        }
    }

    #[test]
    fn the_table_is_what_random_directions_fill() {
        let mut random = Pcg32::new(7);
        for (radius, place, narrow) in [
            (1.0, 0.0, 0.25),
            (0.5, 0.0, 0.5),
            (0.25, 0.5, 0.5),
            (0.25, 0.75, 0.25),
            (0.75, 0.75, 0.125),
            (0.5, 0.25, 0.0625),
        ] {
            let count = 400_000;
            let mut within = 0.0;
            for _ in 0..count {
                let (a, b) = (point(&mut random), point(&mut random));
                let at = [0, 1].map(|k| narrow * a[k] + (1.0 - narrow) * b[k]);
                within += f64::from(u8::from((at[0] - place).hypot(at[1]) <= radius));
            }
            let expected = within / f64::from(count) / (lens(radius, 1.0, place) / PI);
            let found = mean_density(radius, place, narrow);
            assert!(
                (found / expected - 1.0).abs() < 0.02,
                "{radius} {place} {narrow}: {found} and {expected}"
            );
        }
    }

    #[test]
    fn all_of_a_cone_weighs_one_and_a_cone_without_a_lobe_does_everywhere() {
        let lobes: Vec<f64> = lobe_table().iter().map(|x| f64::from(*x)).collect();
        for part in [0.0, 0.1, 0.3, 0.5] {
            let all = lobe_weight(&lobes, 1.0, 0.0, part);
            assert!((all - 1.0).abs() < 1e-4, "{part}: {all}");
        }
        for (share, distance) in [(0.0, 0.0), (0.2, 0.3), (0.5, 0.9)] {
            assert_eq!(lobe_weight(&lobes, share, distance, 0.0), 1.0);
        }
        // The middle of two equal disks has four times the density of a cone of both.
        let middle = lobe_weight(&lobes, 0.0, 0.0, 0.5);
        assert!((middle - 4.0).abs() < 1e-4, "{middle}");
    }
}

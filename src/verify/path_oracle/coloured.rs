//! A medium whose coefficients differ by channel, in f64: from `docs/media.md`, "In the path tracer", *Colours*.

use super::Walk;
use super::hits::Segment;
use super::medium::{Alone, Flight, Medium, Numbers, depth_of};
use glam::{DVec2, DVec3};
use raystone_volume::medium::Region;

/// Least and greatest extinction of each channel in a region, per scene unit.
struct Extinctions {
    least: DVec3,
    most: DVec3,
    /// True if the region has one σ_s and one σ.
    is_even: bool,
}

/// The extinction of each channel where σ_s and σ are these.
fn extinction(there: DVec2, [scatters, absorbs]: [DVec3; 2]) -> DVec3 {
    scatters * there.x + absorbs * (there.y - there.x).max(0.0)
}

impl Extinctions {
    /// Of a region: σ_s and σ are within its bounds, so that σ_a is between their differences; and each channel has
    /// between the products of σ and its tints.
    fn of(medium: &Medium, region: &Region) -> Self {
        let tints = medium.tints;
        let density = f64::from(medium.straight.density);
        // The structure knows σ_s in the place of n.
        let [s, sigma] = [region.n, region.sigma].map(|shares| shares.as_dvec2() * density);
        let [scatters, absorbs] = tints;
        if s.x == s.y && sigma.x == sigma.y {
            let even = extinction(DVec2::new(s.x, sigma.x), tints);
            return Self {
                least: even,
                most: even,
                is_even: true,
            };
        }
        let least_absorbed = (sigma.x - s.y).max(0.0);
        let most_absorbed = (sigma.y - s.x).max(0.0);
        let by_parts = scatters * s.x + absorbs * least_absorbed;
        let least = by_parts.max(scatters.min(absorbs) * sigma.x);
        let by_parts = scatters * s.y + absorbs * most_absorbed;
        let most = by_parts.min(scatters.max(absorbs) * sigma.y);
        Self {
            least,
            most: most.max(least),
            is_even: false,
        }
    }

    /// True if an extinction is within the bounds, but for rounding.
    fn hold(&self, extinction: DVec3) -> bool {
        let room = 1e-6 * self.most;
        extinction.cmpge(self.least - room).all() && extinction.cmple(self.most + room).all()
    }
}

impl Medium<'_> {
    /// A free flight by spectral tracking (Kutz, Habel, Li & Novák 2017): one number decides for all channels, by their mean
    /// weighted with the path's throughput.
    pub(super) fn coloured_flight(
        &self,
        walk: &mut Walk,
        (ray, end): (&Segment, f64),
        first: f64,
        mut numbers: Numbers,
        mut throughput: DVec3,
    ) -> Alone {
        let mut left = depth_of(first, &mut walk.rounding);
        let mut alone = Alone::default();
        self.regions(ray, end, |region, [enter, exit]| {
            let bounds = Extinctions::of(self, region);
            let most = bounds.most.max_element();
            if most <= 0.0 {
                return false;
            }
            let mut t = enter;
            loop {
                let step = walk.rounding.number(left / most);
                if t + step >= exit {
                    left = (left - (exit - t) * most).max(0.0);
                    return false;
                }
                t += step;
                let there = self.at(self.in_voxels(ray, t));
                let own = walk.rounding.colour(extinction(there, self.tints));
                if !bounds.hold(own) {
                    alone.none.push((t, DVec3::NAN));
                }
                // Each channel's part of the path.
                let parts = throughput / throughput.element_sum();
                let mean = parts.dot(own);
                let none = (1.0 - mean / most).max(0.0);
                let none = walk.rounding.share(none);
                let collides = numbers.next() >= none;
                walk.decide(collides.into());
                if collides {
                    let scattered = self.tints[0] * there.x;
                    alone.scattered = Some(Flight {
                        distance: t,
                        albedo: scattered / mean,
                        medium: self.number,
                    });
                    return true;
                }
                let kept = (most - own).max(DVec3::ZERO) / (most - mean);
                throughput *= kept;
                alone.none.push((t, kept));
                left = depth_of(numbers.next(), &mut walk.rounding);
            }
        });
        alone
    }

    /// What this medium lets pass along a shadow ray: the least extinction of each channel in closed form, its rest by ratio
    /// tracking at the greatest rest of a channel.
    pub(super) fn coloured_passes(
        &self,
        walk: &mut Walk,
        ray: &Segment,
        mut numbers: Numbers,
    ) -> DVec3 {
        let mut result = DVec3::ONE;
        let mut collisions = 0;
        self.regions(ray, ray.length, |region, [enter, exit]| {
            let bounds = Extinctions::of(self, region);
            result *= (-bounds.least * (exit - enter)).exp();
            if bounds.is_even {
                return false;
            }
            let rate = (bounds.most - bounds.least).max_element();
            let mut way = depth_of(numbers.next(), &mut walk.rounding);
            if rate <= 0.0 {
                return false;
            }
            let mut t = enter;
            loop {
                t += way / rate;
                if t >= exit {
                    break;
                }
                collisions += 1;
                let own = extinction(self.at(self.in_voxels(ray, t)), self.tints);
                let is_bounded = bounds.hold(own);
                let own = walk.rounding.colour(own);
                result *= if is_bounded {
                    (1.0 - (own - bounds.least) / rate).clamp(DVec3::ZERO, DVec3::ONE)
                } else {
                    DVec3::NAN
                };
                way = depth_of(numbers.next(), &mut walk.rounding);
            }
            false
        });
        walk.decide(collisions);
        walk.rounding.colour(result)
    }
}

//! All media of a scene on a path, in f64: from `docs/media.md`, "In the path tracer", *Several media*.
//!
//! A medium is a Poisson process of collisions along a ray, and those of several are independent; the first point of their
//! union is the nearest of their first ones.

use super::hits::Segment;
use super::medium::{Alone, FLIGHT, Flight, LAST_FLIGHT, Numbers, SURVIVAL, TO_LIGHT};
use super::{PathOracle, Walk};
use glam::DVec3;

impl PathOracle<'_> {
    /// Where a ray is scattered first before `end`: the sampler's number is that of the first collision that there may be in
    /// the first medium. In colours, the throughput changes on the way.
    pub(super) fn flight(
        &self,
        walk: &mut Walk,
        (ray, end): (&Segment, f64),
        depth: u32,
        sampled: Option<f64>,
        throughput: &mut DVec3,
    ) -> Option<Flight> {
        let begun = *throughput;
        let mut nearest: Option<Flight> = None;
        let mut none = Vec::new();
        for medium in &self.media {
            let first = sampled.filter(|_| medium.number == 0);
            let first = first
                .unwrap_or_else(|| Numbers::new(walk, depth, (LAST_FLIGHT, medium.number)).next());
            let numbers = Numbers::new(walk, depth, (FLIGHT, medium.number));
            // Farther ones cannot be the nearest.
            let way = (ray, nearest.as_ref().map_or(end, |flight| flight.distance));
            let alone: Alone = if self.are_coloured {
                medium.coloured_flight(walk, way, first, numbers, begun)
            } else {
                medium.flight(walk, way, first, numbers)
            };
            walk.decide(5 + u64::from(alone.scattered.is_some()));
            none.extend(alone.none);
            nearest = alone.scattered.or(nearest);
        }
        let until = nearest.as_ref().map_or(end, |flight| flight.distance);
        for (_, kept) in none.iter().filter(|(distance, _)| *distance <= until) {
            *throughput *= *kept;
        }
        nearest
    }

    /// What passes along the shadow ray to a light: of what passes each medium, the next lets pass its share.
    pub(super) fn passes(&self, walk: &mut Walk, ray: &Segment, depth: u32, light: usize) -> DVec3 {
        let mut all = DVec3::ONE;
        for medium in &self.media {
            let numbers = Numbers::new(walk, depth, (TO_LIGHT + light as u32, medium.number));
            all *= if self.are_coloured {
                medium.coloured_passes(walk, ray, numbers)
            } else {
                medium.passes(walk, ray, numbers)
            };
        }
        all
    }

    /// The number that decides whether a path survives, where flights have that of the sampler.
    pub(super) fn survival(&self, walk: &Walk, depth: u32) -> Option<f64> {
        let _ = self.media.first()?;
        Some(Numbers::new(walk, depth, (SURVIVAL, 0)).next())
    }
}

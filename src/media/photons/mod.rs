//! Photons on a square: point sets × orders of the list × warps, and what is counted of them.
//!
//! The square lies between a light and a medium; a photon goes on from its point. What the order of the list does on a
//! device is counted by a model: which photons that run together write to the same voxels, and to how many segments of
//! memory (Pfeuti 2009, §4.2, where point set and order are one choice).

mod blue_noise;
mod count;
mod order;
mod points;
mod warp;

pub use count::{cell_deviation, collisions, density_deviation, segments_of_32};
pub(crate) use order::cell_of;
pub use order::{Order, ordered};
pub use points::{Points, point_set};
pub use warp::{ImportanceMap, Warp};

#[cfg(test)]
mod tests;

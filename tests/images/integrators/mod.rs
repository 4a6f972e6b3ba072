//! Integrators against known images: furnaces, mirrors, textures, open and closed scenes; and
//! against themselves: seeds, slices, structures, with and without direct light.

mod bits;
mod blocks;
mod colors;
mod estimators;
mod facets;

mod furnace;
mod model;
mod ray_counts;
mod sides;

/// Default number of bounces: tests that share it share their kernels.
const MAX_DEPTH: i64 = 6;

//! Tests of hits: structures, builders and traversals, triangle tests, the correctness check.

#[path = "../support/mod.rs"]
mod support;

mod animation;
mod builders;
mod coherence;
mod cracks;
mod divide_and_conquer;
mod faults;
mod gate;
mod grids;
mod instances;
mod intersectors;
mod peers;
mod ray_hierarchy;
mod real_scenes;
mod shadow_rays;
mod slivers;
mod spatial;
mod structures;
mod together;
mod traversals;
mod wide;

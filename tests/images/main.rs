//! Tests of rendering: samplers, materials, lights, integrators, and the image references.

#[path = "../support/mod.rs"]
mod support;

mod adaptive;
mod adding_a_light;
mod adding_a_material;
mod dielectric;
mod foreign;
mod image_gate;
mod integrators;
mod known_images;
mod lights;
mod masks;
mod materials;
mod primary_visibility;
mod sampler_images;
mod sampler_measures;
mod samplers;

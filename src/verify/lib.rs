//! Checks of hits and images: the gate, the path oracle, closed-form images, Mitsuba.
#![warn(missing_docs)]

#[cfg(test)]
mod connection_tests;
mod end_rays;
pub mod full_stacks;
pub mod gate;
pub mod hard_rays;
mod holes;
pub mod image_gate;
mod instance_reference;
mod kept_checks;
pub mod kinds;
pub mod known_images;
pub mod lights;
pub mod materials;
#[cfg(test)]
mod media_colour_tests;
#[cfg(test)]
mod media_tests;
mod mesh;
pub mod mitsuba;
mod no_rays;
pub mod path_oracle;
pub mod peer_check;
mod pixels;
pub mod ray_classes;
pub mod ray_counts;
pub mod rays;
pub mod scene_record;
pub mod self_test;
#[cfg(test)]
mod several_media_tests;
pub mod shadow_rays;
pub mod strained_copies;
#[cfg(test)]
#[allow(dead_code, unreachable_pub, reason = "other tests use the rest")]
#[path = "../../tests/support/tier.rs"]
mod tier;
mod trial_lights;
mod trial_media;
mod trial_mirrors;
mod trial_reach;
pub mod trial_scenes;
mod trial_slivers;
mod trial_surfaces;
pub mod twin_work;

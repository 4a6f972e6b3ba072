//! Cones in the place of rays (Roger 2008, chapter 5): one cone a pixel, the exact part of it that each triangle covers,
//! the nearest of these layers blended, and how far the image stays off what distributed rays converge to.
//!
//! [`disk`] has the overlap in f32 and f64; its kernel is `kernels/cones/disk.wesl`. [`quadrature`] knows it in f64 and
//! shares no code with it. `docs/cones.md` says what is measured.
#![warn(missing_docs)]

pub mod check;
pub mod cone;
pub mod device;
pub mod disk;
mod figures;
pub mod known_figures;
pub mod level;
pub mod lobe;
mod measure;
pub mod oracle;
pub mod quadrature;
pub mod rays;
pub mod sample;
pub mod scene;
mod spheres;
mod ties;
pub mod trace;
mod world;

pub use measure::register;

#[cfg(test)]
mod tests;

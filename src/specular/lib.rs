//! The point of a smooth reflector at which light from a vertex turns to the eye, searched for step by step (Roger
//! 2008, chapter 2).
//!
//! [`solve`] has the search in f32 and f64, by the secants of the thesis or by Newton's method; its kernel is
//! `kernels/specular/solve.wesl`. [`oracle`] knows all points of reflection in f64 and shares no code with it.
//! `docs/specular.md` says what is measured.
#![warn(missing_docs)]

pub mod device;
mod judge;
pub mod known_figures;
mod measure;
pub mod newton;
pub mod oracle;
pub mod path;
pub mod real;
pub mod reflector;
mod scene;
pub mod secant;
pub mod solve;

pub use measure::register;

#[cfg(test)]
mod tests;

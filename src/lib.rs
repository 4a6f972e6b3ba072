//! Raystone: a proving ground for ray-tracing acceleration structures and samplers.
//!
//! One config-driven harness swaps acceleration structures and sampling schemes under one GPU path
//! tracer, on the same rays, and reports Mrays/s, star discrepancy and error curves. Data flows one
//! way:
//!
//! ```text
//! config → scene → accel → gpu → integrator → measure → report
//! ```
//!
//! Each of these is a crate of its own below this one, which has the command line and names them all.
//!
//! Every figure is gated for truth before it is printed: a structure whose hits differ from the
//! reference tracer's gets no speed.
#![warn(missing_docs)]

#[path = "confirm.rs"]
pub mod confirm;
mod reproduce;

pub use raystone_accel as accel;
pub use raystone_accel::oracle;
pub use raystone_advice as advice;
pub use raystone_bench::{coherence, peers, run};
pub use raystone_cones as cones;
pub use raystone_config as config;
pub use raystone_core::{
    __parameter, atomic, geometry, parameters, params, program, random, store, structure, text,
};
pub use raystone_discrepancy as discrepancy;
pub use raystone_gpu as gpu;
pub use raystone_gpu::compaction;
pub use raystone_image as image;
pub use raystone_media as media;
pub use raystone_render as integrator;
pub use raystone_report as report;
pub use raystone_report::{export, history};
pub use raystone_sampling as sampling;
pub use raystone_scene as scene;
pub use raystone_specular as specular;
pub use raystone_stress as stress;

/// Comparisons of records, and the runs that confirm them.
pub mod compare {
    pub use crate::confirm;
    pub use raystone_report::compare::*;
}

/// What is measured, and what it is held against: checks, figures, statistics, records.
pub mod measure {
    pub use raystone_bench::{
        animation, compaction, environment, figure_registry, known_pictures, known_words, memory,
        ray_sets, sampler_cost, spectrum, stopping, stream, timing, words,
    };
    pub use raystone_record as record;
    pub use raystone_record::{figure, replicates};
    pub use raystone_stats::{
        adaptive, bias, comparison, flip, growth, heavy_tails, hypothesis, interval, known_figures,
        metrics, signed_rank, statistics,
    };
    pub use raystone_verify::*;
}

/// Tables of theses: the runs behind them, and verdicts on what they claim.
pub mod repro {
    pub use raystone_report::repro::*;

    /// Tables, run and compared with what they claim.
    pub mod run {
        pub use crate::reproduce::{ReproError, reproduce};
        pub use raystone_report::repro::table::*;
    }
}

/// Everything that can be named in this program: what the crates below register, the parts of the stress suite, and the measurements of media, of searches for points of reflection, and of cones.
pub fn registries() -> run::Registries {
    let mut registries = run::Registries::default();
    // Their names are their own: a test of the suite adds them to the same registries.
    let added = stress::register(&mut registries)
        .and_then(|()| media::register(&mut registries))
        .and_then(|()| specular::register(&mut registries))
        .and_then(|()| cones::register(&mut registries));
    debug_assert_eq!(added, Ok(()));
    registries
}

/// This program: what it was built from.
pub const PROGRAM: program::Program = program::Program {
    version: env!("CARGO_PKG_VERSION"),
    commit: option_env!("RAYSTONE_COMMIT"),
    dirty: match option_env!("RAYSTONE_DIRTY") {
        // "true" or "false": constants compare no texts.
        Some(text) => Some(text.len() == 4),
        None => None,
    },
};

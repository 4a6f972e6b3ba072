//! Tests of the device: kernels, recordings, passes, organisations, and user additions.

#[path = "../support/mod.rs"]
mod support;

mod adding_a_figure;
mod adding_a_measurement;
mod adding_a_structure;
mod adding_a_triangle_test;
mod adding_an_integrator;
mod compaction;
mod device_builders;
mod kernel_folders;
mod kernels;
mod orders;
mod organisations;
mod pipelines;
mod portability;
mod recordings;
mod refill;
mod sorting;
mod specialisation;
mod storage_buffers;
mod viewer;
mod workgroups;

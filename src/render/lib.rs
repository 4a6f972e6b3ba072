//! Integrators: the work per sample, and the renderer that runs them.
#![warn(missing_docs)]

mod alias;
mod blocks;
mod builtin;
mod environment_tables;
pub mod integrand;
mod kind;
mod light_tables;
mod light_tree;
mod medium;
pub mod offset;
pub mod order;
pub mod organisation;
mod parts;
mod passes;
pub mod path;
mod registry;
mod render;
mod scene_kinds;
mod slice;
mod stage;
mod surface_tables;
mod tables;
mod units;
mod visibility;

pub use blocks::BLOCK_EDGE;
pub use environment_tables::environment_aliases;
pub use kind::{ConfiguredIntegrator, CountedRays, Integrator, IntegratorError, IntegratorFacts};
pub use light_tables::LightTables;
pub use light_tables::light_branches;
pub use light_tree::TreeNode;
pub use offset::{OffsetRegistry, RayOffset};
pub use order::Order;
pub use organisation::{Organisation, OrganisationRegistry};
pub use parts::{InOrder, PartRenderer};
pub use passes::ImageSteps;
pub use raystone_accel::Traced;
pub use raystone_core::structure::{RAY_COUNT_CLASSES, RAY_QUERIES, TRACED_CLASSES};
pub use registry::IntegratorRegistry;
pub use render::{BLOCK_SAMPLES, RenderJob, Renderer, Snapshot, rounding_bound, with_sampler};
pub use scene_kinds::{SceneKind, SceneKinds};
pub use stage::{Stage, StageError};
pub use surface_tables::SurfaceFeatures;
pub use tables::{SceneBuffers, SceneFeatures};
pub use visibility::Visibility;

//! What checks know of the kinds of materials and lights.

use crate::lights::LightRegistry;
use crate::materials::MaterialRegistry;

/// The rows of all kinds: those of the program, until more are registered.
#[derive(Clone, Default)]
pub struct KindChecks {
    /// Of materials.
    pub materials: MaterialRegistry,
    /// Of lights.
    pub lights: LightRegistry,
}

//! The checks of each kind of material and light.

use crate::lights::LightRegistry;
use crate::materials::MaterialRegistry;

/// The registered kinds: the built-in ones by default.
#[derive(Clone, Default)]
pub struct KindChecks {
    /// Materials.
    pub materials: MaterialRegistry,
    /// Lights.
    pub lights: LightRegistry,
}

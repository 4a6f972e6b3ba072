//! The registry of integrators: one line each.

use super::builtin::{AmbientOcclusion, Primary};
use super::integrand::INTEGRANDS;
use super::path::Path;
use super::{ConfiguredIntegrator, Integrator, IntegratorError};
use crate::params::{Kinds, Named, ParameterSchema, Sources, Variant};
use crate::text::nearest;

/// Everything that can be named on the `integrator` axis.
pub type IntegratorRegistry = Kinds<dyn Integrator>;

impl Default for IntegratorRegistry {
    fn default() -> Self {
        let kinds = [&Primary as &dyn Integrator, &AmbientOcclusion, &Path];
        let integrands = INTEGRANDS.iter().map(|i| i as &dyn Integrator);
        Self::new(kinds.into_iter().chain(integrands))
    }
}

impl Named for dyn Integrator {
    fn name(&self) -> &'static str {
        Integrator::name(self)
    }

    fn description(&self) -> &'static str {
        Integrator::description(self)
    }

    fn parameters(&self) -> ParameterSchema {
        Integrator::parameters(self)
    }

    fn sources(&self) -> Sources {
        Integrator::sources(self)
    }
}

impl IntegratorRegistry {
    /// The integrator of a variant, with its parameters.
    ///
    /// # Errors
    /// A name that is not registered, or parameters that the integrator does not have.
    pub fn configured(&self, variant: &Variant) -> Result<ConfiguredIntegrator, IntegratorError> {
        let unknown = || IntegratorError::Unknown {
            name: variant.name.clone(),
            nearest: nearest(&variant.name, self.iter().map(|k| k.name())),
        };
        let kind = self.get(&variant.name).ok_or_else(unknown)?;
        ConfiguredIntegrator::new(kind, variant)
    }
}

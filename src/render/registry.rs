//! The registry of integrators: one line each.

use super::builtin::{AmbientOcclusion, Primary};
use super::integrand::INTEGRANDS;
use super::path::Path;
use super::{ConfiguredIntegrator, Integrator, IntegratorError};
use raystone_core::params::{Kinds, Named, ParameterSchema, Sources, Variant};
use raystone_core::text::nearest;
use std::ops::{Deref, DerefMut};

/// The values of the `integrator` axis.
#[derive(Clone, Default)]
pub struct IntegratorRegistry(Kinds<dyn Integrator>);

impl Deref for IntegratorRegistry {
    type Target = Kinds<dyn Integrator>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for IntegratorRegistry {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

impl Named for dyn Integrator {
    fn built_in() -> Vec<&'static Self> {
        let kinds = [&Primary as &dyn Integrator, &AmbientOcclusion, &Path];
        let integrands = INTEGRANDS.iter().map(|i| i as &dyn Integrator);
        kinds.into_iter().chain(integrands).collect()
    }

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
    /// An unknown name, or an unknown parameter of the integrator.
    pub fn configured(&self, variant: &Variant) -> Result<ConfiguredIntegrator, IntegratorError> {
        let unknown = || IntegratorError::Unknown {
            name: variant.name.clone(),
            nearest: nearest(&variant.name, self.iter().map(|k| k.name())),
        };
        let kind = self.get(&variant.name).ok_or_else(unknown)?;
        ConfiguredIntegrator::new(kind, variant)
    }
}

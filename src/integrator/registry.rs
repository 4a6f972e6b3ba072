//! The registry of integrators: one line each.

use super::builtin::{AmbientOcclusion, Path, Primary};
use super::integrand::INTEGRANDS;
use super::{ConfiguredIntegrator, Integrator, IntegratorError};
use crate::params::{Entry, Variant};
use crate::text::nearest;

/// Everything that can be named on the `integrator` axis.
#[derive(Clone)]
pub struct IntegratorRegistry {
    kinds: Vec<&'static dyn Integrator>,
}

impl Default for IntegratorRegistry {
    fn default() -> Self {
        let mut kinds: Vec<&'static dyn Integrator> = vec![&Primary, &AmbientOcclusion, &Path];
        kinds.extend(INTEGRANDS.iter().map(|i| i as &dyn Integrator));
        Self { kinds }
    }
}

impl IntegratorRegistry {
    /// Adds an integrator; it replaces one of the same name.
    pub fn register(&mut self, kind: &'static dyn Integrator) {
        self.kinds.retain(|k| k.name() != kind.name());
        self.kinds.push(kind);
    }

    /// The integrator of this name.
    pub fn get(&self, name: &str) -> Option<&'static dyn Integrator> {
        self.iter().find(|k| k.name() == name)
    }

    /// All integrators.
    pub fn iter(&self) -> impl Iterator<Item = &'static dyn Integrator> + '_ {
        self.kinds.iter().copied()
    }

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

    /// Names, descriptions and parameters for parser, help and docs.
    pub fn entries(&self) -> Vec<Entry> {
        let entry = |k: &'static dyn Integrator| Entry {
            name: k.name().to_owned(),
            description: k.description().to_owned(),
            schema: k.parameters(),
        };
        self.iter().map(entry).collect()
    }
}

//! The registry of organisations: one line each.

use super::{MultiKernel, Organisation, Regeneration, SingleKernel, Wavefront};
use raystone_core::params::{Parameters, Registered, Registry, Variant};
use raystone_core::text::did_you_mean;
use std::sync::Arc;

/// All organisations by name; more can be added.
#[derive(Clone)]
pub struct OrganisationRegistry(pub Registry<dyn Organisation>);

impl Default for OrganisationRegistry {
    fn default() -> Self {
        Self(Registry::new(vec![
            organisation_kind::<SingleKernel>("single-kernel"),
            organisation_kind::<Regeneration>("regeneration"),
            organisation_kind::<MultiKernel>("multi-kernel"),
            organisation_kind::<Wavefront>("wavefront"),
        ]))
    }
}

impl OrganisationRegistry {
    /// The organisation of a variant, with its parameters.
    ///
    /// # Errors
    /// A description of an unknown name or parameter.
    pub fn configured(&self, variant: &Variant) -> Result<Arc<dyn Organisation>, String> {
        let Some(kind) = self.0.find(&variant.name) else {
            let near = did_you_mean(&variant.name, self.0.iter().map(Registered::name));
            return Err(format!(
                "no organisation is called `{}`{near}",
                variant.name
            ));
        };
        let made = kind.make(&variant.params);
        made.map_err(|error| format!("{}: {error}", variant.name))
    }
}

/// An organisation that is its own parameter struct.
pub fn organisation_kind<O: Organisation + Parameters + 'static>(
    name: &str,
) -> Registered<dyn Organisation> {
    Registered::new::<O>(name, |params| Ok(Arc::new(O::from_params(params)?)))
}

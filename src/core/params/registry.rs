//! Registries: what a user can name, each with the struct of its parameters.

use super::{Entry, ParamError, Parameters, Params};
use std::sync::Arc;

/// One registered kind of `T`: what it is called, and how it is made from parameters.
pub struct Registered<T: ?Sized> {
    /// Name, description and parameters.
    pub entry: Entry,
    make: fn(&Params) -> Result<Arc<T>, ParamError>,
}

impl<T: ?Sized> Clone for Registered<T> {
    fn clone(&self) -> Self {
        Self {
            entry: self.entry.clone(),
            make: self.make,
        }
    }
}

impl<T: ?Sized> Registered<T> {
    /// A kind that `P` declares, whose doc comment says what it is; `make` is [`Parameters::from_params`]
    /// behind an `Arc<T>`.
    pub fn new<P: Parameters>(name: &str, make: fn(&Params) -> Result<Arc<T>, ParamError>) -> Self {
        Self {
            entry: Entry {
                name: name.to_owned(),
                description: P::ABOUT.to_owned(),
                schema: P::schema(),
            },
            make,
        }
    }

    /// Name as a user types it.
    pub fn name(&self) -> &str {
        &self.entry.name
    }

    /// This kind with these parameters, and the defaults of those that are missing.
    ///
    /// # Errors
    /// An unknown parameter, or a value out of its range.
    pub fn make(&self, params: &Params) -> Result<Arc<T>, ParamError> {
        (self.make)(params)
    }
}

/// All kinds of `T` that can be named, in the order of `raystone list`.
pub struct Registry<T: ?Sized>(Vec<Registered<T>>);

impl<T: ?Sized> Clone for Registry<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T: ?Sized> Registry<T> {
    /// A registry of these kinds.
    pub fn new(kinds: Vec<Registered<T>>) -> Self {
        Self(kinds)
    }

    /// Adds a kind; one of the same name is replaced.
    pub fn add(&mut self, kind: Registered<T>) {
        self.0.retain(|k| k.name() != kind.name());
        self.0.push(kind);
    }

    /// All kinds.
    pub fn iter(&self) -> impl Iterator<Item = &Registered<T>> {
        self.0.iter()
    }

    /// The kind of this name.
    pub fn find(&self, name: &str) -> Option<&Registered<T>> {
        self.iter().find(|kind| kind.name() == name)
    }

    /// Every kind with its parameters at their defaults.
    pub fn defaults(&self) -> impl Iterator<Item = Arc<T>> {
        self.iter()
            .filter_map(|kind| kind.make(&Params::default()).ok())
    }

    /// Names, descriptions and parameters, for parser, help and docs.
    pub fn entries(&self) -> Vec<Entry> {
        self.iter().map(|kind| kind.entry.clone()).collect()
    }
}

//! Registries of named kinds, each with its parameter struct.

use super::{Entry, ParamError, Parameters, Params};
use std::sync::Arc;

/// A registered kind of `T`: its entry, and its constructor.
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
    /// A kind declared by `P`, whose doc comment describes it; `make` wraps
    /// [`Parameters::from_params`] in an `Arc<T>`.
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

    /// Name as typed.
    pub fn name(&self) -> &str {
        &self.entry.name
    }

    /// Creates this kind with these parameters, and defaults for missing ones.
    ///
    /// # Errors
    /// An unknown parameter, or a value out of its range.
    pub fn make(&self, params: &Params) -> Result<Arc<T>, ParamError> {
        (self.make)(params)
    }
}

/// All named kinds of `T`, in the order of `raystone list`.
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

    /// Adds a kind, replacing one of the same name.
    pub fn add(&mut self, kind: Registered<T>) {
        self.0.retain(|k| k.name() != kind.name());
        self.0.push(kind);
    }

    /// All kinds.
    pub fn iter(&self) -> impl Iterator<Item = &Registered<T>> {
        self.0.iter()
    }

    /// Finds a kind by name.
    pub fn find(&self, name: &str) -> Option<&Registered<T>> {
        self.iter().find(|kind| kind.name() == name)
    }

    /// Every kind with default parameters.
    pub fn defaults(&self) -> impl Iterator<Item = Arc<T>> {
        self.iter()
            .filter_map(|kind| kind.make(&Params::default()).ok())
    }

    /// Names, descriptions and parameters, for parser, help and docs.
    pub fn entries(&self) -> Vec<Entry> {
        self.iter().map(|kind| kind.entry.clone()).collect()
    }
}

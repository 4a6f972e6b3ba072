//! Registries of static kinds that an axis can name.

use super::{Entry, ParameterSchema};
use crate::text::did_you_mean;

/// Paths and texts of additional kernel modules that are not part of the program.
pub type Sources = &'static [(&'static str, &'static str)];

/// A kind that a registry can hold.
pub trait Named: 'static {
    /// The program's own kinds, in the order of `raystone list`.
    fn built_in() -> Vec<&'static Self>;
    /// Name as typed.
    fn name(&self) -> &'static str;
    /// Returns one line: description and source (paper).
    fn description(&self) -> &'static str;
    /// Its parameters.
    fn parameters(&self) -> ParameterSchema {
        Vec::new()
    }
    /// Its additional kernel modules.
    fn sources(&self) -> Sources {
        &[]
    }
}

/// All named kinds of `T`, in the order of `raystone list`.
pub struct Kinds<T: ?Sized + 'static>(Vec<&'static T>);

impl<T: ?Sized> Clone for Kinds<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

/// The program's own kinds.
impl<T: Named + ?Sized> Default for Kinds<T> {
    fn default() -> Self {
        Self(T::built_in())
    }
}

impl<T: Named + ?Sized> Kinds<T> {
    /// A registry of these kinds.
    pub fn new(kinds: impl IntoIterator<Item = &'static T>) -> Self {
        Self(kinds.into_iter().collect())
    }

    /// Adds a kind, replacing one of the same name.
    pub fn register(&mut self, kind: &'static T) {
        self.0.retain(|k| k.name() != kind.name());
        self.0.push(kind);
    }

    /// Finds a kind by name.
    pub fn get(&self, name: &str) -> Option<&'static T> {
        self.iter().find(|kind| kind.name() == name)
    }

    /// Finds a kind by name; `what` names the kind of entry in the error message.
    ///
    /// # Errors
    /// No such kind exists; the message suggests the nearest name.
    pub fn named(&self, what: &str, name: &str) -> Result<&'static T, String> {
        self.get(name).ok_or_else(|| {
            let near = did_you_mean(name, self.iter().map(Named::name));
            format!("no {what} is called `{name}`{near}")
        })
    }

    /// All kinds.
    pub fn iter(&self) -> impl Iterator<Item = &'static T> + '_ {
        self.0.iter().copied()
    }

    /// Names, descriptions and parameters for parser, help and docs.
    pub fn entries(&self) -> Vec<Entry> {
        let entry = |kind: &'static T| Entry {
            name: kind.name().to_owned(),
            description: kind.description().to_owned(),
            schema: kind.parameters(),
        };
        self.iter().map(entry).collect()
    }

    /// Kernel modules of all registered kinds.
    pub fn sources(&self) -> impl Iterator<Item = (&'static str, &'static str)> + '_ {
        self.iter().flat_map(|kind| kind.sources().iter().copied())
    }
}

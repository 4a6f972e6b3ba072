//! Registries of kinds that stand for themselves: what an axis can name.

use super::{Entry, ParameterSchema};
use crate::text::nearest;

/// Paths and texts of kernel modules that something brings along, because they are not the program's.
pub type Sources = &'static [(&'static str, &'static str)];

/// What a registry has to know of a kind.
pub trait Named: 'static {
    /// All that the program brings along, in the order of `raystone list`.
    fn built_in() -> Vec<&'static Self>;
    /// Name as a user types it.
    fn name(&self) -> &'static str;
    /// One line: what it is and its source (paper).
    fn description(&self) -> &'static str;
    /// Its parameters.
    fn parameters(&self) -> ParameterSchema {
        Vec::new()
    }
    /// Kernel modules that it brings along.
    fn sources(&self) -> Sources {
        &[]
    }
}

/// Every kind of `T` that can be named, in the order of `raystone list`.
pub struct Kinds<T: ?Sized + 'static>(Vec<&'static T>);

impl<T: ?Sized> Clone for Kinds<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

/// What the program brings along.
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

    /// Adds a kind; it replaces one of the same name.
    pub fn register(&mut self, kind: &'static T) {
        self.0.retain(|k| k.name() != kind.name());
        self.0.push(kind);
    }

    /// The kind of this name.
    pub fn get(&self, name: &str) -> Option<&'static T> {
        self.iter().find(|kind| kind.name() == name)
    }

    /// The kind of this name, of which the message of an error says that it is a `what`.
    ///
    /// # Errors
    /// No kind is called so; the message names the nearest one.
    pub fn named(&self, what: &str, name: &str) -> Result<&'static T, String> {
        self.get(name).ok_or_else(|| {
            let near = nearest(name, self.iter().map(Named::name)).unwrap_or_default();
            format!("no {what} is called `{name}`; did you mean `{near}`?")
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

    /// The kernel modules that came with what was registered.
    pub fn sources(&self) -> impl Iterator<Item = (&'static str, &'static str)> + '_ {
        self.iter().flat_map(|kind| kind.sources().iter().copied())
    }
}

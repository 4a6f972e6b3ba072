//! Collects the mistakes of one file, to name them all at once.

use super::check::key_in;
use super::error::{ConfigError, Place};
use raystone_core::text::nearest;

/// Mistakes named at most: a file of another kind has any number.
const MOST: usize = 20;

/// The mistakes found so far.
#[derive(Default)]
pub(super) struct Faults(Vec<ConfigError>);

impl Faults {
    /// The value, or `None` if there is a mistake, which is kept.
    pub(crate) fn keep<T>(&mut self, result: Result<T, ConfigError>) -> Option<T> {
        match result {
            Ok(value) => return Some(value),
            Err(ConfigError::Several(all)) => all.into_iter().for_each(|one| self.add(one)),
            Err(one) => self.add(one),
        }
        None
    }

    /// Adds a mistake, unless it was found already.
    fn add(&mut self, fault: ConfigError) {
        if self.0.len() >= MOST {
            return;
        }
        let text = fault.to_string();
        if self.0.iter().all(|other| other.to_string() != text) {
            self.0.push(fault);
        }
    }

    /// Goes on if there is no mistake.
    ///
    /// # Errors
    /// The only mistake, or [`ConfigError::Several`].
    pub(crate) fn end(self) -> Result<(), ConfigError> {
        if self.0.is_empty() {
            Ok(())
        } else {
            Err(self.error())
        }
    }

    /// All mistakes in the order of the file. What is missing from a section with an unknown key, or
    /// from one whose name is misspelt, is most likely there, and is not named.
    fn error(self) -> ConfigError {
        let mut all = self.0;
        let unknown: Vec<String> = all.iter().filter_map(misspelt).collect();
        all.retain(|fault| match fault {
            ConfigError::Missing { key, .. } => {
                let section = key.rsplit_once('.').map_or("", |(section, _)| section);
                !unknown.contains(&key_in(section))
            }
            _ => true,
        });
        // What else is wrong with a misspelt section follows from its name.
        let mut before: Vec<Place> = Vec::new();
        all.retain(|fault| {
            let follows = matches!(
                fault,
                ConfigError::NotOnAxis { .. } | ConfigError::WrongType { .. }
            );
            let place = fault.place();
            let is_known = place.is_some_and(|place| before.contains(place));
            before.extend(place.cloned());
            !(follows && is_known)
        });
        all.sort_by_key(line);
        match all.pop() {
            Some(only) if all.is_empty() => only,
            last => ConfigError::Several(all.into_iter().chain(last).collect()),
        }
    }

    /// The value, if there is no mistake.
    ///
    /// # Errors
    /// As [`Self::end`].
    pub(crate) fn or<T>(self, value: T) -> Result<T, ConfigError> {
        self.end().map(|()| value)
    }
}

/// Both values.
///
/// # Errors
/// The mistakes of one or of both.
pub(super) fn both<A, B>(
    a: Result<A, ConfigError>,
    b: Result<B, ConfigError>,
) -> Result<(A, B), ConfigError> {
    match (a, b) {
        (Ok(a), Ok(b)) => Ok((a, b)),
        (a, b) => {
            let mut faults = Faults::default();
            faults.keep(a);
            faults.keep(b);
            Err(faults.error())
        }
    }
}

/// Where an unknown key stands, or the keys of the section that an unknown one stands for.
fn misspelt(fault: &ConfigError) -> Option<String> {
    let ConfigError::Unknown {
        what, name, known, ..
    } = fault
    else {
        return None;
    };
    match what.as_str() {
        "section" => nearest(name, known.iter().map(String::as_str)).map(key_in),
        _ => Some(what.clone()),
    }
}

/// The line in the file; what stands elsewhere comes last.
fn line(fault: &ConfigError) -> usize {
    match fault.place() {
        Some(Place::File { line, .. }) => *line,
        _ => usize::MAX,
    }
}

//! Counts of a model's deviations, for warnings.

use std::collections::BTreeMap;

/// Occurrences of one deviation, with the place of the first.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tally {
    pub count: usize,
    first: usize,
}

impl Tally {
    /// Counts an occurrence at `place`, such as a line.
    pub(crate) fn see(&mut self, place: usize) {
        if self.count == 0 || place < self.first {
            self.first = place;
        }
        self.count += 1;
    }

    pub(crate) fn see_if(&mut self, is_so: bool, place: usize) {
        if is_so {
            self.see(place);
        }
    }

    /// The warning `2 polygons cross themselves (first: line 6): …`; `None` if there was none.
    /// `what` is singular, then plural.
    pub(crate) fn note(&self, what: [&str; 2], place: &str, so: &str) -> Option<String> {
        let Self { count, first } = self;
        match count {
            0 => None,
            1 => Some(format!("1 {} ({place} {first}): {so}", what[0])),
            _ => Some(format!(
                "{count} {} (first: {place} {first}): {so}",
                what[1]
            )),
        }
    }
}

/// Everything in a text that is not read, by name.
#[derive(Default)]
pub(super) struct Unread(BTreeMap<String, Tally>);

impl Unread {
    /// Limit on the number of names: a file in another format has any number.
    const MOST: usize = 64;

    pub(crate) fn see(&mut self, what: &str, line: usize) {
        if let Some(tally) = self.0.get_mut(what) {
            tally.see(line);
        } else if self.0.len() < Self::MOST {
            self.0.entry(what.to_owned()).or_default().see(line);
        }
    }

    pub(crate) fn see_if(&mut self, is_so: bool, what: &str, line: usize) {
        if is_so {
            self.see(what, line);
        }
    }

    /// One warning for everything.
    pub(crate) fn note(&self) -> Option<String> {
        unread_warning(self.0.iter().map(|(what, tally)| {
            let Tally { count, first } = tally;
            let what = if what.contains(' ') {
                what.clone()
            } else {
                format!("`{what}`")
            };
            match count {
                1 => format!("{what} (line {first})"),
                _ => format!("{what} ({count} times, first: line {first})"),
            }
        }))
    }
}

/// One warning for everything in a file that is not read; `None` if there is nothing.
pub(super) fn unread_warning(what: impl Iterator<Item = String>) -> Option<String> {
    const SHOWN: usize = 32;
    let what: Vec<String> = what.collect();
    let shown = what[..what.len().min(SHOWN)].join(", ");
    let more = match what.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    (!what.is_empty())
        .then(|| format!("not read, and drawn as if it were not there: {shown}{more}"))
}

//! The part of long lists that a run of the tests covers: everything with `RAYSTONE_FULL=1`, which `scripts/test --full`
//! sets, else a part, and with the next commit another part. `docs/testing.md` has a row for each list.

use std::fmt::Display;
use std::process::Command;
use std::sync::OnceLock;

/// Number of parts where a test names no other.
const PARTS: usize = 3;
/// Of lists of planted faults. They test the tests, which change more rarely than what these check.
const PARTS_OF_FAULTS: usize = 9;

/// Returns `true` if this run covers everything; a table is always rewritten as a whole.
pub fn is_full() -> bool {
    let is_set = |name| std::env::var(name).is_ok_and(|value| !["", "0"].contains(&&*value));
    is_set("RAYSTONE_FULL") || is_set("RAYSTONE_WRITE_HASHES")
}

/// Returns the turn: `RAYSTONE_ROTATION`, which `scripts/test` sets and prints, else by the commit.
pub fn turn() -> usize {
    static TURN: OnceLock<usize> = OnceLock::new();
    *TURN.get_or_init(|| match std::env::var("RAYSTONE_ROTATION") {
        Ok(text) => {
            (text.parse()).unwrap_or_else(|_| panic!("RAYSTONE_ROTATION={text} is no number"))
        }
        // A package has no commit.
        Err(_) => commit().unwrap_or_default(),
    })
}

/// The first seven digits of the commit.
fn commit() -> Option<usize> {
    let mut git = Command::new("git");
    git.args(["-C", env!("CARGO_MANIFEST_DIR"), "rev-parse", "HEAD"]);
    let text = String::from_utf8(git.output().ok()?.stdout).ok()?;
    usize::from_str_radix(text.get(..7)?, 16).ok()
}

/// Returns the places of a list of `count` that are covered in this turn: one of `parts`, with another start in every list;
/// never none of a list that has any.
pub fn places(list: &str, count: usize, parts: usize, turn: usize) -> Vec<usize> {
    let parts = parts.min(count).max(1);
    let begin = list.bytes().map(usize::from).sum::<usize>() + turn % parts;
    (0..count)
        .filter(|at| (at + begin).is_multiple_of(parts))
        .collect()
}

/// A third of `all`, or all of it: see the head of this module.
pub fn in_turn<T>(list: &str, all: impl IntoIterator<Item = T>) -> Vec<T> {
    one_of(PARTS, list, all)
}

/// A ninth of a list of planted faults, or all of it.
pub fn faults_in_turn<T>(list: &str, all: impl IntoIterator<Item = T>) -> Vec<T> {
    one_of(PARTS_OF_FAULTS, list, all)
}

/// One of so many parts of `all`, or all of it.
pub fn one_of<T>(parts: usize, list: &str, all: impl IntoIterator<Item = T>) -> Vec<T> {
    let all: Vec<T> = all.into_iter().collect();
    if is_full() {
        return all;
    }
    let count = all.len();
    let places = places(list, count, parts, turn());
    told(list, places.len(), count);
    let taken = all.into_iter().enumerate();
    let taken = taken.filter(|(at, _)| places.contains(at));
    taken.map(|(_, item)| item).collect()
}

/// Returns the number of random samples: few, or as many as a full run has.
pub fn so_many(list: &str, few: u64, full: u64) -> u64 {
    let count = if is_full() { full } else { few };
    told(list, count, full);
    count
}

fn told(list: &str, taken: impl Display, of: impl Display) {
    println!("{list}: {taken} of {of} (RAYSTONE_ROTATION={})", turn());
}

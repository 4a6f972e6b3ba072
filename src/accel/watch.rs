//! A log of CPU traversals: every node visited and every triangle tested, with the memory read for
//! them, for one ray at a time.
//!
//! The log is thread-local, so that traversals need not pass it along. When logging is off, an
//! event only costs the check of one flag.

use super::ray::Hit;
use std::cell::{Cell, RefCell};

/// Host memory read by a CPU version where a kernel reads the array with the same layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Read {
    /// Address of the first byte.
    pub address: usize,
    /// Number of bytes.
    pub bytes: u32,
}

impl Read {
    /// The memory of this value.
    pub fn of<T: ?Sized>(what: &T) -> Self {
        Self {
            address: std::ptr::from_ref(what).cast::<u8>() as usize,
            bytes: size_of_val(what) as u32,
        }
    }
}

/// An event of a traversal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// Visit of a node or cell, with its index in the structure.
    Node(u32),
    /// Test of the triangle with this index.
    Triangle(u32),
    /// The triangle tested last is the nearest so far.
    Nearest(Hit),
    /// A read for the next visit or test.
    Read(Read),
}

/// Events beyond this are only counted: a longer log, as of brute force, is of no use.
const MOST_EVENTS: usize = 1 << 20;

thread_local! {
    static IS_WATCHED: Cell<bool> = const { Cell::new(false) };
    static EVENTS: RefCell<Vec<Event>> = const { RefCell::new(Vec::new()) };
}

/// Runs `work` on this thread and returns its log, in order.
pub fn watch<T>(work: impl FnOnce() -> T) -> (T, Vec<Event>) {
    EVENTS.take();
    IS_WATCHED.set(true);
    let result = work();
    IS_WATCHED.set(false);
    (result, EVENTS.take())
}

/// Records a read, if logging is on, and returns its argument.
#[inline(always)]
pub(super) fn read<T: ?Sized>(what: &T) -> &T {
    if IS_WATCHED.get() && size_of_val(what) > 0 {
        keep(Event::Read(Read::of(what)));
    }
    what
}

/// The words of a list, each recorded when it is read.
pub(super) fn each(list: &[u32]) -> impl Iterator<Item = u32> {
    list.iter().map(|word| *read(word))
}

/// Records an event, if logging is on.
#[inline(always)]
pub(super) fn note(event: Event) {
    if IS_WATCHED.get() {
        keep(event);
    }
}

#[cold]
fn keep(event: Event) {
    EVENTS.with_borrow_mut(|events| {
        if events.len() < MOST_EVENTS {
            events.push(event);
        }
    });
}

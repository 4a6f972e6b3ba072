//! What a twin looks at: every node it visits and every triangle it tests, for one ray at a time.
//!
//! The log belongs to the thread, so that twins need not carry it. While nobody watches, an event costs
//! the look at one flag.

use super::ray::Hit;
use std::cell::{Cell, RefCell};

/// Something that a twin did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// It visited a node or cell; its place among the structure's own.
    Node(u32),
    /// It tested the triangle with this index.
    Triangle(u32),
    /// The triangle tested last is the nearest so far.
    Nearest(Hit),
}

/// Events beyond this many are counted and not kept: the log of brute force over a large scene is of no
/// use.
const MOST_EVENTS: usize = 1 << 20;

thread_local! {
    static IS_WATCHED: Cell<bool> = const { Cell::new(false) };
    static EVENTS: RefCell<Vec<Event>> = const { RefCell::new(Vec::new()) };
}

/// Runs `work` on this thread and returns what it looked at, in order.
pub fn watch<T>(work: impl FnOnce() -> T) -> (T, Vec<Event>) {
    EVENTS.take();
    IS_WATCHED.set(true);
    let result = work();
    IS_WATCHED.set(false);
    (result, EVENTS.take())
}

/// Notes an event, if anybody watches.
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

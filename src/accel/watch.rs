//! What a twin looks at: every node it visits and every triangle it tests, with the memory that it reads for
//! them, for one ray at a time.
//!
//! The log belongs to the thread, so that twins need not carry it. While nobody watches, an event costs
//! the look at one flag.

use super::ray::Hit;
use std::cell::{Cell, RefCell};

/// Memory of the host that a twin reads where a kernel reads the array that is laid out like it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Read {
    /// Of the first byte.
    pub address: usize,
    /// How many.
    pub bytes: u32,
}

impl Read {
    /// All of this.
    pub fn of<T: ?Sized>(what: &T) -> Self {
        Self {
            address: std::ptr::from_ref(what).cast::<u8>() as usize,
            bytes: size_of_val(what) as u32,
        }
    }
}

/// Something that a twin did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// It visited a node or cell; its place among the structure's own.
    Node(u32),
    /// It tested the triangle with this index.
    Triangle(u32),
    /// The triangle tested last is the nearest so far.
    Nearest(Hit),
    /// It read this for the visit or the test that comes next.
    Read(Read),
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

/// Notes that something is read, if anybody watches, and hands it on.
#[inline(always)]
pub(super) fn read<T: ?Sized>(what: &T) -> &T {
    if IS_WATCHED.get() && size_of_val(what) > 0 {
        keep(Event::Read(Read::of(what)));
    }
    what
}

/// The words of a list, each read when its turn comes.
pub(super) fn each(list: &[u32]) -> impl Iterator<Item = u32> {
    list.iter().map(|word| *read(word))
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

//! The faults, one row each.

mod binary;
mod cells;
mod counts;
mod divide;
mod ends;
mod frames;
mod hard;
mod image;
mod instanced;
mod late_samples;
mod media;
mod narrow;
mod path_lights;
mod paths;
mod rays;
mod reach;
mod samplers;
mod shared;
mod specular;
mod stacks;
mod wide;
mod words;

use crate::subject::Changes;
use crate::{Check, Mutant, Plant, Subject};
use raystone::accel::GpuBuffers;

/// All faults.
pub fn mutants() -> Vec<Mutant> {
    [
        binary::MUTANTS,
        wide::MUTANTS,
        cells::MUTANTS,
        instanced::MUTANTS,
        ends::MUTANTS,
        hard::MUTANTS,
        samplers::MUTANTS,
        late_samples::MUTANTS,
        shared::MUTANTS,
        reach::MUTANTS,
        image::MUTANTS,
        paths::MUTANTS,
        specular::MUTANTS,
        path_lights::MUTANTS,
        media::MUTANTS,
        frames::MUTANTS,
        counts::MUTANTS,
        rays::MUTANTS,
        stacks::MUTANTS,
        divide::MUTANTS,
        narrow::MUTANTS,
    ]
    .concat()
}

const fn structure(name: &'static str, changes: Changes) -> Subject {
    Subject::Structure { name, changes }
}

const fn row(
    name: &'static str,
    what: &'static str,
    plant: Plant,
    subject: Subject,
    expected: Check,
) -> Mutant {
    Mutant {
        name,
        what,
        plant,
        subject,
        expected,
        equivalent: None,
        hangs: false,
    }
}

/// A fault that no check can be relied on to see, and why.
const fn equivalent(mutant: Mutant, why: &'static str) -> Mutant {
    Mutant {
        equivalent: Some(why),
        ..mutant
    }
}

/// A text that occurs in the kernel once.
const fn text(file: &'static str, from: &'static str, to: &'static str) -> Plant {
    texts(file, from, to, 1)
}

const fn texts(file: &'static str, from: &'static str, to: &'static str, times: usize) -> Plant {
    Plant::Kernel {
        file,
        from,
        to,
        times,
    }
}

const fn built(part: &'static str, change: fn(&mut GpuBuffers) -> usize) -> Plant {
    Plant::Built { part, change }
}

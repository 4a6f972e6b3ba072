//! Comparison of runs: required findings, and alarms it must not raise.

mod alarms;
mod evidence;
mod inputs;
mod judged;
mod kernels;
mod limits;
mod machine;
mod program;
mod records;
mod seeds;
mod shown;

use raystone::compare::judge::ChangeVerdict;
use raystone::compare::side::Side;
use raystone::compare::{Comparison, Confirmed, Finding, Options, compare_sides};

fn compared(base: &Side, candidate: &Side) -> Comparison {
    compare_sides(base, candidate, &Options::default(), &Confirmed::new())
}

/// Findings of a figure other than "same".
fn said<'a>(found: &'a Comparison, figure: &'a str) -> impl Iterator<Item = &'a Finding> {
    let of = move |f: &&Finding| f.figure.id == figure && f.verdict != ChangeVerdict::Same;
    found.findings.iter().filter(of)
}

//! Known values, brute force, property oracles and bad input.

mod bounds;
mod nets;
mod quadratic;
mod sets;
mod star;

use super::*;

/// Time enough for any small set.
fn ample() -> Budget {
    Budget::seconds(600.0)
}

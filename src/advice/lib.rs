//! Which structure for which scene (the question of Dufay 2017, 4.4): features of a scene that are cheap to know
//! ([`SceneFeatures`]), a table of weights that is fitted on measured times ([`AdviceTable`], [`fit`]), and the choice with
//! the least predicted cost of building and tracing ([`AdviceTable::advise`]).
//!
//! A cost is a product of powers: its logarithm is linear in the logarithms of the features. That is as much as some forty
//! scenes can support, and a person can read the weights.
#![warn(missing_docs)]

mod features;
mod fit;
mod predict;
mod table;
mod trial;

pub use features::{FEATURES, SceneFeatures};
pub use fit::{Sample, fit};
pub use predict::{Demand, Prediction, check_known};
pub use table::{AdviceError, AdviceTable, CLASSES, Choice, Costs};
pub use trial::{Regret, Trial, leave_one_out, trial};

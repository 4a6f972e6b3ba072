//! The core of an interactive view: what is on screen, the frames that lead there, and their figures.
//!
//! A [`Screen`] says what is shown, in the words of an experiment file. A [`Viewer`] is given one after the other, loads, builds and
//! compiles what has changed, and is stepped by a shell between two looks at its user. It knows no window, no files but through
//! `core::files`, and no clock but `core::clock`.
#![warn(missing_docs)]

mod camera;
mod cycles;
mod display;
mod done;
mod experiment;
mod frame;
mod inspect;
mod maps;
mod motion;
mod points;
mod reference;
mod screen;
mod side;
mod viewer;
mod world;

pub use camera::{Motion, moved, projected};
pub use display::Display;
pub use done::{Done, Step, Work};
pub use frame::{Figures, Frame, RaysOfClass, SideFrame};
pub use inspect::{Grasp, Inspection, Seen, Trail};
pub use motion::{FrameTimes, SideTimes};
pub use points::SamplePoints;
pub use screen::{SIDE_NAMES, START, Screen};
pub use viewer::Viewer;

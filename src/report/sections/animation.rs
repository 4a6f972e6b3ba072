//! Refitting against building anew, frame by frame of a moving scene.

use crate::config::{Animation, Motion};
use crate::measure::record::{
    AnimationRecord, Cost, FrameRays, FrameRecord, Interval, Key, Measured2, axis,
};

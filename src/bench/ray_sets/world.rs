//! The rooms of sets of rays, on the host.

use super::{Bounce, Room, room};
use crate::run::Absent;
use raystone_accel::{BuildLog, BuiltBvh, BvhParameters, TriangleSoup};
use raystone_gpu::{Gpu, probe_arithmetic};
use std::sync::{Arc, Mutex, PoisonError};

/// A room on the host, with what judges answers in it.
pub(super) struct World {
    room: Room,
    /// The triangles, and those of the first frame if they have moved.
    pub soup: TriangleSoup,
    pub first: Option<TriangleSoup>,
    pub judge: BuiltBvh,
    pub exact: bool,
    truth: Mutex<Option<Truth>>,
}

/// What lobes see.
struct Truth {
    /// Edge of the image, waves and half-angle.
    of: [f64; 3],
    /// Pixel by pixel.
    brightness: Arc<Vec<f64>>,
}

impl World {
    pub(super) fn new(gpu: &Gpu, room: &Room) -> Result<Self, Absent> {
        let still = room::room(room.squares);
        let (soup, first) = if room.moved > 0.0 {
            (room::moved(&still, room.moved as f32), Some(still))
        } else {
            (still, None)
        };
        let parameters = BvhParameters::default();
        let judge = BuiltBvh::build(&soup, &parameters, &mut BuildLog::default());
        let judge = judge.map_err(|error| Absent::Failed(error.to_string()))?;
        Ok(Self {
            room: room.clone(),
            soup,
            first,
            judge,
            exact: probe_arithmetic(gpu)?.is_exact(),
            truth: Mutex::default(),
        })
    }

    /// Whether it has the triangles of a room.
    pub(super) fn is_of(&self, room: &Room) -> bool {
        (self.room.squares, self.room.moved) == (room.squares, room.moved)
    }

    /// The brightness that these lobes see; samplers and structures share the last one.
    pub(super) fn truth(&self, of: &Bounce, find: impl FnOnce() -> Vec<f64>) -> Arc<Vec<f64>> {
        let of = [f64::from(of.room.side), of.waves, of.spread];
        let mut last = self.truth.lock().unwrap_or_else(PoisonError::into_inner);
        match &*last {
            Some(truth) if truth.of == of => Arc::clone(&truth.brightness),
            _ => {
                let brightness = Arc::new(find());
                *last = Some(Truth {
                    of,
                    brightness: Arc::clone(&brightness),
                });
                brightness
            }
        }
    }
}

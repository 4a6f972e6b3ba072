//! Default light for scenes without any.

use super::Framing;
use glam::Vec3;

/// Sky for a scene without a light: a vertical grey gradient and a soft key light from above, left
/// and in front, to reveal shapes. Radiance is `kernels/shading/light/sky.wesl` times
/// [`super::SceneData::environment`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Daylight {
    /// Unit vector to the zenith.
    pub up: Vec3,
    /// Unit vector to the centre of the key light.
    pub key: Vec3,
    /// Bounced rays longer than this (scene units) see the sky; otherwise rooms without a lamp
    /// would be dark. Outside rooms it is the largest number.
    pub reach: f32,
}

/// Reach in rooms, relative to the least extent of the scene.
const REACH: f32 = 0.25;

impl Daylight {
    pub(super) fn over(framing: &Framing) -> Self {
        let [right, up, front] = framing.axes();
        Self {
            up,
            key: (-0.45 * right + 0.74 * up + 0.5 * front).normalize(),
            reach: if framing.is_room() {
                REACH * framing.least_extent()
            } else {
                f32::MAX
            },
        }
    }

    pub(super) fn note(&self) -> String {
        let mut note = "the scene has no light: lit by a grey sky with a key light".to_owned();
        if self.reach < f32::MAX {
            note += &format!(", seen through what is farther than {:.3}", self.reach);
        }
        note
    }
}

impl Default for Daylight {
    /// The sky over an object standing on the y axis.
    fn default() -> Self {
        Self::over(&Framing::default())
    }
}

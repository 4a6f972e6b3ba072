//! The light of scenes that bring none.

use super::Framing;
use glam::Vec3;

/// A sky over a scene without a light: grey from below to above, and a soft key light from above, left
/// and in front, so that shapes show. Its radiance is `kernels/shading/light/sky.wesl` times
/// [`super::SceneData::environment`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Daylight {
    /// Unit vector to the zenith.
    pub up: Vec3,
    /// Unit vector to the middle of the key light.
    pub key: Vec3,
    /// Bounced rays that go farther than this see the sky, scene units: rooms without a lamp would be
    /// dark. Outside of rooms it is the largest number.
    pub reach: f32,
}

/// Reach in rooms, in the least extent of the scene.
const REACH: f32 = 0.25;

impl Daylight {
    /// The sky over a scene.
    pub(super) fn over(framing: &Framing) -> Self {
        let [right, up, front] = framing.axes();
        Self {
            up,
            key: (-0.45 * right + 0.74 * up + 0.5 * front).normalize(),
            reach: match framing.is_room() {
                true => REACH * framing.least_extent(),
                false => f32::MAX,
            },
        }
    }

    /// What the report of a scene says of it.
    pub(super) fn note(&self) -> String {
        let mut note = "the scene has no light: lit by a grey sky with a key light".to_owned();
        if self.reach < f32::MAX {
            note += &format!(", seen through what is farther than {:.3}", self.reach);
        }
        note
    }
}

impl Default for Daylight {
    /// The sky over an object that stands on the y axis.
    fn default() -> Self {
        Self::over(&Framing::default())
    }
}

//! How many spheres around triangles meet a cone: what is left out wrongly shows in few pixels, and what is counted in none.

use crate::oracle::{Oracle, beam};
use crate::scene::Patch;

/// What f32 may be off in the distance of a sphere from a cone, as a part of the distance from its apex, and in units.
const OFF_SPHERE: [f64; 2] = [1e-4, 1e-6];

impl Oracle<'_> {
    /// The least and the greatest number of triangles whose spheres may meet a pixel's cone, by the angles between the axis, the
    /// middle and the cone.
    pub fn cut(&self, pixel: u32) -> [u32; 2] {
        let beam = beam(&self.given.camera, &self.lens, pixel);
        let room = |patch: &Patch<f64>| {
            let to = patch.centre.f64() - beam.apex;
            let far = to.length();
            let off = OFF_SPHERE[0] * far + OFF_SPHERE[1];
            let beside = far * (to.angle_between(beam.axis) - beam.angle).sin();
            let before = beam.near - to.dot(beam.axis);
            (patch.radius - beside.max(before), off)
        };
        let rooms = self.patches.iter().map(room);
        rooms.fold([0, 0], |[least, most], (room, off)| {
            [least + u32::from(room > off), most + u32::from(room > -off)]
        })
    }
}

//! The search on the device.

use crate::newton::{Search, Solved};
use crate::path::Setup;
use crate::real::V3;
use glam::DVec3;
use raystone_gpu::{
    Bindings, Composition, Elapsed, Gpu, GpuError, Player, Recording, Storage, UniformValues,
    groups_for,
};

/// Vertices on the device, and where their searches begin.
pub struct Solver {
    recording: Recording,
    player: Player,
}

impl Solver {
    /// Uploads vertices. `given` has directions to begin at, where the search asks for them.
    ///
    /// # Errors
    /// An array exceeds what the adapter binds, or the kernel does not compile.
    pub fn new(
        gpu: &Gpu,
        setup: &Setup<f32>,
        search: &Search<f32>,
        vertices: &[DVec3],
        given: &[DVec3],
    ) -> Result<Self, GpuError> {
        let words = |all: &[DVec3]| -> Vec<[f32; 4]> {
            let all = all.iter().map(|v| v.as_vec3().extend(0.0).to_array());
            all.collect()
        };
        let count = vertices.len() as u32;
        let begins = match given {
            [] => vec![[0.0; 4]; 3],
            _ => words(given),
        };
        let found = Storage::scratch("found", u64::from(count) * 32);
        let status = Storage::scratch("status", 64);
        let mut bindings = Bindings::new();
        bindings
            .uniform("given", uniform(setup, search, count))
            .buffer("vertices", &gpu.storage("vertices", &words(vertices))?)
            .buffer("begins", &gpu.storage("begins", &begins)?)
            .buffer("found", &found)
            .buffer("status", &status);
        let pipeline = gpu.pipeline(&Composition::new("specular/solve"), true)?;
        let mut recording = Recording::new();
        recording
            .clear(&status)
            .run("solve", &pipeline, &bindings, groups_for(count))
            .download("found", &found)
            .download("status", &status);
        Ok(Self {
            recording,
            player: Player::new(gpu),
        })
    }

    /// Searches for all points.
    ///
    /// # Errors
    /// The driver ended loops, or the device is lost.
    pub fn solve(&self) -> Result<(Vec<Solved<f32>>, Elapsed), GpuError> {
        let played = self.player.play(&self.recording)?;
        let status = played.download::<u32>("status")?;
        self.player.gpu().check_error_word(status[0])?;
        let solved = |[a, b]: [[f32; 4]; 2]| Solved {
            p: V3::new(a[0], a[1], a[2]),
            size: a[3],
            iterations: b[0] as u32,
            status: b[1] as u32,
            points: b[2] as u32,
        };
        let found = played.download::<[[f32; 4]; 2]>("found")?;
        Ok((found.into_iter().map(solved).collect(), played.elapsed()))
    }
}

fn uniform(setup: &Setup<f32>, search: &Search<f32>, count: u32) -> UniformValues {
    let vector = |v: V3<f32>| [v.x, v.y, v.z];
    UniformValues::new()
        .u32("count", count)
        .u32("shape", setup.reflector.shape)
        .f32("amplitude", setup.reflector.amplitude)
        .f32("frequency", setup.reflector.frequency)
        .vec("eye", &vector(setup.eye))
        .vec("right", &vector(setup.right))
        .vec("up", &vector(setup.up))
        .vec("forward", &vector(setup.forward))
        .f32("pixels", setup.pixels)
        .u32("form", setup.form)
        .u32("is_newton", search.is_newton.into())
        .u32("is_exact", search.is_exact.into())
        .u32("stop", search.stop)
        .u32("merit", search.merit)
        .u32("is_given", search.is_given.into())
        .u32("starts", search.starts)
        .u32("most", search.most)
        .f32("singular", search.singular)
        .f32("difference", search.difference)
}

//! Cones on the device.

use crate::disk::{Overlap, V2};
use crate::lobe::lobe_table;
use crate::scene::{Patch, tile_levels};
use crate::trace::{Found, Given};
use raystone_gpu::{
    Bindings, Composition, Elapsed, Gpu, GpuError, Player, Recording, Storage, UniformValues,
    groups_for,
};
use raystone_specular::real::V3;

fn word(v: V3<f32>, w: f32) -> [f32; 4] {
    [v.x, v.y, v.z, w]
}

/// A picture by cones on the device.
pub struct Tracer {
    recording: Recording,
    player: Player,
}

impl Tracer {
    /// Uploads triangles and directions of masks.
    ///
    /// # Errors
    /// An array exceeds what the adapter binds, or the kernel does not compile.
    pub fn new(
        gpu: &Gpu,
        given: &Given<f32>,
        patches: &[Patch<f32>],
        directions: &[[f32; 2]],
    ) -> Result<Self, GpuError> {
        let words: Vec<[[f32; 4]; 7]> = patches
            .iter()
            .map(|patch| {
                let [a, b, c] = patch.corners.map(|p| word(p, 0.0));
                let a = [a[0], a[1], a[2], patch.tile];
                let [x, y, z] = patch.colours.map(|p| word(p, 0.0));
                [a, b, c, word(patch.centre, patch.radius), x, y, z]
            })
            .collect();
        let pixels = given.camera.side * given.camera.side;
        let layers = u64::from(pixels) * u64::from(given.most) * 32;
        let found = Storage::scratch("found", u64::from(pixels) * 32);
        let status = Storage::scratch("status", 64);
        let mut bindings = Bindings::new();
        bindings
            .uniform("given", uniform(given, patches.len() as u32))
            .buffer("triangles", &gpu.storage("triangles", &words)?)
            .buffer("directions", &gpu.storage("directions", directions)?)
            .buffer("texels", &gpu.storage("texels", &tile_levels())?)
            .buffer("lobes", &gpu.storage("lobes", lobe_table())?)
            .buffer("layers", Storage::scratch("layers", layers))
            .buffer("found", &found)
            .buffer("status", &status);
        let pipeline = gpu.pipeline(&Composition::new("cones/trace"), true)?;
        let mut recording = Recording::new();
        recording
            .clear(&status)
            .run("trace", &pipeline, &bindings, groups_for(pixels))
            .download("found", &found)
            .download("status", &status);
        Ok(Self {
            recording,
            player: Player::new(gpu),
        })
    }

    /// Traces all cones.
    ///
    /// # Errors
    /// The driver ended loops, or the device is lost.
    pub fn trace(&self) -> Result<(Vec<Found<f32>>, Elapsed), GpuError> {
        let played = self.player.play(&self.recording)?;
        let status = played.download::<u32>("status")?;
        self.player.gpu().check_error_word(status[0])?;
        let pixel = |[a, b]: [[f32; 4]; 2]| Found {
            colour: V3::new(a[0], a[1], a[2]),
            covered: a[3],
            counts: [b[0] as u32, b[1] as u32, b[2] as u32],
        };
        let found = played.download::<[[f32; 4]; 2]>("found")?;
        Ok((found.into_iter().map(pixel).collect(), played.elapsed()))
    }
}

fn uniform(given: &Given<f32>, count: u32) -> UniformValues {
    let vector = |v: V3<f32>| [v.x, v.y, v.z];
    let camera = &given.camera;
    UniformValues::new()
        .vec("eye", &vector(camera.eye))
        .f32("distance", camera.distance)
        .vec("right", &vector(camera.right))
        .f32("stride", camera.stride)
        .vec("up", &vector(camera.up))
        .u32("side", camera.side)
        .vec("forward", &vector(camera.forward))
        .u32("mirror", camera.mirror)
        .vec("background", &vector(given.background))
        .f32("gloss", camera.gloss)
        .u32("is_mean", camera.is_mean.into())
        .u32("count", count)
        .u32("most", given.most)
        .f32("cut", given.cut)
        .u32("blend", given.blend)
}

/// Overlaps of triangles with the disk, on the device.
///
/// # Errors
/// An array exceeds what the adapter binds, the kernel does not compile, or the device is lost.
pub fn overlaps(gpu: &Gpu, triangles: &[[V3<f32>; 3]]) -> Result<Vec<Overlap<f32>>, GpuError> {
    let words: Vec<[[f32; 4]; 3]> = triangles
        .iter()
        .map(|corners| corners.map(|p| word(p, 0.0)))
        .collect();
    let found = Storage::scratch("found", words.len() as u64 * 16);
    let status = Storage::scratch("status", 64);
    let mut bindings = Bindings::new();
    bindings
        .buffer("corners", &gpu.storage("corners", &words)?)
        .buffer("found", &found)
        .buffer("status", &status);
    let pipeline = gpu.pipeline(&Composition::new("cones/overlaps"), true)?;
    let mut recording = Recording::new();
    recording
        .clear(&status)
        .run(
            "overlaps",
            &pipeline,
            &bindings,
            groups_for(words.len() as u32),
        )
        .download("found", &found)
        .download("status", &status);
    let player = Player::new(gpu);
    let played = player.play(&recording)?;
    gpu.check_error_word(played.download::<u32>("status")?[0])?;
    let found = played.download::<[f32; 4]>("found")?;
    let overlap = |[area, x, y, _]: [f32; 4]| Overlap {
        area,
        centroid: V2::new(x, y),
    };
    Ok(found.into_iter().map(overlap).collect())
}

//! What happens at one pixel.

use super::camera::projected;
use super::side::Side;
use super::world::World;
use raystone_accel::{Counters, Hit, NO_HIT, Query, Ray};
use raystone_bench::run::{Estimator, Registries};
use raystone_config::Axis;
use raystone_core::geometry::Camera;
use raystone_gpu::GpuError;
use raystone_render::Stage;
use raystone_stress::explain::explain;
use raystone_verify::path_oracle::{Estimator as Rules, Path, PathId, PathOracle, Rounding, View};
use raystone_verify::rays::{primary_pixels, primary_rays};

/// What is seen at a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Inspection {
    /// Column and row.
    pub pixel: [u32; 2],
    /// The ray through its centre.
    pub ray: Ray,
    /// What each image has there.
    pub sides: Vec<Seen>,
}

/// What an image has at a pixel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Seen {
    /// Mean radiance so far; `None` while the image is coarse.
    pub value: Option<[f32; 3]>,
    /// The nearest hit of the ray through the pixel's centre; `None` where nothing is hit.
    pub hit: Option<Hit>,
    /// Name of the material that is hit.
    pub material: Option<String>,
    /// Work of that ray; `None` if the structure does not count it.
    pub work: Option<Counters>,
}

impl Seen {
    /// What is known, each a name and a value in words.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let mut rows = Vec::new();
        if let Some([r, g, b]) = self.value {
            rows.push(("radiance", format!("{r:.4} {g:.4} {b:.4}")));
        }
        match self.hit {
            Some(hit) => {
                rows.push(("triangle", hit.triangle.to_string()));
                let place = format!("{:.5} {:.4} {:.4}", hit.t, hit.u, hit.v);
                rows.push(("t, u, v", place));
            }
            None => rows.push(("hit", "none".to_owned())),
        }
        if let Some(material) = &self.material {
            rows.push(("material", material.clone()));
        }
        if let Some(work) = self.work {
            rows.push(("nodes", work.nodes.to_string()));
            rows.push(("box tests", work.box_tests.to_string()));
            rows.push(("triangle tests", work.triangle_tests.to_string()));
            rows.push(("stack", work.stack_high_water.to_string()));
        }
        rows
    }
}

/// A path, for lists and lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Trail {
    /// Side, pixel and sample.
    pub of: (usize, [u32; 2], u32),
    /// The camera's eye and the vertices, scene units.
    pub points: Vec<glam::Vec3>,
    /// A line for each vertex.
    pub text: Vec<String>,
}

impl Trail {
    pub(crate) fn new(of: (usize, [u32; 2], u32), camera: Camera, path: &Path) -> Self {
        let vertices = path.vertices.iter();
        let points = vertices.clone().map(|vertex| vertex.position.as_vec3());
        Self {
            of,
            points: std::iter::once(camera.eye).chain(points).collect(),
            text: vertices.map(ToString::to_string).collect(),
        }
    }

    /// Where its vertices lie in an image of this size, pixels from the top left; `None` behind the eye. The path's own eye is left
    /// out: it is everywhere.
    pub fn on(&self, camera: &Camera, size: [u32; 2]) -> Vec<Option<[f32; 2]>> {
        let points = self.points.iter().skip(1);
        points
            .map(|point| projected(camera, size, *point))
            .collect()
    }
}

/// An instance that is seen at a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grasp {
    /// Its index.
    pub instance: u32,
    /// Where it is seen, scene units.
    pub point: glam::Vec3,
}

/// The ray through the centre of a pixel.
fn center_ray(side: &Side, [x, y]: [u32; 2]) -> Option<Ray> {
    let [width, height] = side.lens.size;
    let place = primary_pixels(width, height)
        .into_iter()
        .position(|at| at == y * width + x)?;
    primary_rays(side.lens.camera, width, height)
        .get(place)
        .copied()
}

/// Inspects a pixel of all images.
pub(crate) async fn inspect(
    world: &World,
    sides: &[&Side<'_>],
    [x, y]: [u32; 2],
) -> Result<Option<Inspection>, GpuError> {
    let ray = sides.first().and_then(|side| center_ray(side, [x, y]));
    let Some(ray) = ray.filter(|_| sides[0].lens.size[0] > x) else {
        return Ok(None);
    };
    let mut all = Vec::new();
    for side in sides {
        all.push(seen(&world.stage, side, [x, y], &ray).await?);
    }
    Ok(Some(Inspection {
        pixel: [x, y],
        ray,
        sides: all,
    }))
}

/// The instance that is seen at a pixel.
pub(crate) async fn grasp(
    world: &World,
    side: &Side<'_>,
    pixel: [u32; 2],
) -> Result<Option<Grasp>, String> {
    let assembly = world.stage.scene.assembly.as_ref();
    let assembly = assembly.filter(|assembly| assembly.instances().len() > 1);
    let assembly = assembly.ok_or(
        "nothing can be dragged: the scene has no instances (objects that are placed by a transform) as they are shown",
    )?;
    let ray = center_ray(side, pixel).ok_or("there is no such pixel")?;
    let seen = seen(&world.stage, side, pixel, &ray)
        .await
        .map_err(|e| e.to_string())?;
    Ok(seen.hit.map(|hit| {
        let before = |instance: &raystone_scene::Instance| instance.first <= hit.triangle;
        let count = assembly.instances().iter().filter(|i| before(i)).count();
        Grasp {
            instance: count.saturating_sub(1) as u32,
            point: glam::Vec3::from(ray.origin) + hit.t * glam::Vec3::from(ray.direction),
        }
    }))
}

async fn seen(
    stage: &Stage,
    side: &Side<'_>,
    [x, y]: [u32; 2],
    ray: &Ray,
) -> Result<Seen, GpuError> {
    let Some(structure) = &side.structure else {
        return Ok(Seen::default());
    };
    let traced = &structure.traced;
    let batch = stage.tracer(traced, Query::Closest)?.batch(&[*ray])?;
    batch.trace_async().await?;
    stage
        .gpu
        .check_error_word(batch.error_word_async().await?)?;
    let hit = batch.hits_async().await?.first().copied();
    let hit = hit.filter(|hit| hit.triangle != NO_HIT);
    let work = stage
        .count_work_async(traced, Query::Closest, &[*ray])
        .await?;
    let scene = &stage.scene;
    let material = hit.and_then(|hit| scene.material_ids.get(hit.triangle as usize));
    let material = material.and_then(|id| scene.materials.get(*id as usize));
    let place = (y * side.lens.size[0] + x) as usize;
    let image = side.image.as_deref().filter(|_| side.shown > 0);
    Ok(Seen {
        value: image.and_then(|image| image.pixels.get(place).copied()),
        hit,
        material: material.map(|material| material.name.clone()),
        work: work.and_then(|work| work.first().copied()),
    })
}

/// What the structure does with the ray through the centre of a pixel, in words: that of `raystone trace`.
pub(crate) fn explained(
    registries: &Registries,
    world: &World,
    side: &Side,
    pixel: [u32; 2],
) -> Result<String, String> {
    let ray = center_ray(side, pixel).ok_or("the pixel is outside of the image")?;
    let accel = &side.cell[Axis::Accel];
    let kind = registries.accel.named("structure", &accel.name)?;
    let (scene, soup) = (&world.stage.scene, world.soup());
    let (text, _) = explain(scene, &soup, kind, &accel.params, &ray)?;
    Ok(format!("ray {ray}\n{text}"))
}

/// The path of one sample of a pixel, computed on the host in double precision.
pub(crate) fn path(
    registries: &Registries,
    world: &World,
    side: &Side,
    (pixel, sample): ([u32; 2], u32),
) -> Result<Path, String> {
    let estimator = Estimator::of(registries, &side.cell, side.lens.spp, side.lens.size[0])?;
    let view = View {
        estimator: Rules::of(&estimator.integrator)?,
        camera: side.lens.camera,
        size: side.lens.size,
        sampler: &estimator.sampler,
    };
    let id = PathId {
        pixel,
        sample,
        seed: side.lens.seed,
    };
    let oracle = PathOracle::knowing(&world.stage.scene, &registries.kinds)?;
    Ok(oracle.trace(&view, id, Rounding::none()))
}

// A buffer of rays through a named structure.
use raystone::accel::{AccelRegistry, Ray};
use raystone::{gpu, integrator::Stage, scene};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let gpu = gpu::open(&Default::default(), Default::default())?;
    let stage = Stage::new(&gpu, scene::named("cornell-box")?, Default::default())?;
    let traced = stage.structure(&AccelRegistry::default(), "cwbvh")?;
    let ray = |x: f32| Ray::new([x, 273.0, -500.0], [0.0, 0.0, 1.0]);
    for hit in stage.closest(&traced, &[ray(100.0), ray(400.0)])?.answers {
        println!("triangle {} at {}", hit.triangle, hit.t);
    }
    Ok(())
}

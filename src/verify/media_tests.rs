//! Paths through media against other sources: the oracle path by path, closed forms, quadratures in f64, and a furnace.
//! Then faults in kernels, each seen by one of these.

use crate::image_gate::{Choice, Pixels, answers, judge};
use crate::kinds::KindChecks;
use crate::mesh::Mesh;
use crate::path_oracle::{Estimator, Lens, PathOracle, View};
use crate::trial_media::{media, several_media};
use crate::trial_scenes::clamp;
use glam::{DVec3, UVec3, Vec3, vec3};
use raystone_accel::AccelRegistry;
use raystone_core::geometry::Camera;
use raystone_core::params::{ParamValue, Params, Variant};
use raystone_gpu::{AdapterChoice, Gpu, GpuError, KernelLibrary};
use raystone_record::Verdict;
use raystone_render::{
    ConfiguredIntegrator, IntegratorRegistry, OrganisationRegistry, RayOffset, RenderJob, Renderer,
    Stage,
};
use raystone_sampling::{Sampler, SamplerRegistry};
use raystone_scene::{Light, Material, SceneData, SceneMedium};
use raystone_volume::{Phase, Volume, phase, procedures};
use std::f64::consts::PI;

pub(crate) fn gpu() -> Gpu {
    raystone_gpu::open(&AdapterChoice::Best, KernelLibrary::default())
        .unwrap_or_else(|e| panic!("no adapter: run scripts/install-driver ({e})"))
}

pub(crate) fn path(changes: &[(&str, ParamValue)]) -> ConfiguredIntegrator {
    let changes = changes.iter().map(|(k, v)| ((*k).to_owned(), v.clone()));
    let variant = Variant {
        name: "path".to_owned(),
        label: "path".to_owned(),
        params: Params(changes.collect()),
    };
    IntegratorRegistry::default().configured(&variant).unwrap()
}

pub(crate) fn depth(depth: i64) -> (&'static str, ParamValue) {
    ("max_depth", ParamValue::Integer(depth))
}

pub(crate) fn word(key: &'static str, value: &str) -> (&'static str, ParamValue) {
    (key, ParamValue::Name(value.to_owned()))
}

/// Numbers without any order.
fn independent(integrator: &ConfiguredIntegrator, width: u32) -> Sampler {
    let named = |name: &str| Variant {
        name: name.to_owned(),
        label: name.to_owned(),
        params: Params::default(),
    };
    let demand = integrator.demand(100_000, width);
    let registry = SamplerRegistry::default();
    registry
        .sampler(&named("pixel-hash"), &named("none"), &demand)
        .unwrap()
}

/// A renderer of a scene through a plain BVH, for `use_it`.
pub(crate) fn with_renderer<T>(
    gpu: &Gpu,
    scene: &SceneData,
    size: [u32; 2],
    integrator: &ConfiguredIntegrator,
    use_it: impl FnOnce(&Renderer, &Sampler) -> Result<T, GpuError>,
) -> Result<T, GpuError> {
    let stage = Stage::new(gpu, scene.clone(), Default::default())?;
    let traced = stage.structure(&AccelRegistry::default(), "bvh").unwrap();
    let sampler = independent(integrator, size[0]);
    let job = RenderJob {
        size,
        camera: scene.view(1.0),
        sampler: &sampler,
        integrator,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(gpu, &stage.buffers, &traced, &job, false)?;
    use_it(&renderer, &sampler)
}

/// What the gate says of single paths: `None` if all are those of the oracle.
pub(crate) fn gate(
    gpu: &Gpu,
    scene: &SceneData,
    integrator: &ConfiguredIntegrator,
) -> Option<String> {
    const SIZE: [u32; 2] = [26, 19];
    let pixels = Pixels {
        size: SIZE,
        choice: Choice::Every(1),
        samples: vec![0, 3, 70_000],
        seed: 70_003,
    };
    let judged = with_renderer(gpu, scene, SIZE, integrator, |renderer, sampler| {
        let answers = answers(renderer, &pixels)?;
        let oracle = PathOracle::new(scene).unwrap();
        let view = View {
            estimator: Estimator::of(integrator).unwrap(),
            camera: scene.view(1.0),
            size: SIZE,
            sampler,
        };
        Ok(judge(&oracle, &view, &answers))
    });
    match judged {
        Err(e) => Some(e.to_string()),
        Ok(record) if record.verdict() == Verdict::Pass => {
            println!("{record:?}");
            None
        }
        Ok(record) => Some(format!("{record:?}")),
    }
}

/// The mean image of some samples, row by row.
pub(crate) fn image(
    gpu: &Gpu,
    scene: &SceneData,
    size: [u32; 2],
    integrator: &ConfiguredIntegrator,
    samples: u32,
) -> Result<Vec<DVec3>, GpuError> {
    with_renderer(gpu, scene, size, integrator, |renderer, _| {
        let shots = renderer.render(&[samples], 5)?;
        let pixels = shots[0].image.pixels.iter();
        Ok(pixels
            .map(|p| DVec3::from_array(p.map(f64::from)))
            .collect())
    })
}

pub(crate) const EYE: Vec3 = vec3(0.2, 0.4, 4.0);

/// Nothing but a triangle behind the camera, and a sky of radiance 1.
pub(crate) fn empty(volume: Volume, structure: &str) -> SceneData {
    let camera = Camera {
        eye: EYE,
        target: Vec3::ZERO,
        up: Vec3::Y,
        vertical_fov_degrees: 30.0,
    };
    let mut mesh = Mesh::new("empty", camera, Vec3::ONE).unwrap();
    let black = mesh.material(Material::diffuse("black", Vec3::ZERO));
    let corner = vec3(0.0, 0.0, 60.0);
    mesh.triangle(
        [corner, corner + Vec3::X, corner + Vec3::Y],
        [glam::Vec2::ZERO; 3],
        black,
    );
    let mut scene = mesh.done(Vec::new());
    scene.media = vec![SceneMedium::new(volume, structure).unwrap()];
    scene
}

pub(crate) fn placed(volume: Volume, anisotropy: Option<f32>) -> Volume {
    Volume {
        low: DVec3::new(-0.9, -0.7, -1.0),
        high: DVec3::new(1.0, 0.8, 0.6),
        phase: anisotropy.map_or(Phase::ISOTROPIC, |anisotropy| Phase {
            kind: phase::HENYEY_GREENSTEIN,
            anisotropy,
        }),
        ..volume
    }
    .checked()
    .unwrap()
}

/// A cloud with coefficients of this size.
pub(crate) fn clouds(scattering: f32, absorption: f32) -> Volume {
    let mut cloud = procedures::cloud(14).unwrap();
    let most = cloud.scattering.iter().copied().fold(0.0, f32::max);
    let share: Vec<f32> = cloud.scattering.iter().map(|s| s / most).collect();
    cloud.scattering = share.iter().map(|s| scattering * s).collect();
    cloud.absorption = share.iter().map(|s| absorption * s).collect();
    cloud
}

/// σ_s and σ, trilinear between the middles of voxels: of the volume as it is, not as kernels read it.
pub(crate) fn coefficients(volume: &Volume, position: DVec3) -> [f64; 2] {
    let size = UVec3::from(volume.resolution);
    let local = (position - volume.low) / (volume.high - volume.low) * size.as_dvec3() - 0.5;
    let local = local.clamp(DVec3::ZERO, (size - 1).as_dvec3());
    let mut sum = [0.0; 2];
    for k in 0..8_u32 {
        let corner = UVec3::new(k & 1, k >> 1 & 1, k >> 2);
        let voxel = (local.floor().as_uvec3() + corner).min(size - 1);
        let share = local - local.floor();
        let weight = DVec3::select(corner.cmpeq(UVec3::ONE), share, 1.0 - share).element_product();
        let place = (voxel.x + size.x * (voxel.y + size.y * voxel.z)) as usize;
        let [s, a] = [&volume.scattering, &volume.absorption].map(|g| f64::from(g[place]));
        sum = [sum[0] + weight * s, sum[1] + weight * (s + a)];
    }
    sum
}

/// ∫ σ between two points, by the midpoint rule within the medium.
pub(crate) fn optical_depth(volume: &Volume, from: DVec3, to: DVec3) -> f64 {
    const STEPS: i32 = 400;
    let way = to - from;
    let Some([enter, leave]) = volume.clip(from, way.normalize()) else {
        return 0.0;
    };
    let leave = leave.min(way.length());
    let width = (leave - enter).max(0.0) / f64::from(STEPS);
    let at = |k: i32| from + way.normalize() * (enter + (f64::from(k) + 0.5) * width);
    (0..STEPS)
        .map(|k| coefficients(volume, at(k))[1])
        .sum::<f64>()
        * width
}

pub(crate) fn rays(scene: &SceneData, size: [u32; 2]) -> Vec<DVec3> {
    let lens = Lens::new(&scene.view(1.0), size);
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
    pixels
        .map(|pixel| lens.direction(pixel, [0.5; 2]))
        .collect()
}

/// How many standard errors the number of rays that pass an absorber is from their transmittances.
fn absorbed(gpu: &Gpu, volume: &Volume, structure: &str) -> Result<f64, GpuError> {
    const SAMPLES: u32 = 256;
    let (scene, size) = (empty(volume.clone(), structure), [24, 20]);
    let integrator = path(&[
        depth(2),
        word("primary", "centre"),
        word("roulette", "none"),
    ]);
    let found = image(gpu, &scene, size, &integrator, SAMPLES)?;
    let eye = EYE.as_dvec3();
    let (mut excess, mut variance, mut wide) = (0.0, 0.0, 0.0);
    for (pixel, direction) in found.iter().zip(rays(&scene, size)) {
        let passes = (-optical_depth(volume, eye, eye + direction * 50.0)).exp();
        let of_pixel = passes * (1.0 - passes) / f64::from(SAMPLES);
        excess += pixel.x - passes;
        variance += of_pixel;
        if of_pixel > 1e-9 {
            wide = f64::max(wide, (pixel.x - passes).abs() / of_pixel.sqrt());
        } else if (pixel.x - passes).abs() > 1e-3 {
            wide = f64::INFINITY;
        }
    }
    // 480 pixels: one in 10⁵ such images has a pixel beyond 5.7.
    Ok(f64::max((excess / f64::sqrt(variance)).abs(), wide - 1.2))
}

/// Greatest difference of a floor under an absorber and a point light from its irradiance in closed form, relative;
/// for a grid, the mean over pixels.
fn shaded(gpu: &Gpu, volume: &Volume, structure: &str, samples: u32) -> Result<f64, GpuError> {
    let mut scene = floor(volume.clone(), structure);
    let light = DVec3::new(0.1, 3.0, 0.2);
    scene.lights = vec![Light::Point {
        position: light.as_vec3(),
        intensity: Vec3::splat(7.0),
    }];
    let size = [16, 16];
    let integrator = path(&[
        depth(1),
        word("primary", "centre"),
        word("roulette", "none"),
    ]);
    let found = image(gpu, &scene, size, &integrator, samples)?;
    let eye = scene.view(1.0).eye.as_dvec3();
    let (mut worst, mut sum) = (0.0_f64, 0.0);
    for (pixel, direction) in found.iter().zip(rays(&scene, size)) {
        let point = eye - direction * ((eye.y + 1.5) / direction.y);
        let way = light - point;
        let lit = 0.5 / PI * 7.0 * way.normalize().y / way.length_squared();
        let expected = lit * (-optical_depth(volume, point, light)).exp();
        let differs = pixel.x / expected - 1.0;
        worst = worst.max(differs.abs());
        sum += differs / found.len() as f64;
    }
    Ok(if samples == 1 { worst } else { sum.abs() })
}

/// A floor of albedo 0.5 seen from the side, below the medium; no ray of the camera meets the medium.
pub(crate) fn floor(volume: Volume, structure: &str) -> SceneData {
    let camera = Camera {
        eye: vec3(0.0, -1.0, 4.0),
        target: vec3(0.0, -1.5, 0.0),
        up: Vec3::Y,
        vertical_fov_degrees: 8.0,
    };
    let mut mesh = Mesh::new("floor", camera, Vec3::ZERO).unwrap();
    let grey = mesh.material(Material::diffuse("grey", Vec3::splat(0.5)));
    mesh.plain(
        [vec3(-1.0, -1.5, -5.0), 10.0 * Vec3::Z, 2.0 * Vec3::X],
        grey,
    );
    let mut scene = mesh.done(Vec::new());
    scene.media = vec![SceneMedium::new(volume, structure).unwrap()];
    scene
}

/// How many standard errors the mean of an image of single scattering is from a quadrature.
fn scattered_once(
    gpu: &Gpu,
    volume: &Volume,
    light: DVec3,
    structure: &str,
) -> Result<f64, GpuError> {
    const STEPS: i32 = 200;
    let mut scene = empty(volume.clone(), structure);
    scene.environment = Vec3::ZERO;
    scene.lights = vec![Light::Point {
        position: light.as_vec3(),
        intensity: Vec3::splat(5.0),
    }];
    let size = [16, 12];
    let integrator = path(&[
        depth(1),
        word("primary", "centre"),
        word("roulette", "none"),
    ]);
    let runs: Result<Vec<Vec<DVec3>>, GpuError> =
        with_renderer(gpu, &scene, size, &integrator, |renderer, _| {
            let run = |seed: u32| {
                let shots = renderer.render(&[64], seed)?;
                let pixels = shots[0].image.pixels.iter();
                Ok(pixels
                    .map(|p| DVec3::from_array(p.map(f64::from)))
                    .collect())
            };
            Ok((0..16).map(run).collect())
        })?;
    let eye = EYE.as_dvec3();
    let mut expected = 0.0;
    let all = rays(&scene, size);
    for direction in &all {
        let Some([enter, leave]) = volume.clip(eye, *direction) else {
            continue;
        };
        let width = (leave - enter) / f64::from(STEPS);
        for k in 0..STEPS {
            let x = eye + *direction * (enter + (f64::from(k) + 0.5) * width);
            let way = light - x;
            let through = (-optical_depth(volume, eye, x) - optical_depth(volume, x, light)).exp();
            let g = f64::from(volume.phase.anisotropy);
            let cosine = direction.dot(way.normalize());
            let phase = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine).powf(1.5) / (4.0 * PI);
            let scattering = coefficients(volume, x)[0];
            expected += 5.0 * scattering * phase * through * width / way.length_squared();
        }
    }
    expected /= all.len() as f64;
    let means: Vec<f64> = (runs?.iter())
        .map(|pixels| pixels.iter().map(|p| p.x).sum::<f64>() / pixels.len() as f64)
        .collect();
    let mean = means.iter().sum::<f64>() / means.len() as f64;
    let spread = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>();
    let error = (spread / (means.len() * (means.len() - 1)) as f64).sqrt();
    println!("single scattering: {mean} ± {error}, quadrature {expected}");
    Ok((mean - expected).abs() / error)
}

/// Greatest difference of a pixel from 1 in a medium that absorbs nothing under a sky of 1.
fn furnace(gpu: &Gpu, volume: Volume, structure: &str) -> Result<f64, GpuError> {
    let scene = empty(volume, structure);
    let integrator = path(&[depth(20), word("roulette", "none")]);
    let found = image(gpu, &scene, [24, 20], &integrator, 64)?;
    let worst = found.iter().map(|p| (*p - DVec3::ONE).abs().max_element());
    Ok(worst.fold(0.0, f64::max))
}

pub(crate) fn fog(scattering: f32, absorption: f32) -> Volume {
    Volume::constant(scattering, absorption, 1.0).unwrap()
}

#[test]
fn single_paths_through_media_are_those_of_the_oracle() {
    let gpu = gpu();
    for trial in media(&KindChecks::default()).unwrap() {
        for (name, changes) in &trial.trials {
            assert_eq!(*name, "path");
            let fault = gate(&gpu, &trial.scene, &path(changes));
            assert_eq!(fault, None, "{} {changes:?}", trial.scene.name);
        }
    }
}

#[test]
fn a_medium_that_absorbs_nothing_is_a_furnace() {
    let gpu = gpu();
    for structure in ["dda", "level-map"] {
        for anisotropy in [None, Some(0.7)] {
            let constant = furnace(&gpu, placed(fog(0.35, 0.0), anisotropy), structure).unwrap();
            assert_eq!(constant, 0.0);
            let grid = furnace(&gpu, placed(clouds(0.9, 0.0), anisotropy), structure).unwrap();
            assert_eq!(grid, 0.0);
        }
    }
    let absorbs = furnace(&gpu, placed(fog(1.0, 0.1), None), "dda").unwrap();
    assert!(absorbs > 0.01);
}

#[test]
fn absorbers_let_pass_what_their_depth_says() {
    let gpu = gpu();
    for structure in ["dda", "bricks", "cube-bvh"] {
        let constant = absorbed(&gpu, &placed(fog(0.0, 0.8), None), structure).unwrap();
        let grid = absorbed(&gpu, &placed(clouds(0.0, 4.0), None), structure).unwrap();
        println!("{structure}: {constant:.2} and {grid:.2} standard errors");
        assert!(
            constant < 4.5 && grid < 4.5,
            "{structure}: {constant} {grid}"
        );
    }
}

#[test]
fn shadow_rays_lose_what_the_depth_says() {
    let gpu = gpu();
    for structure in ["dda", "chebyshev", "min-max"] {
        let constant = shaded(&gpu, &placed(fog(0.5, 0.3), None), structure, 1).unwrap();
        let grid = shaded(&gpu, &placed(clouds(2.0, 1.0), None), structure, 256).unwrap();
        println!("{structure}: {constant:.2e} and {grid:.2e}");
        assert!(constant < 2e-5, "{structure}: {constant}");
        assert!(grid < 2e-3, "{structure}: {grid}");
    }
}

#[test]
fn light_scattered_once_is_that_of_a_quadrature() {
    let gpu = gpu();
    let (inside, outside) = (DVec3::new(0.1, 0.2, 0.1), DVec3::new(2.0, 1.5, 1.0));
    let cases = [
        (placed(fog(0.7, 0.3), None), outside),
        (placed(fog(0.7, 0.3), Some(0.5)), inside),
        (placed(clouds(3.0, 1.0), Some(0.5)), outside),
        (placed(clouds(3.0, 1.0), None), inside),
    ];
    for (volume, light) in cases {
        let off = scattered_once(&gpu, &volume, light, "level-map").unwrap();
        assert!(off < 4.5, "{off} standard errors");
    }
}

#[test]
fn organisations_follow_the_same_paths_through_media() {
    let gpu = gpu();
    let registry = OrganisationRegistry::default();
    let entries = registry.0.entries();
    let entry = |name: &str| entries.iter().find(|e| e.name == name).unwrap();
    let by_kind = ("shading", ParamValue::Name("per-material".to_owned()));
    let by_ray = ("sorting", ParamValue::Name("ray-key".to_owned()));
    let mut all: Vec<Variant> = entries.iter().map(|e| e.default_variant()).collect();
    all.push(entry("wavefront").variant(&[by_kind]));
    all.push(entry("wavefront").variant(&[by_ray]));
    println!("{} organisations", all.len());
    let kinds = KindChecks::default();
    let several = several_media(&kinds).unwrap();
    for trial in media(&kinds).unwrap().into_iter().chain(several) {
        // What is held below a limit in one scene, too.
        let limit = (trial.scene.name == "fog").then(clamp);
        let one = path(&[&[depth(4)][..], limit.as_slice()].concat());
        let truth = image(&gpu, &trial.scene, [40, 28], &one, 4).unwrap();
        for variant in &all {
            let by = registry.configured(variant).unwrap();
            let organised = one.clone().organised(by).unwrap();
            let found = image(&gpu, &trial.scene, [40, 28], &organised, 4).unwrap();
            assert!(found == truth, "{} by {}", trial.scene.name, variant.label);
        }
    }
}

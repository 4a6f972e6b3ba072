//! Media whose coefficients differ by channel, and media in glass, against closed forms and quadratures in f64.
//! The oracle sees single paths through them in `media_tests`.

use crate::kinds::KindChecks;
use crate::media_tests::{
    EYE, clouds, coefficients, depth, empty, floor, fog, gate, gpu, image, optical_depth, path,
    placed, rays, with_renderer, word,
};
use crate::mesh::Mesh;
use crate::trial_media::media;
use glam::{DVec3, Vec3, vec3};
use raystone_core::geometry::Camera;
use raystone_gpu::{AdapterChoice, Gpu, GpuError, KernelLibrary};
use raystone_render::ConfiguredIntegrator;
use raystone_scene::{Light, Material, SceneData, SceneMedium};
use raystone_volume::{Bounds, Volume};
use std::f64::consts::PI;

const TINTS: [Vec3; 2] = [vec3(1.0, 0.6, 0.2), vec3(0.0, 0.5, 1.0)];

/// The volume as one channel has it.
fn channel(volume: &Volume, tints: [Vec3; 2], channel: usize) -> Volume {
    let by = |values: &[f32], tint: Vec3| values.iter().map(|x| x * tint[channel]).collect();
    Volume {
        scattering: by(&volume.scattering, tints[0]),
        absorption: by(&volume.absorption, tints[1]),
        ..volume.clone()
    }
}

fn channels(volume: &Volume, tints: [Vec3; 2]) -> [Volume; 3] {
    [0, 1, 2].map(|k| channel(volume, tints, k))
}

fn tinted(mut scene: SceneData, volume: &Volume, tints: [Vec3; 2], structure: &str) -> SceneData {
    let medium = SceneMedium::tinted(volume.clone(), tints, structure).unwrap();
    assert!(medium.is_coloured() || tints == [Vec3::ONE; 2]);
    scene.media = vec![medium];
    scene
}

fn plain(most: i64) -> ConfiguredIntegrator {
    path(&[
        depth(most),
        word("primary", "centre"),
        word("roulette", "none"),
    ])
}

/// By how many standard errors the mean of images is off in each channel, the greatest of them.
fn off(
    gpu: &Gpu,
    scene: &SceneData,
    (size, samples): ([u32; 2], u32),
    integrator: &ConfiguredIntegrator,
    expected: DVec3,
) -> Result<f64, GpuError> {
    const RUNS: u32 = 16;
    let means: Result<Vec<DVec3>, GpuError> =
        with_renderer(gpu, scene, size, integrator, |renderer, _| {
            let run = |seed: u32| {
                let shots = renderer.render(&[samples], seed)?;
                let pixels = &shots[0].image.pixels;
                let sum: DVec3 = (pixels.iter())
                    .map(|p| DVec3::from_array(p.map(f64::from)))
                    .sum();
                Ok(sum / pixels.len() as f64)
            };
            (0..RUNS).map(run).collect()
        });
    let means = means?;
    let runs = f64::from(RUNS);
    let mean = means.iter().sum::<DVec3>() / runs;
    let spread: DVec3 = means.iter().map(|m| (*m - mean) * (*m - mean)).sum();
    let error = (spread / (runs * (runs - 1.0))).map(f64::sqrt);
    println!("{mean} ± {error}, expected {expected}");
    // What rounding leaves of an estimate without spread.
    Ok(((mean - expected) / error.max(expected * 2e-6))
        .abs()
        .max_element())
}

/// The mean over rays of what a function says of each channel.
fn mean_of(rays: &[DVec3], at: impl Fn(DVec3, usize) -> f64) -> DVec3 {
    let sum: DVec3 = (rays.iter())
        .map(|ray| DVec3::from_array([0, 1, 2].map(|k| at(*ray, k))))
        .sum();
    sum / rays.len() as f64
}

/// An absorber before a sky of 1.
fn absorbed(gpu: &Gpu, volume: &Volume, tints: [Vec3; 2], structure: &str) -> f64 {
    let size = [24, 20];
    let scene = tinted(empty(volume.clone(), structure), volume, tints, structure);
    let eye = EYE.as_dvec3();
    let of = channels(volume, tints);
    let expected = mean_of(&rays(&scene, size), |ray, k| {
        (-optical_depth(&of[k], eye, eye + ray * 50.0)).exp()
    });
    off(gpu, &scene, (size, 64), &plain(2), expected).unwrap()
}

/// A floor under a point light behind the medium.
fn shaded(gpu: &Gpu, volume: &Volume, structure: &str, samples: u32) -> f64 {
    let light = DVec3::new(0.1, 3.0, 0.2);
    let mut scene = tinted(floor(volume.clone(), structure), volume, TINTS, structure);
    scene.lights = vec![Light::Point {
        position: light.as_vec3(),
        intensity: Vec3::splat(7.0),
    }];
    let size = [16, 16];
    let eye = scene.view(1.0).eye.as_dvec3();
    let of = channels(volume, TINTS);
    let expected = mean_of(&rays(&scene, size), |ray, k| {
        let point = eye - ray * ((eye.y + 1.5) / ray.y);
        let way = light - point;
        let lit = 0.5 / PI * 7.0 * way.normalize().y / way.length_squared();
        lit * (-optical_depth(&of[k], point, light)).exp()
    });
    off(gpu, &scene, (size, samples), &plain(1), expected).unwrap()
}

/// Light of a point scattered once.
fn scattered(gpu: &Gpu, volume: &Volume, light: DVec3, structure: &str) -> f64 {
    const STEPS: i32 = 100;
    let mut scene = tinted(empty(volume.clone(), structure), volume, TINTS, structure);
    scene.environment = Vec3::ZERO;
    scene.lights = vec![Light::Point {
        position: light.as_vec3(),
        intensity: Vec3::splat(5.0),
    }];
    let size = [16, 12];
    let eye = EYE.as_dvec3();
    let of = channels(volume, TINTS);
    let expected = mean_of(&rays(&scene, size), |ray, k| {
        let Some([enter, leave]) = volume.clip(eye, ray) else {
            return 0.0;
        };
        let width = (leave - enter) / f64::from(STEPS);
        let at = |step: i32| {
            let x = eye + ray * (enter + (f64::from(step) + 0.5) * width);
            let depths = optical_depth(&of[k], eye, x) + optical_depth(&of[k], x, light);
            let lit = 5.0 / (light - x).length_squared() / (4.0 * PI);
            coefficients(&of[k], x)[0] * lit * (-depths).exp() * width
        };
        (0..STEPS).map(at).sum()
    });
    off(gpu, &scene, (size, 64), &plain(1), expected).unwrap()
}

#[test]
fn each_channel_loses_what_its_own_depth_says() {
    let gpu = gpu();
    let all = [TINTS[1], vec3(1.0, 0.0, 0.3)];
    for structure in ["dda", "level-map", "cube-bvh"] {
        let constant = absorbed(&gpu, &placed(fog(0.0, 0.8), None), all, structure);
        let grid = absorbed(&gpu, &placed(clouds(0.0, 4.0), None), all, structure);
        assert!(
            constant < 4.5 && grid < 4.5,
            "{structure}: {constant} {grid}"
        );
    }
}

#[test]
fn shadow_rays_lose_it_too() {
    let gpu = gpu();
    for structure in ["dda", "bricks"] {
        // In closed form, where the medium is constant.
        let constant = shaded(&gpu, &placed(fog(0.5, 0.3), None), structure, 1);
        let grid = shaded(&gpu, &placed(clouds(2.0, 1.0), None), structure, 16);
        assert!(
            constant < 4.5 && grid < 4.5,
            "{structure}: {constant} {grid}"
        );
    }
}

#[test]
fn each_channel_scatters_once_as_a_quadrature_says() {
    let gpu = gpu();
    let (inside, outside) = (DVec3::new(0.1, 0.2, 0.1), DVec3::new(2.0, 1.5, 1.0));
    let cases = [
        (placed(fog(0.7, 0.3), None), outside),
        (placed(clouds(3.0, 1.0), None), outside),
        (placed(clouds(3.0, 1.0), None), inside),
    ];
    for (volume, light) in cases {
        let off = scattered(&gpu, &volume, light, "level-map");
        assert!(off < 4.5, "{off} standard errors");
    }
}

/// Probabilities by the throughput keep its sum: what one channel does not scatter the others do.
#[test]
fn channels_of_a_furnace_have_the_sum_of_three_in_each_path() {
    let gpu = gpu();
    for volume in [fog(0.35, 0.0), clouds(0.9, 0.0)] {
        let volume = placed(volume, Some(0.5));
        let scene = tinted(empty(volume.clone(), "dda"), &volume, TINTS, "dda");
        let integrator = path(&[depth(20), word("roulette", "none")]);
        let found = image(&gpu, &scene, [24, 20], &integrator, 16).unwrap();
        let worst = (found.iter()).map(|p| (p.element_sum() - 3.0).abs());
        let worst = worst.fold(0.0, f64::max);
        println!("greatest difference from 3: {worst}");
        assert!(worst < 2e-5, "{worst}");
        assert!(found.iter().any(|p| (p.x - 1.0).abs() > 0.01));
        let each = off(&gpu, &scene, ([24, 20], 64), &integrator, DVec3::ONE).unwrap();
        assert!(each < 4.5, "{each} standard errors");
    }
}

/// Reflectance of glass for unpolarised light (Fresnel), and the cosine within, from the cosine outside.
fn fresnel(cosine: f64, index: f64) -> (f64, f64) {
    let within = (1.0 - (1.0 - cosine * cosine) / (index * index)).sqrt();
    let s = (cosine - index * within) / (cosine + index * within);
    let p = (index * cosine - within) / (index * cosine + within);
    (f64::midpoint(s * s, p * p), within)
}

/// What reaches the eye over a body of glass under a sky of 1: reflected, and passed after any number of reflections within, each
/// way through it letting this share pass.
fn through_glass(reflectance: f64, passes: f64) -> f64 {
    let r = reflectance;
    r + (1.0 - r).powi(2) * passes / (1.0 - r * passes)
}

const INDEX: f32 = 1.5;

/// Glass in an empty scene under a sky of 1, filled with a medium.
fn glazed(
    eye: Vec3,
    degrees: f32,
    fill: impl FnOnce(&mut Mesh, u32),
    volume: Volume,
    tints: [Vec3; 2],
) -> SceneData {
    let camera = Camera {
        eye,
        target: Vec3::ZERO,
        up: Vec3::Y,
        vertical_fov_degrees: degrees,
    };
    let mut mesh = Mesh::new("glass", camera, Vec3::ONE).unwrap();
    let glass = mesh.material(Material::dielectric("glass", Vec3::ONE, INDEX));
    fill(&mut mesh, glass);
    let volume = volume.checked().unwrap();
    tinted(mesh.done(Vec::new()), &volume, tints, "dda")
}

/// A slab of glass, as wide as no ray needs, full of a medium up to its surfaces.
fn slab(volume: Volume, tints: [Vec3; 2]) -> SceneData {
    let (low, size) = (vec3(-60.0, -60.0, -0.5), vec3(120.0, 120.0, 1.0));
    let volume = Volume {
        low: low.as_dvec3(),
        high: (low + size).as_dvec3(),
        ..volume
    };
    let block = |mesh: &mut Mesh, glass| mesh.block(low, size, glass);
    glazed(vec3(2.5, 1.0, 3.0), 40.0, block, volume, tints)
}

#[test]
fn a_slab_of_tinted_glass_is_beers_law_between_fresnels() {
    let gpu = gpu();
    let absorber = [Vec3::ONE, vec3(0.2, 0.5, 1.0)];
    let scene = slab(fog(0.0, 1.3), absorber);
    let size = [20, 16];
    let expected = mean_of(&rays(&scene, size), |ray, k| {
        let (reflectance, within) = fresnel(ray.z.abs(), INDEX.into());
        let sigma = 1.3 * f64::from(absorber[1][k]);
        through_glass(reflectance, (-sigma / within).exp())
    });
    let off = off(&gpu, &scene, (size, 256), &plain(16), expected).unwrap();
    assert!(off < 4.5, "{off} standard errors");
}

/// A ball of many facets, whose circles of latitude have twice as many corners as there are of them.
fn ball(mesh: &mut Mesh, rows: u32, material: u32) {
    use std::f32::consts::{PI, TAU};
    let at = |row: u32, column: u32| {
        let theta = PI * row as f32 / rows as f32;
        let phi = TAU * (column % (2 * rows)) as f32 / (2 * rows) as f32;
        let ring = theta.sin();
        vec3(ring * phi.cos(), theta.cos(), ring * phi.sin())
    };
    for row in 0..rows {
        for column in 0..2 * rows {
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [d, c] = [at(row + 1, column), at(row + 1, column + 1)];
            let uv = [glam::Vec2::ZERO; 3];
            if row > 0 {
                mesh.triangle([a, b, c], uv, material);
            }
            if row + 1 < rows {
                mesh.triangle([a, c, d], uv, material);
            }
        }
    }
}

/// The unit ball, full of a medium but for what its facets leave.
fn glass_ball(volume: Volume, tints: [Vec3; 2]) -> SceneData {
    let volume = Volume {
        low: DVec3::splat(-1.0),
        high: DVec3::splat(1.0),
        bounds: Bounds::Sphere,
        ..volume
    };
    let fill = |mesh: &mut Mesh, glass| ball(mesh, 96, glass);
    glazed(vec3(0.3, 0.4, 6.0), 10.0, fill, volume, tints)
}

/// A chord of a ball meets its surface everywhere at the same angle.
#[test]
fn a_ball_of_tinted_glass_is_beers_law_along_its_chords() {
    let gpu = gpu();
    let absorber = [Vec3::ONE, vec3(0.2, 0.5, 1.0)];
    let scene = glass_ball(fog(0.0, 0.6), absorber);
    let size = [24, 20];
    let eye = scene.view(1.0).eye.as_dvec3();
    let all = rays(&scene, size);
    let expected = mean_of(&all, |ray, k| {
        let beside = (eye - ray * eye.dot(ray)).length_squared();
        let (reflectance, within) = fresnel((1.0 - beside).sqrt(), INDEX.into());
        let sigma = 0.6 * f64::from(absorber[1][k]);
        through_glass(reflectance, (-sigma * 2.0 * within).exp())
    });
    // Facets are off by less than chance is: 18,000 of them.
    let off = off(&gpu, &scene, (size, 256), &plain(16), expected).unwrap();
    assert!(off < 4.5, "{off} standard errors");
}

/// A path that leaves glass around what absorbs nothing finds the sky unweakened, however often it was reflected, refracted and scattered;
/// those that do not leave in time become few.
#[test]
fn glass_around_what_absorbs_nothing_is_a_furnace() {
    const SAMPLES: u32 = 64;
    let gpu = gpu();
    for (name, scene) in [
        ("slab", slab(fog(0.4, 0.0), [Vec3::ONE; 2])),
        ("ball", glass_ball(fog(0.5, 0.0), [Vec3::ONE; 2])),
    ] {
        let lost = [5, 10, 20].map(|most| {
            let integrator = path(&[depth(most), word("roulette", "none")]);
            let found = image(&gpu, &scene, [16, 12], &integrator, SAMPLES).unwrap();
            for pixel in &found {
                let paths = pixel.x * f64::from(SAMPLES);
                assert!((paths - paths.round()).abs() < 1e-3, "{name}: {pixel}");
                assert!(
                    pixel.max_element() - pixel.min_element() < 1e-5,
                    "{name}: {pixel}"
                );
            }
            1.0 - found.iter().map(|p| p.x).sum::<f64>() / found.len() as f64
        });
        println!("{name}: {lost:?} of all paths are still in the glass after 5, 10 and 20 bounces");
        assert!(
            lost[1] < 0.6 * lost[0] && lost[2] < 0.4 * lost[1],
            "{lost:?}"
        );
    }
}

/// Faults in the kernels of coloured media: file, text, and what stands in its place.
const FAULTS: [(&str, &str, &str); 16] = [
    (COLOURED, "dot(share, lacking)", "greatest(lacking) / 3.0"),
    (COLOURED, "passed *= lacking / none;", ""),
    (COLOURED, "share *= lacking / none;", ""),
    (
        COLOURED,
        "    return Flight(end, passed, false);",
        "    return Flight(end, vec3<f32>(1.0), false);",
    ),
    (
        COLOURED,
        "passed * placed.scattering_tint * (there.x / mean)",
        "placed.scattering_tint * (there.x / mean)",
    ),
    (
        COLOURED,
        "passed * placed.scattering_tint * (there.x / mean)",
        "passed * (there.x / mean)",
    ),
    (
        COLOURED,
        "placed.scattering_tint * there.x + placed.absorption_tint",
        "placed.absorption_tint * there.x + placed.scattering_tint",
    ),
    (
        COLOURED,
        "let most = greatest(range.least + range.more);",
        "let most = greatest(range.least);",
    ),
    (
        COLOURED,
        "result *= exp(-range.least * unit",
        "result *= exp(-greatest(range.least) * unit",
    ),
    (
        COLOURED,
        "let most = greatest(range.more);",
        "let most = range.more.y;",
    ),
    (
        COLOURED,
        "(extinction(there) - range.least)",
        "extinction(there)",
    ),
    (
        COLOURED,
        "min(s, a) * region.sigma.x",
        "max(s, a) * region.sigma.x",
    ),
    (
        COLOURED,
        "throughput / (throughput.x + throughput.y + throughput.z)",
        "vec3<f32>(0.33333334)",
    ),
    (
        PATH,
        "throughput *= flight.albedo;\n            (*path).throughput = throughput;",
        "",
    ),
    (
        PATH,
        "free_flight(ray, end, first, throughput)",
        "free_flight(ray, end, first, throughput.zyx)",
    ),
    (
        PATH,
        "all(flight.albedo <= vec3<f32>(0.0))",
        "any(flight.albedo <= vec3<f32>(0.0))",
    ),
];
const COLOURED: &str = "integrator/coloured_medium";
const PATH: &str = "integrator/path";

#[test]
fn faults_of_coloured_media_are_seen_by_single_paths() {
    let mut trials = media(&KindChecks::default()).unwrap();
    trials.retain(|t| t.scene.media.len() == 1 && t.scene.media[0].is_coloured());
    assert_eq!(trials.len(), 2);
    for (file, text, fault) in FAULTS {
        let whole = match file {
            COLOURED => include_str!("../../kernels/integrator/coloured_medium.wesl"),
            _ => include_str!("../../kernels/integrator/path.wesl"),
        };
        assert_eq!(whole.matches(text).count(), 1, "stale fault: {text}");
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path().join(format!("{file}.wesl"));
        std::fs::create_dir_all(at.parent().unwrap()).unwrap();
        std::fs::write(&at, whole.replace(text, fault)).unwrap();
        let library = KernelLibrary::default().with_folder(folder.path()).unwrap();
        let gpu = raystone_gpu::open(&AdapterChoice::Best, library).unwrap();
        let seen = trials.iter().any(|trial| {
            let mut all = trial.trials.iter();
            all.any(|(_, changes)| gate(&gpu, &trial.scene, &path(changes)).is_some())
        });
        assert!(seen, "not seen: {fault} for {text}");
    }
}

//! Connections over mirrors against other sources: the oracle path by path, closed forms, and path tracing without them. Faults in
//! kernels are in the table of `tests/mutants`.

use crate::media_tests::{depth, gate, gpu, image, path, rays, with_renderer, word};
use crate::mesh::Mesh;
use crate::tier::in_turn;
use crate::trial_mirrors::{cap, connected, mirrors};
use crate::trial_scenes::{TrialScene, trial_scenes};
use glam::{DVec3, Vec3, vec3};
use raystone_core::geometry::Camera;
use raystone_gpu::{Gpu, KernelLibrary};
use raystone_render::{ConfiguredIntegrator, OrganisationRegistry};
use raystone_scene::{GEOMETRIC, Light, Material, SceneData};
use std::f64::consts::PI;

/// Scenes with mirrors whose trials have connections.
fn trials() -> Vec<TrialScene> {
    let mut scenes = trial_scenes().unwrap();
    scenes.retain(|trial| ["mirrors", "mist"].contains(&&*trial.scene.name));
    assert_eq!(scenes.len(), 2);
    scenes
}

fn fault_of(gpu: &Gpu) -> Option<String> {
    trials().iter().find_map(|trial| {
        (trial.trials.iter()).find_map(|(_, changes)| {
            let fault = gate(gpu, &trial.scene, &path(changes))?;
            Some(format!("{} {changes:?}: {fault}", trial.scene.name))
        })
    })
}

#[test]
fn single_paths_over_mirrors_are_those_of_the_oracle() {
    assert_eq!(fault_of(&gpu()), None);
}

/// Balls of facets with normals of vertices, copies that are mirrored.
#[test]
fn so_are_those_over_mirrored_triangles() {
    let mut scenes = trial_scenes().unwrap();
    scenes.retain(|trial| trial.scene.name == "mirrored");
    let integrator = path(&[depth(4), connected()]);
    assert_eq!(gate(&gpu(), &scenes[0].scene, &integrator), None);
}

const FLOOR: f32 = 0.5;

/// A floor seen from above within 0.5 of the origin.
fn floor(name: &str, half: f32) -> (Mesh, u32) {
    let camera = Camera {
        eye: vec3(0.0, 1.2, 1.2),
        target: Vec3::ZERO,
        up: Vec3::Y,
        vertical_fov_degrees: 22.0,
    };
    let mut mesh = Mesh::new(name, camera, Vec3::ZERO).unwrap();
    let grey = mesh.material(Material::diffuse("grey", Vec3::splat(FLOOR)));
    let corner = vec3(-half, 0.0, -half);
    mesh.plain([corner, 2.0 * half * Vec3::Z, 2.0 * half * Vec3::X], grey);
    let mirror = mesh.material(Material::mirror("mirror", Vec3::splat(0.8)));
    (mesh, mirror)
}

/// Greatest relative difference of the floor from its radiance in closed form under a point light and what reflects it.
fn off(gpu: &Gpu, scene: &SceneData, radiance: impl Fn(DVec3) -> f64) -> f64 {
    const SIZE: [u32; 2] = [16, 16];
    let integrator = path(&[
        depth(2),
        word("primary", "centre"),
        word("lights", "all"),
        connected(),
    ]);
    let found = image(gpu, scene, SIZE, &integrator, 1).unwrap();
    let eye = scene.view(1.0).eye.as_dvec3();
    let directions = rays(scene, SIZE);
    let mut worst = 0.0_f64;
    for (pixel, direction) in found.iter().zip(directions) {
        let point = eye - direction * (eye.y / direction.y);
        let expected = radiance(point);
        worst = worst.max((pixel.x / expected - 1.0).abs());
    }
    worst
}

const LIGHT: DVec3 = DVec3::new(0.3, 0.6, 0.1);
const INTENSITY: f64 = 7.0;

fn with_point_light(mut scene: SceneData) -> SceneData {
    scene.lights = vec![Light::Point {
        position: LIGHT.as_vec3(),
        intensity: Vec3::splat(INTENSITY as f32),
    }];
    scene
}

/// Radiance of the floor under a point at this place.
fn lit(point: DVec3, light: DVec3) -> f64 {
    let way = light - point;
    f64::from(FLOOR) / PI * INTENSITY * way.normalize().y / way.length_squared()
}

/// Two plane mirrors: the floor has the light of both images besides the light's own.
fn plane(gpu: &Gpu) -> f64 {
    let (mut mesh, mirror) = floor("plane", 6.0);
    mesh.plain(
        [vec3(-1.5, 0.0, -3.0), 3.0 * Vec3::Y, 6.0 * Vec3::Z],
        mirror,
    );
    mesh.plain(
        [vec3(-8.0, 2.0, -8.0), 16.0 * Vec3::Z, 16.0 * Vec3::X],
        mirror,
    );
    let scene = with_point_light(mesh.done(Vec::new()));
    let aside = DVec3::new(-3.0 - LIGHT.x, LIGHT.y, LIGHT.z);
    let above = DVec3::new(LIGHT.x, 4.0 - LIGHT.y, LIGHT.z);
    off(gpu, &scene, |point| {
        lit(point, LIGHT) + 0.8 * (lit(point, aside) + lit(point, above))
    })
}

#[test]
fn a_plane_mirror_lights_like_the_image_of_the_light() {
    let worst = plane(&gpu());
    println!("plane mirrors: {worst:.2e}");
    assert!(worst < 2e-5, "{worst}");
}

/// Dark spheres before a plane mirror: one in the way from the floor to it, one in that from it to the light.
const BALLS: [(DVec3, f64); 2] = [
    (DVec3::new(-0.9, 0.17, 0.03), 0.08),
    (DVec3::new(-0.6, 0.45, 0.18), 0.05),
];

#[test]
fn what_shines_itself_is_in_the_way_to_a_mirror_and_from_it() {
    let (mut mesh, mirror) = floor("balls", 6.0);
    mesh.plain(
        [vec3(-1.5, 0.0, -3.0), 3.0 * Vec3::Y, 6.0 * Vec3::Z],
        mirror,
    );
    let mut scene = with_point_light(mesh.done(Vec::new()));
    let ball = |(centre, radius): (DVec3, f64)| Light::Sphere {
        center: centre.as_vec3(),
        radius: radius as f32,
        radiance: Vec3::splat(1e-6),
    };
    scene.lights.extend(BALLS.map(ball));
    let image_of_light = DVec3::new(-3.0 - LIGHT.x, LIGHT.y, LIGHT.z);
    let is_between = |from: DVec3, to: DVec3, (centre, radius): (DVec3, f64)| {
        let way = (to - from).normalize();
        let beside = (centre - from - way * way.dot(centre - from)).length() - radius;
        assert!(beside.abs() > 1e-5, "an edge of a shadow");
        beside < 0.0
    };
    let counts = std::cell::Cell::new([0; 3]);
    let worst = off(&gpu(), &scene, |point| {
        let part = (-1.5 - point.x) / (image_of_light.x - point.x);
        let at = point + (image_of_light - point) * part;
        let before = is_between(point, at, BALLS[0]);
        let behind = is_between(at, LIGHT, BALLS[1]);
        let (place, over) = match (before, behind) {
            (true, _) => (0, 0.0),
            (_, true) => (1, 0.0),
            _ => (2, 0.8),
        };
        let mut sums = counts.get();
        sums[place] += 1;
        counts.set(sums);
        lit(point, LIGHT) + over * lit(point, image_of_light)
    });
    println!("{worst:.2e}, {:?} before, behind, neither", counts.get());
    assert!(counts.get().iter().all(|count| *count > 5));
    assert!(worst < 2e-5, "{worst}");
}

/// The point of a sphere at which it reflects a to b, where the path's length over the angle between both is stationary, and the cosine there.
fn on_sphere(centre: DVec3, radius: f64, [a, b]: [DVec3; 2]) -> (DVec3, f64) {
    let [x, y] = [a - centre, b - centre].map(DVec3::normalize);
    let across = (y - x * x.dot(y)).normalize();
    let at = |t: f64| centre + radius * (x * t.cos() + across * t.sin());
    let slope = |t: f64| {
        let p = at(t);
        let tangent = across * t.cos() - x * t.sin();
        tangent.dot((p - a).normalize() + (p - b).normalize())
    };
    let [mut low, mut high] = [0.0, x.angle_between(y)];
    let sign = slope(low).signum();
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if slope(middle) * sign > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let p = at(0.5 * (low + high));
    let cosine = (p - centre).normalize().dot((a - p).normalize()).abs();
    (p, cosine)
}

/// A convex mirror and a hollow one over the floor, finely tessellated: greatest difference from the mirror equations (Coddington's, for both
/// focal lines).
fn curved(gpu: &Gpu, is_hollow: bool) -> f64 {
    let (mut mesh, mirror) = floor("curved", 6.0);
    // The lowest point of the ball, or the highest of the hollow, at a height of 1.5 or 2.
    let (centre, radius) = if is_hollow {
        (vec3(0.0, -1.0, 0.0), 3.0)
    } else {
        (vec3(0.0, 2.5, 0.0), 1.0)
    };
    let axis = if is_hollow { Vec3::Y } else { -Vec3::Y };
    let angle = if is_hollow { 0.5 } else { 0.7 };
    cap(&mut mesh, (centre, radius), (axis, angle), [10, 60], mirror);
    let scene = with_point_light(mesh.done(Vec::new()));
    let r = f64::from(radius) * if is_hollow { -1.0 } else { 1.0 };
    off(gpu, &scene, |point| {
        let (p, cosine) = on_sphere(centre.as_dvec3(), f64::from(radius), [point, LIGHT]);
        let (near, far) = (p.distance(point), p.distance(LIGHT));
        let line = |power: f64| near + far + near * far * power;
        let spread = (line(2.0 / (r * cosine)) * line(2.0 * cosine / r)).abs();
        let falls = (p - point).normalize().y;
        let over = f64::from(FLOOR) / PI * INTENSITY * 0.8 * falls / spread;
        lit(point, LIGHT) + over
    })
}

#[test]
fn curved_mirrors_light_as_the_mirror_equations_have_it() {
    let gpu = gpu();
    for is_hollow in [false, true] {
        let worst = curved(&gpu, is_hollow);
        println!("hollow {is_hollow}: {worst:.2e}");
        assert!(worst < 5e-3, "hollow {is_hollow}: {worst}");
    }
}

/// Scenes in which the floor has only light over mirrors: a lamp faces up to them.
fn caustics() -> Vec<SceneData> {
    let scene = |name: &str, build: &dyn Fn(&mut Mesh, u32)| {
        let (mut mesh, mirror) = floor(name, 3.0);
        build(&mut mesh, mirror);
        let lamp = Material::diffuse("lamp", Vec3::ZERO).emitting_from_front(Vec3::splat(9.0));
        let lamp = mesh.material(lamp);
        let corner = vec3(0.1, 0.7, -0.3);
        mesh.plain([corner, 0.4 * Vec3::Z, 0.4 * Vec3::X], lamp);
        let mut scene = mesh.done(Vec::new());
        if !scene.normals.is_empty() {
            let count = scene.triangles.len();
            scene.normals.resize(count, [GEOMETRIC; 3]);
        }
        scene
    };
    vec![
        scene("two planes", &|mesh, mirror| {
            mesh.plain(
                [vec3(-1.5, 1.6, -1.5), 3.0 * Vec3::Z, 3.0 * Vec3::X],
                mirror,
            );
            mesh.plain(
                [vec3(1.2, 0.1, -1.5), vec3(0.4, 1.2, 0.0), 3.0 * Vec3::Z],
                mirror,
            );
        }),
        scene("ball", &|mesh, mirror| {
            let ball = (vec3(0.0, 1.9, 0.0), 0.7);
            cap(mesh, ball, (-Vec3::Y, 1.4), [8, 16], mirror);
        }),
        scene("hollow", &|mesh, mirror| {
            let ball = (vec3(0.0, 0.2, 0.0), 1.6);
            cap(mesh, ball, (Vec3::Y, 0.8), [8, 16], mirror);
        }),
    ]
}

/// Mean and standard error of images of several seeds.
fn mean(
    gpu: &Gpu,
    scene: &SceneData,
    integrator: &ConfiguredIntegrator,
    (seeds, samples): (u32, u32),
) -> [f64; 2] {
    let means: Vec<f64> = with_renderer(gpu, scene, [16, 16], integrator, |renderer, _| {
        let mean = |seed| Ok(renderer.render(&[samples], seed)?[0].image.mean());
        (1..=seeds).map(mean).collect()
    })
    .unwrap();
    let count = means.len() as f64;
    let mean = means.iter().sum::<f64>() / count;
    let spread: f64 = means.iter().map(|m| (m - mean).powi(2)).sum();
    [mean, (spread / (count * (count - 1.0))).sqrt()]
}

/// By how many standard errors connections differ from path tracing without them, and how wide one is, relative to the mean.
fn apart(gpu: &Gpu, faulty: &Gpu, scene: &SceneData, strategy: &str) -> [f64; 2] {
    let without = path(&[depth(2), word("roulette", "none")]);
    let with = path(&[
        depth(2),
        word("roulette", "none"),
        word("strategy", strategy),
        connected(),
    ]);
    let [a, e] = mean(gpu, scene, &without, (16, 8192));
    let [b, f] = mean(faulty, scene, &with, (16, 64));
    let error = e.hypot(f);
    println!(
        "{} {strategy}: {a:.6} ± {e:.6} without, {b:.6} ± {f:.6} with",
        scene.name
    );
    [(a - b).abs() / error, error / a]
}

#[test]
fn connections_change_no_mean() {
    let gpu = gpu();
    let scenes = caustics();
    let by = |scene| ["mis-balance", "light"].map(|strategy| (scene, strategy));
    for (scene, strategy) in in_turn("means of connections", scenes.iter().flat_map(by)) {
        let [errors, width] = apart(&gpu, &gpu, scene, strategy);
        assert!(width < 0.0045, "{}: {width}", scene.name);
        assert!(errors < 4.0, "{}: {errors} standard errors", scene.name);
    }
}

const KERNEL: &str = "integrator/connection";
const SPREAD: &str = "let spread = abs(across_of(shot)) *";

/// Light over mirrors that is a fiftieth too much would be seen where it matters. Further faults are in the table of `tests/mutants`.
#[test]
fn means_show_a_spread_that_is_two_percent_off() {
    let gpu = gpu();
    let library = KernelLibrary::default();
    let text = library.text(KERNEL).unwrap();
    let changed = text.replace(SPREAD, &SPREAD.replace("= abs", "= 1.02 * abs"));
    assert_ne!(text, changed, "stale");
    let faulty = gpu.with_kernels(library.with_sources(&[(KERNEL, &changed)]));
    let scene = &caustics()[0];
    let [errors, _] = apart(&gpu, &faulty, scene, "light");
    assert!(errors > 4.0, "{errors}");
}

#[test]
fn organisations_of_one_kernel_follow_the_same_paths_and_queues_refuse() {
    let gpu = gpu();
    let registry = OrganisationRegistry::default();
    let scene = mirrors().unwrap();
    let one = path(&[depth(4), connected()]);
    let truth = image(&gpu, &scene, [40, 28], &one, 4).unwrap();
    let mut inline = 0;
    for entry in registry.0.entries() {
        let by = registry.configured(&entry.default_variant()).unwrap();
        match one.clone().organised(by) {
            Ok(organised) => {
                let found = image(&gpu, &scene, [40, 28], &organised, 4).unwrap();
                assert!(found == truth, "{}", entry.name);
                inline += 1;
            }
            Err(reason) => assert!(reason.contains("connection = specular"), "{reason}"),
        }
    }
    assert!(inline >= 2, "{inline}");
}

/// Without connections, and where the strategy has none, kernels are as they would be if there were none at all.
#[test]
fn the_kernel_is_the_same_to_the_byte_without_them() {
    let gpu = gpu();
    let text = |changes: &[_]| {
        let scene = mirrors().unwrap();
        let integrator = path(changes);
        with_renderer(&gpu, &scene, [8, 8], &integrator, |renderer, _| {
            Ok(renderer.kernel_text())
        })
        .unwrap()
    };
    let plain = text(&[]);
    assert_eq!(text(&[word("connection", "none")]), plain);
    let by_material = text(&[word("strategy", "bsdf")]);
    let both = [word("strategy", "bsdf"), connected()];
    assert_eq!(text(&both), by_material);
    let with = text(&[connected()]);
    for name in ["first_mirror", "connected_light", "flat_point", "Before"] {
        let is_there = |text: &str| {
            text.match_indices(name)
                .any(|(at, _)| !text[at + name.len()..].starts_with("ed"))
        };
        assert!(is_there(&with) && !is_there(&plain), "{name}");
    }
}

//! Pictures by cones: twin and kernel against the oracle, faults that this sees, cones against closed forms, and rays against
//! all triangles.

use super::tier::faults_in_turn;
use crate::check;
use crate::cone::{Camera, Mirror, cone_of};
use crate::device::{Tracer, overlaps};
use crate::disk::disk_triangle;
use crate::level::{LEVELS, TEXELS};
use crate::oracle::Expected;
use crate::rays::{Lens, Rays};
use crate::sample::{Crossing, Truth, budget, crossing, shimmer};
use crate::scene::{Place, patches, tile_levels};
use crate::trace::{Blend, Found};
use crate::world::{Keep, View, World, directions, double};
use glam::DVec3;
use raystone_core::random::Pcg32;
use raystone_gpu::{AdapterChoice, Gpu, KernelLibrary, probe_arithmetic};
use raystone_specular::real::V3;

fn adapter() -> Option<Gpu> {
    let gpu = raystone_gpu::open(&AdapterChoice::Best, KernelLibrary::default());
    let gpu = gpu.unwrap_or_else(|e| panic!("no adapter: run scripts/install-driver ({e})"));
    let exact = probe_arithmetic(&gpu).unwrap().is_exact();
    if !exact {
        eprintln!("skipped for want of an adapter that computes like the host");
    }
    exact.then_some(gpu)
}

const KEEP: Keep = Keep {
    layers: 40,
    blend: Blend::Saturate,
    cut: 0.0,
    is_mean: false,
};

fn view(place: Place, mirror: Option<Mirror>, gloss: f64) -> View {
    View {
        place,
        mirror,
        gloss,
        side: 12,
        resolution: 256,
        samples: 64,
        turned: 0.0,
    }
}

fn world(place: Place, mirror: Option<Mirror>, gloss: f64) -> World {
    World::new(view(place, mirror, gloss), 1)
}

/// Sixteen pixels of eleven degrees.
fn wide(place: Place, mirror: Option<Mirror>) -> World {
    let view = View {
        side: 4,
        resolution: 4,
        ..view(place, mirror, 0.0)
    };
    World::new(view, 1)
}

/// Views and what is kept that show all parts.
fn cases() -> Vec<(World, Keep)> {
    let mean = Keep {
        is_mean: true,
        blend: Blend::MaskArea,
        ..KEEP
    };
    let few = Keep {
        layers: 3,
        cut: 0.01,
        ..KEEP
    };
    let count = Keep {
        blend: Blend::MaskCount,
        ..KEEP
    };
    let level = Keep {
        blend: Blend::Level,
        ..KEEP
    };
    let lobe = Keep {
        blend: Blend::Lobe,
        ..KEEP
    };
    let all = Keep {
        layers: 200,
        ..KEEP
    };
    vec![
        (world(Place::Checker, Some(Mirror::Sphere), 0.01), lobe),
        (world(Place::Thin, Some(Mirror::Plane), 0.003), lobe),
        (world(Place::Balls, None, 0.0), level),
        (world(Place::Checker, Some(Mirror::Sphere), 0.02), level),
        (world(Place::Checker, Some(Mirror::Plane), 0.1), level),
        (world(Place::Checker, None, 0.0), KEEP),
        (world(Place::Thin, None, 0.0), few),
        (world(Place::Checker, Some(Mirror::Sphere), 0.0), KEEP),
        (world(Place::Balls, Some(Mirror::Sphere), 0.1), mean),
        (world(Place::Thin, Some(Mirror::Plane), 0.05), count),
        (wide(Place::Checker, None), all),
        (wide(Place::Checker, Some(Mirror::Plane)), all),
        // Reflected cones that would be wider than any may be.
        (wide(Place::Checker, Some(Mirror::Sphere)), all),
    ]
}

#[test]
fn the_twin_agrees_with_the_oracle() {
    for (world, keep) in cases() {
        let mut found = world.by_twin(&keep);
        let apart = check::near(&found, &world.by_oracle(&keep));
        let apart = apart.unwrap_or_else(|e| panic!("{:?} {keep:?}: {e}", world.view));
        let cut = world.cut_by_oracle(&keep);
        assert_eq!(
            check::cut(&found, &cut),
            Ok(()),
            "{:?} {keep:?}",
            world.view
        );
        // Half of the pixels know the number of triangles that are cut.
        let certain = cut.iter().filter(|[least, most]| least == most).count();
        assert!(2 * certain > cut.len(), "{:?} {keep:?}", world.view);
        for pixel in &mut found {
            pixel.counts[2] += 1;
        }
        assert!(
            check::cut(&found, &cut).is_err(),
            "{:?} {keep:?}",
            world.view
        );
        eprintln!("{:?}: {apart:?}", world.view);
    }
}

#[test]
fn the_kernel_agrees_with_oracle_and_quadrature() {
    let Some(gpu) = adapter() else { return };
    for (world, keep) in cases() {
        let picture = world.picture(&gpu, &keep);
        picture.unwrap_or_else(|e| panic!("{:?} {keep:?}: {e:?}", world.view));
    }
    let triangles = check::triangles(4096, 9);
    let worst = check::overlaps(&triangles, &overlaps(&gpu, &triangles).unwrap(), true);
    eprintln!("area off by {:?}", worst.unwrap());
}

/// Kernel, text, its replacement.
type Fault = (&'static str, &'static str, &'static str);

const FAULTS: [Fault; 43] = [
    ("disk", "0.5 * angle_of", "0.49 * angle_of"),
    ("disk", "to_b.y - from_a.y", "to_b.y + from_a.y"),
    (
        "disk",
        "let half = sqrt(max(1.0 - h * h, 0.0));",
        "let half = max(1.0 - h * h, 0.0);",
    ),
    (
        "disk",
        "vec2<f32>(n.y, -n.x) / length",
        "vec2<f32>(-n.y, n.x) / length",
    ),
    (
        "disk",
        "let c = 0.5 * h * (high - low);",
        "let c = 0.5 * h * (end - begin);",
    ),
    ("disk", "if (begin < -half) {", "if (false) {"),
    ("disk", "along * (low + high)", "along * (low - high)"),
    ("disk", "if (area > HALF_PI) {", "if (area > 10.0) {"),
    ("disk", "angle = QUARTER_PI;", "angle = 0.0;"),
    (
        "cone",
        "sqrt(camera.distance * PART / far)",
        "sqrt(camera.distance / far)",
    ),
    (
        "cone",
        "wider = 1.0 + 2.0 * t / cosine;",
        "wider = 1.0 + 2.0 * t * cosine;",
    ),
    ("cone", "normal * (2.0 * cosine)", "normal * cosine"),
    (
        "cone",
        "sum = (own + camera.gloss)",
        "sum = max(own, camera.gloss)",
    ),
    (
        "cone",
        "let behind = tangent * t / sum;",
        "let behind = 0.0;",
    ),
    ("cone", "outside <= radius", "outside <= 0.5 * radius"),
    (
        "cone",
        "wider = sqrt(wider * (1.0 + 2.0 * t * cosine));",
        "wider = wider;",
    ),
    (
        "trace",
        "return a.depth < b.depth ||",
        "return a.depth > b.depth ||",
    ),
    ("trace", "while (at > 0u) {", "while (false) {"),
    ("trace", "weight = min(weight, 1.0 - covered);", ""),
    ("trace", "weight = weight * (left / bits);", ""),
    (
        "trace",
        "let fresh = layer.bits & ~mask;",
        "let fresh = layer.bits;",
    ),
    ("trace", "leave = crossing(a, b, near);", "leave = a;"),
    (
        "trace",
        "out.bits = covered.right;",
        "out.bits = covered.left;",
    ),
    (
        "trace",
        "b * parts.y + c * parts.z",
        "c * parts.y + b * parts.z",
    ),
    (
        "trace",
        "out.depth = clamp(dot3(n, a) / facing, low, high);",
        "out.depth = low;",
    ),
    ("trace", "max(given.cut, LEAST_SHARE)", "LEAST_SHARE"),
    ("trace", "c.x * a.y - c.y * a.x", "c.x * a.y + c.y * a.x"),
    ("trace", "if (out.depth < cone.near) {", "if (false) {"),
    (
        "trace",
        "weighted(triangle.a, triangle.b, triangle.c, parts)",
        "weighted(triangle.a, triangle.c, triangle.b, parts)",
    ),
    ("level", "log2(2.0 * ", "log2("),
    ("level", "length / abs(n.z)", "along / abs(n.z)"),
    ("level", "(f32(side) - 0.5)", "f32(side)"),
    ("level", "/ 3u * 4u", "/ 3u * 2u"),
    (
        "level",
        "let upper = c + (d - c) * part.x;",
        "let upper = c + (d - c) * part.y;",
    ),
    ("level", "bounded - f32(low)", "0.0"),
    ("lobe", "sqrt(min(share, 1.0))", "min(share, 1.0)"),
    ("lobe", "min(2.0 * part, 1.0)", "min(part, 1.0)"),
    ("lobe", "min(distance, 1.0)", "0.0"),
    ("lobe", "(size - f32(low))", "1.0"),
    (
        "lobe",
        "(part * PLACES + place) * SIZES + size",
        "(part * PLACES + size) * SIZES + place",
    ),
    ("cone", "min(own, camera.gloss) /", "own /"),
    ("trace", "colour = colour * (covered / sum);", ""),
    (
        "trace",
        "weight = weight * bitcast<f32>(layer.bits.x);",
        "weight = weight;",
    ),
];

/// What sees a fault: the oracle of pictures, quadrature of single overlaps.
fn seen_by(gpu: &Gpu, cases: &[(World, Keep, Vec<Expected>)]) -> [bool; 2] {
    let mut seen = [false; 2];
    for (world, keep, expected) in cases {
        let given = world.given(keep);
        let tracer = Tracer::new(gpu, &given, &world.patches, &directions()).unwrap();
        let (found, _) = tracer.trace().unwrap();
        seen[0] |= check::near(&found, expected).is_err();
    }
    let triangles = check::triangles(1024, 9);
    let found = overlaps(gpu, &triangles).unwrap();
    seen[1] = check::overlaps(&triangles, &found, false).is_err();
    seen
}

#[test]
fn faults_of_the_kernels_are_seen() {
    let Some(gpu) = adapter() else { return };
    let cases: Vec<_> = cases()
        .into_iter()
        .map(|(world, keep)| {
            let expected = world.by_oracle(&keep);
            (world, keep, expected)
        })
        .collect();
    assert_eq!(seen_by(&gpu, &cases), [false; 2], "sound kernels");
    let mut unseen = Vec::new();
    for (file, text, fault) in faults_in_turn("faults of cones", FAULTS) {
        let library = KernelLibrary::default();
        let name = format!("cones/{file}");
        let sound = library
            .text(&name)
            .unwrap_or_else(|| panic!("there is no {name}"));
        assert_eq!(sound.matches(text).count(), 1, "{name}: `{text}`");
        let changed = sound.replace(text, fault);
        let faulty = gpu.with_kernels(library.with_sources(&[(&name, &changed)]));
        let seen = seen_by(&faulty, &cases);
        eprintln!("{name}: `{text}`: oracle, quadrature {seen:?}");
        if seen == [false; 2] {
            unseen.push((name, text, seen));
        }
    }
    assert!(unseen.is_empty(), "not seen: {unseen:#?}");
}

/// What is handed to the host's checks in place of a picture.
type HostFault = (&'static str, fn(&mut Vec<Found<f32>>));

const HOST_FAULTS: [HostFault; 6] = [
    ("two pixels are exchanged", |all| all.swap(3, 100)),
    ("a pixel is missing", |all| {
        all.pop();
    }),
    ("a pixel is no number", |all| all[7].colour.x = f32::NAN),
    ("a pixel is brighter by a hundredth", |all| {
        all[9].colour.y += 0.01
    }),
    ("a part is not covered", |all| all[11].covered -= 0.01),
    ("the picture is mirrored", |all| {
        for row in all.chunks_mut(12) {
            row.reverse();
        }
    }),
];

#[test]
fn faults_of_a_picture_are_seen() {
    let world = world(Place::Checker, Some(Mirror::Sphere), 0.0);
    let (twin, expected) = (world.by_twin(&KEEP), world.by_oracle(&KEEP));
    for (name, plant) in HOST_FAULTS {
        let mut found = twin.clone();
        plant(&mut found);
        assert!(check::near(&found, &expected).is_err(), "not seen: {name}");
    }
}

#[test]
fn a_cone_has_the_solid_angle_of_its_pixel_however_wide() {
    for distance in [1000.0, 20.0, 4.0, 2.0] {
        let camera = Camera::<f64> {
            eye: V3::of(DVec3::X),
            right: V3::of(DVec3::Y),
            up: V3::of(DVec3::Z),
            forward: V3::of(-DVec3::X),
            distance,
            stride: 1.0,
            side: 4,
            mirror: 0,
            gloss: 0.0,
            is_mean: false,
        };
        for (pixel, [x, y]) in [(0, [-1.5, 1.5]), (6, [0.5, 0.5]), (11, [1.5, -0.5])] {
            let tangent = cone_of(&camera, pixel).tangent;
            // A cap's, 2π (1 - cos), and that of a unit square seen aslant from this distance.
            let cap = std::f64::consts::TAU * (1.0 - 1.0 / (1.0 + tangent * tangent).sqrt());
            let square = distance / (distance * distance + x * x + y * y).powf(1.5);
            assert!(
                (cap / square - 1.0).abs() < 1e-9,
                "{distance}, {pixel}: {cap}, not {square}"
            );
        }
    }
}

#[test]
fn a_reflected_cone_is_that_of_the_digest_and_nearly_that_of_two_rays() {
    // t = 3, R = 1, incidence of 45°, half-angle 8e-4.
    let normal = DVec3::Z;
    let direction = DVec3::new(1.0, 0.0, -1.0).normalize();
    let eye = normal - direction * 3.0;
    let tangent = 8e-4_f64;
    let camera = Camera::<f64> {
        eye: V3::of(eye),
        right: V3::of(DVec3::Y),
        up: V3::of(direction.cross(DVec3::Y)),
        forward: V3::of(direction),
        // One pixel of this solid angle in the middle.
        distance: (1.0 / (std::f64::consts::PI * tangent * tangent)).sqrt(),
        stride: 1.0,
        side: 1,
        mirror: Mirror::Sphere.word(),
        gloss: 0.0,
        is_mean: false,
    };
    let cone = cone_of(&camera, 0);
    assert!((cone.tangent - 7.58823e-3).abs() < 1e-8, "{cone:?}");
    assert!((cone.near - 0.316279).abs() < 1e-6, "{cone:?}");
    // Both marginal rays, reflected at the true sphere.
    let rays = Rays::new(&patches(Place::Checker));
    let lens = Lens::new(camera, &rays);
    let side = direction.cross(DVec3::Y);
    let out = [-1.0, 1.0].map(|sign| {
        let ray = (direction + side * (sign * tangent)).normalize();
        lens.mirrored(eye, ray).unwrap().1
    });
    let exact = 0.5 * out[0].angle_between(out[1]);
    assert!((exact - 7.58832e-3).abs() < 2e-8, "{exact}");
    assert!((cone.tangent / exact - 1.0).abs() < 5e-5);
    let axis = lens.mirrored(eye, direction).unwrap().1;
    assert!(axis.distance(cone.axis.f64()) < 1e-12);
}

#[test]
fn rays_find_what_all_triangles_say() {
    let mut random = Pcg32::new(21);
    for place in [Place::Checker, Place::Balls, Place::Thin] {
        let rays = Rays::new(&patches(place));
        for _ in 0..2000 {
            let origin = random.in_cube();
            let direction = random.direction();
            let (a, b) = (
                rays.closest(origin, direction),
                rays.closest_of_all(origin, direction),
            );
            assert_eq!(a.map(|hit| hit.0), b.map(|hit| hit.0));
            assert!(a.is_some(), "the room is closed: {origin} {direction}");
        }
    }
}

#[test]
fn a_cone_of_tiles_alone_has_next_to_no_bias() {
    // Off a plane without a lobe cones are exact: layers do not hide each other, colours change little.
    let view = View {
        samples: 4096,
        ..view(Place::Checker, Some(Mirror::Plane), 0.0)
    };
    let world = World::new(view, 1);
    let colours = |found: Vec<Found<f32>>| -> Vec<DVec3> {
        found.iter().map(|pixel| pixel.colour.f64()).collect()
    };
    let error = world.truth.error(&colours(world.by_twin(&KEEP)));
    assert!(error.abs().sqrt() < 2e-3, "{}", error.abs().sqrt());
    // One layer is not the picture.
    let one = Keep { layers: 1, ..KEEP };
    assert!(world.truth.error(&colours(world.by_twin(&one))).sqrt() > 0.02);
}

#[test]
fn levels_are_means_of_tiles_and_spare_most_of_the_noise_of_one_ray() {
    let texels = tile_levels();
    let mut first = 0;
    for level in 0..LEVELS {
        let side = (TEXELS >> level) as usize;
        let all = &texels[first..first + side * side];
        let mean = all.iter().map(|x| f64::from(*x)).sum::<f64>() / all.len() as f64;
        assert!((mean - 0.49).abs() < 1e-6, "level {level}: {mean}");
        first += side * side;
    }
    assert_eq!(first, texels.len());
    assert_eq!(
        [texels[0], texels[16], texels[16 * 32 + 16]],
        [0.9, 0.08, 0.9]
    );
    // Off a plane with a wide lobe a ray sees one tile or another, and a level their mean.
    let world = world(Place::Checker, Some(Mirror::Plane), 0.1);
    let error = |blend: Blend, gloss: f64| {
        let view = View {
            gloss,
            ..world.view
        };
        let found = World::new(view, 1).by_twin(&Keep { blend, ..KEEP });
        let colours: Vec<DVec3> = found.iter().map(|pixel| pixel.colour.f64()).collect();
        world.truth.error(&colours).sqrt()
    };
    let (ray, level) = (error(Blend::Level, 0.0), error(Blend::Level, 0.1));
    assert!(level < 0.5 * ray, "{level} {ray}");
}

#[test]
fn the_reference_has_no_noise_in_its_squares() {
    let lens = (
        patches(Place::Thin),
        view(Place::Thin, Some(Mirror::Sphere), 0.1),
    );
    let rays = Rays::new(&lens.0);
    let camera = double(&World::new(lens.1, 1).given(&KEEP).camera);
    let lens = Lens::new(camera, &rays);
    let (few, many) = (
        Truth::new(&lens, 144, 64, 1),
        Truth::new(&lens, 144, 16_384, 2),
    );
    // The mean of both halves, against others: what is left of the noise of 64 samples.
    let off = many.error(&few.mean());
    assert!(off > 0.0 && few.noise() > 0.0);
    assert!(
        (0.3..3.0).contains(&(off / (0.5 * few.noise()))),
        "{off} {}",
        few.noise()
    );
    // A picture 0.1 too bright is 0.1 off, by few samples too.
    let bright: Vec<DVec3> = many.mean().iter().map(|p| *p + 0.1).collect();
    assert!((few.error(&bright).sqrt() - 0.1).abs() < 0.01);
}

#[test]
fn silhouettes_are_where_something_ends_before_something_else() {
    let count = |world: &World| world.edges.iter().filter(|edge| **edge).count();
    let of = |place: Place, mirror: Option<Mirror>| count(&world(place, mirror, 0.0));
    // Pixels that are as wide as their distance.
    let wide = |place: Place| {
        let view = View {
            resolution: 12,
            ..view(place, None, 0.0)
        };
        World::new(view, 1)
    };
    // Walls and floor meet, and nothing stands before them.
    assert_eq!(of(Place::Checker, None), 0);
    assert_eq!(of(Place::Checker, Some(Mirror::Plane)), 0);
    let [balls, thin] = [Place::Balls, Place::Thin].map(|place| count(&wide(place)));
    assert!(
        (10..130).contains(&balls) && (10..130).contains(&thin),
        "{balls} {thin}"
    );
    // Along 24 circles of a pixel neighbours end at much the same distance, unless a silhouette is between them.
    let world = wide(Place::Balls);
    let lens = world.lens();
    let mut cut = 0;
    for pixel in 0..world.pixels() {
        let gap = |circle: u32| {
            let end = |k: u32| {
                let u = [(f64::from(circle) + 0.5) / 24.0, f64::from(k) / 256.0];
                let hit = lens.hit(pixel, [u[0], u[1], 0.0, 0.0]);
                hit.map_or(f64::MAX, |hit| hit.0)
            };
            let pairs = (0..256).map(|k| end(k) / end(k + 1));
            pairs.fold(0.0, f64::max)
        };
        let widest = (0..24).map(gap).fold(0.0, f64::max);
        assert!(
            !world.edges[pixel as usize] || widest > 1.05,
            "{pixel}: {widest}"
        );
        cut += usize::from(widest > 1.1);
    }
    // One that cuts off next to nothing may be missed by 64 rays.
    assert!(10 * balls >= 7 * cut, "{balls} of {cut}");
}

#[test]
fn a_steady_error_does_not_shimmer_and_a_changing_one_by_how_much_it_changes() {
    let world = world(Place::Thin, None, 0.0);
    let truth = &world.truth;
    let off = |by: f64| {
        (
            truth,
            truth.mean().iter().map(|p| *p + by).collect::<Vec<_>>(),
        )
    };
    assert!(shimmer(&[off(0.1), off(0.1), off(0.1)]).abs() < 1e-12);
    // About their mean 0.1, -0.1, 0.1, -0.1: the squares' sum over one less than four.
    let found = shimmer(&[off(0.3), off(0.1), off(0.3), off(0.1)]);
    assert!((found - 0.04 / 3.0).abs() < 1e-12, "{found}");
}

#[test]
fn an_eye_that_turns_by_a_pixel_sees_the_next_one() {
    let still = View {
        resolution: 12,
        ..view(Place::Balls, None, 0.0)
    };
    let [still, turned] = [0.0, 1.0].map(|turned| World::new(View { turned, ..still }, 1));
    let (row, middle) = (6 * 12, 6);
    let axis = |world: &World, column: u32| world.lens().pixel(row + column).0;
    let (next, now) = (axis(&still, middle), axis(&turned, middle - 1));
    // In the middle row about the horizon, half a pixel to either side: angles of neighbours differ a little.
    assert!(
        next.angle_between(now) < 0.01 * next.angle_between(axis(&still, middle - 1)),
        "{next} {now}"
    );
}

#[test]
fn crossings_and_budgets_are_those_of_a_hand() {
    let errors: Vec<f64> = (0..9).map(|k| 0.5_f64.powi(k)).collect();
    assert_eq!(crossing(&errors, 2.0), Crossing::At(1.0));
    assert_eq!(crossing(&errors, 1e-9), Crossing::Beyond);
    let Crossing::At(at) = crossing(&errors, 0.1) else {
        panic!()
    };
    assert!((at - 10.0).abs() < 1e-9, "{at}");
    // A curve that falls below and rises again counts where it falls for good.
    let Crossing::At(at) = crossing(&[1.0, 0.1, 1.0, 0.25], 0.5) else {
        panic!()
    };
    assert!((at - 4.0 * 2.0_f64.powf(0.5)).abs() < 1e-9, "{at}");
    let spent = budget(&[1.0, 1.0, 2.0, 4.0], 16);
    assert_eq!(spent, [8, 8, 16, 32]);
    // Of 1.2, 2.4 and 2.4 samples, what one pixel loses by rounding goes to the next.
    assert_eq!(budget(&[1.0, 2.0, 2.0], 2), [1, 3, 2]);
    let spent = budget(&[1e-9, 1.0, 1e9, 1e9], 16);
    assert_eq!(spent.iter().sum::<u32>(), 64);
    let triangle = [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]].map(|p| V3::<f64>::new(p[0], p[1], 1.0));
    assert!(disk_triangle(triangle[0], triangle[1], triangle[2]).area > 0.7);
}

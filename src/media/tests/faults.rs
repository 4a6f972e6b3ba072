//! Faults planted into the kernels of structures, walks and paths: each must be seen.

use super::scatter::first_wrong;
use super::segments::adapter;
use crate::march::{March, Marcher, Scheme, march_path, parallel_rays};
use crate::medium::{Homogeneity, Key, Medium};
use crate::optics::Optical;
use crate::rays::random_and_hard;
use crate::scatter::{Adding, Strategy, scatter_list};
use crate::segments::{Walker, first_difference};
use crate::{procedures, structure};
use raystone_core::params::Choice as _;
use raystone_gpu::{Gpu, KernelLibrary};

/// Structure that shows it, kernel, text, its replacement.
type Fault = (&'static str, &'static str, &'static str, &'static str);

const WALKS: [Fault; 22] = [
    (
        "dda",
        "walk",
        "vec3<i32>(low) - 1, vec3<i32>(high)",
        "vec3<i32>(low), vec3<i32>(high)",
    ),
    (
        "dda",
        "walk",
        "let planes = select(low, high, forward);",
        "let planes = select(high, low, forward);",
    ),
    ("dda", "walk", "planes == border", "vec3<bool>(false)"),
    (
        "dda",
        "walk",
        "next == vec3<f32>(exit)",
        "next <= vec3<f32>(exit * 1.01)",
    ),
    (
        "level-map",
        "walk",
        "segment.region.sigma.x == segment.region.sigma.y",
        "segment.region.homogeneous",
    ),
    ("dda", "walk", "0.57735026", "0.5"),
    ("dda", "walk", "position - 0.5", "position"),
    ("dda", "walk", "- near) * w.y", "- near) * w.x"),
    (
        "dda",
        "walk",
        "floor(ray.origin + ray.direction * t)",
        "floor(ray.origin + ray.direction)",
    ),
    (
        "min-max",
        "medium",
        "min(low + vec3<u32>(1u << level), medium.resolution)",
        "low + vec3<u32>(1u << level)",
    ),
    (
        "min-max",
        "medium",
        "<= medium.spans.y",
        "<= medium.spans.x",
    ),
    (
        "min-max",
        "medium",
        "sigma.y - sigma.x <=",
        "sigma.y - sigma.x <",
    ),
    ("min-max", "medium", "/ 7u * 8u", "/ 7u * 7u"),
    ("dda", "medium", "0x38000000u", "0x38800000u"),
    (
        "level-map",
        "medium",
        "(8u * (place & 3u))",
        "(24u - 8u * (place & 3u))",
    ),
    ("dda", "structure/dda", "voxel + 1u", "voxel + 2u"),
    (
        "level-map",
        "structure/level_map",
        "cube_of(voxel, level,",
        "cube_of(voxel, 0u,",
    ),
    ("min-max", "structure/min_max", "level > 0u", "level > 1u"),
    (
        "bricks",
        "structure/bricks",
        "(local.y + 8u * local.z)",
        "(local.z + 8u * local.y)",
    ),
    (
        "sparse-tree",
        "structure/sparse_tree",
        "(bits.y << 1u) | (bits.z << 2u)",
        "(bits.z << 1u) | (bits.y << 2u)",
    ),
    (
        "chebyshev",
        "structure/chebyshev",
        "voxel + reach + 1u",
        "voxel + reach",
    ),
    (
        "cube-bvh",
        "structure/cube_bvh",
        "all(voxel < high)",
        "all(voxel <= high)",
    ),
];

/// Scheme that shows it, kernel, text, its replacement.
const PATHS: [(Scheme, &str, &str, &str); 7] = [
    (
        Scheme::Euler,
        "bend",
        "v * (h / here.n)",
        "v * (h / norm(v))",
    ),
    (Scheme::Printed, "bend", "(h * here.n)", "h"),
    (
        Scheme::SemiImplicit,
        "bend",
        "x + kicked * (h / norm(kicked))",
        "x + v * (h / norm(v))",
    ),
    (
        Scheme::DriftKickDrift,
        "bend",
        "optics_at(middle).gradient",
        "optics_at(x).gradient",
    ),
    (
        Scheme::RungeKutta,
        "bend",
        "(b.v + c.v) * 2.0",
        "(b.v + c.v)",
    ),
    (
        Scheme::Normalised,
        "optics",
        "-r / (square * n)",
        "-r / square",
    ),
    (Scheme::Normalised, "march", "max(drift, ", "min(drift, "),
];

/// A device whose kernel has a fault.
fn with_fault(gpu: &Gpu, file: &str, text: &str, fault: &str) -> Gpu {
    let library = KernelLibrary::default();
    let of_volumes = ["walk", "medium", "structure/"];
    let folder = if of_volumes.iter().any(|start| file.starts_with(start)) {
        "volume"
    } else {
        "media"
    };
    let name = format!("{folder}/{file}");
    let sound = library
        .text(&name)
        .unwrap_or_else(|| panic!("there is no {name}"));
    assert_eq!(sound.matches(text).count(), 1, "{name}: `{text}`");
    let changed = sound.replace(text, fault);
    gpu.with_kernels(library.with_sources(&[(&name, &changed)]))
}

#[test]
fn faults_of_walks_are_seen() {
    let Some(gpu) = adapter() else { return };
    // Neither a cube nor a power of two, and σ nearly constant in places.
    let mut volume = procedures::cloud(20).unwrap();
    (volume.resolution, volume.high.z) = ([20, 25, 16], 0.7);
    let homogeneity = Homogeneity {
        key: Key::Extinction,
        epsilon: 0.25,
    };
    let registry = structure::registry();
    let differs = |gpu: &Gpu, name: &str| {
        let structure = registry
            .find(name)
            .unwrap()
            .make(&Default::default())
            .unwrap();
        let medium = Medium::new(&volume, structure, homogeneity);
        let rays = random_and_hard(&volume, &medium, 2048, 3);
        // A walk that does not end raises the error word.
        match Walker::new(gpu, &medium, &rays, true).unwrap().walk() {
            Ok((found, _)) => first_difference(&medium, &rays, &found).is_some(),
            Err(_) => true,
        }
    };
    for kind in registry.iter() {
        assert!(
            !differs(&gpu, kind.name()),
            "{} without a fault",
            kind.name()
        );
    }
    for (name, file, text, fault) in WALKS {
        let faulty = with_fault(&gpu, file, text, fault);
        assert!(
            differs(&faulty, name),
            "{file}: `{text}` as `{fault}` was not seen"
        );
    }
}

#[test]
fn faults_of_paths_are_seen() {
    let Some(gpu) = adapter() else { return };
    let lens = Optical::Lens {
        size: glam::UVec3::splat(32),
        radius: 12.0,
    };
    let heights: Vec<f64> = (1..64).map(|k| 0.15 * f64::from(k)).collect();
    let begins = parallel_rays(&lens, 32, 12.0, &heights);
    for (scheme, file, text, fault) in PATHS {
        let march = March {
            scheme,
            step: 0.5,
            nudge: 0.0,
            most_steps: 256,
        };
        let differs = |gpu: &Gpu| {
            let (found, _) = Marcher::new(gpu, &march, &lens, None, &begins)
                .unwrap()
                .march()
                .unwrap();
            begins.iter().zip(found).any(|(begin, found)| {
                let twin = march_path(&march, &lens, None, *begin);
                (twin.path.x - found.path.x).length() > 1e-3
                    || (twin.drift - found.drift).abs() > 1e-4
            })
        };
        assert!(!differs(&gpu), "{scheme:?} without a fault");
        let faulty = with_fault(&gpu, file, text, fault);
        assert!(
            differs(&faulty),
            "{file}: `{text}` as `{fault}` was not seen"
        );
    }
}

/// Strategy that shows it, kernel, text, its replacement.
const SCATTERS: [(Strategy, &str, &str, &str); 13] = [
    // A carry that is lost, and one that comes for nothing.
    (
        Strategy::Fixed64,
        "wide",
        "select(0u, 1u, old + low < old)",
        "0u",
    ),
    (
        Strategy::Tiles,
        "wide",
        "select(carry, carry + 0xffffffffu, units < 0)",
        "carry",
    ),
    // A wrong scale, and numbers that are cut off.
    (
        Strategy::Fixed64,
        "resolve",
        "f32(low)) / scatter.units",
        "f32(low)) / (2.0 * scatter.units)",
    ),
    (Strategy::Fixed32, "tallies", "units + 0.5));", "units));"),
    (
        Strategy::Fixed64,
        "resolve",
        "select(value, -value, negative)",
        "value",
    ),
    // A wrap that is told of sums without one.
    (Strategy::Fixed32, "fixed_32", "sum < old", "sum > old"),
    // No second attempt, and energy that is dropped and not told.
    (
        Strategy::Swap,
        "swap",
        "if (swapped.exchanged) {",
        "if (true) {",
    ),
    (
        Strategy::Swap,
        "tallies",
        "dropped += energy.x + energy.y + energy.z;",
        "dropped += energy.x;",
    ),
    // Entries of a table that are not flushed, or are taken from another voxel.
    (
        Strategy::Tiles,
        "tiles",
        "if (owner == 0u) {",
        "if (owner <= 1u) {",
    ),
    (
        Strategy::Tiles,
        "tiles",
        "return owner == place + 1u;",
        "return true;",
    ),
    (
        Strategy::Sort,
        "append",
        "vec4<f32>(direction, f32(place >> 16u))",
        "vec4<f32>(direction, 0.0)",
    ),
    (
        Strategy::Sort,
        "sum",
        "keys[middle] < key",
        "keys[middle] <= key",
    ),
    (
        Strategy::Sort,
        "sum",
        "direction += one[1].xyz *",
        "direction = one[1].xyz *",
    ),
];

#[test]
fn faults_of_scatter_are_seen() {
    let Some(gpu) = adapter() else { return };
    let mut deposits = super::scatter::deposits(20_000);
    deposits[3].place = super::scatter::MOST;
    // Enough in one voxel for a carry of two words.
    for k in 1..2000 {
        deposits[10 * k - 1].place = 1;
        deposits[10 * k - 1].energy = glam::Vec3::splat(0.9);
    }
    let all: f64 = (deposits.iter())
        .map(|d| f64::from(d.energy.element_sum()))
        .sum();
    let differs = |gpu: &Gpu, strategy: Strategy| {
        let adding = Adding::new(strategy, 20_001);
        let whole = match first_wrong(gpu, adding, &deposits) {
            Ok((wrong, tallies)) => wrong.is_some() || tallies.wraps > 0,
            Err(_) => true,
        };
        // With one attempt, what is kept and what is told to be dropped are all.
        let once = Adding {
            attempts: 1,
            ..adding
        };
        let (found, tallies, _) =
            scatter_list(gpu, once, super::scatter::CELLS, &deposits).unwrap();
        let kept = found.iter().map(|v| f64::from(v[0] + v[1] + v[2]));
        let kept: f64 = kept.sum::<f64>() + tallies.dropped;
        whole || (kept / all - 1.0).abs() > 1e-3
    };
    for strategy in Strategy::ALL.iter().copied() {
        assert!(!differs(&gpu, strategy), "{strategy:?} without a fault");
    }
    for (strategy, file, text, fault) in SCATTERS {
        let faulty = with_fault(&gpu, &format!("scatter/{file}"), text, fault);
        assert!(
            differs(&faulty, strategy),
            "{file}: `{text}` as `{fault}` was not seen"
        );
    }
}

/// Of photons: text, its replacement.
const PHOTONS: [(&str, &str); 5] = [
    // A voxel too far.
    (
        "deposit(place_of(voxel)",
        "deposit(place_of(vec3<u32>(next.voxel))",
    ),
    ("through *= exp(-depth);", ""),
    ("way * mean_transmittance(depth)", "way"),
    ("energy, photon[2].xyz", "energy, photon[1].xyz"),
    ("let stop = min(next.t, end);", "let stop = next.t;"),
];

/// Of the view.
const VIEWS: [(&str, &str); 7] = [
    // No phase function, and one the other way round.
    (
        "phase_density(Phase(gather.phase_kind, gather.anisotropy), cosine)",
        "0.07957747",
    ),
    ("-dot(sums.direction", "dot(sums.direction"),
    // No transmittance up to the eye.
    ("through *= after;", ""),
    (
        "* (through * (1.0 - after))",
        "* (through * (stop - walk.t))",
    ),
    // Half a voxel beside.
    ("position - 0.5", "position"),
    ("* gather.albedo", ""),
    ("light += scattered(", "light = scattered("),
];

#[test]
fn faults_of_photons_and_views_are_seen() {
    let Some(gpu) = adapter() else { return };
    let worst = |gpu: &Gpu| {
        let [worst, all] = super::pipeline::deposit_error(gpu, "level-map", Strategy::Fixed64);
        worst.max(all)
    };
    let sound = worst(&gpu);
    assert!(sound < 1e-5, "{sound}");
    for (text, fault) in PHOTONS {
        let found = worst(&with_fault(&gpu, "photons", text, fault));
        assert!(
            found.is_nan() || found >= 1e-4,
            "photons: `{text}` as `{fault}`: {found}"
        );
    }
    let fog = super::pipeline::fog([24; 3]);
    let error = |gpu: &Gpu| super::pipeline::image_error(gpu, &fog, "dda", 192);
    let sound = error(&gpu);
    assert!(sound < 0.01, "{sound}");
    for (text, fault) in VIEWS {
        let found = error(&with_fault(&gpu, "gather", text, fault));
        assert!(
            found.is_nan() || found >= 2.0 * sound,
            "view: `{text}` as `{fault}`: {found} of {sound}"
        );
    }
}

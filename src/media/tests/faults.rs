//! Faults planted into the kernels of structures, walks and paths: each must be seen.

use super::segments::adapter;
use crate::march::{March, Marcher, Scheme, march_path, parallel_rays};
use crate::medium::{Homogeneity, Key, Medium};
use crate::optics::Optical;
use crate::rays::random_and_hard;
use crate::segments::{Walker, first_difference};
use crate::{procedures, structure};
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
        "march",
        "v * (h / here.n)",
        "v * (h / norm(v))",
    ),
    (Scheme::Printed, "march", "(h * here.n)", "h"),
    (
        Scheme::SemiImplicit,
        "march",
        "x + kicked * (h / norm(kicked))",
        "x + v * (h / norm(v))",
    ),
    (
        Scheme::DriftKickDrift,
        "march",
        "optics_at(middle).gradient",
        "optics_at(x).gradient",
    ),
    (
        Scheme::RungeKutta,
        "march",
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
    let name = format!("media/{file}");
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

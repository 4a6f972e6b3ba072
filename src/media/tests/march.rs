use crate::march::{
    Ended, March, Marcher, Path, Scheme, angle_of, ball_deviation, focus_miss, march_path,
    parallel_rays,
};
use crate::medium::{Homogeneity, Key, Medium};
use crate::optics::Optical;
use crate::procedures::ball;
use crate::{Volume, structure};
use glam::{UVec3, Vec3};
use raystone_gpu::{AdapterChoice, KernelLibrary, probe_arithmetic};
use std::sync::OnceLock;

const SIDE: u32 = 128;
const LENS: f64 = 50.0;
const BALL: f64 = 40.0;

fn march(scheme: Scheme, step: f32) -> March {
    March {
        scheme,
        step,
        nudge: 1e-3,
        most_steps: 8 * SIDE * (1.0 / step.max(0.01)) as u32 + 8 * SIDE,
    }
}

fn lens() -> Optical {
    Optical::Lens {
        size: UVec3::splat(SIDE),
        radius: LENS as f32,
    }
}

/// Mean distance from the focus, of ten rays.
fn mean_miss(scheme: Scheme, step: f32) -> f64 {
    let heights: Vec<f64> = (0..10).map(|k| 2.0 + 4.5 * f64::from(k)).collect();
    let begins = parallel_rays(&lens(), SIDE, LENS, &heights);
    let ended = begins
        .iter()
        .map(|begin| march_path(&march(scheme, step), &lens(), None, *begin));
    ended
        .map(|ended| focus_miss(SIDE, LENS, &ended))
        .sum::<f64>()
        / heights.len() as f64
}

#[test]
fn schemes_reach_the_focus_of_a_lens_with_their_order_and_the_printed_one_does_not() {
    let steps = [2.0, 1.0, 0.5, 0.25];
    for scheme in Scheme::ALL {
        let misses = steps.map(|step| mean_miss(scheme, step));
        println!("{scheme:?}: {misses:.4?}");
        let ratios = [0, 1, 2].map(|k| misses[k] / misses[k + 1]);
        match scheme {
            // About 4 voxels with every step.
            Scheme::Printed => assert!(misses.iter().all(|m| *m > 3.0), "{misses:?}"),
            Scheme::Euler | Scheme::Normalised | Scheme::SemiImplicit => {
                assert!(
                    ratios.iter().all(|r| (1.8..2.3).contains(r)),
                    "{scheme:?} {ratios:?}"
                );
            }
            // Of second order and more; rounding of f32 is reached below a thousandth.
            _ => assert!(
                misses[0] < 0.02 && misses[2] < 2e-3,
                "{scheme:?} {misses:?}"
            ),
        }
    }
    let at_two = |scheme| mean_miss(scheme, 2.0);
    assert!(at_two(Scheme::SemiImplicit) < at_two(Scheme::Normalised));
    assert!(at_two(Scheme::Normalised) < at_two(Scheme::Euler));
}

fn glass() -> &'static (Volume, Optical) {
    static GLASS: OnceLock<(Volume, Optical)> = OnceLock::new();
    GLASS.get_or_init(|| {
        let volume = ball(SIDE, BALL / f64::from(SIDE)).unwrap();
        let optical = Optical::of(&volume);
        (volume, optical)
    })
}

/// Root of the mean square of errors of angles in degrees, the greatest drift, and the mean number of steps of eight rays
/// through a ball of glass.
fn through_glass(scheme: Scheme, step: f32, regions: Option<&Medium>) -> (f64, f32, f64) {
    let optical = &glass().1;
    let heights: Vec<f64> = (1..=8).map(|k| 4.0 * f64::from(k)).collect();
    let middle = SIDE as f32 / 2.0;
    let ended = heights.iter().map(|height| {
        let begin = Vec3::new(0.5, middle + *height as f32, middle);
        let begin = Path::new(optical, begin, Vec3::X);
        let ended = march_path(&march(scheme, step), optical, regions, begin);
        assert!(!optical.holds(ended.path.x), "{ended:?}");
        ended
    });
    let ended: Vec<Ended> = ended.collect();
    let square = |(ended, height): (&Ended, &f64)| {
        (angle_of(ended.path.v) - ball_deviation(1.5, BALL, *height)).powi(2)
    };
    let sum: f64 = ended.iter().zip(&heights).map(square).sum();
    let drift = ended.iter().map(|e| e.drift).fold(0.0, f32::max);
    let steps: u32 = ended.iter().map(|e| e.steps).sum();
    ((sum / 8.0).sqrt(), drift, f64::from(steps) / 8.0)
}

#[test]
fn a_ball_of_glass_turns_light_as_snell_says_to_what_its_blurred_border_allows() {
    for scheme in Scheme::ALL {
        let found = [1.0, 0.25].map(|step| through_glass(scheme, step, None));
        println!("{scheme:?}: {found:.3?}");
        let [(one, ..), (quarter, ..)] = found;
        match scheme {
            Scheme::Printed => assert!(one > 2.0 && quarter > 2.0, "{found:?}"),
            Scheme::Euler => assert!((0.7..2.5).contains(&one), "{found:?}"),
            _ => assert!(one < 1.0 && quarter < 0.8, "{scheme:?} {found:?}"),
        }
    }
}

fn level_map(epsilon: f64) -> Medium {
    let registry = structure::registry();
    let map = registry
        .find("level-map")
        .unwrap()
        .make(&Default::default())
        .unwrap();
    let key = Key::Refraction;
    Medium::new(&glass().0, map, Homogeneity { key, epsilon })
}

#[test]
fn cubes_of_nearly_constant_index_save_steps_up_to_a_cliff() {
    let voxels = through_glass(Scheme::Normalised, 1.0, None);
    let mut found = Vec::new();
    for epsilon in [0.3, 0.2, 0.1, 0.05, 0.01, 0.001] {
        let of = through_glass(Scheme::Normalised, 0.0, Some(&level_map(epsilon)));
        println!("ε {epsilon}: {of:.3?}");
        found.push(of);
    }
    let fine = &found[3..];
    assert!(fine.iter().all(|of| of.0 < voxels.0 + 0.5), "{fine:?}");
    assert!(fine.iter().all(|of| of.2 < voxels.2), "{fine:?}");
    assert!(found[0].0 > 4.0 * voxels.0, "{:?} has no cliff", found[0]);
}

/// A grid whose index falls along z from `below` to `above` over `width` voxels in the middle.
fn slab(below: f32, above: f32, width: f64) -> Optical {
    let volume = Volume::new([8, 8, 64], |p| {
        let t = (((p.z - 0.5) * 64.0 / width) + 0.5).clamp(0.0, 1.0) as f32;
        [0.0, 0.0, below + (above - below) * t]
    });
    Optical::of(&volume.unwrap())
}

#[test]
fn light_is_reflected_totally_beyond_the_critical_angle_and_refracted_below_it() {
    let optical = slab(1.5, 1.0, 8.0);
    let critical = (1.0_f32 / 1.5).asin();
    for scheme in [
        Scheme::SemiImplicit,
        Scheme::DriftKickDrift,
        Scheme::RungeKutta,
    ] {
        for (angle, reflected) in [(critical + 0.08, true), (critical - 0.08, false)] {
            let direction = Vec3::new(angle.sin(), 0.0, angle.cos());
            // The grid is narrow and repeats itself along x: begin far enough to the left.
            let begin = Path::new(&optical, Vec3::new(0.0, 4.0, 20.0), direction);
            let wide = Wide(&optical);
            let ended = wide.march(&march(scheme, 0.25), begin);
            assert_eq!(ended.v.z < 0.0, reflected, "{scheme:?} {angle}: {ended:?}");
            // n sin θ is conserved where n varies along z alone.
            assert!(
                (ended.v.x - 1.5 * angle.sin()).abs() < 1e-4,
                "{scheme:?}: {ended:?}"
            );
            let n = if reflected { 1.5 } else { 1.0 };
            assert!((ended.v.length() - n).abs() < 0.01, "{scheme:?}: {ended:?}");
        }
    }
}

/// A grid that goes on along x.
struct Wide<'a>(&'a Optical);

impl Wide<'_> {
    fn march(&self, march: &March, begin: Path) -> Path {
        let mut path = begin;
        let one = March {
            most_steps: 1,
            ..*march
        };
        for _ in 0..march.most_steps {
            if !(1.0..63.0).contains(&path.x.z) {
                break;
            }
            path.x.x = 4.0;
            path = march_path(&one, self.0, None, path).path;
        }
        path
    }
}

#[test]
fn paths_that_use_up_their_steps_are_told() {
    let capped = March {
        most_steps: 10,
        ..march(Scheme::SemiImplicit, 1.0)
    };
    let begin = parallel_rays(&lens(), SIDE, LENS, &[10.0])[0];
    let ended = march_path(&capped, &lens(), None, begin);
    assert!(ended.steps == 10 && lens().holds(ended.path.x));
}

#[test]
fn kernels_march_as_their_twin_does() {
    let gpu = raystone_gpu::open(&AdapterChoice::Best, KernelLibrary::default())
        .unwrap_or_else(|e| panic!("no adapter: run scripts/install-driver ({e})"));
    let exact = probe_arithmetic(&gpu).unwrap().is_exact();
    let volume = ball(32, 0.3).unwrap();
    let registry = structure::registry();
    let map = registry
        .find("level-map")
        .unwrap()
        .make(&Default::default())
        .unwrap();
    let key = Key::Refraction;
    let medium = Medium::new(&volume, map, Homogeneity { key, epsilon: 0.05 });
    let grid = Optical::of(&volume);
    let lens = Optical::Lens {
        size: UVec3::splat(32),
        radius: 12.0,
    };
    let cases = [
        (&grid, None, 0.5),
        (&grid, Some(&medium), 0.0),
        // Of small regions several are one step.
        (&grid, Some(&medium), 2.0),
        (&lens, None, 0.5),
    ];
    for (optical, regions, step) in cases {
        let heights: Vec<f64> = (0..64).map(|k| -9.0 + 0.28 * f64::from(k)).collect();
        let begins = parallel_rays(optical, 32, 12.0, &heights);
        for scheme in Scheme::ALL {
            let how = march(scheme, step);
            let marcher = Marcher::new(&gpu, &how, optical, regions, &begins).unwrap();
            let (found, _) = marcher.march().unwrap();
            for (begin, found) in begins.iter().zip(&found) {
                let twin = march_path(&how, optical, regions, *begin);
                let off = (twin.path.x - found.path.x).length();
                // Of Runge and Kutta's sums the driver may choose the order.
                let rounded = !exact || scheme == Scheme::RungeKutta;
                let same = twin == *found || (rounded && off < 0.1);
                assert!(
                    same,
                    "{scheme:?} {regions}: {found:?}, not {twin:?}",
                    regions = regions.is_some()
                );
            }
        }
    }
}

//! Reflecting materials: sampling against density against value, by f64 formulas and the device's
//! own answers; and detection of planted faults.

mod device;
mod faults;
mod quadrature;
mod reference;
mod surfaces;

use crate::support::open;
use device::{Answer, Ask, Device, rounded};
use glam::DVec3;
use quadrature::{Grid, chi_square};
use raystone::gpu::KernelLibrary;
use raystone::random::Pcg32;
use reference::{Model, models};
use std::path::Path;

/// Degrees from the normal to the viewer.
const ANGLES: [f64; 4] = [0.0, 35.0, 70.0, 86.0];
/// Sampled directions per material and angle.
const SAMPLES: usize = 1 << 14;
/// Probability of a false finding.
const LEAST_P: f64 = 1e-5;

fn from(angle: f64) -> DVec3 {
    let (sin, cos) = angle.to_radians().sin_cos();
    let (y, x) = 0.7_f64.sin_cos();
    rounded(DVec3::new(sin * x, sin * y, cos))
}

/// Faults in value and density of directions chosen by the test.
fn told(device: &Device, model: &Model, o: DVec3, grid: &Grid) -> Vec<&'static str> {
    let directions: Vec<DVec3> = grid.some().map(rounded).collect();
    let asks: Vec<Ask> = directions.iter().map(|i| Ask::Tell(*i)).collect();
    let answers = device.ask(&model.material(), o, &asks);
    let mut out = Vec::new();
    for (i, answer) in directions.iter().zip(&answers) {
        let (pdf, value) = (model.pdf(o, *i), model.value(o, *i));
        let near =
            |found: f64, expected: f64| (found - expected).abs() <= 1e-3 * expected.abs() + 1e-6;
        // Directions in the surface may be seen on either side.
        if i.z.abs() < 1e-6 {
            continue;
        }
        if !near(answer.pdf, pdf) {
            out.push("density");
        }
        let found = answer.weight * answer.pdf;
        if !(0..3).all(|k| near(found[k], value[k])) {
            out.push("value");
        }
        if i.z < 0.0 && answer.pdf != 0.0 {
            out.push("side");
        }
    }
    out
}

/// Faults in sampled directions: distribution, densities, and energy.
fn sampled(device: &Device, model: &Model, o: DVec3, grid: &Grid) -> Vec<&'static str> {
    let mut random = Pcg32::with_stream(7, Pcg32::DEFAULT_STREAM);
    let mut unit = || (random.next_u32() >> 8) as f32 / 16_777_216.0;
    let asks: Vec<Ask> = (0..SAMPLES)
        .map(|_| Ask::Sample([unit(), unit()]))
        .collect();
    let answers = device.ask(&model.material(), o, &asks);
    let mut out = Vec::new();
    let directions: Vec<DVec3> = answers.iter().map(|a| a.direction).collect();
    let p = chi_square(grid, &directions, |i| model.pdf(o, i));
    if p < LEAST_P {
        out.push("distribution");
    }
    let weights = answers.iter().map(|a| a.weight);
    let mean = weights.clone().sum::<DVec3>() / SAMPLES as f64;
    let squares = weights.map(|w| (w - mean) * (w - mean)).sum::<DVec3>();
    let error = (squares / (SAMPLES * SAMPLES) as f64).map(f64::sqrt);
    let albedo = grid.integral(|i| model.value(o, i));
    let off = (mean - albedo).abs() - (5.0 * error + 2e-3 * albedo);
    if off.is_nan() || off.max_element() > 0.0 {
        out.push("energy");
    }
    if albedo.is_nan() || albedo.max_element() > 1.003 {
        out.push("more than arrives");
    }
    if answers.iter().any(|a| !is_consistent(a, model, o)) {
        out.push("weight");
    }
    out
}

/// True if density and weight of a sampled direction match the formulas; at the rim of a narrow
/// lobe the rounded direction has another density.
fn is_consistent(answer: &Answer, model: &Model, o: DVec3) -> bool {
    let i = answer.direction;
    if i.z.abs() < 1e-4 {
        return answer.weight.is_finite();
    }
    let (pdf, value) = (model.pdf(o, i), model.value(o, i));
    let near = |found: f64, expected: f64| (found - expected).abs() <= 0.02 * expected.abs() + 1e-5;
    near(answer.pdf, pdf)
        && (0..3).all(|k| near(answer.weight[k] * pdf, value[k]))
        && (i.length() - 1.0).abs() < 1e-5
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Seen {
    First,
    All,
}

/// Every kind of fault, or the first, in materials chosen by `concerns`, with these kernels.
fn faults_of(
    library: KernelLibrary,
    wanted: Seen,
    concerns: impl Fn(&Model) -> bool,
) -> Vec<&'static str> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images/materials/kernels");
    let device = Device::new(open(library.with_folder(&folder).expect("kernels")));
    let chosen: Vec<Model> = models().into_iter().filter(concerns).collect();
    assert!(!chosen.is_empty(), "no material was looked at");
    let mut out = Vec::new();
    // Values of all first: they cost least.
    for check in [told, sampled] {
        for (model, angle) in chosen.iter().flat_map(|m| ANGLES.map(|angle| (m, angle))) {
            let o = from(angle);
            let grid = Grid::around(DVec3::new(-o.x, -o.y, o.z));
            for fault in check(&device, model, o, &grid) {
                if !out.contains(&fault) {
                    println!("{fault}: {model:?} from {angle} degrees");
                    out.push(fault);
                }
            }
            if wanted == Seen::First && !out.is_empty() {
                return out;
            }
        }
    }
    out
}

#[test]
fn sampling_density_and_value_agree_with_the_formulas() {
    assert_eq!(
        faults_of(KernelLibrary::default(), Seen::All, |_| true),
        [""; 0]
    );
}

/// f is symmetric in the two directions; Phong's lobe, by definition, is not.
#[test]
fn all_but_phong_are_reciprocal() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images/materials/kernels");
    let library = KernelLibrary::default().with_folder(&folder);
    let device = Device::new(open(library.expect("kernels")));
    let o = from(35.0);
    for model in models() {
        let material = model.material();
        let grid = Grid::around(DVec3::new(-o.x, -o.y, o.z));
        let above: Vec<DVec3> = grid.some().map(rounded).filter(|i| i.z > 0.05).collect();
        let asks: Vec<Ask> = above.iter().map(|i| Ask::Tell(*i)).collect();
        let forth = device.ask(&material, o, &asks);
        let mut worst = 0.0_f64;
        for (i, forth) in above.iter().zip(&forth).step_by(7) {
            let back = device.ask(&material, *i, &[Ask::Tell(o)])[0];
            let forth = forth.weight * forth.pdf / i.z;
            let back = back.weight * back.pdf / o.z;
            let difference = (forth - back).abs() - 1e-6;
            worst = worst.max((difference / forth.max(DVec3::splat(1e-9))).max_element());
        }
        let is_phong = matches!(model, Model::Phong { .. });
        assert_eq!(worst > 2e-3, is_phong, "{model:?}: {worst}");
    }
}

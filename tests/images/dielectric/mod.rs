//! The smooth dielectric against closed forms in f64: Fresnel's equations, Snell's law, total
//! internal reflection, radiance in the denser medium; and detection of planted faults.

use crate::support::{kernels_with, open};
use raystone::gpu::{
    Bindings, Composition, Gpu, KernelLibrary, Player, Recording, Storage, UniformValues,
};
use std::path::Path;

const TINT: f64 = 0.5;
const IORS: [f64; 5] = [1.0, 1.1, 1.33, 1.5, 2.4];

#[derive(Debug, Clone, Copy)]
struct Arrival {
    cosine: f32,
    /// Below the reflectance, the ray is reflected.
    u: f32,
    outside: bool,
    ior: f32,
    thin: bool,
    /// By Schlick's polynomial.
    schlick: bool,
}

impl Arrival {
    /// Ratio of the index beyond the surface to that before it.
    fn eta(&self) -> f64 {
        let ior = f64::from(self.ior);
        if self.outside || self.thin {
            ior
        } else {
            1.0 / ior
        }
    }
}

#[derive(Debug)]
struct Departure {
    direction: [f64; 3],
    pdf: f64,
    weight: f64,
    medium: f64,
    is_delta: bool,
}

/// Angles from normal to grazing, both sides, both outcomes, thin and thick.
fn arrivals() -> Vec<Arrival> {
    let mut out = Vec::new();
    for ior in IORS.map(|n| n as f32) {
        for step in 0..=200_u16 {
            let cosine = f32::from(step) / 200.0;
            for (u, schlick) in [
                (0.0, false),
                (1.0 - f32::EPSILON, false),
                (0.0, true),
                (1.0 - f32::EPSILON, true),
            ] {
                for (outside, thin) in [(true, false), (false, false), (true, true), (false, true)]
                {
                    out.push(Arrival {
                        cosine,
                        u,
                        outside,
                        ior,
                        thin,
                        schlick,
                    });
                }
            }
        }
    }
    out
}

fn scatter(gpu: &Gpu, arrivals: &[Arrival]) -> Vec<Departure> {
    let mut parameters = Vec::new();
    let mut asked = Vec::new();
    for a in arrivals {
        let [thin, schlick] = [a.thin, a.schlick].map(|is| f32::from(u8::from(is)));
        let row = [a.ior, thin, schlick, 0.0].map(f32::to_bits);
        let place = parameters.iter().position(|known| *known == row);
        let place = place.unwrap_or_else(|| {
            parameters.push(row);
            parameters.len() - 1
        });
        let side = if a.outside { 1.0 } else { -1.0 };
        asked.push([a.cosine, a.u, side, place as f32]);
    }
    let kernel = Composition::new("test/scatter").feature("dielectric", true);
    let kernel = gpu
        .pipeline(&kernel, true)
        .unwrap_or_else(|e| panic!("{e}"));
    let buffer = |name, words: &[[f32; 4]]| gpu.storage(name, words).expect("a buffer");
    let tables = gpu
        .storage("shading_tables", &parameters)
        .expect("a buffer");
    let count = arrivals.len() as u32;
    let departures = Storage::scratch("departures", u64::from(count) * 32);
    let mut bindings = Bindings::new();
    bindings
        .buffer("shading_tables", &tables)
        .buffer("arrivals", &buffer("arrivals", &asked))
        .buffer("departures", &departures)
        .uniform("scatter", UniformValues::new().u32("count", count));
    let mut recording = Recording::new();
    recording
        .run("scatter", &kernel, &bindings, [count.div_ceil(64), 1, 1])
        .download("departures", &departures);
    let played = Player::new(gpu).play(&recording).expect("it plays");
    let words: Vec<[f32; 8]> = played.download("departures").expect("departures");
    let departure = |w: &[f32; 8]| {
        let [x, y, z, pdf, weight, medium, is_delta, _] = w.map(f64::from);
        Departure {
            direction: [x, y, z],
            pdf,
            weight,
            medium,
            is_delta: is_delta == 1.0,
        }
    };
    words.iter().map(departure).collect()
}

/// Reflectance for unpolarised light by sines and tangents (Fresnel 1823), unlike the kernel.
fn reflectance(cosine: f64, eta: f64) -> f64 {
    let arriving = cosine.clamp(0.0, 1.0).acos();
    let sine = arriving.sin() / eta;
    if sine >= 1.0 {
        return 1.0;
    }
    let refracted = sine.asin();
    let (difference, sum) = (arriving - refracted, arriving + refracted);
    if sum < 1e-3 {
        return ((eta - 1.0) / (eta + 1.0)).powi(2);
    }
    let perpendicular = difference.sin() / sum.sin();
    let parallel = difference.tan() / sum.tan();
    0.5 * (perpendicular.powi(2) + parallel.powi(2))
}

/// Schlick's polynomial in the cosine on the thinner side, where light is nearer to grazing; 1 where nothing is refracted.
fn polynomial(cosine: f64, cos_refracted: f64, eta: f64) -> f64 {
    let straight = ((eta - 1.0) / (eta + 1.0)).powi(2);
    straight + (1.0 - straight) * (1.0 - cosine.min(cos_refracted)).powi(5)
}

fn faults(a: &Arrival, d: &Departure) -> Vec<&'static str> {
    let (cosine, eta) = (f64::from(a.cosine), a.eta());
    let sine = (1.0 - cosine * cosine).sqrt();
    let cos_refracted = (1.0 - (sine / eta).powi(2)).max(0.0).sqrt();
    // The root of a rounded difference: near the critical angle, and at grazing angles.
    let tolerance = 2e-6 + 1e-6 / cos_refracted.max(1e-3);
    let once = if a.schlick {
        polynomial(cosine, cos_refracted, eta)
    } else {
        reflectance(cosine, eta)
    };
    let reflected = if a.thin {
        2.0 * once / (1.0 + once)
    } else {
        once
    };
    let is_near = |x: f64, y: f64| (x - y).abs() <= tolerance;
    let mut out = Vec::new();
    let mut expect = |holds: bool, what| {
        if !holds {
            out.push(what)
        }
    };
    expect(d.is_delta, "a delta lobe");
    let length = d.direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    expect(is_near(length, 1.0), "length of the direction");
    let [x, y, z] = d.direction;
    if z >= 0.0 && (a.u == 0.0 || reflected > 1.0 - 1e-4) {
        expect(is_near(d.pdf, reflected), "Fresnel's equations");
        expect(
            is_near(x, sine) && y == 0.0 && is_near(z, cosine),
            "law of reflection",
        );
        expect(
            d.weight == 1.0 && d.medium == 1.0,
            "weight of the reflected",
        );
        return out;
    }
    expect(z <= 0.0, "side of the refracted");
    expect(
        a.u > 0.0 || reflected == 0.0 || d.pdf > 1.0 - tolerance,
        "choice by u",
    );
    expect(is_near(d.pdf, 1.0 - reflected), "Fresnel's equations");
    if a.thin {
        expect(
            is_near(x, sine) && is_near(z, -cosine),
            "straight through a thin wall",
        );
        expect(
            d.weight == TINT && d.medium == 1.0,
            "weight behind a thin wall",
        );
        return out;
    }
    expect(
        is_near(x * eta, sine) && y == 0.0 && is_near(z, -cos_refracted),
        "Snell's law",
    );
    let relative = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-6;
    expect(
        relative(d.weight, TINT / (eta * eta)),
        "radiance in the other medium",
    );
    expect(relative(d.medium, eta * eta), "density of the other medium");
    out
}

/// Every kind of fault in these kernels, once.
fn all_faults(library: KernelLibrary) -> Vec<&'static str> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images/dielectric/kernels");
    let gpu = open(library.with_folder(&folder).expect("kernels"));
    let arrivals = arrivals();
    let departures = scatter(&gpu, &arrivals);
    let mut out = Vec::new();
    for (arrival, departure) in arrivals.iter().zip(&departures) {
        for fault in faults(arrival, departure) {
            if !out.contains(&fault) {
                println!("{fault}: {arrival:?} {departure:?}");
                out.push(fault);
            }
        }
    }
    out
}

#[test]
fn light_is_reflected_and_refracted_as_fresnel_and_snell_say() {
    assert_eq!(all_faults(KernelLibrary::default()), [""; 0]);
}

#[test]
fn planted_faults_are_seen() {
    let (file, fresnel) = ("shading/bsdf/dielectric", "shading/bsdf/fresnel");
    for (file, from, to, expected) in [
        (
            file,
            "surface.side > 0.0",
            "surface.side < 0.0",
            "Snell's law",
        ),
        (
            file,
            "tint / (eta * eta)",
            "tint",
            "radiance in the other medium",
        ),
        (
            file,
            "eta * eta);\n}\n",
            "1.0);\n}\n",
            "density of the other medium",
        ),
        (
            fresnel,
            "        return 1.0;\n",
            "        return 0.0;\n",
            "law of reflection",
        ),
        (
            fresnel,
            "cos_arriving - eta * cos_refracted",
            "cos_arriving - cos_refracted",
            "Fresnel's equations",
        ),
        (
            fresnel,
            "select(cos_refracted, cos_arriving, eta >= 1.0)",
            "cos_arriving",
            "Fresnel's equations",
        ),
        (
            file,
            "2.0 * reflectance / (1.0 + reflectance)",
            "reflectance",
            "Fresnel's equations",
        ),
        (
            file,
            "arriving / eta + along",
            "arriving * eta + along",
            "Snell's law",
        ),
        (
            file,
            "surface.arriving + 2.0 * cos",
            "surface.arriving - 2.0 * cos",
            "length of the direction",
        ),
    ] {
        let found = all_faults(kernels_with(file, &[(from, to)]));
        assert!(found.contains(&expected), "`{to}` for `{from}`: {found:?}");
    }
}

#[test]
fn the_reference_has_the_values_of_the_textbook() {
    for n in [1.33, 1.5, 2.4] {
        let straight = ((n - 1.0) / (n + 1.0_f64)).powi(2);
        let near = |found: f64, expected: f64| (found - expected).abs() < 1e-6;
        assert!(near(reflectance(1.0, n), straight) && near(reflectance(1.0, 1.0 / n), straight));
        // At Brewster's angle, tan θ = n, one polarisation is not reflected.
        let brewster = n.atan().cos();
        let other = ((1.0 - n * n) / (1.0 + n * n)).powi(2);
        assert!(near(reflectance(brewster, n), 0.5 * other), "{n}");
        // From inside nothing leaves beyond the critical angle, sin θ = 1 / n.
        let critical = (1.0 - 1.0 / (n * n)).sqrt();
        assert_eq!(reflectance(critical - 1e-6, 1.0 / n), 1.0);
        assert!(reflectance(critical + 1e-6, 1.0 / n) < 1.0);
        assert!(near(reflectance(0.0, n), 1.0));
    }
}

#[test]
fn the_critical_angle_and_brewsters_are_where_they_should_be() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images/dielectric/kernels");
    let gpu = open(
        KernelLibrary::default()
            .with_folder(&folder)
            .expect("kernels"),
    );
    let n = 1.5_f64;
    let critical = (1.0 - 1.0 / (n * n)).sqrt();
    let brewster = n.atan().cos();
    let arrival = |cosine: f64, outside| Arrival {
        cosine: cosine as f32,
        u: 1.0 - f32::EPSILON,
        outside,
        ior: n as f32,
        thin: false,
        schlick: false,
    };
    let asked = [
        arrival(critical - 1e-5, false),
        arrival(critical + 1e-5, false),
        arrival(brewster, true),
    ];
    let [beyond, within, polarised] = &scatter(&gpu, &asked)[..] else {
        panic!("three departures");
    };
    assert!(beyond.direction[2] > 0.0 && beyond.pdf == 1.0, "{beyond:?}");
    assert!(within.direction[2] < 0.0 && within.pdf < 1.0, "{within:?}");
    let expected = 1.0 - 0.5 * ((1.0 - n * n) / (1.0 + n * n)).powi(2);
    assert!((polarised.pdf - expected).abs() < 1e-6, "{polarised:?}");
}

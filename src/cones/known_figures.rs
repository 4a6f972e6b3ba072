//! Known errors, budgets and scenes, computed anew before any figure of cones is shown.

use crate::cone::{Camera, Mirror};
use crate::measure::{covering, layers_of};
use crate::rays::{Lens, Rays};
use crate::sample::{Crossing, DIMENSIONS, MOST, Truth, budget, crossing, sampled};
use crate::scene::{Place, patches};
use crate::trace::Found;
use glam::DVec3;
use raystone_core::params::Variant;
use raystone_sampling::{Coordinate, Demand, SamplerRegistry, to_unit};
use raystone_specular::real::V3;

/// Computes them.
///
/// # Errors
/// One is not what it should be: what of which, and both values.
pub fn check() -> Result<(), String> {
    // Errors 1, 1/2, 1/4, … fall to 1/8 with eight samples, and to √(1/2 · 1/4) half way between two and four.
    let errors: Vec<f64> = (0..9).map(|k| 0.5_f64.powi(k)).collect();
    for (floor, samples) in [(0.125, 8.0), (0.125_f64.sqrt(), 2.0_f64.powf(1.5))] {
        let found = crossing(&errors, floor);
        let agrees = matches!(found, Crossing::At(at) if (at / samples - 1.0).abs() < 1e-9);
        agree(
            agrees,
            "samples to an error",
            &format!("{found:?}"),
            samples,
        )?;
    }
    // By a weight of 1, 2 and 5 the sixteenfold of three pixels.
    let spent = budget(&[1.0, 2.0, 5.0], 16);
    agree(
        spent == [6, 12, 30],
        "budget of samples",
        &format!("{spent:?}"),
        48.0,
    )?;
    let bounded = budget(&[1.0, 1e9], 200);
    agree(
        bounded[1] == MOST,
        "greatest budget",
        &format!("{bounded:?}"),
        f64::from(MOST),
    )?;
    // Cones of 1 to 200 layers, of which every other is covered, and the rest by a quarter.
    let cones = (1..=200).map(|k| (201 - k, if k % 2 == 0 { 1.0 } else { 0.25 }));
    let found = covering(cones.collect());
    for (what, found, expected) in [
        ("mean number of layers", found.mean, 100.5),
        ("number of layers of 99 %", found.of_99, 198.0),
        ("open part", found.open, 0.375),
    ] {
        let agrees = (found - expected).abs() < 1e-9;
        agree(agrees, what, &found.to_string(), expected)?;
    }
    let pixel = Found {
        colour: V3::new(0.0, 0.0, 0.0),
        covered: 0.5,
        counts: [7, 5, 9],
    };
    let found = layers_of(&pixel);
    let agrees = found == (7, 0.5);
    agree(agrees, "number of layers met", &format!("{found:?}"), 7.0)?;
    let rays = Rays::new(&patches(Place::Checker));
    let lens = lens(&rays);
    means_of_samples(&lens)?;
    halves(&lens)
}

/// A mirror before the eye, of 2 × 2 pixels.
fn lens(rays: &Rays) -> Lens<'_> {
    let eye = DVec3::new(4.0, 0.0, 0.3);
    let forward = -eye.normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let camera = Camera {
        eye: V3::of(eye),
        right: V3::of(right),
        up: V3::of(right.cross(forward)),
        forward: V3::of(forward),
        distance: 3.0,
        stride: 1.0,
        side: 2,
        mirror: Mirror::Sphere.word(),
        gloss: 0.1,
        is_mean: false,
    };
    Lens::new(camera, rays)
}

/// The mean of 2ᵏ rays, each drawn anew; and the same where a pixel's own budget is as many.
fn means_of_samples(lens: &Lens) -> Result<(), String> {
    let variant = |name: &str| Variant {
        name: name.to_owned(),
        ..Variant::default()
    };
    let demand = Demand {
        samples: Some(MOST),
        dimensions: DIMENSIONS,
        width: Some(2),
    };
    let registry = SamplerRegistry::default();
    let sampler = registry.sampler(&variant("pixel-hash"), &variant("none"), &demand);
    let sampler = sampler.map_err(|e| e.to_string())?;
    let budget = [1, 2, 8, MOST];
    let found = sampled(lens, std::slice::from_ref(&sampler), 4, 3, Some(&budget));
    for (pixel, count) in (0_u32..).zip(budget) {
        let rays = (0..count).map(|sample| {
            let number = |dimension| {
                to_unit(sampler.sample_u32(Coordinate {
                    pixel,
                    sample,
                    dimension,
                    seed: 3,
                }))
            };
            lens.sample(pixel, [0, 1, 2, 3].map(|d| number(d).into()))
        });
        let mean = rays.sum::<DVec3>() / f64::from(count);
        let even = found.powers[count.ilog2() as usize][pixel as usize];
        let own = found.adaptive.as_ref().map(|all| all[pixel as usize]);
        let is_mean = |x: DVec3| x.distance(mean) < 1e-9;
        let agrees = is_mean(even) && own.is_some_and(is_mean);
        let of = format!("{even} and {own:?} where {mean} is right");
        agree(agrees, "mean of samples", &of, f64::from(count))?;
    }
    Ok(())
}

/// Both halves of a reference see the same scene by other rays: their difference is noise, neither nothing nor all.
fn halves(lens: &Lens) -> Result<(), String> {
    let truth = Truth::new(lens, 4, 32, 1);
    let (noise, mean) = (truth.noise(), truth.mean());
    let is_noise = noise > 1e-9 && noise < 0.05;
    agree(is_noise, "noise of a reference", &noise.to_string(), 0.001)?;
    // Against its own mean a half is off by its noise, with the other sign.
    let own = truth.error(&mean);
    let agrees = (own / noise + 0.5).abs() < 1e-6;
    agree(
        agrees,
        "error of a reference's own mean",
        &own.to_string(),
        -0.5 * noise,
    )
}

fn agree(agrees: bool, what: &str, found: &str, expected: f64) -> Result<(), String> {
    agrees.then_some(()).ok_or_else(|| {
        format!(
            "the {what} is {found}, and should be about {expected}: this program shows wrong figures of cones; build it \
             anew, and report what stays wrong"
        )
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(super::check(), Ok(()));
    }
}

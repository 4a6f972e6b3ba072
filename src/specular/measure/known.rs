//! Readings of a search whose every number is another, and the jumps of known points.

use super::{FIGURES, Ready};
use crate::judge::{Summary, jumps};
use crate::newton::Solved;
use crate::path::{Form, Setup};
use crate::real::V3;
use crate::reflector::Shape;
use crate::scene::{Mirror, Vertex, setup};
use glam::DVec3;
use raystone_bench::run::Prepared as _;
use raystone_bench::timing::Samples;
use std::cell::Cell;

/// In the order of the figures. Half of the jumps exceed a pixel, and two of ten points that are apart, of which nine are at most
/// eight pixels; 2 ms are 500 ns for each of 4000 vertices.
const READINGS: [f64; 16] = [
    5.5, 4.5, 6.5, 12.0, 40.0, 0.03, 0.04, 1.75, 0.05, 0.02, 0.9, 7.0, 0.5, 8.0, 0.2, 500.0,
];

/// Makes them.
///
/// # Errors
/// A figure is not what it should be: which, and both values.
pub(crate) fn check() -> Result<(), String> {
    let wrong = |what: &str, found: String, expected: String| {
        format!(
            "the {what} of known searches is {found}, and should be {expected}: this program shows wrong figures; build it anew, \
             and report what stays wrong"
        )
    };
    let samples = Samples {
        ms: vec![2.0; 3],
        ..Samples::default()
    };
    let found = ready().readings(vec![samples])?;
    let expected: Vec<(&str, f64)> = FIGURES.iter().map(|f| &*f.id).zip(READINGS).collect();
    let found: Vec<(&str, f64)> = (found.iter())
        .map(|reading| (&*reading.figure, reading.value.value))
        .collect();
    if found != expected {
        return Err(wrong(
            "readings",
            format!("{found:?}"),
            format!("{expected:?}"),
        ));
    }
    let jump = jump();
    let is_right = (jump - 4.0).abs() < 1e-6;
    is_right
        .then_some(())
        .ok_or_else(|| wrong("greatest jump", jump.to_string(), "4".to_owned()))
}

fn ready() -> Ready {
    Ready {
        summary: Summary {
            iterations: 5.5,
            middle: Some(4.5),
            silhouette: Some(6.5),
            high: 12.0,
            most: 40.0,
            wrong: 0.03,
            other: 0.04,
            error: 1.75,
            capped: 0.05,
            singular: 0.02,
            points: 0.9,
        },
        jumps: vec![0.25, 7.0, 1.0, 1.5],
        apart: Some(vec![8.0, 0.5, 9.0, 0.5, 0.5, 2.0e-3, 0.5, 1.0, 0.5, 0.5]),
        several: true,
        map: Vec::new(),
        solver: None,
        count: 4000,
    }
}

/// Of a search that finds the true point of a sphere, then one three pixels to the right, then one four pixels above that.
fn jump() -> f64 {
    let mirror = Mirror {
        shape: Shape::Sphere,
        amplitude: 0.0,
        frequency: 1.0,
    };
    let oracle = mirror.oracle();
    let seen: Setup<f64> = setup(&mirror, Form::Transposed, 0.0);
    let v = DVec3::new(2.0, 1.0, 0.5);
    let vertex = Vertex {
        v,
        points: oracle.points(seen.eye.f64(), v),
    };
    let picture = Cell::new(0);
    let search = |own: &Setup<f64>, v: V3<f64>| {
        picture.set(picture.get() + 1);
        let [right, up] = match picture.get() {
            ..20 => [0.0, 0.0],
            20..40 => [3.0, 0.0],
            _ => [3.0, 4.0],
        };
        let eye = own.eye.f64();
        let points = oracle.points(eye, v.f64());
        let p = points.first().map_or(DVec3::NAN, |point| point.p);
        let pixel = (p - eye).dot(own.forward.f64()) / own.pixels;
        let aside = own.right.f64() * right + own.up.f64() * up;
        Solved {
            p: V3::of(p + aside * pixel),
            size: 0.0,
            iterations: 1,
            status: 0,
            points: 1,
        }
    };
    jumps(&mirror, &oracle, &vertex, search, Form::Transposed)
}

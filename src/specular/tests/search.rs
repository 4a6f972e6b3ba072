//! The search against the oracle and against differences.

use super::oracle::{EYE, VECTORS, mirrors};
use crate::newton::{Search, by_differences, exact};
use crate::path::{Form, length_of, sample_at};
use crate::real::V3;
use crate::reflector::is_on;
use crate::scene::{pixel, setup, vertices};
use glam::DVec3;

pub(super) fn newton() -> Search<f64> {
    Search {
        is_newton: true,
        is_exact: false,
        stop: 0,
        merit: 0,
        is_given: false,
        starts: 1,
        most: 60,
        singular: 1e-12,
        difference: 1e-6,
    }
}

#[test]
fn the_gradient_is_that_of_the_length() {
    // Form T is the gradient for displacements across u, as r(u) moves with them.
    for mirror in mirrors() {
        let setup = setup::<f64>(&mirror, Form::Transposed, 0.0);
        let mut seen = 0;
        for vertex in vertices(&mirror, &mirror.oracle(), 0.0, 40, 11).unwrap() {
            let v = V3::of(vertex.v);
            let p = vertex.points[0].p;
            let away = (p.normalize() + DVec3::new(0.0, 0.05, -0.08)).normalize();
            let here = sample_at(setup, v, V3::of(away));
            // Beyond the part of the torus there is no radial map.
            if !is_on(setup.reflector, here.p) {
                continue;
            }
            seen += 1;
            let [x, y] = crate::newton::basis_of(here.u).map(V3::f64);
            let h = 1e-5;
            for axis in [x, y] {
                let at = |step: f64| {
                    let u = (away + axis * step).normalize();
                    length_of(setup, v, sample_at(setup, v, V3::of(u)).p)
                };
                let difference = (at(h) - at(-h)) / (2.0 * h);
                let r = here.p.f64().length();
                let told = here.g.f64().dot(axis) * r;
                assert!(
                    (difference - told).abs() < 1e-6 * r.max(1.0),
                    "{mirror:?}: {difference} {told}"
                );
            }
        }
        assert!(seen >= 20, "{mirror:?}: {seen}");
    }
}

#[test]
fn the_hessian_is_that_of_differences_at_points_of_reflection() {
    // Away from such points the two differ, as their offsets are across other vectors.
    for mirror in mirrors() {
        let setup = setup::<f64>(&mirror, Form::Intrinsic, 0.0);
        for vertex in vertices(&mirror, &mirror.oracle(), 0.0, 40, 13).unwrap() {
            let v = V3::of(vertex.v);
            let here = sample_at(setup, v, V3::of(vertex.points[0].p.normalize()));
            let told = exact(setup, v, here);
            let (x, y) = (told.x.f64(), told.y.f64());
            let r = here.p.f64().length();
            let at = |offset: DVec3| {
                let p = here.p.f64() + offset * r;
                sample_at(setup, v, V3::of(p.normalize())).g.f64()
            };
            let h = 1e-5;
            let along = |axis: DVec3| (at(axis * h) - at(axis * -h)) / (2.0 * h);
            let (right, up) = (along(x), along(y));
            let difference = [right.dot(x), right.dot(y), up.dot(y)];
            for (a, b) in difference.into_iter().zip(told.h) {
                assert!(
                    (a - b).abs() < 1e-4 * (1.0 + b.abs()),
                    "{mirror:?}: {difference:?} {:?}",
                    told.h
                );
            }
            let _ = by_differences(setup, newton(), v, here);
        }
    }
}

#[test]
fn vectors_of_the_digest_are_found() {
    let mirror = mirrors()[1];
    let setup = setup::<f64>(&mirror, Form::Transposed, 0.0);
    for ([x, y], degrees, _) in VECTORS {
        let v = V3::new(x, y, 0.0);
        let mut search = newton();
        for (is_newton, is_exact) in [(true, false), (true, true), (false, false)] {
            search.is_newton = is_newton;
            search.is_exact = is_exact;
            search.stop = 2;
            let found = crate::solve::reflect_vertex(setup, search, v, &[]);
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let at = [found.p.f64(), DVec3::new(cosine, sine, 0.0)].map(|p| pixel(&setup, p));
            let off = (at[0][0] - at[1][0]).hypot(at[0][1] - at[1][1]);
            // Newton's method ends with a step of a tenth of a pixel, and its error is that squared.
            let most = if is_newton { 0.001 } else { 0.5 };
            assert!(off < most, "{is_newton} {off} {degrees} {found:?}");
        }
    }
    assert_eq!(setup.eye.f64(), EYE);
}

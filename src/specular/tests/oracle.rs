//! The oracle against vectors of the digest, Alhazen's polynomial and the law of reflection.

use crate::oracle::Oracle;
use crate::path::Form;
use crate::reflector::Shape;
use crate::scene::{Mirror, setup, vertices};
use glam::{DVec2, DVec3};

/// Vertex, angle of the point in degrees, length of the path: appendix A of the digest.
pub(super) const VECTORS: [([f64; 2], f64, f64); 5] = [
    ([0.0, 4.0], 45.0, 6.735917),
    ([0.0, 2.0], 51.926920, 4.834263),
    ([0.0, 1.05], 73.849681, 4.135983),
    ([-2.0, 2.5], 66.163463, 6.590144),
    ([1.5, 1.5], 26.146587, 4.352071),
];

pub(super) const EYE: DVec3 = DVec3::new(4.0, 0.0, 0.0);

#[test]
fn the_sphere_has_the_points_of_the_digest() {
    let oracle = Oracle::new(Shape::Sphere, 0.0, 0.0);
    for ([x, y], degrees, length) in VECTORS {
        let points = oracle.points(EYE, DVec3::new(x, y, 0.0));
        assert_eq!(points.len(), 1, "{points:?}");
        let angle = points[0].p.y.atan2(points[0].p.x).to_degrees();
        assert!((angle - degrees).abs() < 1e-6, "{angle}, not {degrees}");
        assert!((points[0].length - length).abs() < 1e-6);
    }
}

pub(super) fn mirrors() -> Vec<Mirror> {
    let of = |shape| Mirror {
        shape,
        amplitude: if shape == Shape::Bumpy { 0.05 } else { 0.0 },
        frequency: 4.0,
    };
    Shape::ALL.map(of).to_vec()
}

fn times(a: DVec2, b: DVec2) -> DVec2 {
    DVec2::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x)
}

fn conjugate(a: DVec2) -> DVec2 {
    DVec2::new(a.x, -a.y)
}

#[test]
fn points_of_spheres_are_roots_of_alhazens_polynomial() {
    for shape in [Shape::Sphere, Shape::Concave] {
        let mirror = Mirror {
            shape,
            amplitude: 0.0,
            frequency: 4.0,
        };
        let all = vertices(&mirror, &mirror.oracle(), 0.0, 200, 3).unwrap();
        for vertex in &all {
            for point in &vertex.points {
                let second = (vertex.v - DVec3::X * vertex.v.x).normalize();
                let flat = |p: DVec3| DVec2::new(p.x, p.dot(second));
                let (a, b, z) = (flat(EYE), flat(vertex.v), flat(point.p));
                let z2 = times(z, z);
                // ā b̄ z⁴ − (ā + b̄) z³ + (a + b) z − a b
                let value = times(times(conjugate(a), conjugate(b)), times(z2, z2))
                    - times(conjugate(a + b), times(z2, z))
                    + times(a + b, z)
                    - times(a, b);
                assert!(value.length() < 1e-9, "{shape:?}: {value}");
            }
        }
    }
}

#[test]
fn light_turns_by_the_law_of_reflection_at_all_points() {
    for mirror in mirrors() {
        let all = vertices(&mirror, &mirror.oracle(), 0.0, 200, 5).unwrap();
        let seen = setup::<f64>(&mirror, Form::Transposed, 0.0);
        for vertex in &all {
            for point in &vertex.points {
                // Both directions make the same angle with the normal.
                assert!(
                    (point.to_eye - point.to_vertex).abs() < 1e-8,
                    "{mirror:?} {point:?}"
                );
            }
        }
        assert!(seen.eye.f64() == EYE);
    }
}

#[test]
fn a_dense_grid_finds_no_shorter_path_than_the_oracle() {
    // Least lengths over 400,000 directions, by the radial map alone.
    for mirror in mirrors() {
        if matches!(mirror.shape, Shape::Concave | Shape::Torus | Shape::Plane) {
            continue;
        }
        let all = vertices(&mirror, &mirror.oracle(), 0.0, 12, 7).unwrap();
        for vertex in &all {
            let least = grid_least(&mirror, vertex.v);
            let found = vertex.points[0].length;
            assert!(
                found <= least + 1e-12 && least - found < 1e-3,
                "{mirror:?} {found} {least}"
            );
        }
    }
}

fn grid_least(mirror: &Mirror, v: DVec3) -> f64 {
    let count = 400_000;
    let lengths = (0..count).map(|k| {
        let z = 1.0 - 2.0 * (k as f64 + 0.5) / f64::from(count);
        let (sine, cosine) = (2.399_963_229_728_653 * f64::from(k)).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let u = DVec3::new(r * cosine, r * sine, z);
        let radius = match mirror.shape {
            Shape::Ellipsoid => (u * u).dot(DVec3::new(4.0, 1.0, 16.0)).sqrt().recip(),
            Shape::Bumpy => {
                let f = mirror.frequency;
                1.0 + mirror.amplitude
                    * (f * u.x + 0.4).cos()
                    * (f * u.y - 0.3).cos()
                    * (f * u.z).cos()
            }
            _ => 1.0,
        };
        let p = u * radius;
        p.distance(EYE) + p.distance(v)
    });
    lengths.fold(f64::INFINITY, f64::min)
}

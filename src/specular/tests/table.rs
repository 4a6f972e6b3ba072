//! The table of the digest (§2.10) at 3,000 vertices: f64, the eye at distance 4.

use super::search::newton;
use super::tier::in_turn;
use crate::judge::{Summary, judged, summary};
use crate::newton::Search;
use crate::path::Form;
use crate::real::V3;
use crate::reflector::Shape;
use crate::scene::{Mirror, Vertex, setup, vertices};
use crate::secant::{BY_AREA, BY_EDGE, BY_EDGE_AND_GRADIENT};
use crate::solve::reflect_vertex;

fn bumpy(amplitude: f64, frequency: f64) -> Mirror {
    Mirror {
        shape: Shape::Bumpy,
        amplitude,
        frequency,
    }
}

fn sphere() -> World {
    World::new(Mirror {
        shape: Shape::Sphere,
        amplitude: 0.0,
        frequency: 1.0,
    })
}

/// A reflector with its vertices.
struct World(Mirror, Vec<Vertex>);

impl World {
    fn new(mirror: Mirror) -> Self {
        let all = vertices(&mirror, &mirror.oracle(), 0.0, 3000, 1).unwrap();
        Self(mirror, all)
    }
}

fn told(World(mirror, all): &World, form: Form, search: Search<f64>) -> Summary {
    let setup = setup(mirror, form, 0.0);
    let each = all.iter().filter_map(|vertex| {
        let found = reflect_vertex(setup, search, V3::of(vertex.v), &[]);
        judged(&setup, vertex, &found)
    });
    let told = summary(&each.collect::<Vec<_>>());
    println!(
        "{mirror:?} {form:?} {} {}\n    {told:?}",
        search.is_newton, search.stop
    );
    told
}

fn secants(stop: u32) -> Search<f64> {
    Search {
        is_newton: false,
        stop,
        ..newton()
    }
}

fn is_near(found: f64, told: f64, part: f64, least: f64) {
    let off = (found - told).abs();
    assert!(
        off <= (told * part).max(least),
        "{found}, where the digest has {told}"
    );
}

#[test]
fn the_sphere_has_the_figures_of_the_digest() {
    let sphere = sphere();
    // Stop, mean, 99 %, middle, silhouette, error of 90 %, share beyond a pixel.
    let rows = [
        (BY_AREA, 6.0, 14.0, 4.0, 8.7, 8.4, 0.247),
        (BY_EDGE, 7.8, 17.0, 5.7, 10.5, 0.056, 0.039),
        (BY_EDGE_AND_GRADIENT, 8.0, 18.0, 5.9, 10.8, 0.008, 0.003),
    ];
    for (stop, mean, high, middle, silhouette, error, wrong) in rows {
        let found = told(&sphere, Form::Transposed, secants(stop));
        is_near(found.iterations, mean, 0.06, 0.0);
        is_near(found.high, high, 0.15, 0.0);
        is_near(found.middle.unwrap(), middle, 0.08, 0.0);
        is_near(found.silhouette.unwrap(), silhouette, 0.08, 0.0);
        is_near(found.error, error, 0.35, 0.0);
        is_near(found.other, wrong, 0.1, 0.012);
        assert!(found.capped < 0.006, "{found:?}");
    }
    let found = told(&sphere, Form::Transposed, newton());
    is_near(found.iterations, 2.5, 0.05, 0.0);
    assert!(found.error < 1e-3 && found.wrong < 1e-9 && found.most <= 8.0);
}

/// Amplitude and frequency; stop, mean and share beyond a pixel; the last two of Newton's method.
type Rows = ((f64, f64), &'static [(u32, f64, f64)], (f64, f64));

#[test]
fn bumps_have_the_figures_of_the_digest() {
    let reflectors: [Rows; 3] = [
        (
            (0.05, 4.0),
            &[(BY_AREA, 6.7, 0.261), (BY_EDGE_AND_GRADIENT, 8.8, 0.013)],
            (3.2, 0.0),
        ),
        (
            (0.02, 10.0),
            &[(BY_AREA, 13.1, 0.466), (BY_EDGE_AND_GRADIENT, 20.9, 0.220)],
            (4.1, 0.011),
        ),
        ((0.05, 10.0), &[(BY_AREA, 20.9, 0.743)], (4.7, 0.123)),
    ];
    for ((amplitude, frequency), rows, (mean, wrong)) in
        in_turn("reflectors with bumps", reflectors)
    {
        let world = World::new(bumpy(amplitude, frequency));
        for (stop, mean, wrong) in rows {
            let found = told(&world, Form::Transposed, secants(*stop));
            is_near(found.iterations, *mean, 0.12, 0.0);
            is_near(found.other, *wrong, 0.15, 0.015);
        }
        let found = told(&world, Form::Transposed, newton());
        is_near(found.iterations, mean, 0.1, 0.0);
        is_near(found.other, wrong, 0.3, 0.01);
    }
}

#[test]
fn the_printed_gradient_is_wrong_where_its_normal_is() {
    let bumps = World::new(bumpy(0.05, 4.0));
    let printed = told(&bumps, Form::SignMended, secants(BY_AREA));
    let transposed = told(&bumps, Form::Transposed, secants(BY_AREA));
    // The digest has 98.5 % and 26 %.
    assert!(printed.other > 0.95 && transposed.other < 0.35);
    let sphere = sphere();
    let mended = told(&sphere, Form::SignMended, secants(BY_AREA));
    assert!(mended.other < 0.3);
    assert!(told(&sphere, Form::AsPrinted, secants(BY_AREA)).other > 0.9);
}

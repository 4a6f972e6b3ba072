//! The search as the digest's pseudo-code has it (§2.7 to §2.10), written again on the unit sphere: which samples go and
//! come back, when it ends and what it returns.

use super::oracle::{EYE, mirrors};
use super::search::newton;
use crate::newton::{CAPPED, CONVERGED, SINGULAR, Search};
use crate::path::Form;
use crate::real::V3;
use crate::scene::{setup, vertices};
use crate::secant::BY_EDGE_AND_GRADIENT;
use crate::solve::reflect_vertex;
use glam::{DVec2, DVec3};

/// A point of the unit sphere and the gradient there.
type Pair = (DVec3, DVec3);

fn pair(v: DVec3, direction: DVec3) -> Pair {
    let p = direction.normalize();
    let e = (p - EYE).normalize() + (p - v).normalize();
    (p, e - p * e.dot(p))
}

fn pixel(p: DVec3) -> DVec2 {
    DVec2::new(p.y, p.z) * (256.0 / (std::f64::consts::PI / 8.0).tan() / (EYE.x - p.x))
}

fn is_converged(s: &[Pair]) -> bool {
    let at: Vec<DVec2> = s.iter().map(|pair| pixel(pair.0)).collect();
    let edges = [(0, 1), (1, 2), (2, 0)];
    let is_short = edges.iter().all(|(a, b)| at[*a].distance(at[*b]) < 1.0);
    is_short && s.iter().any(|pair| pair.1.length() < 1e-3)
}

/// Place of the greatest gradient but for one.
fn greatest(s: &[Pair], but: Option<usize>) -> usize {
    let all = (0..3).filter(|k| Some(*k) != but);
    all.max_by(|a, b| s[*a].1.length().total_cmp(&s[*b].1.length()))
        .unwrap()
}

/// The point, the number of turns of the loop, and how it ended.
fn search(v: DVec3, least: f64) -> (DVec3, u32, u32) {
    let (a, b) = (v.normalize(), EYE.normalize());
    let beside = (b - a).cross(a + b).normalize();
    let third = 0.5 * (a + b) + 0.75_f64.sqrt() * (b - a).length() * beside;
    let mut s = [pair(v, a), pair(v, b), pair(v, third)];
    let mut last_in = None;
    let mut last_out: Option<Pair> = None;
    let mut ended = (60, CAPPED);
    for turn in 1..=60 {
        let (a, b, c) = (s[0].1 - s[2].1, s[1].1 - s[2].1, s[2].1);
        let determinant = a.length_squared() * b.length_squared() - a.dot(b).powi(2);
        if determinant <= least * a.length_squared() * b.length_squared() {
            let Some(back) = last_out.take() else {
                ended = (turn, SINGULAR);
                break;
            };
            let k = greatest(&s, last_in);
            s[k] = back;
            last_in = Some(k);
            continue;
        }
        let alpha = (a.dot(b) * b.dot(c) - b.length_squared() * a.dot(c)) / determinant;
        let beta = (a.dot(b) * a.dot(c) - a.length_squared() * b.dot(c)) / determinant;
        let place = s[0].0 * alpha + s[1].0 * beta + s[2].0 * (1.0 - alpha - beta);
        let k = greatest(&s, None);
        last_out = Some(s[k]);
        s[k] = pair(v, place);
        last_in = Some(k);
        if is_converged(&s) {
            ended = (turn, CONVERGED);
            break;
        }
    }
    let least = (0..3).min_by(|a, b| s[*a].1.length().total_cmp(&s[*b].1.length()));
    (s[least.unwrap()].0, ended.0, ended.1)
}

#[test]
fn samples_go_and_come_back_as_in_the_pseudo_code() {
    let sphere = mirrors()[1];
    let all = vertices(&sphere, &sphere.oracle(), 0.0, 800, 21).unwrap();
    let setup = setup::<f64>(&sphere, Form::Transposed, 0.0);
    let mut singular = 0;
    // Coarse thresholds, so that systems are singular often.
    for least in [1e-2, 1e-3, 1e-12] {
        let own = Search {
            is_newton: false,
            stop: BY_EDGE_AND_GRADIENT,
            singular: least,
            ..newton()
        };
        let mut differing = 0;
        for vertex in &all {
            let found = reflect_vertex(setup, own, V3::of(vertex.v), &[]);
            let (p, turns, status) = search(vertex.v, least);
            singular += usize::from(status == SINGULAR);
            let is_same = p.distance(found.p.f64()) < 1e-6
                && (turns, status) == (found.iterations, found.status);
            differing += usize::from(!is_same);
        }
        // Rounding turns a few comparisons, as far as searches wander.
        assert!(differing <= 3, "{least}: {differing}");
    }
    assert!(singular > 100, "{singular}");
}

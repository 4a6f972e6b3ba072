//! The overlap of a triangle and the unit disk by quadrature: an oracle of [`disk`](crate::disk) that shares no code with it.
//!
//! Lines of constant y cut both shapes in intervals. With y = sin φ the integrand has no root at the poles, and it is
//! smooth between the heights of vertices and of crossings of edges with the circle.

use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, PI};

/// Nodes and weights of Gauss and Legendre's rule of 20 points on [0, 1] are computed by Newton's method.
const POINTS: usize = 20;

/// Nodes and weights on [0, 1].
fn rule() -> &'static [(f64, f64); POINTS] {
    static RULE: std::sync::OnceLock<[(f64, f64); POINTS]> = std::sync::OnceLock::new();
    RULE.get_or_init(|| {
        let mut rule = [(0.0, 0.0); POINTS];
        for (k, entry) in rule.iter_mut().enumerate() {
            let mut x = (PI * (k as f64 + 0.75) / (POINTS as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut before, mut now) = (1.0, x);
                for n in 2..=POINTS {
                    let n = n as f64;
                    (before, now) = (now, ((2.0 * n - 1.0) * x * now - (n - 1.0) * before) / n);
                }
                slope = POINTS as f64 * (x * now - before) / (x * x - 1.0);
                let step = now / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            *entry = (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope));
        }
        rule
    })
}

/// The interval of x that a convex polygon has at a height; `None` beside it.
fn row(polygon: &[DVec2], y: f64) -> Option<(f64, f64)> {
    let mut interval: Option<(f64, f64)> = None;
    for (k, p) in polygon.iter().enumerate() {
        let q = polygon[(k + 1) % polygon.len()];
        if (p.y <= y) == (q.y <= y) {
            continue;
        }
        let x = p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y));
        let (low, high) = interval.unwrap_or((x, x));
        interval = Some((low.min(x), high.max(x)));
    }
    interval
}

/// Heights at which the integrand has a kink, as angles of their sines, in order.
fn kinks(polygon: &[DVec2]) -> Vec<f64> {
    let mut all = vec![-FRAC_PI_2, FRAC_PI_2];
    for (k, p) in polygon.iter().enumerate() {
        let d = polygon[(k + 1) % polygon.len()] - *p;
        if p.y.abs() < 1.0 {
            all.push(p.y.asin());
        }
        let square = d.length_squared();
        if square == 0.0 {
            continue;
        }
        // The part of the edge nearest to the centre, and half of its chord.
        let foot = *p - d * (p.dot(d) / square);
        let half = (1.0 - foot.length_squared()) / square;
        if half > 0.0 {
            for sign in [-1.0, 1.0] {
                let y = (foot + d * (sign * half.sqrt())).y;
                all.push(y.clamp(-1.0, 1.0).asin());
            }
        }
    }
    all.sort_by(f64::total_cmp);
    all
}

/// Area of a convex polygon in the unit disk, and the centroid; 0 for an empty overlap.
pub fn overlap(polygon: &[DVec2]) -> (f64, DVec2) {
    let kinks = kinks(polygon);
    let mut sums = [0.0; 3];
    for pair in kinks.windows(2) {
        let width = pair[1] - pair[0];
        for (node, weight) in rule() {
            let angle = pair[0] + width * node;
            let (y, edge) = angle.sin_cos();
            let Some((low, high)) = row(polygon, y) else {
                continue;
            };
            let (low, high) = (low.max(-edge), high.min(edge));
            if low < high {
                // dy = cos φ dφ.
                let part = width * weight * edge * (high - low);
                sums[0] += part;
                sums[1] += 0.5 * part * (low + high);
                sums[2] += part * y;
            }
        }
    }
    if sums[0] <= 0.0 {
        return (0.0, DVec2::ZERO);
    }
    (sums[0], DVec2::new(sums[1], sums[2]) / sums[0])
}

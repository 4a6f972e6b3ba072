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

/// Area in which two disks overlap whose middles are this far apart, by their chords.
fn common(narrow: f64, wide: f64, apart: f64) -> f64 {
    const CHORDS: u32 = 256;
    let step = PI / f64::from(CHORDS);
    let each = (0..CHORDS).map(|k| {
        let (sine, cosine) = (-0.5 * PI + (f64::from(k) + 0.5) * step).sin_cos();
        let (own, other) = (
            narrow * cosine,
            (wide.powi(2) - (narrow * sine).powi(2)).sqrt(),
        );
        let length = own.min(apart + other) - (-own).max(apart - other);
        length.max(0.0) * narrow * cosine * step
    });
    each.sum()
}

/// What a lobe sends through disks of a cone: the means of 17 radii by 17 distances by 9 parts of the width, each over
/// points of the disk, that lie between them on lines.
pub(crate) struct LobeMeans(Vec<f64>);

impl LobeMeans {
    const LINES: u32 = 4096;

    pub(crate) fn new() -> Self {
        let mut means = Vec::new();
        for part in 0..9 {
            let narrow = f64::from(part) / 16.0;
            let wide = 1.0 - narrow;
            let along: Vec<f64> = (0..=Self::LINES)
                .map(|k| common(narrow, wide, f64::from(k) / f64::from(Self::LINES)))
                .map(|area| area / (PI * (narrow * wide).powi(2)))
                .collect();
            let density = |at: f64| {
                let place = at * f64::from(Self::LINES);
                let low = (place as usize).min(along.len() - 2);
                along[low] + (along[low + 1] - along[low]) * (place - low as f64)
            };
            for place in 0..17 {
                for size in 0..17 {
                    let (place, size) = (f64::from(place) / 16.0, f64::from(size) / 16.0);
                    means.push(if part == 0 {
                        1.0
                    } else if size == 0.0 {
                        density(place)
                    } else {
                        let sum: f64 = points(place, size).map(density).sum();
                        let area = PI * size * size / f64::from(RINGS * ANGLES);
                        sum * area / common(size, 1.0, place)
                    });
                }
            }
        }
        Self(means)
    }

    /// The mean of a disk of this share of the cone at a distance from its axis.
    pub(crate) fn of(&self, share: f64, distance: f64, narrow: f64) -> f64 {
        let places = [
            share.clamp(0.0, 1.0).sqrt() * 16.0,
            distance.clamp(0.0, 1.0) * 16.0,
            narrow.clamp(0.0, 0.5) * 16.0,
        ];
        let most = [16, 16, 8];
        (0..8_usize)
            .map(|corner| {
                let mut weight = 1.0;
                let mut node = [0; 3];
                for axis in 0..3 {
                    let low = (places[axis] as usize).min(most[axis] - 1);
                    let beyond = places[axis] - low as f64;
                    let is_upper = corner >> axis & 1 == 1;
                    weight *= if is_upper { beyond } else { 1.0 - beyond };
                    node[axis] = low + usize::from(is_upper);
                }
                weight * self.0[(node[2] * 17 + node[1]) * 17 + node[0]]
            })
            .sum()
    }
}

/// Rings of equal areas of a disk, and points of each.
const RINGS: u32 = 48;
const ANGLES: u32 = 96;

/// How far from the axis the points of a disk are that lie in the cone.
fn points(place: f64, size: f64) -> impl Iterator<Item = f64> {
    let each = (0..RINGS * ANGLES).map(move |k| {
        let radius = size * ((f64::from(k / ANGLES) + 0.5) / f64::from(RINGS)).sqrt();
        let angle = 2.0 * PI * (f64::from(k % ANGLES) + 0.5) / f64::from(ANGLES);
        (place + radius * angle.cos()).hypot(radius * angle.sin())
    });
    each.filter(|distance| *distance <= 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lens of two circles, by the angles of its arcs and the triangles between them.
    fn lens(a: f64, b: f64, apart: f64) -> f64 {
        let angle = |own: f64, other: f64| {
            ((apart * apart + own * own - other * other) / (2.0 * apart * own)).acos()
        };
        let sector = |own: f64, other: f64| {
            let angle = angle(own, other);
            own * own * (angle - 0.5 * (2.0 * angle).sin())
        };
        sector(a, b) + sector(b, a)
    }

    #[test]
    fn disks_have_a_lens_in_common() {
        for (narrow, wide, apart) in [(0.3, 1.0, 0.9), (0.5, 0.5, 0.4), (0.25, 0.75, 0.55)] {
            let (found, exact) = (common(narrow, wide, apart), lens(narrow, wide, apart));
            assert!((found - exact).abs() < 2e-4 * exact, "{found} for {exact}");
        }
        let inside = common(0.25, 0.75, 0.5);
        assert!((inside - PI / 16.0).abs() < 1e-6, "{inside}");
        assert_eq!(common(0.25, 0.5, 0.75), 0.0);
    }
}

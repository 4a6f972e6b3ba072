//! What searches found against all points of reflection that there are.

use crate::newton::{CAPPED, SINGULAR, Solved};
use crate::oracle::Oracle;
use crate::path::{Form, Setup};
use crate::real::{Real, V3};
use crate::scene::{Mirror, PICTURE, Vertex, pixel, setup};
use glam::DVec3;

/// A point that is farther from all points of reflection is wrong, in pixels (§7.4 of the digest).
const WRONG: f64 = 1.0;
/// Cosines at the point of reflection: in the middle of the reflector above the first, at its silhouette below the second.
const MIDDLE: f64 = 0.75;
const SILHOUETTE: f64 = 0.25;
/// Degrees by which the eye turns from picture to picture, and pictures.
const TURN: f64 = 0.01;
const PICTURES: u32 = 60;
/// Pixels of the map of failures along each side.
pub(crate) const MAP: u32 = 128;

/// One search, judged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Judged {
    pub(crate) iterations: u32,
    pub(crate) status: u32,
    /// Pixels to the nearest point of reflection; at most the picture's side.
    pub(crate) nearest: f64,
    /// Pixels to that of the shortest path.
    pub(crate) shortest: f64,
    /// The cosine to the eye at that.
    pub(crate) cosine: f64,
    /// Points told apart, over those that there are.
    pub(crate) share: f64,
    /// Where that is in the picture, in pixels from its middle.
    pub(crate) at: [f64; 2],
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1]).min(PICTURE)
}

/// The pixel of a point that was found; none behind the eye or where nothing was found.
fn found_pixel<T: Real>(setup: &Setup<f64>, found: &Solved<T>) -> Option<[f64; 2]> {
    let p = found.p.f64();
    let is_before = (p - setup.eye.f64()).dot(setup.forward.f64()) > 1e-3;
    is_before.then(|| pixel(setup, p))
}

pub(crate) fn judged<T: Real>(
    setup: &Setup<f64>,
    vertex: &Vertex,
    found: &Solved<T>,
) -> Option<Judged> {
    let at = found_pixel(setup, found);
    let off = |p: DVec3| at.map_or(PICTURE, |at| distance(at, pixel(setup, p)));
    let first = vertex.points.first()?;
    let nearest = vertex.points.iter().map(|point| off(point.p));
    Some(Judged {
        iterations: found.iterations,
        status: found.status,
        nearest: nearest.fold(PICTURE, f64::min),
        shortest: off(first.p),
        cosine: first.to_eye,
        share: f64::from(found.points) / vertex.points.len() as f64,
        at: pixel(setup, first.p),
    })
}

/// What is told of many searches.
#[derive(Debug, Clone, Default)]
pub(crate) struct Summary {
    pub(crate) iterations: f64,
    pub(crate) middle: Option<f64>,
    pub(crate) silhouette: Option<f64>,
    /// Iterations that 99 % do not exceed.
    pub(crate) high: f64,
    pub(crate) most: f64,
    pub(crate) wrong: f64,
    pub(crate) other: f64,
    /// The error, to the shortest path, that 90 % do not exceed, in pixels.
    pub(crate) error: f64,
    pub(crate) capped: f64,
    pub(crate) singular: f64,
    pub(crate) points: f64,
}

/// The value that a share of all does not exceed.
pub(crate) fn quantile(mut all: Vec<f64>, share: f64) -> f64 {
    all.sort_by(f64::total_cmp);
    let place = (share * all.len() as f64).ceil() as usize;
    all.get(place.saturating_sub(1)).copied().unwrap_or(0.0)
}

fn mean(all: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = all.fold((0.0, 0usize), |(sum, count), x| (sum + x, count + 1));
    (count > 0).then(|| sum / count as f64)
}

pub(crate) fn summary(all: &[Judged]) -> Summary {
    let iterations = |of: &dyn Fn(&&Judged) -> bool| {
        mean(all.iter().filter(of).map(|one| f64::from(one.iterations)))
    };
    let share = |of: &dyn Fn(&&Judged) -> bool| {
        all.iter().filter(of).count() as f64 / all.len().max(1) as f64
    };
    let counts: Vec<f64> = all.iter().map(|one| f64::from(one.iterations)).collect();
    Summary {
        iterations: iterations(&|_| true).unwrap_or(0.0),
        middle: iterations(&|one| one.cosine > MIDDLE),
        silhouette: iterations(&|one| one.cosine < SILHOUETTE),
        high: quantile(counts.clone(), 0.99),
        most: quantile(counts, 1.0),
        wrong: share(&|one| one.nearest > WRONG),
        other: share(&|one| one.shortest > WRONG),
        error: quantile(all.iter().map(|one| one.shortest).collect(), 0.9),
        capped: share(&|one| one.status == CAPPED),
        singular: share(&|one| one.status == SINGULAR),
        points: mean(all.iter().map(|one| one.share)).unwrap_or(0.0),
    }
}

/// Where searches failed, as rows of [`MAP`]² pixels: black where no vertex is, grey for iterations, red where wrong,
/// blue where no step could be made, yellow where iterations were used up.
pub(crate) fn failures(all: &[Judged]) -> Vec<[u8; 3]> {
    let mut pixels = vec![[0; 3]; (MAP * MAP) as usize];
    let mut ordered: Vec<&Judged> = all.iter().collect();
    // Failures over the others.
    ordered.sort_by_key(|one| one.nearest > WRONG);
    for one in ordered {
        let place = |x: f64| ((x / PICTURE + 0.5) * f64::from(MAP)) as u32;
        let [x, y] = [place(one.at[0]), place(-one.at[1])].map(|x| x.min(MAP - 1));
        let grey = (80 + 5 * one.iterations).min(220) as u8;
        pixels[(x + MAP * y) as usize] = match one.status {
            _ if one.nearest <= WRONG => [grey; 3],
            SINGULAR => [60, 110, 255],
            CAPPED => [255, 220, 40],
            _ => [255, 50, 40],
        };
    }
    pixels
}

/// The greatest change, from one picture to the next, of the error of a vertex's point in pixels, while the eye turns
/// about the reflector; how far the true point moves is no part of it. `search` searches from an eye.
pub(crate) fn jumps<T: Real>(
    mirror: &Mirror,
    oracle: &Oracle,
    vertex: &Vertex,
    search: impl Fn(&Setup<T>, V3<T>) -> Solved<T>,
    form: Form,
) -> f64 {
    let mut greatest = 0.0_f64;
    let Some(mut truth) = vertex.points.first().map(|point| point.p) else {
        return greatest;
    };
    let mut before: Option<[f64; 2]> = None;
    for picture in 0..PICTURES {
        let degrees = TURN * f64::from(picture);
        let exact: Setup<f64> = setup(mirror, form, degrees);
        let Some(next) = oracle.follow(exact.eye.f64(), vertex.v, truth) else {
            break;
        };
        let own: Setup<T> = setup(mirror, form, degrees);
        let found = search(&own, V3::of(vertex.v));
        let here = pixel(&exact, next);
        let error = found_pixel(&exact, &found).map(|at| [at[0] - here[0], at[1] - here[1]]);
        let error = error.map(|e| e.map(|x| x.clamp(-PICTURE, PICTURE)));
        if let (Some(a), Some(b)) = (before, error) {
            greatest = greatest.max((a[0] - b[0]).hypot(a[1] - b[1]).min(PICTURE));
        }
        before = error.or(before);
        truth = next;
    }
    greatest
}

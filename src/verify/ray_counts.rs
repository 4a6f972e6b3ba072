//! Counted rays of an image against those of the path oracle: rates are counts over times, and a
//! wrong count makes a wrong rate of right answers.

use crate::image_gate::{Answer, Pixels, answers_of, differs, floor_of, samples_of};
use crate::path_oracle::{Estimator, Path, PathOracle, PathRay, Rounding, View};
use rayon::prelude::*;
use raystone_gpu::GpuError;
use raystone_render::{CountedRays, RAY_COUNT_CLASSES, Renderer, TRACED_CLASSES};

/// Rays that may be counted otherwise though all answers agree: grazing light, a lobe of weight 0.
const FEW: u64 = 2;

/// Renders one sample of every pixel through kernels that count, and compares rays by class, and
/// paths by bounce, with those of the oracle. Paths whose answer differs, or that meet a surface
/// with another within rounding, may count otherwise. Returns what is wrong, or `None`.
///
/// # Errors
/// A kernel raised its error word, or the device is lost or hangs.
pub fn fault(
    renderer: &Renderer,
    oracle: &PathOracle,
    view: &View,
    pixels: &Pixels,
) -> Result<Option<String>, GpuError> {
    let sample = pixels.samples.first().copied().unwrap_or_default();
    let image = samples_of(renderer, pixels, sample..sample + 1)?;
    let answers: Vec<Answer> = answers_of(&image, pixels, (0, sample)).collect();
    let truth: Vec<Path> = (answers.par_iter())
        .map(|answer| oracle.trace(view, answer.id, Rounding::none()))
        .collect();
    let floor = floor_of(&truth);
    let is_unsure =
        |(answer, path): (&Answer, &Path)| path.layers > 0 || differs(answer, path, floor);
    let unsure = answers
        .iter()
        .zip(&truth)
        .filter(|&pair| is_unsure(pair))
        .count() as u64;
    let live = match view.estimator {
        Estimator::Path(_) => Some(renderer.live_paths()?),
        _ => None,
    };
    let counted = (renderer.ray_counts()?, live);
    Ok(compare(&truth, unsure, (&counted.0, counted.1.as_deref())))
}

/// Rays by class, and paths by bounce where these are counted, against those of the oracle, of
/// which so many may be unlike those of the kernel.
fn compare(truth: &[Path], unsure: u64, (rays, live): (&[u64], Option<&[u64]>)) -> Option<String> {
    let all = || truth.iter().flat_map(|path| &path.rays);
    let of = |is: &dyn Fn(&PathRay) -> bool| all().filter(|ray| is(ray)).count() as u64;
    let longest = truth.iter().map(|path| path.rays.len()).max();
    let slack = FEW + unsure * longest.unwrap_or_default() as u64;
    let other = |what: String, found: u64, expected: u64, slack: u64| {
        (found.abs_diff(expected) > slack).then(|| {
            format!(
                "{found} {what} are counted in {} paths, {expected} by the path oracle (± {slack})",
                truth.len()
            )
        })
    };
    let classes = RAY_COUNT_CLASSES
        .iter()
        .zip(rays)
        .take(TRACED_CLASSES)
        .enumerate();
    let mut faults = classes.map(|(class, (name, found))| {
        let expected = of(&|ray| ray.class as usize == class);
        let is_first = class == CountedRays::Primary as usize;
        other(
            format!("{name} rays"),
            *found,
            expected,
            if is_first { 0 } else { slack },
        )
    });
    let wrong = faults.find_map(|fault| fault);
    let Some(live) = live.filter(|_| wrong.is_none()) else {
        return wrong;
    };
    let is_next = |ray: &PathRay| matches!(ray.class, CountedRays::Primary | CountedRays::Bounce);
    let deepest = all()
        .filter(|ray| is_next(ray))
        .map(|ray| ray.depth + 1)
        .max();
    let depths = (live.len() as u32).max(deepest.unwrap_or_default());
    let mut faults = (0..depths).map(|depth| {
        let expected = of(&|ray| is_next(ray) && ray.depth == depth);
        let found = live.get(depth as usize).copied().unwrap_or_default();
        let slack = if depth == 0 { 0 } else { FEW + unsure };
        other(
            format!("paths alive after {depth} bounces"),
            found,
            expected,
            slack,
        )
    });
    faults.find_map(|fault| fault)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// Paths of a ray from the camera, one to a light, one onwards.
    fn paths() -> Vec<Path> {
        let ray = |class, depth| PathRay {
            class,
            depth,
            light: 0,
            origin: DVec3::ZERO,
            normal: DVec3::ZERO,
            direction: DVec3::Z,
            length: 1.0,
        };
        let path = Path {
            radiance: DVec3::ONE,
            vertices: Vec::new(),
            rays: vec![
                ray(CountedRays::Primary, 0),
                ray(CountedRays::Shadow, 0),
                ray(CountedRays::Bounce, 1),
            ],
            branch: Vec::new(),
            layers: 0,
            by_chance: 0,
        };
        vec![path; 100]
    }

    #[test]
    fn doubled_and_missing_counts_are_told() {
        let said = |rays: [u64; 5], live: &[u64]| {
            compare(&paths(), 1, (&rays, Some(live))).unwrap_or_default()
        };
        assert_eq!(said([100, 100, 0, 100, 7], &[100, 100]), "");
        assert_eq!(said([100, 105, 0, 97, 7], &[100, 97]), "");
        for (rays, live, part) in [
            ([200, 100, 0, 100, 0], &[100, 100][..], "200 primary rays"),
            ([101, 100, 0, 100, 0], &[100, 100], "101 primary rays"),
            ([100, 200, 0, 100, 0], &[100, 100], "200 shadow rays"),
            ([100, 100, 6, 100, 0], &[100, 100], "6 ao rays"),
            ([100, 100, 0, 0, 0], &[100, 100], "0 bounce rays"),
            ([100, 100, 0, 100, 0], &[100], "0 paths alive after 1"),
            (
                [100, 100, 0, 100, 0],
                &[100, 100, 4],
                "4 paths alive after 2",
            ),
            ([100, 100, 0, 100, 0], &[99, 100], "99 paths alive after 0"),
        ] {
            assert!(
                said(rays, live).contains(part),
                "{part}: {}",
                said(rays, live)
            );
        }
        assert_eq!(compare(&paths(), 0, (&[100, 100, 0, 100, 0], None)), None);
    }
}

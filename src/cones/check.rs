//! What the device found against the oracle in f64, and overlaps against quadrature and, to the bit, against the twin.
//!
//! Pictures are not compared to the bit: in a kernel of this size compilers choose the order of some sums, and depths
//! differ from the twin's in the last one.

use crate::disk::{Overlap, disk_triangle};
use crate::oracle::Expected;
use crate::quadrature;
use crate::trace::Found;
use glam::DVec2;
use raystone_core::random::Pcg32;
use raystone_specular::real::V3;

/// What f32 may be off in the area of the unit disk that a triangle covers, and in its first moments: what sums of
/// sectors round to, and for each of three edges a distance from the centre known to 2⁻²⁴ of the farthest vertex,
/// along a chord of at most 2.
pub fn off_area(corners: &[V3<f32>; 3]) -> f64 {
    let far = corners.iter().map(|p| f64::from(p.x).hypot(p.y.into()));
    1e-6 + 6.0 * 2.0_f64.powi(-24) * far.fold(0.0, f64::max)
}

/// A picture of which more is open, on average over its pixels, is not checked by the oracle.
const MOST_OPEN: f64 = 0.05;

/// What the device is off the oracle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Apart {
    /// Greatest difference of a component of a colour, of pixels whose order is not open.
    pub colour: f64,
    /// What open orders may change, on average over the pixels.
    pub open: f64,
}

/// Compares pixels with the oracle's.
///
/// # Errors
/// The first that is off by more than f32 may be, or too much that f32 cannot decide.
pub fn near(found: &[Found<f32>], expected: &[Expected]) -> Result<Apart, String> {
    if found.len() != expected.len() {
        return Err(format!(
            "{} pixels where the oracle has {}",
            found.len(),
            expected.len()
        ));
    }
    let mut apart = Apart {
        colour: 0.0,
        open: 0.0,
    };
    for (k, (a, b)) in found.iter().zip(expected).enumerate() {
        let colour = (a.colour.f64() - b.colour).abs();
        let covered = (f64::from(a.covered) - b.covered).abs();
        let off = colour.max_element().max(covered);
        // Not a number is no agreement, and no maximum.
        let is_near = colour.is_finite() && covered.is_finite() && off <= b.slack;
        if !is_near {
            return Err(format!(
                "pixel {k}: {a:?} is {off:.3e} off the oracle's {b:?}, which allows {:.3e}",
                b.slack
            ));
        }
        if b.slack < 1e-3 {
            apart.colour = apart.colour.max(off);
        }
        apart.open += b.slack / found.len() as f64;
    }
    if apart.open > MOST_OPEN {
        return Err(format!(
            "f32 leaves {:.3} of each pixel open, more than {MOST_OPEN}, so that the oracle cannot check the picture",
            apart.open
        ));
    }
    Ok(apart)
}

/// Compares the counts of pixels with each other: of the layers met as many are kept as there is room for, each is of a triangle of
/// its own, and what covers a cone was met.
///
/// # Errors
/// The first that contradicts itself.
pub fn counted(found: &[Found<f32>], most: u32, triangles: usize) -> Result<(), String> {
    let is_right = |pixel: &Found<f32>| {
        let [met, kept, cut] = pixel.counts;
        let is_empty = kept == 0 && pixel.covered > 0.0;
        kept == met.min(most) && met <= cut && cut as usize <= triangles && !is_empty
    };
    let wrong = found.iter().position(|pixel| !is_right(pixel));
    wrong.map_or(Ok(()), |k| {
        Err(format!(
            "pixel {k}: the counts of {:?} contradict each other, of {triangles} triangles and room for {most} layers",
            found[k]
        ))
    })
}

/// Compares the numbers of triangles that were cut with each cone with the least and the greatest that the oracle allows.
///
/// # Errors
/// The first that is not between them.
pub fn cut(found: &[Found<f32>], expected: &[[u32; 2]]) -> Result<(), String> {
    let pairs = (0..).zip(found.iter().zip(expected));
    let is_wrong = |(_, (pixel, [least, most])): &(usize, (&Found<f32>, &[u32; 2]))| {
        !(*least..=*most).contains(&pixel.counts[2])
    };
    let wrong = pairs.into_iter().find(is_wrong);
    wrong.map_or(Ok(()), |(k, (pixel, [least, most]))| {
        Err(format!(
            "pixel {k}: {} triangles were cut with the cone, and should be {least} to {most}",
            pixel.counts[2]
        ))
    })
}

/// Triangles that meet the disk in all ways: of its size, tiny, slivers, and far larger.
pub fn triangles(count: usize, seed: u64) -> Vec<[V3<f32>; 3]> {
    let mut random = Pcg32::new(seed);
    let mut at = |size: f64| DVec2::new(random.signed(), random.signed()) * size;
    let each = (0..count).map(|k| match k % 4 {
        0 => [at(2.0), at(2.0), at(2.0)],
        1 => {
            let middle = at(1.1);
            [middle + at(0.05), middle + at(0.05), middle + at(0.05)]
        }
        2 => {
            let (p, q) = (at(3.0), at(3.0));
            [p, q, q + at(0.01)]
        }
        _ => [at(30.0), at(30.0), at(30.0)],
    });
    each.map(|triangle| triangle.map(|p| V3::new(p.x as f32, p.y as f32, 1.0)))
        .collect()
}

/// Compares overlaps with the twin's, where the device computes like the host, and with quadrature; returns the
/// greatest difference of an area.
///
/// # Errors
/// The first that differs, or is off by more than [`off_area`] allows.
pub fn overlaps(
    triangles: &[[V3<f32>; 3]],
    found: &[Overlap<f32>],
    is_exact: bool,
) -> Result<f64, String> {
    let mut worst = 0.0_f64;
    for (corners, part) in triangles.iter().zip(found) {
        let [a, b, c] = *corners;
        let twin = disk_triangle(a, b, c);
        if is_exact && twin != *part {
            return Err(format!(
                "overlap of {corners:?}: {part:?} where the twin has {twin:?}"
            ));
        }
        let polygon = corners.map(|p| DVec2::new(f64::from(p.x), f64::from(p.y)));
        let (area, middle) = quadrature::overlap(&polygon);
        let off = (f64::from(part.area) - area).abs();
        let own = DVec2::new(part.centroid.x.into(), part.centroid.y.into());
        let moment = (own * f64::from(part.area) - middle * area).length();
        let most = off_area(corners);
        let is_near = off <= most && moment <= most;
        if !is_near {
            return Err(format!(
                "overlap of {corners:?}: {part:?} where quadrature has {area} at {middle}"
            ));
        }
        worst = worst.max(off);
    }
    if found.len() == triangles.len() && !found.is_empty() {
        return Ok(worst);
    }
    Err(format!(
        "{} overlaps of {} triangles",
        found.len(),
        triangles.len()
    ))
}

//! Closed meshes as grids of densities: the part of each voxel that is inside (Pfeuti 2009, §3.2), on the host.

use crate::MediaError;
use crate::volume::voxels;
use glam::{DVec3, I64Vec2};
use rayon::prelude::*;
use std::collections::HashMap;

/// Cells of a voxel along each axis.
const CELLS: u32 = 4;
/// Places of corners across a column of cells, per cell. They are whole numbers, so that it is exact on which side of an
/// edge the middle of a column is.
const UNITS: i64 = 16;
/// Most voxels along an axis: cells and their areas stay far from the ends of their types.
pub const MOST_SIDE: u32 = 256;

/// A triangle by its corners.
pub type Triangle = [DVec3; 3];

/// A mesh that encloses nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the mesh is open: {edges} edges belong to an odd number of triangles, the first from {from} to {to}; close it"
)]
pub struct OpenMesh {
    /// Edges.
    pub edges: usize,
    /// Where the first begins.
    pub from: DVec3,
    /// Where it ends.
    pub to: DVec3,
}

/// Checks that each edge belongs to an even number of triangles; corners at the same place are one.
///
/// # Errors
/// How many do not, and the first in the order of triangles.
pub fn check_closed(triangles: impl Iterator<Item = Triangle>) -> Result<(), OpenMesh> {
    // Edges in the order of triangles, each with how often it is there.
    let mut places = HashMap::new();
    let mut edges: Vec<([DVec3; 2], u32)> = Vec::new();
    for corners in triangles {
        for k in 0..3 {
            let ends = [corners[k], corners[(k + 1) % 3]];
            // The zero that is added makes one of both zeros.
            let mut key = ends.map(|end| end.to_array().map(|c| (c + 0.0).to_bits()));
            key.sort_unstable();
            let place = *places.entry(key).or_insert_with(|| {
                edges.push((ends, 0));
                edges.len() - 1
            });
            edges[place].1 += 1;
        }
    }
    let mut open = edges.iter().filter(|(_, count)| count % 2 == 1);
    let Some(([from, to], _)) = open.next() else {
        return Ok(());
    };
    Err(OpenMesh {
        edges: 1 + open.count(),
        from: *from,
        to: *to,
    })
}

/// Of each voxel between two corners, x fastest, the part that is inside a closed mesh within them: of 4³ cells, those
/// whose middles are.
///
/// # Errors
/// A resolution or bounds that cannot be used, an open mesh, or one whose parts overlap.
pub fn solid(
    triangles: &[Triangle],
    resolution: [u32; 3],
    [low, high]: [DVec3; 2],
) -> Result<Vec<f32>, MediaError> {
    if !resolution.iter().all(|n| (1..=MOST_SIDE).contains(n)) {
        let most = MOST_SIDE;
        return Err(MediaError::Resolution { resolution, most });
    }
    let size = high - low;
    if !(size.is_finite() && size.cmpgt(DVec3::ZERO).all()) {
        return Err(MediaError::Bounds(size.to_string()));
    }
    check_closed(triangles.iter().copied())?;
    let cells = resolution.map(|n| n * CELLS);
    let scale = DVec3::from(cells.map(f64::from)) / size;
    let scaled: Vec<Triangle> = (triangles.iter())
        .map(|corners| corners.map(|corner| (corner - low) * scale))
        .collect();
    let mut crossings: Vec<(u32, f64)> = (scaled.par_iter())
        .flat_map_iter(|corners| crossings(corners, cells))
        .collect();
    crossings.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let counts = inside(&crossings, resolution);
    check_volume(&counts, &scaled)?;
    let all = CELLS.pow(3) as f32;
    Ok(counts.into_iter().map(|count| count as f32 / all).collect())
}

/// The columns of cells along z whose middles a triangle is above or below, and where each crosses it, in cells. The
/// middle of a column on an edge is in one of both triangles.
fn crossings(corners: &Triangle, cells: [u32; 3]) -> Vec<(u32, f64)> {
    let place = |x: f64| (x * UNITS as f64).round() as i64;
    let [mut a, mut b, c] = corners.map(|p| (I64Vec2::new(place(p.x), place(p.y)), p.z));
    let area = (b.0 - a.0).perp_dot(c.0 - a.0);
    if area == 0 {
        return Vec::new();
    }
    if area < 0 {
        (a, b) = (b, a);
    }
    let corners = [a, b, c];
    let [low, high] = [a.0.min(b.0).min(c.0), a.0.max(b.0).max(c.0)];
    // Middles within the triangle's box.
    let from = |x: i64| (x + UNITS / 2 - 1).div_euclid(UNITS).max(0);
    let to = |x: i64, most: u32| (x + UNITS / 2).div_euclid(UNITS).min(i64::from(most));
    let mut found = Vec::new();
    for y in from(low.y)..to(high.y, cells[1]) {
        for x in from(low.x)..to(high.x, cells[0]) {
            let middle = I64Vec2::new(x, y) * UNITS + UNITS / 2;
            let sides = [0, 1, 2].map(|k| {
                let (start, end) = (corners[(k + 1) % 3].0, corners[(k + 2) % 3].0);
                let along = end - start;
                let side = along.perp_dot(middle - start);
                let is_owner = along.y > 0 || (along.y == 0 && along.x < 0);
                (side > 0 || (side == 0 && is_owner)).then_some(side)
            });
            if let [Some(a), Some(b), Some(c)] = sides {
                let weights = [a, b, c].map(|side| side as f64);
                let z: f64 = (0..3).map(|k| weights[k] * corners[k].1).sum();
                let column = x as u32 + cells[0] * y as u32;
                found.push((column, z / area.abs() as f64));
            }
        }
    }
    found
}

/// Of each voxel the cells whose middles are behind an odd number of crossings, which are sorted.
fn inside(crossings: &[(u32, f64)], resolution: [u32; 3]) -> Vec<u32> {
    let [width, height, depth] = resolution;
    let mut counts = vec![0; voxels(resolution)];
    let cell = |z: f64| (z - 0.5).ceil().clamp(0.0, f64::from(depth * CELLS)) as u32;
    for column in crossings.chunk_by(|a, b| a.0 == b.0) {
        let (x, y) = (
            column[0].0 % (width * CELLS) / CELLS,
            column[0].0 / (width * CELLS) / CELLS,
        );
        for [(_, enters), (_, leaves)] in column.as_chunks().0 {
            let [from, to] = [cell(*enters), cell(*leaves)];
            for voxel in from / CELLS..to.div_ceil(CELLS) {
                let [start, end] = [voxel * CELLS, (voxel + 1) * CELLS];
                let at = x + width * (y + height * voxel);
                counts[at as usize] += to.min(end) - from.max(start);
            }
        }
    }
    counts
}

/// Compares the cells inside with what the triangles enclose by the divergence theorem: parts that overlap are inside by
/// one and outside by the other.
fn check_volume(counts: &[u32], triangles: &[Triangle]) -> Result<(), MediaError> {
    let parts = triangles.iter().map(|[a, b, c]| {
        let enclosed = a.dot(b.cross(*c)) / 6.0;
        let area = (b - a).cross(c - a).length() / 2.0;
        (enclosed, area)
    });
    let (enclosed, area) = parts.fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
    let (found, enclosed) = (
        counts.iter().map(|n| f64::from(*n)).sum::<f64>(),
        f64::abs(enclosed),
    );
    // Middles of cells: a half of one at most along all of the surface.
    if (found - enclosed).abs() <= area / 2.0 {
        return Ok(());
    }
    Err(MediaError::Overlaps { found, enclosed })
}

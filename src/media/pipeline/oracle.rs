//! What photons leave in a grid and what a view sees of it, in f64 and without a structure: judges of the kernels.
//! Written from the definitions in `docs/media.md`, not from `kernels/media/`.

use super::ways::Ways;
use super::{Photon, Source};
use crate::phase::{HENYEY_GREENSTEIN, SCHLICK};
use crate::{Medium, Phase, Volume};
use glam::{DVec3, UVec3};
use std::f64::consts::PI;

/// Rounding of a position, as a part of the extent of the grid: four units in the last place of an f32.
const ROUNDING: f64 = 4e-7;
/// A photon that passes an edge may leave a sliver of its way in a voxel beside: so many of them in one voxel.
const SLIVERS: f64 = 16.0;
/// How far rounding may move a curved way, in voxels.
const WANDER: f64 = 2e-4;
/// Photons whose ways are kept at a time.
const CHUNK: usize = 4096;

/// A piece of a line within one voxel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece {
    /// The voxel.
    pub(crate) voxel: UVec3,
    /// Where it begins and ends, in the line's own length.
    pub(crate) span: [f64; 2],
    /// How far rounding may move both ends together.
    pub(crate) slack: f64,
}

/// The pieces of a line through the grid: position and direction in voxels, from `from` to `to`.
fn pieces(resolution: UVec3, (o, d): (DVec3, DVec3), [from, to]: [f64; 2]) -> Vec<Piece> {
    let most = (resolution - 1).as_dvec3();
    let rounded = ROUNDING * resolution.max_element() as f64;
    // For each axis the next plane. The grid's own planes are ends of the line, which is known better.
    let forward = d.cmpgt(DVec3::ZERO);
    let sign = DVec3::select(forward, DVec3::ONE, DVec3::NEG_ONE);
    let border = DVec3::select(forward, resolution.as_dvec3(), DVec3::ZERO);
    let first = (o + d * from).floor().max(DVec3::ZERO).min(most);
    let mut planes = first + DVec3::select(forward, DVec3::ONE, DVec3::ZERO);
    let step = d.abs().recip();
    let (mut at, mut pieces, mut before) = (from, Vec::new(), 0.0);
    while at < to {
        let next = DVec3::select(planes.cmpeq(border), DVec3::INFINITY, (planes - o) / d);
        let nearest = next.min_element();
        let axis = if nearest == next.x {
            0
        } else if nearest == next.y {
            1
        } else {
            2
        };
        let end = nearest.min(to);
        let after = if end < to { rounded * step[axis] } else { 0.0 };
        if end > at {
            let middle = o + d * (0.5 * (at + end));
            pieces.push(Piece {
                voxel: middle.max(DVec3::ZERO).min(most).as_uvec3(),
                span: [at, end],
                slack: before + after,
            });
        }
        (at, before) = (at.max(end), after);
        planes[axis] += sign[axis];
    }
    pieces
}

/// A straight part of a way.
struct Leg {
    /// Position and direction in voxels.
    line: (DVec3, DVec3),
    /// Where it begins and ends, in the world's length.
    span: [f64; 2],
    /// Its direction in the world.
    direction: DVec3,
    /// v where it begins.
    v: DVec3,
}

/// The legs of a way from a place in the grid along a unit direction, if it is curved.
fn curved(medium: &Medium, ways: &Ways, origin: DVec3, direction: DVec3) -> Vec<Leg> {
    let side = medium.size_of_voxel().x;
    let leg = |chord: super::ways::Chord| Leg {
        line: (chord.from, raised(chord.direction / side)),
        span: [0.0, (chord.to - chord.from).length() * side],
        direction: chord.direction,
        v: chord.v,
    };
    ways.way(origin, direction).into_iter().map(leg).collect()
}

/// The legs of a photon.
fn legs_of(medium: &Medium, ways: Option<&Ways>, photon: &Photon) -> Vec<Leg> {
    let of = &photon.ray.ray;
    let (origin, direction) = (of.origin.as_dvec3(), photon.direction.as_dvec3());
    match ways {
        Some(ways) => curved(medium, ways, origin, direction.normalize()),
        None => vec![Leg {
            line: (origin, of.direction.as_dvec3()),
            span: [photon.ray.from, photon.ray.to].map(f64::from),
            direction,
            v: direction,
        }],
    }
}

/// A direction in voxels, none of its components 0.
fn raised(along: DVec3) -> DVec3 {
    let tiny = along.cmplt(DVec3::splat(1e-12)) & along.cmpgt(DVec3::splat(-1e-12));
    DVec3::select(tiny, DVec3::splat(1e-12), along)
}

/// A medium with what σ is where it is the same in a voxel and around it.
pub(crate) struct Fields<'a> {
    medium: &'a Medium,
    even: Vec<Option<f64>>,
    /// σ, if it is the same in all voxels.
    pub(crate) uniform: Option<f64>,
}

impl<'a> Fields<'a> {
    pub(crate) fn new(medium: &'a Medium) -> Self {
        let even = |pair: &crate::medium::Pair| {
            (pair.sigma.x == pair.sigma.y).then(|| f64::from(pair.sigma.x))
        };
        let even: Vec<_> = medium.dilated().iter().map(even).collect();
        let uniform = even[0].filter(|_| even.iter().all(|sigma| *sigma == even[0]));
        Self {
            medium,
            even,
            uniform,
        }
    }

    /// ∫ σ dt over a piece of a line.
    fn depth(&self, (o, d): (DVec3, DVec3), piece: &Piece) -> f64 {
        let [from, to] = piece.span;
        let place = self.medium.voxel_index(piece.voxel) as usize;
        if let Some(sigma) = self.even[place] {
            return sigma * (to - from);
        }
        // Between planes through middles of voxels σ is a cubic polynomial.
        let middles = ((piece.voxel.as_dvec3() + 0.5 - o) / d).to_array();
        let mut cuts = [from, middles[0], middles[1], middles[2], to].map(|t| t.clamp(from, to));
        cuts.sort_by(f64::total_cmp);
        let sigma = |t: f64| self.medium.exact_at(o + d * t)[1];
        let gauss = |ends: &[f64]| {
            let (middle, half) = ((ends[0] + ends[1]) / 2.0, (ends[1] - ends[0]) / 2.0);
            let offset = half / 3.0_f64.sqrt();
            half * (sigma(middle - offset) + sigma(middle + offset))
        };
        cuts.windows(2).map(gauss).sum()
    }

    /// ∫ σ ds between two positions in the world.
    pub(crate) fn depth_between(&self, volume: &Volume, a: DVec3, b: DVec3) -> f64 {
        let way = b - a;
        let direction = way.normalize();
        let Some([enter, leave]) = volume.clip(a, direction) else {
            return 0.0;
        };
        let span = [enter, leave.min(way.length())];
        if let Some(sigma) = self.uniform {
            return sigma * (span[1] - span[0]).max(0.0);
        }
        let line = self.line(a, direction);
        let pieces = pieces(self.medium.resolution, line, span);
        pieces.iter().map(|piece| self.depth(line, piece)).sum()
    }

    /// A line of the world in voxels, none of its components 0.
    fn line(&self, origin: DVec3, direction: DVec3) -> (DVec3, DVec3) {
        let along = self.medium.difference_in_voxels(direction);
        (self.medium.in_voxels(origin), raised(along))
    }
}

/// The mean of exp(−x s) over s in [0, 1].
fn mean_transmittance(depth: f64) -> f64 {
    if depth < 1e-9 {
        1.0
    } else {
        -(-depth).exp_m1() / depth
    }
}

/// What a list of photons leaves in a grid.
pub(crate) struct Left {
    /// Six sums for each voxel, as [`crate::scatter::sums_in_f64`] has them.
    pub(crate) sums: Vec<[f64; 6]>,
    /// How far rounding of ways may move each of them.
    pub(crate) slack: Vec<f64>,
    /// Deposits in each voxel.
    pub(crate) counts: Vec<u32>,
    /// Deposits in voxels that were not looked at.
    pub(crate) unread: u32,
    /// How often a photon came into each voxel.
    pub(crate) visits: Vec<u32>,
    /// The sum of these photons' weights.
    pub(crate) weights: Vec<f64>,
    /// Energy of red, green and blue that is scattered or absorbed: of each photon Φ (1 − exp(−∫ σ)).
    pub(crate) lost: f64,
}

/// What a photon leaves in a voxel.
struct Share {
    place: usize,
    energy: DVec3,
    direction: DVec3,
    /// How far rounding may move it.
    slack: f64,
}

/// What a photon leaves, with the part of it that is left of it.
fn shares_of(fields: &Fields, ways: Option<&Ways>, photon: &Photon) -> (Vec<Share>, f64) {
    let medium = fields.medium;
    let power = photon.energy.as_dvec3();
    let wander = match ways {
        Some(_) => WANDER * medium.size_of_voxel().max_element(),
        None => 0.0,
    };
    let (mut through, mut shares) = (1.0, Vec::new());
    for leg in legs_of(medium, ways, photon) {
        for piece in pieces(medium.resolution, leg.line, leg.span) {
            let depth = fields.depth(leg.line, &piece);
            let way = piece.span[1] - piece.span[0];
            let energy = power * (through * way * mean_transmittance(depth));
            // Of a way that is nearly along a plane no more is moved than there is.
            let moved = piece.slack.min(way);
            shares.push(Share {
                place: medium.voxel_index(piece.voxel) as usize,
                energy,
                direction: leg.direction * (energy.element_sum() / 3.0),
                slack: power.max_element() * through * (moved + ROUNDING * way + wander),
            });
            through *= (-depth).exp();
        }
    }
    (shares, through)
}

/// Sums of what photons leave in each voxel, from the planes between voxels alone.
pub(crate) fn left_by(fields: &Fields, ways: Option<&Ways>, photons: &[Photon]) -> Left {
    use rayon::prelude::*;
    let medium = fields.medium;
    let count = medium.field.len();
    let mut left = Left {
        sums: vec![[0.0; 6]; count],
        slack: vec![0.0; count],
        counts: vec![0; count],
        unread: 0,
        visits: vec![0; count],
        weights: vec![0.0; count],
        lost: 0.0,
    };
    let mut longest = 0.0_f64;
    for chunk in photons.chunks(CHUNK) {
        let of_all: Vec<_> = (chunk.par_iter())
            .map(|photon| shares_of(fields, ways, photon))
            .collect();
        for (photon, (shares, through)) in chunk.iter().zip(of_all) {
            let mut last = None;
            for share in shares {
                let place = share.place;
                let both = [share.energy.to_array(), share.direction.to_array()];
                for (sum, value) in left.sums[place].iter_mut().zip(both.as_flattened()) {
                    *sum += value;
                }
                left.slack[place] += share.slack;
                left.counts[place] += 1;
                if last != Some(place) {
                    left.visits[place] += 1;
                    left.weights[place] += photon.weight;
                }
                last = Some(place);
            }
            let power = photon.energy.as_dvec3();
            left.lost += power.element_sum() * (1.0 - through);
            let along = f64::from(photon.ray.ray.direction.abs().max_element());
            longest = longest.max(power.max_element() / along);
        }
    }
    let mut sliver = SLIVERS * longest * ROUNDING * medium.resolution.max_element() as f64;
    if ways.is_some() {
        sliver = SLIVERS * longest * WANDER;
    }
    for slack in &mut left.slack {
        *slack += sliver;
    }
    left
}

/// Photons that cross each of `cells`³ cells with the sums of their places on a map of the light's square, and of the places'
/// squares: five sums for each cell.
pub(crate) fn crossed_by(
    medium: &Medium,
    ways: Option<&Ways>,
    photons: &[Photon],
    cells: u32,
    map: u32,
) -> Vec<[u64; 5]> {
    let mut all = vec![[0; 5]; cells.pow(3) as usize];
    for photon in photons {
        let [x, y] = photon.cell_of(map).map(u64::from);
        let mut last = None;
        let legs = legs_of(medium, ways, photon);
        let pieces = legs
            .iter()
            .flat_map(|leg| pieces(medium.resolution, leg.line, leg.span));
        for piece in pieces {
            let place = cell_place(medium, piece.voxel, cells);
            if last != Some(place) {
                let one = [1, x, y, x * x, y * y];
                for (sum, value) in all[place].iter_mut().zip(one) {
                    *sum += value;
                }
                last = Some(place);
            }
        }
    }
    all
}

/// The place of the cell of `cells`³ that holds a voxel.
pub(crate) fn cell_place(medium: &Medium, voxel: UVec3, cells: u32) -> usize {
    let cell = voxel * cells / medium.resolution;
    (cell.x + cells * (cell.y + cells * cell.z)) as usize
}

/// The density of a phase function, per steradian, in f64 (Blasi, Le Saëc & Schlick 1993; Henyey & Greenstein 1941).
fn density(phase: Phase, cosine: f64) -> f64 {
    let a = f64::from(phase.anisotropy);
    let even = 1.0 / (4.0 * PI);
    match phase.kind {
        SCHLICK => even * (1.0 - a * a) / (1.0 - a * cosine).powi(2),
        HENYEY_GREENSTEIN => even * (1.0 - a * a) / (1.0 + a * a - 2.0 * a * cosine).powf(1.5),
        _ => even,
    }
}

/// What rays of a view see of a grid of radiance: in each voxel on their way, the light at the middle of their piece that is
/// scattered into them, times the transmittance up to the eye and the square of n where the ray enters over n there; and what a
/// mirror reflects.
pub(crate) fn seen_by(
    fields: &Fields,
    ways: Option<&Ways>,
    volume: &Volume,
    radiance: &[[f32; 6]],
    rays: &[(DVec3, DVec3)],
) -> Result<Vec<DVec3>, crate::tracking::TrackingError> {
    use rayon::prelude::*;
    let medium = fields.medium;
    let albedo = f64::from(crate::tracking::albedo(volume)?);
    let per_volume = medium.size_of_voxel().element_product().recip();
    let seen = |(origin, direction): &(DVec3, DVec3)| {
        let Some(span) = volume.clip(*origin, *direction) else {
            return DVec3::ZERO;
        };
        let legs = match ways {
            Some(ways) => {
                let enter = medium.in_voxels(*origin + *direction * span[0]);
                curved(medium, ways, enter, *direction)
            }
            None => vec![Leg {
                line: fields.line(*origin, *direction),
                span,
                direction: *direction,
                v: *direction,
            }],
        };
        let n_at = |position| ways.map_or(1.0, |ways| ways.n_at(position));
        let outside = legs.first().map_or(1.0, |leg| n_at(leg.line.0));
        let (mut light, mut through) = (DVec3::ZERO, 1.0);
        let mut sky = None;
        for leg in legs {
            for piece in pieces(medium.resolution, leg.line, leg.span) {
                let middle = leg.line.0 + leg.line.1 * (0.5 * (piece.span[0] + piece.span[1]));
                let (energy, flow) = radiance_at(medium, radiance, middle);
                let after = (-fields.depth(leg.line, &piece)).exp();
                let share = (outside / n_at(middle)).powi(2);
                let mean = energy.element_sum() / 3.0;
                if mean > 0.0 {
                    // Light goes on against the ray.
                    let cosine = -flow.dot(leg.direction) / mean;
                    let scattered = density(volume.phase, cosine) * per_volume * albedo;
                    light += energy * (scattered * through * (1.0 - after) * share);
                }
                through *= after;
            }
            if let (Some(ways), None) = (ways, sky) {
                let end = leg.line.0 + leg.line.1 * leg.span[1];
                let found = ways.mirrored([leg.line.0, end], leg.v, outside);
                sky = found.map(|(reflected, _)| reflected * through);
                through *= found.map_or(1.0, |(_, onward)| onward);
            }
        }
        light + sky.unwrap_or_default()
    };
    Ok(rays.par_iter().map(seen).collect())
}

/// Sums of a grid, trilinearly between the middles of voxels.
fn radiance_at(medium: &Medium, radiance: &[[f32; 6]], position: DVec3) -> (DVec3, DVec3) {
    let most = (medium.resolution - 1).as_dvec3();
    let local = (position - 0.5).max(DVec3::ZERO).min(most);
    let low = local.as_uvec3();
    let w = local - low.as_dvec3();
    let mut sums = [0.0; 6];
    for k in 0..8 {
        let offset = UVec3::new(k & 1, k >> 1 & 1, k >> 2);
        let voxel = (low + offset).min(medium.resolution - 1);
        let weight = DVec3::select(offset.cmpeq(UVec3::ONE), w, 1.0 - w).element_product();
        let one = &radiance[medium.voxel_index(voxel) as usize];
        for (sum, value) in sums.iter_mut().zip(one) {
            *sum += weight * f64::from(*value);
        }
    }
    let [r, g, b, x, y, z] = sums;
    (DVec3::new(r, g, b), DVec3::new(x, y, z))
}

/// Power in red, green and blue that a light sends into the box of a volume: of a point its intensity times the solid angle
/// of the box, of a beam that is wholly caught its own. `None` for a beam that is not.
pub(crate) fn power_into(volume: &Volume, source: &Source) -> Option<DVec3> {
    match *source {
        Source::Point {
            position,
            intensity,
        } => Some(intensity.as_dvec3() * solid_angle(volume, position)),
        Source::Beam { .. } => None,
    }
}

/// The solid angle of a box from a point outside: the sides that face it, each by the arc tangents of its corners.
fn solid_angle(volume: &Volume, point: DVec3) -> f64 {
    let [low, high] = [volume.low - point, volume.high - point];
    let mut sum = 0.0;
    for axis in 0..3 {
        // The plane that faces the point, if the point is beside this pair of sides.
        let distance = if low[axis] > 0.0 {
            low[axis]
        } else if high[axis] < 0.0 {
            -high[axis]
        } else {
            continue;
        };
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let corner = |x: f64, y: f64| {
            let far = (x * x + y * y + distance * distance).sqrt();
            (x * y / (distance * far)).atan()
        };
        sum += corner(high[u], high[v]) - corner(low[u], high[v]) - corner(high[u], low[v])
            + corner(low[u], low[v]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solid_angle_of_a_box_is_that_of_directions_that_meet_it() {
        let volume = Volume::constant(1.0, 0.0, 1.0).unwrap();
        // From the middle of a side's far field: a cube seen along its axis from a distance of half its side hides a sixth.
        let sixth = solid_angle(&volume, DVec3::new(0.5, 0.5, -0.5)) / (4.0 * PI);
        assert!((sixth - 1.0 / 6.0).abs() < 1e-12, "{sixth}");
        let point = DVec3::new(0.3, 2.0, -0.4);
        let (rows, mut hits) = (1500, 0.0);
        for i in 0..rows {
            for j in 0..rows {
                let z = 2.0 * (f64::from(i) + 0.5) / f64::from(rows) - 1.0;
                let angle = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(rows);
                let r = (1.0 - z * z).sqrt();
                let direction = DVec3::new(r * angle.cos(), r * angle.sin(), z);
                hits += f64::from(u8::from(volume.clip(point, direction).is_some()));
            }
        }
        let counted = 4.0 * PI * hits / f64::from(rows * rows);
        let exact = solid_angle(&volume, point);
        assert!(
            (counted / exact - 1.0).abs() < 5e-3,
            "{counted}, not {exact}"
        );
    }
}

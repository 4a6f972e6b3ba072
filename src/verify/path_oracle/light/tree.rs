//! Choice of a light by a bounding hierarchy.
//!
//! The topology is read from the built tree; the bounds and importance of its nodes are computed
//! here from the scene.

use crate::path_oracle::rounding::Rounding;
use glam::{DQuat, DVec3};
use raystone_render::light_branches;
use raystone_scene::{Light, LightList, SceneData, Source};
use std::f64::consts::{FRAC_PI_2, PI};

/// Margin of a node's emission cone, radians.
const SLACK: f64 = 0.01;
/// The smallest emission cosine that counts.
const LEAST_COSINE: f64 = 0.01;

/// Bounds of the lights under a node.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
    power: f64,
    /// Axis and half angle of the normal cone.
    axis: DVec3,
    normals: f64,
    /// Emission angle around a normal.
    spread: f64,
    both_sides: bool,
}

impl Bounds {
    fn of(scene: &SceneData, source: Source, power: f64) -> Option<Self> {
        let flat = |corners: &[DVec3], normal: DVec3, triangle: u32| Self {
            low: corners.iter().fold(DVec3::INFINITY, |a, b| a.min(*b)),
            high: corners.iter().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b)),
            power,
            axis: normal.normalize(),
            normals: 0.0,
            spread: FRAC_PI_2,
            both_sides: scene.materials[scene.material_ids[triangle as usize] as usize]
                .emits_both_sides,
        };
        let id = match source {
            Source::Triangle(id) => {
                let [a, b, c] = scene.outward(id as usize).map(|v| v.as_dvec3());
                return Some(flat(&[a, b, c], (b - a).cross(c - a), id));
            }
            Source::Parallelogram(of) => {
                let (a, [u, v]) = (of.corner.as_dvec3(), of.edges.map(|e| e.as_dvec3()));
                let corners = [a, a + u, a + v, a + u + v];
                return Some(flat(&corners, u.cross(v), of.triangles[0]));
            }
            Source::Light(id) => id,
        };
        let light = &scene.lights[id as usize];
        let (middle, radius) = light.place()?;
        let (middle, radius) = (middle.as_dvec3(), f64::from(radius));
        let mut bounds = Self {
            low: middle - radius,
            high: middle + radius,
            power,
            axis: DVec3::Z,
            normals: PI,
            spread: FRAC_PI_2,
            both_sides: false,
        };
        if let Light::Spot {
            direction,
            inner,
            outer,
            ..
        } = light
        {
            bounds.axis = direction.as_dvec3().normalize();
            bounds.normals = f64::from(*inner);
            bounds.spread = f64::from(*outer) - f64::from(*inner);
        }
        Some(bounds)
    }

    fn and(self, other: Self) -> Self {
        let (axis, normals) = least_cone((self.axis, self.normals), (other.axis, other.normals));
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            power: self.power + other.power,
            axis,
            normals,
            spread: self.spread.max(other.spread),
            both_sides: self.both_sides || other.both_sides,
        }
    }

    /// Approximate contribution of its lights at a surface point with this normal.
    fn importance(&self, at: DVec3, normal: DVec3) -> f64 {
        let to_centre = 0.5 * (self.low + self.high) - at;
        let radius = 0.5 * (self.high - self.low).length();
        let distance = to_centre.length();
        let nearest = distance.max(radius);
        if nearest == 0.0 {
            return self.power;
        }
        let plain = self.power / (nearest * nearest);
        if distance <= radius {
            return plain;
        }
        let box_angle = (radius / distance).asin();
        let direction = to_centre / distance;
        let along = -self.axis.dot(direction);
        let along = if self.both_sides { along.abs() } else { along };
        let rest = |angle: f64, less: f64| (angle - less).max(0.0);
        let off_axis = along.clamp(-1.0, 1.0).acos();
        let emitted = rest(rest(off_axis, self.normals), box_angle);
        if emitted > (self.spread + SLACK).min(PI) {
            return 0.0;
        }
        let arrives = rest(normal.dot(direction).clamp(-1.0, 1.0).acos(), box_angle);
        // A point in a medium has no normal: all light arrives.
        let arrives = if normal == DVec3::ZERO { 0.0 } else { arrives };
        plain * emitted.cos().max(LEAST_COSINE) * arrives.cos().max(0.0)
    }
}

fn least_cone(a: (DVec3, f64), b: (DVec3, f64)) -> (DVec3, f64) {
    let (wide, narrow) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = wide.0.dot(narrow.0).clamp(-1.0, 1.0).acos();
    if (between + narrow.1).min(PI) <= wide.1 {
        return wide;
    }
    let half = (wide.1 + between + narrow.1) / 2.0;
    let across = wide.0.cross(narrow.0);
    let is_along = across.length() < 1e-12;
    if half >= PI || is_along && wide.0.dot(narrow.0) < 0.0 {
        return (wide.0, PI);
    }
    if is_along {
        return (wide.0, between + narrow.1);
    }
    let turn = DQuat::from_axis_angle(across.normalize(), half - wide.1);
    ((turn * wide.0).normalize(), half)
}

/// A tree over the lights that have a position.
pub(super) struct Tree {
    bounds: Vec<Bounds>,
    /// Number of lights under each node.
    below: Vec<f64>,
    /// Left child of each node; `None` for a leaf.
    children: Vec<Option<usize>>,
    lights: Vec<usize>,
    leaves: Vec<usize>,
    parents: Vec<usize>,
}

const ROOT: usize = 1;

impl Tree {
    /// The tree over the lights of a list that have a position, which come first.
    pub(super) fn new(scene: &SceneData, list: &LightList) -> Self {
        let own: Vec<Bounds> = (list.lights.iter())
            .filter_map(|light| Bounds::of(scene, light.source, light.power))
            .collect();
        let branches = light_branches(scene, list);
        let mut below: Vec<Vec<usize>> = vec![Vec::new(); branches.len()];
        let mut leaves = vec![0; own.len()];
        for (node, branch) in branches.iter().enumerate().skip(ROOT) {
            if branch.child == 0 {
                leaves[branch.light as usize] = node;
                let mut above = node;
                while above > 0 {
                    below[above].push(branch.light as usize);
                    above = branches[above].parent as usize;
                }
            }
        }
        let counts = below.iter().map(|lights| lights.len() as f64).collect();
        let bounds = |lights: &mut Vec<usize>| {
            lights.sort_unstable();
            let all = lights.iter().map(|light| own[*light]);
            all.reduce(Bounds::and)
        };
        // 0 means none.
        let first = own.first().copied();
        let bounds = below
            .iter_mut()
            .filter_map(|lights| bounds(lights).or(first));
        Self {
            bounds: bounds.collect(),
            below: counts,
            children: (branches.iter())
                .map(|branch| (branch.child > 0).then_some(branch.child as usize))
                .collect(),
            lights: branches.iter().map(|b| b.light as usize).collect(),
            parents: branches.iter().map(|b| b.parent as usize).collect(),
            leaves,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.leaves.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.leaves.is_empty()
    }

    /// How many of a node's values go to its left child; each light keeps at least one. `None` if
    /// neither child contributes.
    fn values_of_left(
        &self,
        left: usize,
        values: f64,
        (at, normal): (DVec3, DVec3),
        rounding: &mut Rounding,
    ) -> Option<f64> {
        let [a, b] = [left, left + 1].map(|node| self.bounds[node].importance(at, normal));
        let (a, b) = (rounding.number(a), rounding.number(b));
        let [least, rest] = [left, left + 1].map(|node| self.below[node]);
        match (a > 0.0, b > 0.0) {
            (false, false) => None,
            (false, true) => Some(0.0),
            (true, false) => Some(values),
            (true, true) => {
                let part = rounding.share(a / (a + b)) * values;
                Some(part.floor().clamp(least, values - rest))
            }
        }
    }

    /// The light chosen by one of `values` values, and how many of them choose it.
    pub(super) fn choose(
        &self,
        mut value: f64,
        all: f64,
        at: (DVec3, DVec3),
        rounding: &mut Rounding,
    ) -> Option<(usize, f64)> {
        let (mut node, mut values) = (ROOT, all);
        while let Some(left) = self.children[node] {
            let part = self.values_of_left(left, values, at, rounding)?;
            (node, value, values) = if value < part {
                (left, value, part)
            } else {
                (left + 1, value - part, values - part)
            };
        }
        Some((self.lights[node], values))
    }

    /// The number of values for which [`Tree::choose`] returns a light.
    pub(super) fn values(
        &self,
        light: usize,
        all: f64,
        at: (DVec3, DVec3),
        rounding: &mut Rounding,
    ) -> f64 {
        let mut way = vec![self.leaves[light]];
        while let Some(node) = way.last().filter(|node| **node > ROOT) {
            way.push(self.parents[*node]);
        }
        let mut values = all;
        for step in way.windows(2).rev() {
            let left = step[0] & !1;
            let Some(part) = self.values_of_left(left, values, at, rounding) else {
                return 0.0;
            };
            values = if step[0] == left { part } else { values - part };
            if values == 0.0 {
                return 0.0;
            }
        }
        values
    }
}

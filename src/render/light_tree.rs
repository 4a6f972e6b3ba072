//! A bounding volume hierarchy of lights: each node bounds the position, direction and power of its
//! lights, so that a light can be chosen by its approximate contribution at a point.
//!
//! Source: A. Conty Estevez, C. Kulla, "Importance sampling of many lights with adaptive tree
//! splitting", 2018 (without the splitting); cones and the bound of the cosine as in M. Pharr, W.
//! Jakob, G. Humphreys, "Physically Based Rendering", 4th edition, 12.6.3. `importance` is in
//! `kernels/shading/light/tree.wesl`.

use glam::{DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LightBounds {
    pub min: DVec3,
    pub max: DVec3,
    pub power: f64,
    /// Unit axis of the normal cone.
    pub axis: DVec3,
    /// Largest angle between axis and normals, radians.
    pub normals: f64,
    /// Emission angle around a normal, radians.
    pub spread: f64,
    /// True if light is emitted on both sides of the surface.
    pub both_sides: bool,
}

impl LightBounds {
    /// Omnidirectional light from this box.
    pub(crate) fn everywhere(min: DVec3, max: DVec3, power: f64) -> Self {
        Self {
            min,
            max,
            power,
            axis: DVec3::Z,
            normals: PI,
            spread: FRAC_PI_2,
            both_sides: false,
        }
    }

    fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    fn union(&self, other: &Self) -> Self {
        let (axis, normals) = cone_union((self.axis, self.normals), (other.axis, other.normals));
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            power: self.power + other.power,
            axis,
            normals,
            spread: self.spread.max(other.spread),
            both_sides: self.both_sides || other.both_sides,
        }
    }

    /// Cost of a cluster: power, solid angle, and box surface (Conty Estevez & Kulla, eq. 1).
    fn cost(&self, extent: DVec3, axis: usize) -> f64 {
        let reach = (self.normals + self.spread).min(PI);
        let (n, w) = (self.normals, reach);
        let angle = 2.0 * PI * (1.0 - n.cos())
            + FRAC_PI_2 * (2.0 * w * n.sin() - (n - 2.0 * w).cos() - 2.0 * n * n.sin() + n.cos());
        let size = self.max - self.min;
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        // Thin boxes are no better for being thin along the split axis.
        let regular = extent.max_element() / extent[axis].max(f64::MIN_POSITIVE);
        self.power * angle.max(1e-6) * area.max(1e-12 * extent.length_squared()) * regular
    }
}

/// The smallest cone around two cones.
fn cone_union(a: (DVec3, f64), b: (DVec3, f64)) -> (DVec3, f64) {
    let (wide, narrow) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let between = wide.0.dot(narrow.0).clamp(-1.0, 1.0).acos();
    if (between + narrow.1).min(PI) <= wide.1 {
        return wide;
    }
    let angle = 0.5 * (wide.1 + between + narrow.1);
    let across = wide.0.cross(narrow.0);
    if angle >= PI {
        return (wide.0, PI);
    }
    if across.length_squared() < 1e-24 {
        // Equal up to rounding, of which the angle has more than the vectors; or opposite.
        let is_opposite = between > FRAC_PI_2;
        let reach = if is_opposite { PI } else { between + narrow.1 };
        return (wide.0, reach);
    }
    let turn = glam::DQuat::from_axis_angle(across.normalize(), angle - wide.1);
    ((turn * wide.0).normalize(), angle)
}

/// A node, identified by its index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TreeNode {
    pub(super) bounds: LightBounds,
    /// First of its two consecutive children, or 0.
    pub child: u32,
    /// The parent; 0 for the root.
    pub parent: u32,
    /// The light of a leaf.
    pub light: u32,
    /// Number of its lights.
    pub(super) count: u32,
}

/// Index of the root. Siblings begin at even indices and differ in the last bit.
pub(super) const ROOT: usize = 1;
/// Number of split candidates along an axis.
const BUCKETS: usize = 12;

/// The nodes of a tree over lights, index 0 being unused; and the leaf of each light. All nodes
/// below a left child precede those below the right one, by which kernels find a leaf.
pub(super) fn light_tree(lights: &[LightBounds]) -> (Vec<TreeNode>, Vec<u32>) {
    let Some(first) = lights.first() else {
        return (Vec::new(), Vec::new());
    };
    let none = TreeNode {
        bounds: *first,
        child: 0,
        parent: 0,
        light: 0,
        count: 0,
    };
    let mut nodes = vec![none; 2];
    let mut leaves = vec![0; lights.len()];
    let mut open = vec![(ROOT, (0..lights.len() as u32).collect::<Vec<u32>>())];
    while let Some((node, members)) = open.pop() {
        let of = |light: &u32| lights[*light as usize];
        let all = members.iter().map(of).reduce(|a, b| a.union(&b));
        nodes[node].bounds = all.unwrap_or(*first);
        nodes[node].count = members.len() as u32;
        if let [light] = members[..] {
            nodes[node].light = light;
            leaves[light as usize] = node as u32;
            continue;
        }
        let [left, right] = cut(lights, members);
        let child = nodes.len();
        nodes[node].child = child as u32;
        nodes.extend(
            [TreeNode {
                parent: node as u32,
                ..none
            }; 2],
        );
        open.extend([(child + 1, right), (child, left)]);
    }
    (nodes, leaves)
}

/// Splits a cluster where the sum of the costs is least; in halves if all are equal.
fn cut(lights: &[LightBounds], mut members: Vec<u32>) -> [Vec<u32>; 2] {
    let center = |light: &u32| lights[*light as usize].center();
    let low = members.iter().map(center).fold(DVec3::INFINITY, DVec3::min);
    let high = members
        .iter()
        .map(center)
        .fold(DVec3::NEG_INFINITY, DVec3::max);
    let extent = high - low;
    let bucket = |light: &u32, axis: usize| {
        let along = (center(light)[axis] - low[axis]) / extent[axis];
        ((along * BUCKETS as f64) as usize).min(BUCKETS - 1)
    };
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|axis| extent[*axis] > 0.0) {
        let mut clusters: [Option<LightBounds>; BUCKETS] = [None; BUCKETS];
        for light in &members {
            let cluster = &mut clusters[bucket(light, axis)];
            let own = lights[*light as usize];
            *cluster = Some(cluster.map_or(own, |c| c.union(&own)));
        }
        for place in 1..BUCKETS {
            let cost = |part: &[Option<LightBounds>]| {
                let all = part.iter().flatten().copied().reduce(|a, b| a.union(&b));
                all.map(|all| all.cost(extent, axis))
            };
            let costs = cost(&clusters[..place]).zip(cost(&clusters[place..]));
            if let Some(sum) = costs.map(|(a, b)| a + b)
                && best.is_none_or(|(least, ..)| sum < least)
            {
                best = Some((sum, axis, place));
            }
        }
    }
    if let Some((_, axis, place)) = best {
        let (left, right) = members
            .iter()
            .partition(|light| bucket(light, axis) < place);
        return [left, right];
    }
    let right = members.split_off(members.len() / 2);
    [members, right]
}

/// Added to the emission angle, so that rounding in kernels excludes no light, radians.
const SLACK: f64 = 0.01;

/// Rows of `shading_tables`: four `vec4` per node, the last of which holds child, leaf's light,
/// number of lights and a two-sided flag; then the leaf of each light. Boxes are rounded outwards.
pub(super) fn tree_rows(lights: &[LightBounds]) -> Vec<[u32; 4]> {
    let (nodes, leaves) = light_tree(lights);
    let vector =
        |v: DVec3, round: fn(f32) -> f32| v.as_vec3().to_array().map(|x| round(x).to_bits());
    let mut rows = Vec::with_capacity(4 * nodes.len() + leaves.len());
    for node in &nodes {
        let bounds = &node.bounds;
        let [ax, ay, az] = vector(bounds.min, f32::next_down);
        let [bx, by, bz] = vector(bounds.max, f32::next_up);
        let axis: Vec3 = bounds.axis.as_vec3();
        let [x, y, z] = axis.to_array().map(f32::to_bits);
        let spread = (bounds.spread + SLACK).min(PI);
        rows.extend([
            [ax, ay, az, (bounds.power as f32).to_bits()],
            [bx, by, bz, (bounds.normals.cos() as f32).to_bits()],
            [x, y, z, (spread.cos() as f32).to_bits()],
            [
                node.child,
                node.light,
                node.count,
                u32::from(bounds.both_sides),
            ],
        ]);
    }
    rows.extend(leaves.iter().map(|leaf| [*leaf, 0, 0, 0]));
    rows
}

/// Builds trees over two known groups of lamps, far apart along each axis: a tree of bad splits chooses lights that are far
/// away, which makes images noisier and no path wrong.
///
/// # Errors
/// The root does not part the groups, or does not hold all of their power: along which axis.
pub fn check_known() -> Result<(), String> {
    for axis in 0..3 {
        let lights: Vec<LightBounds> = (0..7).map(|k| known_lamp(k, axis)).collect();
        let (nodes, leaves) = light_tree(&lights);
        let child = nodes[ROOT].child as usize;
        let group = |leaf: u32| {
            let mut node = leaf as usize;
            while node > child + 1 {
                node = nodes[node].parent as usize;
            }
            node
        };
        let is_parted = (0..7).all(|k| group(leaves[k]) == child + usize::from(k % 2 == 1));
        let power = nodes[ROOT].bounds.power;
        if !is_parted || power != 28.0 {
            return Err(format!(
                "the tree over known lamps along axis {axis} does not part them in two groups, or has a power of {power}, and \
                 should have 28: this program chooses lights badly; build it anew, and report what stays wrong"
            ));
        }
    }
    let cost = known_cone().cost(DVec3::new(4.0, 2.0, 8.0), 0);
    if (cost / KNOWN_COST - 1.0).abs() > 1e-9 {
        return Err(format!(
            "the cost of a known cluster of lights is {cost}, and should be {KNOWN_COST}: this program chooses lights badly; build it anew, \
             and report what stays wrong"
        ));
    }
    super::alias::check()
}

/// A power of 3, half the surface of 1 × 2 × 3 twice, 22, twice for a length that is half of the greatest, and the cone: 2π times the integrals of sin t
/// to 0.5 and of cos(t − 0.5) sin t on to 1.5 (`scipy.integrate.quad`).
const KNOWN_COST: f64 = 3.0 * 22.0 * 2.0 * 4.912_268_111_708_228;

fn known_cone() -> LightBounds {
    LightBounds {
        axis: DVec3::Z,
        normals: 0.5,
        spread: 1.0,
        ..LightBounds::everywhere(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), 3.0)
    }
}

/// One of four lamps at the origin, or of three a hundred units along the axis, in turn; each group is twice as wide along the
/// next axis as along this one.
fn known_lamp(k: u32, axis: usize) -> LightBounds {
    let mut place = [0.0; 3];
    place[axis] = f64::from(k % 2) * 100.0 + f64::from(k / 2);
    place[(axis + 1) % 3] = 2.0 * f64::from(k / 2);
    let place = DVec3::from_array(place) + DVec3::new(7.0, -40.0, 300.0);
    LightBounds::everywhere(place, place + 0.5, f64::from(k + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;

    fn random_lights(count: usize) -> Vec<LightBounds> {
        let mut random = Pcg32::new(count as u64);
        let light = |_| {
            let place = 10.0 * random.in_cube();
            LightBounds {
                min: place,
                max: place + DVec3::splat(random.uniform()),
                power: 1.0 + random.uniform(),
                axis: random.direction(),
                normals: 0.5 * random.uniform(),
                spread: FRAC_PI_2,
                both_sides: random.below(2) == 0,
            }
        };
        (0..count).map(light).collect()
    }

    #[test]
    fn every_light_has_a_leaf_and_every_node_bounds_what_is_below_it() {
        for count in [1, 2, 3, 50, 300] {
            let mut lights = random_lights(count);
            if count == 50 {
                // All at one position: no basis for a split.
                let first = lights[0];
                lights
                    .iter_mut()
                    .for_each(|l| (l.min, l.max) = (first.min, first.max));
            }
            let (nodes, leaves) = light_tree(&lights);
            assert_eq!(nodes.len(), 2 * count);
            for (light, leaf) in leaves.iter().enumerate() {
                let mut node = *leaf as usize;
                assert_eq!((nodes[node].light as usize, nodes[node].child), (light, 0));
                let own = lights[light];
                while node != 0 {
                    let bounds = nodes[node].bounds;
                    assert!(bounds.min.cmple(own.min).all() && bounds.max.cmpge(own.max).all());
                    let apart = bounds.axis.dot(own.axis).clamp(-1.0, 1.0).acos();
                    assert!(apart + own.normals <= bounds.normals + 1e-6 || bounds.normals >= PI);
                    assert!(bounds.spread >= own.spread && bounds.both_sides >= own.both_sides);
                    let parent = nodes[node].parent as usize;
                    assert!(node == ROOT || nodes[parent].child as usize == node & !1);
                    let right = (node | 1).min(nodes.len() - 1);
                    let after = nodes[right].child as usize;
                    // Search for the leaf of a light as in kernels.
                    let found_left = *leaf as usize == node & !1
                        || (*leaf as usize != right && (after == 0 || (*leaf as usize) < after));
                    assert!(node == ROOT || found_left == (node & 1 == 0));
                    node = parent;
                }
            }
            let total: f64 = lights.iter().map(|l| l.power).sum();
            assert!((nodes[ROOT].bounds.power / total - 1.0).abs() < 1e-12);
        }
        assert!(light_tree(&[]).0.is_empty());
    }

    #[test]
    fn known_groups_are_parted() {
        assert_eq!(check_known(), Ok(()));
    }

    #[test]
    fn lamps_that_face_one_way_have_a_narrow_cone() {
        let mut random = Pcg32::new(3);
        let narrow = (0..1000).filter(|_| {
            let axis = random.direction();
            let (_, angle) = cone_union((axis, 0.0), (axis, 0.0));
            angle < 1e-6
        });
        assert_eq!(narrow.count(), 1000);
        let (_, opposite) = cone_union((DVec3::X, 0.0), (-DVec3::X, 0.0));
        assert_eq!(opposite, PI);
    }

    #[test]
    fn distant_groups_are_parted_first() {
        let mut lights = random_lights(40);
        let far = DVec3::new(1000.0, 0.0, 0.0);
        for light in &mut lights[..7] {
            (light.min, light.max) = (light.min + far, light.max + far);
        }
        let (nodes, leaves) = light_tree(&lights);
        let children = [nodes[ROOT].child, nodes[ROOT].child + 1];
        let top = |leaf: u32| {
            let mut node = leaf;
            while !children.contains(&node) {
                node = nodes[node as usize].parent;
            }
            node
        };
        assert!(leaves[..7].iter().all(|leaf| top(*leaf) == top(leaves[0])));
        assert!(leaves[7..].iter().all(|leaf| top(*leaf) != top(leaves[0])));
    }
}

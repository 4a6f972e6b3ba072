//! Nodes of a tree over rays: a ball that holds all origins, and a cap that holds all directions. CPU
//! version of `kernels/accel/ray_hierarchy/node.wesl`.
//!
//! Source: D. Roger, U. Assarsson, N. Holzschuch, "Whitted ray-tracing for dynamic scenes using a
//! ray-space hierarchy on the GPU", EGSR 2007, section 3; D. Roger's thesis, Grenoble 2008, sections
//! 3.3 and 3.4, of which only the set of rays of a node is taken: all (o, v) with |o − C| ≤ r and
//! ∠(v, d) ≤ α.
//!
//! **No test loses a hit.** A triangle test clamps its distance t into the slabs of the triangle's
//! box, each padded by 2⁻²¹ of itself ([`crate::triangle`]). With the roundings of a difference, a
//! product and a reciprocal of WGSL's 2.5 ulp, the point o + t·v lies in the box grown by 15·2⁻²⁴ of
//! its distances from o on each axis, so at most 9·10⁻⁷ (|P − o| + ρ) outside of a ball (P, ρ) around
//! the box: an angle of 9·10⁻⁷, or a length of that fraction of |P − C| + ρ + r. If o is in the ball and
//! v in the cap of a node, then C + t·v lies in (P, ρ + r), and the distance of P from the cone with
//! apex C is at most ρ + r. In f32, dot and cross products of unit vectors err by a few 2⁻²⁴ of |w|; a
//! sum of angles by 10·2⁻²⁴. Each of them is covered by the inflation, which is at least
//! [`LEAST_INFLATION`]: leaves, unions and tests are each wider by it. Squares of lengths below 1.1·10⁻¹⁹
//! may be 0, which [`LEAST`] covers.
//!
//! The centre of a union may be anywhere, since its radius is measured from where it was rounded to.

/// 67·2⁻²⁴: more than the growth of boxes and the roundings of a test together.
pub(crate) const LEAST_INFLATION: f64 = 4e-6;

const LEAST: f32 = 4.0e-19;
pub(crate) const FAR: f32 = 1.0e38;
const REMOTE: f32 = 1.0e17;

/// A node; lengths in scene units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Node {
    /// Centre of the ball of origins.
    pub centre: [f32; 3],
    /// Its radius; negative for a node without rays.
    pub radius: f32,
    /// Axis of the cap of directions, of length 1.
    pub axis: [f32; 3],
    /// Cosine of half its opening angle; −1 for all directions.
    pub cosine: f32,
    /// The sine.
    pub sine: f32,
    /// The farthest end of a ray, as a length from its origin.
    pub reach: f32,
}

/// What a node's tests depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounding {
    /// Relative widening of every angle, ball and test.
    pub inflation: f32,
    /// True if the space behind the apex is a ball, not a cone.
    pub exact_apex: bool,
}

impl Node {
    /// Half the opening angle, radians.
    pub(crate) fn angle(&self) -> f64 {
        f64::from(self.sine).atan2(f64::from(self.cosine))
    }

    fn cap(&self) -> [f32; 2] {
        [self.cosine, self.sine]
    }
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot3(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length3(a: [f32; 3]) -> f32 {
    dot3(a, a).sqrt()
}

fn cross3(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn greatest(a: [f32; 3]) -> f32 {
    let [x, y, z] = a.map(f32::abs);
    x.max(y).max(z)
}

pub(crate) fn no_rays() -> Node {
    Node {
        centre: [0.0; 3],
        radius: -1.0,
        axis: [1.0, 0.0, 0.0],
        cosine: 1.0,
        sine: 0.0,
        reach: 0.0,
    }
}

/// The node of one ray, of which `t_max` is the end that matters.
pub(crate) fn node_of_ray(
    origin: [f32; 3],
    direction: [f32; 3],
    t_max: f32,
    bounding: &Bounding,
) -> Node {
    let longest = greatest(direction);
    if longest == 0.0 {
        return no_rays();
    }
    if greatest(origin) > REMOTE {
        return Node {
            radius: 0.0,
            cosine: -1.0,
            reach: FAR,
            ..no_rays()
        };
    }
    let scaled = direction.map(|d| d / longest);
    let length = length3(scaled);
    let reach = t_max.min(FAR / longest.max(1.0)) * longest * length * (1.0 + bounding.inflation);
    Node {
        centre: origin,
        radius: 0.0,
        axis: scaled.map(|d| d / length),
        cosine: 1.0,
        sine: bounding.inflation,
        reach: reach.min(FAR),
    }
}

/// Cosine and sine of the sum of two angles.
fn sum_of(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0] * b[0] - a[1] * b[1], a[1] * b[0] + a[0] * b[1]]
}

/// Cosine and sine of the angle between two directions.
fn angle_between(a: [f32; 3], b: [f32; 3]) -> [f32; 2] {
    [dot3(a, b), length3(cross3(a, b))]
}

/// A node around the same centre and axis that holds `child` as well.
pub(crate) fn grown(node: Node, child: &Node) -> Node {
    let mut out = node;
    if child.radius < 0.0 {
        return out;
    }
    let away = length3(minus(child.centre, node.centre)) + child.radius;
    out.radius = node.radius.max(away);
    out.reach = node.reach.max(child.reach);
    let cap = child.cap();
    let apart = angle_between(node.axis, child.axis);
    let angle = sum_of(apart, cap);
    let is_full = node.cosine == -1.0 || cap[0] == -1.0 || angle[1] < 0.0;
    if is_full || (apart[0] < 0.0 && cap[0] < 0.0) {
        (out.cosine, out.sine) = (-1.0, 0.0);
    } else if angle[1] * node.cosine - angle[0] * node.sine > 0.0 {
        [out.cosine, out.sine] = angle;
    }
    out
}

/// The same node, wider than rounding has made it narrower.
pub(crate) fn inflated(node: Node, bounding: &Bounding) -> Node {
    let mut out = node;
    out.radius = node.radius * (1.0 + bounding.inflation) + LEAST;
    if node.cosine == -1.0 {
        return out;
    }
    let wide = sum_of(node.cap(), [1.0, bounding.inflation]);
    let size = (wide[0] * wide[0] + wide[1] * wide[1]).sqrt();
    [out.cosine, out.sine] = if wide[1] < 0.0 {
        [-1.0, 0.0]
    } else {
        wide.map(|x| x / size)
    };
    out
}

/// A node that holds nothing yet.
pub(crate) fn empty_around(centre: [f32; 3], axis: [f32; 3]) -> Node {
    Node {
        centre,
        axis,
        radius: 0.0,
        ..no_rays()
    }
}

/// The sum of directions as a direction, if it has one.
pub(crate) fn axis_of_sum(sum: [f32; 3]) -> [f32; 3] {
    let size = length3(sum);
    if size < 1.0e-3 {
        return [1.0, 0.0, 0.0];
    }
    sum.map(|x| x / size)
}

/// The centre of the smallest ball around two.
fn centre_of_pair(a: &Node, b: &Node) -> [f32; 3] {
    let between = minus(b.centre, a.centre);
    let distance = length3(between);
    if distance + b.radius <= a.radius || distance == 0.0 {
        return if b.radius <= a.radius {
            a.centre
        } else {
            b.centre
        };
    }
    if distance + a.radius <= b.radius {
        return b.centre;
    }
    let radius = 0.5 * (distance + a.radius + b.radius);
    let share = (radius - a.radius) / distance;
    std::array::from_fn(|i| a.centre[i] + between[i] * share)
}

/// The axis of the smallest cap around two: half of the angle that reaches beyond the first.
fn axis_of_pair(a: &Node, b: &Node) -> [f32; 3] {
    let apart = angle_between(a.axis, b.axis);
    let aside: [f32; 3] = std::array::from_fn(|i| b.axis[i] - apart[0] * a.axis[i]);
    let size = length3(aside);
    let beyond = sum_of(apart, b.cap());
    let turn = sum_of(beyond, [a.cosine, -a.sine]);
    let back = sum_of(sum_of(apart, a.cap()), [b.cosine, -b.sine]);
    if turn[1] <= 0.0 || size < 1.0e-6 {
        return a.axis;
    }
    if back[1] <= 0.0 {
        return b.axis;
    }
    // Cosine and sine of half of it, which is at most the angle between the axes.
    let half = [
        (0.5 * (1.0 + turn[0])).max(0.0).sqrt(),
        (0.5 * (1.0 - turn[0])).max(0.0).sqrt(),
    ];
    axis_of_sum(std::array::from_fn(|i| {
        half[0] * a.axis[i] + (half[1] / size) * aside[i]
    }))
}

/// The node around two.
pub(crate) fn pair(a: &Node, b: &Node, bounding: &Bounding) -> Node {
    if a.radius < 0.0 {
        return *b;
    }
    if b.radius < 0.0 {
        return *a;
    }
    let around = empty_around(centre_of_pair(a, b), axis_of_pair(a, b));
    inflated(grown(grown(around, a), b), bounding)
}

/// True if a ray of the node may meet a ball.
pub(crate) fn meets_ball(node: &Node, centre: [f32; 3], radius: f32, bounding: &Bounding) -> bool {
    let w = minus(centre, node.centre);
    let along = dot3(w, node.axis);
    let across = length3(cross3(w, node.axis));
    let reached = radius + node.radius;
    let slack = bounding.inflation * (along.abs() + across + reached) + LEAST;
    let distance = length3(w);
    if distance - reached > node.reach + slack {
        return false;
    }
    let side = across * node.cosine - along * node.sine;
    if bounding.exact_apex {
        let ahead = along * node.cosine + across * node.sine;
        // Inside. What lies straight behind a narrow cone is as near to its sides, which meet there.
        if side <= slack && along.max(ahead) >= -slack {
            return true;
        }
        if ahead < -slack {
            return distance <= reached + slack;
        }
    }
    side <= reached + slack
}

/// True if a ray of the node may meet a box: slabs with an interval of directions on each axis.
pub(crate) fn meets_box(node: &Node, low: [f32; 3], high: [f32; 3], bounding: &Bounding) -> bool {
    let inflation = bounding.inflation;
    let size: [f32; 3] = std::array::from_fn(|a| {
        let [low, high] = [low[a], high[a]].map(|x| (x - node.centre[a]).abs());
        low.max(high)
    });
    let slack = inflation * (size[0] + size[1] + size[2] + node.radius) + LEAST;
    let (mut enter, mut leave) = (0.0_f32, node.reach);
    for a in 0..3 {
        let near = low[a] - node.centre[a] - (node.radius + slack);
        let far = high[a] - node.centre[a] + (node.radius + slack);
        let (d, [b, c]) = (
            node.axis[a],
            [(a + 1) % 3, (a + 2) % 3].map(|i| node.axis[i] * node.axis[i]),
        );
        let aside = (b + c).sqrt() * node.sine;
        let most = if d >= node.cosine {
            1.0
        } else {
            d * node.cosine + aside
        } + inflation;
        let least = if -d >= node.cosine {
            -1.0
        } else {
            d * node.cosine - aside
        } - inflation;
        if (near > 0.0 && most <= 0.0) || (far < 0.0 && least >= 0.0) {
            return false;
        }
        if near > 0.0 {
            enter = enter.max(near / most);
        }
        if far < 0.0 {
            enter = enter.max(far / least);
        }
        if least > inflation {
            leave = leave.min(far / least);
        }
        if most < -inflation {
            leave = leave.min(near / most);
        }
    }
    enter <= leave + inflation * (enter + leave) + LEAST
}

//! All points of reflection in f64, without any code of the search.
//!
//! The plane has the vertex's mirror image. On spheres the points lie in the plane of eye, centre and vertex (Alhazen's
//! problem): the derivative of the path's length over the angle is bracketed and bisected. Other surfaces are
//! parametric here (the search has them as radial maps): every cell of a dense grid over which both derivatives
//! change sign, and every least gradient, begins Newton's method on the exact derivatives.

use crate::reflector::Shape;
use glam::{DVec2, DVec3};

/// Angles of a circle that are bracketed.
const ANGLES: usize = 2048;
/// Cells along each side of a chart.
const CELLS: usize = 64;
/// Half the width of a cube's chart: a little more than its face, so that no point lies on a seam.
const REACH: f64 = 1.04;
/// A point of reflection has less of both derivatives.
const EXACT: f64 = 1e-10;
/// Points that are nearer are one.
const ONE_POINT: f64 = 1e-6;
/// Radii of the torus, and how far its part turns about the axis.
const CORE: f64 = 1.5;
const TUBE: f64 = 0.6;

/// A point of reflection.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// The point.
    pub p: DVec3,
    /// The length of the path over it.
    pub length: f64,
    /// The cosine of the normal and the direction to the eye.
    pub to_eye: f64,
    /// The cosine of the normal and the direction to the vertex.
    pub to_vertex: f64,
}

/// A point of a chart, its derivatives along both parameters.
#[derive(Debug, Clone, Copy)]
struct Node {
    p: DVec3,
    s: DVec3,
    t: DVec3,
}

/// A node with the normal there, which all vertices share.
#[derive(Debug, Clone, Copy)]
struct Known {
    node: Node,
    n: DVec3,
}

/// A reflector with its charts.
pub struct Oracle {
    shape: Shape,
    amplitude: f64,
    frequency: f64,
    /// (CELLS + 1)² nodes of each chart; none where a closed form is known.
    charts: Vec<Vec<Known>>,
}

impl Oracle {
    /// A reflector; `amplitude` and `frequency` are those of bumps.
    pub fn new(shape: Shape, amplitude: f64, frequency: f64) -> Self {
        let mut oracle = Self {
            shape,
            amplitude,
            frequency,
            charts: Vec::new(),
        };
        let charts = match shape {
            Shape::Plane | Shape::Sphere | Shape::Concave => 0,
            Shape::Torus => 1,
            Shape::Ellipsoid | Shape::Bumpy => 6,
        };
        let side = CELLS + 1;
        oracle.charts = (0..charts)
            .map(|chart| {
                let node = |k: usize| {
                    let node = oracle.node(chart, oracle.place([k % side, k / side]));
                    let n = normal(&node);
                    Known { node, n }
                };
                (0..side * side).map(node).collect()
            })
            .collect();
        oracle
    }

    /// Parameters of a node of the grid.
    fn place(&self, at: [usize; 2]) -> DVec2 {
        let part = at.map(|k| 2.0 * k as f64 / CELLS as f64 - 1.0);
        DVec2::from(part) * self.reach()
    }

    fn reach(&self) -> DVec2 {
        match self.shape {
            Shape::Torus => DVec2::new(0.7_f64.acos(), std::f64::consts::PI),
            _ => DVec2::splat(REACH),
        }
    }

    fn node(&self, chart: usize, at: DVec2) -> Node {
        if self.shape == Shape::Torus {
            return torus_node(at);
        }
        let sign = if chart.is_multiple_of(2) { 1.0 } else { -1.0 };
        let axis = chart / 2;
        let turned = |v: [f64; 3]| {
            let mut out = [0.0; 3];
            for (k, value) in v.into_iter().enumerate() {
                out[(axis + k) % 3] = value;
            }
            DVec3::from(out)
        };
        let d = turned([sign, at.x, at.y]);
        let length = d.length();
        let u = d / length;
        let across = |v: DVec3| (v - u * u.dot(v)) / length;
        let (us, ut) = (
            across(turned([0.0, 1.0, 0.0])),
            across(turned([0.0, 0.0, 1.0])),
        );
        if self.shape == Shape::Ellipsoid {
            let axes = DVec3::new(0.5, 1.0, 0.25);
            return Node {
                p: u * axes,
                s: us * axes,
                t: ut * axes,
            };
        }
        let (a, f) = (self.amplitude, self.frequency);
        let angles = [f * u.x + 0.4, f * u.y - 0.3, f * u.z];
        let [x, y, z] = angles.map(f64::cos);
        let [dx, dy, dz] = angles.map(|angle| -f * angle.sin());
        let r = 1.0 + a * x * y * z;
        let along = |v: DVec3| a * (dx * y * z * v.x + x * dy * z * v.y + x * y * dz * v.z);
        Node {
            p: u * r,
            s: u * along(us) + us * r,
            t: u * along(ut) + ut * r,
        }
    }

    /// Chart and parameters of a point of the surface.
    fn chart_of(&self, p: DVec3) -> (usize, DVec2) {
        if self.shape == Shape::Torus {
            let core = p.z.hypot(p.y + CORE);
            let turn = p.z.atan2(p.y + CORE);
            return (0, DVec2::new(turn, p.x.atan2(core - CORE)));
        }
        let d = match self.shape {
            Shape::Ellipsoid => p / DVec3::new(0.5, 1.0, 0.25),
            _ => p,
        };
        let size = d.abs().to_array();
        let axis = (0..3).fold(0, |best, k| if size[k] > size[best] { k } else { best });
        let d = d.to_array();
        let at = DVec2::new(d[(axis + 1) % 3], d[(axis + 2) % 3]) / size[axis];
        (2 * axis + usize::from(d[axis] < 0.0), at)
    }

    /// All points of reflection that eye and vertex see from the right side, the shortest path first.
    pub fn points(&self, eye: DVec3, vertex: DVec3) -> Vec<Point> {
        let places = match self.shape {
            Shape::Plane => {
                let image = DVec3::new(2.0 - vertex.x, vertex.y, vertex.z);
                let part = (1.0 - eye.x) / (image.x - eye.x);
                vec![eye + (image - eye) * part]
            }
            Shape::Sphere | Shape::Concave => on_circle(eye, vertex),
            _ => self.on_charts(eye, vertex),
        };
        let mut points: Vec<Point> = Vec::new();
        for p in places {
            let point = self.point(eye, vertex, p);
            let is_new = points.iter().all(|known| known.p.distance(p) > ONE_POINT);
            if is_new && point.to_eye > 0.0 && point.to_vertex > 0.0 && self.holds(p) {
                points.push(point);
            }
        }
        points.sort_by(|a, b| a.length.total_cmp(&b.length));
        points
    }

    fn point(&self, eye: DVec3, vertex: DVec3, p: DVec3) -> Point {
        let n = match self.shape {
            Shape::Plane => DVec3::X,
            Shape::Sphere => p.normalize(),
            Shape::Concave => -p.normalize(),
            _ => {
                let (chart, at) = self.chart_of(p);
                normal(&self.node(chart, at))
            }
        };
        Point {
            p,
            length: p.distance(eye) + p.distance(vertex),
            to_eye: n.dot((eye - p).normalize()),
            to_vertex: n.dot((vertex - p).normalize()),
        }
    }

    fn holds(&self, p: DVec3) -> bool {
        match self.shape {
            Shape::Concave => p.x <= -0.2,
            Shape::Torus => (p.y + CORE) >= 0.7 * p.z.hypot(p.y + CORE),
            _ => true,
        }
    }

    fn on_charts(&self, eye: DVec3, vertex: DVec3) -> Vec<DVec3> {
        let side = CELLS + 1;
        let mut found = Vec::new();
        for (chart, nodes) in self.charts.iter().enumerate() {
            let felt: Vec<Option<(DVec2, f64)>> =
                nodes.iter().map(|node| felt(eye, vertex, node)).collect();
            for row in 0..side {
                for column in 0..side {
                    let begins = is_least(&felt, [column, row]) || changes(&felt, [column, row]);
                    let at = self.place([column, row]);
                    if let Some(p) = begins
                        .then(|| self.polished(eye, vertex, chart, at))
                        .flatten()
                    {
                        found.push(p);
                    }
                }
            }
        }
        found
    }

    /// Newton's method on both derivatives of the length.
    fn polished(&self, eye: DVec3, vertex: DVec3, chart: usize, mut at: DVec2) -> Option<DVec3> {
        let limit = self.reach() * 1.2;
        let derivatives = |at: DVec2| pulls(eye, vertex, &self.node(chart, at)).0;
        for _ in 0..40 {
            let here = derivatives(at);
            if here.abs().max_element() < EXACT {
                return Some(self.node(chart, at).p);
            }
            let h = 1e-6;
            let [x, y] = [DVec2::X, DVec2::Y]
                .map(|axis| (derivatives(at + axis * h) - derivatives(at - axis * h)) / (2.0 * h));
            let determinant = x.x * y.y - x.y * y.x;
            let step =
                DVec2::new(here.x * y.y - here.y * y.x, here.y * x.x - here.x * x.y) / -determinant;
            if !step.is_finite() {
                return None;
            }
            at += step.clamp_length_max(0.05);
            if at.abs().cmpgt(limit).any() {
                return None;
            }
        }
        None
    }

    /// The point of reflection to which one moves when eye or vertex move a little.
    pub fn follow(&self, eye: DVec3, vertex: DVec3, near: DVec3) -> Option<DVec3> {
        if !self.charts.is_empty() {
            let (chart, at) = self.chart_of(near);
            return self.polished(eye, vertex, chart, at);
        }
        let points = self.points(eye, vertex).into_iter().map(|point| point.p);
        points.min_by(|a, b| a.distance(near).total_cmp(&b.distance(near)))
    }
}

fn torus_node(at: DVec2) -> Node {
    let ((turn_sine, turn), (sine, cosine)) = (at.x.sin_cos(), at.y.sin_cos());
    let core = CORE + TUBE * cosine;
    Node {
        p: DVec3::new(TUBE * sine, core * turn - CORE, core * turn_sine),
        s: DVec3::new(0.0, -core * turn_sine, core * turn),
        t: DVec3::new(TUBE * cosine, -TUBE * sine * turn, -TUBE * sine * turn_sine),
    }
}

/// The outward normal; the surfaces here are star-shaped about the origin.
fn normal(node: &Node) -> DVec3 {
    let n = node.s.cross(node.t).normalize();
    if n.dot(node.p) < 0.0 { -n } else { n }
}

/// Derivatives of the path's length along both parameters, for steps of length 1, and its gradient in space.
fn pulls(eye: DVec3, vertex: DVec3, node: &Node) -> (DVec2, DVec3) {
    let e = (node.p - eye).normalize() + (node.p - vertex).normalize();
    let along = DVec2::new(
        e.dot(node.s) / node.s.length(),
        e.dot(node.t) / node.t.length(),
    );
    (along, e)
}

/// Derivatives and the squared gradient along the surface; nothing where the surface faces away from the eye.
fn felt(eye: DVec3, vertex: DVec3, known: &Known) -> Option<(DVec2, f64)> {
    let Known { node, n } = *known;
    // A little beyond the silhouette, so that points at it have neighbours.
    if n.dot(eye - node.p) < -0.4 {
        return None;
    }
    let (along, e) = pulls(eye, vertex, &node);
    Some((along, (e - n * n.dot(e)).length_squared()))
}

/// Whether no neighbour of a node has less gradient.
fn is_least(felt: &[Option<(DVec2, f64)>], at: [usize; 2]) -> bool {
    let side = CELLS + 1;
    let Some((_, here)) = felt[at[0] + side * at[1]] else {
        return false;
    };
    let near = |k: usize| k.saturating_sub(1)..=(k + 1).min(CELLS);
    near(at[1]).all(|row| {
        near(at[0]).all(|column| felt[column + side * row].is_none_or(|(_, other)| other >= here))
    })
}

/// Whether both derivatives change sign over the cell that begins at a node.
fn changes(felt: &[Option<(DVec2, f64)>], at: [usize; 2]) -> bool {
    let side = CELLS + 1;
    if at[0] == CELLS || at[1] == CELLS {
        return false;
    }
    let corners = [0, 1, side, side + 1].map(|step| felt[at[0] + side * at[1] + step]);
    let [Some(a), Some(b), Some(c), Some(d)] = corners else {
        return false;
    };
    let all = [a.0, b.0, c.0, d.0];
    let over = |value: fn(&DVec2) -> f64| {
        all.iter().any(|g| value(g) <= 0.0) && all.iter().any(|g| value(g) >= 0.0)
    };
    over(|g| g.x) && over(|g| g.y)
}

/// Points of the unit sphere at which the law of reflection holds, on either side.
fn on_circle(eye: DVec3, vertex: DVec3) -> Vec<DVec3> {
    let first = eye.normalize();
    let across = vertex - first * first.dot(vertex);
    let second = if across.length() > 1e-12 {
        across.normalize()
    } else {
        first.any_orthonormal_vector()
    };
    let p = |angle: f64| first * angle.cos() + second * angle.sin();
    let derivative = |angle: f64| {
        let tangent = second * angle.cos() - first * angle.sin();
        let p = p(angle);
        tangent.dot((p - eye).normalize() + (p - vertex).normalize())
    };
    // No sample lies on the axis of eye and centre, which may be a root.
    let angle = |k: usize| std::f64::consts::TAU * (k as f64 + 0.37) / ANGLES as f64;
    let mut found = Vec::new();
    for k in 0..ANGLES {
        let (mut low, mut high) = (angle(k), angle(k + 1));
        let sign = derivative(low) > 0.0;
        if sign == (derivative(high) > 0.0) {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (derivative(middle) > 0.0) == sign {
                low = middle;
            } else {
                high = middle;
            }
        }
        found.push(p(0.5 * (low + high)));
    }
    found
}

//! `integrand:*`: functions on the unit square with known integrals, instead of light. They trace
//! nothing, so errors and slopes of samplers are measured in seconds. CPU version of
//! `kernels/integrator/integrand.wesl`.
//!
//! A smooth function shows the best case of a sampler (slope −1.5 of the RMSE for Owen scrambling),
//! a discontinuous one the effect of an edge (about −0.75 for all low-discrepancy points, Owen's
//! lectures "Monte Carlo theory, methods and examples", ch. 17).

use super::{Integrator, IntegratorFacts};
use raystone_core::parameters;
use raystone_core::params::{ParameterSchema, Parameters as _, Params};
use raystone_sampling::dimensions;

/// Squared radius of the disk, so that its quarter has about the area 1/2.
const DISK_RADIUS_SQUARED: f32 = std::f32::consts::FRAC_2_PI;
const BOX_CORNER: [f32; 2] = [std::f32::consts::FRAC_1_SQRT_2, 0.618_034];
/// `half-plane`: x · cos + y · sin < offset.
const OBLIQUE_EDGE: [f32; 3] = [-0.6, 0.8, 0.2];

parameters! {
    /// Parameters of `heaviside`.
    struct Edge {
        /// angle of the edge's normal to the x axis, degrees
        angle: f64 = 30.0, in 0.0..=360.0;
    }
}

// Function numbers in the kernel.
const EXPONENTIAL: u32 = 0;
const GAUSSIAN: u32 = 1;
const DISK: u32 = 2;
const CORNER_BOX: u32 = 3;
const HALF_PLANE: u32 = 4;

/// A function on the unit square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Function {
    /// e^(x + y): smooth, not periodic.
    Exponential,
    /// e^(−x² − y²): smooth.
    Gaussian,
    /// 1 inside the quarter of a disk.
    Disk,
    /// 1 in a box with one corner at the origin, as in the definition of D*.
    CornerBox,
    /// 1 on one side of an edge: x · cos + y · sin < offset.
    HalfPlane([f32; 3]),
}

impl Function {
    /// An edge through the centre, with its normal at `degrees` from the x axis.
    pub(crate) fn heaviside(degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let [cos, sin] = [cos as f32, sin as f32];
        Self::HalfPlane([cos, sin, 0.5 * (cos + sin)])
    }

    /// CPU version of the kernel's `evaluate`.
    pub fn evaluate(&self, [x, y]: [f32; 2]) -> f32 {
        let indicator = |inside: bool| f32::from(u8::from(inside));
        match self {
            Self::Exponential => exponential(x) * exponential(y),
            Self::Gaussian => exponential(-(x * x)) * exponential(-(y * y)),
            Self::Disk => indicator(x * x + y * y < DISK_RADIUS_SQUARED),
            Self::CornerBox => indicator(x < BOX_CORNER[0] && y < BOX_CORNER[1]),
            Self::HalfPlane([a, b, offset]) => indicator(x * a + y * b < *offset),
        }
    }

    /// The exact function, in double precision.
    pub fn value(&self, [x, y]: [f64; 2]) -> f64 {
        let indicator = |inside: bool| f64::from(u8::from(inside));
        match self {
            Self::Exponential => (x + y).exp(),
            Self::Gaussian => (-x * x - y * y).exp(),
            Self::Disk => indicator(x * x + y * y < f64::from(DISK_RADIUS_SQUARED)),
            Self::CornerBox => {
                let [a, b] = BOX_CORNER.map(f64::from);
                indicator(x < a && y < b)
            }
            Self::HalfPlane(edge) => {
                let [a, b, offset] = edge.map(f64::from);
                indicator(x * a + y * b < offset)
            }
        }
    }

    /// The integral over the unit square, in double precision.
    pub fn integral(&self) -> f64 {
        match self {
            Self::Exponential => (std::f64::consts::E - 1.0).powi(2),
            // (√π/2 · erf 1)².
            Self::Gaussian => 0.557_746_285_351_033_7,
            Self::Disk => std::f64::consts::FRAC_PI_4 * f64::from(DISK_RADIUS_SQUARED),
            Self::CornerBox => f64::from(BOX_CORNER[0]) * f64::from(BOX_CORNER[1]),
            Self::HalfPlane(edge) => half_plane_area(edge.map(f64::from)),
        }
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        let (function, edge) = match self {
            Self::Exponential => (EXPONENTIAL, [0.0; 3]),
            Self::Gaussian => (GAUSSIAN, [0.0; 3]),
            Self::Disk => (DISK, [0.0; 3]),
            Self::CornerBox => (CORNER_BOX, [0.0; 3]),
            Self::HalfPlane(edge) => (HALF_PLANE, *edge),
        };
        vec![
            ("FUNCTION", function),
            ("EDGE_X", edge[0].to_bits()),
            ("EDGE_Y", edge[1].to_bits()),
            ("EDGE_OFFSET", edge[2].to_bits()),
        ]
    }
}

/// CPU version of the kernel's `exponential`.
fn exponential(x: f32) -> f32 {
    let h = x * 0.25;
    let mut sum = 1.0_f32;
    for k in (1..=8).rev() {
        sum = 1.0 + h * sum / k as f32;
    }
    let squared = sum * sum;
    squared * squared
}

/// Area of the part of the unit square where x · a + y · b < offset, by clipping.
fn half_plane_area([a, b, offset]: [f64; 3]) -> f64 {
    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let side = |p: [f64; 2]| offset - a * p[0] - b * p[1];
    let mut kept = Vec::new();
    for (i, &p) in SQUARE.iter().enumerate() {
        let q = SQUARE[(i + 1) % 4];
        let (sp, sq) = (side(p), side(q));
        if sp > 0.0 {
            kept.push(p);
        }
        if (sp > 0.0) != (sq > 0.0) {
            let t = sp / (sp - sq);
            kept.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
        }
    }
    let cross = |(i, p): (usize, &[f64; 2])| {
        let q = kept[(i + 1) % kept.len()];
        p[0] * q[1] - p[1] * q[0]
    };
    0.5 * kept.iter().enumerate().map(cross).sum::<f64>()
}

pub(super) struct Integrand {
    name: &'static str,
    description: &'static str,
    /// The function; `None` for the edge at the angle of the parameter.
    function: Option<Function>,
}

/// The registry entries, in the order of `raystone list`.
pub(super) static INTEGRANDS: [Integrand; 6] = [
    Integrand {
        name: "integrand:exponential",
        description: "e^(x + y) on the unit square: smooth; traces nothing, the exact value is the reference",
        function: Some(Function::Exponential),
    },
    Integrand {
        name: "integrand:gaussian",
        description: "e^(−x² − y²) on the unit square: smooth",
        function: Some(Function::Gaussian),
    },
    Integrand {
        name: "integrand:disk",
        description: "quarter of a disk: a curved edge",
        function: Some(Function::Disk),
    },
    Integrand {
        name: "integrand:half-plane",
        description: "half-plane y < 0.25 + 0.75 x: a straight oblique edge",
        function: Some(Function::HalfPlane(OBLIQUE_EDGE)),
    },
    Integrand {
        name: "integrand:corner-box",
        description: "box with a corner at the origin: the kind of error whose worst case is D*",
        function: Some(Function::CornerBox),
    },
    Integrand {
        name: "integrand:heaviside",
        description: "edge through the centre at an angle",
        function: None,
    },
];

/// Every function by its name without `integrand:`, in the order of `raystone list`.
pub fn functions() -> Vec<(&'static str, Function)> {
    let function = |integrand: &'static Integrand| {
        let function = integrand
            .function
            .unwrap_or(Function::heaviside(Edge::default().angle));
        (integrand.name.trim_start_matches("integrand:"), function)
    };
    INTEGRANDS.iter().map(function).collect()
}

impl Integrand {
    fn function(&self, params: &Params) -> Function {
        self.function
            .unwrap_or_else(|| Function::heaviside(Edge::from_checked(params).angle))
    }
}

impl Integrator for Integrand {
    fn name(&self) -> &'static str {
        self.name
    }

    fn description(&self) -> &'static str {
        self.description
    }

    fn kernel(&self) -> &'static str {
        "integrator/integrand"
    }

    fn parameters(&self) -> ParameterSchema {
        match self.function {
            Some(_) => Vec::new(),
            None => Edge::schema(),
        }
    }

    fn constants(&self, params: &Params) -> Vec<(&'static str, u32)> {
        self.function(params).constants()
    }

    fn facts(&self, params: &Params) -> IntegratorFacts {
        IntegratorFacts {
            dimensions: dimensions::FIRST_BOUNCE,
            exact: Some(self.function(params).integral()),
            ..Default::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn functions() -> Vec<Function> {
        let angles = [0.0, 30.0, 45.0, 90.0, 137.5, 200.0, 300.0];
        let mut all: Vec<_> = INTEGRANDS.iter().filter_map(|i| i.function).collect();
        assert_eq!(all.len(), INTEGRANDS.len() - 1);
        all.extend(angles.map(Function::heaviside));
        all
    }

    #[test]
    fn integrals_equal_the_midpoint_rule() {
        const N: usize = 1000;
        let at = |i: usize| (i as f32 + 0.5) / N as f32;
        for function in functions() {
            let mut sums = [0.0; 2];
            for point in (0..N * N).map(|k| [at(k % N), at(k / N)]) {
                sums[0] += f64::from(function.evaluate(point));
                sums[1] += function.value(point.map(f64::from));
            }
            let exact = function.integral();
            for found in sums.map(|sum| sum / (N * N) as f64) {
                assert!(
                    (found - exact).abs() < 1e-3,
                    "{function:?}: {found} {exact}"
                );
            }
        }
    }

    #[test]
    fn the_series_is_the_exponential_function_to_two_ulp() {
        for i in 0..=4000 {
            let x = i as f32 / 2000.0 - 1.0;
            let exact = f64::from(x).exp();
            let error = (f64::from(exponential(x)) - exact).abs() / exact;
            assert!(error < 5e-7, "e^{x}: relative error {error}");
        }
    }

    #[test]
    fn an_edge_through_the_centre_halves_the_square() {
        for degrees in [0.0, 12.0, 45.0, 90.0, 170.0, 359.0] {
            let area = Function::heaviside(degrees).integral();
            assert!((area - 0.5).abs() < 1e-6, "{degrees}: {area}");
        }
        assert!((half_plane_area([1.0, 0.0, 0.25]) - 0.25).abs() < 1e-15);
    }
}

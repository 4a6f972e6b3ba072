//! Lights: what shines on a scene. Emission of surfaces is a matter of their materials; the lights here are
//! those without triangles. A kind of light is a kernel in `kernels/shading/light/` with its lines in the table of kernels,
//! `kernels/shading/lights.wesl`, a row of [`LIGHT_KINDS`] with what [`Light`] holds of it, its rows of
//! `shading_tables` (`src/render/light_tables.rs`), and the row of its checks in `src/verify/lights/`. One from outside the program is
//! a [`Light::Other`] of a kind of its own: two rows and a kernel. How the parts fit: `docs/shading.md`.

mod kind;
mod list;

pub use kind::{LIGHT_KINDS, LightKind};
pub use list::{LightList, ListedLight, Parallelogram, Source};

use super::{EnvironmentMap, IesProfile};
use glam::{DVec3, Quat, Vec3};
use std::sync::Arc;

/// A light that has no triangles. Colours are linear RGB in the radiance unit of the scene (times its unit of length
/// squared for intensities).
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// A sphere that emits the same radiance everywhere, and reflects nothing. Rays see it, and it casts shadows.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius, above 0.
        radius: f32,
        /// Radiance of its surface, towards outside and inside.
        radiance: Vec3,
    },
    /// A point that emits evenly.
    Point {
        /// Place.
        position: Vec3,
        /// Radiant intensity, per steradian.
        intensity: Vec3,
    },
    /// A point that emits into a cone.
    Spot {
        /// Place.
        position: Vec3,
        /// Axis of the cone, away from the light; of any length above 0.
        direction: Vec3,
        /// Radiant intensity on the axis, per steradian; without decay the irradiance at any distance.
        intensity: Vec3,
        /// Angle from the axis up to which it shines in full, radians.
        inner: f32,
        /// Angle from the axis from which it is dark, radians, at least `inner` and at most π.
        outer: f32,
        /// Whether light falls off with the square of the distance.
        decay: bool,
    },
    /// A point with the measured intensities of a luminaire.
    Ies {
        /// Place.
        position: Vec3,
        /// Takes the axes of [`IesProfile`] to those of the scene; of length 1.
        rotation: Quat,
        /// What multiplies the candela of the profile.
        color: Vec3,
        /// The measured intensities.
        profile: Arc<IesProfile>,
    },
    /// Radiance from all around, in the place of a constant one. A scene has one at most.
    Environment {
        /// Radiance by direction.
        map: Arc<EnvironmentMap>,
        /// What multiplies it.
        scale: f32,
        /// By how much it is turned about +y, radians, counter-clockwise seen from above.
        turn: f32,
    },
    /// Light from infinitely far away.
    Directional {
        /// Where the light travels; of any length above 0.
        direction: Vec3,
        /// Irradiance of a surface that faces it.
        irradiance: Vec3,
    },
    /// A point of a kind from outside the program, which no ray can find. Lights are chosen as if it shone evenly.
    Other {
        /// The kind.
        kind: &'static LightKind,
        /// Place.
        position: Vec3,
        /// Where it points, in `c.xyz` of the kernel's `Light`.
        direction: Vec3,
        /// What scales it.
        color: Vec3,
        /// Numbers that only this kind has: `a.w`, `b.w` and `c.w`.
        parameters: [f32; 3],
    },
}

/// Relative luminance of linear sRGB, by which lights are weighed.
pub(crate) fn luminance(c: Vec3) -> f64 {
    let [r, g, b] = c.to_array().map(f64::from);
    0.212_671 * r + 0.715_160 * g + 0.072_169 * b
}

impl Light {
    /// Its row in [`LIGHT_KINDS`].
    pub fn kind(&self) -> &'static LightKind {
        match self {
            Self::Sphere { .. } => &kind::SPHERE,
            Self::Point { .. } => &kind::POINT,
            Self::Spot { .. } => &kind::SPOT,
            Self::Ies { .. } => &kind::IES,
            Self::Directional { .. } => &kind::DIRECTIONAL,
            Self::Environment { .. } => &kind::ENVIRONMENT,
            Self::Other { kind, .. } => kind,
        }
    }

    /// Radiance, intensity or irradiance: what scales it.
    pub fn color(&self) -> Vec3 {
        match self {
            Self::Sphere { radiance, .. } => *radiance,
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => *intensity,
            Self::Ies { color, .. } | Self::Other { color, .. } => *color,
            Self::Directional { irradiance, .. } => *irradiance,
            Self::Environment { scale, .. } => Vec3::splat(*scale),
        }
    }

    /// The middle and the radius of what shines; nothing at infinity.
    pub fn place(&self) -> Option<(Vec3, f32)> {
        match self {
            Self::Sphere { center, radius, .. } => Some((*center, *radius)),
            Self::Point { position, .. }
            | Self::Spot { position, .. }
            | Self::Ies { position, .. }
            | Self::Other { position, .. } => Some((*position, 0.0)),
            Self::Directional { .. } | Self::Environment { .. } => None,
        }
    }

    /// Whether it has no place: no tree over places can hold it.
    pub fn is_infinite(&self) -> bool {
        self.place().is_none()
    }

    /// The same light turned about the origin and then moved. Maps turn about one axis alone: they stay as they are.
    #[must_use]
    pub fn moved(mut self, turn: Quat, by: Vec3) -> Self {
        match &mut self {
            Self::Sphere {
                center: position, ..
            }
            | Self::Point { position, .. } => *position = turn * *position + by,
            Self::Spot {
                position,
                direction,
                ..
            }
            | Self::Other {
                position,
                direction,
                ..
            } => (*position, *direction) = (turn * *position + by, turn * *direction),
            Self::Ies {
                position, rotation, ..
            } => {
                *position = turn * *position + by;
                *rotation = (turn * *rotation).normalize();
            }
            Self::Directional { direction, .. } => *direction = turn * *direction,
            Self::Environment { .. } => {}
        }
        self
    }

    /// Luminous power in a scene whose bounding sphere has this radius: what lights are chosen by. Without decay and for
    /// lights at infinity, that of what falls on the sphere's disk.
    pub fn power(&self, scene_radius: f64) -> f64 {
        use std::f64::consts::{PI, TAU};
        let color = luminance(self.color());
        let disk = PI * scene_radius * scene_radius;
        match self {
            Self::Sphere { radius, .. } => 4.0 * PI * PI * f64::from(*radius).powi(2) * color,
            Self::Point { .. } | Self::Other { .. } => 4.0 * PI * color,
            Self::Spot {
                inner,
                outer,
                decay,
                ..
            } => {
                // The square of a linear step between the cosines has a mean of a third.
                let [inner, outer] = [inner, outer].map(|angle| f64::from(*angle).cos());
                let flux = TAU * ((1.0 - inner) + (inner - outer) / 3.0) * color;
                if *decay {
                    flux
                } else {
                    flux * scene_radius * scene_radius
                }
            }
            Self::Ies { profile, .. } => profile.lumens() * color,
            Self::Directional { .. } => disk * color,
            Self::Environment { map, scale, .. } => {
                disk * f64::from(*scale) * map.weights().iter().sum::<f64>()
            }
        }
    }

    /// What is wrong with it, if it cannot shine as it is.
    pub fn problem(&self) -> Option<String> {
        let finite = |v: &Vec3| v.is_finite();
        let color = self.color();
        if !finite(&color) {
            return Some(format!("its {} is not finite", self.kind().color));
        }
        if color.min_element() < 0.0 {
            return Some(format!("its {} is negative", self.kind().color));
        }
        let is_axis = |v: &Vec3| finite(v) && v.as_dvec3().normalize_or_zero() != DVec3::ZERO;
        let placed = |v: &Vec3| finite(v).then_some(()).ok_or("its place is not finite");
        let aimed = |v: &Vec3| is_axis(v).then_some(()).ok_or("its direction is none");
        let found = match self {
            Self::Sphere { center, radius, .. } => placed(center).and({
                let fits = radius.is_finite() && *radius > 0.0;
                fits.then_some(()).ok_or("its radius is not above 0")
            }),
            Self::Point { position, .. } | Self::Other { position, .. } => placed(position),
            Self::Spot {
                position,
                direction,
                inner,
                outer,
                ..
            } => placed(position).and(aimed(direction)).and({
                let fits = *inner >= 0.0 && inner <= outer && *outer <= std::f32::consts::PI;
                fits.then_some(())
                    .ok_or("its cone is none: 0 ≤ inner ≤ outer ≤ π does not hold")
            }),
            Self::Ies {
                position, rotation, ..
            } => placed(position).and(
                (rotation.is_finite() && rotation.is_normalized())
                    .then_some(())
                    .ok_or("its rotation is none"),
            ),
            Self::Directional { direction, .. } => aimed(direction),
            Self::Environment { turn, .. } => {
                (turn.is_finite().then_some(())).ok_or("its turn is not finite")
            }
        };
        found.err().map(str::to_owned)
    }
}

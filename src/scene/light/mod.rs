//! Lights without triangles; surfaces emit by their materials. A kind of light consists of a kernel
//! in `kernels/shading/light/` with its lines in the table of kernels,
//! `kernels/shading/lights.wesl`; an entry of [`LIGHT_KINDS`] with its variant of [`Light`]; its
//! rows of `shading_tables` (`src/render/light_tables.rs`); and its checks in `src/verify/lights/`.
//! A kind from outside the program is a [`Light::Other`]: two rows and a kernel. Overview:
//! `docs/shading.md`.

mod kind;
mod list;

pub use kind::{LIGHT_KINDS, LightKind};
pub use list::{LightList, ListedLight, Parallelogram, Source};

use super::{EnvironmentMap, IesProfile};
use glam::{DVec3, Quat, Vec3};
use std::sync::Arc;

/// A light without triangles. Colours are linear RGB in the scene's radiance unit (times its length
/// unit squared for intensities).
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// A sphere with constant radiance that reflects nothing. Visible to rays, and casts shadows.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius, positive.
        radius: f32,
        /// Radiance of its surface, outwards and inwards.
        radiance: Vec3,
    },
    /// An isotropic point light.
    Point {
        /// Position.
        position: Vec3,
        /// Radiant intensity, per steradian.
        intensity: Vec3,
    },
    /// A point light with a cone.
    Spot {
        /// Position.
        position: Vec3,
        /// Axis of the cone, away from the light; any non-zero length.
        direction: Vec3,
        /// Radiant intensity on the axis, per steradian; without decay, irradiance at any distance.
        intensity: Vec3,
        /// Angle from the axis up to which it has full intensity, radians.
        inner: f32,
        /// Angle from the axis beyond which it is dark, radians, between `inner` and π.
        outer: f32,
        /// True for inverse-square falloff.
        decay: bool,
    },
    /// A point light with a luminaire's measured intensities.
    Ies {
        /// Position.
        position: Vec3,
        /// Rotates the axes of [`IesProfile`] to the scene's; unit length.
        rotation: Quat,
        /// Multiplier of the profile's candela.
        color: Vec3,
        /// The measured intensities.
        profile: Arc<IesProfile>,
    },
    /// Radiance from all directions, replacing a constant one. At most one per scene.
    Environment {
        /// Radiance by direction.
        map: Arc<EnvironmentMap>,
        /// Multiplier of the radiance.
        scale: f32,
        /// Rotation about +y, radians, counter-clockwise seen from above.
        turn: f32,
    },
    /// A light at infinity.
    Directional {
        /// Direction the light travels; any non-zero length.
        direction: Vec3,
        /// Irradiance of a surface facing it.
        irradiance: Vec3,
    },
    /// A point light of an outside kind, invisible to rays; isotropic for light selection.
    Other {
        /// The kind.
        kind: &'static LightKind,
        /// Position.
        position: Vec3,
        /// Its direction, `c.xyz` of the kernel's `Light`.
        direction: Vec3,
        /// Its colour.
        color: Vec3,
        /// Parameters specific to its kind: `a.w`, `b.w` and `c.w`.
        parameters: [f32; 3],
    },
}

/// Relative luminance of linear sRGB, the weight of lights.
pub(crate) fn luminance(c: Vec3) -> f64 {
    let [r, g, b] = c.to_array().map(f64::from);
    0.212_671 * r + 0.715_160 * g + 0.072_169 * b
}

impl Light {
    /// Its entry in [`LIGHT_KINDS`].
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

    /// Radiance, intensity or irradiance scale.
    pub fn color(&self) -> Vec3 {
        match self {
            Self::Sphere { radiance, .. } => *radiance,
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => *intensity,
            Self::Ies { color, .. } | Self::Other { color, .. } => *color,
            Self::Directional { irradiance, .. } => *irradiance,
            Self::Environment { scale, .. } => Vec3::splat(*scale),
        }
    }

    /// Centre and radius of the emitter; `None` at infinity.
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

    /// True if it is at infinity: no spatial tree can contain it.
    pub fn is_infinite(&self) -> bool {
        self.place().is_none()
    }

    /// The light rotated about the origin, then translated; maps stay unchanged.
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

    /// Luminous power in a scene with this bounding radius, the weight for light selection. Without
    /// decay and at infinity, the power that reaches the sphere's disk.
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
                // The square of a linear ramp between the cosines has mean 1/3.
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

    /// The problem of a light that cannot shine.
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

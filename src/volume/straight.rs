//! Media in which light travels straight, as a path tracer reads them. Kernel: `kernels/integrator/medium.wesl`.

use crate::files::{Grid, read_grid};
use crate::medium::pack_halves;
use crate::volume::voxel_at;
use crate::{Homogeneity, MediaError, Medium, Volume, procedures, structure};
use glam::Vec2;
use std::path::Path;

/// The share of the greatest extinction by which extinctions in a region may differ: wider regions cost collisions
/// that are none, narrower ones steps.
const EPSILON: f64 = 0.2;

/// A volume of index 1 with a structure over it. In the place of n is σ_s; both are shares of the greatest extinction,
/// which half floats hold whatever the unit of length is.
#[derive(Clone)]
pub struct Straight {
    /// σ_s and σ of each voxel as shares, and their bounds.
    pub medium: Medium,
    /// The greatest extinction, per unit of length.
    pub density: f32,
}

impl Straight {
    /// Builds the structure of this name over a volume.
    ///
    /// # Errors
    /// The volume refracts, or there is no such structure.
    pub fn new(volume: &Volume, name: &str) -> Result<Self, MediaError> {
        check_straight(volume)?;
        let known = structure::registry();
        let found = known.find(name).ok_or_else(|| MediaError::Unknown {
            what: "structure over volumes",
            name: name.to_owned(),
            known: known.iter().map(|kind| kind.name().to_owned()).collect(),
        })?;
        let problem = |e: raystone_core::params::ParamError| MediaError::Structure(e.to_string());
        let structure = found.make(&Default::default()).map_err(problem)?;
        let coefficients = || volume.scattering.iter().zip(&volume.absorption);
        let density = coefficients().map(|(s, a)| s + a).fold(0.0, f32::max);
        let share = |value: f32| if density > 0.0 { value / density } else { 0.0 };
        let field = coefficients()
            .map(|(s, a)| pack_halves(Vec2::new(share(*s), share(s + a))))
            .collect();
        let homogeneity = Homogeneity {
            epsilon: EPSILON,
            ..Homogeneity::default()
        };
        Ok(Self {
            medium: Medium::over(volume, field, structure, homogeneity),
            density,
        })
    }
}

/// Checks that a volume bends no light.
///
/// # Errors
/// The first voxel whose refractive index is not 1.
pub fn check_straight(volume: &Volume) -> Result<(), MediaError> {
    match volume.refraction.iter().position(|n| *n != 1.0) {
        None => Ok(()),
        Some(at) => Err(MediaError::Refracts {
            voxel: voxel_at(volume.resolution, at),
            value: volume.refraction[at],
        }),
    }
}

/// Densities between 0 and 1: of one voxel (`constant`), of a procedure (`cloud`, with this many voxels along an axis),
/// or of a file, as it has them.
///
/// # Errors
/// An unknown name, or a file that cannot be read.
pub fn grid(name: &str, side: u32) -> Result<Grid, MediaError> {
    let of_volume = |volume: Volume| {
        let sigma = volume.scattering.iter().zip(&volume.absorption);
        let sigma: Vec<f32> = sigma.map(|(s, a)| s + a).collect();
        let most = sigma.iter().copied().fold(0.0, f32::max);
        Grid {
            resolution: volume.resolution,
            values: sigma.iter().map(|s| s / most).collect(),
            corners: None,
        }
    };
    match name {
        "constant" => Ok(of_volume(Volume::constant(1.0, 0.0, 1.0)?)),
        "cloud" => Ok(of_volume(procedures::cloud(side)?)),
        file if Path::new(file).extension().is_some() => read_grid(Path::new(file)),
        _ => Err(MediaError::Unknown {
            what: "medium",
            name: name.to_owned(),
            known: [
                "constant",
                "cloud",
                "a file of a grid (.npy, .vol) or of a closed mesh",
            ]
            .map(str::to_owned)
            .to_vec(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walk::field_at;
    use glam::Vec3;

    #[test]
    fn shares_hold_albedo_and_density_whatever_the_unit_is() {
        for unit in [1e-5_f32, 1.0, 1e3] {
            let volume = Volume::constant(3.0 * unit, unit, 1.0).unwrap();
            let straight = Straight::new(&volume, "dda").unwrap();
            assert_eq!(straight.density, 4.0 * unit);
            let shares = field_at(&straight.medium, Vec3::splat(0.5));
            assert_eq!(shares, Vec2::new(0.75, 1.0));
        }
        let nothing = Volume::constant(0.0, 0.0, 1.0).unwrap();
        let nothing = Straight::new(&nothing, "dda").unwrap();
        assert_eq!(field_at(&nothing.medium, Vec3::ZERO), Vec2::ZERO);
    }

    #[test]
    fn what_the_path_tracer_cannot_follow_is_refused_by_name() {
        let glass = procedures::glass_ball(8).unwrap();
        let error = Straight::new(&glass, "dda").err().unwrap().to_string();
        assert!(error.contains("straight"), "{error}");
        let fog = Volume::constant(1.0, 0.0, 1.0).unwrap();
        let error = Straight::new(&fog, "octree").err().unwrap().to_string();
        assert!(
            error.contains("`octree`") && error.contains("level-map"),
            "{error}"
        );
        let error = grid("smoke", 8).unwrap_err().to_string();
        assert!(
            error.contains("`smoke`") && error.contains("cloud"),
            "{error}"
        );
    }
}

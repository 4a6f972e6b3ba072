//! The medium of a scene: fog, smoke or a cloud in a box or a ball.

use super::{SceneData, SceneError};
use glam::{DVec3, Vec3};
use raystone_core::parameters;
use raystone_volume::files::Grid;
use raystone_volume::volume::voxels;
use raystone_volume::{Bounds, MediaError, Phase, Volume, grid, phase};

/// A volume in a scene, and what finds the way through it.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneMedium {
    /// Scattering and absorption, per scene unit; its refractive index is 1.
    pub volume: Volume,
    /// What scattering and absorption of each channel are multiplied by: in [0, 1], 1 in some channel.
    pub tints: [Vec3; 2],
    /// The structure whose bounds free flights go by: a name of `raystone_volume::structure`.
    pub structure: String,
}

parameters! {
    /// What a medium fills of its box.
    enum Shape {
        /// All of it.
        Box = "box",
        /// The ball that touches its six sides.
        Ball = "ball",
    }

    /// How a medium scatters.
    enum PhaseFunction {
        /// The same in all directions.
        Isotropic = "isotropic",
        /// Schlick's approximation.
        Schlick = "schlick",
        /// The function of Henyey and Greenstein.
        HenyeyGreenstein = "henyey-greenstein",
    }

    /// The medium of any scene.
    pub(crate) struct MediumParameters {
        /// medium in the scene: `constant`, `cloud`, or a grid of densities from a file (NumPy's .npy or
        /// Mitsuba's .vol); that of the scene itself if empty
        medium: String = String::new();
        /// grid of what absorbs, where it is another than that of what scatters: as `medium`
        absorber: String = String::new();
        /// low and high corner of the medium's box, scene units; the scene's box if both are 0
        medium_box: [f64; 6] = [0.0; 6], in -1e12..=1e12;
        /// what it fills of its box
        medium_shape: Shape = Shape::Box;
        /// scattering coefficient where the density is 1, per scene unit
        scattering: f64 = 1.0, in 0.0..=6e4;
        /// absorption coefficient where the density is 1, per scene unit
        absorption: f64 = 0.0, in 0.0..=6e4;
        /// what the scattering coefficient of red, green and blue is multiplied by
        scattering_tint: [f64; 3] = [1.0; 3], in 0.0..=1.0;
        /// what the absorption coefficient of red, green and blue is multiplied by
        absorption_tint: [f64; 3] = [1.0; 3], in 0.0..=1.0;
        /// phase function
        phase: PhaseFunction = PhaseFunction::Isotropic;
        /// its anisotropy, k of Schlick or g of Henyey and Greenstein: above 0 is forward
        anisotropy: f64 = 0.0, in -0.99..=0.99;
        /// voxels along an axis of `cloud`
        medium_voxels: u32 = 32, in 1..=256;
        /// structure over the volume, whose bounds free flights go by
        medium_structure: String = "level-map".to_owned();
    }
}

impl MediumParameters {
    /// The scene with this medium, or as it is.
    pub(super) fn applied(&self, mut scene: SceneData) -> Result<SceneData, SceneError> {
        if self.medium.is_empty() {
            return Ok(scene);
        }
        let problem = |source: MediaError| SceneError::Medium {
            name: scene.name.clone(),
            source,
        };
        scene.medium = Some(self.built(&scene).map_err(problem)?);
        scene.hash = scene.content_hash();
        Ok(scene)
    }

    fn built(&self, scene: &SceneData) -> Result<SceneMedium, MediaError> {
        let scatters = grid(&self.medium, self.medium_voxels)?;
        let absorbs = match self.absorber.as_str() {
            "" => scatters.clone(),
            other => grid(other, self.medium_voxels)?,
        };
        let [low, high] = self.corners(scene, scatters.corners);
        let scaled = |grid: &Grid, factor: f64| -> Vec<f32> {
            grid.values.iter().map(|x| factor as f32 * x).collect()
        };
        let volume = Volume {
            resolution: scatters.resolution,
            low,
            high,
            bounds: match self.medium_shape {
                Shape::Box => Bounds::Box,
                Shape::Ball => Bounds::Sphere,
            },
            scattering: scaled(&scatters, self.scattering),
            absorption: scaled(&absorbs, self.absorption),
            refraction: vec![1.0; voxels(scatters.resolution)],
            phase: Phase {
                kind: match self.phase {
                    PhaseFunction::Isotropic => phase::ISOTROPIC,
                    PhaseFunction::Schlick => phase::SCHLICK,
                    PhaseFunction::HenyeyGreenstein => phase::HENYEY_GREENSTEIN,
                },
                anisotropy: self.anisotropy as f32,
            },
        };
        let tints = [self.scattering_tint, self.absorption_tint]
            .map(|tint| Vec3::from_array(tint.map(|x| x as f32)));
        SceneMedium::tinted(volume, tints, &self.medium_structure)
    }

    /// The medium's box: as given, or as the file of its grid has it, or that of the scene.
    fn corners(&self, scene: &SceneData, filed: Option<[DVec3; 2]>) -> [DVec3; 2] {
        let [a, b, c, d, e, f] = self.medium_box;
        if self.medium_box != [0.0; 6] {
            return [DVec3::new(a, b, c), DVec3::new(d, e, f)];
        }
        let bounds = scene.bounds();
        filed.unwrap_or_else(|| [bounds.min, bounds.max].map(|corner| corner.as_dvec3()))
    }
}

impl SceneMedium {
    /// A volume that the path tracer can follow paths through.
    ///
    /// # Errors
    /// The volume is not [sound](Volume::checked), refracts, or there is no such structure.
    pub fn new(volume: Volume, structure: &str) -> Result<Self, MediaError> {
        Self::tinted(volume, [Vec3::ONE; 2], structure)
    }

    /// The same with coefficients that differ by channel: those of the volume times a tint each. What is the same in
    /// all channels becomes part of the volume, so that a grey tint is none; a coefficient that is 0 everywhere takes the
    /// other's.
    ///
    /// # Errors
    /// As [`SceneMedium::new`], and a tint beyond [0, 1].
    pub fn tinted(
        mut volume: Volume,
        mut tints: [Vec3; 2],
        structure: &str,
    ) -> Result<Self, MediaError> {
        let grids = [&mut volume.scattering, &mut volume.absorption];
        let mut are_none = [false; 2];
        for ((tint, is_none), values) in tints.iter_mut().zip(&mut are_none).zip(grids) {
            let most = tint.max_element();
            let allowed = 0.0..=1.0;
            if !tint.to_array().iter().all(|part| allowed.contains(part)) {
                return Err(MediaError::Tint(tint.to_array()));
            }
            if most < 1.0 {
                values.iter_mut().for_each(|value| *value *= most);
            }
            *is_none = values.iter().all(|value| *value == 0.0);
            *tint = if *is_none { Vec3::ONE } else { *tint / most };
        }
        // With the tint of the other, bounds of σ are bounds of each channel.
        tints = match are_none {
            [true, false] => [tints[1]; 2],
            [false, true] => [tints[0]; 2],
            _ => tints,
        };
        let volume = volume.checked()?;
        let medium = Self {
            volume,
            tints,
            structure: structure.to_owned(),
        };
        medium.check()?;
        Ok(medium)
    }

    /// True if some coefficient differs by channel.
    pub fn is_coloured(&self) -> bool {
        self.tints != [Vec3::ONE; 2]
    }

    /// An error where paths would bend, or nothing is known of the structure.
    fn check(&self) -> Result<(), MediaError> {
        let least = Volume {
            resolution: [1; 3],
            scattering: vec![1.0],
            absorption: vec![0.0],
            refraction: vec![1.0],
            ..self.volume.clone()
        };
        raystone_volume::Straight::new(&least, &self.structure)?;
        raystone_volume::check_straight(&self.volume)
    }

    /// Bytes that tell it from others, for the hash of a scene.
    pub(super) fn words(&self) -> Vec<u8> {
        let volume = &self.volume;
        let head = format!(
            "{:?} {:?} {:?} {:?} {:?} {}",
            volume.resolution, volume.low, volume.high, volume.bounds, volume.phase, self.structure
        );
        let grids = [&volume.scattering, &volume.absorption];
        let values = grids.into_iter().flatten().flat_map(|x| x.to_le_bytes());
        let tints = self.is_coloured().then_some(self.tints);
        let tints = tints.into_iter().flatten().flat_map(|tint| tint.to_array());
        let values = values.chain(tints.flat_map(f32::to_le_bytes));
        head.into_bytes().into_iter().chain(values).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::builtin::tests::{load_default, load_with, try_load_with};
    use glam::DVec3;
    use raystone_core::params::ParamValue::{Integer, List, Name, Number};
    use raystone_volume::Bounds;

    fn name(text: &str) -> raystone_core::params::ParamValue {
        Name(text.to_owned())
    }

    #[test]
    fn any_scene_takes_a_medium_by_its_parameters() {
        let corners = [1.0, 2.0, 3.0, 4.0, 5.0, 7.0].map(Number).to_vec();
        let scene = load_with(
            "cornell-box",
            &[
                ("medium", name("cloud")),
                ("medium_voxels", Integer(8)),
                ("medium_box", List(corners)),
                ("medium_shape", name("ball")),
                ("scattering", Number(0.25)),
                ("absorption", Number(0.5)),
                ("absorber", name("cloud")),
            ],
        );
        let volume = scene.medium.unwrap().volume;
        assert_eq!(volume.resolution, [8; 3]);
        assert_eq!(
            [volume.low, volume.high],
            [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 7.0)]
        );
        assert_eq!(volume.bounds, Bounds::Sphere);
        assert_eq!(volume.scattering.iter().copied().fold(0.0, f32::max), 0.25);
        let pairs = volume.scattering.iter().zip(&volume.absorption);
        assert!(pairs.clone().all(|(s, a)| 2.0 * s == *a));
    }

    #[test]
    fn a_medium_without_a_box_fills_that_of_the_scene_and_changes_its_hash() {
        let plain = load_default("cornell-box");
        assert!(plain.medium.is_none());
        let fog = load_with("cornell-box", &[("medium", name("constant"))]);
        assert_ne!(plain.hash, fog.hash);
        let volume = fog.medium.unwrap().volume;
        assert_eq!(volume.high.as_vec3(), plain.bounds().max);
        let other = load_with(
            "cornell-box",
            &[("medium", name("constant")), ("anisotropy", Number(0.5))],
        );
        assert_ne!(other.hash, fog.hash);
    }

    #[test]
    fn what_is_the_same_in_all_channels_is_no_tint() {
        let tinted = |scattering: [f64; 3], absorption: [f64; 3]| {
            let tint = |t: [f64; 3]| List(t.map(Number).to_vec());
            let changes = [
                ("medium", name("constant")),
                ("scattering", Number(2.0)),
                ("absorption", Number(0.0)),
                ("scattering_tint", tint(scattering)),
                ("absorption_tint", tint(absorption)),
            ];
            load_with("cornell-box", &changes)
        };
        let grey = tinted([0.5; 3], [0.1, 0.2, 0.3]);
        let plain = load_with(
            "cornell-box",
            &[("medium", name("constant")), ("scattering", Number(1.0))],
        );
        assert_eq!(grey.hash, plain.hash);
        let grey = grey.medium.unwrap();
        assert!(!grey.is_coloured());
        let coloured = tinted([0.25, 0.5, 0.0], [1.0; 3]);
        assert_ne!(coloured.hash, plain.hash);
        let coloured = coloured.medium.unwrap();
        assert!(coloured.is_coloured());
        assert_eq!(coloured.volume.scattering, [1.0]);
        assert_eq!(coloured.tints[0].to_array(), [0.5, 1.0, 0.0]);
        let nothing = tinted([0.0; 3], [1.0; 3]).medium.unwrap();
        assert!(!nothing.is_coloured() && nothing.volume.scattering == [0.0]);
        let fog = raystone_volume::Volume::constant(1.0, 0.0, 1.0).unwrap();
        for wrong in [[-0.1, 1.0, 1.0], [1.1, 1.0, 1.0], [f32::NAN, 1.0, 1.0]] {
            let tints = [glam::Vec3::ONE, glam::Vec3::from_array(wrong)];
            let refused = crate::SceneMedium::tinted(fog.clone(), tints, "dda").unwrap_err();
            assert!(refused.to_string().contains("tint"), "{refused}");
        }
    }

    #[test]
    fn wrong_media_are_errors_that_name_scene_and_value() {
        let refused = |changes: &[(&str, raystone_core::params::ParamValue)]| {
            let mut all = vec![("medium", name("constant"))];
            all.extend_from_slice(changes);
            try_load_with("cornell-box", &all).unwrap_err().to_string()
        };
        let unknown = refused(&[("medium", name("smoke"))]);
        assert!(
            unknown.contains("`smoke`") && unknown.contains("cornell-box"),
            "{unknown}"
        );
        let flat = refused(&[(
            "medium_box",
            List([0.0, 0.0, 0.0, 1.0, 0.0, 1.0].map(Number).to_vec()),
        )]);
        assert!(flat.contains("above zero"), "{flat}");
        let structure = refused(&[("medium_structure", name("bvh"))]);
        assert!(
            structure.contains("`bvh`") && structure.contains("bricks"),
            "{structure}"
        );
        let grids = refused(&[("absorber", name("cloud"))]);
        assert!(grids.contains("absorption has"), "{grids}");
        let file = refused(&[("medium", name("missing.npy"))]);
        assert!(file.contains("missing.npy"), "{file}");
    }
}

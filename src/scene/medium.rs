//! A medium of a scene: fog, smoke or a cloud in a box or a ball.

use super::{SceneData, SceneError, extension, named};
use glam::{DVec3, Vec3};
use raystone_core::files::MODEL_ENDINGS;
use raystone_core::parameters;
use raystone_core::params::{ParamValue, Parameters as _, Params};
use raystone_volume::files::Grid;
use raystone_volume::volume::voxels;
use raystone_volume::{Bounds, MediaError, Phase, Volume, grid, phase, solid};
use std::path::Path;

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

/// How many media paths are followed through.
pub const MOST_MEDIA: usize = 8;

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

    /// The first medium of any scene, or one of `more_media`.
    pub(crate) struct MediumParameters {
        /// medium in the scene: `constant`, `cloud`, a grid of densities from a file (NumPy's .npy or Mitsuba's
        /// .vol), or what a closed mesh encloses (a model's file); that of the scene itself if empty
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
        /// voxels along an axis of `cloud`, and along the longest of a mesh
        medium_voxels: u32 = 32, in 1..=256;
        /// structure over the volume, whose bounds free flights go by
        medium_structure: String = "level-map".to_owned();
    }
}

impl MediumParameters {
    /// A warning of parameters that say nothing, because no `medium` is given.
    pub(super) fn idle(params: &Params) -> Option<String> {
        let is_given =
            |value: &ParamValue| !matches!(value, ParamValue::Name(name) if name.is_empty());
        if params.0.get("medium").is_some_and(is_given) {
            return None;
        }
        let changed = Self::schema().into_iter().filter(|parameter| {
            let value = params.0.get(parameter.name);
            value.is_some_and(|value| *value != parameter.default)
        });
        let names: Vec<String> = changed.map(|p| format!("`{}`", p.name)).collect();
        (!names.is_empty()).then(|| {
            format!(
                "{} of a medium say nothing without `medium`, its kind: give `medium = \"constant\"`, for instance",
                names.join(", ")
            )
        })
    }

    /// A warning of an anisotropy that no phase function hears of.
    pub(super) fn unheard(&self) -> Option<String> {
        let is_unheard = self.phase == PhaseFunction::Isotropic && self.anisotropy != 0.0;
        is_unheard.then(|| {
            "`anisotropy` says nothing with `phase = \"isotropic\"`, the default: give `phase = \"henyey-greenstein\"`".to_owned()
        })
    }

    /// The scene with this medium alone, or as it is.
    pub(super) fn applied(&self, mut scene: SceneData) -> Result<SceneData, SceneError> {
        if self.medium.is_empty() {
            return Ok(scene);
        }
        scene.media = vec![self.made(&scene)?];
        scene.report.warnings.extend(self.unheard());
        scene.hash = scene.content_hash();
        Ok(scene)
    }

    /// The medium, for this scene.
    pub(super) fn made(&self, scene: &SceneData) -> Result<SceneMedium, SceneError> {
        let problem = |source: MediaError| SceneError::Medium {
            name: scene.name.clone(),
            source,
        };
        let grid = |name: &str| match extension(Path::new(name)).as_str() {
            ending if MODEL_ENDINGS.contains(&ending) => {
                of_mesh(&named(name)?, self.medium_voxels).map_err(problem)
            }
            _ => grid(name, self.medium_voxels).map_err(problem),
        };
        let scatters = grid(&self.medium)?;
        let absorbs = match self.absorber.as_str() {
            "" => scatters.clone(),
            other => grid(other)?,
        };
        let medium = self.built(scene, [&scatters, &absorbs]);
        medium.map_err(problem)
    }

    fn built(
        &self,
        scene: &SceneData,
        [scatters, absorbs]: [&Grid; 2],
    ) -> Result<SceneMedium, MediaError> {
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
            scattering: scaled(scatters, self.scattering),
            absorption: scaled(absorbs, self.absorption),
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

    /// The medium's box: as given, or as the file of its grid or mesh has it, or that of the scene.
    fn corners(&self, scene: &SceneData, filed: Option<[DVec3; 2]>) -> [DVec3; 2] {
        let [a, b, c, d, e, f] = self.medium_box;
        if self.medium_box != [0.0; 6] {
            return [DVec3::new(a, b, c), DVec3::new(d, e, f)];
        }
        let bounds = scene.bounds();
        filed.unwrap_or_else(|| [bounds.min, bounds.max].map(|corner| corner.as_dvec3()))
    }
}

/// The part of each voxel that a closed mesh encloses, in the box of the mesh, with so many voxels along its longest
/// side. Triangles of which two corners are one have no inside.
fn of_mesh(scene: &SceneData, side: u32) -> Result<Grid, MediaError> {
    let corners =
        (0..scene.triangles.len()).map(|k| scene.outward(k).map(|corner| corner.as_dvec3()));
    let triangles: Vec<solid::Triangle> = corners
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect();
    let all = triangles.iter().flatten();
    let [low, high] = all.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| {
        [low.min(*p), high.max(*p)]
    });
    let size = high - low;
    let voxels = (size / size.max_element() * f64::from(side)).round();
    let resolution = voxels.max(DVec3::ONE).to_array().map(|n| n as u32);
    let values = solid::solid(&triangles, resolution, [low, high])?;
    Ok(Grid {
        resolution,
        values,
        corners: Some([low, high]),
    })
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
        let volume = scene.media[0].volume.clone();
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
        assert!(plain.media.is_empty());
        let fog = load_with("cornell-box", &[("medium", name("constant"))]);
        assert_ne!(plain.hash, fog.hash);
        let volume = fog.media[0].volume.clone();
        assert_eq!(volume.high.as_vec3(), plain.bounds().max);
        let other = load_with(
            "cornell-box",
            &[("medium", name("constant")), ("anisotropy", Number(0.5))],
        );
        assert_ne!(other.hash, fog.hash);
        let notes = |scene: &crate::SceneData| scene.report.lines().join("\n");
        assert!(notes(&other).contains("`anisotropy` says nothing with `phase = \"isotropic\"`"));
        assert!(!notes(&fog).contains("anisotropy"));
        let forward = load_with(
            "cornell-box",
            &[
                ("medium", name("constant")),
                ("anisotropy", Number(0.5)),
                ("phase", name("henyey-greenstein")),
            ],
        );
        assert!(!notes(&forward).contains("anisotropy"));
    }

    /// A scene in which a mesh of this text encloses a medium.
    fn filled(text: &str, voxels: i64) -> Result<crate::SceneData, crate::SceneError> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("mesh.obj");
        std::fs::write(&file, text).unwrap();
        let file = file.to_string_lossy();
        let changes = [
            ("medium", name(&file)),
            ("medium_voxels", Integer(voxels)),
            ("scattering", Number(0.5)),
        ];
        try_load_with("cornell-box", &changes)
    }

    /// A box from (1, 2, 3) to (3, 6, 4) without one of its faces.
    const BOX: [&str; 2] = [
        "v 1 2 3\nv 3 2 3\nv 3 6 3\nv 1 6 3\nv 1 2 4\nv 3 2 4\nv 3 6 4\nv 1 6 4\n\
         f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\n",
        "f 4 1 5 8\n",
    ];

    #[test]
    fn a_closed_mesh_encloses_a_medium_where_it_is() {
        let scene = filled(&BOX.concat(), 12).unwrap();
        let volume = scene.media[0].volume.clone();
        assert_eq!(volume.resolution, [6, 12, 3]);
        assert_eq!(
            [volume.low, volume.high],
            [DVec3::new(1.0, 2.0, 3.0), DVec3::new(3.0, 6.0, 4.0)]
        );
        assert!(volume.scattering.iter().all(|sigma| *sigma == 0.5));
        // A pyramid over the square from (-1, -1, 0) to (1, 1, 0), as high as 2: a third of its box, and of a layer at
        // height z the part (1 - z / 2)².
        let pyramid = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv 0 0 2\n\
                       f 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
        let volume = filled(pyramid, 32).unwrap().media[0].volume.clone();
        assert_eq!(volume.resolution, [32; 3]);
        for layer in 0..32_usize {
            let values = &volume.scattering[layer * 1024..][..1024];
            let part = values.iter().sum::<f32>() / 512.0;
            let left = 1.0 - (layer as f32 + 0.5) / 32.0;
            assert!((part - left * left).abs() < 0.01, "{layer}: {part}");
        }
        // The layer at half the height is full from -0.5 to 0.5, here along x in the middle of y.
        let row = &volume.scattering[16 * 1024 + 16 * 32..][..32];
        assert_eq!(row[..7], [0.0; 7]);
        assert!(row[9..23].iter().all(|sigma| *sigma == 0.5), "{row:?}");
        assert_eq!(row[25..], [0.0; 7]);
    }

    #[test]
    fn meshes_that_enclose_nothing_or_themselves_twice_are_refused() {
        let open = filled(BOX[0], 8).unwrap_err().to_string();
        assert!(open.contains("the mesh is open: 4 edges"), "{open}");
        let moved: String = BOX
            .concat()
            .lines()
            .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
                ["v", x, y, z] => {
                    let beside = x.parse::<f64>().unwrap() + 1.0;
                    format!("v {beside} {y} {z}\n")
                }
                ["f", ..] => {
                    let corners = line[2..].split(' ').map(|k| k.parse::<i32>().unwrap() - 9);
                    let corners: Vec<String> = corners.map(|k| k.to_string()).collect();
                    format!("f {}\n", corners.join(" "))
                }
                _ => panic!("{line}"),
            })
            .collect();
        let twice = filled(&format!("{}{moved}", BOX.concat()), 24).unwrap_err();
        assert!(twice.to_string().contains("parts of it overlap"), "{twice}");
        let flat = filled("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n", 8).unwrap_err();
        assert!(flat.to_string().contains("above zero"), "{flat}");
        let missing = try_load_with("cornell-box", &[("medium", name("no.ply"))]).unwrap_err();
        assert!(missing.to_string().contains("no.ply"), "{missing}");
    }

    #[test]
    fn parameters_of_a_medium_that_is_not_there_are_named() {
        let scene = load_with("cornell-box", &[("scattering", Number(2.0))]);
        assert!(scene.media.is_empty());
        let said = scene.report.warnings.join("\n");
        assert!(
            said.contains("`scattering` of a medium say nothing"),
            "{said}"
        );
        for silent in [
            vec![],
            vec![("medium", name("constant")), ("scattering", Number(2.0))],
        ] {
            let said = load_with("cornell-box", &silent).report.warnings.join("\n");
            assert!(!said.contains("say nothing"), "{said}");
        }
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
        let grey = grey.media[0].clone();
        assert!(!grey.is_coloured());
        let coloured = tinted([0.25, 0.5, 0.0], [1.0; 3]);
        assert_ne!(coloured.hash, plain.hash);
        let coloured = coloured.media[0].clone();
        assert!(coloured.is_coloured());
        assert_eq!(coloured.volume.scattering, [1.0]);
        assert_eq!(coloured.tints[0].to_array(), [0.5, 1.0, 0.0]);
        let nothing = tinted([0.0; 3], [1.0; 3]).media[0].clone();
        assert!(!nothing.is_coloured() && nothing.volume.scattering == [0.0]);
        // What only absorbs keeps its colour.
        let dye = load_with(
            "cornell-box",
            &[
                ("medium", name("constant")),
                ("scattering", Number(0.0)),
                ("absorption", Number(4.0)),
                (
                    "absorption_tint",
                    List([0.25, 0.5, 0.0].map(Number).to_vec()),
                ),
            ],
        );
        assert_eq!(dye.media[0].volume.absorption, [2.0]);
        assert_eq!(dye.media[0].tints[1].to_array(), [0.5, 1.0, 0.0]);
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

//! The media of a scene for Mitsuba's `volpath`, and for `volpathmis` where coefficients of one differ by channel.

use super::{Export, ExportError, vector};
use glam::{DVec3, Vec3};
use raystone_scene::SceneMedium;
use raystone_volume::{Bounds, Volume, phase};
use std::fmt::Write as _;

/// A medium as its sensor and its shape refer to it, and the folder of its grids.
fn id(number: usize) -> String {
    match number {
        0 => "medium".to_owned(),
        _ => format!("medium-{}", number + 1),
    }
}

/// The integrator that knows media, or that does not.
pub(super) fn integrator(media: &[SceneMedium]) -> &'static str {
    match media {
        [] => "path",
        _ if media.iter().any(SceneMedium::is_coloured) => "volpathmis",
        _ => "volpath",
    }
}

/// What a sensor in a medium says of it.
pub(super) fn around(media: &[SceneMedium], eye: Vec3) -> String {
    let is_inside = |volume: &Volume| {
        let place = eye.as_dvec3();
        match volume.bounds {
            Bounds::Box => place.cmpge(volume.low).all() && place.cmple(volume.high).all(),
            Bounds::Sphere => {
                let [centre, half] = [volume.low + volume.high, volume.high - volume.low];
                ((2.0 * place - centre) / half).length() < 1.0
            }
        }
    };
    let around = media.iter().position(|medium| is_inside(&medium.volume));
    around.map_or(String::new(), |number| {
        format!("        <ref name=\"medium\" id=\"{}\"/>\n", id(number))
    })
}

/// How far two of a scene's volumes are apart; not above 0 where they overlap or touch. Ellipsoids are refused before.
fn gap(a: &Volume, b: &Volume) -> f64 {
    // A ball is what is within its radius of its middle.
    let core = |of: &Volume| match of.bounds {
        Bounds::Box => ([of.low, of.high], 0.0),
        Bounds::Sphere => (
            [(of.low + of.high) / 2.0; 2],
            (of.high - of.low).max_element() / 2.0,
        ),
    };
    let ([a_low, a_high], a_radius) = core(a);
    let ([b_low, b_high], b_radius) = core(b);
    let apart = (a_low - b_high).max(b_low - a_high).max(DVec3::ZERO);
    apart.length() - a_radius - b_radius
}

impl Export<'_> {
    /// Writes all media.
    pub(super) fn media(&mut self) -> Result<(), ExportError> {
        let media = &self.scene.media;
        for (number, medium) in media.iter().enumerate() {
            self.medium(medium, number)?;
            let before = &media[..number];
            if before
                .iter()
                .any(|other| gap(&other.volume, &medium.volume) <= 0.0)
            {
                return Err(ExportError::Medium(
                    "two media overlap or touch, and a place has one medium there: move them apart, or put both into one grid",
                ));
            }
        }
        Ok(())
    }

    /// Writes a medium, its grids and its border.
    fn medium(&mut self, medium: &SceneMedium, number: usize) -> Result<(), ExportError> {
        let id = id(number);
        let volume = &medium.volume;
        let size = volume.high - volume.low;
        let spread = size.max_element() - size.min_element();
        if volume.bounds == Bounds::Sphere && spread > 1e-9 * size.max_element() {
            return Err(ExportError::Medium(
                "it fills an ellipsoid: give it a box whose sides are equal",
            ));
        }
        let scatters = match volume.phase.kind {
            phase::ISOTROPIC => "<phase type=\"isotropic\"/>".to_owned(),
            phase::HENYEY_GREENSTEIN => format!(
                "<phase type=\"hg\"><float name=\"g\" value=\"{}\"/></phase>",
                volume.phase.anisotropy
            ),
            _ => {
                return Err(ExportError::Medium(
                    "Mitsuba has no phase function of Schlick: take henyey-greenstein",
                ));
            }
        };
        let (kind, coefficients) = if volume.scattering.len() == 1 {
            ("homogeneous", one_voxel(medium))
        } else {
            ("heterogeneous", self.grids(medium, &id)?)
        };
        let (low, size) = (vector(volume.low.as_vec3()), vector(size.as_vec3()));
        let to_world = |scale: &str, place: &str| {
            format!(
                "<transform name=\"to_world\"><scale value=\"{scale}\"/><translate value=\"{place}\"/></transform>"
            )
        };
        let grid_place = to_world(&size, &low);
        let coefficients = coefficients.replace("TO_WORLD", &grid_place);
        let half: DVec3 = (volume.high - volume.low) / 2.0;
        let centre = vector((volume.low + half).as_vec3());
        let shape = match volume.bounds {
            Bounds::Box => "cube",
            Bounds::Sphere => "sphere",
        };
        let placed = to_world(&vector(half.as_vec3()), &centre);
        let _ = write!(
            self.xml,
            r#"    <medium type="{kind}" id="{id}">
{coefficients}        {scatters}
    </medium>
    <shape type="{shape}">
        {placed}
        <bsdf type="null"/>
        <ref name="interior" id="{id}"/>
    </shape>
"#
        );
        Ok(())
    }

    /// Writes extinction and albedo as grids, with the channels of [`parts_of`].
    fn grids(&mut self, medium: &SceneMedium, folder: &str) -> Result<String, ExportError> {
        let files = ["extinction", "albedo"].map(|name| format!("{folder}/{name}.vol"));
        let resolution = medium.volume.resolution;
        let (channels, parts) = parts_of(medium);
        let extinction: Vec<f32> = parts.iter().map(|[s, a]| s + a).collect();
        let share = |[s, a]: &[f32; 2]| if s + a > 0.0 { s / (s + a) } else { 0.0 };
        let albedo: Vec<f32> = parts.iter().map(share).collect();
        let even: Option<Vec<f32>> = (0..channels)
            .map(|channel| the_same(channel, channels, &albedo, &extinction))
            .collect();
        let path = self.folder.join(folder);
        std::fs::create_dir_all(&path).map_err(super::unwritable(&path))?;
        self.write(&files[0], &vol(resolution, channels, &extinction))?;
        let grid = |name: &str, file: &str| {
            format!(
                r#"        <volume name="{name}" type="gridvolume">
            <string name="filename" value="{file}"/>
            <boolean name="raw" value="true"/>
            TO_WORLD
        </volume>
"#
            )
        };
        let sigma = grid("sigma_t", &files[0]);
        match even.as_deref() {
            Some([all]) => {
                return Ok(sigma + &format!("        <float name=\"albedo\" value=\"{all}\"/>\n"));
            }
            Some([r, g, b]) => {
                return Ok(
                    sigma + &format!("        <rgb name=\"albedo\" value=\"{r} {g} {b}\"/>\n")
                );
            }
            _ => {}
        }
        self.warnings.push(
            "the medium's albedo differs from voxel to voxel: between them Mitsuba mixes albedos, not scattering"
                .to_owned(),
        );
        self.write(&files[1], &vol(resolution, channels, &albedo))?;
        Ok(sigma + &grid("albedo", &files[1]))
    }
}

/// Scattering and absorption of each channel of each voxel, channels fastest: of one channel, or of red, green and blue where they
/// differ.
fn parts_of(medium: &SceneMedium) -> (usize, Vec<[f32; 2]>) {
    let channels = if medium.is_coloured() { 3 } else { 1 };
    let [scatters, absorbs] = medium.tints;
    let volume = &medium.volume;
    let pairs = volume.scattering.iter().zip(&volume.absorption);
    let of_voxel = |(s, a): (&f32, &f32)| {
        let (s, a) = (*s, *a);
        (0..channels).map(move |c| [scatters[c] * s, absorbs[c] * a])
    };
    (channels, pairs.flat_map(of_voxel).collect())
}

/// The albedo of a channel where there is any extinction, if it is the same everywhere.
fn the_same(channel: usize, channels: usize, albedo: &[f32], extinction: &[f32]) -> Option<f32> {
    let all = albedo.iter().zip(extinction).skip(channel);
    let mut known = (all.step_by(channels)).filter(|(_, sigma)| **sigma > 0.0);
    let first = known.next().map_or(0.0, |(share, _)| *share);
    let is_even = known.all(|(share, _)| (share - first).abs() < 1e-4);
    is_even.then_some(first)
}

fn one_voxel(medium: &SceneMedium) -> String {
    let volume = &medium.volume;
    let [scattering, absorption] = [volume.scattering[0], volume.absorption[0]].map(f64::from);
    let albedo_of = |scattering: f64, sigma: f64| {
        if sigma > 0.0 { scattering / sigma } else { 0.0 }
    };
    if medium.is_coloured() {
        let [scatters, absorbs] = medium.tints.map(|tint| tint.as_dvec3().to_array());
        let scattered = scatters.map(|tint| tint * scattering);
        let sigma = [0, 1, 2].map(|k| scattered[k] + absorbs[k] * absorption);
        let [x, y, z] = sigma;
        let [r, g, b] = [0, 1, 2].map(|k| albedo_of(scattered[k], sigma[k]));
        return format!(
            "        <rgb name=\"sigma_t\" value=\"{x} {y} {z}\"/>\n        <rgb name=\"albedo\" value=\"{r} {g} {b}\"/>\n"
        );
    }
    let sigma = scattering + absorption;
    let albedo = albedo_of(scattering, sigma);
    format!(
        "        <float name=\"sigma_t\" value=\"{sigma}\"/>\n        <float name=\"albedo\" value=\"{albedo}\"/>\n"
    )
}

/// A grid in Mitsuba's binary format, version 3, in the unit cube; of each voxel its channels one after the other.
fn vol(resolution: [u32; 3], channels: usize, values: &[f32]) -> Vec<u8> {
    let mut bytes = b"VOL\x03".to_vec();
    let words = [1].into_iter().chain(resolution).chain([channels as u32]);
    bytes.extend(words.flat_map(u32::to_le_bytes));
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 1.0, 1.0];
    bytes.extend(corners.iter().chain(values).flat_map(|x| x.to_le_bytes()));
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_volume::files::read_grid;

    #[test]
    fn grids_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vol");
        let values: Vec<f32> = (0..24_u8).map(f32::from).collect();
        std::fs::write(&path, vol([2, 3, 4], 1, &values)).unwrap();
        let grid = read_grid(&path).unwrap();
        assert_eq!((grid.resolution, grid.values), ([2, 3, 4], values));
        assert_eq!(grid.corners, Some([DVec3::ZERO, DVec3::ONE]));
    }

    /// A medium of two voxels along x, tinted.
    fn tinted(absorption: Vec<f32>) -> SceneMedium {
        let volume = Volume {
            resolution: [2, 1, 1],
            scattering: vec![1.0, 2.0],
            absorption,
            refraction: vec![1.0; 2],
            ..Volume::constant(1.0, 0.0, 1.0).unwrap()
        };
        let tints = [Vec3::new(1.0, 0.5, 0.0), Vec3::new(0.5, 1.0, 1.0)];
        SceneMedium::tinted(volume, tints, "dda").unwrap()
    }

    #[test]
    fn voxels_have_the_coefficients_of_each_channel() {
        let (channels, parts) = parts_of(&tinted(vec![0.5, 3.0]));
        let of_first = [[1.0, 0.25], [0.5, 0.5], [0.0, 0.5]];
        let of_second = [[2.0, 1.5], [1.0, 3.0], [0.0, 3.0]];
        assert_eq!((channels, parts), (3, [of_first, of_second].concat()));
        // A file of them: three channels in the header, and the values as they are.
        let bytes = vol([2, 1, 1], channels, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(bytes[20..24], [3, 0, 0, 0]);
        assert_eq!(bytes[48..52], 1.0_f32.to_le_bytes());
        assert_eq!(bytes[56..60], 3.0_f32.to_le_bytes());
        assert_eq!(bytes.len(), 48 + 6 * 4);
    }

    #[test]
    fn an_albedo_is_one_colour_where_scattering_and_absorption_are_in_proportion() {
        let albedos = |medium: &SceneMedium| {
            let (channels, parts) = parts_of(medium);
            let extinction: Vec<f32> = parts.iter().map(|[s, a]| s + a).collect();
            let albedo: Vec<f32> = parts.iter().map(|[s, a]| s / (s + a)).collect();
            [0, 1, 2].map(|channel| the_same(channel, channels, &albedo, &extinction))
        };
        assert_eq!(
            albedos(&tinted(vec![0.5, 1.0])),
            [Some(0.8), Some(0.5), Some(0.0)]
        );
        assert_eq!(albedos(&tinted(vec![0.5, 3.0])), [None, None, Some(0.0)]);
    }
    /// A volume in the box between two corners, or in the ball of it.
    fn at(bounds: Bounds, low: [f64; 3], high: [f64; 3]) -> Volume {
        let [low, high] = [low, high].map(DVec3::from_array);
        let fog = Volume::constant(1.0, 0.5, 1.0).unwrap();
        Volume {
            low,
            high,
            bounds,
            ..fog
        }
    }

    #[test]
    fn gaps_between_boxes_and_balls_are_those_of_geometry() {
        let (box_of, ball) = (Bounds::Box, Bounds::Sphere);
        let unit = at(box_of, [0.0; 3], [1.0; 3]);
        let beside = at(box_of, [1.5, 0.2, 0.2], [2.0, 3.0, 3.0]);
        let across = at(box_of, [4.0, 5.0, 1.0], [5.0, 6.0, 2.0]);
        // Of radius 1 around (3, 0.5, 0.5), and of radius 0.5 in a corner's direction.
        let far = at(ball, [2.0, -0.5, -0.5], [4.0, 1.5, 1.5]);
        let corner = at(ball, [1.0, 1.0, 0.0], [2.0, 2.0, 1.0]);
        let inner = at(ball, [0.2; 3], [0.8; 3]);
        for (a, b, expected) in [
            (&unit, &beside, 0.5),
            (&unit, &across, 5.0),
            (&unit, &far, 1.0),
            (&unit, &corner, 0.5_f64.sqrt() - 0.5),
            (&far, &corner, 1.5_f64.hypot(1.0) - 1.5),
            (&unit, &inner, -0.3),
            (&unit, &unit, 0.0),
        ] {
            assert!((gap(a, b) - expected).abs() < 1e-12, "{a:?} {b:?}");
            assert_eq!(gap(a, b), gap(b, a));
        }
    }

    /// What an export of a room with these media says, or why there is none.
    fn exported(volumes: &[Volume]) -> Result<String, String> {
        let mut scene = raystone_scene::named("cornell-box").unwrap();
        let media = volumes.iter().map(|v| SceneMedium::new(v.clone(), "dda"));
        scene.media = media.map(Result::unwrap).collect();
        let folder = tempfile::tempdir().unwrap();
        let mut export = Export {
            folder: folder.path(),
            kinds: &crate::kinds::KindChecks::default(),
            scene: &scene,
            warnings: Vec::new(),
            needs_materials: false,
            xml: String::new(),
        };
        export.media().map_err(|e| e.to_string())?;
        for file in ["medium/extinction.vol", "medium-2/extinction.vol"] {
            assert_eq!(
                folder.path().join(file).exists(),
                export.xml.contains(file),
                "{file}"
            );
        }
        Ok(export.xml)
    }

    #[test]
    fn several_media_have_a_border_each_and_are_refused_where_they_overlap() {
        let first = at(Bounds::Box, [0.0; 3], [1.0; 3]);
        let grid = Volume::new([2, 1, 1], |p| [p.x as f32, 0.0, 1.0]).unwrap();
        let second = Volume {
            low: DVec3::new(2.0, 0.0, 0.0),
            high: DVec3::new(3.0, 1.0, 1.0),
            bounds: Bounds::Sphere,
            ..grid
        };
        let xml = exported(&[first.clone(), second.clone()]).unwrap();
        for (shape, id) in [("cube", "medium"), ("sphere", "medium-2")] {
            let (_, after) = xml.split_once(&format!("id=\"{id}\">")).unwrap();
            let shape = format!("<shape type=\"{shape}\">");
            assert!(after.contains(&shape), "{xml}");
            let interior = format!("<ref name=\"interior\" id=\"{id}\"/>");
            assert_eq!(xml.matches(&interior).count(), 1, "{xml}");
        }
        assert!(xml.contains("medium-2/extinction.vol") && !xml.contains("medium/extinction.vol"));
        let eye = |x: f32| around(&scene_of(&[&first, &second]), Vec3::new(x, 0.5, 0.5));
        assert!(eye(0.5).contains("\"medium\"/>") && eye(2.5).contains("\"medium-2\"/>"));
        assert_eq!(eye(1.5), "");
        for (low, high) in [([0.5; 3], [2.0; 3]), ([1.0, 0.0, 0.0], [2.0, 1.0, 1.0])] {
            let refused = exported(&[first.clone(), at(Bounds::Box, low, high)]).unwrap_err();
            assert!(refused.contains("overlap or touch"), "{refused}");
        }
    }

    fn scene_of(volumes: &[&Volume]) -> Vec<SceneMedium> {
        let media = volumes
            .iter()
            .map(|v| SceneMedium::new((*v).clone(), "dda"));
        media.map(Result::unwrap).collect()
    }
}

//! The medium of a scene for Mitsuba's `volpath`, and for `volpathmis` where its coefficients differ by channel.

use super::{Export, ExportError, vector};
use glam::{DVec3, Vec3};
use raystone_scene::SceneMedium;
use raystone_volume::{Bounds, Volume, phase};
use std::fmt::Write as _;

/// The medium as its sensor and its shape refer to it.
const ID: &str = "medium";
const FILES: [&str; 2] = ["medium/extinction.vol", "medium/albedo.vol"];

/// The integrator that knows media, or that does not.
pub(super) fn integrator(medium: Option<&SceneMedium>) -> &'static str {
    match medium {
        Some(medium) if medium.is_coloured() => "volpathmis",
        Some(_) => "volpath",
        None => "path",
    }
}

/// What a sensor in the medium says of it.
pub(super) fn around(medium: Option<&SceneMedium>, eye: Vec3) -> String {
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
    if medium.is_some_and(|medium| is_inside(&medium.volume)) {
        format!("        <ref name=\"medium\" id=\"{ID}\"/>\n")
    } else {
        String::new()
    }
}

impl Export<'_> {
    /// Writes the medium, its grids and its border.
    pub(super) fn medium(&mut self) -> Result<(), ExportError> {
        let Some(medium) = &self.scene.medium else {
            return Ok(());
        };
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
        } else if medium.is_coloured() {
            return Err(ExportError::Medium(
                "its coefficients differ from voxel to voxel and by channel: take a constant one or leave out its tints",
            ));
        } else {
            ("heterogeneous", self.grids(volume)?)
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
            r#"    <medium type="{kind}" id="{ID}">
{coefficients}        {scatters}
    </medium>
    <shape type="{shape}">
        {placed}
        <bsdf type="null"/>
        <ref name="interior" id="{ID}"/>
    </shape>
"#
        );
        Ok(())
    }

    /// Writes extinction and albedo as grids.
    fn grids(&mut self, volume: &Volume) -> Result<String, ExportError> {
        let pairs = || volume.scattering.iter().zip(&volume.absorption);
        let extinction: Vec<f32> = pairs().map(|(s, a)| s + a).collect();
        let shares = pairs().map(|(s, a)| if s + a > 0.0 { s / (s + a) } else { 0.0 });
        let albedo: Vec<f32> = shares.collect();
        let mut known = albedo
            .iter()
            .zip(&extinction)
            .filter(|(_, sigma)| **sigma > 0.0);
        let first = known.next().map_or(0.0, |(share, _)| *share);
        let is_even = known.all(|(share, _)| (share - first).abs() < 1e-4);
        let path = self.folder.join("medium");
        std::fs::create_dir_all(&path).map_err(super::unwritable(&path))?;
        self.write(FILES[0], &vol(volume.resolution, &extinction))?;
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
        let sigma = grid("sigma_t", FILES[0]);
        if is_even {
            return Ok(sigma + &format!("        <float name=\"albedo\" value=\"{first}\"/>\n"));
        }
        self.warnings.push(
            "the medium's albedo differs from voxel to voxel: between them Mitsuba mixes albedos, not scattering"
                .to_owned(),
        );
        self.write(FILES[1], &vol(volume.resolution, &albedo))?;
        Ok(sigma + &grid("albedo", FILES[1]))
    }
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

/// A grid in Mitsuba's binary format, version 3, in the unit cube.
fn vol(resolution: [u32; 3], values: &[f32]) -> Vec<u8> {
    let mut bytes = b"VOL\x03".to_vec();
    let words = [1].into_iter().chain(resolution).chain([1]);
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
        std::fs::write(&path, vol([2, 3, 4], &values)).unwrap();
        let grid = read_grid(&path).unwrap();
        assert_eq!((grid.resolution, grid.values), ([2, 3, 4], values));
        assert_eq!(grid.corners, Some([DVec3::ZERO, DVec3::ONE]));
    }
}

//! Equirectangular environment maps.

use super::SceneError;
use super::light::luminance;
use super::reduce::area_means;
use glam::Vec3;
use std::f64::consts::PI;
use std::fmt;
use std::path::Path;

/// Radiance in all directions, bilinear between texel centres, linear RGB. Row 0 is the zenith, +y;
/// the centre of column c is at (sin φ sin θ, cos θ, −cos φ sin θ), φ = 2π (c + 0.5)/width: columns
/// run to the right for a viewer inside.
#[derive(Clone, PartialEq)]
pub struct EnvironmentMap {
    /// File name.
    pub name: String,
    /// Number of columns.
    pub width: u32,
    /// Number of rows, from zenith to nadir.
    pub height: u32,
    /// Row by row, finite and non-negative.
    pub texels: Vec<Vec3>,
}

/// Prints name, size and a content hash.
impl fmt::Debug for EnvironmentMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hash = blake3::hash(bytemuck::cast_slice::<Vec3, u8>(&self.texels));
        let [width, height] = [self.width, self.height];
        write!(f, "EnvironmentMap({width} × {height}, {hash})")
    }
}

impl EnvironmentMap {
    /// Reads a linear image in any format that [`raystone_image::read_linear`] supports. Negative,
    /// infinite and NaN texels become 0, with a warning.
    ///
    /// # Errors
    /// The file cannot be read or is not an image.
    pub fn read(path: &Path, warnings: &mut Vec<String>) -> Result<Self, SceneError> {
        let malformed = |problem: String| SceneError::malformed(path, "", problem);
        super::error::open(path)?;
        super::disguise::check(path)?;
        let map = raystone_image::read_linear(path).map_err(|error| match error {
            raystone_image::ImageError::Decode { reason, .. } => malformed(reason),
            raystone_image::ImageError::UnknownFormat { .. } => SceneError::Unsupported {
                path: path.to_owned(),
                place: String::new(),
                problem: "this kind of image".to_owned(),
                advice: "give one of linear light: .exr, .hdr, .pfm or .npy",
            },
            error => malformed(error.to_string()),
        })?;
        warnings.extend(raystone_image::primaries_note(path));
        if raystone_image::is_cube_map(path) {
            let problem = "it has the six sides of a cube; make it a map by latitude and longitude: exrenvmap -l IN.exr OUT.exr";
            return Err(malformed(problem.to_owned()));
        }
        let (width, height) = (map.width, map.height);
        if width == height && width > 1 {
            warnings.push(format!(
                "{}: it is {width} × {height} texels, like pictures of mirror balls; it is taken as a map by latitude and longitude, \
                 which is twice as wide as high",
                path.display()
            ));
        }
        let texels = map.pixels.into_iter().map(Vec3::from).collect();
        Self::new(
            &path.display().to_string(),
            [width, height],
            texels,
            warnings,
        )
        .map_err(malformed)
    }

    /// Builds a map from texels, row by row; negative, infinite and NaN texels become 0.
    ///
    /// # Errors
    /// There are not exactly `width · height` texels, or none.
    pub fn new(
        name: &str,
        [width, height]: [u32; 2],
        mut texels: Vec<Vec3>,
        warnings: &mut Vec<String>,
    ) -> Result<Self, String> {
        if texels.is_empty() || texels.len() != width as usize * height as usize {
            let count = texels.len();
            return Err(format!("it has {count} texels, not {width} × {height}"));
        }
        let mut broken = 0;
        for texel in &mut texels {
            if !(texel.is_finite() && texel.min_element() >= 0.0) {
                broken += 1;
                *texel = Vec3::select(texel.is_finite_mask(), *texel, Vec3::ZERO).max(Vec3::ZERO);
            }
        }
        if broken > 0 {
            let all = texels.len();
            warnings.push(format!(
                "{name}: {broken} of {all} texels are negative, infinite or NaN in some colour, which is taken as 0"
            ));
        }
        Ok(Self {
            name: name.to_owned(),
            width,
            height,
            texels,
        })
    }

    /// Halves both sides until the map's tables fit into `bytes`, with a warning if that was
    /// needed. Texels are weighted by solid angle.
    #[must_use]
    pub fn within(self, bytes: u64, warnings: &mut Vec<String>) -> Self {
        let from = [self.width, self.height];
        let mut to = from;
        while table_bytes(to) > bytes && to != [1, 1] {
            to = to.map(|n| n.div_ceil(2));
        }
        if to == from {
            return self;
        }
        let [[width, height], [columns, rows]] = [from, to];
        warnings.push(format!(
            "{}: reduced from {width} × {height} to {columns} × {rows} texels, so that its tables fit into {bytes} bytes",
            self.name
        ));
        let texel = |at: usize| self.texels[at].extend(0.0);
        let means = area_means(from, to, texel, |row| self.solid_angle(row) as f32);
        Self {
            name: self.name.clone(),
            width: columns,
            height: rows,
            texels: means.into_iter().map(|mean| mean.truncate()).collect(),
        }
    }

    /// Solid angle of a texel in this row, in steradians.
    pub fn solid_angle(&self, row: u32) -> f64 {
        let cosine = |row: u32| (PI * f64::from(row) / f64::from(self.height)).cos();
        2.0 * PI / f64::from(self.width) * (cosine(row) - cosine(row + 1))
    }

    /// Sampling weights, row by row: mean luminance over the (bilinear) texel times solid angle.
    pub fn weights(&self) -> Vec<f64> {
        let [w, h] = [self.width, self.height];
        let light: Vec<f64> = self.texels.iter().map(|t| luminance(*t)).collect();
        let at = |x: u32, y: u32| light[(y * w + x) as usize];
        // Linear from centre to centre, hence weights 1/8, 3/4 and 1/8 of three neighbours.
        let along = |x: u32, y: u32| {
            0.75 * at(x, y) + 0.125 * (at((x + w - 1) % w, y) + at((x + 1) % w, y))
        };
        let places = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
        places
            .map(|(x, y)| {
                let [above, below] = [y.saturating_sub(1), (y + 1).min(h - 1)];
                let mean = 0.75 * along(x, y) + 0.125 * (along(x, above) + along(x, below));
                mean * self.solid_angle(y)
            })
            .collect()
    }
}

/// Bytes of a map of this size in `shading_tables`: texels and alias tables.
fn table_bytes([width, height]: [u32; 2]) -> u64 {
    let [w, h] = [width, height].map(u64::from);
    16 + 16 * w * h + 8 * (h.next_power_of_two() + h * w.next_power_of_two())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_texels_are_counted_and_black() {
        let mut texels = vec![Vec3::ONE; 8];
        texels[3] = Vec3::new(f32::NAN, 2.0, -1.0);
        texels[5] = Vec3::new(1.0, f32::INFINITY, 1.0);
        let mut warnings = Vec::new();
        let map = EnvironmentMap::new("sky.hdr", [4, 2], texels, &mut warnings).expect("a map");
        assert_eq!(map.texels[3], Vec3::new(0.0, 2.0, 0.0));
        assert_eq!(map.texels[5], Vec3::new(1.0, 0.0, 1.0));
        assert!(
            warnings[0].contains("sky.hdr: 2 of 8 texels"),
            "{warnings:?}"
        );
        assert!(EnvironmentMap::new("x", [4, 2], vec![Vec3::ONE; 7], &mut warnings).is_err());
    }

    #[test]
    fn an_even_map_has_weights_of_its_solid_angle() {
        let mut warnings = Vec::new();
        let size = [5, 4];
        let map =
            EnvironmentMap::new("x", size, vec![Vec3::ONE; 20], &mut warnings).expect("a map");
        let sum: f64 = map.weights().iter().sum();
        assert!(
            (sum / (4.0 * PI * luminance(Vec3::ONE)) - 1.0).abs() < 1e-12,
            "{sum}"
        );
        assert!(warnings.is_empty());
    }

    #[test]
    fn maps_are_halved_until_they_fit_and_keep_their_light() {
        let mut warnings = Vec::new();
        // Bright at the pole, where texels are small.
        let texel = |k: usize| Vec3::splat([9.0, 1.0, 0.0, 4.0][k / 8] + (k % 2) as f32);
        let texels = (0..32).map(texel).collect();
        let map = EnvironmentMap::new("x", [8, 4], texels, &mut warnings).expect("a map");
        let light = |map: &EnvironmentMap| -> f64 {
            let texels = map.texels.iter().enumerate();
            texels
                .map(|(k, t)| f64::from(t.x) * map.solid_angle(k as u32 / map.width))
                .sum()
        };
        let before = light(&map);
        assert_eq!(table_bytes([8, 4]), 16 + 512 + 8 * (4 + 32));
        let same = map.clone().within(table_bytes([8, 4]), &mut warnings);
        assert!(same == map && warnings.is_empty());
        let half = map.clone().within(table_bytes([8, 4]) - 1, &mut warnings);
        assert_eq!(([half.width, half.height], warnings.len()), ([4, 2], 1));
        assert!((light(&half) / before - 1.0).abs() < 1e-6);
        let least = map.within(0, &mut warnings);
        assert!(least.texels.len() == 1 && (light(&least) / before - 1.0).abs() < 1e-6);
        // Software adapters still bind a map of 2048 × 1024, but not of twice that size.
        let all = crate::LEAST_BINDING - (8 << 20);
        assert!(table_bytes([2048, 1024]) <= all && table_bytes([4096, 2048]) > all);
    }
}

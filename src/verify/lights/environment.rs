//! Radiance from all around by an equirectangular map.
//!
//! The texel chosen by a number depends on the order in which an alias table was built, so the
//! table is read as data, in the integer format of docs/shading.md. The probability of each texel
//! is counted from it, which exposes a table whose weights differ from the kernels' divisors, and a
//! density that does not match the table.

use super::delta::FAR;
use super::{LightChecks, LightTwin};
use crate::known_images::closed::{map_irradiance, map_radiance};
use crate::known_images::lamps::{NEAR, path, reflected};
use crate::known_images::lights::image;
use crate::known_images::{KnownImage, View};
use crate::mitsuba::{Export, ExportError};
use crate::path_oracle::light::UNITS;
use crate::path_oracle::{LightSample, Rounding};
use crate::trial_lights;
use crate::trial_scenes::Trial;
use glam::{DVec3, Vec3, vec3};
use raystone_image::Image;
use raystone_render::environment_aliases;
use raystone_scene::{EnvironmentMap, LIGHT_KINDS, Light, SceneError};
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::sync::Arc;

pub(super) static CHECKS: LightChecks = LightChecks {
    trials: trial_lights::skies,
    images,
    ..LightChecks::new(LIGHT_KINDS[7], LightTwin::Map, mitsuba)
};

/// The same bilinear function. Mitsuba's rows go from pole to pole, ours have centres half a row
/// inside, so every other of `2 n + 1` rows is one of ours. Columns match.
fn mitsuba(export: &mut Export<'_>, _: usize, light: &Light) -> Result<(), ExportError> {
    let Light::Environment { map, scale, turn } = light else {
        return Ok(());
    };
    let (width, height) = (map.width, 2 * map.height + 1);
    let texel = |x: u32, y: u32| map.texels[(y * width + x) as usize];
    let between = |at: u32| {
        let (x, y) = (at % width, at / width);
        let [above, below] = [y.saturating_sub(1) / 2, (y / 2).min(map.height - 1)];
        (0.5 * (texel(x, above) + texel(x, below))).to_array()
    };
    let texels = (0..width * height).map(between).collect();
    let name = "textures/environment.exr";
    export.write_radiance(name, &Image::new(width, height, texels)?)?;
    let _ = write!(
        export.xml,
        r#"    <emitter type="envmap">
        <string name="filename" value="{name}"/>
        <float name="scale" value="{scale}"/>
        <transform name="to_world">
            <rotate y="1" angle="{}"/>
        </transform>
    </emitter>
"#,
        turn.to_degrees()
    );
    Ok(())
}

/// An alias table: threshold and alias of each part, and the probability of each entry.
struct Aliases {
    parts: Vec<(u32, usize)>,
    /// Values of a number in each part.
    size: u32,
    shares: Vec<f64>,
}

impl Aliases {
    fn new(parts: Vec<(u32, usize)>) -> Self {
        let size = (UNITS / parts.len() as f64) as u32;
        let mut shares = vec![0.0; parts.len()];
        for (part, (own, alias)) in parts.iter().enumerate() {
            shares[part] += f64::from(*own) / UNITS;
            shares[*alias] += f64::from(size - own) / UNITS;
        }
        Self {
            parts,
            size,
            shares,
        }
    }

    /// The entry for a number in [0, 1), and the number's relative position in its range.
    fn choose(&self, u: f64) -> (usize, f64) {
        let value = (u * UNITS).clamp(0.0, UNITS - 1.0) as u32;
        let part = (value / self.size) as usize;
        let place = value % self.size;
        let (own, alias) = self.parts[part];
        let along = |place: u32, of: u32| (f64::from(place) + 0.5) / f64::from(of);
        if place < own {
            (part, along(place, own))
        } else {
            (alias, along(place - own, self.size - own))
        }
    }
}

/// A map with its sampling tables.
pub(crate) struct Map {
    map: Arc<EnvironmentMap>,
    scale: f64,
    turn: f64,
    rows: Aliases,
    /// One per row.
    columns: Vec<Aliases>,
}

impl Map {
    /// The map of a light, if it is an environment.
    pub(crate) fn of(light: &Light) -> Option<Self> {
        let Light::Environment { map, scale, turn } = light else {
            return None;
        };
        Some(Self::new(map, *scale, *turn))
    }

    fn new(map: &Arc<EnvironmentMap>, scale: f32, turn: f32) -> Self {
        let parts: Vec<(u32, usize)> = (environment_aliases(map).into_iter())
            .map(|(threshold, alias)| (threshold, alias as usize))
            .collect();
        let [width, height] = [map.width, map.height].map(|n| n.next_power_of_two() as usize);
        let (rows, columns) = parts.split_at(height);
        let of_row = |row: &[(u32, usize)]| Aliases::new(row.to_vec());
        Self {
            map: Arc::clone(map),
            scale: scale.into(),
            turn: turn.into(),
            rows: of_row(rows),
            columns: columns.chunks(width).map(of_row).collect(),
        }
    }

    fn size(&self) -> [f64; 2] {
        [self.map.width.into(), self.map.height.into()]
    }

    fn solid_angle(&self, row: usize) -> f64 {
        let [width, height] = self.size();
        let cosine = |row: usize| (PI * row as f64 / height).cos();
        TAU / width * (cosine(row) - cosine(row + 1))
    }

    /// Column and row of a direction, continuous over the map.
    fn place(&self, d: DVec3) -> [f64; 2] {
        let [width, height] = self.size();
        // The poles have no azimuth: they map to the first column, however the map is turned.
        let around = if d.x == 0.0 && d.z == 0.0 {
            0.0
        } else {
            (d.x.atan2(-d.z) + self.turn).rem_euclid(TAU)
        };
        let down = d.x.hypot(d.z).atan2(d.y);
        [around / TAU * width, down / PI * height]
    }

    /// Bilinear between texel centres.
    pub(crate) fn radiance(&self, direction: DVec3) -> DVec3 {
        let [x, y] = self.place(direction);
        let (width, height) = (self.map.width as usize, self.map.height as usize);
        let (x, y) = (x - 0.5, (y - 0.5).clamp(0.0, height as f64 - 1.0));
        let left = x.floor().rem_euclid(width as f64) as usize;
        let above = y as usize;
        let (s, t) = (x - x.floor(), y - above as f64);
        let texel = |column: usize, row: usize| {
            let at = row.min(height - 1) * width + column % width;
            self.map.texels[at].as_dvec3()
        };
        let along = |row: usize| texel(left, row) * (1.0 - s) + texel(left + 1, row) * s;
        self.scale * (along(above) * (1.0 - t) + along(above + 1) * t)
    }

    /// The texel of a direction, and the density of light sampling for it.
    pub(crate) fn density(&self, direction: DVec3) -> (usize, f64) {
        let [x, y] = self.place(direction);
        let (width, height) = (self.map.width as usize, self.map.height as usize);
        let (column, row) = ((x as usize).min(width - 1), (y as usize).min(height - 1));
        (row * width + column, self.density_of(column, row))
    }

    fn density_of(&self, column: usize, row: usize) -> f64 {
        self.rows.shares[row] * self.columns[row].shares[column] / self.solid_angle(row)
    }

    /// A sampled direction: `v` chooses the row and the position along it, `u` the column.
    pub(crate) fn sample(
        &self,
        [u, v]: [f64; 2],
        rounding: &mut Rounding,
    ) -> (usize, Option<LightSample>) {
        let [width, height] = self.size();
        let (row, down) = self.rows.choose(rounding.share(v));
        let (column, along) = self.columns[row].choose(rounding.share(u));
        let edge = |row: usize| (PI * row as f64 / height).cos();
        let cos = edge(row) + down * (edge(row + 1) - edge(row));
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let around = TAU * (column as f64 + along) / width - self.turn;
        let direction = DVec3::new(around.sin() * sin, cos, -around.cos() * sin);
        let direction = rounding.direction(direction);
        let density = self.density_of(column, row);
        let sample = LightSample {
            direction,
            distance: FAR,
            radiance: self.radiance(direction),
            density: Some(density),
            triangles: None,
        };
        let texel = row * self.map.width as usize + column;
        (texel, (density > 0.0).then_some(sample))
    }
}

fn images() -> Result<Vec<KnownImage>, SceneError> {
    [("map", "mis-balance"), ("map, by the light", "light")]
        .map(|(name, strategy)| shown(name, path(1, &[("strategy", strategy)])))
        .into_iter()
        .collect()
}

/// A turned map that is brighter towards one side and the horizon.
fn shown(name: &'static str, trial: Trial) -> Result<KnownImage, SceneError> {
    const TURN: f32 = 0.4;
    let texel = |k: u32| {
        let (x, y) = ((k % 12) as f32, (k / 12) as f32);
        let sun = if (x, y) == (3.0, 1.0) { 4.0 } else { 0.0 };
        vec3(0.2 + 0.1 * x, 0.3 + 0.3 * y + sun, 1.5 - 0.1 * x)
    };
    let texels = (0..72).map(texel).collect();
    let map = EnvironmentMap::new("map", [12, 6], texels, &mut Vec::new());
    let map = map.map_err(|e| SceneError::malformed(std::path::Path::new("map"), "", e))?;
    let turn = f64::from(TURN);
    let floor = reflected(map_irradiance(&map, turn));
    let mut views = vec![View::new("floor", Vec3::ZERO, NEAR, floor)];
    for (polar, azimuth) in [(0.3_f64, 0.2_f64), (1.1, 2.0), (1.4, 4.4)] {
        let (sin, cos) = polar.sin_cos();
        let direction = DVec3::new(azimuth.sin() * sin, cos, -azimuth.cos() * sin).as_vec3();
        let seen = map_radiance(&map, turn, polar, azimuth);
        let eye = Vec3::Y;
        views.push(View::new("sky", eye + direction, -direction, seen));
    }
    let lights = vec![Light::Environment {
        map: Arc::new(map),
        scale: 1.0,
        turn: TURN,
    }];
    image(name, lights, trial, views)
}

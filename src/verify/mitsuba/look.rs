//! Materials, textures and skies for Mitsuba.

use super::{Export, ExportError, vector};
use crate::materials::DIFFUSE_CHECKS;
use glam::Vec3;
use raystone_image::{Image, Picture};
use raystone_scene::{AlphaMask, Daylight, Material, SceneData, Texture, TextureUse, Wrap};
use std::f32::consts::{PI, TAU};
use std::fmt::Write as _;

/// Python base code of the materials that Mitsuba lacks, and the file name for all of them.
const OPAQUE: &str = include_str!("opaque.py");
const MATERIALS_FILE: &str = "materials.py";

/// Texels of a written mask per texel of its image, on each axis.
const FINER: u32 = 4;

/// Size of the map that replaces a gradient sky, texels.
const SKY_SIZE: [u32; 2] = [1024, 512];

impl Export<'_> {
    /// The material as a BSDF named by its number, two-sided as in our kernels.
    pub(super) fn material(&mut self, scene: &SceneData, id: usize) -> Result<(), ExportError> {
        let material = &scene.materials[id];
        let color = self.color(scene, id)?;
        let known = self.kinds.materials.get(material.kind.name);
        let kind = known.unwrap_or(&DIFFUSE_CHECKS);
        if !kind.python.is_empty() {
            self.teach()?;
        }
        if known.is_none() {
            self.warnings.push(format!(
                "material {}: {} has no counterpart in Mitsuba, written as diffuse",
                material.name, material.kind.name
            ));
        }
        if material.texture_uses()[1..].iter().any(Option::is_some) {
            self.warnings.push(format!(
                "material {}: of its textures only that of the base colour is written",
                material.name
            ));
        }
        let wraps = material.base_color_texture.map(|of| of.wrap);
        if wraps.is_some_and(|wrap| wrap != [Wrap::Repeat; 2]) {
            self.warnings.push(format!(
                "material {}: its texture repeats in Mitsuba",
                material.name
            ));
        }
        let name = format!("id=\"material-{id}\"");
        let opening = self.mask(scene, id, &name)?;
        // The mask carries the name and wraps the material it cuts.
        let (id, closing) = if opening {
            (String::new(), "    </bsdf>\n")
        } else {
            (name, "")
        };
        self.xml += &(kind.mitsuba)(material, &color, &id, &mut self.warnings);
        self.xml += closing;
        Ok(())
    }

    /// Writes the material kinds that Mitsuba lacks, once.
    fn teach(&mut self) -> Result<(), ExportError> {
        if !self.needs_materials {
            self.needs_materials = true;
            let kinds = self.kinds.materials.iter().map(|kind| kind.python);
            let texts: Vec<&str> = kinds.filter(|text| !text.is_empty()).collect();
            let python = OPAQUE.to_owned() + &texts.join("\n\n");
            self.write(MATERIALS_FILE, python.as_bytes())?;
            self.warnings.push(format!(
                "some materials are those of {MATERIALS_FILE}, which has to be imported in Python before the scene is loaded"
            ));
        }
        Ok(())
    }

    /// Opens the mask of a material and writes its image, if it has one.
    fn mask(&mut self, scene: &SceneData, id: usize, name: &str) -> Result<bool, ExportError> {
        let material = &scene.materials[id];
        let Some(mask) = &material.mask else {
            return Ok(false);
        };
        let moved = |of: TextureUse| (of.linear, of.offset);
        let color = material.base_color_texture.map(moved);
        if mask.texture.map(moved) != color && color.is_some() {
            self.warnings.push(format!(
                "material {}: its mask lies where its base colour does in Mitsuba",
                material.name
            ));
        }
        if material.emission != Vec3::ZERO {
            self.warnings.push(format!(
                "material {}: Mitsuba's emitters shine where masks cut them out, too",
                material.name
            ));
        }
        let file = format!("textures/{id}-mask.png");
        self.write_picture(&file, &cut(mask, &scene.textures))?;
        let wrap = match mask.texture.map(|of| of.wrap[0]) {
            Some(Wrap::Mirrored) => "mirror",
            Some(Wrap::Clamp) => "clamp",
            _ => "repeat",
        };
        let _ = write!(
            self.xml,
            r#"    <bsdf type="mask" {name}>
        <texture name="opacity" type="bitmap">
            <string name="filename" value="{file}"/>
            <string name="filter_type" value="nearest"/>
            <string name="wrap_mode" value="{wrap}"/>
            <boolean name="raw" value="true"/>
        </texture>
"#
        );
        Ok(true)
    }

    /// The base colour: constant, or a texture file. Mitsuba cannot multiply colours, so a texture
    /// with a factor is written as the product, in floats.
    fn color(&self, scene: &SceneData, id: usize) -> Result<Color, ExportError> {
        let material = &scene.materials[id];
        let factor = material.base_color;
        let texture = material
            .base_color_texture
            .map(|used| used.texture as usize);
        let Some(texture) = texture.and_then(|index| scene.textures.get(index)) else {
            return Ok(Color::Constant(factor));
        };
        if factor == Vec3::ONE {
            let name = format!("textures/{id}.png");
            self.write_picture(&name, &picture(texture))?;
            return Ok(Color::Texture(name));
        }
        let name = format!("textures/{id}.exr");
        self.write_radiance(&name, &product(texture, factor)?)?;
        Ok(Color::Texture(name))
    }

    pub(super) fn sky(&mut self, scene: &SceneData) -> Result<(), ExportError> {
        if scene.environment == Vec3::ZERO {
            return Ok(());
        }
        let Some(daylight) = &scene.daylight else {
            let radiance = vector(scene.environment);
            let _ = write!(
                self.xml,
                r#"    <emitter type="constant">
        <rgb name="radiance" value="{radiance}"/>
    </emitter>
"#
            );
            return Ok(());
        };
        if daylight.reach < f32::MAX {
            let warning = "the sky is seen through what is far, which Mitsuba cannot: the room will be darker";
            self.warnings.push(warning.to_owned());
        }
        self.write_radiance("textures/sky.exr", &sky_image(daylight, scene.environment)?)?;
        self.xml += r#"    <emitter type="envmap">
        <string name="filename" value="textures/sky.exr"/>
    </emitter>
"#;
        Ok(())
    }
}

/// A reflectance.
pub enum Color {
    /// Linear RGB.
    Constant(Vec3),
    /// A file in the exported folder.
    Texture(String),
}

impl Color {
    /// This colour as an element with this name.
    pub fn named(&self, name: &str) -> String {
        match self {
            Self::Constant(color) => {
                format!("<rgb name=\"{name}\" value=\"{}\"/>", vector(*color))
            }
            Self::Texture(file) => format!(
                "<texture name=\"{name}\" type=\"bitmap\"><string name=\"filename\" value=\"{file}\"/></texture>"
            ),
        }
    }
}

/// A material of Python's class `raystone-<kind>`, which takes the same numbers in the same order.
pub fn by_formula(material: &Material, color: &Color, id: &str, _: &mut Vec<String>) -> String {
    let kind = material.kind.name;
    let mut text = format!(
        "    <bsdf type=\"raystone-{kind}\" {id}>\n        {}\n",
        color.named("base")
    );
    for (k, value) in material.parameters.iter().enumerate() {
        let _ = writeln!(text, "        <float name=\"p{k}\" value=\"{value}\"/>");
    }
    text + "    </bsdf>\n"
}

fn picture(texture: &Texture) -> Picture {
    Picture {
        width: texture.width,
        height: texture.height,
        pixels: texture
            .texels
            .iter()
            .map(|[r, g, b, _]| [*r, *g, *b])
            .collect(),
    }
}

/// White where the surface exists, the alpha where that is its probability, with [`FINER`] texels
/// per image texel in each direction: Mitsuba's masks have no cutoff.
fn cut(mask: &AlphaMask, textures: &[Texture]) -> Picture {
    let texture = mask
        .texture
        .and_then(|of| textures.get(of.texture as usize));
    let size = texture.map_or([1, 1], |t| [t.width, t.height].map(|n| n * FINER));
    let wraps = mask.texture.map_or([Wrap::Repeat; 2], |of| of.wrap);
    let beside = |at: i64, axis: usize| {
        let count = i64::from(size[axis] / FINER);
        let inside = match wraps[axis] {
            Wrap::Repeat => at.rem_euclid(count),
            Wrap::Mirrored | Wrap::Clamp => at.clamp(0, count - 1),
        };
        inside as usize
    };
    let alpha = |x: i64, y: i64| {
        let texel = texture.map(|t| t.texels[beside(y, 1) * t.width as usize + beside(x, 0)]);
        texel.map_or(1.0, |texel| f64::from(mask.channel.value(texel)) / 255.0)
    };
    let pixel = |k: u32| {
        let [x, y] =
            [k % size[0], k / size[0]].map(|n| (f64::from(n) + 0.5) / f64::from(FINER) - 0.5);
        let (column, row) = (x.floor(), y.floor());
        let (fx, fy) = (x - column, y - row);
        let (column, row) = (column as i64, row as i64);
        let line = |row| alpha(column, row) * (1.0 - fx) + alpha(column + 1, row) * fx;
        let found = line(row) * (1.0 - fy) + line(row + 1) * fy;
        let alpha = found * f64::from(mask.factor);
        match mask.cutoff.map(f64::from) {
            Some(cutoff) => [if alpha >= cutoff { 255 } else { 0 }; 3],
            None => [(255.0 * alpha).round() as u8; 3],
        }
    };
    Picture {
        width: size[0],
        height: size[1],
        pixels: (0..size[0] * size[1]).map(pixel).collect(),
    }
}

/// The linear texels times `factor`.
fn product(texture: &Texture, factor: Vec3) -> Result<Image, ExportError> {
    let linear = |[r, g, b, _]: &[u8; 4]| {
        let color = Vec3::from([r, g, b].map(|v| decoded(*v)));
        (factor * color).to_array()
    };
    let texels = texture.texels.iter().map(linear).collect();
    Ok(Image::new(texture.width, texture.height, texels)?)
}

/// The sky as a map of directions in Mitsuba's convention: from +y in the first row to −y in the
/// last, the middle of the first column at −z, continuing to +x.
fn sky_image(daylight: &Daylight, scale: Vec3) -> Result<Image, ExportError> {
    let [width, height] = SKY_SIZE;
    let texel = |at: u32| {
        let (column, row) = (at % width, at / width);
        let phi = TAU * (column as f32 + 0.5) / width as f32;
        let theta = PI * row as f32 / (height - 1) as f32;
        let (sin, cos) = theta.sin_cos();
        let direction = Vec3::new(phi.sin() * sin, cos, -phi.cos() * sin);
        (scale * sky_radiance(daylight, direction)).to_array()
    };
    Ok(Image::new(
        width,
        height,
        (0..width * height).map(texel).collect(),
    )?)
}

/// A component of an sRGB texel as linear radiance (IEC 61966-2-1).
fn decoded(encoded: u8) -> f32 {
    let encoded = f32::from(encoded) / 255.0;
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// The sky of `kernels/shading/light/sky.wesl` in a direction, times a white environment.
fn sky_radiance(sky: &Daylight, direction: Vec3) -> Vec3 {
    let t = ((direction.dot(sky.up) + 0.6) / 1.4).clamp(0.0, 1.0);
    let grey = 0.12 + 0.38 * t * t * (3.0 - 2.0 * t);
    let key = 10.0 * direction.dot(sky.key).max(0.0).powi(16);
    Vec3::splat(grey) + key * Vec3::new(1.0, 0.96, 0.9)
}

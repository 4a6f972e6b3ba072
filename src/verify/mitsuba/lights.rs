//! Lights without triangles in Mitsuba's words.

use super::{Export, ExportError, vector};
use glam::{Vec2, Vec3};
use raystone_image::Image;
use raystone_scene::{EnvironmentMap, Light, SceneData};
use std::fmt::Write as _;

/// Width and height of the picture that a spot throws: it fades from the middle to the edge in so many texels.
const SPOT_EDGE: u32 = 512;

impl Export<'_> {
    /// Every light that shines.
    ///
    /// # Errors
    /// [`ExportError::Light`] names one that Mitsuba cannot express.
    pub(super) fn lights(&mut self, scene: &SceneData) -> Result<(), ExportError> {
        let all = scene.lights.iter().enumerate();
        for (number, light) in all.filter(|(_, light)| light.problem().is_none()) {
            self.light(scene, number, light)?;
        }
        Ok(())
    }

    fn light(
        &mut self,
        scene: &SceneData,
        number: usize,
        light: &Light,
    ) -> Result<(), ExportError> {
        let refused = |reason| {
            let kind = light.kind().name;
            Err(ExportError::Light {
                number,
                kind,
                reason,
            })
        };
        let colour = vector(light.color());
        match light {
            Light::Sphere { center, radius, .. } => {
                let inside = |v: &Vec3| v.distance(*center) < *radius;
                let mut corners = scene.triangles.iter().flat_map(|t| &t.vertices);
                if corners.any(inside) {
                    return refused("something is inside, where Mitsuba's spheres do not shine");
                }
                let _ = write!(
                    self.xml,
                    r#"    <shape type="sphere">
        <point name="center" value="{}"/>
        <float name="radius" value="{radius}"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="{colour}"/></emitter>
    </shape>
"#,
                    vector(*center)
                );
            }
            Light::Point { position, .. } => {
                let _ = write!(
                    self.xml,
                    r#"    <emitter type="point">
        <point name="position" value="{}"/>
        <rgb name="intensity" value="{colour}"/>
    </emitter>
"#,
                    vector(*position)
                );
            }
            Light::Directional { direction, .. } => {
                let _ = write!(
                    self.xml,
                    r#"    <emitter type="directional">
        <vector name="direction" value="{}"/>
        <rgb name="irradiance" value="{colour}"/>
    </emitter>
"#,
                    vector(*direction)
                );
            }
            Light::Spot { decay: false, .. } => {
                return refused("all of Mitsuba's spots fall off with the distance");
            }
            Light::Spot { outer, .. } if *outer >= 1.5 => {
                return refused("a cone of 86 degrees or more throws no picture on a plane");
            }
            Light::Spot {
                position,
                direction,
                inner,
                outer,
                ..
            } => self.spot(number, [*position, *direction], [*inner, *outer], &colour)?,
            Light::Ies { .. } => {
                return refused("it has no lights with the intensities of a file");
            }
            Light::Environment { map, scale, turn } => self.environment(map, *scale, *turn)?,
        }
        Ok(())
    }

    /// Mitsuba's spots fade linearly in the angle; one with a sharp edge throws the picture of how ours do.
    fn spot(
        &mut self,
        number: usize,
        [position, direction]: [Vec3; 2],
        [inner, outer]: [f32; 2],
        colour: &str,
    ) -> Result<(), ExportError> {
        let name = format!("textures/spot-{number}.exr");
        let [bright, dark] = [inner.cos(), outer.cos()];
        let shown = |at: u32| {
            let [x, y] = [at % SPOT_EDGE, at / SPOT_EDGE];
            let place = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) * (2.0 / SPOT_EDGE as f32) - 1.0;
            let cosine = 1.0 / (1.0 + (place * outer.tan()).length_squared()).sqrt();
            let step = ((cosine - dark) / (bright - dark).max(1e-4)).clamp(0.0, 1.0);
            [step * step; 3]
        };
        let texels = (0..SPOT_EDGE * SPOT_EDGE).map(shown).collect();
        self.write_radiance(&name, &Image::new(SPOT_EDGE, SPOT_EDGE, texels)?)?;
        let degrees = outer.to_degrees();
        let _ = write!(
            self.xml,
            r#"    <emitter type="spot">
        <transform name="to_world">
            <lookat origin="{}" target="{}" up="{}"/>
        </transform>
        <float name="cutoff_angle" value="{degrees}"/>
        <float name="beam_width" value="{degrees}"/>
        <rgb name="intensity" value="{colour}"/>
        <texture name="texture" type="bitmap">
            <string name="filename" value="{name}"/>
            <boolean name="raw" value="true"/>
            <string name="wrap_mode" value="clamp"/>
        </texture>
    </emitter>
"#,
            vector(position),
            vector(position + direction.normalize()),
            vector(direction.normalize().any_orthonormal_vector())
        );
        Ok(())
    }

    /// The same bilinear function: Mitsuba's rows go from pole to pole, ours have their centres half a row inside, so that every other
    /// row of twice as many and one is one of ours. Columns run the same way.
    fn environment(
        &mut self,
        map: &EnvironmentMap,
        scale: f32,
        turn: f32,
    ) -> Result<(), ExportError> {
        let (width, height) = (map.width, 2 * map.height + 1);
        let texel = |x: u32, y: u32| map.texels[(y * width + x) as usize];
        let between = |at: u32| {
            let (x, y) = (at % width, at / width);
            let [above, below] = [y.saturating_sub(1) / 2, (y / 2).min(map.height - 1)];
            (0.5 * (texel(x, above) + texel(x, below))).to_array()
        };
        let texels = (0..width * height).map(between).collect();
        let name = "textures/environment.exr";
        self.write_radiance(name, &Image::new(width, height, texels)?)?;
        let _ = write!(
            self.xml,
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
}

//! A second file of each format: what stands for values that a file leaves out, other types of numbers, and orders of transforms.

use super::{OF_COLORS, Values, part};
use crate::colors::decode_color;
use crate::known_scenes::with;
use crate::light::Light;
use crate::{SceneData, decode_normal};
use glam::{DVec3, Vec3};
use raystone_core::params::ParamValue;
use std::f64::consts::{FRAC_PI_4, PI};

/// What each of them is, in turn.
pub(super) fn values(all: &mut Values) -> Result<(), String> {
    let read = |name: &str| crate::named(name).map_err(|e| e.to_string());
    all.bare_gltf(&read("known:/b.gltf")?)?;
    all.wide_ply(&read("known:/b.ply")?)?;
    all.bare_nori(&read("known:/b.xml")?)?;
    all.grids()
}

impl Values {
    /// A sun in lux along what its node is turned to, whatever that is scaled by; a spot light in candela without angles. Without
    /// an aspect the angle of a camera is as high as with one. Whole numbers that are scaled, turned by 90° about z, and moved.
    fn bare_gltf(&mut self, scene: &SceneData) -> Result<(), String> {
        let (eye, forward) = ([0.0; 3], [0.0, 0.0, -1.0]);
        self.camera("camera of glTF", scene, eye, forward, 0.5_f64.to_degrees())?;
        let sun = part(&scene.lights, 0, "lights")?;
        if let Light::Directional {
            direction,
            irradiance,
        } = sun
        {
            let along = direction.normalize_or_zero();
            self.vector("direction of a sun", along, [-1.0, 0.0, 0.0]);
            self.vector("irradiance of a sun", *irradiance, [4.0, 2.0, 1.0]);
        }
        let spot = part(&scene.lights, 1, "lights")?;
        if let Light::Spot {
            intensity,
            inner,
            outer,
            ..
        } = spot
        {
            self.vector("intensity of a bare spot light", *intensity, [1.0; 3]);
            let angles = Vec3::new(*inner, *outer, 0.0);
            let expected = [0.0, FRAC_PI_4, 0.0];
            self.vector("angles of a bare spot light", angles, expected);
        }
        let kinds = matches!((sun, spot), (Light::Directional { .. }, Light::Spot { .. }));
        (self.0).push(("kinds of lights", f64::from(kinds), 1.0));
        let turned = [[1.0, 2.0, 3.0], [-2.0, 4.0, 7.0], [1.0, 6.0, 3.0]];
        self.corners("triangle of a node", scene, 0, turned)?;
        let uvs = part(&scene.uvs, 2, "coordinates")?;
        for (found, expected) in uvs.iter().zip([[0.0, 0.0], [1.0, 0.2], [0.0, 1.0]]) {
            let [u, v] = expected;
            self.vector("whole coordinates of glTF", found.extend(0.0), [u, v, 0.0]);
        }
        self.bare_materials(scene)
    }

    /// Rough white metal; gloss is what roughness lacks; a mask cuts at one half; light has its factor.
    fn bare_materials(&mut self, scene: &SceneData) -> Result<(), String> {
        let of = |index: usize| part(&scene.materials, index, "materials");
        let rough = |index: usize| -> Result<_, String> {
            let source = &of(index)?.source;
            Ok([source.roughness, source.metallic].map(|x| x.map_or(-1.0, f64::from)))
        };
        let [roughness, metallic] = rough(0)?;
        self.0
            .push(("roughness of a bare material", roughness, 1.0));
        self.0.push(("metal of a bare material", metallic, 1.0));
        self.vector("colour of a bare material", of(0)?.base_color, [1.0; 3]);
        (self.0).push(("roughness of a gloss", rough(1)?[0], 0.75));
        let specular = Vec3::from(of(1)?.source.specular.unwrap_or([-1.0; 3]));
        self.vector("specular colour of a gloss", specular, [0.5, 0.25, 0.125]);
        // By Khronos's converter: https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Archived/KHR_materials_pbrSpecularGlossiness/examples
        let metallic = f64::from(*part(&of(1)?.parameters, 0, "parameters")?);
        self.0
            .push(("metal of a gloss", metallic, 0.766_204_538_683_868_5));
        let base = [
            0.467_926_683_321_688,
            0.368_365_368_373_841,
            0.364_579_620_761_474,
        ];
        self.vector("colour of a gloss", of(1)?.base_color, base);
        let mask = of(2)?.mask.ok_or("a known material has no mask")?;
        let cut = Vec3::new(mask.factor, mask.cutoff.unwrap_or(-1.0), 0.0);
        self.vector("factor and cut of a mask", cut, [0.75, 0.5, 0.0]);
        self.vector("emission of a factor", of(3)?.emission, [1.0, 0.5, 0.25]);
        Ok(())
    }

    /// Of 65535 a fifth, as a byte of sRGB; two triangles of a quad, of which the second is not level as its normals are.
    fn wide_ply(&mut self, scene: &SceneData) -> Result<(), String> {
        let colors = part(&scene.colors, 0, "colours")?.map(decode_color);
        let expected = [[1.0, 0.0, 0.0], [0.0, 0.033_104_767, 0.0], [0.0, 0.0, 1.0]];
        for (found, expected) in colors.into_iter().zip(expected) {
            let near = found.distance(DVec3::from_array(expected)) < OF_COLORS;
            (self.0).push(("agreement of a wide colour of PLY", f64::from(near), 1.0));
        }
        let first = [[0.0, 0.0, 0.0], [2.5, 0.0, 0.0], [2.5, 1.5, 0.0]];
        self.corners("triangle of PLY", scene, 0, first)?;
        let count = scene.triangles.len() as f64;
        self.0.push(("number of triangles of PLY", count, 2.0));
        let normal = decode_normal(part(&scene.normals, 1, "normals")?[0]).unwrap_or_default();
        self.vector("normal of PLY", normal.as_vec3(), [0.0, 0.0, 1.0]);
        Ok(())
    }

    /// The width is seen under 30°, and the height is twice as much. What is moved first is scaled as well.
    fn bare_nori(&mut self, scene: &SceneData) -> Result<(), String> {
        let fov = 2.0 * (2.0 * (PI / 12.0).tan()).atan().to_degrees();
        let (eye, forward) = ([0.0, 0.0, 10.0], [0.0, 0.0, -1.0]);
        self.camera("upright camera of Nori", scene, eye, forward, fov)?;
        let first = [[2.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 0.0, 8.0]];
        self.corners("moved triangle of Nori", scene, 0, first)?;
        let of = |index: usize| part(&scene.materials, index, "materials");
        let ior = part(&of(0)?.parameters, 0, "parameters")?;
        self.0.push(("index of Nori's glass", f64::from(*ior), 1.5));
        let alpha = part(&of(1)?.parameters, 3, "parameters")?;
        self.0.push(("alpha of Nori", f64::from(*alpha), 0.25));
        // What a microfacet has without being told: BK7 in air.
        let ior = part(&of(1)?.parameters, 4, "parameters")?;
        (self.0).push((
            "index of Nori's facets",
            f64::from(*ior),
            1.5046 / 1.000_277,
        ));
        Ok(())
    }

    /// Bytes over 255; columns before rows; and a wedge below z = x / 2, of which 4³ cells a voxel are counted.
    fn grids(&mut self) -> Result<(), String> {
        let voxels = |name: &str, side: i64| -> Result<_, String> {
            let scene = with(&[
                ("medium", ParamValue::Name(name.to_owned())),
                ("medium_voxels", ParamValue::Integer(side)),
            ])?;
            let medium = scene.media.into_iter().next();
            let volume = medium.ok_or("a known scene has no medium")?.volume;
            Ok((volume.resolution, volume.scattering))
        };
        let wedge = [0.25, 0.75, 1.0, 1.0, 0.25, 0.75, 1.0, 1.0];
        let above = [0.0, 0.0, 0.25, 0.75, 0.0, 0.0, 0.25, 0.75];
        let wedge = [wedge, above].concat();
        for (name, resolution, expected) in [
            ("known:/b.vol", [2, 1, 1], &[0.2, 1.0][..]),
            ("known:/b.npy", [1, 2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
            ("known:/b.obj", [4, 2, 2], &wedge),
        ] {
            let (size, found) = voxels(name, 4)?;
            let same = size == resolution && found.len() == expected.len();
            (self.0).push(("agreement of a grid's size", f64::from(same), 1.0));
            let pairs = found.into_iter().zip(expected);
            let pairs = pairs.map(|(found, expected)| ("voxel of a grid", found.into(), *expected));
            self.0.extend(pairs);
        }
        Ok(())
    }
}

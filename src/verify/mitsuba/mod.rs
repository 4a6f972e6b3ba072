//! Scene export for image comparisons with other renderers: [Mitsuba
//! 3](https://mitsuba.readthedocs.io), as an XML file with meshes and textures beside it.
//!
//! The other renderer gets the same integral to estimate: the same triangles in the same space, the
//! same camera, a box filter, no clipping. Mitsuba's `max_depth` counts vertices after the camera,
//! ours counts bounces: a path of `b` bounces there has depth `b + 1`. Features without a
//! counterpart are approximated, and reported.

mod look;
mod medium;
mod mesh;

pub use look::{Color, by_formula};

use crate::kinds::KindChecks;
use glam::Vec3;
use raystone_core::atomic::write_atomic;
use raystone_core::geometry::Camera;
use raystone_image::{FileFormat, Image, ImageError, Picture, write_png};
use raystone_scene::{Bounds, Light, SceneData};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Settings of an export that the scene itself does not contain.
#[derive(Debug, Clone, Copy)]
pub struct MitsubaSettings {
    /// The camera.
    pub camera: Camera,
    /// Width and height of the image, pixels.
    pub size: [u32; 2],
    /// Samples per pixel unless Mitsuba's command line sets them (`-D spp=N`).
    pub spp: u32,
    /// Maximum bounces of a path, as `path` counts them.
    pub bounces: u32,
    /// Omits the back of emitters: correct where nothing can see it, and wastes fewer samples.
    pub fronts_only: bool,
}

/// The reason why a scene could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A file or folder could not be written.
    #[error("cannot write {}: {source}; check that the folder is writable and has space", path.display())]
    Write {
        /// The path.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A light has no counterpart: the image would differ.
    #[error("light {number}, a {kind}, cannot be written for Mitsuba: {reason}")]
    Light {
        /// Its index in [`SceneData::lights`].
        number: usize,
        /// Name of its kind.
        kind: &'static str,
        /// The reason, and how to avoid it.
        reason: &'static str,
    },
    /// The medium has no counterpart.
    #[error("the medium of the scene cannot be written for Mitsuba: {0}")]
    Medium(&'static str),
    /// A texture or the sky could not be written.
    #[error(transparent)]
    Image(#[from] ImageError),
}

impl ExportError {
    /// The error for a light with this number and reason.
    pub fn light(number: usize, light: &Light, reason: &'static str) -> Self {
        let kind = light.kind().name;
        Self::Light {
            number,
            kind,
            reason,
        }
    }
}

/// Name of the XML file in the folder of an exported scene.
pub const MITSUBA_FILE: &str = "scene.xml";

/// The largest distance between the front and the back of an emitter, relative to the largest
/// coordinate of the scene. Mitsuba's area emitters are one-sided, so a two-sided one becomes two,
/// which must not coincide.
const GAP: f32 = 2e-5;

/// Writes `scene` as [`MITSUBA_FILE`] with its meshes and textures into `folder`, creating it if
/// missing. Returns a line for each thing that Mitsuba renders differently.
///
/// # Errors
/// [`ExportError`] with the file that could not be written.
pub fn export_mitsuba(
    scene: &SceneData,
    settings: &MitsubaSettings,
    folder: &Path,
) -> Result<Vec<String>, ExportError> {
    export_mitsuba_of(&KindChecks::default(), scene, settings, folder)
}

/// The same for a scene with these kinds of materials and lights.
///
/// # Errors
/// As [`export_mitsuba`].
pub fn export_mitsuba_of(
    kinds: &KindChecks,
    scene: &SceneData,
    settings: &MitsubaSettings,
    folder: &Path,
) -> Result<Vec<String>, ExportError> {
    let mut export = Export {
        folder,
        kinds,
        scene,
        warnings: Vec::new(),
        needs_materials: false,
        xml: String::new(),
    };
    for name in ["", "meshes", "textures"] {
        let path = folder.join(name);
        std::fs::create_dir_all(&path).map_err(unwritable(&path))?;
    }
    export.xml += "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<scene version=\"3.0.0\">\n";
    export.view(scene, settings);
    if !scene.colors.is_empty() {
        let warning = "colours of vertices are left out: Mitsuba draws the base colours alone";
        export.warnings.push(warning.to_owned());
    }
    export.sky(scene)?;
    for id in 0..scene.materials.len() {
        export.material(scene, id)?;
    }
    export.media()?;
    export.lights()?;
    export.shapes(scene, settings.fronts_only)?;
    export.xml += "</scene>\n";
    let path = folder.join(MITSUBA_FILE);
    write_atomic(&path, export.xml.as_bytes()).map_err(unwritable(&path))?;
    Ok(export.warnings)
}

/// An export in progress.
pub struct Export<'a> {
    folder: &'a Path,
    kinds: &'a KindChecks,
    /// The exported scene.
    pub scene: &'a SceneData,
    warnings: Vec<String>,
    /// True if a material needs a Python definition.
    needs_materials: bool,
    /// The XML text so far.
    pub xml: String,
}

impl Export<'_> {
    fn view(&mut self, scene: &SceneData, settings: &MitsubaSettings) {
        let Camera {
            eye,
            target,
            up,
            vertical_fov_degrees: fov,
        } = settings.camera;
        let [width, height] = settings.size;
        let [eye_text, target, up] = [eye, target, up].map(vector);
        // Mitsuba's cameras clip; this one must not.
        let bounds = scene.bounds();
        let far = 2.0 * (bounds.center().distance(eye) + bounds.radius()).max(f32::MIN_POSITIVE);
        let near = 1e-4 * far;
        let (spp, depth) = (settings.spp, settings.bounces + 1);
        let integrator = medium::integrator(&scene.media);
        let around = medium::around(&scene.media, eye);
        let _ = write!(
            self.xml,
            r#"    <default name="spp" value="{spp}"/>
    <default name="sampler" value="independent"/>
    <integrator type="{integrator}">
        <integer name="max_depth" value="{depth}"/>
    </integrator>
    <sensor type="perspective">
        <string name="fov_axis" value="y"/>
        <float name="fov" value="{fov}"/>
        <float name="near_clip" value="{near}"/>
        <float name="far_clip" value="{far}"/>
        <transform name="to_world">
            <lookat origin="{eye_text}" target="{target}" up="{up}"/>
        </transform>
{around}        <sampler type="$sampler">
            <integer name="sample_count" value="$spp"/>
        </sampler>
        <film type="hdrfilm">
            <integer name="width" value="{width}"/>
            <integer name="height" value="{height}"/>
            <string name="pixel_format" value="rgb"/>
            <string name="component_format" value="float32"/>
            <rfilter type="box"/>
        </film>
    </sensor>
"#
        );
    }

    fn lights(&mut self) -> Result<(), ExportError> {
        let all = self.scene.lights.iter().enumerate();
        for (number, light) in all.filter(|(_, light)| light.problem().is_none()) {
            let kind = self.kinds.lights.get(light.kind().name);
            let unknown = "its kind has no row of checks";
            let kind = kind.ok_or_else(|| ExportError::light(number, light, unknown))?;
            (kind.mitsuba)(self, number, light)?;
        }
        Ok(())
    }

    /// Writes a mesh for each material with triangles, and one for the back of each emitter.
    fn shapes(&mut self, scene: &SceneData, fronts_only: bool) -> Result<(), ExportError> {
        let Bounds { min, max } = scene.bounds();
        let gap = GAP * min.abs().max(max.abs()).max_element();
        for (id, material) in (0u32..).zip(&scene.materials) {
            let emits = material.emission.max_element() > 0.0;
            let both = emits && material.emits_both_sides && !fronts_only;
            let sides = 1 + usize::from(both);
            for back in [None, Some(gap)].into_iter().take(sides) {
                let Some((bytes, smooth)) = mesh::ply(scene, id, back) else {
                    continue;
                };
                let side = ["", "-back"][usize::from(back.is_some())];
                let name = format!("meshes/{id}{side}.ply");
                self.write(&name, &bytes)?;
                // Mitsuba emits by vertex normals too: a faceted ball casts 0.3 % less around its
                // shadows.
                let by_faces = emits || !smooth;
                let _ = write!(
                    self.xml,
                    r#"    <shape type="ply">
        <string name="filename" value="{name}"/>
        <boolean name="face_normals" value="{by_faces}"/>
        <ref id="material-{id}"/>
"#
                );
                if emits {
                    let radiance = vector(material.emission);
                    let _ = write!(
                        self.xml,
                        r#"        <emitter type="area">
            <rgb name="radiance" value="{radiance}"/>
        </emitter>
"#
                    );
                }
                self.xml += "    </shape>\n";
            }
        }
        Ok(())
    }

    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), ExportError> {
        let path = self.folder.join(name);
        write_atomic(&path, bytes).map_err(unwritable(&path))
    }

    /// Writes a linear image; `name` is relative to the folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_radiance(&self, name: &str, image: &Image) -> Result<(), ExportError> {
        let path = self.folder.join(name);
        Ok(FileFormat::of(&path)?.write(&path, image, &[])?)
    }

    fn write_picture(&self, name: &str, picture: &Picture) -> Result<(), ExportError> {
        Ok(write_png(&self.folder.join(name), picture)?)
    }
}

fn unwritable(path: &Path) -> impl Fn(std::io::Error) -> ExportError + '_ {
    |source| ExportError::Write {
        path: path.to_owned(),
        source,
    }
}

/// Three numbers that read back bit-identically.
pub fn vector(v: Vec3) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

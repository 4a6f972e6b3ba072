//! What a shell draws: pictures and figures.

use super::motion::FrameTimes;
use super::reference::error_of;
use super::side::Side;
use raystone_accel::StructureStats;
use raystone_bench::run::{RunError, attributes};
use raystone_config::Axis;
use raystone_core::program::Program;
use raystone_core::structure::{RAY_COUNT_CLASSES, TRACED_CLASSES};
use raystone_image::{Attribute, FileFormat, Image, Picture, write_png};
use raystone_stats::metrics::Reference;
use std::path::Path;

/// What is on screen now.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// The images, from left to right.
    pub sides: Vec<SideFrame>,
    /// Upper end of the scale of colours, where a map is shown.
    pub scale: Option<f32>,
    /// Samples per pixel of the reference; `None` without one.
    pub reference_spp: Option<u32>,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Objects that can be dragged.
    pub objects: usize,
    /// What the last frame took, of a scene that moves.
    pub times: Option<FrameTimes>,
}

/// An image on screen.
#[derive(Debug, Clone, Default)]
pub struct SideFrame {
    /// The picture, of the size of the image or coarser; `None` until there is one.
    pub picture: Option<Picture>,
    /// What it is made of.
    pub label: String,
    /// Its figures.
    pub figures: Figures,
    /// Why there is no picture, or none that goes on.
    pub fault: Option<String>,
}

/// Figures of an image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Figures {
    /// Samples per pixel that are shown; 0 of a coarse image.
    pub spp: u32,
    /// Samples per pixel at which it is finished.
    pub of: u32,
    /// Milliseconds of a sample of all pixels, the last ones.
    pub sample_ms: Vec<f32>,
    /// Rays, by class.
    pub rays: Vec<RaysOfClass>,
    /// Million rays per second, all classes together; with the counting of rays.
    pub mrays_s: Option<f64>,
    /// relMSE against the reference, free of its noise; may be negative while there is little of it.
    pub relmse: Option<f64>,
    /// Mean FLIP against the reference, both tone-mapped: 0 of equal pictures, 1 at most. It takes longer than a sample, so it is
    /// that of an image a little before, until the image and the reference are finished.
    pub flip: Option<f64>,
    /// Figures of the structure.
    pub structure: StructureStats,
    /// Mean of the map over pixels, where one is shown and counted.
    pub map_mean: Option<f64>,
}

/// Rays of a class that an image took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RaysOfClass {
    /// The class.
    pub class: &'static str,
    /// Rays per pixel and sample.
    pub per_sample: f64,
    /// Million rays of the class per second of the whole image: a single kernel does not say which of them took how long.
    pub mrays_s: f64,
}

/// The figures of a side, but for its map; its errors against this reference.
pub(crate) fn figures(side: &Side, reference: Option<&Reference>) -> Figures {
    let reference = reference.filter(|_| side.shown > 0);
    let relmse = reference.and_then(|reference| error_of(side.image.as_deref()?, reference));
    let flip = reference.and(side.flip.as_ref());
    let [width, height] = side.lens.size.map(f64::from);
    let samples = width * height * f64::from(side.shown);
    let all: u64 = side.pace.rays.iter().sum();
    let is_counted = all > 0 && side.pace.rays_ms > 0.0;
    let class = |class: usize| RaysOfClass {
        class: RAY_COUNT_CLASSES[class],
        per_sample: side.pace.rays[class] as f64 / samples,
        mrays_s: side.pace.rays[class] as f64 / side.pace.rays_ms / 1e3,
    };
    Figures {
        spp: side.shown,
        of: side.lens.spp,
        sample_ms: side.pace.history.iter().copied().collect(),
        rays: if is_counted {
            (0..TRACED_CLASSES)
                .map(class)
                .filter(|rays| rays.per_sample > 0.0)
                .collect()
        } else {
            Vec::new()
        },
        mrays_s: is_counted.then(|| all as f64 / side.pace.rays_ms / 1e3),
        relmse,
        flip: flip.and_then(|flip| flip.value),
        structure: side
            .structure
            .as_ref()
            .map_or_else(StructureStats::default, |s| s.stats.clone()),
        map_mean: None,
    }
}

impl Frame {
    /// One picture of all sides: each left or right of `swipe`, a share of the width; `None` while one has none. Beside another
    /// image, one that cannot be made is black.
    pub fn picture(&self, size: [u32; 2], swipe: f32) -> Option<Picture> {
        let black = Picture {
            width: 1,
            height: 1,
            pixels: vec![[0; 3]],
        };
        let pictures = self.sides.iter().map(|side| {
            let absent = side.fault.as_ref().map(|_| &black);
            side.picture.as_ref().or(absent)
        });
        let pictures: Option<Vec<&Picture>> = pictures.collect();
        let pictures = pictures.filter(|_| self.sides.iter().any(|side| side.picture.is_some()))?;
        let border = match pictures.len() {
            1 => size[0],
            _ => (swipe * size[0] as f32) as u32,
        };
        let pixel = |x: u32, y: u32| {
            let picture = pictures[usize::from(x >= border)];
            let at = |v: u32, from: u32, to: u32| u64::from(v) * u64::from(to) / u64::from(from);
            let (x, y) = (
                at(x, size[0], picture.width),
                at(y, size[1], picture.height),
            );
            picture.pixels[(y * u64::from(picture.width) + x) as usize]
        };
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
        Some(Picture {
            width: size[0],
            height: size[1],
            pixels: pixels.map(|(x, y)| pixel(x, y)).collect(),
        })
    }

    /// Writes what is on screen, tone-mapped, as PNG.
    ///
    /// # Errors
    /// There is no picture yet, or the file cannot be written.
    pub fn write_png(&self, file: &Path, size: [u32; 2], swipe: f32) -> Result<(), RunError> {
        let picture = self.picture(size, swipe);
        let picture =
            picture.ok_or_else(|| RunError::Input("there is no picture yet".to_owned()))?;
        write_png(file, &picture).map_err(|e| RunError::Input(e.to_string()))
    }
}

/// The linear image of a side, and what its file says of it.
fn linear<'s>(
    side: &'s Side,
    program: &Program,
) -> Result<(&'s Image, Vec<Attribute<'static>>), RunError> {
    let image = side.image.as_deref().filter(|_| side.shown > 0);
    let image =
        image.ok_or_else(|| RunError::Input("no sample of all pixels is done yet".to_owned()))?;
    let cell = &side.cell;
    let sampler = format!("{} × {}", cell[Axis::Sequence], cell[Axis::Decorrelation]);
    let about = attributes(program, cell, &sampler, side.shown, side.lens.seed);
    Ok((image, about))
}

/// Writes the linear image of a side, in the format of the file's ending.
pub(crate) fn write_linear(side: &Side, file: &Path, program: &Program) -> Result<(), RunError> {
    let format = format_of(file)?;
    let (image, about) = linear(side, program)?;
    let written = format.write(file, image, &about);
    written.map_err(|e| RunError::Input(e.to_string()))
}

/// The bytes of such a file.
pub(crate) fn encoded(side: &Side, file: &Path, program: &Program) -> Result<Vec<u8>, RunError> {
    let format = format_of(file)?;
    let (image, about) = linear(side, program)?;
    let bytes = format.encoded(image, &about);
    bytes.map_err(|e| RunError::Input(e.to_string()))
}

fn format_of(file: &Path) -> Result<&'static FileFormat, RunError> {
    FileFormat::of(file).map_err(|e| RunError::Input(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn side(color: [u8; 3], size: [u32; 2]) -> SideFrame {
        SideFrame {
            picture: Some(Picture {
                width: size[0],
                height: size[1],
                pixels: vec![color; (size[0] * size[1]) as usize],
            }),
            ..SideFrame::default()
        }
    }

    #[test]
    fn two_images_meet_at_the_swipe_whatever_their_sizes() {
        let (red, blue) = ([255, 0, 0], [0, 0, 255]);
        let mut frame = Frame {
            sides: vec![side(red, [8, 6]), side(blue, [2, 2])],
            ..Frame::default()
        };
        let count = |frame: &Frame, swipe: f32| {
            let picture = frame.picture([8, 6], swipe).unwrap();
            assert_eq!(picture.pixels.len(), 48);
            picture.pixels.iter().filter(|p| **p == red).count()
        };
        assert_eq!([0.0, 0.5, 1.0].map(|s| count(&frame, s)), [0, 24, 48]);
        frame.sides[1].picture = None;
        assert_eq!(frame.picture([8, 6], 0.5), None);
        // One that cannot be made leaves the other its place.
        frame.sides[1].fault = Some("no room".to_owned());
        assert_eq!([0.0, 0.5, 1.0].map(|s| count(&frame, s)), [0, 24, 48]);
        frame.sides[0] = frame.sides[1].clone();
        assert_eq!(frame.picture([8, 6], 0.5), None);
        assert_eq!(Frame::default().picture([8, 6], 0.5), None);
        assert!(frame.write_png(Path::new("x.png"), [8, 6], 0.5).is_err());
    }
}

//! Pixels within a drawing, where there would be too many shapes.

use super::drawing::{Ink, Point};
use crate::ReportError;
use base64::Engine;
use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};

/// Pixels of a [`Canvas`] per pixel of the drawing, as in the PNG file.
const CANVAS_SCALE: f64 = 2.0;
/// Number of shades between paper and ink on a [`Canvas`]: few, so that files stay small.
const SHADES: f32 = 16.0;

/// A rectangle of pixels behind all shapes of a drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Upper left corner, pixels of the drawing.
    pub at: Point,
    /// Width and height, pixels of the drawing.
    pub size: (f64, f64),
    /// Number of its own pixels in a row.
    pub columns: usize,
    /// sRGB pixels, row by row from the top.
    pub rgb: Vec<[u8; 3]>,
}

impl Raster {
    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.rgb.len() / self.columns.max(1)
    }

    /// Paints it on an RGB picture of `width` pixels a row that shows the drawing `scale` times as large; every pixel
    /// gets the colour at its centre.
    pub(crate) fn blit(&self, picture: &mut [u8], width: usize, scale: f64) {
        let height = picture.len() / 3 / width.max(1);
        let range = |from: f64, length: f64, end: usize| {
            let first = (from * scale).round().max(0.0) as usize;
            first..(((from + length) * scale).round().max(0.0) as usize).min(end)
        };
        let cell = |pixel: usize, from: f64, length: f64, count: usize| {
            let share = ((pixel as f64 + 0.5) / scale - from) / length;
            ((share * count as f64).max(0.0) as usize).min(count - 1)
        };
        for y in range(self.at.1, self.size.1, height) {
            let row = cell(y, self.at.1, self.size.1, self.rows());
            for x in range(self.at.0, self.size.0, width) {
                let column = cell(x, self.at.0, self.size.0, self.columns);
                let color = self.rgb[row * self.columns + column];
                picture[(y * width + x) * 3..][..3].copy_from_slice(&color);
            }
        }
    }

    /// Returns the raster as an `<image>` of an SVG document that shows the drawing `scale` times as large.
    ///
    /// # Errors
    /// If the pixels cannot be encoded.
    pub fn svg(&self, scale: f64) -> Result<String, ReportError> {
        let mut png = Vec::new();
        // Few colours compress best unfiltered.
        PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::NoFilter)
            .write_image(
                self.rgb.as_flattened(),
                self.columns as u32,
                self.rows() as u32,
                image::ExtendedColorType::Rgb8,
            )
            .map_err(|error| ReportError::Draw(error.to_string()))?;
        let data = base64::engine::general_purpose::STANDARD.encode(png);
        let [x, y, width, height] =
            [self.at.0, self.at.1, self.size.0, self.size.1].map(|length| length * scale);
        // Few pixels are cells of a table and need sharp edges.
        let style = if (self.columns as f64) < self.size.0 {
            r#" style="image-rendering: pixelated""#
        } else {
            ""
        };
        Ok(format!(
            r#"<image x="{x}" y="{y}" width="{width}" height="{height}" preserveAspectRatio="none"{style} href="data:image/png;base64,{data}"/>"#
        ))
    }
}

/// A white square on which dots of one ink are painted.
pub(crate) struct Canvas {
    at: Point,
    side: f64,
    columns: usize,
    ink: Ink,
    /// Coverage of each pixel, 0 to 1.
    cover: Vec<f32>,
}

impl Canvas {
    /// Returns an empty square of `side` pixels with this upper left corner.
    pub(crate) fn new(at: Point, side: f64, ink: Ink) -> Self {
        let columns = (side * CANVAS_SCALE).round().max(1.0) as usize;
        Self {
            at,
            side,
            columns,
            ink,
            cover: vec![0.0; columns * columns],
        }
    }

    /// Paints a disc with a smooth edge, clipped to the square; place and radius in pixels of the drawing, opacity in
    /// [0, 1].
    pub(crate) fn dot(&mut self, (x, y): Point, radius: f64, alpha: f64) {
        let (x, y) = (
            (x - self.at.0) * CANVAS_SCALE,
            (y - self.at.1) * CANVAS_SCALE,
        );
        let radius = radius * CANVAS_SCALE;
        let range = |middle: f64| {
            let first = (middle - radius - 1.0).floor().max(0.0) as usize;
            first..((middle + radius + 1.0).ceil().max(0.0) as usize).min(self.columns)
        };
        for row in range(y) {
            for column in range(x) {
                let distance = (column as f64 + 0.5 - x).hypot(row as f64 + 0.5 - y);
                let more = (radius + 0.5 - distance).clamp(0.0, 1.0) * alpha;
                let cover = &mut self.cover[row * self.columns + column];
                *cover += (1.0 - *cover) * more as f32;
            }
        }
    }

    /// Returns the painted raster.
    pub(crate) fn into_raster(self) -> Raster {
        let color = |cover: &f32| {
            let share = (cover * SHADES).round() / SHADES;
            self.ink
                .rgb
                .map(|ink| (255.0 + (f32::from(ink) - 255.0) * share).round() as u8)
        };
        Raster {
            at: self.at,
            size: (self.side, self.side),
            columns: self.columns,
            rgb: self.cover.iter().map(color).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawing::INK;
    use super::*;

    #[test]
    fn a_dot_is_painted_where_it_lies_and_cut_off_at_the_border() {
        let mut canvas = Canvas::new((10.0, 20.0), 30.0, INK);
        canvas.dot((15.0, 25.0), 2.0, 1.0);
        canvas.dot((40.0, 50.0), 2.0, 1.0);
        canvas.dot((-500.0, 1e9), 2.0, 1.0);
        let raster = canvas.into_raster();
        assert_eq!((raster.columns, raster.rows()), (60, 60));
        assert_eq!(raster.rgb[10 * 60 + 10], INK.rgb);
        assert_eq!(raster.rgb[30 * 60 + 30], [255; 3]);
        assert_eq!(raster.rgb[59 * 60 + 59], INK.rgb);
    }

    #[test]
    fn rows_and_columns_keep_their_place_when_shown_larger() {
        let raster = Raster {
            at: (1.0, 0.0),
            size: (2.0, 2.0),
            columns: 2,
            rgb: vec![[1; 3], [2; 3], [3; 3], [4; 3]],
        };
        let mut picture = vec![0u8; 8 * 6 * 3];
        raster.blit(&mut picture, 8, 2.0);
        let row = |y: usize| -> Vec<u8> { (0..8).map(|x| picture[(y * 8 + x) * 3]).collect() };
        assert_eq!(row(0), [0, 0, 1, 1, 2, 2, 0, 0]);
        assert_eq!(row(3), [0, 0, 3, 3, 4, 4, 0, 0]);
        assert_eq!(row(4), [0; 8]);
    }
}

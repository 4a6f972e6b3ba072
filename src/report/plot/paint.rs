//! Drawings as SVG and PNG, through any `plotters` backend.
//!
//! Only the embedded font is used, so that a machine without fonts draws the same picture.

use super::drawing::{Anchor, Drawing, FONT_PX, Ink, Point, Shape, Spot};
use crate::ReportError;
use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontTransform, register_font};
use raystone_core::text::escape::xml;
use std::sync::Once;

/// Returns the width of a text in pixels with the embedded font at [`FONT_PX`].
pub(crate) fn text_width(text: &str) -> f64 {
    register_fonts();
    // Measured at a large size, because plotters returns whole pixels.
    font(8.0)
        .box_size(text)
        .map_or(0.0, |(width, _)| f64::from(width) / 8.0)
}

/// Returns the text, shortened with `…` to fit into `width` pixels.
pub(crate) fn fit_text(text: &str, width: f64) -> String {
    if text_width(text) <= width {
        return text.to_owned();
    }
    let mut kept: String = text.to_owned();
    while !kept.is_empty() && text_width(&kept) + text_width("…") > width {
        kept.pop();
    }
    kept + "…"
}

/// Returns the embedded sans-serif font; plotters' sizes are 1.24 × the em.
fn font(scale: f64) -> FontDesc<'static> {
    FontDesc::new(
        FontFamily::SansSerif,
        FONT_PX * 1.24 * scale,
        FontStyle::Normal,
    )
}

fn register_fonts() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let bytes = include_bytes!("../../../assets/fonts/DejaVuSans-subset.ttf");
        // A broken font makes every text fail to draw, which `paint` reports.
        let _ = register_font("sans-serif", FontStyle::Normal, bytes);
    });
}

/// Returns the drawing as an SVG document of its own size.
pub(crate) fn to_svg(drawing: &Drawing) -> Result<String, ReportError> {
    // Backends round to whole pixels: lay out eight times as large, and show at the original size.
    const SCALE: f64 = 8.0;
    let (width, height) = scaled_size(drawing, SCALE);
    let mut svg = String::new();
    let mut backend = SVGBackend::with_string(&mut svg, (width, height));
    let corner = (width as i32, height as i32);
    backend
        .draw_rect((0, 0), corner, &WHITE, true)
        .map_err(|error| ReportError::Draw(error.to_string()))?;
    paint(drawing, backend, SCALE, 0.5)?;
    // Rasters go between the paper and the first shape.
    let paper = svg
        .find("<rect")
        .and_then(|at| Some(at + svg[at..].find("/>")? + 2));
    if let Some(end) = paper {
        let rasters: Result<String, _> = drawing.rasters.iter().map(|r| r.svg(SCALE)).collect();
        svg.insert_str(end, &rasters?);
    }
    if let Some(end) = svg.rfind("</svg>") {
        svg.insert_str(end, &spots(drawing, SCALE));
    }
    Ok(svg.replacen(
        &format!(r#"width="{width}" height="{height}""#),
        &format!(r#"width="{}" height="{}""#, drawing.width, drawing.height),
        1,
    ))
}

/// Returns transparent discs whose titles a browser shows as tooltips.
fn spots(drawing: &Drawing, scale: f64) -> String {
    let disc = |Spot { at, text }: &Spot| {
        let [x, y, r] = [at.0, at.1, 9.0].map(|v| v * scale);
        let text = xml(text);
        format!(
            "<circle cx=\"{x:.0}\" cy=\"{y:.0}\" r=\"{r:.0}\" fill-opacity=\"0\"><title>{text}</title></circle>\n"
        )
    };
    let discs: String = drawing.spots.iter().map(disc).collect();
    if discs.is_empty() {
        discs
    } else {
        format!("<g class=\"spots\">\n{discs}</g>\n")
    }
}

/// Above this height, in CSS pixels, a drawing is mostly legend, and its PNG file has its own size, not twice that.
/// Dozens of them would cost a report more time than everything else; the SVG file stays sharp.
const TALL: f64 = 1000.0;

/// Returns the drawing as a PNG file, smoothed by 2×2 samples per pixel: of twice its size `for_print` (its own above
/// `TALL`), otherwise of its own.
pub(crate) fn to_png(drawing: &Drawing, for_print: bool) -> Result<Vec<u8>, ReportError> {
    let is_fine = for_print && drawing.height <= TALL;
    let scale = if is_fine { 4.0 } else { 2.0 };
    let (width, height) = scaled_size(drawing, scale);
    // Starts white: painting the paper pixel by pixel would take longer than the plot.
    let mut pixels = vec![255u8; width as usize * height as usize * 3];
    for raster in &drawing.rasters {
        raster.blit(&mut pixels, width as usize, scale);
    }
    let backend = BitMapBackend::with_buffer(&mut pixels, (width, height));
    paint(drawing, backend, scale, 0.625 * scale)?;
    let mut png = Vec::new();
    // Flat colours compress best unfiltered; the usual level 6 needs twice the time for 3 % fewer bytes.
    PngEncoder::new_with_quality(&mut png, CompressionType::Level(4), FilterType::NoFilter)
        .write_image(
            &halve(&pixels, width as usize),
            width / 2,
            height / 2,
            image::ExtendedColorType::Rgb8,
        )
        .map_err(|error| ReportError::Draw(error.to_string()))?;
    Ok(png)
}

/// Returns an RGB picture of half the size, by means of 2×2 pixels. Rows have `width` pixels; both sizes are even.
fn halve(pixels: &[u8], width: usize) -> Vec<u8> {
    let mut half = vec![0; pixels.len() / (width * 6) * (width / 2) * 3];
    for (row, rows) in (half.chunks_exact_mut(width / 2 * 3)).zip(pixels.chunks_exact(width * 6)) {
        let (upper, lower) = rows.split_at(width * 3);
        let blocks = upper.chunks_exact(6).zip(lower.chunks_exact(6));
        for (pixel, (a, b)) in row.chunks_exact_mut(3).zip(blocks) {
            for (c, mean) in pixel.iter_mut().enumerate() {
                let sum = [a[c], a[c + 3], b[c], b[c + 3]].map(u16::from);
                *mean = ((sum.iter().sum::<u16>() + 2) / 4) as u8;
            }
        }
    }
    half
}

fn scaled_size(drawing: &Drawing, scale: f64) -> (u32, u32) {
    // Even, so that it can be halved.
    let even = |length: f64| (length * scale / 2.0).round().max(1.0) as u32 * 2;
    (even(drawing.width), even(drawing.height))
}

/// Paints every shape, `scale` backend pixels to a pixel. Backends disagree on the vertical middle of a text: it
/// looks centred `drop` pixels below its position.
fn paint<B: DrawingBackend>(
    drawing: &Drawing,
    backend: B,
    scale: f64,
    drop: f64,
) -> Result<(), ReportError> {
    register_fonts();
    let area = backend.into_drawing_area();
    let failed = |error: DrawingAreaErrorKind<B::ErrorType>| ReportError::Draw(error.to_string());
    let to_pixel = |&(x, y): &Point| ((x * scale).round() as i32, (y * scale).round() as i32);
    for shape in &drawing.shapes {
        let drawn = match shape {
            Shape::Line { points, ink, width } => {
                let style = color(*ink).stroke_width((width * scale).round().max(1.0) as u32);
                area.draw(&PathElement::new(
                    points.iter().map(to_pixel).collect::<Vec<_>>(),
                    style,
                ))
            }
            Shape::Area { points, ink } => {
                let corners: Vec<_> = points.iter().map(to_pixel).collect();
                area.draw(&Polygon::new(corners, color(*ink).filled()))
            }
            Shape::Text {
                at,
                text,
                ink,
                anchor,
                upwards,
            } => {
                let turn = if *upwards {
                    FontTransform::Rotate270
                } else {
                    FontTransform::None
                };
                let h_pos = match anchor {
                    Anchor::Start => HPos::Left,
                    Anchor::Middle => HPos::Center,
                    Anchor::End => HPos::Right,
                };
                let tint = color(*ink);
                let style = TextStyle::from(font(scale).transform(turn))
                    .color(&tint)
                    .pos(Pos::new(h_pos, VPos::Center));
                let (right, down) = if *upwards { (drop, 0.0) } else { (0.0, drop) };
                let place = to_pixel(&(at.0 + right, at.1 + down));
                area.draw(&Text::new(text.clone(), place, style))
            }
        };
        drawn.map_err(failed)?;
    }
    area.present().map_err(failed)
}

fn color(ink: Ink) -> RGBAColor {
    RGBAColor(ink.rgb[0], ink.rgb[1], ink.rgb[2], ink.alpha)
}

#[cfg(test)]
mod tests {
    use super::super::drawing::INK;
    use super::*;

    fn sample() -> Drawing {
        let mut drawing = Drawing::new(120.0, 40.0);
        drawing.line(vec![(0.0, 0.0), (100.0, 30.5)], INK, 1.5);
        drawing.text((60.0, 20.0), "a<b & δ ≤ 10⁻³", INK, Anchor::Middle);
        drawing
    }

    #[test]
    fn svg_keeps_the_size_and_escapes_text() {
        let svg = to_svg(&sample()).unwrap();
        assert!(
            svg.starts_with(r#"<svg width="120" height="40" viewBox="0 0 960 320""#),
            "{svg}"
        );
        assert!(svg.contains("a&lt;b &amp; δ"));
        assert!(!svg.contains("a<b"));
    }

    #[test]
    fn png_has_twice_the_size_and_both_paper_and_ink() {
        let png = to_png(&sample(), true).unwrap();
        let picture = image::load_from_memory(&png).unwrap().to_luma8();
        assert_eq!(picture.dimensions(), (240, 80));
        assert!(picture.pixels().any(|p| p.0[0] == 255));
        assert!(picture.pixels().any(|p| p.0[0] < 80));
        let mut tall = sample();
        tall.height = TALL + 100.0;
        let size = |drawing: &Drawing, for_print: bool| {
            let png = to_png(drawing, for_print).unwrap();
            let picture = image::load_from_memory(&png).unwrap();
            (picture.width(), picture.height())
        };
        assert_eq!(size(&tall, true), (120, 1100));
        assert_eq!(size(&sample(), false), (120, 40));
    }

    #[test]
    fn long_text_is_cut_to_its_place() {
        let cut = fit_text("a very long name of a structure", 80.0);
        assert!(cut.ends_with('…') && text_width(&cut) <= 80.0, "{cut}");
        assert_eq!(fit_text("bvh", 80.0), "bvh");
    }
}

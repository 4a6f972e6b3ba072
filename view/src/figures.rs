//! Figures of the images.

use crate::app::warning;
use eframe::egui;
use egui::{Grid, ProgressBar, RichText, Sense, Stroke, Ui, Vec2};
use raystone_config::Map;
use raystone_core::params::Choice as _;
use raystone_image::viridis;
use raystone_viewer::{Figures, Frame, FrameTimes, SIDE_NAMES, Screen};

pub fn draw(ui: &mut Ui, frame: &Frame, adapter: &str, screen: &Screen) {
    ui.strong("Figures");
    ui.label(format!(
        "{adapter}, {} triangles",
        grouped(frame.triangles as u64)
    ));
    if let Some(scale) = frame.scale {
        draw_scale(ui, screen.window.map, scale);
    }
    if let Some(times) = &frame.times {
        draw_times(ui, times);
    }
    for (side, name) in frame.sides.iter().zip(SIDE_NAMES) {
        ui.separator();
        if frame.sides.len() > 1 {
            ui.strong(name);
        }
        ui.label(&side.label);
        if let Some(fault) = &side.fault {
            ui.label(RichText::new(fault).color(warning(ui)));
        }
        // One that could not be made has no samples to come.
        if side.fault.is_none() || side.figures.spp > 0 {
            draw_progress(ui, &side.figures);
        }
        draw_side(ui, name, &side.figures, frame.reference_spp);
    }
    ui.separator();
}

fn draw_progress(ui: &mut Ui, figures: &Figures) {
    let share = figures.spp as f32 / figures.of.max(1) as f32;
    let text = match figures.spp {
        0 => "coarse image".to_owned(),
        spp => format!("{spp} of {} spp", figures.of),
    };
    ui.add(ProgressBar::new(share).text(text));
}

fn draw_side(ui: &mut Ui, name: &str, figures: &Figures, reference_spp: Option<u32>) {
    Grid::new(("figures", name)).num_columns(2).show(ui, |ui| {
        let mut row = |what: &str, value: String| {
            ui.label(what);
            ui.label(RichText::new(value).monospace());
            ui.end_row();
        };
        if let Some(rate) = figures.mrays_s {
            row("Mrays/s", format!("{rate:.2}"));
        }
        if let Some(ms) = median(&figures.sample_ms) {
            row("ms a sample", format!("{ms:.1}"));
        }
        for rays in &figures.rays {
            let value = format!("{:.3} ({:.2} Mrays/s)", rays.per_sample, rays.mrays_s);
            row(&format!("{} rays a sample", rays.class), value);
        }
        if let Some(spp) = reference_spp {
            let error = figures
                .relmse
                .map_or("–".to_owned(), |error| format!("{error:.3e}"));
            row("relMSE", error);
            let flip = figures.flip.map(|flip| format!("{flip:.4}"));
            row("FLIP", flip.unwrap_or("–".to_owned()));
            row("reference, spp", spp.to_string());
        }
        if let Some(mean) = figures.map_mean {
            let digits = if mean < 10.0 { 3 } else { 1 };
            row("map, mean", format!("{mean:.digits$}"));
        }
        let structure = &figures.structure;
        if structure.nodes > 0 {
            row("nodes or cells", grouped(structure.nodes));
        }
        if let Some(cost) = structure.sah_cost {
            row("SAH cost", format!("{cost:.2}"));
        }
        if let Some(depth) = structure.depth {
            row("depth", depth.to_string());
        }
        if structure.bytes > 0 {
            row(
                "KiB of the structure",
                grouped(structure.bytes.div_ceil(1024)),
            );
        }
    });
    draw_history(ui, &figures.sample_ms);
}

/// The parts of a frame's time.
fn draw_times(ui: &mut Ui, times: &FrameTimes) {
    ui.separator();
    let [frame, of] = times.frame;
    let ms = median(&times.whole_ms).unwrap_or_default();
    ui.label(format!(
        "frame {frame} of {of}: {ms:.0} ms, {:.1} a second",
        1e3 / ms.max(1e-3)
    ));
    Grid::new("times").num_columns(2).show(ui, |ui| {
        let mut row = |what: String, ms: f64| {
            ui.label(what.trim_start());
            ui.label(RichText::new(format!("{ms:.1} ms")).monospace());
            ui.end_row();
        };
        row("scene moved, uploaded".to_owned(), times.scene_ms);
        for (side, name) in times.sides.iter().zip(SIDE_NAMES) {
            let name = if times.sides.len() > 1 { name } else { "" };
            row(format!("{name} structure updated"), side.update_ms);
            match side.trace_ms {
                Some(trace) => {
                    row(format!("{name} traced"), trace);
                    row(format!("{name} shaded"), side.render_ms - trace);
                }
                None => row(format!("{name} traced and shaded"), side.render_ms),
            }
        }
        row("rest".to_owned(), times.rest_ms());
    });
    draw_history(ui, &times.whole_ms);
}

/// The last times as a line, from 0 up.
fn draw_history(ui: &mut Ui, ms: &[f32]) {
    if ms.len() < 2 {
        return;
    }
    let (response, painter) =
        ui.allocate_painter(Vec2::new(ui.available_width(), 36.0), Sense::hover());
    let (rect, most) = (response.rect, ms.iter().copied().fold(0.0, f32::max));
    let ink = ui.visuals().widgets.noninteractive.fg_stroke.color;
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let last = (ms.len() - 1) as f32;
    let points = ms.iter().enumerate().map(|(i, ms)| {
        let x = rect.left() + rect.width() * i as f32 / last;
        egui::pos2(
            x,
            rect.bottom() - 2.0 - (rect.height() - 4.0) * ms / most.max(1e-6),
        )
    });
    painter.line(points.collect(), Stroke::new(1.0, ink));
    response.on_hover_text(format!("ms of the last {}, from 0 to {most:.1}", ms.len()));
}

/// The colours of a map, from 0 to its upper end.
fn draw_scale(ui: &mut Ui, map: Map, most: f32) {
    let (response, painter) =
        ui.allocate_painter(Vec2::new(ui.available_width(), 14.0), Sense::hover());
    let (rect, steps) = (response.rect, 64);
    for step in 0..steps {
        let [from, to] =
            [step, step + 1].map(|s| rect.left() + rect.width() * s as f32 / steps as f32);
        let [r, g, b] = viridis(step as f32 / (steps - 1) as f32);
        let bar =
            egui::Rect::from_min_max(egui::pos2(from, rect.top()), egui::pos2(to, rect.bottom()));
        painter.rect_filled(bar, 0.0, egui::Color32::from_rgb(r, g, b));
    }
    ui.horizontal(|ui| {
        ui.label("0");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let what = match map {
                Map::Bounces => "bounces of a path, mean of a pixel".to_owned(),
                Map::Cycles => "modelled cycles of a first ray".to_owned(),
                map => format!("{} of a pixel's first ray", map.name()),
            };
            let digits = usize::from(most < 10.0 && most.fract() != 0.0);
            ui.label(format!("{most:.digits$} {what}"));
        });
    });
}

fn median(ms: &[f32]) -> Option<f32> {
    let mut sorted = ms.to_vec();
    sorted.sort_unstable_by(f32::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// Digits in groups of three.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_come_in_groups_of_three() {
        let texts = [0, 12, 999, 1000, 262_267, 1_000_000].map(grouped);
        assert_eq!(texts, ["0", "12", "999", "1,000", "262,267", "1,000,000"]);
    }
}

//! The pixel that was clicked: its value, hit, path and points.

use crate::worker::{Ask, Worker};
use eframe::egui;
use egui::{Color32, DragValue, RichText, ScrollArea, Sense, Ui, Vec2};
use raystone_viewer::{Inspection, SIDE_NAMES, SamplePoints, Screen, Seen, Trail};

/// Height of the text of a trace, which may have hundreds of lines, points.
const TRACE: f32 = 260.0;

/// The panel of the inspected pixel.
pub struct PixelPanel {
    pixel: Option<[u32; 2]>,
    sample: u32,
    side: usize,
    dimensions: [u32; 2],
    are_points_wanted: bool,
    /// The points that were asked for last.
    asked: Option<(usize, [u32; 2], [u32; 2], Screen)>,
}

impl Default for PixelPanel {
    fn default() -> Self {
        Self {
            pixel: None,
            sample: 0,
            side: 0,
            dimensions: [0, 1],
            are_points_wanted: false,
            asked: None,
        }
    }
}

impl PixelPanel {
    /// Inspects a pixel.
    pub fn inspect(&mut self, worker: &Worker, pixel: [u32; 2]) {
        self.pixel = Some(pixel);
        let mut found = worker.found();
        (found.path, found.explanation) = (None, None);
        drop(found);
        worker.ask(Ask::Inspect(pixel));
    }

    /// Asks for the path of the inspected pixel, or hides it.
    pub fn ask_path(&mut self, worker: &Worker) {
        let was = worker.found().path.take();
        let wanted = self.pixel.map(|pixel| (self.side, pixel, self.sample));
        if let Some((side, pixel, sample)) = wanted.filter(|of| was.is_none_or(|was| was.of != *of))
        {
            worker.ask(Ask::Path(side, pixel, sample));
        }
    }

    /// The inspected pixel.
    pub fn pixel(&self) -> Option<[u32; 2]> {
        self.pixel
    }

    pub fn draw(&mut self, ui: &mut Ui, worker: &Worker, screen: &Screen) {
        ui.strong("Pixel");
        self.draw_place(ui, worker, screen.size);
        let Some(pixel) = self.pixel else {
            ui.label("Click the image, or choose a pixel here.");
            return;
        };
        self.side = self.side.min(screen.cells.len() - 1);
        let (inspection, path, explanation, points) = {
            let found = worker.found();
            (
                found.inspection.clone(),
                found.path.clone(),
                found.explanation.clone(),
                found.points.clone(),
            )
        };
        if let Some(inspection) = inspection.filter(|inspection| inspection.pixel == pixel) {
            draw_inspection(ui, &inspection);
        }
        if screen.cells.len() > 1 {
            ui.horizontal(|ui| {
                for (side, name) in SIDE_NAMES.into_iter().enumerate() {
                    ui.radio_value(&mut self.side, side, name);
                }
            });
        }
        ui.horizontal(|ui| {
            let label = ui.label("sample");
            ui.add(DragValue::new(&mut self.sample).range(0..=screen.spp - 1))
                .labelled_by(label.id);
            if ui
                .button("Path")
                .on_hover_text("P: the path of this sample, in double precision")
                .clicked()
            {
                self.ask_path(worker);
            }
            if ui
                .button("Trace")
                .on_hover_text("every node visited and triangle tested, on the host")
                .clicked()
            {
                worker.ask(Ask::Explain(self.side, pixel));
            }
        });
        draw_findings(ui, path, explanation);
        self.draw_points(ui, worker, screen, points);
    }

    /// The pixel by its column and row.
    fn draw_place(&mut self, ui: &mut Ui, worker: &Worker, size: [u32; 2]) {
        let mut place = self.pixel.unwrap_or_default();
        ui.horizontal(|ui| {
            for (edge, name) in [(0, "column"), (1, "row")] {
                let label = ui.label(name);
                ui.add(DragValue::new(&mut place[edge]).range(0..=size[edge] - 1))
                    .labelled_by(label.id);
            }
            if ui.button("Inspect").clicked() {
                self.inspect(worker, place);
            }
        });
        if self.pixel.unwrap_or_default() != place {
            self.inspect(worker, place);
        }
    }

    fn draw_points(
        &mut self,
        ui: &mut Ui,
        worker: &Worker,
        screen: &Screen,
        points: Option<SamplePoints>,
    ) {
        ui.separator();
        ui.checkbox(
            &mut self.are_points_wanted,
            "points of the sampler in this pixel",
        );
        let Some(pixel) = self.pixel.filter(|_| self.are_points_wanted) else {
            return;
        };
        ui.horizontal(|ui| {
            let label = ui.label("dimensions");
            for dimension in &mut self.dimensions {
                ui.add(DragValue::new(dimension).range(0..=255).speed(0.1))
                    .labelled_by(label.id);
            }
        });
        let is_known = self
            .asked
            .as_ref()
            .is_some_and(|(side, at, dimensions, of)| {
                (*side, *at, *dimensions) == (self.side, pixel, self.dimensions)
                    && !screen.restarts(of)
            });
        if !is_known {
            worker.ask(Ask::Points(self.side, pixel, self.dimensions));
            self.asked = Some((self.side, pixel, self.dimensions, screen.clone()));
        }
        let Some(points) = points else {
            return;
        };
        ui.label(&points.purpose);
        let edge = ui.available_width().min(240.0);
        let (response, painter) = ui.allocate_painter(Vec2::splat(edge), Sense::hover());
        let rect = response.rect;
        painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        let ink = if ui.visuals().dark_mode {
            Color32::from_rgb(120, 200, 255)
        } else {
            Color32::from_rgb(0, 80, 160)
        };
        for [x, y] in &points.points {
            let at = rect.left_bottom() + Vec2::new(*x as f32, -*y as f32) * edge;
            painter.circle_filled(at, 1.5, ink);
        }
        let star = points
            .star
            .map_or("–".to_owned(), |star| format!("{star:.5}"));
        ui.label(format!("{} points, D* {star}", points.points.len()));
    }
}

/// What was asked for at the pixel: a path, and what the structure does with the ray.
fn draw_findings(ui: &mut Ui, path: Option<Trail>, explanation: Option<String>) {
    if let Some(path) = path {
        egui::CollapsingHeader::new("Path")
            .default_open(true)
            .show(ui, |ui| {
                if path.text.is_empty() {
                    ui.label("It leaves the scene at once.");
                }
                for line in &path.text {
                    ui.label(line);
                }
            });
    }
    if let Some(text) = explanation {
        egui::CollapsingHeader::new("Trace")
            .default_open(true)
            .show(ui, |ui| {
                let place = ScrollArea::both()
                    .max_height(TRACE)
                    .min_scrolled_height(TRACE);
                place.show(ui, |ui| {
                    ui.add(egui::Label::new(RichText::new(text).monospace()).extend());
                });
            });
    }
}

fn draw_inspection(ui: &mut Ui, inspection: &Inspection) {
    for (seen, name) in inspection.sides.iter().zip(SIDE_NAMES) {
        if inspection.sides.len() > 1 {
            ui.strong(name);
        }
        draw_seen(ui, name, seen);
    }
    let ray = inspection.ray.to_string();
    ui.horizontal(|ui| {
        if ui
            .button("Copy the ray")
            .on_hover_text("for `raystone trace --ray`")
            .clicked()
        {
            ui.ctx().copy_text(ray.clone());
        }
    });
}

fn draw_seen(ui: &mut Ui, name: &str, seen: &Seen) {
    egui::Grid::new(("seen", name))
        .num_columns(2)
        .show(ui, |ui| {
            for (what, value) in seen.rows() {
                ui.label(what);
                ui.label(RichText::new(value).monospace());
                ui.end_row();
            }
        });
}

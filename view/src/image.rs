//! The images: drawn side by side with a line between them, and moved by mouse, touch and keys.

use crate::worker::{Ask, Found, Worker};
use eframe::egui;
use egui::{
    Color32, Context, Key, Pos2, Rect, Sense, Stroke, TextureHandle, TextureOptions, Ui, Vec2,
};
use raystone_core::geometry::Camera;
use raystone_image::Picture;
use raystone_viewer::{Frame, Motion, SIDE_NAMES, Screen, moved};
use std::collections::HashSet;
use std::f32::consts::PI;

/// Distance from the line at which a drag moves it, points.
const GRASP: f32 = 8.0;
/// Speed of flights, distances to the target per second.
const SPEED: f32 = 0.5;
/// Speed of turns by keys, radians per second.
const TURN: f32 = 1.0;

/// The textures on screen.
#[derive(Default)]
pub struct ImageView {
    textures: Vec<Option<TextureHandle>>,
    /// The number of the frame that they show.
    number: u64,
    /// Width and height of the place for the image, pixels.
    room: [f32; 2],
    /// True while the line between two images is dragged.
    is_grasped: bool,
    /// True while an object is dragged.
    is_moving: bool,
    /// Whether a drag without Alt moves objects, too.
    pub drags_objects: bool,
}

impl ImageView {
    /// The size of an image that fills its place.
    pub fn room(&self, most: u32) -> [u32; 2] {
        self.room.map(|edge| (edge as u32).clamp(16, most))
    }

    /// Draws the images, moves camera and line, and returns the pixel that was clicked.
    pub fn draw(
        &mut self,
        ui: &mut Ui,
        worker: &Worker,
        screen: &mut Screen,
        inspected: Option<[u32; 2]>,
    ) -> Option<[u32; 2]> {
        let place = ui.available_rect_before_wrap();
        self.room = [
            place.width() * ui.pixels_per_point(),
            place.height() * ui.pixels_per_point(),
        ];
        if place.width() < 1.0 || place.height() < 1.0 {
            return None;
        }
        let found = worker.found();
        self.upload(ui.ctx(), &found);
        let (shown, camera) = (found.screen.clone(), found.camera);
        let response = ui.allocate_rect(place, Sense::click_and_drag());
        let size = shown.as_ref().map_or(screen.size, |shown| shown.size);
        let rect = fitted(place, size);
        self.draw_images(ui, rect, &found.frame, screen.window.swipe);
        draw_path(ui, rect, &found, size);
        draw_pixel(ui, rect, inspected, size);
        drop(found);
        self.move_line(ui, &response, rect, screen);
        let camera = screen.camera.or(camera)?;
        self.move_object(ui, (worker, &response), rect, (screen, &camera));
        let next = self
            .moves(ui, &response, rect)
            .into_iter()
            .fold(camera, moved);
        if next != camera {
            screen.camera = Some(next);
        }
        let at = response
            .interact_pointer_pos()
            .filter(|at| response.clicked() && rect.contains(*at))?;
        Some(pixel_at(rect, size, at))
    }

    fn upload(&mut self, ctx: &Context, found: &Found) {
        if found.number == self.number {
            return;
        }
        self.number = found.number;
        let sides = &found.frame.sides;
        self.textures.resize(sides.len(), None);
        let most = ctx.input(|i| i.max_texture_side);
        let pixels = |picture: &Picture| pixels(picture, most);
        for (texture, side) in self.textures.iter_mut().zip(sides) {
            match (&mut *texture, &side.picture) {
                (_, None) => *texture = None,
                (Some(texture), Some(picture)) => {
                    texture.set(pixels(picture), TextureOptions::NEAREST)
                }
                (None, Some(picture)) => {
                    *texture =
                        Some(ctx.load_texture("image", pixels(picture), TextureOptions::NEAREST));
                }
            }
        }
    }

    fn draw_images(&self, ui: &Ui, rect: Rect, frame: &Frame, swipe: f32) {
        let painter = ui.painter();
        painter.rect_filled(rect, 0.0, ui.visuals().extreme_bg_color);
        let border = rect.left() + rect.width() * swipe;
        let whole = Rect::from_min_max(Pos2::ZERO, egui::pos2(1.0, 1.0));
        let count = self.textures.len();
        for (side, texture) in self.textures.iter().enumerate() {
            let mut part = rect;
            match side {
                0 if count > 1 => part.set_right(border),
                1 => part.set_left(border),
                _ => {}
            }
            let clipped = painter.with_clip_rect(part.intersect(painter.clip_rect()));
            match texture {
                Some(texture) => {
                    clipped.image(texture.id(), rect, whole, Color32::WHITE);
                }
                None => draw_absence(ui, &clipped, part, frame, side),
            }
            if count > 1 {
                let corner = part.left_top() + Vec2::splat(6.0);
                let font = egui::FontId::proportional(16.0);
                let galley =
                    painter.layout_no_wrap(SIDE_NAMES[side].to_owned(), font, Color32::WHITE);
                let back = Rect::from_min_size(corner, galley.size()).expand(4.0);
                clipped.rect_filled(back, 3.0, Color32::from_black_alpha(170));
                clipped.galley(corner, galley, Color32::WHITE);
            }
        }
        if count > 1 {
            for (width, color) in [(3.0, Color32::BLACK), (1.0, Color32::WHITE)] {
                let ends = [
                    egui::pos2(border, rect.top()),
                    egui::pos2(border, rect.bottom()),
                ];
                painter.line_segment(ends, Stroke::new(width, color));
            }
        }
    }

    fn move_line(&mut self, ui: &Ui, response: &egui::Response, rect: Rect, screen: &mut Screen) {
        if screen.cells.len() < 2 {
            self.is_grasped = false;
            return;
        }
        let border = rect.left() + rect.width() * screen.window.swipe;
        let is_near = |at: Pos2| (at.x - border).abs() < GRASP;
        if response.hover_pos().is_some_and(is_near) || self.is_grasped {
            ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
        }
        let pressed = ui.input(|i| i.pointer.press_origin());
        if response.drag_started() {
            self.is_grasped = pressed.is_some_and(is_near);
        }
        if let Some(at) = response.interact_pointer_pos().filter(|_| self.is_grasped) {
            screen.window.swipe = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
        }
        if response.drag_stopped() {
            self.is_grasped = false;
        }
    }

    /// Moves an object along the image while it is dragged.
    fn move_object(
        &mut self,
        ui: &Ui,
        (worker, response): (&Worker, &egui::Response),
        rect: Rect,
        (screen, camera): (&mut Screen, &Camera),
    ) {
        let is_asked = ui.input(|i| i.modifiers.alt) || self.drags_objects;
        if response.drag_started() && !self.is_grasped && is_asked {
            let pressed = ui.input(|i| i.pointer.press_origin());
            if let Some(at) = pressed.filter(|at| rect.contains(*at)) {
                self.is_moving = true;
                worker.found().grasp = None;
                worker.ask(Ask::Grasp(pixel_at(rect, screen.size, at)));
            }
        }
        if response.drag_stopped() {
            self.is_moving = false;
        }
        let by = response.drag_delta() / rect.size();
        if !self.is_moving || by == Vec2::ZERO {
            return;
        }
        ui.ctx().set_cursor_icon(egui::CursorIcon::Grabbing);
        let Some(grasp) = worker.found().grasp else {
            return;
        };
        screen.drag(&grasp, camera, by.into());
    }

    /// The moves of the camera that mouse, touch and keys ask for.
    fn moves(&self, ui: &Ui, response: &egui::Response, rect: Rect) -> Vec<Motion> {
        let mut moves = Vec::new();
        let by = response.drag_delta() / rect.height();
        let touch = ui.ctx().multi_touch();
        if let Some(touch) = touch {
            let by = touch.translation_delta / rect.height();
            moves.push(Motion::Pan([-by.x, by.y]));
        } else if response.dragged() && !self.is_grasped && !self.is_moving && by != Vec2::ZERO {
            let modifiers = ui.input(|i| i.modifiers);
            let is_pan = modifiers.shift || response.dragged_by(egui::PointerButton::Secondary);
            moves.push(if is_pan {
                Motion::Pan([-by.x, by.y])
            } else if modifiers.command || response.dragged_by(egui::PointerButton::Middle) {
                Motion::Turn([by.x * 0.5 * PI, -by.y * 0.5 * PI])
            } else {
                Motion::Orbit([-by.x * PI, by.y * PI])
            });
        }
        if response.hovered() {
            let (scroll, zoom) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
            let times = (-scroll / 400.0).exp() / zoom;
            if times != 1.0 {
                moves.push(Motion::Approach(times));
            }
        }
        if !ui.ctx().text_edit_focused() {
            moves.extend(by_keys(ui));
        }
        moves
    }
}

/// The moves of the keys that are held.
fn by_keys(ui: &Ui) -> Vec<Motion> {
    let (seconds, is_plain) = ui.input(|i| (i.stable_dt.min(0.1), i.modifiers.is_none()));
    // A key of a shortcut moves nothing until it is released, also if Ctrl is released first.
    let id = ui.scope_id().with("keys of shortcuts");
    let before: HashSet<Key> = ui.data(|kept| kept.get_temp(id)).unwrap_or_default();
    let of_shortcuts: HashSet<Key> = ui.input(|i| {
        let down = i.keys_down.iter().copied();
        down.filter(|key| !is_plain || before.contains(key))
            .collect()
    });
    ui.data_mut(|kept| kept.insert_temp(id, of_shortcuts.clone()));
    if !is_plain {
        return Vec::new();
    }
    // Arrows move the focus between buttons, where one has it.
    let is_free = ui.memory(|memory| memory.focused().is_none());
    let held = |more: Key, less: Key| {
        let is_held = |key| ui.input(|i| i.key_down(key)) && !of_shortcuts.contains(&key);
        let [more, less] = [more, less].map(|key| f32::from(u8::from(is_held(key))));
        more - less
    };
    let fly = [
        held(Key::D, Key::A),
        held(Key::E, Key::Q),
        held(Key::W, Key::S),
    ];
    let orbit = [
        held(Key::ArrowRight, Key::ArrowLeft),
        held(Key::ArrowUp, Key::ArrowDown),
    ];
    let farther = held(Key::PageDown, Key::PageUp);
    let mut moves = Vec::new();
    if fly != [0.0; 3] {
        moves.push(Motion::Fly(fly.map(|by| by * SPEED * seconds)));
    }
    if orbit != [0.0; 2] && is_free {
        moves.push(Motion::Orbit(orbit.map(|by| by * TURN * seconds)));
    }
    if farther != 0.0 {
        moves.push(Motion::Approach((farther * SPEED * seconds).exp()));
    }
    if !moves.is_empty() {
        ui.ctx().request_repaint();
    }
    moves
}

/// The pixel at a point of the image.
fn pixel_at(rect: Rect, size: [u32; 2], at: Pos2) -> [u32; 2] {
    let of = (at - rect.min) / rect.size();
    [0, 1].map(|axis| ((of[axis] * size[axis] as f32) as u32).min(size[axis] - 1))
}

/// The greatest rectangle of an image's shape in the middle of a place.
fn fitted(place: Rect, size: [u32; 2]) -> Rect {
    let size = Vec2::new(size[0] as f32, size[1] as f32);
    let scale = (place.width() / size.x).min(place.height() / size.y);
    Rect::from_center_size(place.center(), size * scale)
}

/// Every pixel, or of a picture beyond the greatest texture every second, third, … of each row and column.
fn pixels(picture: &Picture, most: usize) -> egui::ColorImage {
    let size = [picture.width as usize, picture.height as usize];
    let step = size[0].max(size[1]).div_ceil(most).max(1);
    if step == 1 {
        return egui::ColorImage::from_rgb(size, picture.pixels.as_flattened());
    }
    let rows = picture.pixels.chunks_exact(size[0]).step_by(step);
    let some: Vec<[u8; 3]> = rows
        .flat_map(|row| row.iter().copied().step_by(step))
        .collect();
    egui::ColorImage::from_rgb(size.map(|edge| edge.div_ceil(step)), some.as_flattened())
}

/// Says why there is no image.
fn draw_absence(ui: &Ui, painter: &egui::Painter, part: Rect, frame: &Frame, side: usize) {
    let fault = frame.sides.get(side).and_then(|side| side.fault.clone());
    let text = fault.unwrap_or_else(|| "no image yet: the driver compiles its kernels".to_owned());
    let font = egui::TextStyle::Body.resolve(ui.style());
    let galley = painter.layout(text, font, ui.visuals().text_color(), part.width() * 0.9);
    painter.galley(
        part.center() - 0.5 * galley.size(),
        galley,
        ui.visuals().text_color(),
    );
}

/// Draws a frame around the inspected pixel.
fn draw_pixel(ui: &Ui, rect: Rect, inspected: Option<[u32; 2]>, size: [u32; 2]) {
    let Some(pixel) = inspected else {
        return;
    };
    let scale = rect.width() / size[0] as f32;
    let corner = rect.min + Vec2::new(pixel[0] as f32, pixel[1] as f32) * scale;
    let frame = Rect::from_min_size(corner, Vec2::splat(scale)).expand(3.0);
    for (out, color) in [(0.0, Color32::WHITE), (1.0, Color32::BLACK)] {
        let stroke = Stroke::new(1.0, color);
        (ui.painter().with_clip_rect(rect)).rect_stroke(
            frame.expand(out),
            0.0,
            stroke,
            egui::StrokeKind::Outside,
        );
    }
}

/// Draws the path of the inspected pixel over the image.
fn draw_path(ui: &Ui, rect: Rect, found: &Found, size: [u32; 2]) {
    let (Some(path), Some(camera)) = (&found.path, &found.camera) else {
        return;
    };
    let painter = ui.painter().with_clip_rect(rect);
    let at = |[x, y]: [f32; 2]| {
        rect.min + Vec2::new(x / size[0] as f32, y / size[1] as f32) * rect.size()
    };
    let points = path.on(camera, size).into_iter();
    let points: Vec<Option<Pos2>> = points.map(|point| point.map(at)).collect();
    for pair in points.windows(2) {
        if let [Some(from), Some(to)] = pair {
            for (width, color) in [(4.0, Color32::BLACK), (2.0, Color32::from_rgb(255, 220, 0))] {
                painter.line_segment([*from, *to], Stroke::new(width, color));
            }
        }
    }
    for point in points.into_iter().flatten() {
        painter.circle_filled(point, 5.0, Color32::BLACK);
        painter.circle_filled(point, 3.5, Color32::from_rgb(255, 220, 0));
    }
}

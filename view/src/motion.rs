//! How the scene moves: an animation, objects that were dragged, and how structures follow.

use crate::choices::slider;
use eframe::egui;
use egui::{ComboBox, DragValue, Ui};
use raystone_config::{Animation, Motion};
use raystone_core::params::Choice;
use raystone_viewer::Screen;

/// Frames of an animation that is begun here.
const FRAMES: u32 = 32;

/// An animation of so many frames.
fn animation() -> Animation {
    Animation {
        frames: FRAMES,
        ..Animation::default()
    }
}

/// Lets frames follow one another, or stop at the one that is shown.
pub fn play(screen: &mut Screen, frame: u32) {
    let plays = screen.window.play && screen.animation.is_some();
    screen.animation.get_or_insert_with(animation);
    screen.window.play = !plays;
    screen.window.frame = frame;
}

/// What the panel moves: an animation at a frame, and objects.
pub struct Moves<'a> {
    pub frame: u32,
    /// Objects that can be dragged.
    pub objects: usize,
    /// Whether a drag moves them.
    pub drags: &'a mut bool,
    /// The object that is typed.
    pub object: &'a mut u32,
}

pub fn draw(ui: &mut Ui, screen: &mut Screen, moves: Moves) {
    let frame = moves.frame;
    let mut is_animated = screen.animation.is_some();
    if ui.checkbox(&mut is_animated, "animation").changed() {
        screen.animation = is_animated.then(animation);
        screen.window.frame = 0;
    }
    if screen.animation.is_some() {
        draw_animation(ui, screen, frame);
    }
    draw_dragged(ui, screen, moves);
    if screen.animation.is_some() || !screen.dragged.is_empty() {
        let follow = &mut screen.window.follow;
        choice(ui, "structures are", follow);
    }
}

fn draw_animation(ui: &mut Ui, screen: &mut Screen, frame: u32) {
    let plays = screen.window.play;
    let Some(animation) = &mut screen.animation else {
        return;
    };
    choice(ui, "moves", &mut animation.motion);
    ui.add(slider(&mut animation.amplitude, 0.0..=0.5).text("amplitude, radii"));
    if animation.motion == Motion::Deform {
        ui.add(slider(&mut animation.wavelength, 0.1..=4.0).text("wavelength, radii"));
    }
    ui.add(slider(&mut animation.frames, 2..=256).text("frames"));
    let last = animation.frames - 1;
    ui.horizontal(|ui| {
        let text = if plays { "stop" } else { "play" };
        if ui.button(text).on_hover_text("Space").clicked() {
            play(screen, frame);
        }
        let mut shown = frame.min(last);
        if ui.add(slider(&mut shown, 0..=last).text("frame")).changed() {
            screen.window.frame = shown;
        }
    });
    ui.horizontal(|ui| {
        let label = ui.label("samples per pixel of a frame");
        let value = DragValue::new(&mut screen.window.frame_spp).range(1..=256);
        ui.add(value.update_while_editing(false))
            .labelled_by(label.id);
    });
}

/// The ways of objects that were dragged, or are moved here.
fn draw_dragged(ui: &mut Ui, screen: &mut Screen, moves: Moves) {
    if moves.objects == 0 {
        return;
    }
    ui.checkbox(moves.drags, "a drag moves objects")
        .on_hover_text("as Alt + drag does");
    ui.horizontal(|ui| {
        let label = ui.label("object");
        let number = DragValue::new(moves.object).range(0..=moves.objects - 1);
        ui.add(number.speed(0.1)).labelled_by(label.id);
        let is_new = !screen.dragged.contains_key(moves.object);
        let add = ui.add_enabled(is_new, egui::Button::new("move it"));
        if add.on_hover_text("by numbers that are typed").clicked() {
            screen.dragged.insert(*moves.object, Default::default());
        }
    });
    for (instance, way) in &mut screen.dragged {
        ui.horizontal(|ui| {
            let label = ui.label(format!("object {instance} by"));
            for along in way.as_mut() {
                let speed = (along.abs() * 0.01).max(1e-3);
                ui.add(DragValue::new(along).speed(speed))
                    .labelled_by(label.id);
            }
        });
    }
    if !screen.dragged.is_empty() && ui.button("put objects back").clicked() {
        screen.dragged.clear();
    }
}

/// A list of the values of a choice.
fn choice<T: Choice + PartialEq>(ui: &mut Ui, label: &str, value: &mut T) {
    ComboBox::from_label(label)
        .selected_text(value.name())
        .show_ui(ui, |ui| {
            for one in T::ALL {
                ui.selectable_value(value, *one, one.name());
            }
        });
}

//! What the images are made of: a choice for each axis, with the parameters that its registry declares.

use eframe::egui;
use egui::emath::Numeric;
use egui::{ComboBox, DragValue, InnerResponse, Slider, SliderClamping, TextEdit, Ui};
use raystone_config::{Axis, COMPACTIONS, Catalogue, STRESS};
use raystone_core::params::{Entry, ParamRange, ParamValue, Parameter, Variant};
use raystone_viewer::{SIDE_NAMES, Screen};
use std::ops::RangeInclusive;

/// Axes that A and B share.
const OF_BOTH: [Axis; 3] = [Axis::Scene, Axis::Triangle, Axis::BoxTest];
/// Axes of each image.
const OF_EACH: [Axis; 8] = [
    Axis::Accel,
    Axis::Sequence,
    Axis::Decorrelation,
    Axis::Integrator,
    Axis::Organisation,
    Axis::Workgroup,
    Axis::Load,
    Axis::Offset,
];

pub fn draw(ui: &mut Ui, screen: &mut Screen, catalogue: &Catalogue) {
    draw_axes(ui, screen, catalogue, 0, &OF_BOTH);
    let sides = screen.cells.len();
    for (side, name) in SIDE_NAMES.into_iter().enumerate().take(sides) {
        if sides > 1 {
            ui.separator();
            ui.strong(name);
        }
        draw_axes(ui, screen, catalogue, side, &OF_EACH);
    }
}

fn draw_axes(ui: &mut Ui, screen: &mut Screen, catalogue: &Catalogue, side: usize, axes: &[Axis]) {
    for axis in axes {
        let Some(now) = screen.cells[side].get(*axis).cloned() else {
            continue;
        };
        if let Some(chosen) = draw_axis(ui, (*axis, side), &now, catalogue) {
            screen.choose(side, *axis, &chosen);
        }
    }
}

/// The variant that the user chose instead, if any.
fn draw_axis(
    ui: &mut Ui,
    (axis, side): (Axis, usize),
    now: &Variant,
    catalogue: &Catalogue,
) -> Option<Variant> {
    let entries = &catalogue[axis];
    let mut chosen = None;
    ui.horizontal(|ui| {
        let list = ComboBox::from_id_salt((axis.name(), side))
            .width(150.0)
            .truncate()
            .selected_text(shortened(&now.label))
            .show_ui(ui, |ui| {
                let renders = |entry: &&Entry| {
                    !entry.name.starts_with(COMPACTIONS) && !entry.name.starts_with(STRESS)
                };
                for entry in entries.iter().filter(renders) {
                    let label = ui.selectable_label(entry.name == now.name, &entry.name);
                    if label.on_hover_text(&entry.description).clicked() && entry.name != now.name {
                        chosen = Some(entry.default_variant());
                    }
                }
            });
        let label = ui.label(axis.name());
        list.response
            .labelled_by(label.id)
            .on_hover_text(&now.label);
    });
    // A model has those that every scene has.
    let entry = catalogue.entry(axis, &now.name);
    let schema: Vec<&Parameter> = entry.iter().flat_map(|entry| &entry.schema).collect();
    if schema.is_empty() {
        return chosen;
    }
    ui.indent((axis.name(), side, "parameters"), |ui| {
        egui::CollapsingHeader::new("parameters")
            .id_salt((axis.name(), side))
            .show(ui, |ui| {
                for parameter in schema {
                    let value = now
                        .params
                        .0
                        .get(parameter.name)
                        .unwrap_or(&parameter.default);
                    if let Some(value) = draw_parameter(ui, (axis, side), parameter, value) {
                        chosen = catalogue.with_parameter(axis, now, parameter.name, &value);
                    }
                }
            });
    });
    chosen
}

/// Characters of a choice that are shown at most: parameters hold whole paths and lists.
const SHOWN: usize = 30;

/// The beginning of a text that is too long for the panel.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}…", &text[..end]),
    }
}

/// A slider that leaves a value beyond its ends as it is until it is moved: an experiment may have others.
pub fn slider<N: Numeric>(value: &mut N, range: RangeInclusive<N>) -> Slider<'_> {
    Slider::new(value, range).clamping(SliderClamping::Edits)
}

/// A field for a text, and what was entered where that is another one: half a name is none yet.
fn text_field(
    ui: &mut Ui,
    id: (&'static str, usize, &'static str),
    now: &str,
) -> InnerResponse<Option<String>> {
    let id = ui.scope_id().with(id);
    let begun = ui.data(|kept| kept.get_temp::<String>(id));
    let mut text = begun.unwrap_or_else(|| now.to_owned());
    let widget = ui.add(TextEdit::singleline(&mut text).desired_width(110.0));
    if widget.has_focus() {
        ui.data_mut(|kept| kept.insert_temp(id, text));
        return InnerResponse::new(None, widget);
    }
    ui.data_mut(|kept| kept.remove_temp::<String>(id));
    let is_new = widget.lost_focus() && text != now;
    InnerResponse::new(is_new.then_some(text), widget)
}

/// A widget for the parameter's range, and the value that the user gave.
fn draw_parameter(
    ui: &mut Ui,
    (axis, side): (Axis, usize),
    parameter: &Parameter,
    value: &ParamValue,
) -> Option<ParamValue> {
    let mut given = None;
    ui.horizontal(|ui| {
        let widget = match (&parameter.range, value) {
            (ParamRange::Number { min, max }, ParamValue::Number(x)) => {
                let (mut x, speed) = (*x, (x.abs() * 0.02).max(1e-3));
                let number = DragValue::new(&mut x).range(*min..=*max).speed(speed);
                let widget = ui.add(number.update_while_editing(false));
                given = widget.changed().then_some(ParamValue::Number(x));
                widget
            }
            (ParamRange::Integer { min, max }, ParamValue::Integer(x)) => {
                let mut x = *x;
                let number = DragValue::new(&mut x).range(*min..=*max).speed(0.1);
                let widget = ui.add(number.update_while_editing(false));
                given = widget.changed().then_some(ParamValue::Integer(x));
                widget
            }
            (ParamRange::Flag, ParamValue::Flag(x)) => {
                let mut x = *x;
                let widget = ui.checkbox(&mut x, "");
                given = widget.changed().then_some(ParamValue::Flag(x));
                widget
            }
            (ParamRange::Choice(names), ParamValue::Name(now)) => {
                let list = ComboBox::from_id_salt((axis.name(), side, parameter.name))
                    .width(110.0)
                    .selected_text(now);
                let list = list.show_ui(ui, |ui| {
                    for name in names.iter() {
                        if ui.selectable_label(name == now, *name).clicked() && name != now {
                            given = Some(ParamValue::Name((*name).to_owned()));
                        }
                    }
                });
                list.response
            }
            (ParamRange::Text | ParamRange::Filled, ParamValue::Name(now)) => {
                let widget = text_field(ui, (axis.name(), side, parameter.name), now);
                given = widget.inner.map(ParamValue::Name);
                widget.response
            }
            // Lists and steps are changed in an experiment.
            _ => {
                let text = value.to_string();
                ui.label(shortened(&text)).on_hover_text(text)
            }
        };
        let label = ui.label(parameter.name);
        widget.labelled_by(label.id);
        label.on_hover_text(parameter.description);
    });
    given.filter(|value| parameter.range.allows(value))
}

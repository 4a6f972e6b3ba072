//! The window: panels around the images, and keys.

use crate::choices::{self, slider};
use crate::figures;
use crate::image::ImageView;
use crate::motion;
use crate::pixel::PixelPanel;
use crate::worker::{Ask, Message, Worker};
use eframe::egui;
use egui::util::History;
use egui::{Color32, Key, Modifiers, RichText, ScrollArea, ThemePreference, Ui};
use raystone_bench::run::Registries;
use raystone_config::{Map, Pace};
use raystone_core::files::MODEL_ENDINGS;
use raystone_core::params::Choice as _;
use raystone_viewer::Screen;
use std::path::{Path, PathBuf};

/// Greatest texture of every adapter, pixels: beyond it, pictures leave out rows and columns.
const MOST_PIXELS: u32 = 2048;
/// The least and the greatest exposure of an experiment, stops.
const EXPOSURES: [f32; 2] = [-20.0, 20.0];
/// Widths of a window from which the panels, left and right, are open, points.
const WIDTHS: [f32; 2] = [700.0, 1000.0];
/// Height that all keys fit into, points.
const HELP: f32 = 500.0;
/// What the keys do.
const KEYS: [(&str, &str); 19] = [
    ("drag, arrow keys", "orbit around the target"),
    ("Shift + drag, right drag", "move along the image"),
    ("Ctrl + drag", "look around"),
    ("Alt + drag", "move an object (instance) along the image"),
    ("wheel, pinch, Page Up, Page Down", "nearer, farther"),
    ("W A S D, Q E", "fly"),
    ("click", "inspect a pixel"),
    ("Home", "the scene's own camera"),
    ("B", "one image or two"),
    ("[ and ], drag the line", "move where they meet"),
    ("M", "next map"),
    ("+ and −", "exposure"),
    ("Space", "let the scene move, or stand still"),
    ("P", "path of the inspected pixel"),
    ("Ctrl + O", "open a model or an experiment"),
    ("Ctrl + S", "save the image"),
    ("Ctrl + E", "copy what is on screen as an experiment"),
    ("F1", "these keys"),
    ("F2, F3", "the panels, left and right"),
];

/// The window's state: what it asked the worker for, and what the user types.
pub struct App {
    pub worker: Worker,
    registries: Registries,
    /// What the user wants on screen.
    pub screen: Screen,
    /// What the worker was asked for last.
    asked: Screen,
    image: ImageView,
    pixel: PixelPanel,
    /// The object that is moved by numbers.
    object: u32,
    /// The path that is typed.
    path: String,
    file: String,
    message: Option<Message>,
    /// Whether the panels, left and right, are open; `None` until the user says so.
    are_open: [Option<bool>; 2],
    is_help_open: bool,
    /// Heights of the panels above and below, points.
    heights: [f32; 2],
    /// When a window with a display was drawn, for a second; empty without a display.
    drawn: History<()>,
}

impl App {
    pub fn new(worker: Worker, screen: Screen) -> Self {
        worker.ask(Ask::Show(Box::new(screen.clone())));
        Self {
            worker,
            registries: Registries::default(),
            asked: screen.clone(),
            screen,
            image: ImageView::default(),
            pixel: PixelPanel::default(),
            object: 0,
            path: String::new(),
            file: "view.png".to_owned(),
            message: None,
            are_open: [None; 2],
            is_help_open: false,
            heights: [0.0; 2],
            drawn: History::new(0..1000, 1.0),
        }
    }

    /// Draws the window, and sends what the user changed.
    pub fn draw(&mut self, ui: &mut Ui) {
        if std::mem::take(&mut self.worker.found().refused) {
            // A refused screen: that before it is still there.
            if let Some(screen) = self.worker.found().screen.clone() {
                self.asked = screen.clone();
                self.screen = screen;
            }
        }
        let message = self.worker.found().message.take();
        self.message = message.or(self.message.take());
        self.take_dropped(ui);
        self.take_keys(ui);
        let top = egui::Panel::top("top").show(ui, |ui| self.draw_top(ui));
        let bottom = egui::Panel::bottom("bottom").show(ui, |ui| self.draw_bottom(ui));
        let heights = [top, bottom].map(|panel| panel.response.rect.height());
        if self.heights != heights {
            // Their lines were cut at the heights of before.
            ui.ctx().request_discard("panels of other heights");
            self.heights = heights;
        }
        let [has_choices, has_figures] = [0, 1].map(|panel| self.is_open(ui, panel));
        if has_choices {
            let most = 0.4 * ui.available_width();
            let panel = egui::Panel::left("left").default_size(290.0).max_size(most);
            panel.show(ui, |ui| {
                ScrollArea::vertical().show(ui, |ui| self.draw_choices(ui));
            });
        }
        if has_figures {
            let panel = egui::Panel::right("right").default_size(300.0);
            panel.show(ui, |ui| {
                ScrollArea::vertical().show(ui, |ui| self.draw_figures(ui));
            });
        }
        egui::CentralPanel::default().show(ui, |ui| {
            let inspected = self.pixel.pixel();
            let clicked = (self.image).draw(ui, &self.worker, &mut self.screen, inspected);
            if let Some(pixel) = clicked {
                self.pixel.inspect(&self.worker, pixel);
            }
        });
        self.draw_help(ui);
        if self.asked != self.screen {
            self.worker.ask(Ask::Show(Box::new(self.screen.clone())));
            self.asked = self.screen.clone();
            self.message = self.message.take().filter(|message| !message.is_error);
        }
    }

    /// Whether a panel is open: as the user said, else if it leaves most of the window to the image.
    fn is_open(&self, ui: &Ui, panel: usize) -> bool {
        let width = ui.ctx().content_rect().width();
        self.are_open[panel].unwrap_or(width >= WIDTHS[panel])
    }

    fn draw_figures(&mut self, ui: &mut Ui) {
        let (frame, adapter) = {
            let found = self.worker.found();
            (found.frame.clone(), found.adapter.clone())
        };
        figures::draw(ui, &frame, &adapter, &self.screen);
        self.pixel.draw(ui, &self.worker, &self.screen);
    }

    fn draw_top(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new("Raystone").strong());
            let open = ui.button("Open…").on_hover_text("Ctrl + O");
            if open.clicked() {
                self.open_dialog();
            }
            // Hints are weak texts, too weak to be read.
            ui.visuals_mut().weak_text_color = Some(ui.visuals().strong_text_color());
            let typed = ui.add(
                egui::TextEdit::singleline(&mut self.path)
                    .hint_text("path of a model or an experiment")
                    .desired_width(220.0),
            );
            let typed = typed.labelled_by(open.id);
            if typed.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter)) && !self.path.is_empty() {
                self.open(&PathBuf::from(self.path.clone()));
            }
            ui.separator();
            if ui.button("Copy as experiment").on_hover_text("Ctrl + E").clicked() {
                self.copy(ui);
            }
            let save = ui.button("Save").on_hover_text(
                "Ctrl + S; what is there stays, names are numbered; the ending chooses the format: .png is what is on screen, .exr, .hdr, .pfm and .npy the linear radiance of A, .toml the experiment",
            );
            if save.clicked() {
                self.save();
            }
            ui.add(egui::TextEdit::singleline(&mut self.file).desired_width(110.0))
                .labelled_by(save.id);
            ui.separator();
            for (panel, (name, key)) in [("Choices", "F2"), ("Figures", "F3")].into_iter().enumerate() {
                let mut is_open = self.is_open(ui, panel);
                if ui.toggle_value(&mut is_open, name).on_hover_text(key).changed() {
                    self.are_open[panel] = Some(is_open);
                }
            }
            ui.toggle_value(&mut self.is_help_open, "Keys").on_hover_text("F1");
            draw_themes(ui);
        });
    }

    fn draw_bottom(&mut self, ui: &mut Ui) {
        let (status, done, notes) = {
            let found = self.worker.found();
            (
                found.status.clone(),
                found.done.clone(),
                found.notes.clone(),
            )
        };
        ui.horizontal_wrapped(|ui| {
            if let Some(status) = status {
                ui.label(RichText::new(format!("{status} …")).strong());
                ui.separator();
            }
            let texts: Vec<String> = done.iter().map(ToString::to_string).collect();
            ui.label(texts.join(" · "));
            if !self.drawn.is_empty() {
                ui.separator();
                ui.label(format!("drawn {} times a second", self.drawn.len()));
            }
            if !notes.is_empty() {
                ui.separator();
                ui.menu_button(format!("notes on the scene: {}", notes.len()), |ui| {
                    ui.label(notes.join("\n"));
                });
            }
        });
        let mut is_read = false;
        if let Some(message) = &self.message {
            ui.horizontal_wrapped(|ui| {
                is_read = ui.button("×").on_hover_text("hide the message").clicked();
                let text = RichText::new(&message.text);
                ui.label(if message.is_error {
                    text.color(warning(ui))
                } else {
                    text
                });
            });
        }
        if is_read {
            self.message = None;
        }
    }

    fn draw_choices(&mut self, ui: &mut Ui) {
        let catalogue = &self.worker.catalogue;
        let mut is_split = self.screen.cells.len() > 1;
        ui.horizontal(|ui| {
            if ui.checkbox(&mut is_split, "two images, A and B").changed() {
                self.screen.split(is_split);
            }
        });
        choices::draw(ui, &mut self.screen, catalogue);
        ui.separator();
        ui.strong("Image");
        egui::Grid::new("image").num_columns(2).show(ui, |ui| {
            let label = ui.label("width, height");
            ui.horizontal(|ui| {
                for edge in &mut self.screen.size {
                    let value = egui::DragValue::new(edge).range(16..=MOST_PIXELS);
                    // That of an experiment stays as it is.
                    let value = value.clamp_existing_to_range(false);
                    ui.add(value.update_while_editing(false))
                        .labelled_by(label.id);
                }
                if ui
                    .button("fit")
                    .on_hover_text("the size of the place for the image")
                    .clicked()
                {
                    self.screen.size = self.image.room(MOST_PIXELS);
                }
            });
            ui.end_row();
            let label = ui.label("samples per pixel");
            let value = egui::DragValue::new(&mut self.screen.spp).range(1..=1 << 16);
            ui.add(value.update_while_editing(false))
                .labelled_by(label.id);
            ui.end_row();
            let label = ui.label("seed");
            let value = egui::DragValue::new(&mut self.screen.seed);
            ui.add(value.update_while_editing(false))
                .labelled_by(label.id);
            ui.end_row();
        });
        ui.separator();
        ui.strong("Motion");
        let (frame, objects) = {
            let found = self.worker.found();
            (found.frame_number, found.frame.objects)
        };
        let moves = motion::Moves {
            frame,
            objects,
            drags: &mut self.image.drags_objects,
            object: &mut self.object,
        };
        motion::draw(ui, &mut self.screen, moves);
        ui.separator();
        ui.strong("Shown");
        self.draw_shown(ui);
    }

    fn draw_shown(&mut self, ui: &mut Ui) {
        let is_split = self.screen.cells.len() > 1;
        let window = &mut self.screen.window;
        ui.add(slider(&mut window.exposure, -8.0..=8.0).text("exposure, stops"));
        egui::ComboBox::from_label("map of the pixels")
            .selected_text(window.map.name())
            .show_ui(ui, |ui| {
                for map in Map::ALL {
                    ui.selectable_value(&mut window.map, *map, map.name());
                }
            });
        if window.map != Map::None {
            ui.add(slider(&mut window.scale, 0.0..=500.0).text("upper end, 0: 99 %"));
        }
        if is_split {
            ui.add(slider(&mut window.swipe, 0.0..=1.0).text("where A and B meet"));
            ui.horizontal(|ui| {
                ui.label("A and B have the same");
                for pace in Pace::ALL {
                    ui.radio_value(&mut window.pace, *pace, pace.name());
                }
            });
        }
        ui.checkbox(
            &mut window.error,
            "accumulate a reference, show relMSE and FLIP",
        );
    }

    fn draw_help(&mut self, ui: &mut Ui) {
        egui::Window::new("Keys")
            .open(&mut self.is_help_open)
            .resizable(false)
            .vscroll(true)
            .default_height(HELP)
            .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0])
            .show(ui.ctx(), |ui| {
                egui::Grid::new("keys")
                    .num_columns(2)
                    .striped(true)
                    .show(ui, |ui| {
                        for (key, what) in KEYS {
                            ui.strong(key);
                            ui.label(what);
                            ui.end_row();
                        }
                    });
            });
    }

    fn take_dropped(&mut self, ui: &Ui) {
        let dropped: Vec<PathBuf> = ui.input(|i| {
            i.raw
                .dropped_files
                .iter()
                .map(|f| f.path().to_owned())
                .collect()
        });
        if let Some(path) = dropped.first() {
            self.open(path);
        }
        if let ([first, _, ..], None) = (&dropped[..], &self.message) {
            self.message = Some(Message {
                text: format!(
                    "{} files were dropped, and {} is opened: drop the model alone, what belongs to it is found beside it",
                    dropped.len(),
                    first.display()
                ),
                is_error: false,
            });
        }
    }

    fn take_keys(&mut self, ui: &Ui) {
        let pressed = |modifiers, key| ui.input_mut(|i| i.consume_key(modifiers, key));
        if pressed(Modifiers::COMMAND, Key::O) {
            self.open_dialog();
        }
        if pressed(Modifiers::COMMAND, Key::S) {
            self.save();
        }
        if pressed(Modifiers::COMMAND, Key::E) {
            self.copy(ui);
        }
        if pressed(Modifiers::NONE, Key::F1) {
            self.is_help_open = !self.is_help_open;
        }
        for (key, panel) in [(Key::F2, 0), (Key::F3, 1)] {
            if pressed(Modifiers::NONE, key) {
                self.are_open[panel] = Some(!self.is_open(ui, panel));
            }
        }
        if ui.ctx().text_edit_focused() {
            return;
        }
        // Where the window is drawn a few times a second, a key is pressed more often than it is looked for.
        let times = |key| ui.input_mut(|i| i.count_and_consume_key(Modifiers::NONE, key));
        let window = &mut self.screen.window;
        let place = Map::ALL.iter().position(|map| *map == window.map);
        window.map = Map::ALL[(place.unwrap_or(0) + times(Key::M)) % Map::ALL.len()];
        for (key, by) in [(Key::OpenBracket, -0.05), (Key::CloseBracket, 0.05)] {
            window.swipe = (window.swipe + by * times(key) as f32).clamp(0.0, 1.0);
        }
        let [least, most] = EXPOSURES;
        for (key, stops) in [(Key::Plus, 0.5), (Key::Equals, 0.5), (Key::Minus, -0.5)] {
            window.exposure = (window.exposure + stops * times(key) as f32).clamp(least, most);
        }
        if pressed(Modifiers::NONE, Key::B) {
            let is_split = self.screen.cells.len() > 1;
            self.screen.split(!is_split);
        }
        if !ui.ctx().memory(|memory| memory.focused().is_some())
            && pressed(Modifiers::NONE, Key::Space)
        {
            motion::play(&mut self.screen, self.worker.found().frame_number);
        }
        if pressed(Modifiers::NONE, Key::Home) {
            self.screen.camera = None;
        }
        if pressed(Modifiers::NONE, Key::P) {
            self.pixel.ask_path(&self.worker);
        }
    }

    fn open_dialog(&mut self) {
        let chosen = rfd::FileDialog::new()
            .add_filter(
                "models and experiments",
                &[&MODEL_ENDINGS[..], &["toml"]].concat(),
            )
            .pick_file();
        match chosen {
            Some(path) => self.open(&path),
            // A desktop without dialogs answers like one that was cancelled.
            None => {
                self.message = Some(Message {
                    text: "no file was chosen; where no dialog opens, type the path beside, or drop the file on the window"
                        .to_owned(),
                    is_error: false,
                });
            }
        }
    }

    /// Shows a model, or what an experiment says.
    pub fn open(&mut self, path: &Path) {
        let name = path.display().to_string();
        let opened = if is_experiment(path) {
            let text =
                std::fs::read_to_string(path).map_err(|e| format!("cannot read {name}: {e}"));
            text.and_then(|text| {
                self.screen = Screen::parse(&text, &name, &[], &self.registries)?;
                Ok(())
            })
        } else {
            self.screen.open(&name, &self.worker.catalogue)
        };
        self.message = opened.err().map(|text| Message {
            text,
            is_error: true,
        });
    }

    fn copy(&mut self, ui: &Ui) {
        ui.ctx()
            .copy_text(self.screen.to_toml(&self.worker.catalogue));
        self.message = Some(Message {
            text: "copied; `raystone view --experiment FILE` shows it again, `raystone run FILE` measures it".to_owned(),
            is_error: false,
        });
    }

    fn save(&mut self) {
        // What is there stays.
        let file = unused(Path::new(&self.file));
        if !is_experiment(&file) {
            return self.worker.ask(Ask::Save(file, 0));
        }
        let text = self.screen.to_toml(&self.worker.catalogue);
        let (text, is_error) = match std::fs::write(&file, text) {
            Ok(()) => (format!("wrote {}", file.display()), false),
            Err(error) => (format!("cannot write {}: {error}", file.display()), true),
        };
        self.message = Some(Message { text, is_error });
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        self.drawn.add(ui.input(|i| i.time), ());
        self.draw(ui);
    }
}

fn is_experiment(file: &Path) -> bool {
    file.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
}

/// The file, or the first of `name-2`, `name-3`, … that does not exist.
pub fn unused(file: &Path) -> PathBuf {
    let stem = file.file_stem().unwrap_or_default().display();
    let ending = file.extension().unwrap_or_default().display();
    let numbered = (2..).map(|number| file.with_file_name(format!("{stem}-{number}.{ending}")));
    std::iter::once(file.to_owned())
        .chain(numbered)
        .find(|file| !file.exists())
        .unwrap_or_default()
}

fn draw_themes(ui: &mut Ui) {
    let themes = [
        (ThemePreference::System, "as the system"),
        (ThemePreference::Light, "light"),
        (ThemePreference::Dark, "dark"),
    ];
    let before = ui.ctx().options(|options| options.theme_preference);
    let now = themes.iter().find(|(theme, _)| *theme == before);
    let mut chosen = before;
    egui::ComboBox::from_label("colours")
        .width(90.0)
        .selected_text(now.map_or("", |(_, name)| name))
        .show_ui(ui, |ui| {
            for (theme, name) in themes {
                ui.selectable_value(&mut chosen, theme, name);
            }
        });
    if chosen != before {
        ui.ctx().set_theme(chosen);
    }
}

/// The colour of warnings, dark enough on light and light enough on dark.
pub fn warning(ui: &Ui) -> Color32 {
    if ui.visuals().dark_mode {
        Color32::from_rgb(255, 150, 120)
    } else {
        Color32::from_rgb(170, 30, 0)
    }
}

//! The window of Raystone: structures and samplers at work.

mod app;
mod choices;
mod figures;
mod image;
mod motion;
mod pixel;
mod screenshot;
#[cfg(test)]
mod tests;
mod worker;

use app::App;
use clap::Parser;
use eframe::egui;
use raystone_bench::run::Registries;
use raystone_gpu::AdapterChoice;
use raystone_viewer::{START, Screen};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use worker::Worker;

/// Width or height of a window, points: it has room for a button, and no adapter refuses it.
const EDGES: RangeInclusive<u32> = 240..=8192;

/// Open a window onto structures and samplers at work
#[derive(Parser)]
#[command(name = "raystone view")]
struct Arguments {
    /// Built-in scene or path of a model
    #[arg(long)]
    scene: Option<String>,
    /// Structure, or two for two images
    #[arg(long, value_name = "A[,B]", value_delimiter = ',')]
    accel: Vec<String>,
    /// Sample sequence, or two for two images
    #[arg(long, value_name = "A[,B]", value_delimiter = ',')]
    sequence: Vec<String>,
    /// Decorrelation of the pixels, or two for two images
    #[arg(long, value_name = "A[,B]", value_delimiter = ',')]
    decorrelation: Vec<String>,
    /// Experiment file whose first one or two cells are shown
    #[arg(long, value_name = "FILE")]
    experiment: Option<PathBuf>,
    /// Value laid over the experiment or the defaults, as in `raystone run`
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Adapter, by its number in `raystone list adapter` or a part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    adapter: Option<AdapterChoice>,
    /// Let glTF models name files outside their folder, and OBJ models absolute paths
    #[arg(long)]
    allow_outside: bool,
    /// Open no window: draw it into this PNG file
    #[arg(long, value_name = "FILE", value_parser = parse_png)]
    screenshot: Option<PathBuf>,
    /// Samples per pixel before the screenshot
    #[arg(long, value_name = "N", default_value_t = 16, requires = "screenshot")]
    frames: u32,
    /// Width and height of the window, points
    #[arg(long, value_name = "WxH", default_value = "1280x800", value_parser = parse_size)]
    size: [u32; 2],
}

impl Arguments {
    fn screen(&self) -> Result<Screen, String> {
        let (text, name) = match &self.experiment {
            Some(file) => {
                let text = std::fs::read_to_string(file);
                (
                    text.map_err(|e| format!("cannot read {}: {e}", file.display()))?,
                    file.display().to_string(),
                )
            }
            None => (START.to_owned(), "raystone view".to_owned()),
        };
        if let Some((axis, names)) = self.lists().into_iter().find(|(_, names)| names.len() > 2) {
            let count = names.len();
            return Err(format!(
                "--{axis} names {count}: there are two images, A and B, at most"
            ));
        }
        let is_split = self.lists().iter().any(|(_, names)| names.len() > 1);
        let overrides = |side: usize| self.of_side(side).chain(self.set.iter().cloned()).collect();
        let sides: Vec<Vec<String>> = (0..=usize::from(is_split)).map(overrides).collect();
        Screen::parse_sides(&text, &name, &sides, &Registries::default())
    }

    fn lists(&self) -> [(&'static str, &[String]); 4] {
        [
            ("scene", self.scene.as_slice()),
            ("accel", &self.accel),
            ("sequence", &self.sequence),
            ("decorrelation", &self.decorrelation),
        ]
    }

    /// The overrides of an image; where the user named one variant, both images have it.
    fn of_side(&self, side: usize) -> impl Iterator<Item = String> {
        self.lists().into_iter().filter_map(move |(axis, names)| {
            let name = names.get(side).or(names.last())?;
            Some(format!("axes.{axis}=[{name:?}]"))
        })
    }
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let edge = |text: &str| text.trim().parse().ok().filter(|edge| EDGES.contains(edge));
    let parsed = text
        .split_once(['x', 'X', '×'])
        .and_then(|(width, height)| Some([edge(width)?, edge(height)?]));
    parsed.ok_or_else(|| {
        let (least, most) = (EDGES.start(), EDGES.end());
        format!("must be width x height, each from {least} to {most}, for instance 1280x800")
    })
}

fn parse_png(text: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(text);
    let ending = file.extension().unwrap_or_default();
    if ending.eq_ignore_ascii_case("png") {
        Ok(file)
    } else {
        Err("the picture is a PNG file: its name must end in .png".to_owned())
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let ended = arguments
        .screen()
        .and_then(|screen| match &arguments.screenshot {
            Some(file) => take(&arguments, screen, file),
            None => open(&arguments, screen),
        });
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("error: {reason}");
            ExitCode::from(2)
        }
    }
}

fn take(arguments: &Arguments, screen: Screen, file: &Path) -> Result<(), String> {
    let adapter = arguments.adapter.clone().unwrap_or_default();
    let worker = Worker::start(adapter, arguments.allow_outside, || ());
    let mut app = App::new(worker, screen);
    screenshot::wait(&app.worker, &app.screen, arguments.frames)?;
    // Two devices at once take more memory.
    app.worker.end();
    let mut harness = screenshot::drawn(app, arguments.size);
    screenshot::write(&mut harness, file)?;
    let found = harness.state().worker.found();
    if let Some(ms) = found.first_picture_ms {
        eprintln!("first picture after {:.1} s", ms / 1e3);
    }
    println!("{}", file.display());
    screenshot::all_made(&found.frame.sides)
}

fn open(arguments: &Arguments, screen: Screen) -> Result<(), String> {
    let [width, height] = arguments.size.map(|edge| edge as f32);
    let viewport = egui::ViewportBuilder::default()
        .with_title("Raystone")
        .with_inner_size([width, height])
        .with_min_inner_size([*EDGES.start() as f32; 2]);
    let options = eframe::NativeOptions {
        viewport,
        ..Default::default()
    };
    let adapter = arguments.adapter.clone().unwrap_or_default();
    let allow_outside = arguments.allow_outside;
    let run = eframe::run_native(
        "Raystone",
        options,
        Box::new(move |context| {
            // Nothing moves by itself.
            context
                .egui_ctx
                .all_styles_mut(|style| style.animation_time = 0.0);
            let ctx = context.egui_ctx.clone();
            let worker = Worker::start(adapter, allow_outside, move || ctx.request_repaint());
            Ok(Box::new(App::new(worker, screen)))
        }),
    );
    run.map_err(|error| format!("no window: {error}; `--screenshot FILE` needs none"))
}

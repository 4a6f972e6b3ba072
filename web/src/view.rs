//! A scene on screen: takes what the page asks for, steps the viewer between two looks at it, and hands pictures and figures out.

use crate::PROGRAM;
use raystone_bench::run::{Registries, RunError};
use raystone_config::Axis;
use raystone_core::params::{Entry, ParamRange, ParamValue, Parameter};
use raystone_gpu::{Gpu, GpuError, KernelLibrary};
use raystone_viewer::{Frame, Motion, START, Screen, SideFrame, Step, Viewer, moved};
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::Path;

/// Devices that are opened one after the other before it gives up.
const MOST_DEVICES: usize = 3;
/// Axes on which the page offers a choice.
const AXES: [Axis; 6] = [
    Axis::Scene,
    Axis::Accel,
    Axis::Sequence,
    Axis::Decorrelation,
    Axis::Integrator,
    Axis::Organisation,
];

/// The page around a view, or a test.
pub trait Shell {
    /// Opens a device; a lost one is followed by another.
    ///
    /// # Errors
    /// There is none.
    fn open(&self, kernels: KernelLibrary) -> impl Future<Output = Result<Gpu, GpuError>>;

    /// Returns when the view may go on: one in the background waits, and one that is `idle` until it is asked for something.
    fn allowed(&self, idle: bool) -> impl Future<Output = ()>;

    /// The next request, as JSON.
    fn ask(&self) -> Option<String>;

    /// True if a request waits that makes the samples at hand useless.
    fn is_overtaken(&self) -> bool;

    /// Tells what happened, as JSON.
    fn tell(&self, news: &Value);

    /// Shows figures, and a picture of this size in bytes of red, green, blue and alpha; empty while there is none.
    fn draw(&self, figures: &Value, size: [u32; 2], picture: &[u8]);

    /// Hands a file to the visitor.
    fn save(&self, name: &str, bytes: &[u8]);
}

/// A request of the page.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Ask {
    /// What is on screen: the overrides of each image (`section.key=value`), one or two.
    Show(Vec<Vec<String>>),
    /// Moves of the camera, see [`Motion`].
    Orbit([f32; 2]),
    Turn([f32; 2]),
    Pan([f32; 2]),
    Approach(f32),
    Fly([f32; 3]),
    /// The scene's own camera.
    Home,
    /// The linear image of a side, as a file of this ending.
    Save(usize, String),
    /// The experiment that reproduces what is on screen.
    Experiment,
}

/// A device that was lost, and what was on screen.
struct Lost {
    cause: String,
    screen: Option<Screen>,
}

/// Shows what the page asks for, until its worker is ended.
///
/// # Errors
/// There is no device, or one after the other is lost.
pub async fn view(shell: &impl Shell) -> Result<(), String> {
    let mut screen = None;
    for _ in 0..MOST_DEVICES {
        let registries = Registries::default();
        let gpu = shell.open(registries.library()).await;
        let gpu = gpu.map_err(|e| e.to_string())?;
        shell.tell(&json!({ "opened": opened(&gpu, &registries) }));
        let mut viewer = Viewer::new(&gpu, registries, PROGRAM, false);
        let lost = serve(shell, &mut viewer, screen.take()).await;
        let cause = lost.cause;
        shell.tell(
            &json!({ "trouble": format!("The device was lost ({cause}); it is opened anew.") }),
        );
        screen = lost.screen;
    }
    Err(format!(
        "the device was lost {MOST_DEVICES} times: reload the page"
    ))
}

async fn serve(shell: &impl Shell, viewer: &mut Viewer<'_>, screen: Option<Screen>) -> Lost {
    let mut is_idle = screen.is_none();
    let mut ended = match screen {
        Some(screen) => show(shell, viewer, screen).await,
        None => Ok(()),
    };
    loop {
        if let Err(error) = ended {
            if let RunError::Gpu(GpuError::Lost(cause)) = error {
                let screen = viewer.screen().cloned();
                return Lost { cause, screen };
            }
            shell.tell(&json!({ "trouble": error.to_string() }));
        }
        shell.allowed(is_idle).await;
        if let Some(ask) = shell.ask() {
            is_idle = false;
            ended = answer(shell, viewer, &ask).await;
            continue;
        }
        // Each image is shown at least once, however quickly the next request follows.
        let is_seen = viewer.is_seen();
        let stop = || is_seen && shell.is_overtaken();
        ended = viewer.step_async(&stop).await.map(|step| {
            is_idle = step == Step::Idle;
            match step {
                Step::Shown => publish(shell, viewer),
                Step::Idle => shell.tell(&json!({ "idle": true })),
                Step::Worked | Step::Stopped => {}
            }
        });
        is_idle |= ended.is_err();
    }
}

async fn answer(shell: &impl Shell, viewer: &mut Viewer<'_>, ask: &str) -> Result<(), RunError> {
    let ask: Ask = serde_json::from_str(ask).map_err(|e| RunError::Input(e.to_string()))?;
    let motion = match ask {
        Ask::Show(sides) => {
            let screen = Screen::parse_sides(START, "view", &sides, viewer.registries());
            let mut screen = screen.map_err(RunError::Input)?;
            let scene = |screen: &Screen| screen.cells[0].on(&[Axis::Scene]);
            let before = viewer.screen().filter(|old| scene(old) == scene(&screen));
            screen.camera = screen.camera.or(before.and_then(|old| old.camera));
            return show(shell, viewer, screen).await;
        }
        Ask::Home => {
            let Some(screen) = viewer.screen().cloned() else {
                return Ok(());
            };
            let camera = None;
            return show(shell, viewer, Screen { camera, ..screen }).await;
        }
        Ask::Save(side, ending) => {
            let name = format!("raystone.{ending}");
            let bytes = viewer.encoded(Path::new(&name), side)?;
            shell.save(&name, &bytes);
            return Ok(());
        }
        Ask::Experiment => {
            let catalogue = viewer.registries().catalogue();
            let text = viewer.screen().map(|screen| screen.to_toml(&catalogue));
            shell.tell(&json!({ "experiment": text }));
            return Ok(());
        }
        Ask::Orbit(by) => Motion::Orbit(by),
        Ask::Turn(by) => Motion::Turn(by),
        Ask::Pan(by) => Motion::Pan(by),
        Ask::Approach(times) => Motion::Approach(times),
        Ask::Fly(by) => Motion::Fly(by),
    };
    let (Some(screen), Some(camera)) = (viewer.screen().cloned(), viewer.camera()) else {
        return Ok(());
    };
    let camera = Some(moved(camera, motion));
    show(shell, viewer, Screen { camera, ..screen }).await
}

async fn show(shell: &impl Shell, viewer: &mut Viewer<'_>, screen: Screen) -> Result<(), RunError> {
    let mut tell = |what: &str| shell.tell(&json!({ "status": what }));
    let done = viewer.show_async(screen, &mut tell).await?;
    let done: Vec<String> = done.iter().map(ToString::to_string).collect();
    shell.tell(&json!({ "done": done, "notes": viewer.notes() }));
    publish(shell, viewer);
    Ok(())
}

fn publish(shell: &impl Shell, viewer: &Viewer<'_>) {
    let Some(screen) = viewer.screen() else {
        return;
    };
    let frame = viewer.frame();
    let picture = frame.picture(screen.size, screen.window.swipe);
    let bytes = picture.map_or(Vec::new(), |picture| {
        let pixels = picture.pixels.iter();
        pixels.flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect()
    });
    shell.draw(&figures(&frame), screen.size, &bytes);
}

fn figures(frame: &Frame) -> Value {
    let side = |side: &SideFrame| {
        let known = &side.figures;
        json!({
            "label": side.label,
            "fault": side.fault,
            "spp": known.spp,
            "of": known.of,
            "sample_ms": known.sample_ms.last(),
            "mrays_s": known.mrays_s,
            "rays": known.rays.iter().map(|r| (r.class, r.per_sample, r.mrays_s)).collect::<Vec<_>>(),
            "relmse": known.relmse,
            "flip": known.flip,
            "map_mean": known.map_mean,
            "nodes": known.structure.nodes,
            "bytes": known.structure.bytes,
            "sah_cost": known.structure.sah_cost,
        })
    };
    json!({
        "triangles": frame.triangles,
        "scale": frame.scale,
        "reference_spp": frame.reference_spp,
        "sides": frame.sides.iter().map(side).collect::<Vec<_>>(),
    })
}

/// The adapter, and what can be chosen.
fn opened(gpu: &Gpu, registries: &Registries) -> Value {
    let catalogue = registries.catalogue();
    let is_rendered = |name: &str| registries.integrators.get(name).is_some();
    let start = Screen::parse(START, "view", &[], registries).ok();
    let first = |axis: Axis| {
        let cell = start.as_ref().and_then(|screen| screen.cells[0].get(axis));
        cell.map(|chosen| chosen.name.clone())
            .or(axis.default_name().map(str::to_owned))
    };
    let entries = |axis: Axis| -> Value {
        let entries = catalogue[axis].iter();
        let shown = entries.filter(|entry| axis != Axis::Integrator || is_rendered(&entry.name));
        json!({ "first": first(axis), "entries": shown.map(choice).collect::<Vec<_>>() })
    };
    let axes = AXES.map(|axis| (axis.name().to_owned(), entries(axis)));
    json!({
        "adapter": gpu.info.name,
        "software": gpu.is_software(),
        "axes": serde_json::Map::from_iter(axes),
    })
}

fn choice(entry: &Entry) -> Value {
    let parameters: Vec<Value> = entry.schema.iter().filter_map(parameter).collect();
    json!({
        "name": entry.name,
        "description": entry.description,
        "parameters": parameters,
    })
}

/// What the page needs to ask for a parameter; `None` if that takes more than a number, a switch or a list of names.
fn parameter(known: &Parameter) -> Option<Value> {
    let range = match &known.range {
        ParamRange::Number { min, max } => json!({ "min": min, "max": max, "step": "any" }),
        ParamRange::Integer { min, max } => json!({ "min": min, "max": max, "step": 1 }),
        ParamRange::Choice(names) => json!({ "names": names }),
        ParamRange::Flag => json!({}),
        _ => return None,
    };
    let default = match known.default_written()? {
        ParamValue::Number(x) => json!(x),
        ParamValue::Integer(n) => json!(n),
        ParamValue::Flag(is_on) => json!(is_on),
        ParamValue::Name(name) => json!(name),
        ParamValue::List(_) => return None,
    };
    Some(json!({
        "name": known.name,
        "description": known.description,
        "default": default,
        "range": range,
    }))
}

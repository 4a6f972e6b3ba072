//! A scene on screen: takes what the page asks for, steps the viewer between two looks at it, and hands pictures and figures out.

use crate::PROGRAM;
use crate::host::no_device;
use crate::memory::MEMORY;
use crate::opened::Opened;
use crate::told::{self, AXES};
use raystone_bench::run::{Registries, RunError};
use raystone_config::{Axis, Catalogue, Window};
use raystone_gpu::{Gpu, GpuError, KernelLibrary};
use raystone_viewer::{Display, Grasp, Motion, START, Screen, Step, Trail, Viewer, Work, moved};
use serde::Deserialize;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

/// Devices that are opened one after the other before it gives up.
const MOST_DEVICES: usize = 3;
/// Points of a sampler that are drawn and measured.
const MOST_POINTS: u32 = 1024;

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

    /// The waiting request for a screen, once, if it leaves the samples at hand as they are. It stays to be answered.
    fn glance(&self) -> Option<String>;

    /// The contents of a file of the request that was taken last, by its place there.
    fn file(&self, place: usize) -> Vec<u8>;

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
    /// Files of the visitor, by name; what moves by itself stands `still`.
    Open {
        names: Vec<String>,
        still: bool,
    },
    /// What is on screen is what the controls say from now on.
    Adopt,
    /// Moves of the camera, see [`Motion`].
    Orbit([f32; 2]),
    Turn([f32; 2]),
    Pan([f32; 2]),
    Approach(f32),
    Fly([f32; 3]),
    /// The scene's own camera.
    Home,
    /// Grasps the object that is seen at a pixel.
    Grasp([u32; 2]),
    /// Moves it along the image, by shares of its width and height.
    Drag([f32; 2]),
    /// Puts an object so far from its place, scene units.
    Place(u32, [f32; 3]),
    /// Puts all objects back.
    PutBack,
    /// What the images have at a pixel.
    Inspect([u32; 2]),
    /// The path of a sample of a side's pixel, or none any more.
    Path(Option<(usize, [u32; 2], u32)>),
    /// What a side's structure does with the ray of a pixel.
    Explain(usize, [u32; 2]),
    /// The points of a side's pixel in two dimensions.
    Points(usize, [u32; 2], [u32; 2]),
    /// The linear image of a side, as a file of this ending.
    Save(usize, String),
    /// The experiment that reproduces what is on screen.
    Experiment,
}

/// What outlives a device.
struct Session {
    registries: Registries,
    catalogue: Catalogue,
    /// What was on screen when its controls were last set to it: what they cannot say is that of it.
    base: Option<Screen>,
    /// What is dragged.
    grasp: Option<Grasp>,
    trail: Option<Trail>,
    canvas: RefCell<Canvas>,
}

/// What was rendered last, to be drawn while the viewer works.
#[derive(Default)]
struct Canvas {
    display: Display,
    size: [u32; 2],
    frame: u32,
    /// Vertices of the path that is shown, pixels.
    trail: Vec<Option<[f32; 2]>>,
    /// Objects that were moved, and how far, scene units.
    dragged: Vec<(u32, [f32; 3])>,
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
    raystone_core::files::read_from(&MEMORY)?;
    let registries = Registries::default();
    let mut session = Session {
        catalogue: registries.catalogue(),
        registries,
        base: None,
        grasp: None,
        trail: None,
        canvas: RefCell::default(),
    };
    let mut screen = None;
    for _ in 0..MOST_DEVICES {
        let registries = Registries::default();
        let gpu = shell.open(registries.library()).await;
        let gpu = gpu.map_err(|error| no_device(&error))?;
        shell.tell(&json!({ "opened": told::opened(&gpu, &registries) }));
        let mut viewer = Viewer::new(&gpu, registries, PROGRAM, false);
        let lost = serve(shell, &mut viewer, &mut session, screen.take()).await;
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

async fn serve(
    shell: &impl Shell,
    viewer: &mut Viewer<'_>,
    session: &mut Session,
    screen: Option<Screen>,
) -> Lost {
    let mut is_idle = screen.is_none();
    let mut ended = match screen {
        Some(screen) => show(shell, viewer, session, screen).await,
        None => Ok(()),
    };
    loop {
        if let Err(error) = ended {
            if let RunError::Gpu(GpuError::Lost(cause)) = error {
                let screen = viewer.screen().cloned();
                return Lost { cause, screen };
            }
            // What was on screen is there still.
            let shown = viewer.screen().map(told::shown);
            shell.tell(&json!({ "trouble": error.to_string(), "shown": shown }));
        }
        shell.allowed(is_idle).await;
        if let Some(ask) = shell.ask() {
            is_idle = false;
            ended = answer(shell, viewer, session, &ask).await;
            continue;
        }
        // Each image is shown at least once, however quickly the next request follows.
        let is_seen = viewer.is_seen();
        let stop = || {
            session.draw_as_wanted(shell);
            is_seen && shell.is_overtaken()
        };
        ended = viewer.step_async(&stop).await.map(|step| {
            is_idle = step == Step::Idle;
            match step {
                Step::Shown => publish(shell, viewer, session),
                Step::Idle => shell.tell(&json!({ "idle": true })),
                Step::Worked | Step::Stopped => {}
            }
        });
        is_idle |= ended.is_err();
    }
}

async fn answer(
    shell: &impl Shell,
    viewer: &mut Viewer<'_>,
    session: &mut Session,
    ask: &str,
) -> Result<(), RunError> {
    let ask: Ask = serde_json::from_str(ask).map_err(|e| RunError::Input(e.to_string()))?;
    let motion = match ask {
        Ask::Show(sides) => {
            let mut screen = session.screen(&sides).map_err(RunError::Input)?;
            let scene = |screen: &Screen| screen.cells[0].on(&[Axis::Scene]);
            let before = viewer.screen().filter(|old| scene(old) == scene(&screen));
            screen.camera = screen.camera.or(before.and_then(|old| old.camera));
            screen.dragged = before.map_or_else(BTreeMap::new, |old| old.dragged.clone());
            return show(shell, viewer, session, screen).await;
        }
        Ask::Open { names, still } => {
            let file = |(place, name): (usize, String)| (name, shell.file(place));
            let files = names.into_iter().enumerate().map(file).collect();
            return open(shell, viewer, session, (Opened::new(files), still)).await;
        }
        Ask::Adopt => {
            session.base = viewer.screen().cloned();
            shell.tell(&json!({ "shown": session.base.as_ref().map(told::shown) }));
            return Ok(());
        }
        Ask::Home => {
            let Some(screen) = viewer.screen().cloned() else {
                return Ok(());
            };
            let camera = None;
            return show(shell, viewer, session, Screen { camera, ..screen }).await;
        }
        Ask::Grasp(_) | Ask::Drag(_) | Ask::Place(..) | Ask::PutBack => {
            return move_object(shell, viewer, session, ask).await;
        }
        Ask::Save(side, ending) => {
            let name = format!("raystone.{ending}");
            let bytes = viewer.encoded(Path::new(&name), side)?;
            shell.save(&name, &bytes);
            return Ok(());
        }
        Ask::Experiment => {
            let text = viewer
                .screen()
                .map(|screen| screen.to_toml(&session.catalogue));
            shell.tell(&json!({ "experiment": text }));
            return Ok(());
        }
        Ask::Inspect(_) | Ask::Path(_) | Ask::Explain(..) | Ask::Points(..) => {
            return look(shell, viewer, session, ask).await;
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
    show(shell, viewer, session, Screen { camera, ..screen }).await
}

/// Moves an object. What cannot be grasped is no trouble of the view.
async fn move_object(
    shell: &impl Shell,
    viewer: &mut Viewer<'_>,
    session: &mut Session,
    ask: Ask,
) -> Result<(), RunError> {
    let (Some(mut screen), Some(camera)) = (viewer.screen().cloned(), viewer.camera()) else {
        return Ok(());
    };
    match (ask, session.grasp) {
        (Ask::Grasp(pixel), _) => {
            let grasp = viewer.grasp_async(pixel).await;
            let told = match &grasp {
                Ok(Some(grasp)) => json!({ "grasped": grasp.instance }),
                Ok(None) => {
                    json!({ "refused-drag": "nothing is seen there that could be dragged" })
                }
                Err(reason) => json!({ "refused-drag": reason }),
            };
            session.grasp = grasp.ok().flatten();
            shell.tell(&told);
            return Ok(());
        }
        (Ask::Drag(by), Some(grasp)) => screen.drag(&grasp, &camera, by),
        (Ask::Place(instance, way), _) => {
            screen.dragged.insert(instance, way.into());
        }
        (Ask::PutBack, _) => screen.dragged.clear(),
        _ => return Ok(()),
    }
    show(shell, viewer, session, screen).await
}

/// Shows what the visitor opened. If it cannot be shown, the files of before are held again.
async fn open(
    shell: &impl Shell,
    viewer: &mut Viewer<'_>,
    session: &mut Session,
    (opened, still): (Opened, bool),
) -> Result<(), RunError> {
    let (now, registries) = (viewer.screen(), &session.registries);
    let screen = opened.screen(now, registries, &session.catalogue);
    let mut screen = screen.map_err(RunError::Input)?;
    screen.window.play &= !still;
    let models = json!(opened.models());
    let before = MEMORY.replace(opened.files);
    viewer.reload(true);
    let shown = show(shell, viewer, session, screen.clone()).await;
    if shown.is_err() {
        MEMORY.replace(before);
        viewer.reload(false);
    } else {
        shell.tell(&json!({ "shown": told::shown(&screen), "models": models }));
        session.base = Some(screen);
    }
    shown
}

/// Answers what is asked of a pixel. What cannot be said there is no trouble of the view.
async fn look(
    shell: &impl Shell,
    viewer: &Viewer<'_>,
    session: &mut Session,
    ask: Ask,
) -> Result<(), RunError> {
    let status = |what: &str| shell.tell(&json!({ "status": what }));
    let found = match ask {
        Ask::Inspect(pixel) => {
            let inspection = viewer.inspect_async(pixel).await?;
            let outside = || format!("there is no pixel {}, {} to inspect", pixel[0], pixel[1]);
            let inspection = inspection.ok_or_else(outside);
            inspection.map(|found| json!({ "inspected": told::inspected(&found) }))
        }
        Ask::Path(of) => {
            if of.is_some() {
                status("following the path on the host");
            }
            let path = of.map(|(side, pixel, sample)| viewer.path(side, pixel, sample));
            let path = path
                .transpose()
                .map_err(|reason| format!("no path: {reason}"));
            session.trail = path.as_ref().ok().cloned().flatten();
            publish(shell, viewer, session);
            path.map(|path| json!({ "path": path.map(|path| path.text) }))
        }
        Ask::Explain(side, pixel) => {
            status("tracing the ray on the host");
            let text = viewer.explain(side, pixel);
            text.map(|text| json!({ "explained": text }))
        }
        Ask::Points(side, pixel, dimensions) => {
            let points = viewer.points(side, pixel, dimensions, MOST_POINTS);
            points.map(|points| json!({ "points": told::points(&points) }))
        }
        _ => return Ok(()),
    };
    status("");
    shell.tell(&found.unwrap_or_else(|reason| json!({ "refused": reason })));
    Ok(())
}

async fn show(
    shell: &impl Shell,
    viewer: &mut Viewer<'_>,
    session: &mut Session,
    screen: Screen,
) -> Result<(), RunError> {
    let was = viewer.screen().cloned();
    let mut tell = |what: &str| shell.tell(&json!({ "status": what }));
    let done = viewer.show_async(screen, &mut tell).await?;
    // What took nothing leaves what was said before.
    let is_something = done.iter().any(|done| done.work != Work::Kept);
    let done: Option<Vec<String>> =
        is_something.then(|| done.iter().map(ToString::to_string).collect());
    let now = viewer.screen();
    // What was found at a pixel holds for what it was found in; a path is drawn with any camera.
    let is_same = |same: fn(&Screen, &Screen) -> bool| {
        now.zip(was.as_ref())
            .is_some_and(|(now, was)| same(now, was))
    };
    let stays = is_same(|now, was| !now.restarts(was));
    if !is_same(Screen::has_paths_of) {
        session.trail = None;
    }
    let trail = session.trail.is_some();
    shell.tell(&json!({ "done": done, "notes": viewer.notes(), "stays": stays, "trail": trail }));
    publish(shell, viewer, session);
    Ok(())
}

fn publish(shell: &impl Shell, viewer: &Viewer<'_>, session: &Session) {
    let (Some(screen), Some(camera)) = (viewer.screen(), viewer.camera()) else {
        return;
    };
    let trail = session.trail.as_ref();
    let canvas = Canvas {
        display: viewer.display(),
        size: screen.size,
        frame: viewer.frame_number(),
        trail: trail.map_or(Vec::new(), |trail| trail.on(&camera, screen.size)),
        dragged: (screen.dragged.iter())
            .map(|(instance, way)| (*instance, way.to_array()))
            .collect(),
    };
    canvas.draw(shell, &screen.window);
    session.canvas.replace(canvas);
}

impl Canvas {
    fn draw(&self, shell: &impl Shell, window: &Window) {
        let frame = self.display.frame(window);
        let picture = frame.picture(self.size, window.swipe);
        let bytes = picture.map_or(Vec::new(), |picture| {
            let pixels = picture.pixels.iter();
            pixels.flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect()
        });
        let mut figures = told::figures(&frame);
        figures["frame"] = json!(self.frame);
        figures["trail"] = json!(self.trail);
        figures["dragged"] = json!(self.dragged);
        shell.draw(&figures, self.size, &bytes);
    }
}

impl Session {
    /// The screen of these overrides.
    fn screen(&self, sides: &[Vec<String>]) -> Result<Screen, String> {
        let mut screen = Screen::parse_sides(START, "view", sides, &self.registries)?;
        if let Some(base) = &self.base {
            carry(&mut screen, base, &self.catalogue);
        }
        Ok(screen)
    }

    /// Draws what was rendered as the page wants it, without waiting for the samples at hand.
    fn draw_as_wanted(&self, shell: &impl Shell) {
        let wanted = shell
            .glance()
            .and_then(|ask| serde_json::from_str(&ask).ok());
        let Some(Ask::Show(sides)) = wanted else {
            return;
        };
        let canvas = self.canvas.borrow();
        // What is wrong with it is said when it is answered.
        if let Ok(screen) = self.screen(&sides)
            && canvas.display.has(screen.window.map)
        {
            canvas.draw(shell, &screen.window);
        }
    }
}

/// Takes what the page has no control for from what was opened.
fn carry(screen: &mut Screen, base: &Screen, catalogue: &Catalogue) {
    screen.seed = base.seed;
    screen.reference = base.reference.clone();
    (screen.window.scale, screen.window.pace) = (base.window.scale, base.window.pace);
    for (cell, of_base) in screen.cells.iter_mut().zip(base.cells.iter().cycle()) {
        for axis in Axis::ALL {
            let (Some(before), Some(now)) = (of_base.get(axis), cell.get(axis)) else {
                continue;
            };
            let entry = catalogue.entry(axis, &now.name);
            let variant = match entry {
                _ if !AXES.contains(&axis) => before.clone(),
                _ if before.name != now.name => continue,
                None => before.clone(),
                // What the page does not ask for.
                Some(entry) => (entry.schema.iter())
                    .filter(|known| told::parameter(known).is_none())
                    .filter_map(|known| Some((known.name, before.params.0.get(known.name)?)))
                    .fold(now.clone(), |now, (name, value)| {
                        let set = catalogue.with_parameter(axis, &now, name, value);
                        set.unwrap_or(now)
                    }),
            };
            *cell = cell.clone().with(axis, &variant);
        }
    }
}

//! The thread that renders: it owns the device, takes requests, and leaves what it found for the window.

use eframe::wgpu;
use raystone_bench::run::{Registries, RunError};
use raystone_config::{Catalogue, Window};
use raystone_core::geometry::Camera;
use raystone_core::program::Program;
use raystone_gpu::{AdapterChoice, GpuError};
use raystone_viewer::{
    Display, Done, Frame, Grasp, Inspection, SamplePoints, Screen, Step, Trail, Viewer,
};
use std::cell::RefCell;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time between two looks at the queue while there is nothing to do.
const REST: Duration = Duration::from_millis(50);

/// Devices that are opened one after the other before it gives up.
const MOST_DEVICES: usize = 3;
/// Points of a sampler that are drawn and measured.
const MOST_POINTS: u32 = 1024;

/// A request of the window.
pub enum Ask {
    /// Change what is on screen.
    Show(Box<Screen>),
    /// Look at a pixel of the images.
    Inspect([u32; 2]),
    /// Compute the path of a sample of a side's pixel.
    Path(usize, [u32; 2], u32),
    /// Explain what a side's structure does with the ray of a pixel.
    Explain(usize, [u32; 2]),
    /// Compute the points of a side's pixel in two dimensions.
    Points(usize, [u32; 2], [u32; 2]),
    /// Look for the instance that is seen at a pixel.
    Grasp([u32; 2]),
    /// Write an image of a side.
    Save(PathBuf, usize),
}

/// What the thread found.
#[derive(Default)]
pub struct Found {
    /// What to draw, and its number: it grows with every change.
    pub frame: Arc<Frame>,
    pub number: u64,
    /// What is on screen.
    pub screen: Option<Screen>,
    /// Its camera.
    pub camera: Option<Camera>,
    /// What is being done that may take long.
    pub status: Option<String>,
    /// What the last change of the screen took.
    pub done: Vec<Done>,
    /// Notes on the scene.
    pub notes: Vec<String>,
    /// The last message: what went wrong, or what was written.
    pub message: Option<Message>,
    /// True if a change of the screen was refused: the window shows the screen before it again.
    pub refused: bool,
    /// The adapter.
    pub adapter: String,
    /// The interface through which it is used.
    pub backend: Option<wgpu::Backend>,
    pub inspection: Option<Inspection>,
    /// The instance that is being dragged.
    pub grasp: Option<Grasp>,
    /// The frame of the animation that is shown.
    pub frame_number: u32,
    pub path: Option<Trail>,
    pub explanation: Option<String>,
    pub points: Option<SamplePoints>,
    /// Milliseconds from the start until the first picture.
    pub first_picture_ms: Option<f64>,
    /// True if there is nothing left to do.
    pub idle: bool,
    /// How what is rendered is to be shown, if that was asked for since and needs no other samples.
    wanted: Option<Window>,
}

/// A message to the user.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    pub text: String,
    pub is_error: bool,
}

/// The thread, seen from the window.
pub struct Worker {
    asks: Option<Sender<Ask>>,
    found: Arc<Mutex<Found>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    pub catalogue: Catalogue,
}

impl Worker {
    /// Starts it; `repaint` is called whenever there is something new.
    pub fn start(
        adapter: AdapterChoice,
        allow_outside: bool,
        repaint: impl Fn() + Send + 'static,
    ) -> Self {
        let (asks, received) = channel();
        let found = Arc::new(Mutex::new(Found::default()));
        let stop = Arc::new(AtomicBool::new(false));
        let catalogue = Registries::default().catalogue();
        let inside = Inside {
            asks: received,
            found: Arc::clone(&found),
            stop: Arc::clone(&stop),
            repaint: Box::new(repaint),
            start: Instant::now(),
            display: RefCell::default(),
        };
        Self {
            asks: Some(asks),
            found,
            stop,
            thread: Some(std::thread::spawn(move || {
                inside.serve(&adapter, allow_outside)
            })),
            catalogue,
        }
    }

    /// Sends a request. A new screen ends the samples of the one before if they are not needed any more.
    pub fn ask(&self, ask: Ask) {
        if let Ask::Show(screen) = &ask {
            let mut found = self.found();
            let old = found.screen.as_ref();
            let restarts = old.is_none_or(|old| screen.restarts(old));
            self.stop.fetch_or(restarts, Ordering::Relaxed);
            found.wanted = (!restarts).then_some(screen.window);
        }
        if let Some(asks) = &self.asks {
            // A thread that has ended has left a message.
            let _ = asks.send(ask);
        }
    }

    /// Ends the thread, and gives its device and its scene back. What it found stays.
    pub fn end(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.asks = None;
        if let Some(thread) = self.thread.take() {
            // It has nothing to say any more.
            let _ = thread.join();
        }
    }

    /// What it found.
    pub fn found(&self) -> MutexGuard<'_, Found> {
        self.found.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.end();
    }
}

/// The thread, seen from inside.
struct Inside {
    asks: Receiver<Ask>,
    found: Arc<Mutex<Found>>,
    stop: Arc<AtomicBool>,
    repaint: Box<dyn Fn() + Send>,
    start: Instant,
    /// What was rendered last.
    display: RefCell<Display>,
}

/// Why the thread stops serving a device.
enum End {
    /// The window was closed.
    Closed,
    /// The device is lost; this was on screen.
    Lost(Option<Box<Screen>>),
}

impl Inside {
    fn change(&self, change: impl FnOnce(&mut Found)) {
        change(&mut self.found.lock().unwrap_or_else(PoisonError::into_inner));
        (self.repaint)();
    }

    fn say(&self, text: String, is_error: bool) {
        self.change(|found| found.message = Some(Message { text, is_error }));
    }

    /// Serves until the window is closed; a device that is lost is opened once more.
    fn serve(self, adapter: &AdapterChoice, allow_outside: bool) {
        let mut screen = None;
        for _ in 0..MOST_DEVICES {
            self.change(|found| found.status = Some("opening the adapter".to_owned()));
            let registries = Registries::default();
            let gpu = match raystone_gpu::open(adapter, registries.library()) {
                Ok(gpu) => gpu,
                Err(error) => {
                    self.change(|found| found.status = None);
                    return self.say(error.to_string(), true);
                }
            };
            self.change(|found| {
                found.adapter = gpu.info.name.clone();
                found.backend = Some(gpu.info.backend);
                found.status = None;
            });
            let viewer = Viewer::new(&gpu, registries, Program::default(), allow_outside);
            match self.serve_with(viewer, screen.take()) {
                End::Closed => return,
                End::Lost(was) => screen = was,
            }
        }
        self.say(
            format!("the device was lost {MOST_DEVICES} times: open the window again"),
            true,
        );
    }

    fn serve_with(&self, mut viewer: Viewer, screen: Option<Box<Screen>>) -> End {
        if let Some(screen) = screen
            && let Err(end) = self.show(&mut viewer, *screen)
        {
            return end;
        }
        let mut is_idle = true;
        loop {
            let first = if is_idle {
                match self.asks.recv_timeout(REST) {
                    Ok(ask) => Some(ask),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => return End::Closed,
                }
            } else {
                None
            };
            self.stop.store(false, Ordering::Relaxed);
            let mut asks: Vec<Ask> = first.into_iter().collect();
            loop {
                match self.asks.try_recv() {
                    Ok(ask) => asks.push(ask),
                    Err(TryRecvError::Empty) => break,
                    Err(TryRecvError::Disconnected) => return End::Closed,
                }
            }
            if let Err(end) = self.answer_all(&mut viewer, asks) {
                return end;
            }
            // Each image is shown at least once, however quickly the next screen follows.
            let is_seen = viewer.is_seen();
            let stop = || {
                self.draw_as_wanted();
                is_seen && self.stop.load(Ordering::Relaxed)
            };
            match viewer.step(&stop) {
                Ok(step) => {
                    is_idle = step == Step::Idle;
                    if step == Step::Shown {
                        self.publish(&viewer);
                    }
                    let is_new = self.found.lock().is_ok_and(|found| found.idle != is_idle);
                    if is_new {
                        self.change(|found| found.idle = is_idle);
                    }
                }
                Err(error) => {
                    is_idle = true;
                    if let Err(end) = self.tell(&viewer, error) {
                        return end;
                    }
                }
            }
        }
    }

    /// Answers in order; of screens only the last counts.
    fn answer_all(&self, viewer: &mut Viewer, asks: Vec<Ask>) -> Result<(), End> {
        let last = asks.iter().rposition(|ask| matches!(ask, Ask::Show(_)));
        for (place, ask) in asks.into_iter().enumerate() {
            match ask {
                Ask::Show(screen) if Some(place) == last => self.show(viewer, *screen)?,
                Ask::Show(_) => {}
                ask => self.answer(viewer, ask)?,
            }
        }
        Ok(())
    }

    fn show(&self, viewer: &mut Viewer, screen: Screen) -> Result<(), End> {
        let mut tell = |text: &str| self.change(|found| found.status = Some(text.to_owned()));
        let done = viewer.show(screen, &mut tell);
        let is_refused = done.is_err();
        match done {
            Ok(done) => self.change(|found| {
                let is_something = done.iter().any(|d| d.work != raystone_viewer::Work::Kept);
                if is_something || found.done.is_empty() {
                    found.done = done;
                }
                found.notes = viewer.notes();
                let was = found.screen.as_ref();
                let is_other = |same: fn(&Screen, &Screen) -> bool| {
                    !viewer
                        .screen()
                        .zip(was)
                        .is_some_and(|(now, was)| same(now, was))
                };
                // What was found at a pixel holds for what it was found in; lines are drawn with any camera.
                if is_other(|now, was| !now.restarts(was)) {
                    (found.inspection, found.explanation) = (None, None);
                }
                if is_other(Screen::has_paths_of) {
                    (found.path, found.points) = (None, None);
                }
            }),
            Err(error) => self.tell(viewer, error)?,
        }
        self.change(|found| {
            found.status = None;
            found.screen = viewer.screen().cloned();
            found.camera = viewer.camera();
            found.refused = is_refused;
            found.idle = false;
        });
        self.publish(viewer);
        Ok(())
    }

    fn answer(&self, viewer: &Viewer, ask: Ask) -> Result<(), End> {
        match ask {
            Ask::Show(_) => {}
            Ask::Inspect(pixel) => match viewer.inspect(pixel) {
                Ok(inspection) => self.change(|found| found.inspection = inspection),
                Err(error) => self.tell(viewer, error)?,
            },
            Ask::Grasp(pixel) => match viewer.grasp(pixel) {
                Ok(grasp) => self.change(|found| found.grasp = grasp),
                Err(reason) => self.say(reason, true),
            },
            Ask::Path(side, pixel, sample) => {
                self.change(|found| {
                    found.status = Some("following the path on the host".to_owned())
                });
                let path = viewer.path(side, pixel, sample);
                self.change(|found| found.status = None);
                match path {
                    Ok(path) => self.change(|found| found.path = Some(path)),
                    Err(reason) => self.say(format!("no path: {reason}"), true),
                }
            }
            Ask::Explain(side, pixel) => {
                self.change(|found| found.status = Some("tracing the ray on the host".to_owned()));
                let text = viewer.explain(side, pixel);
                self.change(|found| found.status = None);
                match text {
                    Ok(text) => self.change(|found| found.explanation = Some(text)),
                    Err(reason) => self.say(reason, true),
                }
            }
            Ask::Points(side, pixel, dimensions) => {
                match viewer.points(side, pixel, dimensions, MOST_POINTS) {
                    Ok(points) => self.change(|found| found.points = Some(points)),
                    Err(reason) => self.say(reason, true),
                }
            }
            Ask::Save(file, side) => match viewer.save(&file, side) {
                Ok(()) => self.say(format!("wrote {}", file.display()), false),
                Err(error) => self.tell(viewer, error)?,
            },
        }
        Ok(())
    }

    /// Tells an error, and ends with a device that is lost.
    fn tell(&self, viewer: &Viewer, error: RunError) -> Result<(), End> {
        let is_lost = matches!(error, RunError::Gpu(GpuError::Lost(_)));
        let text = if is_lost {
            format!("{error}; it is opened anew")
        } else {
            error.to_string()
        };
        self.say(text, true);
        if is_lost {
            return Err(End::Lost(viewer.screen().cloned().map(Box::new)));
        }
        Ok(())
    }

    fn publish(&self, viewer: &Viewer) {
        let window = viewer.screen().map(|screen| screen.window);
        let display = viewer.display();
        let frame = window.map_or_else(Frame::default, |window| display.frame(&window));
        self.display.replace(display);
        let is_first = frame.sides.iter().any(|side| side.picture.is_some());
        let ms = self.start.elapsed().as_secs_f64() * 1e3;
        let frame_number = viewer.frame_number();
        self.change(|found| {
            found.frame = Arc::new(frame);
            found.frame_number = frame_number;
            found.number += 1;
            if is_first {
                found.first_picture_ms.get_or_insert(ms);
            }
        });
    }

    /// Draws what was rendered as the window wants it, without waiting for the samples at hand.
    fn draw_as_wanted(&self) {
        let found = self.found.lock();
        let wanted = found.unwrap_or_else(PoisonError::into_inner).wanted.take();
        let Some(window) = wanted else {
            return;
        };
        let display = self.display.borrow();
        if display.has(window.map) {
            let frame = Arc::new(display.frame(&window));
            self.change(|found| {
                found.frame = frame;
                found.number += 1;
            });
        }
    }
}

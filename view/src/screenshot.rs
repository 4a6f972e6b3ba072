//! The window without a display: drawn into a picture once its images have their samples.

use crate::app::App;
use crate::worker::Worker;
use eframe::egui;
use eframe::egui_wgpu::WgpuSetup;
use eframe::wgpu;
use egui_kittest::Harness;
use raystone_viewer::{SIDE_NAMES, Screen, SideFrame};
use std::path::Path;
use std::time::{Duration, Instant};

/// The longest wait for the images.
const PATIENCE: Duration = Duration::from_secs(300);
/// Time between two looks at the images.
const REST: Duration = Duration::from_millis(20);

/// Waits for the images of a window, and draws it. Nothing is drawn meanwhile: all of the machine is for the images.
#[cfg(test)]
pub fn settled<'a>(app: App, frames: u32, size: [u32; 2]) -> Result<Harness<'a, App>, String> {
    wait(&app.worker, &app.screen, frames)?;
    Ok(drawn(app, size))
}

/// Draws a window.
pub fn drawn<'a>(app: App, [width, height]: [u32; 2]) -> Harness<'a, App> {
    let builder = Harness::builder()
        .with_size(egui::vec2(width as f32, height as f32))
        .with_render_cursor(false)
        // A widget without a name is a fault of the window, and no reason to refuse a picture of it.
        .with_accessibility_check(cfg!(test))
        .allow_missing_glyphs()
        .wgpu_setup(setup(app.worker.found().backend));
    let draw = |ui: &mut egui::Ui, app: &mut App| {
        // All of the picture: what is handed over has a margin.
        let whole = ui.ctx().content_rect();
        let mut ui = ui.new_child(egui::UiBuilder::new().max_rect(whole));
        ui.set_clip_rect(whole);
        app.draw(&mut ui);
    };
    let mut harness = builder.build_ui_state(draw, app);
    harness.run_steps(3);
    harness
}

/// A device to draw with, of the interface that images are made with: a driver for another would only take memory.
fn setup(backend: Option<wgpu::Backend>) -> WgpuSetup {
    let mut setup = egui_kittest::wgpu::default_wgpu_setup();
    if let (WgpuSetup::CreateNew(new), Some(backend)) = (&mut setup, backend) {
        new.instance_descriptor.backends = backend.into();
    }
    setup
}

/// Waits until each image of a screen has so many samples, fails, or is finished; an error on screen ends it.
pub fn wait(worker: &Worker, screen: &Screen, frames: u32) -> Result<(), String> {
    let start = Instant::now();
    let is_done =
        |side: &SideFrame| side.figures.spp >= frames.min(side.figures.of) || side.fault.is_some();
    while start.elapsed() < PATIENCE {
        {
            let found = worker.found();
            if let Some(message) = found.message.as_ref().filter(|message| message.is_error) {
                return Err(message.text.clone());
            }
            let sides = &found.frame.sides;
            let is_shown = found.status.is_none() && found.screen.as_ref() == Some(screen);
            if is_shown && !sides.is_empty() && sides.iter().all(is_done) {
                return Ok(());
            }
        }
        std::thread::sleep(REST);
    }
    let seconds = PATIENCE.as_secs();
    Err(format!(
        "the images did not get {frames} samples within {seconds} s"
    ))
}

/// Checks that a picture shows every image.
///
/// # Errors
/// Each image that could not be made, and why.
pub fn all_made(sides: &[SideFrame]) -> Result<(), String> {
    let faults: Vec<String> = (sides.iter().zip(SIDE_NAMES))
        .filter_map(|(side, name)| Some((name, side.fault.as_ref()?)))
        .map(|(name, fault)| format!("image {name} could not be made: {fault}"))
        .collect();
    if faults.is_empty() {
        return Ok(());
    }
    Err(faults.join("\n"))
}

/// Writes a picture of the window.
pub fn write(harness: &mut Harness<'_, App>, file: &Path) -> Result<(), String> {
    let picture = harness.render()?;
    picture
        .save(file)
        .map_err(|e| format!("cannot write {}: {e}", file.display()))
}

//! The window without a display: drawn into a picture once its images have their samples.

use crate::app::App;
use egui_kittest::Harness;
use std::path::Path;
use std::time::{Duration, Instant};

/// The longest wait for the images.
const PATIENCE: Duration = Duration::from_secs(300);

/// Draws the window until each image has so many samples, fails, or is finished, and returns it.
pub fn settled<'a>(
    app: App,
    frames: u32,
    [width, height]: [u32; 2],
) -> Result<Harness<'a, App>, String> {
    let size = eframe::egui::vec2(width as f32, height as f32);
    let builder = Harness::builder()
        .with_size(size)
        .allow_missing_glyphs()
        .wgpu();
    let mut harness = builder.build_ui_state(|ui, app: &mut App| app.draw(ui), app);
    wait(&mut harness, frames)?;
    Ok(harness)
}

/// Draws the window until each image has so many samples, fails, or is finished.
pub fn wait(harness: &mut Harness<'_, App>, frames: u32) -> Result<(), String> {
    let start = Instant::now();
    loop {
        harness.step();
        {
            let found = harness.state().worker.found();
            let sides = &found.frame.sides;
            let is_done = |side: &raystone_viewer::SideFrame| {
                side.figures.spp >= frames.min(side.figures.of) || side.fault.is_some()
            };
            let is_shown = found.screen.as_ref() == Some(&harness.state().screen);
            if is_shown && found.status.is_none() && !sides.is_empty() && sides.iter().all(is_done)
            {
                break;
            }
            if let Some(message) = harness.state().error() {
                return Err(message);
            }
        }
        if start.elapsed() > PATIENCE {
            return Err(format!(
                "the images did not get {frames} samples within {} s",
                PATIENCE.as_secs()
            ));
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    // What was asked for on the way arrives, and text is laid out.
    harness.run_steps(3);
    Ok(())
}

/// Writes a picture of the window.
pub fn write(harness: &mut Harness<'_, App>, file: &Path) -> Result<(), String> {
    let picture = harness.render()?;
    picture
        .save(file)
        .map_err(|e| format!("cannot write {}: {e}", file.display()))
}

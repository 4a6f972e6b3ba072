//! The window, drawn without a display.

use super::*;
use egui::Role;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use raystone_config::{Axis, Map};
use raystone_core::params::Choice as _;
use raystone_viewer::Work;
use screenshot::{settled, wait};

/// What a window of small images is to show.
fn asked(arguments: &[&str]) -> Screen {
    let fixed = [
        "view",
        "--set",
        "run.resolution=[48,36]",
        "--set",
        "run.spp=[4]",
    ];
    let arguments = Arguments::parse_from(fixed.iter().chain(arguments));
    arguments.screen().unwrap()
}

/// A window of small images, with so many samples.
fn window(arguments: &[&str], frames: u32) -> Harness<'static, App> {
    let worker = Worker::start(AdapterChoice::Best, false, || ());
    let app = App::new(worker, asked(arguments));
    settled(app, frames, [1280, 1000]).unwrap()
}

/// Whether a text is on screen.
fn has(harness: &Harness<'_, App>, text: &str) -> bool {
    harness.query_all_by_label_contains(text).next().is_some()
}

/// Draws until the images of what was asked for are finished.
fn settle(harness: &mut Harness<'_, App>) {
    harness.run_steps(2);
    let app = harness.state();
    wait(&app.worker, &app.screen, 4).unwrap();
    harness.run_steps(3);
}

/// Draws until what was asked for is there, and nothing is left to do.
fn rest(harness: &mut Harness<'_, App>) {
    for _ in 0..1500 {
        harness.run_steps(1);
        let app = harness.state();
        let found = app.worker.found();
        if found.idle && found.screen.as_ref() == Some(&app.screen) {
            drop(found);
            harness.run_steps(2);
            return;
        }
        drop(found);
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    panic!("there is no end to it");
}

/// Draws until a text is on screen.
fn expect(harness: &mut Harness<'_, App>, text: &str) {
    for _ in 0..1500 {
        harness.run_steps(1);
        if has(harness, text) {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    panic!("{text:?} does not come on screen");
}

#[test]
fn one_image_has_figures_and_a_click_inspects_a_pixel() {
    let mut harness = window(&["--accel", "bvh"], 4);
    for text in [
        "Mrays/s",
        "4 of 4 spp",
        "primary rays a sample",
        "nodes or cells",
    ] {
        assert!(has(&harness, text), "{text}");
    }
    assert!(!has(&harness, "no such text"));
    let middle = egui::pos2(640.0, 500.0);
    harness.drag_at(middle);
    harness.drop_at(middle);
    expect(&mut harness, "radiance");
    assert!(has(&harness, "box tests"));
    // The picture has the image in it: not one colour.
    let picture = harness.render().unwrap();
    let colors: std::collections::HashSet<_> = picture.pixels().map(|p| p.0).collect();
    assert!(colors.len() > 200, "{}", colors.len());
}

#[test]
fn keys_split_the_image_choose_a_map_and_move_the_line() {
    let mut harness = window(&[], 1);
    for key in [egui::Key::B, egui::Key::M, egui::Key::OpenBracket] {
        harness.key_press(key);
        harness.run_steps(2);
    }
    settle(&mut harness);
    let screen = &harness.state().screen;
    assert_eq!((screen.cells.len(), screen.window.map), (2, Map::Nodes));
    assert!((screen.window.swipe - 0.45).abs() < 1e-6);
    assert!(has(&harness, "nodes of a pixel's first ray"));
    let found = harness.state().worker.found();
    assert!(
        found.done.iter().all(|done| done.work != Work::Built),
        "the structure is shared: {:?}",
        found.done
    );
}

#[test]
fn bounces_and_cycles_have_maps_with_a_scale() {
    let mut harness = window(&["--accel", "bvh,brute-force"], 1);
    let mut means = Vec::new();
    for map in Map::ALL.iter().skip(1) {
        harness.key_press(egui::Key::M);
        rest(&mut harness);
        assert_eq!(harness.state().screen.window.map, *map);
        let found = harness.state().worker.found();
        let sides = found.frame.sides.iter();
        means = sides.map(|side| side.figures.map_mean).collect();
        drop(found);
        match map {
            Map::Bounces => {
                assert!(has(&harness, "bounces of a path"));
                // Paths are the same through any structure.
                assert!(means[0] == means[1] && means[0] > Some(0.5), "{means:?}");
            }
            Map::Cycles => assert!(has(&harness, "modelled cycles of a first ray")),
            map => {
                assert!(has(
                    &harness,
                    &format!("{} of a pixel's first ray", map.name())
                ));
            }
        }
    }
    assert!(means[1] > means[0] && means[0] > Some(1.0), "{means:?}");
}

/// Enters a number into the field of this name.
fn enter(harness: &mut Harness<'_, App>, field: &str, number: f64) {
    let field = harness.get_by_role_and_label(Role::SpinButton, field);
    field.set_value_accesskit(number);
    settle(harness);
}

#[test]
fn a_model_has_the_parameters_of_every_scene_and_a_wrong_text_is_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("one.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mut harness = window(&["--scene", model.to_str().unwrap()], 1);
    assert!(has(&harness, "1 triangles") && !has(&harness, "copies"));
    // The first of the list is that of the scene.
    harness
        .get_all_by_label("parameters")
        .next()
        .unwrap()
        .click();
    expect(&mut harness, "copies");
    enter(&mut harness, "copies", 3.0);
    // They stand on a ground of two.
    expect(&mut harness, "5 triangles");
    let before = harness.state().screen.cells[0][Axis::Scene].clone();
    assert_eq!(before.label, "one.obj(copies=3)");
    harness
        .get_by_role_and_label(Role::TextInput, "environment")
        .focus();
    harness.run_steps(2);
    harness.event(egui::Event::Text("no/such.hdr".to_owned()));
    harness.run_steps(2);
    // Half a name is none yet.
    assert_eq!(harness.state().screen.cells[0][Axis::Scene], before);
    harness.key_press(egui::Key::Enter);
    expect(&mut harness, "cannot read");
    harness.run_steps(5);
    assert_eq!(harness.state().screen.cells[0][Axis::Scene], before);
}

#[test]
fn an_object_is_moved_by_numbers() {
    let mut harness = window(&["--scene", "instances", "--accel", "meta-bvh"], 1);
    enter(&mut harness, "object", 2.0);
    harness.get_by_label("move it").click();
    settle(&mut harness);
    let moved: Vec<u32> = harness.state().screen.dragged.keys().copied().collect();
    assert_eq!(moved, [2]);
    assert!(has(&harness, "object 2 by"));
    assert!(has(&harness, "samples begun anew") && !has(&harness, "image kept"));
    harness.get_by_label("put objects back").click();
    settle(&mut harness);
    assert!(harness.state().screen.dragged.is_empty());
}

/// A file that is let go over the window.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

#[test]
fn a_dropped_model_is_shown_and_an_experiment_brings_back_what_was_on_screen() {
    let folder = tempfile::tempdir().unwrap();
    let [model, experiment] = ["one.obj", "screen.toml"].map(|name| folder.path().join(name));
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mut harness = window(&["--accel", "bvh,cwbvh"], 1);
    let drop = |harness: &mut Harness<'_, App>, path: &Path| {
        let file = Dropped(path.to_owned());
        let files = &mut harness.input_mut().dropped_files;
        files.push(std::sync::Arc::new(file));
        settle(harness);
    };
    drop(&mut harness, &model);
    assert!(has(&harness, "1 triangles"));
    harness.key_press(egui::Key::Plus);
    settle(&mut harness);
    let before = harness.state().screen.clone();
    assert_eq!((before.cells.len(), before.window.exposure), (2, 0.5));
    let text = before.to_toml(&harness.state().worker.catalogue);
    std::fs::write(&experiment, text).unwrap();
    harness.key_press(egui::Key::M);
    settle(&mut harness);
    assert_ne!(harness.state().screen, before);
    drop(&mut harness, &experiment);
    assert_eq!(harness.state().screen, before);
}

#[test]
fn a_drag_moves_the_camera_and_home_returns_to_that_of_the_scene() {
    let mut harness = window(&[], 1);
    assert_eq!(harness.state().screen.camera, None);
    let middle = egui::pos2(640.0, 500.0);
    harness.hover_at(middle);
    harness.drag_at(middle);
    harness.hover_at(middle + egui::vec2(40.0, 10.0));
    harness.drop_at(middle + egui::vec2(40.0, 10.0));
    settle(&mut harness);
    let moved = harness.state().screen.camera.unwrap();
    let found = harness.state().worker.found().camera;
    assert_eq!(found, Some(moved), "the image is that of the camera");
    harness.key_press(egui::Key::Home);
    settle(&mut harness);
    assert_eq!(harness.state().screen.camera, None);
    assert_ne!(harness.state().worker.found().camera, Some(moved));
}

#[test]
fn a_wrong_file_is_a_sentence_and_the_screen_stays() {
    let mut harness = window(&[], 1);
    let before = harness.state().screen.clone();
    for (path, says) in [
        ("no/such.ply", "no/such.ply"),
        ("no/such.toml", "cannot read"),
        ("notes.txt", "neither built in"),
    ] {
        harness.state_mut().open(std::path::Path::new(path));
        expect(&mut harness, says);
        assert_eq!(
            harness.state().screen.cells[0][Axis::Scene],
            before.cells[0][Axis::Scene]
        );
    }
}

#[test]
fn every_button_and_list_is_in_reach_of_the_keyboard() {
    let mut harness = window(&[], 1);
    let mut reached = std::collections::HashSet::new();
    for _ in 0..80 {
        harness.key_press(egui::Key::Tab);
        harness.run_steps(1);
        reached.extend(harness.ctx.memory(|memory| memory.focused()));
    }
    let lists = harness.query_all_by_role(Role::ComboBox).count();
    let buttons = harness.query_all_by_role(Role::Button).count();
    assert!(
        lists >= 8 && buttons >= 4,
        "{lists} lists, {buttons} buttons"
    );
    assert!(
        reached.len() >= lists + buttons,
        "{} of {lists} + {buttons}",
        reached.len()
    );
}

#[test]
fn two_names_on_an_axis_make_two_images_and_more_than_the_axis_has_is_an_error() {
    let screen =
        |arguments: &[&str]| Arguments::parse_from(["view"].iter().chain(arguments)).screen();
    let two = screen(&["--accel", "bvh,cwbvh", "--sequence", "sobol,halton"]).unwrap();
    let names =
        |side: usize| [Axis::Accel, Axis::Sequence].map(|axis| two.cells[side][axis].name.clone());
    assert_eq!(
        [names(0), names(1)],
        [["bvh", "sobol"], ["cwbvh", "halton"]].map(|n| n.map(str::to_owned))
    );
    assert_eq!(screen(&[]).unwrap().cells.len(), 1);
    assert!(screen(&["--accel", "bhv"]).unwrap_err().contains("bvh"));
    let picture = |file| Arguments::try_parse_from(["view", "--screenshot", file]);
    assert!(picture("x.PNG").is_ok() && picture("x.txt").is_err() && picture("png").is_err());
    assert!(
        screen(&["--experiment", "no/such.toml"])
            .unwrap_err()
            .contains("no/such.toml")
    );
}

#[test]
fn the_scene_moves_and_stops_and_its_frames_are_timed() {
    let set = ["--accel", "bvh,kd-tree", "--set", "animation.frames=5"];
    let mut harness = window(&set, 1);
    assert!(!has(&harness, "structure updated"));
    harness.key_press(egui::Key::Space);
    for text in [
        "A structure updated",
        "B structure updated",
        "rest",
        "a second",
    ] {
        expect(&mut harness, text);
    }
    harness.key_press(egui::Key::Space);
    settle(&mut harness);
    let app = harness.state();
    assert_eq!(app.screen.window.frame, app.worker.found().frame_number);
    assert!(!has(&harness, "a second"));
}

#[test]
fn an_object_follows_the_pointer() {
    let mut harness = window(&["--scene", "instances", "--accel", "meta-bvh"], 4);
    let before = harness.state().worker.found().number;
    let [from, to] = [egui::pos2(640.0, 500.0), egui::pos2(700.0, 470.0)];
    harness.event(egui::Event::ModifiersChanged(egui::Modifiers::ALT));
    harness.drag_at(from);
    harness.hover_at(from + egui::vec2(8.0, 0.0));
    harness.run_steps(2);
    for _ in 0..500 {
        harness.run_steps(1);
        if harness.state().worker.found().grasp.is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    harness.hover_at(to);
    harness.run_steps(2);
    harness.drop_at(to);
    harness.event(egui::Event::ModifiersChanged(egui::Modifiers::NONE));
    settle(&mut harness);
    let app = harness.state();
    assert_eq!(app.screen.dragged.len(), 1, "{:?}", app.screen.dragged);
    assert_eq!(app.screen.camera, None, "the camera stays");
    assert!(app.worker.found().number > before);
}

#[test]
fn names_of_files_that_are_there_are_numbered() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("view.png");
    assert_eq!(app::unused(&file), file);
    for name in ["view.png", "view-2.png"] {
        std::fs::write(folder.path().join(name), "").unwrap();
    }
    assert_eq!(app::unused(&file), folder.path().join("view-3.png"));
}

#[test]
fn a_key_of_a_shortcut_moves_nothing_until_it_is_released() {
    let mut harness = window(&[], 1);
    harness.hover_at(egui::pos2(640.0, 500.0));
    harness.key_down_modifiers(egui::Modifiers::COMMAND, egui::Key::E);
    harness.run_steps(2);
    assert!(has(&harness, "copied"));
    harness.event(egui::Event::ModifiersChanged(egui::Modifiers::NONE));
    harness.run_steps(4);
    assert_eq!(harness.state().screen.camera, None);
    harness.key_up(egui::Key::E);
    harness.run_steps(1);
    harness.key_down(egui::Key::E);
    harness.run_steps(4);
    assert_ne!(harness.state().screen.camera, None, "E alone flies");
}

#[test]
fn a_scene_with_a_long_parameter_leaves_the_image_its_place() {
    let ways: Vec<String> = (0..24).map(|k| format!("{k} 0.25 0 0")).collect();
    let file = tempfile::NamedTempFile::with_suffix(".toml").unwrap();
    let text = format!(
        "[axes]\nscene = [\"instances\"]\naccel = [\"cwbvh\"]\nsequence = [\"sobol\"]\n[scene.instances]\nshifts = [\"{}\"]\n",
        ways.join(", ")
    );
    std::fs::write(file.path(), text).unwrap();
    let harness = window(&["--experiment", &file.path().display().to_string()], 1);
    let list = harness.get_all_by_role(Role::ComboBox).next().unwrap();
    assert!(list.rect().width() < 260.0, "{:?}", list.rect());
}

#[test]
fn values_beyond_the_sliders_stay_until_they_are_changed() {
    let set = [
        "run.resolution=[2100,16]",
        "animation.frames=500",
        "animation.amplitude=2.0",
        "animation.wavelength=20.0",
        "window.exposure=10.0",
        "window.map=\"nodes\"",
        "window.scale=1000.0",
    ];
    let set: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
    let mut harness = window(&set, 1);
    assert_eq!(harness.state().screen, asked(&set));
    // Twice before the window is drawn again.
    for is_down in [true, false, true, false] {
        harness.event(egui::Event::Key {
            key: egui::Key::Plus,
            physical_key: None,
            pressed: is_down,
            repeat: false,
            modifiers: egui::Modifiers::NONE,
        });
    }
    settle(&mut harness);
    assert_eq!(harness.state().screen.window.exposure, 11.0);
}

#[test]
fn a_narrower_window_is_whole_when_it_is_drawn_once() {
    let mut harness = window(&[], 4);
    rest(&mut harness);
    let pixels = |harness: &mut Harness<'_, App>| harness.render().unwrap().into_raw();
    let wide = pixels(&mut harness);
    harness.set_size(egui::vec2(420.0, 500.0));
    harness.run_steps(1);
    let once = pixels(&mut harness);
    harness.run_steps(3);
    assert!(once == pixels(&mut harness), "lines are cut");
    assert_ne!(once.len(), wide.len());
}

#[test]
fn an_image_that_cannot_be_made_says_so_and_nothing_else_does() {
    let scene = "displaced-sphere(triangles=100000)";
    let arguments = ["--scene", scene, "--accel", "uniform-grid(lambda=1000)"];
    let harness = window(&arguments, 1);
    assert!(has(&harness, "cells of a uniform-grid"));
    assert!(has(&harness, "uniform-grid(lambda=1000) failed after"));
    let made = screenshot::all_made(&harness.state().worker.found().frame.sides);
    assert!(made.unwrap_err().starts_with("image A could not be made: "));
    for untrue in ["built in", "compiled in", "coarse image"] {
        assert!(!has(&harness, untrue), "{untrue}");
    }
}

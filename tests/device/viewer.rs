//! The core of the window: its images are those of `raystone render`, and a change begins no more anew than it has to.

mod maps;
mod motion;

use crate::support;
use raystone::config::{Axis, Map};
use raystone::image::read_linear;
use raystone::params::Variant;
use raystone::program::Program;
use raystone::run::{Registries, RunOptions};
use raystone_viewer::{Done, Frame, Screen, Step, Viewer, Work};
use std::path::Path;

const EXPERIMENT: &str = r#"
[run]
resolution = [40, 32]
spp = [5]
seed = 7
replicates = 1
[axes]
scene = ["cornell-box"]
accel = ["cwbvh"]
sequence = ["sobol"]
decorrelation = ["cranley-patterson"]
"#;

fn screen(overrides: &[&str]) -> Screen {
    let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
    Screen::parse(EXPERIMENT, "x.toml", &overrides, &Registries::default()).unwrap()
}

fn viewer() -> Viewer<'static> {
    Viewer::new(
        support::gpu(),
        Registries::default(),
        Program::default(),
        false,
    )
}

fn show(viewer: &mut Viewer, screen: Screen) -> Vec<Done> {
    viewer.show(screen, &mut |_| ()).unwrap()
}

fn works(done: &[Done]) -> Vec<Work> {
    done.iter().map(|done| done.work).collect()
}

/// Steps until nothing is left; returns how often there was something to show.
fn finish(viewer: &mut Viewer) -> usize {
    let mut shown = 0;
    for _ in 0..10_000 {
        match viewer.step(&|| false).unwrap() {
            Step::Idle => return shown,
            Step::Shown => shown += 1,
            Step::Worked => {}
            Step::Stopped => panic!("nobody asked to stop"),
        }
    }
    panic!("it does not come to an end");
}

fn bits(file: &Path) -> Vec<[u32; 3]> {
    let image = read_linear(file).unwrap();
    image.pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

/// The image of `raystone render`.
fn rendered(screen: &Screen, file: &Path) -> Vec<[u32; 3]> {
    let registries = Registries::default();
    let text = screen.to_toml(&registries.catalogue());
    let catalogue = registries.catalogue();
    let experiment = raystone::config::Experiment::parse(&text, "copied.toml", &[], &catalogue);
    let experiment = experiment.unwrap();
    let plan = raystone::config::Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d));
    let pictures = raystone::run::Pictures {
        file,
        order: None,
        preview: None,
    };
    let options = RunOptions::default();
    raystone::run::render(
        &experiment,
        &plan.unwrap(),
        &registries,
        &options,
        &pictures,
    )
    .unwrap();
    bits(file)
}

#[test]
fn the_finished_image_is_that_of_raystone_render_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let mut viewer = viewer();
    let one = screen(&[]);
    show(&mut viewer, one.clone());
    assert!(finish(&mut viewer) > 1, "a coarse image comes first");
    viewer.save(&file("view.pfm"), 0).unwrap();
    let expected = rendered(&one, &file("render.pfm"));
    assert!(bits(&file("view.pfm")) == expected);
    // Stopped midway, it is begun anew and is the same, with the seed of before or another.
    let mut again = one.clone();
    again.seed = 8;
    for screen in [again, one.clone()] {
        show(&mut viewer, screen);
        assert_eq!(viewer.step(&|| true).unwrap(), Step::Stopped);
    }
    finish(&mut viewer);
    viewer.save(&file("again.pfm"), 0).unwrap();
    assert!(bits(&file("again.pfm")) == expected);
    // The comparison can fail.
    let mut other = one;
    other.seed = 9;
    show(&mut viewer, other);
    finish(&mut viewer);
    viewer.save(&file("other.pfm"), 0).unwrap();
    assert!(bits(&file("other.pfm")) != expected);
    viewer.save(&file("screen.png"), 0).unwrap();
    assert!(viewer.save(&file("screen.txt"), 0).is_err());
}

#[test]
fn a_change_begins_no_more_anew_than_it_has_to() {
    let mut viewer = viewer();
    let mut now = screen(&[]);
    let done = show(&mut viewer, now.clone());
    assert_eq!(works(&done), [Work::Loaded, Work::Built, Work::Compiled]);
    // Another sampler: the structure stays.
    now.choose(
        0,
        Axis::Sequence,
        &screen(&["axes.sequence=halton"]).cells[0][Axis::Sequence].clone(),
    );
    assert_eq!(
        works(&show(&mut viewer, now.clone())),
        [Work::Kept, Work::Compiled]
    );
    // Another exposure: the image stays, with its samples.
    finish(&mut viewer);
    now.window.exposure = 1.0;
    assert_eq!(works(&show(&mut viewer, now.clone())), [Work::Kept]);
    assert_eq!(viewer.step(&|| false).unwrap(), Step::Idle);
    // Another camera: kernels stay.
    let camera = viewer.camera().unwrap();
    now.camera = Some(raystone_viewer::moved(
        camera,
        raystone_viewer::Motion::Orbit([0.1, 0.0]),
    ));
    assert_eq!(works(&show(&mut viewer, now.clone())), [Work::Restarted]);
    // A second image with another structure: the first stays.
    now.split(true);
    now.choose(
        1,
        Axis::Accel,
        &screen(&["axes.accel=bvh"]).cells[0][Axis::Accel].clone(),
    );
    assert_eq!(
        works(&show(&mut viewer, now.clone())),
        [Work::Kept, Work::Built, Work::Compiled]
    );
    finish(&mut viewer);
    // Hits are equal to the bit, and so are the images.
    let folder = tempfile::tempdir().unwrap();
    let sides = [0, 1].map(|side| {
        let file = folder.path().join(format!("{side}.pfm"));
        viewer.save(&file, side).unwrap();
        bits(&file)
    });
    assert!(sides[0] == sides[1]);
    // And back: nothing is built.
    now.split(false);
    assert_eq!(works(&show(&mut viewer, now)), [Work::Kept]);
}

#[test]
fn maps_figures_and_errors_are_there_once_they_are_asked_for() {
    let mut viewer = viewer();
    let mut now = screen(&["axes.accel=[\"bvh\", \"brute-force\"]", "reference.spp=16"]);
    now.window.map = Map::Triangles;
    now.window.error = true;
    show(&mut viewer, now.clone());
    finish(&mut viewer);
    let frame = viewer.frame();
    let [bvh, brute] = [0, 1].map(|side: usize| frame.sides[side].figures.clone());
    // Brute force tests all 36 triangles for every ray.
    assert_eq!(brute.map_mean, Some(frame.triangles as f64));
    assert!(bvh.map_mean.unwrap() < 0.5 * brute.map_mean.unwrap());
    assert_eq!(frame.scale, Some(frame.triangles as f32));
    assert_eq!(frame.reference_spp, Some(16));
    for figures in [&bvh, &brute] {
        assert_eq!((figures.spp, figures.of), (5, 5));
        assert!(figures.mrays_s.unwrap() > 0.0 && figures.sample_ms.len() >= 5);
        // One ray of the camera for each sample of a pixel.
        let camera = figures.rays[0];
        assert_eq!((camera.class, camera.per_sample), ("primary", 1.0));
        let rates: f64 = figures.rays.iter().map(|rays| rays.mrays_s).sum();
        assert!((rates / figures.mrays_s.unwrap() - 1.0).abs() < 1e-12);
    }
    // The images are the same, and so are their errors.
    assert_eq!(bvh.relmse, brute.relmse);
    assert!(bvh.relmse.unwrap() > 0.0);
    assert_eq!(bvh.flip, brute.flip);
    assert!((0.0..1.0).contains(&bvh.flip.unwrap()) && bvh.flip > Some(0.0));
    now.window.error = false;
    show(&mut viewer, now);
    let figures = &viewer.frame().sides[0].figures;
    assert_eq!([figures.relmse, figures.flip], [None; 2]);
}

#[test]
fn a_pixel_tells_its_hit_its_path_and_its_points() {
    let mut viewer = viewer();
    show(&mut viewer, screen(&["axes.accel=[\"bvh\", \"cwbvh\"]"]));
    finish(&mut viewer);
    let pixel = [20, 27];
    let found = viewer.inspect(pixel).unwrap().unwrap();
    let [a, b] = [&found.sides[0], &found.sides[1]];
    assert_eq!((a.value, a.hit, &a.material), (b.value, b.hit, &b.material));
    assert!(a.value.is_some() && a.material.is_some());
    assert!(a.work.unwrap().nodes > 0);
    assert_ne!(a.work, b.work, "two structures work differently");
    assert_eq!(viewer.inspect([40, 0]).unwrap(), None);
    let text = viewer.explain(0, pixel).unwrap();
    assert!(text.contains("equal to the bit"), "{text}");
    assert!(
        text.contains(&format!("triangle {}", a.hit.unwrap().triangle)),
        "{text}"
    );
    let path = viewer.path(0, pixel, 0).unwrap();
    let size = viewer.screen().unwrap().size;
    let drawn = path.on(&viewer.camera().unwrap(), size);
    assert_eq!(
        (drawn.len(), path.text.len()),
        (path.points.len() - 1, drawn.len())
    );
    let [x, y] = drawn[0].unwrap();
    assert_eq!([x as u32, y as u32], pixel, "the path begins in its pixel");
    // Sobol's points of one pixel are those of `points`, shifted: as even as before but for the shift.
    let points = viewer.points(0, pixel, [0, 1], 1024).unwrap();
    assert_eq!(
        (points.points.len(), points.purpose.as_str()),
        (5, "pixel position")
    );
    assert!(points.star.unwrap() < 0.8);
    assert!(viewer.points(0, pixel, [0, 4096], 4).is_err());
    assert!(viewer.points(0, [40, 0], [0, 1], 4).is_err());
}

#[test]
fn another_exposure_is_drawn_within_a_step() {
    let mut viewer = viewer();
    let mut now = screen(&["run.spp=[4096]"]);
    show(&mut viewer, now.clone());
    while viewer.frame().sides[0].figures.spp == 0 {
        viewer.step(&|| false).unwrap();
    }
    let display = viewer.display();
    let before = viewer.frame().sides[0].picture.clone().unwrap();
    now.window.exposure = 2.0;
    let brighter = std::cell::RefCell::new(None);
    // Between slices, while the viewer works.
    let draw = || {
        let frame = display.frame(&now.window);
        brighter.replace(frame.sides[0].picture.clone());
        false
    };
    while brighter.borrow().is_none() {
        assert_ne!(viewer.step(&draw).unwrap(), Step::Idle);
    }
    let brighter = brighter.into_inner().unwrap();
    let sum = |picture: &raystone::image::Picture| -> u64 {
        picture
            .pixels
            .as_flattened()
            .iter()
            .copied()
            .map(u64::from)
            .sum()
    };
    assert!(sum(&brighter) > sum(&before));
    assert!(display.has(Map::None) && !display.has(Map::Nodes));
}

#[test]
fn a_file_of_the_same_name_is_read_anew_if_it_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("one.obj");
    let write = |faces: &str| {
        let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
        std::fs::write(&file, format!("{corners}{faces}")).unwrap();
    };
    write("f 1 2 3\n");
    let mut viewer = viewer();
    let model = screen(&[&format!("axes.scene=[{:?}]", file.to_str().unwrap())]);
    show(&mut viewer, model.clone());
    write("f 1 2 3\nf 2 4 3\n");
    assert_eq!(works(&show(&mut viewer, model.clone())), [Work::Kept]);
    assert_eq!(viewer.frame().triangles, 1);
    viewer.reload(true);
    let done = works(&show(&mut viewer, model.clone()));
    assert_eq!(done, [Work::Loaded, Work::Built, Work::Compiled]);
    assert_eq!(viewer.frame().triangles, 2);
    // Once.
    assert_eq!(works(&show(&mut viewer, model)), [Work::Kept]);
}

#[test]
fn what_cannot_be_shown_is_a_sentence_and_leaves_what_is_on_screen() {
    let mut viewer = viewer();
    let good = screen(&[]);
    show(&mut viewer, good.clone());
    finish(&mut viewer);
    let folder = tempfile::tempdir().unwrap();
    let empty = folder.path().join("empty.obj");
    std::fs::write(&empty, "v 0 0 0\n").unwrap();
    let catalogue = Registries::default().catalogue();
    let mut bad: Vec<(Screen, &str)> = Vec::new();
    for (path, says) in [
        ("no/such.obj", "no/such.obj"),
        (empty.to_str().unwrap(), "triangle"),
    ] {
        let mut screen = good.clone();
        screen.open(path, &catalogue).unwrap();
        bad.push((screen, says));
    }
    let mut flat = good.clone();
    flat.size = [0, 32];
    bad.push((flat, "make it larger"));
    let mut blind = good.clone();
    let camera = viewer.camera().unwrap();
    blind.camera = Some(raystone::geometry::Camera {
        target: camera.eye,
        ..camera
    });
    bad.push((blind, "target"));
    let mut apart = good.clone();
    apart.split(true);
    apart.cells[1] = apart.cells[1]
        .clone()
        .with(Axis::Scene, &Variant::plain("city"));
    bad.push((apart, "the same triangles"));
    for (screen, says) in bad {
        let error = viewer.show(screen, &mut |_| ()).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
        assert_eq!(viewer.screen(), Some(&good));
        assert!(viewer.frame().sides[0].picture.is_some());
    }
    // An image that cannot be made says so in its place, and the other one is made.
    let mut refused = good.clone();
    refused.split(true);
    let steps = Variant::plain("no-such-structure");
    refused.choose(1, Axis::Accel, &steps);
    show(&mut viewer, refused);
    finish(&mut viewer);
    let Frame { sides, .. } = viewer.frame();
    assert!(sides[0].fault.is_none() && sides[0].picture.is_some());
    assert!(
        sides[1]
            .fault
            .as_ref()
            .unwrap()
            .contains("no-such-structure")
    );
}

//! The experiment that reproduces what is on screen.

use super::screen::Screen;
use raystone_config::{Animation, Axis, Catalogue, Window};
use raystone_core::geometry::Camera;
use raystone_core::params::{ParamValue, ParameterType, Variant};
use raystone_scene::{SHIFTS, parse_shifts, shifts_text};
use std::fmt::Write as _;

impl Screen {
    /// The experiment file of what is on screen, for [`Screen::parse`] and `raystone run`.
    pub fn to_toml(&self, catalogue: &Catalogue) -> String {
        if !self.dragged.is_empty() {
            return self.with_shifts().to_toml(catalogue);
        }
        let mut written = String::from("# What was on screen.\n");
        let text = &mut written;
        section(
            text,
            "run",
            &[
                ("replicates", ParamValue::Integer(1)),
                ("seed", self.seed.value()),
                ("resolution", self.size.value()),
                ("spp", vec![self.spp].value()),
            ],
        );
        self.write_axes(text, catalogue);
        if let Some(camera) = &self.camera {
            section(text, "camera", &view(camera));
        }
        let reference = &self.reference;
        let mut keys = vec![
            ("spp", reference.spp.value()),
            ("seed", reference.seed.value()),
        ];
        for (key, variant) in [
            ("sequence", &reference.sequence),
            ("decorrelation", &reference.decorrelation),
        ] {
            keys.push((key, ParamValue::Name(variant.name.clone())));
        }
        section(text, "reference", &keys);
        if let Some(animation) = &self.animation {
            section(text, "animation", &motion(animation));
        }
        section(text, "window", &shown(&self.window));
        written
    }

    /// The same screen with what was dragged as parameters of its scene.
    fn with_shifts(&self) -> Self {
        let mut screen = self.clone();
        let dragged = std::mem::take(&mut screen.dragged);
        for cell in &mut screen.cells {
            let mut scene = cell[Axis::Scene].clone();
            let before = scene.params.0.get(SHIFTS);
            let before = before.and_then(|ways| match ways {
                ParamValue::Name(ways) => parse_shifts(ways).ok(),
                _ => None,
            });
            let mut ways = before.unwrap_or_default();
            for (instance, way) in &dragged {
                *ways.entry(*instance).or_default() += *way;
            }
            let text = ParamValue::Name(shifts_text(&ways));
            scene.params.0.insert(SHIFTS.to_owned(), text);
            // It is that of no entry any more.
            scene.label = format!("{}({SHIFTS})", scene.name);
            *cell = cell.clone().with(Axis::Scene, &scene);
        }
        screen
    }

    /// The axes with one or two values each, their parameters, and where more than one axis has two, which of the four
    /// combinations are on screen.
    fn write_axes(&self, text: &mut String, catalogue: &Catalogue) {
        let variants = |axis: Axis| -> Vec<&Variant> {
            let mut all: Vec<&Variant> = self.cells.iter().filter_map(|c| c.get(axis)).collect();
            all.dedup();
            all
        };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "\n[axes]");
        let is_default = |axis: Axis, all: &[&Variant]| {
            all.iter()
                .all(|v| Some(v.label.as_str()) == axis.default_name() || v.name.is_empty())
        };
        let written: Vec<(Axis, Vec<&Variant>)> = Axis::ALL
            .into_iter()
            .map(|axis| (axis, variants(axis)))
            .filter(|(axis, all)| !all.is_empty() && !is_default(*axis, all))
            .collect();
        for (axis, all) in &written {
            let mut names: Vec<ParamValue> = all
                .iter()
                .map(|v| ParamValue::Name(v.name.clone()))
                .collect();
            names.dedup();
            let _ = writeln!(text, "{axis} = {}", toml_of(&ParamValue::List(names)));
        }
        for (axis, all) in &written {
            let is_same_entry = all.len() == 2 && all[0].name == all[1].name;
            for variant in all {
                let keys = changed(variant, *axis, catalogue);
                if keys.is_empty() && !is_same_entry {
                    continue;
                }
                let name = format!("{axis}.{}", quoted(&variant.name));
                let name = if is_same_entry {
                    format!("[{name}]")
                } else {
                    name
                };
                section(text, &name, &keys);
            }
        }
        let differing: Vec<&(Axis, Vec<&Variant>)> =
            written.iter().filter(|(_, all)| all.len() == 2).collect();
        if differing.len() > 1 {
            let _ = writeln!(text, "\n[[exclude]]\n{} = \"*\"", Axis::Scene);
            for side in 0..2 {
                let _ = writeln!(text, "\n[[include]]");
                for (axis, all) in &differing {
                    let _ = writeln!(text, "{axis} = {}", quoted(&all[side].label));
                }
            }
        }
    }
}

/// The parameters of a variant that differ from the defaults.
fn changed<'v>(
    variant: &'v Variant,
    axis: Axis,
    catalogue: &Catalogue,
) -> Vec<(&'v str, ParamValue)> {
    let entry = catalogue.entry(axis, &variant.name);
    let schema = entry.as_ref().map_or(&[][..], |entry| &entry.schema);
    let is_default =
        |key: &str, value: &ParamValue| schema.iter().any(|p| p.name == key && p.default == *value);
    let keys = variant.params.0.iter();
    keys.filter(|(key, value)| !is_default(key, value))
        .map(|(key, value)| (key.as_str(), value.clone()))
        .collect()
}

fn view(camera: &Camera) -> [(&'static str, ParamValue); 4] {
    [
        ("eye", camera.eye.to_array().value()),
        ("target", camera.target.to_array().value()),
        ("up", camera.up.to_array().value()),
        ("fov", camera.vertical_fov_degrees.value()),
    ]
}

fn motion(animation: &Animation) -> [(&'static str, ParamValue); 4] {
    [
        ("motion", animation.motion.value()),
        ("frames", animation.frames.value()),
        ("amplitude", animation.amplitude.value()),
        ("wavelength", animation.wavelength.value()),
    ]
}

fn shown(window: &Window) -> [(&'static str, ParamValue); 10] {
    [
        ("exposure", window.exposure.value()),
        ("map", window.map.value()),
        ("scale", window.scale.value()),
        ("swipe", window.swipe.value()),
        ("pace", window.pace.value()),
        ("error", window.error.value()),
        ("frame", window.frame.value()),
        ("play", window.play.value()),
        ("frame_spp", window.frame_spp.value()),
        ("follow", window.follow.value()),
    ]
}

fn section(text: &mut String, name: &str, keys: &[(&str, ParamValue)]) {
    let _ = writeln!(text, "\n[{name}]");
    for (key, value) in keys {
        let _ = writeln!(text, "{key} = {}", toml_of(value));
    }
}

fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

fn toml_of(value: &ParamValue) -> String {
    match value {
        // With a point, as a file has it.
        ParamValue::Number(x) => format!("{x:?}"),
        ParamValue::Name(text) => quoted(text),
        ParamValue::List(items) => {
            let items: Vec<String> = items.iter().map(toml_of).collect();
            format!("[{}]", items.join(", "))
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use raystone_bench::run::Registries;
    use raystone_config::{Follow, Map, Motion, Pace};
    use raystone_scene::LoadOptions;

    fn screen(overrides: &[&str]) -> Screen {
        let text = "[axes]\nscene = [\"cornell-box\"]\naccel = [\"bvh\"]\nsequence = [\"sobol\"]\n";
        let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
        Screen::parse(text, "x", &overrides, &Registries::default()).unwrap()
    }

    /// Reads what was written.
    fn read_back(screen: &Screen) -> Screen {
        let text = screen.to_toml(&Registries::default().catalogue());
        let read = Screen::parse(&text, "copied.toml", &[], &Registries::default());
        read.unwrap_or_else(|e| panic!("{e}\n{text}"))
    }

    #[test]
    fn an_experiment_reads_back_as_what_was_on_screen() {
        let one = screen(&["run.spp=[3]", "run.seed=77", "run.resolution=[333,100]"]);
        assert_eq!(read_back(&one), one);
        let mut moved = one.clone();
        moved.camera = Some(Camera::upright(
            Vec3::new(0.1, -2.3e-7, 1e7),
            Vec3::splat(1.0 / 3.0),
            41.7,
        ));
        moved.window = Window {
            exposure: -1.3,
            map: Map::BoxTests,
            scale: 12.5,
            swipe: 0.3,
            pace: Pace::Time,
            error: true,
            frame: 3,
            play: true,
            frame_spp: 2,
            follow: Follow::Rebuild,
        };
        moved.animation = Some(Animation {
            motion: Motion::Instances,
            frames: 12,
            amplitude: 0.3,
            wavelength: 2.0,
        });
        moved.reference.spp = 512;
        assert_eq!(read_back(&moved), moved);
        // The comparison can fail.
        moved.window.swipe = 0.4;
        assert_ne!(read_back(&one), moved);
    }

    #[test]
    fn what_was_dragged_reads_back_as_shifts_of_the_scene() {
        let mut screen = screen(&["axes.scene=[\"instances\"]"]);
        let still = screen.clone();
        screen.dragged.insert(7, Vec3::new(0.5, -1.0, 1.0 / 3.0));
        let loaded = |screen: &Screen| {
            let scene =
                raystone_scene::load(&screen.cells[0][Axis::Scene], &LoadOptions::default());
            scene.unwrap().shifted(&screen.dragged).unwrap().triangles
        };
        let read = read_back(&screen);
        assert!(read.dragged.is_empty());
        assert_eq!(loaded(&read), loaded(&screen));
        assert_ne!(loaded(&read), loaded(&still));
        // Dragged on, and back.
        let mut again = read;
        again.dragged.insert(7, Vec3::new(-0.5, 1.0, -1.0 / 3.0));
        again.dragged.insert(2, Vec3::X);
        let read = read_back(&again);
        let mut alone = still;
        alone.dragged.insert(2, Vec3::X);
        assert_eq!(loaded(&read), loaded(&alone));
    }

    #[test]
    fn two_images_read_back_whatever_they_differ_in() {
        let two = [
            vec!["axes.accel=[\"cwbvh\", \"bvh\"]"],
            vec!["accel.bvh.leaf_size=[4, 2]"],
            vec![
                "axes.sequence=[\"sobol\", \"halton\"]",
                "axes.decorrelation=[\"cranley-patterson\"]",
            ],
        ];
        for overrides in &two {
            let screen = screen(overrides);
            assert_eq!(screen.cells.len(), 2, "{overrides:?}");
            assert_eq!(read_back(&screen), screen, "{overrides:?}");
        }
        // More than one axis differs: of four combinations two are on screen.
        let mut both = screen(&two[0].iter().chain(&two[2]).copied().collect::<Vec<_>>());
        let halton = screen(&["axes.sequence=[\"halton\"]"]).cells[0][Axis::Sequence].clone();
        let bvh = screen(&["axes.accel=[\"bvh\"]"]).cells[0][Axis::Accel].clone();
        both.choose(1, Axis::Sequence, &halton);
        both.choose(1, Axis::Accel, &bvh);
        assert_ne!(both.cells[0][Axis::Accel], both.cells[1][Axis::Accel]);
        assert_ne!(both.cells[0][Axis::Sequence], both.cells[1][Axis::Sequence]);
        assert_eq!(read_back(&both), both);
    }

    #[test]
    fn a_model_with_an_odd_name_reads_back() {
        let mut screen = screen(&[]);
        let catalogue = Registries::default().catalogue();
        let model = "my \"models\"/a b.obj";
        screen.open(model, &catalogue).unwrap();
        assert_eq!(screen.cells[0][Axis::Scene].name, model);
        assert_eq!(read_back(&screen), screen);
        let before = screen.clone();
        assert!(screen.open("notes.txt", &catalogue).is_err());
        assert_eq!(screen, before);
        // With the parameters that every scene has.
        let set = |screen: &Screen, name: &str, value: &ParamValue| {
            let now = &screen.cells[0][Axis::Scene];
            catalogue.with_parameter(Axis::Scene, now, name, value)
        };
        for (name, value) in [
            ("copies", ParamValue::Integer(3)),
            ("environment", ParamValue::Name("maps/sky.hdr".to_owned())),
        ] {
            let variant = set(&screen, name, &value).unwrap();
            screen.choose(0, Axis::Scene, &variant);
            assert_eq!(read_back(&screen), screen);
        }
        let label = &screen.cells[0][Axis::Scene].label;
        assert_eq!(label, "a b.obj(environment=maps/sky.hdr,copies=3)");
        assert_eq!(set(&screen, "copies", &ParamValue::Integer(-1)), None);
        assert_eq!(set(&screen, "no such", &ParamValue::Integer(3)), None);
    }
}

//! Parameters declared by a library user: read, refused and swept like the program's own.

use raystone::config::{Axis, Catalogue, Experiment, Settings};
use raystone::parameters;
use raystone::params::{
    Choice as _, Entry, ParamError, ParamRange, ParamValue, Parameters as _, Params,
};

parameters! {
    /// A lamp.
    pub struct Lamp {
        /// radiance,
        /// any unit
        power: f64 = 2.5, in 0.0..=10.0;
        /// where it stands
        place: Place = Place::OnTheCeiling;
        /// What it is seen through.
        glass: Glass { layers = 3, in 2..=4; };
        /// whether it is on
        r#loop: bool = true;
    }

    /// A pane.
    pub struct Glass {
        /// panes, one behind the other
        layers: u32 = 1, in 0..=8;
        /// share of the light that passes
        clear: f32 = 0.2, in 0.0..=1.0;
    }

    /// A measurement of its own.
    pub struct Warmth {
        /// Times of day, hours
        hours: Vec<u32> = vec![6, 12], in 0..=23;
        /// Edges of a window, pixels
        window: [u32; 2] = [8, 8], in 1..=64, where power_of_two();
        /// A file that says more
        notes: Option<String> = None;
        /// Degrees at which it ends
        limit: f32 = f32::NAN, in -40.0..=60.0;
        /// Where it is measured
        place: Place = Place::OnTheCeiling;
    }

    /// Where a lamp stands.
    pub enum Place {
        /// Above.
        OnTheCeiling = "on-the-ceiling",
        /// Below.
        OnTheFloor = "on-the-floor",
    }
}

/// Everything a measurement adds to have its own section.
impl Settings for Warmth {
    const SECTION: &'static str = "warmth";
    const REQUIRED: &'static [&'static str] = &["limit"];

    fn contradiction(&self) -> Option<(&'static str, String)> {
        let is_cold = self.place == Place::OnTheFloor && self.limit > 30.0;
        is_cold.then(|| ("limit", "at most 30 on the floor".to_owned()))
    }
}

fn params(values: &[(&str, ParamValue)]) -> Params {
    let owned = values
        .iter()
        .map(|(name, value)| ((*name).to_owned(), value.clone()));
    Params(owned.collect())
}

#[test]
fn one_declaration_gives_schema_defaults_and_fields() {
    let schema = Lamp::schema();
    let names: Vec<_> = schema.iter().map(|p| p.name).collect();
    assert_eq!(names, ["power", "place", "layers", "clear", "loop"]);
    assert_eq!(schema[0].description, "radiance, any unit");
    // The nested struct's own declaration, and the override by the outer one.
    assert_eq!(schema[2].range, ParamRange::Integer { min: 2, max: 4 });
    assert_eq!(
        Glass::schema()[0].range,
        ParamRange::Integer { min: 0, max: 8 }
    );
    assert_eq!(
        (Lamp::default().glass.layers, Glass::default().layers),
        (3, 1)
    );
    // 0.2 as in a file, not the f64 of the f32.
    assert_eq!(schema[3].default, ParamValue::Number(0.2));
    assert_eq!(Lamp::from_params(&Params::default()), Ok(Lamp::default()));
    assert_eq!(Place::from_name("on-the-floor"), Some(Place::OnTheFloor));
    let set = params(&[
        ("power", ParamValue::Integer(7)),
        ("place", ParamValue::Name("on-the-floor".into())),
        ("clear", ParamValue::Number(0.1)),
        ("loop", ParamValue::Flag(false)),
    ]);
    let lamp = Lamp::from_params(&set).expect("values in their ranges");
    assert_eq!((lamp.power, lamp.place), (7.0, Place::OnTheFloor));
    assert_eq!((lamp.glass.clear, lamp.r#loop), (0.1, false));
}

#[test]
fn what_does_not_fit_is_an_error_that_names_it_and_never_a_panic() {
    let refused = |name: &str, value: ParamValue| {
        let error = Lamp::from_params(&params(&[(name, value)])).err();
        error
            .unwrap_or_else(|| panic!("{name} is taken"))
            .to_string()
    };
    let misspelt = refused("powr", ParamValue::Integer(1));
    assert!(
        misspelt.contains("`powr`") && misspelt.contains("`power`"),
        "{misspelt}"
    );
    for (name, value, words) in [
        ("power", ParamValue::Number(10.5), "[0, 10]"),
        ("power", ParamValue::Number(f64::NAN), "[0, 10]"),
        ("layers", ParamValue::Integer(1), "[2, 4]"),
        ("layers", ParamValue::Integer(-1), "[2, 4]"),
        ("layers", ParamValue::Number(3.0), "[2, 4]"),
        (
            "place",
            ParamValue::Name("On-The-Floor".into()),
            "on-the-floor",
        ),
        ("loop", ParamValue::Integer(1), "true or false"),
    ] {
        let error = refused(name, value);
        assert!(
            error.contains(&format!("`{name}`")) && error.contains(words),
            "{error}"
        );
    }
    // Read without completing first: an old record may lack newer parameters.
    let missing = Lamp::read(&Params::default());
    assert!(
        matches!(missing, Err(ParamError::Value { name: "power", .. })),
        "{missing:?}"
    );
}

#[test]
fn an_experiment_sweeps_them() {
    let entry = |name: &str, schema| Entry {
        name: name.to_owned(),
        description: String::new(),
        schema,
    };
    let mut catalogue: Catalogue = raystone::run::Registries::default().catalogue();
    catalogue[Axis::Accel].push(entry("lamp", Lamp::schema()));
    let text = |values: &str| {
        format!(
            "[axes]\nscene = [\"cornell-box\"]\naccel = [\"lamp\"]\nsequence = [\"sobol\"]\n\
             [accel.lamp]\n{values}\n"
        )
    };
    let parse = |values: &str| Experiment::parse(&text(values), "lamp.toml", &[], &catalogue);
    let swept = parse("layers = [2, 3]\nplace = [\"on-the-floor\", \"on-the-ceiling\"]");
    let swept = swept.expect("values in their ranges");
    let labels: Vec<_> = swept.axes[Axis::Accel]
        .iter()
        .map(|v| v.label.as_str())
        .collect();
    assert_eq!(
        labels,
        [
            "lamp(place=on-the-floor,layers=2)",
            "lamp(place=on-the-floor)",
            "lamp(layers=2)",
            "lamp",
        ]
    );
    for (values, words) in [
        ("layers = 5", "[2, 4]"),
        ("layrs = 2", "`layers`"),
        ("place = \"on-the-flor\"", "`on-the-floor`"),
    ] {
        let error = parse(values).expect_err(values).to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_section_of_settings_is_added_in_one_place_and_read() {
    let mut catalogue: Catalogue = raystone::run::Registries::default().catalogue();
    let text = |more: &str| {
        format!("[axes]\nscene = \"city\"\naccel = \"bvh\"\nsequence = \"sobol\"\n{more}")
    };
    let parse = |more: &str, known: &Catalogue| {
        Experiment::parse(
            &text(more),
            "warm.toml",
            &["timing.rounds=4".to_owned()],
            known,
        )
    };
    let unknown = parse("[warmth]\nlimit = 3\n", &catalogue).expect_err("no such section");
    assert!(
        unknown.to_string().contains("unknown section `warmth`"),
        "{unknown}"
    );
    catalogue.add_section::<Warmth>();
    let read = |more: &str| parse(more, &catalogue).map(|e| e.settings::<Warmth>());
    assert_eq!(read("").expect("it may be left out"), None);
    let written = "[warmth]\nlimit = 21\nhours = [3, 1]\nwindow = [2, 64]\nnotes = \"a.txt\"\n";
    let warmth = read(written)
        .expect("values in their ranges")
        .expect("settings");
    assert_eq!((&warmth.hours[..], warmth.window), (&[3, 1][..], [2, 64]));
    assert_eq!(
        (warmth.notes.as_deref(), warmth.limit),
        (Some("a.txt"), 21.0)
    );
    assert_eq!(warmth.place, Place::OnTheCeiling);
    for (more, message) in [
        (
            "",
            ":5: `warmth.limit` is missing; add it, as a number in [-40, 60]",
        ),
        (
            "limit = 3\nhour = [1]\n",
            ":7: unknown key in [warmth] `hour`; did you mean `hours`?",
        ),
        (
            "limit = 3\nhours = [\n1,\n24]\n",
            ":9: `warmth.hours` = 24 is not allowed",
        ),
        (
            "limit = 3\nhours = [1, 1]\n",
            ":7: `warmth.hours` lists 1 twice",
        ),
        (
            "limit = 3\nwindow = [3, 4]\n",
            "it must be a list of two powers of two in [1, 64]",
        ),
        (
            "limit = 3\nplace = \"floor\"\n",
            "did you mean `on-the-floor`?",
        ),
        (
            "limit = 40\nplace = \"on-the-floor\"\n",
            ":6: `warmth.limit` = 40 is not allowed; it must be at most 30",
        ),
    ] {
        let error = read(&format!("[warmth]\n{more}"))
            .expect_err(more)
            .to_string();
        assert!(
            error.starts_with("warm.toml:") && error.contains(message),
            "{error}"
        );
    }
    let table = catalogue.table();
    for row in [
        "| **`[warmth]`** | | | A measurement of its own. |",
        "| `warmth.hours` | a list of integers in [0, 23] | `[6, 12]` | Times of day, hours |",
        "| `warmth.notes` | a text that is not empty | – | A file that says more |",
        "| `warmth.place` | one of on-the-ceiling, on-the-floor | `\"on-the-ceiling\"` | Where it is measured |",
    ] {
        assert!(table.contains(row), "{table}");
    }
}

//! Verdicts on hand-made values detect planted faults.

use raystone::config::Experiment;
use raystone::config::expect::{Expect, Thesis};
use raystone::measure::figure::{STAR_DISCREPANCY, figure as figure_of};
use raystone::measure::record::{Interval, Key};
use raystone::report::values::{Estimate, Value};
use raystone::repro::claim::{Context, Row, judge};
use raystone::repro::judge::ClaimVerdict;
use raystone::repro::run::{Settings, prepare};
use raystone::repro::{SOURCES, Source};
use raystone::run::Registries;

fn value(accel: &str, n: u32, figure: &str, low: f64, at: f64, high: f64) -> Value<'static> {
    let key = Key::default().with("scene", "box").with("accel", accel);
    let key = key.with("spp", n);
    Value::new(
        &key,
        figure_of(figure),
        Interval {
            value: at,
            low,
            high,
        },
    )
}

fn values() -> Vec<Value<'static>> {
    vec![
        value("fast", 8, "ms-per-spp/v1", 0.9, 1.0, 1.1),
        value("slow", 8, "ms-per-spp/v1", 1.8, 2.0, 2.2),
        value("near", 8, "ms-per-spp/v1", 0.8, 1.05, 1.3),
        value("slow", 8, "nodes-per-ray/v1", 30.0, 30.0, 30.0),
        value("fast", 8, "nodes-per-ray/v1", 10.0, 10.0, 10.0),
        value("a", 8, "rmse-unbiased/v1", 0.79, 0.8, 0.81),
        value("a", 32, "rmse-unbiased/v1", 0.39, 0.4, 0.41),
        value("a", 128, "rmse-unbiased/v1", 0.19, 0.2, 0.21),
    ]
}

pub fn expect(body: &str) -> Expect {
    let head = "[thesis]\ntitle = \"t\"\nsource = \"s\"\n[[expect]]\nid = \"x\"\nsays = \"y\"\n";
    let thesis = Thesis::parse(&format!("{head}{body}"), "test.toml");
    thesis.expect("sound").expect("a thesis").expects.remove(0)
}

fn gpu() -> Context {
    Context::default()
}

fn software() -> Context {
    Context {
        software: true,
        ..Context::default()
    }
}

fn found(body: &str, context: &Context) -> Row {
    let mut rows = judge(&expect(body), &values(), context);
    assert_eq!(rows.len(), 1, "{rows:?}");
    rows.remove(0)
}

const RATIO: &str = "figure = \"ms-per-spp/v1\"\ncompare = \"ratio\"\nof = { accel = \"slow\" }\nover = { accel = \"fast\" }\n";

#[test]
fn a_ratio_upside_down_is_seen_and_its_interval_counts() {
    let at = |body: String| found(&body, &gpu()).verdict;
    assert_eq!(at(format!("{RATIO}least = 1.5")), ClaimVerdict::Supported);
    assert_eq!(at(format!("{RATIO}most = 1.0")), ClaimVerdict::Contradicted);
    // 2.0 is above 1.9, but its interval is not.
    assert_eq!(at(format!("{RATIO}least = 1.9")), ClaimVerdict::Undecided);
    let upside_down = RATIO
        .replace("slow", "_")
        .replace("fast", "slow")
        .replace('_', "fast");
    assert_eq!(
        at(format!("{upside_down}least = 1.5")),
        ClaimVerdict::Contradicted
    );
    let row = found(
        &format!("{RATIO}least = 1.5\nexplain = [\"nodes-per-ray/v1\"]"),
        &gpu(),
    );
    assert_eq!(row.ours.map(|i| i.value), Some(2.0));
    assert_eq!(row.counted, [("nodes/ray".to_owned(), 3.0)]);
}

#[test]
fn times_of_a_software_adapter_are_shown_and_not_judged() {
    let row = found(
        &format!("{RATIO}least = 1.5\ndevice = \"gpu\""),
        &software(),
    );
    assert_eq!(row.verdict, ClaimVerdict::NotTestable);
    assert!(row.ours.is_some() && row.reason.contains("software"));
    let anywhere = found(&format!("{RATIO}least = 1.5"), &software());
    assert_eq!(anywhere.verdict, ClaimVerdict::Supported);
    let order = "figure = \"ms-per-spp/v1\"\ncompare = \"order\"\ndevice = \"gpu\"\norder = [{ accel = \"fast\" }, { accel = \"slow\" }]\n";
    let row = found(order, &software());
    assert_eq!(row.verdict, ClaimVerdict::NotTestable);
    assert!(row.reason.contains("software") && row.reason.contains("fast 1.00 → slow 2.00"));
}

#[test]
fn an_order_reversed_is_seen() {
    let order = |names: [&str; 2]| {
        let picks = names
            .map(|name| format!("{{ accel = \"{name}\" }}"))
            .join(", ");
        let body = format!("figure = \"ms-per-spp/v1\"\ncompare = \"order\"\norder = [{picks}]\n");
        found(&body, &gpu()).verdict
    };
    assert_eq!(order(["fast", "slow"]), ClaimVerdict::Supported);
    assert_eq!(order(["slow", "fast"]), ClaimVerdict::Contradicted);
    assert_eq!(order(["fast", "near"]), ClaimVerdict::Undecided);
}

#[test]
fn a_slope_is_judged_against_the_thesis() {
    let body = |thesis: f64| {
        format!(
            "figure = \"rmse-unbiased/v1\"\ncompare = \"slope\"\nalong = \"spp\"\noff_by = 0.1\nat = [{{ thesis = {thesis:?} }}]\n"
        )
    };
    assert_eq!(found(&body(-0.5), &gpu()).verdict, ClaimVerdict::Supported);
    assert_eq!(
        found(&body(0.5), &gpu()).verdict,
        ClaimVerdict::Contradicted
    );
    assert_eq!(found(&body(-0.6), &gpu()).verdict, ClaimVerdict::Undecided);
}

#[test]
fn a_thesis_in_another_unit_is_converted_and_one_that_measures_something_else_is_a_fault() {
    let body = |unit: &str, thesis: &str| {
        format!(
            "figure = \"ms-per-spp/v1\"\ncompare = \"bound\"\nof = {{ accel = \"slow\" }}\nwithin = 1.2\nunit = \"{unit}\"\nat = [{{ thesis = {thesis} }}]\n"
        )
    };
    let seconds = found(&body("s", "0.002"), &gpu());
    assert_eq!(
        (seconds.verdict, seconds.thesis),
        (ClaimVerdict::Supported, Some(2.0))
    );
    assert_eq!(
        found(&body("ms", "0.002"), &gpu()).verdict,
        ClaimVerdict::Contradicted
    );
    assert_eq!(
        found(&body("Mrays/s", "2.0"), &gpu()).verdict,
        ClaimVerdict::Faulty
    );
}

#[test]
fn an_expectation_that_selects_nothing_is_a_fault_unless_it_was_left_out_for_a_reason() {
    let body = RATIO.replace("\"fast\"", "\"fst\"") + "least = 1.0";
    let row = found(&body, &gpu());
    assert_eq!(row.verdict, ClaimVerdict::Faulty);
    assert!(row.reason.contains("accel = fst"), "{}", row.reason);
    let context = Context {
        absent: vec![(
            Key::default().with("accel", "fst"),
            "it was too big".to_owned(),
        )],
        ..Context::default()
    };
    let row = found(&body, &context);
    assert_eq!(
        (row.verdict, row.reason.as_str()),
        (ClaimVerdict::NotTestable, "it was too big")
    );
    let two = "figure = \"rmse-unbiased/v1\"\ncompare = \"ratio\"\nof = { spp = \"8\" }\nover = { spp = \"*\" }\nleast = 1.0";
    let row = found(two, &gpu());
    assert_eq!(row.verdict, ClaimVerdict::Faulty);
    assert!(row.reason.contains("name the axis"), "{}", row.reason);
}

#[test]
fn a_missing_scene_is_told_and_the_rest_is_judged() {
    let head = "[thesis]\ntitle = \"t\"\nsource = \"s\"\n[[substitute]]\noriginal = \"There\"\n[[substitute]]\noriginal = \"Gone\"\n[[expect]]\nid = \"x\"\nsays = \"y\"\n";
    let body =
        format!("{head}{RATIO}least = 1.0\nat = [{{ on = \"There\" }}, {{ on = \"Gone\" }}]\n");
    let thesis = Thesis::parse(&body, "test.toml")
        .expect("sound")
        .expect("a thesis");
    let context = Context {
        scenes: vec![
            ("There".to_owned(), Ok("box".to_owned())),
            ("Gone".to_owned(), Err("get it from there".to_owned())),
        ],
        ..Context::default()
    };
    let rows = judge(&thesis.expects[0], &values(), &context);
    let verdicts: Vec<_> = rows
        .iter()
        .map(|row| (row.verdict, row.row.as_str()))
        .collect();
    assert_eq!(
        verdicts,
        [
            (ClaimVerdict::Supported, "There"),
            (ClaimVerdict::NotTestable, "Gone")
        ]
    );
    assert_eq!(rows[1].reason, "get it from there");
}

#[test]
fn a_plain_run_passes_over_what_is_expected_but_tells_a_fault_in_it() {
    let registries = Registries::default();
    let text = SOURCES[0].text;
    let parse = |text: &str| Experiment::parse(text, "x.toml", &[], &registries.catalogue());
    assert!(parse(text).is_ok());
    let faulty = text.replace("compare = \"ratio\"", "compere = \"ratio\"");
    let error = parse(&faulty).expect_err("a fault").to_string();
    assert!(
        error.contains("`compere`") && error.contains("`compare`"),
        "{error}"
    );
}

#[test]
fn a_place_that_a_short_run_leaves_out_is_tested_by_a_whole_one_alone() {
    let at = "least = 1.0\nat = [{ row = \"large\", full_only = true }]\n";
    let said = |quick| {
        let context = Context {
            quick,
            ..Context::default()
        };
        found(&(RATIO.to_owned() + at), &context).verdict
    };
    assert_eq!(said(true), ClaimVerdict::NotTestable);
    assert_eq!(said(false), ClaimVerdict::Supported);
}

#[test]
fn what_a_place_says_goes_before_what_the_expectation_says() {
    let bounds = RATIO.to_owned() + "least = 1.5\nat = [{ least = 2.5 }]\n";
    assert_eq!(found(&bounds, &gpu()).verdict, ClaimVerdict::Contradicted);
    let most = RATIO.to_owned() + "most = 1.5\nat = [{ most = 2.5 }]\n";
    assert_eq!(found(&most, &gpu()).verdict, ClaimVerdict::Supported);
    let of = "figure = \"nodes-per-ray/v1\"\ncompare = \"bound\"\nof = { accel = \"slow\" }\nmost = 15\nat = [{ of = { accel = \"fast\" } }]\n";
    let row = found(of, &gpu());
    assert_eq!(
        (row.verdict, row.ours.map(|i| i.value)),
        (ClaimVerdict::Supported, Some(10.0))
    );
    let over = RATIO.to_owned() + "least = 1.0\nat = [{ over = { accel = \"near\" } }]\n";
    assert_eq!(found(&over, &gpu()).ours.map(|i| i.value), Some(2.0 / 1.05));
}

#[test]
fn an_error_that_the_reference_does_not_resolve_leaves_it_open_and_a_word_is_no_number() {
    let key = Key::default().with("accel", "a");
    let of = |reading: Estimate, figure: &str| {
        let values = [Value::new(&key, figure_of(figure), reading)];
        let body = format!("figure = \"{figure}\"\ncompare = \"bound\"\nmost = 1.0\n");
        judge(&expect(&body), &values, &gpu()).remove(0)
    };
    let below = of(Estimate::Below(0.5), "rmse-unbiased/v1");
    assert_eq!((below.verdict, below.ours), (ClaimVerdict::Undecided, None));
    let word = of(Estimate::Word("never"), "break-even/v1");
    assert_eq!(
        (word.verdict, &*word.reason),
        (ClaimVerdict::NotTestable, "never")
    );
}

#[test]
fn every_step_of_an_order_counts_and_the_least_is_shown() {
    let of = |names: [&str; 3]| {
        let picks = names
            .map(|name| format!("{{ accel = \"{name}\" }}"))
            .join(", ");
        let values = [("a", 1.0), ("b", 3.0), ("c", 4.5)]
            .map(|(accel, ms)| value(accel, 8, "ms-per-spp/v1", ms, ms, ms));
        let body = format!("figure = \"ms-per-spp/v1\"\ncompare = \"order\"\norder = [{picks}]\n");
        let row = judge(&expect(&body), &values, &gpu()).remove(0);
        (row.verdict, row.ours.expect("a step").value, row.reason)
    };
    let (verdict, step, reason) = of(["a", "b", "c"]);
    assert_eq!((verdict, step), (ClaimVerdict::Supported, 1.5));
    assert!(reason.starts_with("a 1.00 → b 3.00 → c 4.50"), "{reason}");
    assert_eq!(of(["a", "c", "b"]).0, ClaimVerdict::Contradicted);
    assert_eq!(of(["b", "a", "c"]).0, ClaimVerdict::Contradicted);
}

/// Gains of `slow` over `fast` at two sizes: 1.2 and 3, while the times of both fall.
fn gains() -> Vec<Value<'static>> {
    let at = |accel, n, ms| value(accel, n, "ms-per-spp/v1", 0.95 * ms, ms, 1.05 * ms);
    vec![
        at("slow", 8, 12.0),
        at("fast", 8, 10.0),
        at("slow", 32, 3.0),
        at("fast", 32, 1.0),
    ]
}

const RISES: &str = "figure = \"ms-per-spp/v1\"\ncompare = \"order\"\nof = { accel = \"slow\" }\nover = { accel = \"fast\" }\norder = [{ spp = \"8\" }, { spp = \"32\" }]\n";

#[test]
fn an_order_of_gains_is_one_of_ratios_and_not_of_the_values_above() {
    let verdict = |body: &str, values: &[Value]| judge(&expect(body), values, &gpu()).remove(0);
    let row = verdict(RISES, &gains());
    assert_eq!(row.verdict, ClaimVerdict::Supported, "{row:?}");
    let ours = row.ours.expect("a step");
    assert!((ours.value - 2.5).abs() < 1e-12, "{row:?}");
    // Four parts of 5 % each.
    assert!(
        (ours.high / ours.value).ln() < 0.12 && (ours.high / ours.value).ln() > 0.09,
        "{ours:?}"
    );
    assert!(row.reason.starts_with("8 1.20 → 32 3.00"), "{row:?}");
    // The values themselves fall.
    let values_alone = RISES.replace("over = { accel = \"fast\" }\n", "");
    assert_eq!(
        verdict(&values_alone, &gains()).verdict,
        ClaimVerdict::Contradicted
    );
    let falls = RISES.replace(
        "[{ spp = \"8\" }, { spp = \"32\" }]",
        "[{ spp = \"32\" }, { spp = \"8\" }]",
    );
    assert_eq!(
        verdict(&falls, &gains()).verdict,
        ClaimVerdict::Contradicted
    );
    // A place may also name the other side.
    let of_places = RISES.replace(
        "over = { accel = \"fast\" }\n",
        "at = [{ over = { accel = \"fast\" } }]\n",
    );
    assert_eq!(
        verdict(&of_places, &gains()).verdict,
        ClaimVerdict::Supported
    );
    // Parts that differ by less than their noise.
    let mut close = gains();
    close[2] = value("slow", 32, "ms-per-spp/v1", 1.1, 1.22, 1.3);
    assert_eq!(verdict(RISES, &close).verdict, ClaimVerdict::Undecided);
    // The other side is missing, or not a number.
    assert_eq!(verdict(RISES, &gains()[..3]).verdict, ClaimVerdict::Faulty);
    let mut word = gains();
    word[3].estimate = Estimate::Word("never");
    let row = verdict(RISES, &word);
    assert_eq!(
        (row.verdict, row.reason.as_str()),
        (ClaimVerdict::NotTestable, "never")
    );
}

#[test]
fn each_place_of_a_bound_has_its_own_samples_and_its_own_counts() {
    let body = "figure = \"ms-per-spp/v1\"\ncompare = \"bound\"\nof = { accel = \"!near\" }\nmost = 9.0\nexplain = [\"nodes-per-ray/v1\"]\n";
    let rows = judge(&expect(body), &values(), &gpu());
    let found: Vec<_> = rows
        .iter()
        .map(|row| (row.x, row.counted.clone()))
        .collect();
    let nodes = |n: f64| vec![("nodes/ray".to_owned(), n)];
    assert_eq!(found, [(Some(8.0), nodes(10.0)), (Some(8.0), nodes(30.0))]);
}

#[test]
fn what_was_measured_once_is_undecided_where_it_is_close() {
    let once = [("a", 100.0), ("b", 130.0), ("c", 900.0)]
        .map(|(accel, ms)| value(accel, 1, "build-ms/v1", ms, ms, ms));
    let of = |accel: &str| {
        let body = format!(
            "figure = \"build-ms/v1\"\ncompare = \"ratio\"\nof = {{ accel = \"{accel}\" }}\nover = {{ accel = \"a\" }}\nleast = 1.0\n"
        );
        judge(&expect(&body), &once, &gpu()).remove(0).verdict
    };
    assert_eq!(
        (of("b"), of("c")),
        (ClaimVerdict::Undecided, ClaimVerdict::Supported)
    );
}

#[test]
fn curves_of_two_structures_have_two_slopes() {
    let mut both = values();
    both.extend([8, 32, 128].map(|n| {
        let y = 4.0 / f64::from(n);
        value("b", n, "rmse-unbiased/v1", y, y, y)
    }));
    let body = "figure = \"rmse-unbiased/v1\"\ncompare = \"slope\"\nalong = \"spp\"\nmost = 0.0\n";
    let rows = judge(&expect(body), &both, &gpu());
    let slopes: Vec<f64> = rows
        .iter()
        .filter_map(|row| row.ours.map(|i| (100.0 * i.value).round()))
        .collect();
    assert_eq!(slopes, [-50.0, -100.0]);
}

fn absent(cells: &[(&[(&str, &str)], &str)]) -> Context {
    let key = |axes: &[(&str, &str)]| {
        let axes = axes.iter();
        axes.fold(Key::default(), |key, (axis, label)| key.with(axis, label))
    };
    let absent = cells
        .iter()
        .map(|(axes, why)| (key(axes), (*why).to_owned()));
    Context {
        absent: absent.collect(),
        ..Context::default()
    }
}

fn discrepancies() -> Vec<Value<'static>> {
    let of = |sequence: &str, points: u32| {
        let key = Key::default()
            .with("sequence", sequence)
            .with("decorrelation", "none");
        let key = key
            .with("dimensions", "path dimensions 0 and 1")
            .with("points", points);
        Value::new(&key, &STAR_DISCREPANCY, Interval::exact(0.1))
    };
    vec![
        of("halton", 16),
        of("halton", 64),
        of("sobol", 16),
        of("sobol", 64),
    ]
}

#[test]
fn what_is_misspelt_is_a_fault_whatever_was_left_out() {
    let values: Vec<Value> = values().into_iter().chain(discrepancies()).collect();
    let found = |body: &str, context: &Context| {
        let row = judge(&expect(body), &values, context).remove(0);
        (row.verdict, row.reason)
    };
    let discrepancy = |of: &str| {
        format!(
            "figure = \"star-discrepancy/v1\"\ncompare = \"bound\"\nof = {{ {of} }}\nmost = 1.0\n"
        )
    };
    let left_out = absent(&[
        (&[("scene", "box"), ("accel", "grid")], "it was too big"),
        (
            &[("scene", "box"), ("accel", "grid"), ("sequence", "sobol")],
            "so was this",
        ),
    ]);
    // A skipped structure does not explain an unmeasured point set.
    for of in [
        "sequence = \"haltn*\"",
        "sequence = \"halton\", points = \"46\"",
        "sequence = \"sobol\", points = \"46\"",
        "sequence = \"sobol\", dimensions = \"*dimensions 0 and 11\"",
        "points = \"46\"",
    ] {
        let (verdict, reason) = found(&discrepancy(of), &left_out);
        assert_eq!(verdict, ClaimVerdict::Faulty, "{of}: {reason}");
        assert!(
            reason.contains("no star-discrepancy/v1 was found"),
            "{of}: {reason}"
        );
    }
    // Nor does one explain a sampler or sample count of another cell on the same scene.
    let rmse = |of: &str| {
        format!("figure = \"rmse-unbiased/v1\"\ncompare = \"bound\"\nof = {{ {of} }}\nmost = 1.0\n")
    };
    for of in [
        "scene = \"box\", spp = \"9\"",
        "accel = \"grid\", spp = \"9\"",
        "scene = \"bx\"",
    ] {
        assert_eq!(found(&rmse(of), &left_out).0, ClaimVerdict::Faulty, "{of}");
    }
    // The cell itself, and everything derived from it, cannot be tested.
    for of in [
        "accel = \"grid\"",
        "accel = \"gr*\", spp = \"8\"",
        "scene = \"box\", accel = \"grid\"",
    ] {
        let said = found(&rmse(of), &left_out);
        assert_eq!(
            said,
            (ClaimVerdict::NotTestable, "it was too big".to_owned()),
            "{of}"
        );
    }
    // If a figure was measured nowhere, its axes are unknown, and one reason suffices.
    let body = rmse("accel = \"grid\", rays = \"primary\"").replace("rmse-unbiased", "nowhere");
    assert_eq!(found(&body, &left_out).0, ClaimVerdict::NotTestable);
}

#[test]
fn what_a_comparison_would_pass_over_is_refused_with_what_to_do() {
    let registries = Registries::default();
    let (experiment, _) = SOURCES[0].text.split_once("[thesis]").expect("a thesis");
    let refusal = |body: &str| {
        let head =
            "[thesis]\ntitle = \"t\"\nsource = \"s\"\n[[expect]]\nid = \"x\"\nsays = \"y\"\n";
        let text: &'static str = format!("{experiment}{head}{body}").leak();
        let source = Source { name: "made", text };
        let found = prepare(&source, &Settings::default(), &registries.catalogue());
        found.err().map(|error| error.to_string())
    };
    let order = "figure = \"ms-per-spp/v1\"\ncompare = \"order\"\norder = [{ accel = \"a\" }, { accel = \"b\" }]\n";
    let bound = "figure = \"ms-per-spp/v1\"\ncompare = \"bound\"\nmost = 1.0\n";
    let refused = [
        (format!("{order}least = 1.2\n"), "least"),
        (format!("{order}most = 1.2\n"), "most"),
        (
            format!("{order}at = [{{ row = \"r\", least = 1.2 }}]\n"),
            "least",
        ),
        (
            format!("{order}within = 1.2\nat = [{{ thesis = 1.0 }}]\n"),
            "within",
        ),
        (
            format!("{order}off_by = 1.2\nat = [{{ thesis = 1.0 }}]\n"),
            "off_by",
        ),
        (bound.replace("bound", "shown"), "most"),
        (format!("{bound}over = {{ accel = \"a\" }}\n"), "over"),
        (
            format!("{bound}at = [{{ over = {{ accel = \"a\" }} }}]\n"),
            "over",
        ),
        (format!("{bound}order = [{{ accel = \"a\" }}]\n"), "order"),
        (format!("{bound}along = \"spp\"\n"), "along"),
    ];
    for (body, key) in refused {
        let error = refusal(&body).expect(&body);
        let says = |part: &str| assert!(error.contains(part), "{body}{error}");
        says("made.toml");
        says("id = \"x\"");
        says(&format!("`{key}`"));
        says("take it out");
    }
    for sound in [order, bound] {
        assert_eq!(refusal(sound), None);
    }
}

#[test]
fn an_interval_that_reaches_0_leaves_open_what_it_bears_on_and_no_more() {
    let slope = "figure = \"rmse-unbiased/v1\"\ncompare = \"slope\"\nalong = \"spp\"\n";
    let at = |low: [f64; 3], bound: &str| {
        let points = [(8, 0.8), (32, 0.4), (128, 0.2)].iter().zip(low);
        let points =
            points.map(|((n, y), low)| value("a", *n, "rmse-unbiased/v1", low * y, *y, 1.01 * y));
        let rows = judge(
            &expect(&format!("{slope}{bound}")),
            &points.collect::<Vec<_>>(),
            &gpu(),
        );
        rows[0].verdict
    };
    // The middle of three points has no weight in the slope, for any interval.
    assert_eq!(
        at([0.99, 0.0, 0.99], "least = -0.6\nmost = -0.4\n"),
        ClaimVerdict::Supported
    );
    assert_eq!(
        at([0.99, 0.0, 0.99], "least = 0.5\n"),
        ClaimVerdict::Contradicted
    );
    // The last is unbounded below: the fall may be steeper but not flatter.
    assert_eq!(
        at([0.99, 0.99, 0.0], "most = -0.4\n"),
        ClaimVerdict::Supported
    );
    assert_eq!(
        at([0.99, 0.99, 0.0], "least = -0.6\n"),
        ClaimVerdict::Undecided
    );
    // A count of zero is a number and has a ratio; zero over zero has none.
    let ratio = |a: f64, b: f64, bound: &str| {
        let of = |accel: &str, x: f64| value(accel, 8, "nodes-per-ray/v1", x, x, x);
        let body = RATIO.replace("ms-per-spp", "nodes-per-ray") + bound;
        judge(&expect(&body), &[of("slow", a), of("fast", b)], &gpu())[0].verdict
    };
    assert_eq!(ratio(0.0, 3.0, "most = 0.5\n"), ClaimVerdict::Supported);
    assert_eq!(ratio(0.0, 3.0, "least = 0.5\n"), ClaimVerdict::Contradicted);
    assert_eq!(ratio(0.0, 0.0, "least = 0.5\n"), ClaimVerdict::Undecided);
    // A non-positive figure is reported, not omitted.
    assert_eq!(ratio(-1.0, 3.0, "most = 0.5\n"), ClaimVerdict::Undecided);
}

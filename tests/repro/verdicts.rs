//! Verdicts, on values made by hand: planted faults are seen.

use raystone::config::Experiment;
use raystone::config::expect::{Expect, Thesis};
use raystone::measure::record::{Interval, Key};
use raystone::report::values::Value;
use raystone::repro::SOURCES;
use raystone::repro::claim::{Context, Row, judge};
use raystone::repro::judge::Verdict;
use raystone::run::Registries;

fn value(accel: &str, n: u32, figure: &str, low: f64, at: f64, high: f64) -> Value<'static> {
    let key = Key::default().with("scene", "box").with("accel", accel);
    let key = key.with("spp", n);
    Value::new(
        &key,
        figure,
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
    assert_eq!(at(format!("{RATIO}least = 1.5")), Verdict::Supported);
    assert_eq!(at(format!("{RATIO}most = 1.0")), Verdict::Contradicted);
    // 2.0 is above 1.9, its interval is not.
    assert_eq!(at(format!("{RATIO}least = 1.9")), Verdict::Undecided);
    let upside_down = RATIO
        .replace("slow", "_")
        .replace("fast", "slow")
        .replace('_', "fast");
    assert_eq!(
        at(format!("{upside_down}least = 1.5")),
        Verdict::Contradicted
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
    assert_eq!(row.verdict, Verdict::NotTestable);
    assert!(row.ours.is_some() && row.reason.contains("software"));
    let anywhere = found(&format!("{RATIO}least = 1.5"), &software());
    assert_eq!(anywhere.verdict, Verdict::Supported);
    let order = "figure = \"ms-per-spp/v1\"\ncompare = \"order\"\ndevice = \"gpu\"\norder = [{ accel = \"fast\" }, { accel = \"slow\" }]\n";
    assert_eq!(found(order, &software()).verdict, Verdict::NotTestable);
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
    assert_eq!(order(["fast", "slow"]), Verdict::Supported);
    assert_eq!(order(["slow", "fast"]), Verdict::Contradicted);
    assert_eq!(order(["fast", "near"]), Verdict::Undecided);
}

#[test]
fn a_slope_is_judged_against_the_thesis() {
    let body = |thesis: f64| {
        format!(
            "figure = \"rmse-unbiased/v1\"\ncompare = \"slope\"\nalong = \"spp\"\noff_by = 0.1\nat = [{{ thesis = {thesis:?} }}]\n"
        )
    };
    assert_eq!(found(&body(-0.5), &gpu()).verdict, Verdict::Supported);
    assert_eq!(found(&body(0.5), &gpu()).verdict, Verdict::Contradicted);
    assert_eq!(found(&body(-0.6), &gpu()).verdict, Verdict::Undecided);
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
        (Verdict::Supported, Some(2.0))
    );
    assert_eq!(
        found(&body("ms", "0.002"), &gpu()).verdict,
        Verdict::Contradicted
    );
    assert_eq!(
        found(&body("Mrays/s", "2.0"), &gpu()).verdict,
        Verdict::Faulty
    );
}

#[test]
fn an_expectation_that_selects_nothing_is_a_fault_unless_it_was_left_out_for_a_reason() {
    let body = RATIO.replace("\"fast\"", "\"fst\"") + "least = 1.0";
    let row = found(&body, &gpu());
    assert_eq!(row.verdict, Verdict::Faulty);
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
        (Verdict::NotTestable, "it was too big")
    );
    let two = "figure = \"rmse-unbiased/v1\"\ncompare = \"ratio\"\nof = { spp = \"8\" }\nover = { spp = \"*\" }\nleast = 1.0";
    let row = found(two, &gpu());
    assert_eq!(row.verdict, Verdict::Faulty);
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
            (Verdict::Supported, "There"),
            (Verdict::NotTestable, "Gone")
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
    assert_eq!(said(true), Verdict::NotTestable);
    assert_eq!(said(false), Verdict::Supported);
}

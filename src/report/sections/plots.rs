//! The plots that an experiment asks for, its `[[plot]]`.

use crate::data::RunData;
use crate::document::{Block, Section};
use crate::format;
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::repro::select::select;
use crate::values::{Estimate, Value};
use raystone_config::plot::{Abscissa, PlotRequest};
use raystone_core::text::did_you_mean;
use raystone_record::{Interval, Key, axis};

/// Returns the section; `None` where nothing is asked for.
pub(crate) fn section(data: &RunData, values: &[Value]) -> Option<Section> {
    let run = data.run?;
    let requests = PlotRequest::all(&run.experiment_text, &run.experiment).ok()?;
    let mut section = Section::new("plots", "Plots of this experiment");
    let mut drawn = Vec::new();
    for (number, request) in requests.iter().enumerate() {
        if let Some(misspelt) = misspelt(request) {
            section.blocks.push(Block::Paragraph(misspelt));
            continue;
        }
        let (plot, missing) = plot(request, values);
        let name = format!("plot-{}", number + 1);
        match plot.figure(name, request.caption.clone()) {
            Some(figure) => drawn.push(Some(figure)),
            None => section.blocks.push(Block::Paragraph(missing)),
        }
    }
    let figures = Block::figures(drawn);
    section.blocks.splice(0..0, figures);
    (!section.blocks.is_empty()).then_some(section)
}

/// An axis of a request that there is not.
fn misspelt(request: &PlotRequest) -> Option<String> {
    let of_x = match request.abscissa() {
        Abscissa::Axis(axis) | Abscissa::Parameter { axis, .. } => Some(axis),
        Abscissa::Figure(_) => None,
    };
    let named = request.curves.iter().chain(request.of.keys());
    let mut named = named.map(String::as_str).chain(of_x);
    let unknown = named.find(|axis| !axis::ALL.contains(axis))?;
    let near = did_you_mean(unknown, axis::ALL);
    let caption = &request.caption;
    Some(format!(
        "No plot “{caption}”: there is no axis `{unknown}`{near}"
    ))
}

/// Returns a plot, and why there is none if it has no points.
fn plot(request: &PlotRequest, values: &[Value]) -> (CurvePlot, String) {
    let PlotRequest { x, y, caption, .. } = request;
    let of_y = select(values, y, &request.of);
    let of_x = match request.abscissa() {
        // Parts are placed by figures of their whole.
        Abscissa::Figure(id) => {
            let mut of = request.of.clone();
            of.remove(axis::SUBJECT);
            select(values, id, &of)
        }
        _ => Vec::new(),
    };
    let mut curves: Vec<Curve> = Vec::new();
    for value in &of_y {
        let x = abscissa(request, &value.key, &of_x);
        let (Some(x), Some(y)) = (x, interval(value)) else {
            continue;
        };
        let label = label(request, &value.key);
        let at = curves.iter().position(|curve| curve.label == label);
        let at = at.unwrap_or_else(|| {
            let (look, points) = (curves.len(), Vec::new());
            curves.push(Curve {
                label,
                look,
                exact: false,
                points,
            });
            look
        });
        curves[at].points.push(CurvePoint::new(x, &y));
    }
    for curve in &mut curves {
        curve.points.sort_by(|a, b| a.x.total_cmp(&b.x));
    }
    let x_title = x_title(request, &of_x, &of_y);
    let y_title = of_y
        .first()
        .map_or_else(|| y.clone(), |value| value.figure.heading());
    let missing = format!(
        "No plot “{caption}”: {} of `{y}` found{}, {} of them with an abscissa from `{x}`; two are needed.",
        format::plural(of_y.len(), "value"),
        if request.of.is_empty() {
            ""
        } else {
            " where `of` says"
        },
        curves.iter().map(|curve| curve.points.len()).sum::<usize>(),
    );
    let plot = CurvePlot::new(x_title, ticks(request, &curves), y_title, curves);
    (plot, missing)
}

/// The name of the curve that a value belongs to.
fn label(request: &PlotRequest, key: &Key) -> String {
    let labels = request.curves.iter().map(|axis| key.label(axis));
    let labels: Vec<&str> = labels.filter(|label| !label.is_empty()).collect();
    labels.join(" × ")
}

/// The title of the x axis: a figure, a parameter, or what labels call their numbers.
fn x_title(request: &PlotRequest, of_x: &[&Value], of_y: &[&Value]) -> String {
    let of_label = |axis: &str| {
        let numbered = of_y
            .iter()
            .find_map(|value| value.key.label(axis).rsplit_once(' '));
        numbered.map_or(axis, |(what, _)| what).to_owned()
    };
    match request.abscissa() {
        Abscissa::Figure(id) => of_x
            .first()
            .map_or_else(|| id.to_owned(), |value| value.figure.heading()),
        Abscissa::Parameter { name, .. } => name.to_owned(),
        Abscissa::Axis(axis) => of_label(axis),
    }
}

/// Where a value stands; a figure of the whole cell also serves what the cell tells of its parts.
fn abscissa(request: &PlotRequest, key: &Key, of_x: &[&Value]) -> Option<f64> {
    match request.abscissa() {
        Abscissa::Axis(axis) | Abscissa::Parameter { axis, .. } => {
            request.number_in(key.label(axis))
        }
        Abscissa::Figure(_) => {
            let whole = key.clone().with(axis::SUBJECT, "");
            let of = |key: &Key| of_x.iter().find(|value| value.key == *key);
            let value = of(key).or_else(|| of(&whole))?;
            interval(value).map(|found| found.value)
        }
    }
}

fn interval(value: &Value) -> Option<Interval> {
    match value.estimate {
        Estimate::Known(found) => Some(found),
        Estimate::HeavyTailed(found) => Some(Interval::exact(found.value)),
        Estimate::Below(_) | Estimate::Word(_) => None,
    }
}

/// Figures and parameters span decades, unless one of them is 0; labels of samples and points are powers of two.
fn ticks(request: &PlotRequest, curves: &[Curve]) -> Ticks {
    let mut points = curves.iter().flat_map(|curve| &curve.points);
    match request.abscissa() {
        _ if points.any(|point| point.x <= 0.0) => Ticks::Whole,
        Abscissa::Axis(axis::SUBJECT | axis::RAYS) => Ticks::Whole,
        Abscissa::Axis(_) => Ticks::PowersOfTwo,
        Abscissa::Figure(_) | Abscissa::Parameter { .. } => Ticks::PowersOfTen,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_record::figure;

    fn request(rest: &str) -> PlotRequest {
        let head = "[[plot]]\ncaption = \"c\"\ny = \"nodes-per-ray/v1\"\n";
        let text = format!("{head}{rest}");
        let mut all = PlotRequest::all(&text, "x.toml").unwrap_or_else(|e| panic!("{e}"));
        all.remove(0)
    }

    /// Two structures with two spreads each: nodes, speed, and nodes at a level.
    fn values() -> Vec<Value<'static>> {
        let mut values = Vec::new();
        for (place, accel) in ["a", "b"].into_iter().enumerate() {
            for (spread, of) in [(0.0, "rays:bounce"), (20.0, "rays:bounce(spread=20)")] {
                let key = Key::default().with(axis::ACCEL, accel);
                let key = key.with(axis::INTEGRATOR, of);
                let nodes = 10.0 + place as f64 + spread;
                values.push(Value::new(&key, &figure::NODES_PER_RAY, nodes));
                values.push(Value::new(&key, &figure::MRAYS_PER_S, 100.0 / nodes));
                let level = key.with(axis::SUBJECT, "level 03");
                values.push(Value::new(&level, &figure::NODES_PER_RAY, 1.0));
            }
        }
        values
    }

    fn points(rest: &str) -> Vec<(String, Vec<[f64; 2]>)> {
        let (plot, _) = plot(&request(rest), &values());
        let of_curve = |curve: Curve| {
            let points = curve.points.iter().map(|point| [point.x, point.y]);
            (curve.label, points.collect())
        };
        plot.curves.into_iter().map(of_curve).collect()
    }

    #[test]
    fn abscissas_come_from_parameters_figures_and_numbers_of_labels() {
        let whole = "of = { subject = \"\" }\ncurves = [\"accel\"]\n";
        let spread = points(&format!("{whole}x = \"integrator.spread=1\""));
        let a = vec![[1.0, 10.0], [20.0, 30.0]];
        let b = vec![[1.0, 11.0], [20.0, 31.0]];
        assert_eq!(spread, [("a".to_owned(), a), ("b".to_owned(), b)]);
        let without = points(&format!("{whole}x = \"integrator.spread\""));
        assert_eq!(without[0].1, [[20.0, 30.0]]);
        let against = points("of = { subject = \"\", accel = \"a\" }\nx = \"mrays-per-s/v1\"");
        let fastest_last = vec![[100.0 / 30.0, 30.0], [10.0, 10.0]];
        assert_eq!(against, [(String::new(), fastest_last)]);
        let level = points("of = { subject = \"level*\", accel = \"b\" }\nx = \"subject\"");
        assert_eq!(level, [(String::new(), vec![[3.0, 1.0]; 2])]);
        // A part is placed by the figure of its whole.
        let parts = points("of = { subject = \"level*\", accel = \"a\" }\nx = \"mrays-per-s/v1\"");
        let placed = vec![[100.0 / 30.0, 1.0], [10.0, 1.0]];
        assert_eq!(parts, [(String::new(), placed)]);
    }

    #[test]
    fn an_axis_that_there_is_not_is_told_with_the_nearest_name() {
        for (rest, near) in [
            ("x = \"sp\"", "`spp`"),
            ("x = \"integrato.spread\"", "`integrator`"),
            ("x = \"spp\"\ncurves = [\"acel\"]", "`accel`"),
            ("x = \"spp\"\nof = { scen = \"*\" }", "`scene`"),
        ] {
            let text = misspelt(&request(rest)).unwrap_or_default();
            assert!(text.contains(near), "{text}");
        }
        assert_eq!(
            misspelt(&request("x = \"a/v1\"\ncurves = [\"accel\"]")),
            None
        );
    }

    #[test]
    fn a_plot_of_nothing_says_what_was_found() {
        let (_, missing) = plot(&request("x = \"spp\""), &values());
        assert!(
            missing.contains("8 values of `nodes-per-ray/v1`"),
            "{missing}"
        );
        assert!(
            missing.contains("0 of them with an abscissa from `spp`"),
            "{missing}"
        );
    }
}

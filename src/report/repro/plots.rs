//! Plots of a table: curves of the thesis beside ours, and bars of Mrays/s.

use super::claim::Row;
use super::table::Reproduced;
use crate::data::{grouped, without_repeats};
use crate::document::{Block, Illustration};
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::plot::rates::{Bar, RatePlot};
use raystone_config::expect::Expect;
use raystone_record::Interval;

/// Returns all plots of a table.
pub(super) fn of(table: &Reproduced) -> Option<Block> {
    let pairs = || table.thesis.expects.iter().zip(&table.claims);
    let is_drawn = |(expect, rows): &(&Expect, &Vec<Row>)| {
        let mut rows = rows.iter();
        !is_ratio(expect) && rows.any(|row| row.x.is_some() && row.ours.is_some())
    };
    let figures = pairs()
        .filter(is_drawn)
        .map(|(expect, _)| expect.figure.as_str());
    let figures = without_repeats(figures.collect());
    let curves = figures.into_iter().map(|figure| curves(table, figure));
    let bars = pairs().filter(|(expect, _)| expect.figure.contains("mrays") && !is_ratio(expect));
    let bars = bars.map(|(expect, rows)| bars_of(table, expect, rows));
    Block::figures(curves.chain(bars))
}

fn is_ratio(expect: &Expect) -> bool {
    use raystone_config::expect::Compare::{Bound, Shown};
    !matches!(expect.compare, Bound | Shown)
}

/// Plots every series of a figure over samples or points; those of the thesis are dashed.
fn curves(table: &Reproduced, figure: &str) -> Option<Illustration> {
    let stem = figure.split('/').next().unwrap_or(figure);
    curve_plot(table, figure).figure(
        format!("{}-{stem}", table.name),
        "Ours with 95 % intervals; dashed: the thesis's numbers, or exact values.",
    )
}

fn curve_plot(table: &Reproduced, figure: &str) -> CurvePlot {
    let known = table.figure(figure);
    let mut curves: Vec<Curve> = Vec::new();
    let pairs = table.thesis.expects.iter().zip(&table.claims);
    for (expect, rows) in pairs.filter(|(e, _)| e.figure == figure && !is_ratio(e)) {
        for (column, rows) in grouped(rows, |row| row.column.as_str()) {
            let name = Some(column).filter(|column| !column.is_empty());
            let name = name.unwrap_or(&expect.id);
            let look = curves.len() / 2;
            let ours = points(&rows, |row| row.ours);
            let thesis = points(&rows, |row| row.thesis.map(Interval::exact));
            for (label, exact, points) in [("ours", false, ours), ("thesis", true, thesis)] {
                curves.push(Curve {
                    label: format!("{name}, {label}"),
                    look,
                    exact,
                    points,
                });
            }
        }
    }
    let mut drawn: Vec<Curve> = Vec::new();
    for curve in curves {
        // Several claims may be about the same values.
        let is_new = |known: &Curve| known.exact != curve.exact || known.points != curve.points;
        let is_curve = curve.points.iter().any(|p| p.x != curve.points[0].x);
        if is_curve && drawn.iter().all(is_new) {
            drawn.push(curve);
        }
    }
    let y_title = known.map_or(figure.to_owned(), |f| f.heading());
    CurvePlot::new("N", Ticks::PowersOfTwo, y_title, drawn)
}

fn points(rows: &[&Row], of: impl Fn(&Row) -> Option<Interval>) -> Vec<CurvePoint> {
    let point = |row: &&Row| Some(CurvePoint::new(row.x?, &of(row)?));
    let mut points: Vec<CurvePoint> = rows.iter().filter_map(point).collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    points
}

fn bars_of(table: &Reproduced, expect: &Expect, rows: &[Row]) -> Option<Illustration> {
    let software = table.environment.as_ref().is_none_or(|e| e.software);
    let clock = if software {
        "software adapter"
    } else {
        "device"
    };
    let groups = bars(rows);
    let drawing = RatePlot { clock, groups }.draw()?;
    let name = format!("{}-{}", table.name, expect.id);
    Some(Illustration::new(
        name,
        format!(
            "{}: ours; the thesis's numbers are in the table above.",
            expect.says
        ),
        drawing,
    ))
}

/// Returns the measured bars, grouped by the text before the dot of a row.
fn bars(rows: &[Row]) -> Vec<(String, Vec<Bar>)> {
    let drawn = rows.iter().filter(|row| row.ours.is_some());
    let named = drawn.map(|row| (row, row.row.split_once(" · ").unwrap_or(("", &row.row))));
    let named: Vec<_> = named.collect();
    // A colour belongs to one label, even if a group lacks some bars.
    let labels = without_repeats(
        named
            .iter()
            .map(|(_, (_, label))| (*label).to_owned())
            .collect(),
    );
    let bar = |(row, (_, label)): (&Row, (&str, &str))| Bar {
        label: label.to_owned(),
        look: labels.iter().position(|known| known == label).unwrap_or(0),
        rate: row.ours,
        instead: String::new(),
    };
    let groups = grouped(named, |(_, (group, _))| *group).into_iter();
    let groups = groups.map(|(name, rows)| (name.to_owned(), rows.into_iter().map(bar).collect()));
    groups.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repro::judge::ClaimVerdict;
    use raystone_config::expect::Thesis;

    const TEXT: &str = "[thesis]\ntitle = \"t\"\nsource = \"s\"\n[[expect]]\nid = \"a\"\nsays = \"b\"\nfigure = \"rmse-unbiased/v1\"\ncompare = \"shown\"\n";

    fn parsed(text: &str) -> Thesis {
        Thesis::parse(text, "x").expect("sound").expect("a thesis")
    }

    fn row(x: f64, ours: f64, thesis: f64) -> Row {
        Row {
            row: x.to_string(),
            column: "Halton".to_owned(),
            thesis: Some(thesis),
            ours: Some(Interval::exact(ours)),
            x: Some(x),
            verdict: ClaimVerdict::Shown,
            reason: String::new(),
            counted: Vec::new(),
        }
    }

    fn table(text: &str, claims: Vec<Vec<Row>>) -> Reproduced {
        Reproduced {
            name: "made",
            thesis: parsed(text),
            environment: None,
            started: 0,
            quick: false,
            changes: Vec::new(),
            scenes: Vec::new(),
            figures: Vec::new(),
            claims,
        }
    }

    #[test]
    fn a_curve_of_ours_is_solid_and_one_of_the_thesis_dashed_each_over_its_samples() {
        let rows = vec![row(16.0, 0.5, 0.25), row(8.0, 1.0, 0.75)];
        let one = table(TEXT, vec![rows.clone()]);
        let plot = curve_plot(&one, "rmse-unbiased/v1");
        let found = plot.curves.iter().map(|c| {
            let points: Vec<_> = c.points.iter().map(|p| (p.x, p.y)).collect();
            (c.label.as_str(), c.exact, points)
        });
        let ours = ("Halton, ours", false, vec![(8.0, 1.0), (16.0, 0.5)]);
        let thesis = ("Halton, thesis", true, vec![(8.0, 0.75), (16.0, 0.25)]);
        assert_eq!(found.collect::<Vec<_>>(), [ours, thesis]);
        assert!(of(&one).is_some());
        // A ratio is not a curve.
        let ratio = TEXT.replace(
            "\"shown\"",
            "\"ratio\"\nleast = 1.0\nof = { spp = \"1\" }\nover = { spp = \"2\" }",
        );
        assert!(of(&table(&ratio, vec![rows])).is_none());
    }

    #[test]
    fn values_are_drawn_once_and_those_of_one_number_of_samples_are_no_curve() {
        let rows = vec![row(16.0, 0.5, 0.25), row(8.0, 1.0, 0.75)];
        let (head, claim) = TEXT.split_once("[[expect]]").expect("a claim");
        let again = claim.replace("\"a\"", "\"c\"");
        let twice = format!("{head}[[expect]]{claim}[[expect]]{again}");
        let mut both = table(&twice, vec![rows.clone(), rows]);
        assert_eq!(curve_plot(&both, "rmse-unbiased/v1").curves.len(), 2);
        both.claims[1][0].ours = Some(Interval::exact(0.125));
        assert_eq!(curve_plot(&both, "rmse-unbiased/v1").curves.len(), 3);
        let rows = vec![row(64.0, 0.5, 0.25), row(64.0, 1.0, 0.75)];
        assert!(of(&table(TEXT, vec![rows])).is_none());
    }

    #[test]
    fn bars_stand_in_groups_and_a_colour_means_one_label() {
        let mut rows = [
            row(16.0, 0.5, 0.25),
            row(8.0, 1.0, 0.75),
            row(1.0, 3.0, 4.0),
        ];
        for (row, name) in rows
            .iter_mut()
            .zip(["Box · BVH", "Box · Grid", "Hall · Grid"])
        {
            row.row = name.to_owned();
        }
        let groups = bars(&rows);
        assert_eq!(
            (groups.len(), &*groups[0].0, &*groups[1].0),
            (2, "Box", "Hall")
        );
        assert_eq!(groups[1].1[0].look, groups[0].1[1].look);
        let found = groups[0]
            .1
            .iter()
            .map(|bar| (&*bar.label, bar.rate.map(|i| i.value)));
        let ours = [("BVH", Some(0.5)), ("Grid", Some(1.0))];
        assert_eq!(found.collect::<Vec<_>>(), ours);
    }
}

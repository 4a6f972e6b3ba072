//! A history as tables, JSON and a page with plots.

use super::{Change, History, LEVEL, Run, Series};
use crate::data::grouped;
use crate::document::{Block, Document, Section, Table, TableCell};
use crate::format;
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use raystone_record::figure::Spread;
use raystone_record::{Interval, Key};
use serde_json::{Value as Json, json};

/// Greatest number of series in a plot: more cannot be distinguished.
const IN_PLOT: usize = 6;
/// Above this number of series only those that change are drawn.
const MOST_DRAWN: usize = 200;

impl History<'_> {
    /// Returns the table of runs by number.
    pub fn runs_table(&self) -> Table {
        let heads = ["run", ":commit", ":started", ":device", ":folder"];
        let row = |(number, run): (usize, &Run)| {
            [
                number.to_string().into(),
                short(&run.commit).into(),
                format::utc(run.started_unix_s).into(),
                run.device.as_str().into(),
                run.folder.display().to_string().into(),
            ]
        };
        Table::of("Runs", &heads, self.runs.iter().enumerate().map(row))
    }

    /// Returns the table of level changes, a row each.
    pub fn changes_table(&self) -> Table {
        let heads = [
            "figure", ":of", ":commit", "run", "before", "after", "ratio", "p",
        ];
        let row = |(series, change): (&Series, &Change)| {
            let text = |value| TableCell::from(format::figure(&series.figure, value));
            let run = self.runs.get(change.run);
            let p = change.p.map_or_else(|| "exact".to_owned(), format::number);
            [
                series.figure.heading().into(),
                self.name(series).into(),
                run.map_or("", |run| short(&run.commit)).into(),
                change.run.to_string().into(),
                text(change.before),
                text(change.after),
                format::number(change.after / change.before).into(),
                p.into(),
            ]
        };
        let series = self.series.iter();
        let changes = series.flat_map(|s| s.changes.iter().map(move |change| (s, change)));
        Table::of("Changes", &heads, changes.map(row))
    }

    /// Names the key of a series, and its work where another has the same key.
    fn name(&self, series: &Series) -> String {
        let is_like = |other: &&Series| {
            (&other.figure.id, &other.key) == (&series.figure.id, &series.key)
                && other.work != series.work
        };
        match self.series.iter().find(is_like) {
            Some(_) => format!("{} ({})", series.key, short_work(&series.work)),
            None => series.key.to_string(),
        }
    }

    /// Summarises the tested and untested series and the expected false alarms.
    pub fn summary(&self) -> String {
        let count = |what: &dyn Fn(&&Series) -> bool| self.series.iter().filter(what).count();
        let changed = count(&|s| !s.changes.is_empty());
        let tested = count(&|s| s.tested && s.figure.spread != Spread::Exact);
        let short = count(&|s| !s.tested);
        let mut text = format!(
            "{} of {} changed. Exact figures change where they differ; of {tested} with a spread, levels are parted by \
             E-divisive (Matteson and James 2014) with a permutation test at {LEVEL}: about {} would be said to change by \
             chance.",
            changed,
            format::plural(self.series.len(), "series").replace("seriess", "series"),
            format::number(self.false_alarms()),
        );
        if short > 0 {
            text += &format!(
                " {short} have too few runs to tell: exact ones need 2, others {}.",
                super::change::LEAST_RUNS
            );
        }
        if !self.draws_all() {
            text += " Only what changes is drawn: --figure and --only choose fewer series.";
        }
        if self.left_out > 0 {
            text += &format!(
                " {} values are no numbers, or have no interval to be trusted, and were left out.",
                self.left_out
            );
        }
        text
    }

    fn draws_all(&self) -> bool {
        self.series.len() <= MOST_DRAWN
    }

    /// Returns the page: runs, changes, and plots of each figure over the runs.
    pub fn document(&self) -> Document {
        let mut runs = Section::new("runs", "Runs");
        runs.blocks.extend(self.runs_table().into_block());
        let mut changes = Section::new("changes", "Changes");
        changes.blocks.push(Block::Paragraph(self.summary()));
        changes.blocks.extend(self.changes_table().into_block());
        let mut document = Document {
            title: "Raystone: figures over runs".into(),
            subtitle: format::plural(self.runs.len(), "run"),
            sections: vec![changes, runs],
            ..Document::default()
        };
        document.sections.extend(self.figure_sections());
        document
    }

    fn figure_sections(&self) -> Vec<Section> {
        let is_drawn = |s: &&Series| !s.changes.is_empty() || self.draws_all();
        let figures = grouped(&self.series, |s| s.figure.id.to_string());
        let section = |(id, of_figure): (String, Vec<&Series>)| {
            let heading = of_figure[0].figure.heading();
            let of_figure: Vec<&Series> = of_figure.into_iter().filter(is_drawn).collect();
            let name = id.replace(|c: char| !c.is_ascii_alphanumeric(), "-");
            let mut section = Section::new(name.clone(), heading);
            let plots = of_figure.chunks(IN_PLOT).enumerate();
            let plots = plots.map(|(i, some)| {
                let shared = shared(some).to_string();
                let caption = "Value by run, with intervals; dashed: levels between changes";
                plot(some).figure(format!("{name}-{i}"), format!("{caption}. {shared}"))
            });
            section.blocks.extend(Block::figures(plots));
            section
        };
        let sections = figures.into_iter().map(section);
        sections
            .filter(|section| !section.blocks.is_empty())
            .collect()
    }

    /// Returns runs and series as JSON.
    pub fn json(&self) -> Json {
        let series = self.series.iter().map(|series| {
            let points = series.points.iter().map(
                |(run, i)| json!({ "run": run, "value": i.value, "low": i.low, "high": i.high }),
            );
            json!({
                "figure": series.figure.id,
                "unit": series.figure.unit,
                "better": series.figure.better,
                "key": series.key,
                "device": series.device,
                "work": series.work,
                "tested": series.tested,
                "points": points.collect::<Vec<Json>>(),
                "changes": series.changes,
            })
        });
        json!({
            "runs": self.runs,
            "series": series.collect::<Vec<Json>>(),
            "level": LEVEL,
            "left_out": self.left_out,
        })
    }
}

fn plot(series: &[&Series]) -> CurvePlot {
    let several = series.iter().any(|s| s.device != series[0].device);
    let works = series.iter().any(|s| s.work != series[0].work);
    let shared = shared(series);
    let mut curves = Vec::new();
    for (look, series) in series.iter().enumerate() {
        let own = series
            .key
            .labels()
            .filter(|(axis, _)| shared.get(axis).is_none());
        let mut own: Vec<&str> = own.map(|(_, label)| label).collect();
        own.extend(several.then_some(series.device.as_str()));
        let work = works.then(|| short_work(&series.work));
        own.extend(work.as_deref());
        let label = if own.is_empty() {
            series.key.to_string()
        } else {
            own.join(", ")
        };
        let points = series.points.iter();
        let points = points.map(|(run, value)| CurvePoint::new(*run as f64, value));
        if !series.changes.is_empty() {
            curves.push(Curve {
                label: format!("levels of {label}"),
                look,
                exact: true,
                points: levels(series),
            });
        }
        curves.push(Curve {
            label,
            look,
            exact: false,
            points: points.collect(),
        });
    }
    CurvePlot::new(
        "run, by time",
        Ticks::Whole,
        series[0].figure.heading(),
        curves,
    )
}

/// Returns the labels that the keys of all series share.
fn shared(series: &[&Series]) -> Key {
    let first = &series[0].key;
    let same = |axis: &&str| series.iter().all(|s| s.key.agrees(first, &[*axis]));
    let axes: Vec<&str> = first.labels().map(|(axis, _)| axis).filter(same).collect();
    first.only(&axes)
}

/// Returns steps from level to level, each half a run before the first run of a new level.
fn levels(series: &Series) -> Vec<CurvePoint> {
    let point = |x: f64, y: f64| CurvePoint::new(x, &Interval::exact(y));
    let ends = [series.points.first(), series.points.last()];
    let (Some((first, _)), Some((last, _))) = (ends[0], ends[1]) else {
        return Vec::new();
    };
    let mut points = Vec::new();
    let mut from = *first as f64;
    let mut level = f64::NAN;
    for change in &series.changes {
        let at = change.run as f64 - 0.5;
        points.extend([point(from, change.before), point(at, change.before)]);
        (from, level) = (at, change.after);
    }
    points.extend([point(from, level), point(*last as f64, level)]);
    points
}

/// Returns the first characters of a commit, with its mark of local changes.
fn short(commit: &str) -> &str {
    match commit.char_indices().nth(12) {
        Some((end, _)) if !commit.ends_with('+') => &commit[..end],
        _ => commit,
    }
}

/// Returns the work of a series with the first characters of the scene's hash.
fn short_work(work: &str) -> String {
    match work
        .strip_prefix("scene ")
        .and_then(|of| of.split_once(';'))
    {
        Some((hash, amount)) => format!("scene {};{amount}", short(hash)),
        None => work.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_shown_with_the_first_characters_of_a_hash() {
        let hash = "991a7b2f7a6839d8d8bc0047fbb366e7d835598dc0e502bf9d567ba06024f83d";
        let shown = short_work(&format!("scene {hash}; 4096 rays"));
        assert_eq!(shown, "scene 991a7b2f7a68; 4096 rays");
        assert_eq!(short_work("4096 rays"), "4096 rays");
    }
}

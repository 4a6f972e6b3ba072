//! Tables and plots by declaration: their figures, and the parts of keys that make rows, columns and curves.

use super::data::{RunData, SAMPLER_ROW, STRUCTURE_AXES};
use super::document::{Illustration, Table, TableCell};
use super::names::Names;
use super::pivot::Rows;
use super::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use super::values::{Estimate, Value};
use raystone_record::figure::Figure;
use raystone_record::{Interval, Key, axis};
use std::collections::HashSet;

/// A column before the figures: a part of the key, which distinguishes rows.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Head {
    /// A structure among all of its scene.
    Structure,
    /// A sampler among those of its view.
    Sampler,
    /// The label on this axis under this head (in the notation of [`Table::new`]); no column where no key has one.
    Axis(&'static str, &'static str),
    /// The same, and no column either where all have the same label.
    Varied(&'static str, &'static str),
}

use Head::{Axis, Sampler, Structure, Varied};

impl Head {
    fn title(self) -> &'static str {
        match self {
            Structure => ":structure",
            Sampler => ":sampler",
            Axis(title, _) | Varied(title, _) => title,
        }
    }

    fn axes(self) -> Vec<&'static str> {
        match self {
            Structure => STRUCTURE_AXES.to_vec(),
            Sampler => SAMPLER_ROW.to_vec(),
            Axis(_, axis) | Varied(_, axis) => vec![axis],
        }
    }

    fn text(self, names: &Names, key: &Key) -> String {
        match self {
            Structure => names.structure(key),
            Sampler => names.sampler(key),
            Axis(_, axis) | Varied(_, axis) => key.label(axis).to_owned(),
        }
    }

    fn is_used(self, keys: &[&Key]) -> bool {
        match self {
            Structure | Sampler => true,
            Axis(_, axis) => keys.iter().any(|key| !key.label(axis).is_empty()),
            Varied(_, axis) => keys.iter().any(|key| !key.agrees(keys[0], &[axis])),
        }
    }

    /// Returns the category of a curve, or of the place that it has.
    fn look(self, data: &RunData, name: &str, place: usize) -> usize {
        match self {
            Structure | Axis(_, axis::ACCEL) => data.structure_look(name),
            Sampler => data.sampler_look(name),
            _ => place,
        }
    }
}

/// A table of figures.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TableSpec<'a> {
    /// Its caption; each `{}` is replaced by a word.
    pub caption: &'a str,
    /// The columns that distinguish rows.
    pub rows: &'a [Head],
    /// Figures in the order of their columns.
    pub figures: &'a [&'a Figure],
    /// The column of a key; see [`BY_FIGURE`] and [`BY_RAYS`].
    pub across: fn(&Key) -> String,
}

/// One column for each figure.
pub(crate) const BY_FIGURE: fn(&Key) -> String = |_| String::new();
/// A column for each class of rays.
pub(crate) const BY_RAYS: fn(&Key) -> String = |key| key.label(axis::RAYS).to_owned();
/// A column for each subject.
pub(crate) const BY_SUBJECT: fn(&Key) -> String = |key| key.label(axis::SUBJECT).to_owned();

impl TableSpec<'_> {
    /// Returns a row for each competitor that has one of the figures.
    pub(crate) fn table(&self, names: &Names, values: &[Value], words: &[&str]) -> Table {
        let is_shown = |v: &&Value| self.figures.iter().any(|f| f.id == v.figure.id);
        let keys = values.iter().filter(is_shown).map(|v| &v.key);
        let mut known = HashSet::new();
        let by = self.by();
        let keys: Vec<&Key> = keys
            .filter(|key| known.insert(key.labels_on(&by)))
            .collect();
        // Rows with the same first column are adjacent.
        let first = self.rows[0].axes();
        let mut order: Vec<&Key> = keys.clone();
        order.sort_by_key(|key| keys.iter().position(|other| other.agrees(key, &first)));
        let rows = order.into_iter().map(|key| (key.clone(), Vec::new()));
        self.beside(names, values, words, &[], rows)
    }

    /// Returns a table of these rows, each with cells under further heads before the figures.
    pub(crate) fn beside(
        &self,
        names: &Names,
        values: &[Value],
        words: &[&str],
        further: &[&str],
        rows: impl IntoIterator<Item = (Key, Vec<TableCell>)>,
    ) -> Table {
        let rows: Vec<(Key, Vec<TableCell>)> = rows.into_iter().collect();
        let keys: Vec<&Key> = rows.iter().map(|(key, _)| key).collect();
        let heads = self.rows.iter().filter(|head| head.is_used(&keys));
        let heads: Vec<Head> = heads.copied().collect();
        let titles = heads.iter().map(|head| head.title());
        let titles: Vec<&str> = titles.chain(further.iter().copied()).collect();
        let row = |(key, further): (Key, Vec<TableCell>)| {
            let cells = heads.iter().map(|head| head.text(names, &key).into());
            let cells = cells.chain(further).collect();
            (key, cells)
        };
        let by = self.by();
        let rows = Rows::new(&by, &titles, rows.into_iter().map(row));
        rows.table(
            values,
            filled(self.caption, words),
            self.figures,
            &self.across,
        )
    }

    fn by(&self) -> Vec<&'static str> {
        self.rows.iter().flat_map(|head| head.axes()).collect()
    }
}

/// Replaces each `{}` of a text by a word.
pub(crate) fn filled(text: &str, words: &[&str]) -> String {
    let mut parts = text.split("{}");
    let first = parts.next().unwrap_or_default().to_owned();
    let words = words.iter().chain(std::iter::repeat(&""));
    parts
        .zip(words)
        .fold(first, |all, (part, word)| all + word + part)
}

/// Curves of figures against a number of their keys.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlotSpec<'a> {
    /// The end of the names of its files.
    pub name: &'a str,
    /// Its caption; each `{}` is replaced by a word.
    pub caption: &'a str,
    /// Title of the x axis.
    pub x_title: &'a str,
    /// Its ticks.
    pub x_ticks: Ticks,
    /// The number of a key; keys without it have no point.
    pub x: fn(&Key) -> Option<f64>,
    /// Title of the y axis.
    pub y_title: &'a str,
    /// Figures, each with the suffix of its curves' names; those after the first are dashed.
    pub figures: &'a [(&'a Figure, &'a str)],
    /// The part of the key that has a curve of its own.
    pub curves: Head,
}

impl PlotSpec<'_> {
    /// Returns the plot in a document, if there is anything to draw.
    pub(crate) fn figure(
        &self,
        data: &RunData,
        values: &[Value],
        stem: &str,
        words: &[&str],
    ) -> Option<Illustration> {
        let plot = self.plot(data, values);
        plot.figure(format!("{stem}{}", self.name), filled(self.caption, words))
    }

    /// Returns a curve for each competitor and figure, in the order of the values.
    pub(crate) fn plot(&self, data: &RunData, values: &[Value]) -> CurvePlot {
        let mut curves: Vec<Curve> = Vec::new();
        for value in values {
            let place = self
                .figures
                .iter()
                .position(|(f, _)| f.id == value.figure.id);
            let (Some(place), Some(x)) = (place, (self.x)(&value.key)) else {
                continue;
            };
            let y = match value.estimate {
                Estimate::Known(y) => y,
                Estimate::HeavyTailed(y) => Interval::exact(y.value),
                Estimate::Below(_) | Estimate::Word(_) => continue,
            };
            let name = self.curves.text(&data.names, &value.key);
            let label = format!("{name}{}", self.figures[place].1);
            let at = curves.iter().position(|curve| curve.label == label);
            let at = at.unwrap_or_else(|| {
                curves.push(Curve {
                    look: self.curves.look(data, &name, curves.len()),
                    label,
                    exact: place > 0,
                    points: Vec::new(),
                });
                curves.len() - 1
            });
            curves[at].points.push(CurvePoint::new(x, &y));
        }
        for curve in &mut curves {
            curve.points.sort_by(|a, b| a.x.total_cmp(&b.x));
        }
        CurvePlot::new(self.x_title, self.x_ticks, self.y_title, curves)
    }
}

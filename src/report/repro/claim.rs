//! Compares an expectation with the values of a run: a row for each of its places.

use super::judge::{Bounds, ClaimVerdict, factor, spread};
use super::select::{fits, merged, partner, select, words};
use crate::data::grouped;
use crate::format;
use crate::samplers::HEAVY_TAILED;
use crate::values::{Estimate, Value};
use raystone_config::Pattern;
use raystone_config::expect::{At, Compare, Expect, Pick, Speaks};
use raystone_record::{Interval, Key};
use raystone_stats::comparison::LogFigure;

/// Facts about a run beside its values.
#[derive(Debug, Clone, Default)]
pub struct Context {
    /// True if it was on a software adapter.
    pub software: bool,
    /// True if it is a short run.
    pub quick: bool,
    /// Original scene → pattern of ours, or why there is none.
    pub scenes: Vec<(String, Result<String, String>)>,
    /// Cells left out or failed, with the reason.
    pub absent: Vec<(Key, String)>,
}

/// One place of a claim.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The place, in the thesis's words or by key.
    pub row: String,
    /// Column of the original's table.
    pub column: String,
    /// The thesis's number.
    pub thesis: Option<f64>,
    /// Our value.
    pub ours: Option<Interval>,
    /// The number on the axis of a curve, where the place has one (samples, points).
    pub x: Option<f64>,
    /// The verdict on the claim.
    pub verdict: ClaimVerdict,
    /// The reason, or the values that would agree.
    pub reason: String,
    /// Counted figures: title and value.
    pub counted: Vec<(String, f64)>,
}

/// Compares an expectation with the values in each of its places.
pub fn judge(expect: &Expect, values: &[Value], context: &Context) -> Vec<Row> {
    let everywhere = [At::default()];
    let places = if expect.at.is_empty() {
        &everywhere[..]
    } else {
        &expect.at[..]
    };
    let at = |at: &At| Place::new(expect, at, context).rows(values);
    places.iter().flat_map(at).collect()
}

/// Describes a key of an expectation that its comparison does not use, and what to do about it: a bound of an order would be
/// ignored, and the claim checked as if it were not there.
pub(crate) fn unused(expect: &Expect) -> Option<String> {
    use Compare::{Order, Ratio, Shown, Slope};
    let compare = expect.compare;
    let at = |has: fn(&At) -> bool| expect.at.iter().any(has);
    let bounds = [
        (
            "least",
            expect.least.is_some() || at(|at| at.least.is_some()),
        ),
        ("most", expect.most.is_some() || at(|at| at.most.is_some())),
        ("within", expect.within.is_some()),
        ("off_by", expect.off_by.is_some()),
    ];
    let bounds = bounds.map(|(key, is_said)| (key, is_said && matches!(compare, Order | Shown)));
    let over = !expect.over.is_empty() || at(|at| !at.over.is_empty());
    let others = [
        ("over", over && !matches!(compare, Order | Ratio)),
        ("order", !expect.order.is_empty() && compare != Order),
        ("along", expect.along.is_some() && compare != Slope),
    ];
    let (key, _) = bounds
        .into_iter()
        .chain(others)
        .find(|(_, is_unused)| *is_unused)?;
    let instead = match (key, compare) {
        ("over" | "order" | "along", _) => "or choose the `compare` that needs it (docs/repro.md)",
        (_, Order) => "or bound each step by an expectation of its own with compare = \"ratio\"",
        _ => "or judge the values with compare = \"bound\"",
    };
    Some(format!(
        "[[expect]] id = \"{}\": this comparison has no use for `{key}`: take it out, {instead}",
        expect.id
    ))
}

struct Place<'e> {
    expect: &'e Expect,
    at: &'e At,
    context: &'e Context,
    /// Pattern of the scene, or why there is none.
    scene: Option<Result<String, String>>,
}

impl<'e> Place<'e> {
    fn new(expect: &'e Expect, at: &'e At, context: &'e Context) -> Self {
        let find = |on: &String| {
            let found = context.scenes.iter().find(|(name, _)| name == on);
            found.map_or_else(|| Err(format!("no scene stands for {on}")), |f| f.1.clone())
        };
        let scene = at.on.as_ref().map(find);
        Self {
            expect,
            at,
            context,
            scene,
        }
    }

    /// Returns a pick of the expectation with this place's additions.
    fn pick(&self, base: &Pick, more: &Pick) -> Pick {
        let mut pick = merged(base, more);
        if let Some(Ok(pattern)) = &self.scene {
            pick.insert("scene".to_owned(), pattern.clone());
        }
        pick
    }

    fn rows(&self, values: &[Value]) -> Vec<Row> {
        if self.at.full_only && self.context.quick {
            let reason = "a short run leaves this size out".to_owned();
            return vec![self.row(None, ClaimVerdict::NotTestable, reason)];
        }
        if let Some(Err(reason)) = &self.scene {
            return vec![self.row(None, ClaimVerdict::NotTestable, reason.clone())];
        }
        let found = match self.expect.compare {
            Compare::Shown | Compare::Bound => self.single(values),
            Compare::Ratio => self.ratios(values, &self.expect.figure),
            Compare::Order => self.orders(values),
            Compare::Slope => self.slopes(values),
        };
        match found {
            Ok(rows) => rows,
            Err((pick, problem)) => vec![self.absent(&pick, problem, values)],
        }
    }

    /// Returns the row of an empty selection: a cell left out for a reason cannot be tested, else the expectation is
    /// at fault.
    fn absent(&self, pick: &Pick, problem: String, values: &[Value]) -> Row {
        let is_known = |(axis, pattern): (&String, &String)| {
            let keys = values.iter().map(|value| &value.key);
            let keys = keys.chain(self.context.absent.iter().map(|(key, _)| key));
            let mut labels = keys.filter(|key| key.get(axis).is_some()).peekable();
            let pattern = Pattern::new(pattern.as_str());
            let unseen = labels.peek().is_none() || pattern.fits_text("");
            unseen || labels.any(|key| pattern.fits_text(key.label(axis)))
        };
        let of_figure = values.iter().filter(|v| v.figure.id == self.expect.figure);
        let of_figure: Vec<&Key> = of_figure.map(|value| &value.key).collect();
        // A cell on an axis that the figure never has, as a structure beside point sets, is another's.
        let is_its = |key: &Key| {
            let axes = key.labels().map(|(axis, _)| axis);
            let has = |axis: &str| of_figure.iter().any(|known| known.get(axis).is_some());
            of_figure.is_empty() || axes.into_iter().all(has)
        };
        let explains = |(key, _): &&(Key, String)| {
            let mut shared = pick.clone();
            shared.retain(|axis, _| key.get(axis).is_some());
            !shared.is_empty() && fits(key, &shared) && is_its(key)
        };
        // A label that no cell has, measured or not, is misspelt.
        let is_sound = pick.iter().all(is_known);
        match self.context.absent.iter().find(explains) {
            Some((_, reason)) if is_sound => {
                self.row(None, ClaimVerdict::NotTestable, reason.clone())
            }
            _ => self.row(None, ClaimVerdict::Faulty, problem),
        }
    }

    fn row(&self, ours: Option<Interval>, verdict: ClaimVerdict, reason: String) -> Row {
        let column = if self.at.column.is_empty() {
            &self.expect.column
        } else {
            &self.at.column
        };
        let place = self.at.on.as_ref().filter(|_| self.at.row.is_empty());
        Row {
            row: place.unwrap_or(&self.at.row).clone(),
            column: column.clone(),
            thesis: self.at.thesis,
            ours,
            x: None,
            verdict,
            reason,
            counted: Vec::new(),
        }
    }

    /// Returns the values of a selection; the pick and the problem if there are none.
    fn chosen<'v, 'a>(
        &self,
        values: &'v [Value<'a>],
        figure: &str,
        pick: &Pick,
    ) -> Result<Vec<&'v Value<'a>>, (Pick, String)> {
        let chosen = select(values, figure, pick);
        if chosen.is_empty() {
            Err((
                pick.clone(),
                format!("no {figure} was found where {}", words(pick)),
            ))
        } else {
            Ok(chosen)
        }
    }

    /// Returns the range that agrees, in the unit of ours; `unit` is that of the compared number.
    fn bounds(&self, unit: &str) -> Result<Bounds, String> {
        let (expect, at) = (self.expect, self.at);
        let mut bounds = Bounds::new(at.least.or(expect.least), at.most.or(expect.most));
        if let Some(thesis) = self.thesis_in(unit)? {
            if let Some(factor) = expect.within {
                bounds = bounds.and(Bounds::new(Some(thesis / factor), Some(thesis * factor)));
            }
            if let Some(d) = expect.off_by {
                bounds = bounds.and(Bounds::new(Some(thesis - d), Some(thesis + d)));
            }
        }
        Ok(bounds)
    }

    /// Returns the thesis's value in the unit of ours.
    fn thesis_in(&self, unit: &str) -> Result<Option<f64>, String> {
        let Some(thesis) = self.at.thesis else {
            return Ok(None);
        };
        let from = if self.expect.unit.is_empty() {
            unit
        } else {
            self.expect.unit.as_str()
        };
        let problem = || format!("the thesis's {from} cannot be given in the figure's \"{unit}\"");
        Ok(Some(thesis * factor(from, unit).ok_or_else(problem)?))
    }

    /// Returns a row with its verdict, for a number in this unit.
    fn judged(&self, ours: Interval, unit: &str, key: &Key) -> Row {
        let speaks = self.expect.device == Speaks::Any || !self.context.software;
        let judged = match self.bounds(unit) {
            Err(problem) => (ClaimVerdict::Faulty, problem),
            Ok(_) if self.expect.compare == Compare::Shown => (ClaimVerdict::Shown, String::new()),
            Ok(_) if !speaks => (
                ClaimVerdict::NotTestable,
                "times of a software adapter say nothing of a GPU".to_owned(),
            ),
            Ok(bounds) => (bounds.judge(ours), format!("agrees: {}", bounds.words())),
        };
        let mut row = self.row(Some(ours), judged.0, judged.1);
        row.thesis = self.thesis_in(unit).ok().flatten().or(row.thesis);
        if row.row.is_empty() {
            row.row = key.to_string();
        }
        let number = |axis| key.label(axis).parse::<f64>().ok();
        row.x = ["spp", "points"].into_iter().find_map(number);
        row
    }

    /// Returns a row whose reading is no number.
    fn unread(&self, value: &Value) -> Option<Row> {
        let row = match value.estimate {
            Estimate::Known(_) => return None,
            Estimate::HeavyTailed(i) => {
                let reason = format!("its interval is not to be trusted: {HEAVY_TAILED}");
                self.row(Some(i), ClaimVerdict::Undecided, reason)
            }
            Estimate::Below(bound) => {
                let reason = format!("below {bound:.3e}, which the reference resolves");
                self.row(None, ClaimVerdict::Undecided, reason)
            }
            Estimate::Word(word) => self.row(None, ClaimVerdict::NotTestable, word.to_owned()),
        };
        Some(row)
    }

    fn single(&self, values: &[Value]) -> Result<Vec<Row>, (Pick, String)> {
        let pick = self.pick(&self.expect.of, &self.at.of);
        let chosen = self.chosen(values, &self.expect.figure, &pick)?;
        let row = |value: &&Value| match known(value) {
            None => self.unread(value),
            Some(ours) => {
                let mut row = self.judged(ours, &value.figure.unit, &value.key);
                row.counted = self.counted(values, |figure| {
                    let same = select(values, figure, &pick);
                    let same = same.into_iter().find(|v| agrees(&v.key, &value.key))?;
                    known(same).map(|i| i.value)
                });
                Some(row)
            }
        };
        Ok(chosen.iter().filter_map(row).collect())
    }

    fn counted(&self, values: &[Value], of: impl Fn(&str) -> Option<f64>) -> Vec<(String, f64)> {
        let title = |id: &str| {
            let value = values.iter().find(|value| value.figure.id == id);
            value.map_or_else(|| id.to_owned(), |value| value.figure.title.to_string())
        };
        let figure = |id: &String| Some((title(id), of(id)?));
        self.expect.explain.iter().filter_map(figure).collect()
    }

    /// Returns pairs of the two selections of a ratio, each pair equal on all other axes.
    fn pairs<'v, 'a>(
        &self,
        values: &'v [Value<'a>],
        figure: &str,
    ) -> Result<Vec<[&'v Value<'a>; 2]>, (Pick, String)> {
        let of = self.pick(&self.expect.of, &self.at.of);
        let over = self.pick(&self.expect.over, &self.at.over);
        let upper = self.chosen(values, figure, &of)?;
        let lower = self.chosen(values, figure, &over)?;
        let pair = |a: &'v Value<'a>| {
            let b = partner(a, &lower, &[&of, &over]).map_err(|problem| (over.clone(), problem))?;
            Ok([a, b])
        };
        upper.into_iter().map(pair).collect()
    }

    /// Returns the compared figure of a value: part by part if known (times round by round), else by its interval.
    fn figure(&self, value: &Value) -> Option<LogFigure> {
        let by_parts = value.by_parts();
        by_parts.or_else(|| LogFigure::of_interval(known(value)?, f64::INFINITY))
    }

    /// Returns a ratio with its interval. Nothing is known of a ratio of figures that are not positive.
    fn ratio(&self, a: &Value, b: &Value) -> Interval {
        over(self.figure(a), self.figure(b))
    }

    fn ratios(&self, values: &[Value], figure: &str) -> Result<Vec<Row>, (Pick, String)> {
        let row = |[a, b]: &[&Value; 2]| match (known(a), known(b)) {
            (Some(_), Some(_)) => {
                let mut row = self.judged(self.ratio(a, b), "", &a.key);
                row.counted = self.counted(values, |figure| {
                    let pairs = self.pairs(values, figure).ok()?;
                    let same = pairs.iter().find(|[c, _]| agrees(&c.key, &a.key))?;
                    Some(known(same[0])?.value / known(same[1])?.value)
                });
                Some(row)
            }
            (None, _) => self.unread(a),
            _ => self.unread(b),
        };
        Ok(self.pairs(values, figure)?.iter().filter_map(row).collect())
    }

    /// Returns the picks of an order, with their common part.
    fn steps(&self, shared: &Pick, more: &Pick) -> Vec<Pick> {
        let shared = merged(shared, more);
        let order = self.expect.order.iter();
        order.map(|pick| self.pick(&shared, pick)).collect()
    }

    /// Returns the least ratio of a selection to the one before it: at least 1 where they ascend. With `over` it is
    /// the gain of each over another one that should ascend.
    fn orders(&self, values: &[Value]) -> Result<Vec<Row>, (Pick, String)> {
        let picks = self.steps(&self.expect.of, &self.at.of);
        let lower = if self.expect.over.is_empty() && self.at.over.is_empty() {
            Vec::new()
        } else {
            self.steps(&self.expect.over, &self.at.over)
        };
        let all: Vec<&Pick> = picks.iter().chain(&lower).collect();
        let figure = &self.expect.figure;
        let chosen = |picks: &[Pick]| {
            let chosen = picks.iter().map(|pick| self.chosen(values, figure, pick));
            chosen.collect::<Result<Vec<_>, _>>()
        };
        let (upper, under) = (chosen(&picks)?, chosen(&lower)?);
        let alike = |to: &Value, others: &[_], pick: &Pick| {
            partner(to, others, &all).map_err(|problem| (pick.clone(), problem))
        };
        let mut rows = Vec::new();
        for first in &upper[0] {
            let mut chain = vec![Gain::of(first)];
            for (others, pick) in upper.iter().zip(&picks).skip(1) {
                chain.push(Gain::of(alike(first, others, pick)?));
            }
            for ((gain, others), pick) in chain.iter_mut().zip(&under).zip(&lower) {
                gain.over = Some(alike(first, others, pick)?);
            }
            rows.push(self.ordered(&chain, &picks));
        }
        Ok(rows)
    }

    /// Returns the compared figure of a part of an order.
    fn gained(&self, gain: &Gain) -> Option<LogFigure> {
        let value = self.figure(gain.value)?;
        let Some(over) = gain.over else {
            return Some(value);
        };
        Some(LogFigure::product(&[
            (&value, 1.0),
            (&self.figure(over)?, -1.0),
        ]))
    }

    /// Returns the number of a part of an order.
    fn number(&self, gain: &Gain) -> f64 {
        let value = known(gain.value).map_or(f64::NAN, |i| i.value);
        gain.over
            .map_or(value, |over| self.ratio(gain.value, over).value)
    }

    fn ordered(&self, chain: &[Gain], picks: &[Pick]) -> Row {
        let mut values = chain.iter().flat_map(|gain| [Some(gain.value), gain.over]);
        if let Some(row) = values.find_map(|value| self.unread(value?)) {
            return row;
        }
        let gained: Vec<Option<LogFigure>> = chain.iter().map(|gain| self.gained(gain)).collect();
        let steps = gained.windows(2);
        let steps: Vec<Interval> = steps
            .map(|pair| over(pair[1].clone(), pair[0].clone()))
            .collect();
        let ascends = Bounds::new(Some(1.0), None);
        let verdict = ClaimVerdict::of_all(steps.iter().map(|step| ascends.judge(*step)));
        let least = steps.into_iter().min_by(|a, b| a.value.total_cmp(&b.value));
        let Some(least) = least else {
            return self.row(None, ClaimVerdict::Faulty, "an order of one".to_owned());
        };
        let mut row = self.judged(least, "", &chain[0].value.key);
        if !matches!(
            row.verdict,
            ClaimVerdict::NotTestable | ClaimVerdict::Faulty
        ) {
            row.verdict = verdict;
        }
        let named = picks.iter().zip(chain).map(|(pick, gain)| {
            let own = |axis: &&String| !self.expect.of.contains_key(*axis) && *axis != "scene";
            let labels = pick.keys().filter(own);
            let labels: Vec<&str> = labels.map(|axis| gain.value.key.label(axis)).collect();
            format!("{} {}", labels.join(" "), format::number(self.number(gain)))
        });
        let named = named.collect::<Vec<_>>().join(" → ");
        row.reason = match row.verdict {
            ClaimVerdict::NotTestable | ClaimVerdict::Faulty => format!("{}; {named}", row.reason),
            _ => format!("{named} (least step shown)"),
        };
        row
    }

    fn slopes(&self, values: &[Value]) -> Result<Vec<Row>, (Pick, String)> {
        let pick = self.pick(&self.expect.of, &self.at.of);
        let chosen = self.chosen(values, &self.expect.figure, &pick)?;
        let along = self.expect.along.as_deref().unwrap_or_default();
        let without = |key: &Key| key.clone().with(along, "");
        let placed = chosen.into_iter().filter(|value| known(value).is_some());
        let placed = placed.filter_map(|v| Some((v.key.label(along).parse::<f64>().ok()?, v)));
        let groups = grouped(placed, |(_, value)| without(&value.key));
        if groups.is_empty() {
            return Err((pick, format!("no number on the axis {along}")));
        }
        let row = |(key, points): &(Key, Vec<(f64, &Value)>)| {
            let fault = |problem: &str| {
                let problem = format!("{problem} along {along} at {key}");
                self.row(None, ClaimVerdict::Faulty, problem)
            };
            let figures = points.iter();
            let figures = figures.map(|(x, value)| Some((*x, self.figure(value)?)));
            let Some(figures) = figures.collect::<Option<Vec<(f64, LogFigure)>>>() else {
                return fault("a figure that is not positive has no exponent: there is one");
            };
            match LogFigure::exponent(&figures) {
                Some(slope) => self.judged(slope.log_interval(), "", key),
                None => fault("one point only"),
            }
        };
        Ok(groups.iter().map(row).collect())
    }
}

/// A value, and its divisor where a quotient is compared.
#[derive(Clone, Copy)]
struct Gain<'v, 'a> {
    value: &'v Value<'a>,
    over: Option<&'v Value<'a>>,
}

impl<'v, 'a> Gain<'v, 'a> {
    fn of(value: &'v Value<'a>) -> Self {
        Self { value, over: None }
    }
}

/// Returns the number of a value, with the assumed spread if it was measured once.
fn known(value: &Value) -> Option<Interval> {
    match value.estimate {
        Estimate::Known(i) if i.value.is_finite() => Some(spread(&value.figure, i)),
        _ => None,
    }
}

/// Returns the ratio of two figures; any, where one of them is not positive.
fn over(a: Option<LogFigure>, b: Option<LogFigure>) -> Interval {
    let unknown = Interval {
        value: f64::NAN,
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };
    a.zip(b).map_or(unknown, |(a, b)| a.compared_with(&b).ratio)
}

/// Returns `true` if two keys agree on all axes that both have.
fn agrees(a: &Key, b: &Key) -> bool {
    let both = a.labels().filter(|(axis, _)| b.get(axis).is_some());
    both.into_iter().all(|(axis, label)| b.label(axis) == label)
}

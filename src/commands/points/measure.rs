//! Measures of the uniformity of points in the unit cube, as JSON.

use crate::commands::arguments::{read_text, unknown};
use crate::commands::output::print_json;
use anyhow::{Result, anyhow, bail};
use clap::Args;
use raystone::discrepancy::{Budget, DiscrepancyError, Measure, PointSet, Value, measure};
use serde_json::{Map, json};
use std::io::IsTerminal as _;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

/// The default measures.
const DEFAULT: &str = "star,l2star,centered,wrap,mixture";

/// What of points is measured.
#[derive(Args)]
pub struct MeasureArguments {
    /// Print measures of the points instead of them, by the names of `raystone list measure`, or `all` [default of a file:
    /// star,l2star,centered,wrap,mixture]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    measure: Vec<String>,
    /// Seconds that each measure may take; a star discrepancy in three dimensions or more that is not found in time is
    /// given as bounds
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 60.0,
        allow_negative_numbers = true
    )]
    budget: f64,
}

impl MeasureArguments {
    pub(super) fn is_asked(&self) -> bool {
        !self.measure.is_empty()
    }

    pub(super) fn print(&self, points: &PointSet) -> Result<ExitCode> {
        let measures = self.measures()?;
        if self.budget.is_nan() || self.budget <= 0.0 {
            bail!("--budget: give a number of seconds above 0");
        }
        let mut results = Map::new();
        for kind in measures {
            let clock = Instant::now();
            let result = measure(points, kind, &Budget::seconds(self.budget));
            let seconds = clock.elapsed().as_secs_f64();
            results.insert(kind.name().to_owned(), fields(result, seconds));
        }
        let fields = json!({ "n": points.len(), "dim": points.dim(), "measures": results });
        print_json("points", fields)?;
        Ok(ExitCode::SUCCESS)
    }

    fn measures(&self) -> Result<Vec<Measure>> {
        let default = DEFAULT.split(',').filter(|_| !self.is_asked());
        let mut found = Vec::new();
        for name in self.measure.iter().map(|name| name.trim()).chain(default) {
            match Measure::from_name(name) {
                Some(measure) => found.push(measure),
                None if name == "all" => found.extend(Measure::ALL),
                None => {
                    let known = Measure::ALL.map(Measure::name).into_iter().chain(["all"]);
                    bail!("--measure: {}", unknown(name, known));
                }
            }
        }
        Ok(found)
    }
}

/// Reads the requested dimensions of the points of a file, or of standard input without one.
pub(super) fn read(file: Option<&Path>, dims: &[u32]) -> Result<PointSet> {
    if file.is_none() && std::io::stdin().is_terminal() {
        bail!("give a --sequence to draw points from, or a file to measure");
    }
    let (text, name) = read_text(file.unwrap_or(Path::new("-")))?;
    let points = PointSet::parse(&text).map_err(|error| match error {
        DiscrepancyError::Line { line, reason } => anyhow!("{name}:{line}: {reason}"),
        error => anyhow!("{name}: {error}"),
    })?;
    if dims.is_empty() {
        return Ok(points);
    }
    let dims: Vec<usize> = dims.iter().map(|dim| *dim as usize).collect();
    points.project(&dims).map_err(|_| {
        let (asked, available) = (dims.iter().max().unwrap_or(&0) + 1, points.dim());
        anyhow!("--dim {asked}: the points of {name} have {available} coordinates only")
    })
}

/// Returns the fields of a measurement, or the reason why there is none; an absent value is absent, never 0.
fn fields(result: Result<Value, DiscrepancyError>, seconds: f64) -> serde_json::Value {
    let mut fields = match result {
        Ok(Value::Bracket(bracket)) => {
            let (lower, upper) = (bracket.lower, bracket.upper);
            match bracket.value() {
                Some(value) => {
                    json!({ "value": value, "lower": lower, "upper": upper, "exact": true })
                }
                None => json!({ "lower": lower, "upper": upper, "exact": false }),
            }
        }
        Ok(Value::Number(value)) => json!({ "value": value }),
        Ok(Value::Square(square)) => json!({ "root": square.sqrt(), "square": square }),
        Ok(Value::Net(net)) => json!({ "t": net.t, "m": net.m }),
        Ok(Value::Shapes { all, even }) => json!({ "shapes": all, "even": even }),
        Ok(Value::Spectrum(power)) => json!({ "power": power }),
        Ok(Value::Matrix(rows)) => json!({ "matrix": rows }),
        Err(reason) => json!({ "reason": reason.to_string() }),
    };
    fields["seconds"] = json!(seconds);
    fields
}

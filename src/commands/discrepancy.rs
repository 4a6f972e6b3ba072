//! `raystone discrepancy`.

use super::output::print_json;
use anyhow::{Context as _, Result, anyhow, bail};
use clap::Args;
use raystone::discrepancy::{Budget, DiscrepancyError, Measure, PointSet, Value, measure};
use raystone::text::{nearest, plain_text};
use serde_json::{Map, json};
use std::io::Read as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Measure how evenly points fill the unit cube: exact star discrepancy and others, as JSON
#[derive(Args)]
pub struct Discrepancy {
    /// File with a point a line, coordinates parted by blanks, commas or tabs, `#` for comments;
    /// `-` is standard input
    #[arg(default_value = "-")]
    file: PathBuf,
    /// What to measure, by the names of `raystone list measure`, or `all`
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    #[arg(default_value = "star,l2star,centered,wrap,mixture")]
    measure: Vec<String>,
    /// Use the first D coordinates of each point only
    #[arg(long, value_name = "D")]
    dim: Option<usize>,
    /// Time that each measure may take; a star discrepancy in three dimensions or more that is not
    /// found in time is given as bounds
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 60.0,
        allow_negative_numbers = true
    )]
    budget: f64,
}

impl Discrepancy {
    pub fn execute(self) -> Result<ExitCode> {
        let measures = measures(&self.measure)?;
        if self.budget.is_nan() || self.budget <= 0.0 {
            bail!("--budget: give a number of seconds above 0");
        }
        let points = self.points()?;
        let mut results = Map::new();
        for kind in measures {
            let clock = Instant::now();
            let result = measure(&points, kind, &Budget::seconds(self.budget));
            let seconds = clock.elapsed().as_secs_f64();
            results.insert(kind.name().to_owned(), fields(result, seconds));
        }
        print_json(
            "discrepancy",
            json!({ "n": points.len(), "dim": points.dim(), "measures": results }),
        )?;
        Ok(ExitCode::SUCCESS)
    }

    fn points(&self) -> Result<PointSet> {
        let (name, bytes) = if self.file.as_os_str() == "-" {
            let mut bytes = Vec::new();
            let read = std::io::stdin().lock().read_to_end(&mut bytes);
            ("standard input".to_owned(), read.map(|_| bytes))
        } else {
            (self.file.display().to_string(), std::fs::read(&self.file))
        };
        let bytes = bytes.with_context(|| format!("cannot read {name}"))?;
        let text = plain_text(bytes)
            .map_err(|error| anyhow!("{name}:{}: it is not UTF-8 text", error.line))?;
        let points = PointSet::parse(&text).map_err(|error| match error {
            DiscrepancyError::Line { line, reason } => anyhow!("{name}:{line}: {reason}"),
            error => anyhow!("{name}: {error}"),
        })?;
        let Some(dim) = self.dim else {
            return Ok(points);
        };
        if dim == 0 {
            bail!("--dim: give at least 1");
        }
        let first: Vec<usize> = (0..dim.min(points.dim() + 1)).collect();
        points.project(&first).map_err(|_| {
            let available = points.dim();
            anyhow!("--dim {dim}: the points of {name} have {available} coordinates only")
        })
    }
}

fn measures(names: &[String]) -> Result<Vec<Measure>> {
    let mut found = Vec::new();
    for name in names.iter().map(|name| name.trim()) {
        if name == "all" {
            found.extend(Measure::ALL);
            continue;
        }
        let known = Measure::ALL.map(Measure::name);
        let measure = Measure::from_name(name).ok_or_else(|| {
            let hint = nearest(name, known).map(|near| format!(", did you mean `{near}`?"));
            anyhow!(
                "--measure: there is no `{name}`{} (known: {}, all)",
                hint.unwrap_or_default(),
                known.join(", ")
            )
        })?;
        found.push(measure);
    }
    Ok(found)
}

/// What was measured, or the reason why there is nothing; an absent value is absent, never 0.
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

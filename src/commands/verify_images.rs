//! `raystone verify --images`.

use super::arguments::{DeviceArguments, ValueArguments};
use super::failure::ended;
use super::output::{print, screen};
use anyhow::Result;
use raystone::measure::known_images::{NOISE, SYSTEMATIC, Seen};
use raystone::report::document::{Table, TableCell};
use raystone::report::format::count;
use raystone::run::{Registries, verify_images};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

pub fn execute(
    registries: &Registries,
    device: &DeviceArguments,
    values: &ValueArguments,
) -> Result<ExitCode> {
    let options = device.options(PathBuf::new(), values, true);
    let all = verify_images(registries, &options, device.kernels.as_deref(), |_| true)?;
    print(&table(&all))?;
    let failed = all.iter().filter(|seen| seen.fault.is_some()).count();
    print(&format!(
        "{} of {} views passed\n",
        all.len() - failed,
        all.len()
    ))?;
    Ok(ended(failed == 0))
}

/// Formats a row per view with its worst channel, and failures below.
fn table(all: &[Seen]) -> String {
    let columns = [
        "image, view",
        ":verdict",
        "expected",
        "measured",
        "off by %",
        "sigma %",
        "spp",
    ];
    let mut table = Table::new("Known images", &columns);
    let mut details = String::new();
    for seen in all {
        let (channel, off) = seen.worst();
        let number = |x: f64| TableCell::from(format!("{x:.5}"));
        let percent = |x: f64| TableCell::from(format!("{:.3}", 100.0 * x));
        table.rows.push(vec![
            seen.name.as_str().into(),
            if seen.fault.is_some() {
                "FAILED"
            } else {
                "passed"
            }
            .into(),
            number(seen.expected[channel]),
            number(seen.measured[channel]),
            percent(off),
            percent(seen.noise()),
            count(seen.spp.into()).into(),
        ]);
        if let Some(fault) = &seen.fault {
            // Writing to a string cannot fail.
            let _ = writeln!(details, "{}: {fault}", seen.name);
        }
    }
    let legend = format!(
        "expected, measured, off by: of the worst channel; sigma: the greatest standard error of the mean over 64 pixels; passed: off by \
         at most {:.2} % and four sigma, which are at most {:.2} %\n",
        100.0 * SYSTEMATIC,
        100.0 * NOISE
    );
    format!(
        "{}{}{details}",
        screen().table(&table),
        screen().lines(legend.trim_end())
    )
}

//! Numbers as text: three significant digits, units, and a dash for absent ones.

use raystone_core::text::escape::raised;
pub use raystone_core::text::{count, plural};
use raystone_record::Environment;
use raystone_record::Interval;
use raystone_record::figure::{Figure, Shown};
use raystone_stats::statistics::LEAST_FOR_MEDIAN;

/// The text of an absent value.
pub(crate) const ABSENT: &str = "–";

/// Formats a number with `digits` significant digits and a true minus; `6.33·10⁻⁴` below 10⁻³ and from 10⁶ on, the
/// dash for NaN and infinities.
pub fn significant(value: f64, digits: usize) -> String {
    let text = plain(value, digits);
    match text.split_once('e') {
        None => text.replace('-', "−"),
        Some((mantissa, exponent)) => {
            format!("{}·10{}", mantissa.replace('-', "−"), raised(exponent))
        }
    }
}

/// Formats the same in plain characters.
fn plain(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return ABSENT.into();
    }
    // Let the formatter round first, so that 9.999 counts as 10.0.
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    let exponent: i32 = text
        .split_once('e')
        .and_then(|(_, e)| e.parse().ok())
        .unwrap_or(0);
    if (-3..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        text
    }
}

/// Formats three significant digits.
pub fn number(value: f64) -> String {
    significant(value, 3)
}

/// Formats three significant digits, or the dash.
pub fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| ABSENT.into(), number)
}

/// Formats `[low, high]`.
pub fn bounds(interval: &Interval) -> String {
    format!("[{}, {}]", number(interval.low), number(interval.high))
}

/// Formats `value [low, high]`; the interval is left out where it has no width.
pub fn interval(interval: &Interval) -> String {
    with_bounds(interval, number)
}

fn with_bounds(i: &Interval, text: impl Fn(f64) -> String) -> String {
    if i.low == i.high {
        text(i.value)
    } else {
        format!("{} [{}, {}]", text(i.value), text(i.low), text(i.high))
    }
}

/// Describes the bounds of medians of so many samples.
pub(crate) fn median_bounds(samples: impl Iterator<Item = usize>) -> String {
    match samples.filter(|n| *n > 0).min() {
        Some(few) if few < LEAST_FOR_MEDIAN => {
            format!("range of {few} samples, {LEAST_FOR_MEDIAN} are needed for a 95 % interval")
        }
        _ => "95 % interval".into(),
    }
}

/// Formats a slope with its interval; the interval is left out where it has no width.
pub(crate) fn slope(interval: &Interval) -> String {
    with_bounds(interval, exponent)
}

fn exponent(value: f64) -> String {
    format!("{value:.2}").replace('-', "−")
}

/// Formats bytes with a binary unit.
pub fn bytes(value: u64) -> String {
    const UNITS: [&str; 4] = ["KiB", "MiB", "GiB", "TiB"];
    if value < 1024 {
        return format!("{value} B");
    }
    let mut scaled = value as f64 / 1024.0;
    let mut unit = 0;
    while scaled >= 1024.0 && unit + 1 < UNITS.len() {
        scaled /= 1024.0;
        unit += 1;
    }
    format!("{} {}", number(scaled), UNITS[unit])
}

/// Formats a value by its row in the table of figures.
pub fn figure(figure: &Figure, value: f64) -> String {
    match figure.shown {
        _ if !value.is_finite() => ABSENT.into(),
        Shown::Digits(digits) => significant(value, digits.into()),
        Shown::Count => count(value as u64),
        Shown::Bytes => bytes(value as u64),
        Shown::Percent => percent(value),
        Shown::Exponent => exponent(value),
    }
}

/// Formats a share as whole percent, one decimal below ten. Only nothing is `0.0 %` and only all of it `100 %`: what lies
/// next to them has the digits that tell it from them.
pub(crate) fn percent(share: f64) -> String {
    let value = share * 100.0;
    let size = value.abs();
    let digits = match size {
        _ if !value.is_finite() => return ABSENT.into(),
        0.0 => return "0.0 %".into(),
        ..0.05 => return format!("{} %", significant(value, 1)),
        ..9.95 => 1,
        99.5..100.0 => {
            let is_below = |digits: &usize| !format!("{size:.digits$}").starts_with("100");
            (1..10).find(is_below).unwrap_or(0)
        }
        _ => 0,
    };
    format!("{value:.digits$} %").replace('-', "−")
}

/// Formats date, adapter and processor in one line.
pub fn where_and_when(e: &Environment, unix_s: u64) -> String {
    format!(
        "{} on {} ({}, {} {}), {}",
        utc(unix_s),
        e.adapter,
        e.backend,
        e.driver,
        e.driver_info,
        e.cpu
    )
}

/// Formats seconds since 1970 as `YYYY-MM-DD hh:mm UTC` (days to civil date by Hinnant's algorithm).
pub(crate) fn utc(unix_s: u64) -> String {
    let (days, second) = (unix_s / 86_400, unix_s % 86_400);
    let shifted = days + 719_468;
    let era = shifted / 146_097;
    let day_of_era = shifted % 146_097;
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 {
        shifted_month + 3
    } else {
        shifted_month - 9
    };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    format!(
        "{year:04}-{month:02}-{day:02} {:02}:{:02} UTC",
        second / 3600,
        second / 60 % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits_at_any_size_and_absent_is_a_dash() {
        for (value, text) in [
            (9.999, "10.0"),
            (0.001234, "0.00123"),
            (0.0001234, "1.23·10⁻⁴"),
            (123_456.0, "123456"),
            (1_234_567.0, "1.23·10⁶"),
            (-0.5, "−0.500"),
            (0.0, "0"),
            (f64::NAN, "–"),
        ] {
            assert_eq!(number(value), text);
        }
        assert_eq!(optional(None), "–");
        assert_eq!([count(262_267), count(100)], ["262,267", "100"]);
        assert_eq!([bytes(1023), bytes(3 << 20)], ["1023 B", "3.00 MiB"]);
    }

    #[test]
    fn only_all_of_it_is_a_hundred_percent_and_only_nothing_is_none() {
        for (share, text) in [
            (0.0, "0.0 %"),
            (-0.0, "0.0 %"),
            (0.0004, "0.04 %"),
            (1.7e-8, "2·10⁻⁶ %"),
            (0.0006, "0.1 %"),
            (0.043, "4.3 %"),
            (-0.043, "−4.3 %"),
            (0.0996, "10 %"),
            (0.1, "10 %"),
            (0.994, "99 %"),
            (0.9968, "99.7 %"),
            (0.999_938_96, "99.99 %"),
            (1.0, "100 %"),
            (1.0 - f64::EPSILON, "100 %"),
            (1.004, "100 %"),
            (f64::NAN, "–"),
        ] {
            assert_eq!(percent(share), text, "{share}");
        }
    }

    #[test]
    fn dates_match_known_ones() {
        assert_eq!(utc(0), "1970-01-01 00:00 UTC");
        assert_eq!(utc(951_827_696), "2000-02-29 12:34 UTC");
        assert_eq!(utc(1_763_700_000), "2025-11-21 04:40 UTC");
    }
}

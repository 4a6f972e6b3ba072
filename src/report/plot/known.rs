//! Known plots, drawn anew before any is shown: one with its colours or its axes exchanged looks like another result.

use super::axis::{Axes, Axis};
use super::drawing::{Drawing, Ink, Point, Shape};
use super::heat::HeatMap;
use super::panels::{self, Panel};
use super::spectrum::PeriodogramMap;
use crate::sections::structures::color_scale;
use raystone_discrepancy::{Budget, PointSet, periodogram};

/// The ends of the colour map viridis, as Matplotlib 3.9 prints them.
const LEAST: [u8; 3] = [68, 1, 84];
const GREATEST: [u8; 3] = [253, 231, 37];

/// Draws a table of numbers, axes, a raster and a spectrum.
///
/// # Errors
/// A colour, a corner or a side is not what it should be: of which plot.
pub fn check() -> Result<(), String> {
    let plots = [
        ("table of colours", table()),
        ("table of counts", counts()),
        ("scale of heat maps", scale()),
        ("pair of axes", axes()),
        ("row of marks", marks()),
        ("raster", raster()),
        ("spectrum", spectrum()),
    ];
    let wrong = plots.into_iter().find(|(_, is_right)| !is_right);
    wrong.map_or(Ok(()), |(name, _)| {
        Err(format!(
            "a known {name} is drawn with its colours, labels or axes exchanged: this program shows wrong plots; build it anew, \
             and report what stays wrong"
        ))
    })
}

/// The colours of all areas before a text.
fn colors_below(drawing: &Drawing, text: &str) -> Option<Ink> {
    let mut last = None;
    for shape in &drawing.shapes {
        match shape {
            Shape::Area { ink, .. } => last = Some(*ink),
            Shape::Text { text: found, .. } if found == text => return last,
            _ => {}
        }
    }
    None
}

/// Of three numbers the least is violet and the greatest yellow, and the scale ends with yellow.
fn table() -> bool {
    let names = ["a", "b", "c"].map(str::to_owned);
    let map = HeatMap::of_pairs(&names, &[(0, 1, 1.0), (0, 2, 2.0), (1, 2, 4.0)]);
    let Some(drawing) = map.draw() else {
        return false;
    };
    let last = drawing.shapes.iter().rev().find_map(|shape| match shape {
        Shape::Area { ink, .. } => Some(ink.rgb),
        _ => None,
    });
    let of_tile = |share: f64| {
        let text = map.tiles.iter().flatten().flatten();
        let mut text = text.filter(|tile| tile.share == Some(share));
        let ink = colors_below(&drawing, &text.next()?.text)?;
        Some(ink.rgb)
    };
    // Each is in the table and at its end of the scale.
    let text_of = |share: f64| {
        let mut tiles = map.tiles.iter().flatten().flatten();
        Some(tiles.find(|tile| tile.share == Some(share))?.text.clone())
    };
    let ends = [0.0, 1.0].map(|share| places(&drawing, &text_of(share).unwrap_or_default()));
    let is_scale = match &ends {
        [low, high] if low.len() == 2 && high.len() == 2 => low[1].0 < high[1].0,
        _ => false,
    };
    let is_colored = of_tile(0.0) == Some(LEAST) && of_tile(1.0) == Some(GREATEST);
    is_colored && last == Some(GREATEST) && is_scale
}

/// Where a text stands, of all its places.
fn places(drawing: &Drawing, text: &str) -> Vec<Point> {
    let texts = drawing.shapes.iter().filter_map(|shape| match shape {
        Shape::Text {
            at, text: found, ..
        } if found == text => Some(*at),
        _ => None,
    });
    texts.collect()
}

/// Each number is in the row and column of its
/// names, and as bright as its logarithm; the greatest of all maps ends the scale, at the right.
fn counts() -> bool {
    let names = |names: [&str; 2]| names.map(str::to_owned).to_vec();
    let values = [
        [Some((3.0, false)), Some((0.0, false))].to_vec(),
        [None, Some((25.0, true))].to_vec(),
    ];
    let (rows, columns) = (names(["a", "b"]), names(["c", "d"]));
    let map = HeatMap::of_counts("rays", rows, columns, &values, 40.0);
    let Some(drawing) = map.draw() else {
        return false;
    };
    let at = |text: &str| match places(&drawing, text)[..] {
        [only] => only,
        _ => (f64::NAN, f64::NAN),
    };
    let is_below = |name: &str, number: &str| (at(name).0 - at(number).0).abs() < 2.0;
    let is_beside = |name: &str, number: &str| (at(name).1 - at(number).1).abs() < 2.0;
    let share = |row: usize, column: usize| Some(map.tiles[row][column].as_ref()?.share);
    let bright = |found: Option<Option<f64>>, value: f64| {
        let expected = (1.0 + value).log(41.0);
        matches!(found, Some(Some(share)) if (share - expected).abs() < 1e-12)
    };
    let is_placed = is_below("c", "3.0") && is_beside("a", "3.0") && at("a").1 < at("b").1;
    let is_last = is_below("d", "25") && is_beside("b", "25") && at("c").0 < at("d").0;
    let is_scale = at("few").0 < at("40").0 && (at("few").1 - at("40").1).abs() < 2.0;
    let unit = "rays; logarithm of 1 + value, one scale for all maps; grey: 0";
    let is_bright = bright(share(0, 0), 3.0) && bright(share(1, 1), 25.0);
    let is_said = at(unit).1 > at("few").1 && drawing.says.contains("b, d: 25");
    is_placed && is_last && is_scale && is_bright && share(0, 1) == Some(None) && is_said
}

/// From nothing to a top that maps share, in their unit; or in parts of their own tops.
fn scale() -> bool {
    let labels = |tops: &[f64]| color_scale(tops).map(|scale| scale.labels.join(" "));
    let is_drawn = |scale: &crate::document::ColorScale| {
        let ends = ["linear-gradient(to right, #440154", "#fde725)"];
        scale.gradient.starts_with(ends[0])
            && scale.gradient.ends_with(ends[1])
            && scale
                .title
                .starts_with("nodes + triangle tests per primary ray")
    };
    let shared = labels(&[80.0, 80.0]);
    let own = labels(&[80.0, 40.0]);
    shared.as_deref() == Some("0 20.0 40.0 60.0 80.0")
        && own.as_deref() == Some("0.0 % 25 % 50 % 75 % 100 %")
        && color_scale(&[80.0]).as_ref().is_some_and(is_drawn)
        && color_scale(&[]).is_none()
}

/// Zero lies at the lower left, and the greatest x at the right border of a plot of 500 × 300 pixels.
fn axes() -> bool {
    let axes = Axes::new(
        Axis::linear(10.0, "x"),
        Axis::linear(4.0, "y"),
        500.0,
        300.0,
    );
    let [origin, right, up] = [(0.0, 0.0), (10.0, 0.0), (0.0, 4.0)].map(|(x, y)| axes.at(x, y));
    let is_corner = |(x, y): (f64, f64), at: [f64; 2]| (x - at[0]).hypot(y - at[1]) < 1e-9;
    is_corner(right, [482.0, 248.0])
        && is_corner(up, [origin.0, 14.0])
        && is_corner(origin, [origin.0, 248.0])
        && (60.0..120.0).contains(&origin.0)
}

/// Within an octave marks have the digits that tell them apart, below one as above.
fn marks() -> bool {
    let all = |range: [f64; 2], texts: &[&str]| {
        let Some(axis) = Axis::log10(range.into_iter(), "x") else {
            return false;
        };
        let mut drawing = Drawing::new(600.0, 300.0);
        Axes::new(axis, Axis::linear(4.0, "y"), 600.0, 300.0).draw(&mut drawing);
        texts.iter().all(|text| places(&drawing, text).len() == 1)
    };
    all([1.1, 2.6], &["1.2", "1.5", "2.5"]) && all([0.011, 0.026], &["0.012", "0.015", "0.025"])
}

/// Of three columns and two rows, each twice as large, and wider than high in SVG, too.
fn raster() -> bool {
    let raster = super::raster::Raster {
        at: (0.0, 0.0),
        size: (6.0, 4.0),
        columns: 3,
        rgb: (0..6).map(|i| [i; 3]).collect(),
    };
    let mut picture = vec![255; 3 * 6 * 4];
    raster.blit(&mut picture, 6, 1.0);
    let seen = picture.iter().step_by(3).copied();
    let rows = [[0, 0, 1, 1, 2, 2], [3, 3, 4, 4, 5, 5]];
    let is_wide = |svg: String| svg.contains(r#"width="6" height="4""#);
    seen.eq([rows[0], rows[0], rows[1], rows[1]].concat()) && raster.svg(1.0).is_ok_and(is_wide)
}

/// Two points half an edge apart along x have no power at odd frequencies along x, and 2 at all along y.
fn spectrum() -> bool {
    let found = PointSet::from_points(&[[0.125, 0.25], [0.625, 0.25]])
        .and_then(|points| periodogram(&points, 2, &Budget::seconds(60.0)));
    let Ok(found) = found else {
        return false;
    };
    let drawing = panels::draw(
        &[Panel::new("", "", PeriodogramMap(found))],
        1,
        (100.0, 100.0),
    );
    let Some(raster) = drawing.rasters.first() else {
        return false;
    };
    let at = |column: usize, row: usize| raster.rgb.get(5 * row + column);
    let is_dark = |color: Option<&[u8; 3]>| color == Some(&LEAST);
    raster.columns == 5 && is_dark(at(3, 2)) && is_dark(at(1, 2)) && !is_dark(at(2, 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_have_the_published_colours_and_their_corners_and_sides() {
        assert_eq!(check(), Ok(()));
    }
}

//! Known plots, drawn anew before any is shown: one with its colours or its axes exchanged looks like another result.

use super::axis::{Axes, Axis};
use super::drawing::{Drawing, Ink, Shape};
use super::heat::HeatMap;
use super::panels::{self, Panel};
use super::spectrum::PeriodogramMap;
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
        ("pair of axes", axes()),
        ("raster", raster()),
        ("spectrum", spectrum()),
    ];
    let wrong = plots.into_iter().find(|(_, is_right)| !is_right);
    wrong.map_or(Ok(()), |(name, _)| {
        Err(format!(
            "a known {name} is drawn with its colours or axes exchanged: this program shows wrong plots; build it anew, \
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
    of_tile(0.0) == Some(LEAST) && of_tile(1.0) == Some(GREATEST) && last == Some(GREATEST)
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

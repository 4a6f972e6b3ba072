//! Paths that begin at rasterised triangles, against rays through the same points.

use crate::data::View;
use crate::document::*;
use crate::format;
use crate::pivot::{FIGURES_ALONE, Rows};
use crate::values::Value;
use raystone_record::axis;
use raystone_record::figure;

/// What tells cells of a view apart.
const ROWS: [&str; 5] = [
    axis::ACCEL,
    axis::SEQUENCE,
    axis::DECORRELATION,
    axis::OFFSET,
    axis::WORKGROUP,
];

/// A row for each cell that was compared; no table where none was.
pub(super) fn table(view: &View, values: &[Value]) -> Table {
    let compared = view.valid_times().filter(|time| time.primary.is_some());
    let rows = compared.map(|time| {
        let cells = [&time.structure, &time.sampler];
        let cells = cells.map(|text| text.clone().into()).to_vec();
        (time.key.clone(), cells)
    });
    let counts = view.times.iter().map(|time| time.ms.len());
    let caption = format!(
        "Primary visibility with {}: rasterised against rays through the same points, centres of pixels, with the same samples behind them; wall times of one picture of \
         all first hits, median [{}]. A pixel that sees the same triangle has the same value",
        view.name,
        format::median_bounds(counts),
    );
    let figures = [
        &figure::PRIMARY_OTHER_TRIANGLE,
        &figure::PRIMARY_OTHER_VALUE,
        &figure::PRIMARY_MEAN_DIFFERENCE,
        &figure::PRIMARY_RMS_DIFFERENCE,
        &figure::RASTER_MS,
        &figure::TRACED_PRIMARY_MS,
    ];
    let heads = ["structure", ":sampler"];
    Rows::new(&ROWS, &heads, rows).table(values, caption, &figures, FIGURES_ALONE)
}

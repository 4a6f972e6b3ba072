//! Full cells in orders of passes: how much longer they take, and how soon there is a picture.

use crate::data::View;
use crate::document::*;
use crate::format;
use crate::pivot::{FIGURES_ALONE, Rows};
use crate::values::Value;
use raystone_record::axis;
use raystone_record::figure;

/// What tells cells of a view and their orders apart.
const ROWS: [&str; 5] = [
    axis::ACCEL,
    axis::SEQUENCE,
    axis::DECORRELATION,
    axis::OFFSET,
    axis::SUBJECT,
];

/// A row for each cell and order; no table where none was asked for.
pub(super) fn table(view: &View, values: &[Value]) -> Table {
    let rows = view.valid_times().flat_map(|time| {
        time.orders.iter().map(|at| {
            let key = time.key.clone().with(axis::SUBJECT, &at.order);
            let cells = [&time.structure, &time.sampler, &at.order];
            (key, cells.map(|text| text.clone().into()).to_vec())
        })
    });
    let counts = view.times.iter().map(|time| time.ms.len());
    let caption = format!(
        "Orders of pixels with {}, by the wall clock, a submission for each pass: median [{}]. A picture is there once every \
         pixel has a colour of its own or of the coarser pixel that it lies in",
        view.name,
        format::median_bounds(counts),
    );
    let figures = [
        &figure::ORDER_PASSES,
        &figure::ORDER_MS,
        &figure::ORDER_RATIO,
        &figure::FIRST_PICTURE_MS,
    ];
    let heads = ["structure", ":sampler", ":order"];
    Rows::new(&ROWS, &heads, rows).table(values, caption, &figures, FIGURES_ALONE)
}

//! Plots: laid out once as a [`drawing::Drawing`], painted as SVG and as PNG by `paint`.

pub mod axis;
pub mod curves;
pub mod drawing;
pub mod heat;
pub(crate) mod histogram;
pub mod known;
pub(crate) mod legend;
pub mod marker;
pub(crate) mod paint;
pub(crate) mod panels;
pub(crate) mod pareto;
pub mod points;
pub mod raster;
pub(crate) mod rates;
pub mod spectrum;

//! Plots: laid out once as a [`drawing::Drawing`], painted as SVG and as PNG by [`paint`].

pub mod axis;
pub mod curves;
pub mod drawing;
pub mod heat;
pub mod histogram;
pub mod legend;
pub mod marker;
pub mod paint;
pub mod panels;
pub mod pareto;
pub mod points;
pub mod raster;
pub mod rates;
pub mod spectrum;

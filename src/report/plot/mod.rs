//! Plots: laid out once as a [`drawing::Drawing`], painted as SVG and as PNG by [`paint`].

pub mod axis;
pub mod curves;
pub mod drawing;
pub mod histogram;
pub mod marker;
pub mod paint;
pub mod pareto;
pub mod rates;

//! Appearance of categories: colour and marker shape, and dashes for exact curves.

use super::drawing::{Drawing, Ink, Point};
use raystone_image::categorical;
use std::f64::consts::PI;

/// Number of different marker shapes.
const SHAPES: usize = 7;

/// Looks from this index on belong to structures, those below to samplers and all else: no colour is used for both.
pub(crate) const STRUCTURES: usize = 56;

/// Muted colours for structures.
const MUTED: [[u8; 3]; 8] = [
    [0x4b, 0x5d, 0x73],
    [0x9a, 0x6b, 0x2f],
    [0x5f, 0x7f, 0x3a],
    [0x7a, 0x51, 0x95],
    [0x9c, 0x4f, 0x5b],
    [0x3b, 0x7f, 0x7a],
    [0x8a, 0x8f, 0x98],
    [0xb5, 0x93, 0x6b],
];

/// Returns the colour of the category.
pub(crate) fn ink(index: usize) -> Ink {
    Ink::solid(match index.checked_sub(STRUCTURES) {
        Some(structure) => MUTED[structure % MUTED.len()],
        None => categorical(index),
    })
}

/// Draws the marker of a category at a point; with eight colours, seven shapes distinguish 56 categories.
pub fn draw(drawing: &mut Drawing, shape: usize, (x, y): Point, radius: f64, ink: Ink) {
    let ring = |corners: usize, turn: f64, radius: f64| -> Vec<Point> {
        (0..corners)
            .map(|i| turn + 2.0 * PI * i as f64 / corners as f64)
            .map(|angle| (x + radius * angle.sin(), y - radius * angle.cos()))
            .collect()
    };
    let thick = radius * 0.62;
    match shape % SHAPES {
        0 => drawing.area(ring(24, 0.0, radius), ink),
        1 => drawing.area(ring(4, PI / 4.0, radius * 1.25), ink),
        2 => drawing.area(ring(3, 0.0, radius * 1.35), ink),
        3 => drawing.area(ring(4, 0.0, radius * 1.4), ink),
        4 => drawing.area(ring(3, PI, radius * 1.35), ink),
        kind => {
            // A plus, or a plus rotated to a cross.
            let turn = if kind == 5 { PI / 4.0 } else { 0.0 };
            for angle in [turn, turn + PI / 2.0] {
                let (dx, dy) = (radius * 1.3 * angle.sin(), radius * 1.3 * angle.cos());
                drawing.line(vec![(x - dx, y + dy), (x + dx, y - dy)], ink, thick);
            }
        }
    }
}

//! What was rendered, apart from how it is shown.

use super::frame::{Figures, Frame, SideFrame};
use super::maps::{Maps, absence};
use raystone_config::{Cell, Map, Window};
use raystone_image::{Image, Picture, automatic_exposure, tone_map, viridis};
use std::sync::Arc;

/// Share of pixels below the upper end of an automatic scale.
const PERCENTILE: usize = 99;

/// What a viewer has rendered, which can be drawn with another exposure, line or map while the viewer works on: none of them needs
/// the device, once a map is counted.
#[derive(Clone, Default)]
pub struct Display {
    pub(crate) sides: Vec<Rendered>,
    /// What does not depend on how it is shown.
    pub(crate) frame: Frame,
}

/// An image, with the work of its pixels.
#[derive(Clone)]
pub(crate) struct Rendered {
    pub image: Option<Arc<Image>>,
    pub maps: Maps,
    pub label: String,
    pub cell: Cell,
    pub figures: Figures,
    pub fault: Option<String>,
}

impl Display {
    /// What to draw.
    pub fn frame(&self, window: &Window) -> Frame {
        let painter = Painter::new(&self.sides, window);
        let side = |side: &Rendered| {
            let (picture, map_mean) = painter.picture(side);
            let counted = side.maps.values(window.map);
            let reason = counted.and_then(|(_, values)| values.err());
            let uncounted = reason.map(|reason| absence(&side.cell, &reason));
            SideFrame {
                picture,
                label: side.label.clone(),
                figures: Figures {
                    map_mean,
                    ..side.figures.clone()
                },
                fault: side.fault.clone().or(uncounted),
            }
        };
        Frame {
            sides: self.sides.iter().map(side).collect(),
            scale: painter.scale(),
            ..self.frame.clone()
        }
    }

    /// Whether each image, or its map, is there: a map that was not counted yet needs the device.
    pub fn has(&self, map: Map) -> bool {
        let mut sides = self.sides.iter();
        !self.sides.is_empty()
            && match map {
                Map::None => sides.all(|side| side.image.is_some()),
                map => sides.all(|side| side.maps.has(map)),
            }
    }
}

/// Tone-maps, and draws maps, of all sides on one scale.
struct Painter {
    exposure: f32,
    scale: f32,
    map: Map,
}

impl Painter {
    fn new(sides: &[Rendered], window: &Window) -> Self {
        let first = sides.iter().find_map(|side| side.image.as_deref());
        let automatic = first.map_or(1.0, automatic_exposure);
        let values = |side: &Rendered| side.maps.values(window.map)?.1.ok();
        let greatest = |side: &Rendered| values(side).map_or(0.0, |values| percentile(&values));
        let scale = match window.scale {
            0.0 if window.map != Map::None => sides.iter().map(greatest).fold(1.0, f32::max),
            chosen => chosen,
        };
        Self {
            exposure: automatic * window.exposure.exp2(),
            scale,
            map: window.map,
        }
    }

    fn scale(&self) -> Option<f32> {
        (self.map != Map::None).then_some(self.scale)
    }

    /// The picture of a side, and the mean of its map.
    fn picture(&self, side: &Rendered) -> (Option<Picture>, Option<f64>) {
        if self.map == Map::None {
            let image = side.image.as_deref();
            return (image.map(|image| tone_map(image, self.exposure)), None);
        }
        let Some((size, Ok(values))) = side.maps.values(self.map) else {
            return (None, None);
        };
        if values.is_empty() {
            return (None, None);
        }
        let sum: f64 = values.iter().copied().map(f64::from).sum();
        let picture = Picture {
            width: size[0],
            height: size[1],
            pixels: values.iter().map(|v| viridis(v / self.scale)).collect(),
        };
        (Some(picture), Some(sum / values.len() as f64))
    }
}

fn percentile(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f32::total_cmp);
    let place = sorted.len() * PERCENTILE / 100;
    sorted.get(place).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::MapOfWork;
    use raystone_accel::Counters;

    #[test]
    fn the_scale_ends_where_one_pixel_in_a_hundred_is_above() {
        let values: Vec<f32> = (0..200).map(|i| i as f32).collect();
        assert_eq!(percentile(&values), 198.0);
        assert_eq!(percentile(&[]), 0.0);
    }

    #[test]
    fn what_was_rendered_is_drawn_otherwise_without_rendering_it() {
        let mut display = Display {
            sides: vec![Rendered {
                image: Some(Arc::new(
                    Image::new(2, 1, vec![[0.1; 3], [0.4; 3]]).unwrap(),
                )),
                maps: Maps::default(),
                label: String::new(),
                cell: Cell::default(),
                figures: Figures::default(),
                fault: None,
            }],
            frame: Frame::default(),
        };
        let picture = |display: &Display, window: &Window| {
            display.frame(window).sides[0].picture.clone().unwrap()
        };
        let (plain, brighter) = (
            Window::default(),
            Window {
                exposure: 1.0,
                ..Window::default()
            },
        );
        let [before, after] = [&plain, &brighter].map(|window| picture(&display, window).pixels);
        assert!(
            (0..2).all(|i| after[i][0] > before[i][0]),
            "{before:?} {after:?}"
        );
        // A map is there once it is counted.
        assert_eq!(
            [Map::None, Map::Nodes].map(|map| display.has(map)),
            [true, false]
        );
        let counters = |nodes| Counters {
            nodes,
            ..Counters::default()
        };
        display.sides[0].maps.work = Some(Arc::new(MapOfWork {
            size: [2, 1],
            work: Some(vec![counters(1), counters(3)]),
        }));
        assert!(display.has(Map::Nodes));
        let nodes = Window {
            map: Map::Nodes,
            ..plain
        };
        let frame = display.frame(&nodes);
        assert_eq!(
            (frame.scale, frame.sides[0].figures.map_mean),
            (Some(3.0), Some(2.0))
        );
    }
}

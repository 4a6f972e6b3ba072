//! Photons on a square: what is counted of a point set in an order, warped or not.

use super::{cells_of, declare};
use crate::photons::{
    ImportanceMap, Order, Points, Warp, cell_deviation, collisions, density_deviation, ordered,
    point_set, segments_of_32,
};
use raystone_bench::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Work};
use raystone_bench::timing::Samples;
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan};
use raystone_core::parameters;
use raystone_core::params::Parameters as _;
use raystone_record::Reading;
use raystone_record::figure::{Better, Figure, Shown, Spread};

/// The name on the axis of integrators, after [`MEDIA`].
const NAME: &str = "photons";
/// Cells of the map of importance along each axis.
const MAP: usize = 64;
/// Turn and scale of the square over its cells: neither is in line with them.
const TURN: f64 = 0.3;
const SCALE: f64 = 0.93;
/// Photons that run together: in a subgroup, in several workgroups.
const WINDOWS: [usize; 2] = [32, 512];

parameters! {
    /// points of photons on a square, in an order: how even they are, and which of them would write to the same places (Pfeuti 2009, Table 4.1)
    struct Load {
        /// point set
        points: Points = Points::Hammersley;
        /// order of the list
        order: Order = Order::Natural;
        /// warp by a map with a bright ring
        warp: Warp = Warp::None;
        /// photons along each axis
        side: u32 = 512, in 32..=2048;
        /// receiving cells along each axis
        cells: u32 = 128, in 16..=512;
    }
}

static FIGURES: [Figure; 4] = [
    Figure::new(
        "photon-deviation/v1",
        "deviation of photons in a cell, relative",
        "",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "photon-again-32/v1",
        "written again within 32 photons",
        "",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "photon-again-512/v1",
        "written again within 512 photons",
        "",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "photon-segments/v1",
        "segments of 128 bytes of 32 photons",
        "",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
];

pub(super) struct Photons;

impl Measurement for Photons {
    fn name(&self) -> &'static str {
        "media:photons"
    }

    fn plural(&self) -> &'static str {
        "lists of photons"
    }

    fn figures(&self) -> &'static [Figure] {
        &FIGURES
    }

    fn declare(&self, catalogue: &mut Catalogue) {
        declare::<Load>(catalogue, NAME, Load::ABOUT);
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        cells_of(plan, &[Axis::Integrator], |name| name == NAME)
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn is_timed(&self) -> bool {
        false
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!("{:?}", experiment.run.seed)
    }

    fn cost(&self, _: &Cell, _: &Cost) -> Work {
        Work::other(0.3)
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        Box::new(cells.iter().map(move |cell| {
            let load = Load::from_checked(&cell[Axis::Integrator].params);
            let seed = u64::from(at.experiment.run.seed);
            let counted = counted(&load, seed).map_err(Absent::Failed)?;
            Ok(Box::new(counted) as Box<dyn Prepared>)
        }))
    }
}

struct Counted([f64; 4]);

fn counted(load: &Load, seed: u64) -> Result<Counted, String> {
    let mut points = point_set(load.points, load.side, seed)?;
    let map = ring()?;
    for point in &mut points {
        *point = map.warped(load.warp, *point);
    }
    let points = ordered(points, load.order, load.cells, seed);
    let deviation = match load.warp {
        Warp::None => cell_deviation(&points, load.cells, TURN, SCALE),
        _ => {
            let cells = load.cells.next_multiple_of(MAP as u32);
            density_deviation(&points, cells, |at| map.density(at))
        }
    };
    Ok(Counted([
        deviation,
        collisions(&points, load.cells, WINDOWS[0]),
        collisions(&points, load.cells, WINDOWS[1]),
        segments_of_32(&points, load.cells),
    ]))
}

/// A map of importance with a ring nine times as bright as the rest, like the border of a shadow.
fn ring() -> Result<ImportanceMap, String> {
    let value = |cell: usize| {
        let [x, y] = [cell % MAP, cell / MAP].map(|c| (c as f64 + 0.5) / MAP as f64 - 0.5);
        let radius = x.hypot(y);
        if (0.25..0.35).contains(&radius) {
            9.0
        } else {
            1.0
        }
    };
    ImportanceMap::new((0..MAP * MAP).map(value).collect())
}

impl Prepared for Counted {
    fn readings(&self, _: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let readings = FIGURES.iter().zip(self.0);
        Ok(readings
            .map(|(figure, value)| Reading::exact(figure, value))
            .collect())
    }
}

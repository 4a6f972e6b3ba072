//! Machine drift, measured by the movement of control cells, whose kernels, scene, parameters and counted work are equal
//! on both sides.
//!
//! The model: the logarithm of a cell's ratio is the effect of the change, plus a deviation of the cell in this pair of
//! runs, plus the noise of its rounds. Controls show the last two alone. The variance of both together is the mean of the
//! squares of their logarithms *about zero*: a whole run that was slower counts as much as cells that moved apart, so that
//! drift widens intervals and shifts none. A cell whose own rounds are noisier than those of controls gets that much more.

use crate::format::plural;
use raystone_stats::interval::Spread;

/// Least number of controls that show drift.
pub(crate) const LEAST_CONTROLS: usize = 3;

/// Greatest number of degrees of freedom: deviations have heavier tails than the normal distribution.
const MOST_FREEDOM: f64 = 8.0;

/// The same where both sides were measured in the same rounds, which share the heaviest deviations.
const MOST_FREEDOM_IN_ROUNDS: f64 = 20.0;

/// The group of a time, within which controls are comparable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The figure: its times are of the same clock and kind of work.
    pub figure: String,
    /// The scene: its times are measured in the same rounds.
    pub scene: String,
    /// The clock: clocks differ in their noise.
    pub clock: &'static str,
}

/// A cell with equal kernels and equal work on both sides.
#[derive(Debug, Clone, PartialEq)]
struct Control {
    place: Place,
    /// Logarithm of the ratio of the times.
    log: f64,
    /// Contribution of the noise of its rounds to the square of `log`.
    rounds: f64,
}

/// The movement of controls.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Drift {
    controls: Vec<Control>,
    /// `true` if both sides were measured in the same rounds of one process.
    in_rounds: bool,
}

impl Drift {
    /// Returns an empty drift of two sides that were measured in the same rounds of one process, or separately.
    pub fn new(in_rounds: bool) -> Self {
        Self {
            controls: Vec::new(),
            in_rounds,
        }
    }

    /// Adds a control: the logarithm of its ratio, and its variance estimated from its rounds.
    pub fn add(&mut self, place: Place, log: f64, rounds: f64) {
        self.controls.push(Control { place, log, rounds });
    }

    /// Returns the total noise of a cell whose own rounds have this variance: from the controls of its figure in its rounds,
    /// or in all rounds, whichever moved more. `None` if there are too few. A control leaves itself out.
    pub fn of(&self, place: &Place, rounds: f64, itself: Option<f64>) -> Option<Spread> {
        let alike = self.controls.iter();
        let of_it = |c: &&Control| (&c.place.figure, c.place.clock) == (&place.figure, place.clock);
        let alike = alike.filter(of_it);
        let mut alike: Vec<&Control> = alike.collect();
        let is_itself = |c: &&Control| c.place == *place && Some(c.log) == itself;
        if let Some(at) = alike.iter().position(is_itself) {
            alike.swap_remove(at);
        }
        let near = alike.iter().copied();
        let near: Vec<&Control> = near.filter(|c| c.place.scene == place.scene).collect();
        let most = if self.in_rounds {
            MOST_FREEDOM_IN_ROUNDS
        } else {
            MOST_FREEDOM
        };
        let (near, all) = (spread(&near, rounds, most), spread(&alike, rounds, most));
        let variance = |s: &Option<Spread>| s.map_or(-1.0, |s| s.variance);
        if variance(&near) >= variance(&all) {
            near
        } else {
            all
        }
    }

    /// Describes the movement of the controls in words, figure by figure.
    pub fn words(&self) -> Vec<String> {
        let places = self.controls.iter().map(|c| &c.place);
        let places: std::collections::BTreeSet<(&str, &str)> =
            places.map(|place| (&*place.figure, place.clock)).collect();
        let words = places
            .iter()
            .map(|(figure, clock)| self.words_of(figure, clock));
        words.collect()
    }

    fn words_of(&self, figure: &str, clock: &str) -> String {
        let of_it = self.controls.iter();
        let of_it = of_it.filter(|c| (&*c.place.figure, c.place.clock) == (figure, clock));
        let logs: Vec<f64> = of_it.map(|c| c.log).collect();
        let least = logs.iter().copied().fold(f64::INFINITY, f64::min);
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let square = logs.iter().map(|x| x.exp_m1().powi(2)).sum::<f64>() / logs.len() as f64;
        format!(
            "{figure}: times of {} with equal kernels and work moved by {:+.1} to {:+.1} % (root mean square {:.1} %)",
            plural(logs.len(), "cell"),
            100.0 * least.exp_m1(),
            100.0 * most.exp_m1(),
            100.0 * square.sqrt()
        )
        .replace('-', "−")
    }
}

/// Computes the spread of three known controls: their mean square is (0.1² + 0.1² + 0.2²) / 3 = 0.02, their rounds' 0.001, and what rounds have
/// beyond that is added.
///
/// # Errors
/// It is another: both values.
pub(crate) fn check() -> Result<(), String> {
    let place = Place {
        figure: String::new(),
        scene: String::new(),
        clock: "",
    };
    let mut drift = Drift::default();
    for log in [0.1, -0.1, 0.2] {
        drift.add(place.clone(), log, 0.001);
    }
    for (rounds, expected) in [(0.005, 0.024), (0.0005, 0.02)] {
        let found = drift.of(&place, rounds, None);
        let is_right =
            |s: Spread| (s.variance - expected).abs() < 1e-12 && (s.freedom - 3.0).abs() < 1e-12;
        if !found.is_some_and(is_right) {
            return Err(format!(
                "the drift of known controls is {found:?}, and should be {expected} with three degrees of freedom: this program compares \
                 times wrongly; build it anew, and report what stays wrong"
            ));
        }
    }
    Ok(())
}

/// Returns the mean square of the logarithms plus the excess noise of these rounds over those of controls.
fn spread(controls: &[&Control], own_rounds: f64, most_freedom: f64) -> Option<Spread> {
    let count = controls.len() as f64;
    let square = controls.iter().map(|c| c.log * c.log).sum::<f64>() / count;
    let rounds = controls.iter().map(|c| c.rounds).sum::<f64>() / count;
    (controls.len() >= LEAST_CONTROLS).then(|| Spread {
        variance: square + (own_rounds - rounds).max(0.0),
        freedom: count.min(most_freedom),
    })
}

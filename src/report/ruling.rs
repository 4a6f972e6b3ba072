//! Winners: named only where a test of the difference supports it.

use super::format;
use raystone_record::Interval;
use raystone_record::figure::Better;
use raystone_stats::comparison::{LogFigure, Pairs};

/// Names in an answer without a winner; the others are only counted.
const MOST_NAMES: usize = 5;

/// One competitor.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Contender {
    /// Its name.
    pub name: String,
    /// Its figure.
    pub figure: Interval,
    /// Its logarithm with its noise; absent where the spread is not known: then it is not ranked, neither as winner
    /// nor as beaten.
    pub log: Option<LogFigure>,
}

/// Judges two known cases, and the drift of known controls.
///
/// # Errors
/// The winner is another one: of which, and what to do.
pub fn check() -> Result<(), String> {
    use Better::{Higher, Lower};
    crate::compare::drift::check()?;
    // Three and five, known to a twentieth.
    let contender = |value: f64| {
        let figure = Interval {
            value,
            low: 0.95 * value,
            high: 1.05 * value,
        };
        Contender {
            name: value.to_string(),
            figure,
            log: LogFigure::of_interval(figure, 10.0),
        }
    };
    for (better, wins) in [(Higher, 5.0), (Lower, 3.0)] {
        let ruling = judge([3.0, 5.0].map(contender).into(), better);
        if !matches!(&ruling, Ruling::Winner(winner, ..) if winner.figure.value == wins) {
            return Err(format!(
                "of 3 and 5 the winner is {} where {better:?} is better: this program names wrong winners; build it anew, \
                 and report what stays wrong",
                ruling.answer()
            ));
        }
    }
    Ok(())
}

/// The outcome of a comparison of all with all.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Ruling {
    /// Nothing was measured.
    Nobody,
    /// There are figures that may not be ranked, for this reason.
    Withheld(String),
    /// There was no competition.
    Alone(Contender),
    /// The winner, the next one and the ratio of their figures, if both are positive: the winner differs from every other.
    /// Then the number of pairs compared.
    Winner(Contender, Contender, f64, usize),
    /// The best one and all that it does not differ from, best first, and the ratio of the first two. Then the number of
    /// pairs compared.
    Unclear(Vec<Contender>, f64, usize),
}

/// Ranks the contenders: the best one wins if it differs from every other by the test of their ratio on logarithms, corrected
/// for all pairs ([`Pairs`]). The pairs also decide which one is best, and by how much: figures timed in the same rounds are
/// known better against each other than by themselves.
pub(crate) fn judge(mut contenders: Vec<Contender>, better: Better) -> Ruling {
    contenders.retain(|c| c.figure.value.is_finite());
    if let [only] = &contenders[..] {
        return Ruling::Alone(only.clone());
    }
    let measured = contenders.len();
    let (mut contenders, mut logs): (Vec<Contender>, Vec<LogFigure>) = contenders
        .into_iter()
        .filter_map(|mut c| c.log.take().map(|log| (c, log)))
        .unzip();
    if contenders.is_empty() {
        return match measured {
            0 => Ruling::Nobody,
            _ => Ruling::Withheld(
                "too few measurements to know their spread, or intervals that are not to be trusted"
                    .into(),
            ),
        };
    }
    if better == Better::Higher {
        logs = logs.iter().map(LogFigure::inverse).collect();
    }
    let pairs = Pairs::of(&logs.iter().collect::<Vec<_>>());
    let best = pairs.least().unwrap_or(0);
    let mut others: Vec<usize> = (0..logs.len()).filter(|i| *i != best).collect();
    others.sort_by(|a, b| {
        pairs
            .log_ratio(*a, best)
            .total_cmp(&pairs.log_ratio(*b, best))
    });
    let is_close = |i: &&usize| !(pairs.differ(best, **i) && pairs.log_ratio(**i, best) > 0.0);
    let close: Vec<usize> = others.iter().filter(is_close).copied().collect();
    let count = pairs.count();
    let ratio = |i: usize| pairs.log_ratio(i, best).abs().exp();
    match (&close[..], &others[..]) {
        (_, []) => Ruling::Alone(contenders.swap_remove(best)),
        ([], [next, ..]) => {
            let [winner, second] = [best, *next].map(|i| contenders[i].clone());
            Ruling::Winner(winner, second, ratio(*next), count)
        }
        ([next, ..], _) => {
            let named = std::iter::once(&best).chain(&close);
            let named = named.map(|i| contenders[*i].clone()).collect();
            Ruling::Unclear(named, ratio(*next), count)
        }
    }
}

impl Ruling {
    /// Returns the answer: a name, or why there is none.
    pub(crate) fn answer(&self) -> String {
        match self {
            Self::Nobody => "nothing measured".into(),
            Self::Withheld(reason) => format!("no winner: {reason}"),
            Self::Alone(only) => format!("{} (alone)", only.name),
            Self::Winner(best, ..) => best.name.clone(),
            Self::Unclear(close, ..) => {
                let names: Vec<&str> = close.iter().map(|c| c.name.as_str()).collect();
                let shown = &names[..names.len().min(MOST_NAMES)];
                let more = match names.len() - shown.len() {
                    0 => String::new(),
                    more => format!(" and {more} more"),
                };
                format!("undecided: {}{more}", shown.join(", "))
            }
        }
    }

    /// Returns `true` if there was any competition: two contenders, or a reason that none may win.
    pub(crate) fn is_contest(&self) -> bool {
        !matches!(self, Self::Nobody | Self::Alone(_))
    }

    /// Returns the best figure.
    pub(crate) fn figure(&self) -> String {
        match self {
            Self::Nobody | Self::Withheld(_) => format::ABSENT.into(),
            Self::Alone(best) | Self::Winner(best, ..) => format::interval(&best.figure),
            Self::Unclear(close, ..) => close
                .first()
                .map_or(format::ABSENT.into(), |c| format::interval(&c.figure)),
        }
    }

    /// Returns the next one with its figure and, of positive figures, the ratio of the two.
    pub(crate) fn runner_up(&self) -> String {
        let (best, next, ratio) = match self {
            Self::Winner(best, next, ratio, _) => (best, next, ratio),
            Self::Unclear(close, ratio, _) if close.len() > 1 => (&close[0], &close[1], ratio),
            _ => return format::ABSENT.into(),
        };
        let text = format!("{} {}", next.name, format::interval(&next.figure));
        if best.figure.value <= 0.0 || next.figure.value <= 0.0 {
            return text;
        }
        format!("{text} ({}×)", format::number(*ratio))
    }

    /// Returns the number of pairs compared.
    pub(crate) fn comparisons(&self) -> usize {
        match self {
            Self::Nobody | Self::Withheld(_) | Self::Alone(_) => 0,
            Self::Winner(.., pairs) | Self::Unclear(.., pairs) => *pairs,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_stats::interval::Spread;

    /// Returns the verdict on contenders with these figures, relative standard errors and known spreads, called a, b,
    /// c.
    fn said(better: Better, figures: &[(f64, f64, bool)]) -> [String; 3] {
        let contenders = figures.iter().zip(["a", "b", "c"]);
        let contenders = contenders.map(|((value, error, has_spread), name)| {
            let log = LogFigure::exact(*value).with_noise(Some(Spread {
                variance: error * error,
                freedom: 15.0,
            }));
            Contender {
                name: name.into(),
                figure: log.interval(),
                log: has_spread.then_some(log),
            }
        });
        let ruling = judge(contenders.collect(), better);
        [ruling.answer(), ruling.figure(), ruling.runner_up()]
    }

    #[test]
    fn a_winner_is_named_only_where_the_difference_is_clear_and_spreads_are_known() {
        use Better::{Higher, Lower};
        let answers = [
            (Higher, &[(3.0, 0.05, true), (5.0, 0.05, true)][..], "b"),
            (
                Higher,
                &[(3.0, 0.5, true), (5.0, 0.2, true)],
                "undecided: b, a",
            ),
            // Intervals that overlap, and a difference that is clear all the same.
            (Lower, &[(1.0, 0.05, true), (1.2, 0.05, true)], "a"),
            // A third that does not differ from the best spoils the win.
            (
                Lower,
                &[(1.0, 0.1, true), (2.0, 0.05, true), (3.0, 1.5, true)],
                "undecided: a, c",
            ),
            // Three pairs need more than one: a difference significant for two is not for three.
            (
                Lower,
                &[(1.0, 0.055, true), (1.2, 0.055, true), (1.2, 0.055, true)],
                "undecided: a, b, c",
            ),
            (
                Lower,
                &[(2.0, 0.0, true), (2.0, 0.0, true)],
                "undecided: a, b",
            ),
            (Lower, &[(1.0, 0.1, true)], "a (alone)"),
            (Lower, &[], "nothing measured"),
            // Without spread nobody wins or is beaten.
            (
                Lower,
                &[(1.0, 0.0, false), (8.0, 0.01, true), (9.0, 0.01, true)],
                "b",
            ),
            (Lower, &[(1.0, 0.0, false), (9.0, 0.1, true)], "b (alone)"),
            // An error that is exactly 0.
            (Lower, &[(0.0, 0.0, true), (9.0, 0.1, true)], "a"),
        ];
        for (better, figures, answer) in answers {
            assert_eq!(said(better, figures)[0], answer, "{figures:?}");
        }
        // One has no need of a spread: there is nobody to be compared with.
        assert_eq!(said(Lower, &[(1.0, 0.0, false)])[0], "a (alone)");
        let [answer, figure, next] = said(Lower, &[(1.0, 0.0, false), (2.0, 0.0, false)]);
        assert!(answer.starts_with("no winner: "), "{answer}");
        assert_eq!([figure, next], ["–", "–"]);
        // Errors of nothing have no ratio.
        let next = |figures: &[_]| said(Lower, figures)[2].clone();
        assert_eq!(next(&[(0.0, 0.0, true), (0.0, 0.0, true)]), "b 0");
        assert_eq!(
            next(&[(1.0, 0.0, true), (2.0, 0.0, true)]),
            "b 2.00 (2.00×)"
        );
    }
}

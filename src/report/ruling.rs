//! Who wins: named only where the intervals are apart.

use super::format;
use crate::measure::figure::Better;
use crate::measure::record::Interval;

/// Names in an answer without a winner; the others are only counted.
const MOST_NAMES: usize = 5;

/// One competitor.
#[derive(Debug, Clone, PartialEq)]
pub struct Contender {
    /// Its name.
    pub name: String,
    /// Its figure.
    pub figure: Interval,
    /// Whether the spread is known; without it it is not ranked, neither as winner nor as beaten.
    pub has_spread: bool,
}

/// The outcome of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub enum Ruling {
    /// Nothing was measured.
    Nobody,
    /// There are figures that may not be ranked, for this reason.
    Withheld(String),
    /// There was no competition.
    Alone(Contender),
    /// The winner and the next one, whose intervals are apart.
    Winner(Contender, Contender),
    /// All whose intervals overlap the best one's, best first.
    Unclear(Vec<Contender>),
}

/// Judges the contenders.
pub fn judge(mut contenders: Vec<Contender>, better: Better) -> Ruling {
    contenders.retain(|c| c.figure.value.is_finite());
    let measured = contenders.len();
    contenders.retain(|c| c.has_spread);
    if contenders.is_empty() && measured > 0 {
        return Ruling::Withheld("too few measurements to know their spread".into());
    }
    contenders.sort_by(|a, b| {
        let by_value = a.figure.value.total_cmp(&b.figure.value);
        if better == Better::Higher {
            by_value.reverse()
        } else {
            by_value
        }
    });
    let Some(best) = contenders.first().cloned() else {
        return Ruling::Nobody;
    };
    let close: Vec<Contender> = contenders[1..]
        .iter()
        .filter(|c| !best.figure.is_apart_from(&c.figure))
        .cloned()
        .collect();
    match contenders.get(1) {
        None => Ruling::Alone(best),
        Some(next) if close.is_empty() => Ruling::Winner(best, next.clone()),
        Some(_) => Ruling::Unclear(std::iter::once(best).chain(close).collect()),
    }
}

impl Ruling {
    /// The answer: a name, or why there is none.
    pub fn answer(&self) -> String {
        match self {
            Self::Nobody => "nothing measured".into(),
            Self::Withheld(reason) => format!("no winner: {reason}"),
            Self::Alone(only) => format!("{} (alone)", only.name),
            Self::Winner(best, _) => best.name.clone(),
            Self::Unclear(close) => {
                let names: Vec<&str> = close.iter().map(|c| c.name.as_str()).collect();
                let shown = &names[..names.len().min(MOST_NAMES)];
                let more = match names.len() - shown.len() {
                    0 => String::new(),
                    more => format!(" and {more} more"),
                };
                format!("no clear winner: {}{more}", shown.join(", "))
            }
        }
    }

    /// The best figure.
    pub fn figure(&self) -> String {
        match self {
            Self::Nobody | Self::Withheld(_) => format::ABSENT.into(),
            Self::Alone(best) | Self::Winner(best, _) => format::interval(&best.figure),
            Self::Unclear(close) => close
                .first()
                .map_or(format::ABSENT.into(), |c| format::interval(&c.figure)),
        }
    }

    /// The next one with its figure and, of positive figures, the ratio of the two.
    pub fn runner_up(&self) -> String {
        let (best, next) = match self {
            Self::Winner(best, next) => (best, next),
            Self::Unclear(close) if close.len() > 1 => (&close[0], &close[1]),
            _ => return format::ABSENT.into(),
        };
        let text = format!("{} {}", next.name, format::interval(&next.figure));
        if best.figure.value <= 0.0 || next.figure.value <= 0.0 {
            return text;
        }
        let ratio = best.figure.value / next.figure.value;
        format!("{text} ({}×)", format::number(ratio.max(1.0 / ratio)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contender(name: &str, value: f64, half: f64) -> Contender {
        let figure = Interval {
            value,
            low: value - half,
            high: value + half,
        };
        Contender {
            name: name.into(),
            figure,
            has_spread: true,
        }
    }

    /// What is said of contenders with these figures, half intervals and spreads, called a, b, c.
    fn said(better: Better, figures: &[(f64, f64, bool)]) -> [String; 3] {
        let contenders = figures.iter().zip(["a", "b", "c"]);
        let contenders = contenders.map(|((value, half, has_spread), name)| Contender {
            has_spread: *has_spread,
            ..contender(name, *value, *half)
        });
        let ruling = judge(contenders.collect(), better);
        [ruling.answer(), ruling.figure(), ruling.runner_up()]
    }

    #[test]
    fn a_winner_is_named_only_where_intervals_are_apart_and_known() {
        use Better::{Higher, Lower};
        let answers = [
            (Higher, &[(3.0, 0.5, true), (5.0, 0.5, true)][..], "b"),
            (
                Higher,
                &[(3.0, 1.5, true), (5.0, 0.6, true)],
                "no clear winner: b, a",
            ),
            // A third that overlaps the best spoils the win.
            (
                Lower,
                &[(1.0, 0.1, true), (2.0, 0.1, true), (3.0, 2.5, true)],
                "no clear winner: a, c",
            ),
            (
                Lower,
                &[(2.0, 0.0, true), (2.0, 0.0, true)],
                "no clear winner: a, b",
            ),
            (Lower, &[(1.0, 0.1, true)], "a (alone)"),
            (Lower, &[], "nothing measured"),
            // Without spread nobody wins or is beaten.
            (
                Lower,
                &[(1.0, 0.0, false), (8.0, 0.1, true), (9.0, 0.1, true)],
                "b",
            ),
            (Lower, &[(1.0, 0.0, false), (9.0, 0.1, true)], "b (alone)"),
        ];
        for (better, figures, answer) in answers {
            assert_eq!(said(better, figures)[0], answer, "{figures:?}");
        }
        let [answer, figure, next] = said(Lower, &[(1.0, 0.0, false)]);
        assert!(answer.starts_with("no winner: "), "{answer}");
        assert_eq!([figure, next], ["–", "–"]);
        // Errors of nothing have no ratio.
        let next = |figures: &[_]| said(Lower, figures)[2].clone();
        assert_eq!(next(&[(0.0, 0.0, true), (0.0, 0.0, true)]), "b 0");
        let below = [(-1.0, 0.1, true), (2.0, 0.1, true)];
        assert_eq!(next(&below), "b 2.00 [1.90, 2.10]");
    }

    #[test]
    fn among_equals_a_winner_is_rare() {
        use crate::measure::statistics::mean_interval;
        use crate::random::Pcg32;
        let mut generator = Pcg32::new(21);
        let wins = (0..300).filter(|_| {
            let mut figure = || {
                let mut normal = || 20.0 + (0..12).map(|_| generator.uniform()).sum::<f64>();
                let samples: Vec<f64> = (0..8).map(|_| normal()).collect();
                mean_interval(&samples).unwrap()
            };
            let mut equals: Vec<Contender> = Vec::new();
            for i in 0..10 {
                let figure = figure();
                equals.push(Contender {
                    figure,
                    ..contender(&i.to_string(), 0.0, 0.0)
                });
            }
            matches!(judge(equals, Better::Lower), Ruling::Winner(..))
        });
        let wins = wins.count();
        assert!(wins <= 3, "{wins} winners in 300 draws of ten equals");
    }
}

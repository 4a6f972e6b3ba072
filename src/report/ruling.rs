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

    #[test]
    fn a_winner_is_named_only_where_intervals_are_apart() {
        let apart = vec![contender("slow", 3.0, 0.5), contender("fast", 5.0, 0.5)];
        assert_eq!(judge(apart, Better::Higher).answer(), "fast");
        let close = vec![contender("slow", 3.0, 1.5), contender("fast", 5.0, 0.6)];
        assert_eq!(
            judge(close, Better::Higher).answer(),
            "no clear winner: fast, slow"
        );
    }

    #[test]
    fn a_third_that_overlaps_the_best_spoils_the_win() {
        let wide = vec![
            contender("a", 1.0, 0.1),
            contender("b", 2.0, 0.1),
            contender("c", 3.0, 2.5),
        ];
        assert_eq!(judge(wide, Better::Lower).answer(), "no clear winner: a, c");
    }

    #[test]
    fn without_spread_nobody_wins_or_is_beaten() {
        let mut three = vec![
            contender("a", 1.0, 0.0),
            contender("b", 8.0, 0.1),
            contender("c", 9.0, 0.1),
        ];
        assert_eq!(judge(three.clone(), Better::Lower).answer(), "a");
        three[0].has_spread = false;
        assert_eq!(judge(three.clone(), Better::Lower).answer(), "b");
        three[1].has_spread = false;
        assert_eq!(judge(three.clone(), Better::Lower).answer(), "c (alone)");
        three[2].has_spread = false;
        let nobody = judge(three, Better::Lower);
        assert!(nobody.answer().starts_with("no winner: "), "{nobody:?}");
        assert_eq!(
            (nobody.figure(), nobody.runner_up()),
            ("–".into(), "–".into())
        );
    }

    #[test]
    fn ties_have_no_winner_and_errors_of_nothing_no_ratio() {
        let tie = vec![contender("a", 2.0, 0.0), contender("b", 2.0, 0.0)];
        assert_eq!(judge(tie, Better::Lower).answer(), "no clear winner: a, b");
        let exact = vec![contender("a", 0.0, 0.0), contender("b", 0.0, 0.0)];
        assert_eq!(judge(exact, Better::Lower).runner_up(), "b 0");
        let below = vec![contender("a", -1.0, 0.1), contender("b", 2.0, 0.1)];
        let next = judge(below, Better::Lower).runner_up();
        assert_eq!(next, "b 2.00 [1.90, 2.10]");
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

    #[test]
    fn nobody_and_somebody_alone_are_said_so() {
        assert_eq!(judge(vec![], Better::Lower).answer(), "nothing measured");
        assert_eq!(
            judge(vec![contender("a", 1.0, 0.1)], Better::Lower).answer(),
            "a (alone)"
        );
    }
}

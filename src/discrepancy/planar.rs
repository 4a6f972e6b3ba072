//! Exact star discrepancy in two dimensions: a kinetic tournament over y, computed as a whole.
//!
//! Let a vertical line sweep over x. Of all closed boxes that end at it, the box of height y has
//! `count(y) - N·x·y` points too many: a line in x, moved up by 1 whenever the sweep passes a point
//! at or below y. A balanced tree over y plays a tournament for the highest line: a node knows its
//! winner at every x, and a point passed in the left half of a node lifts all lines of its right
//! half by the same 1. A kinetic segment tree would advance all nodes together with x; here each
//! node computes the whole *history* of its winner from those of its halves, by one merge. All
//! memory is read and written in order, and the nodes of one level have about N stretches in total.
//!
//! Boxes with too few points are the same tournament with a reversed sweep: the line of the open
//! box of height y is `N·x·y - count(y)`, and a point that the sweep leaves lifts it by 1.

/// A stretch of the sweep on which one line wins: from `start` to that of the next stretch.
#[derive(Clone, Copy)]
struct Stretch {
    start: f64,
    /// The line is `count - slope·x`.
    slope: f64,
    count: i32,
    /// Lift of the lines in later halves by the points of this half.
    lift: i32,
}

impl Stretch {
    #[inline]
    fn at(&self, x: f64) -> f64 {
        f64::from(self.count) - self.slope * x
    }
}

/// Largest difference between area and fraction of points over all boxes at the origin.
///
/// Needs a non-empty set of points in the unit square; ties, duplicates, 0 and 1 are allowed.
pub(super) fn star(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let mut by_y = points.to_vec();
    by_y.sort_unstable_by(|p, q| p[1].total_cmp(&q[1]));

    // For equal y, the last line has the correct closed count and the first the correct open count;
    // the others stay below the true value.
    let mut lines: Vec<Line> = by_y.iter().map(|&[x, y]| Line::new(x, n * y)).collect();
    let forwards = Tournament {
        sweep: [0.0, 1.0],
        own: 1,
    };
    let many = forwards.height(&lines);

    for (line, [x, _]) in lines.iter_mut().zip(&by_y) {
        line.event = -x;
    }
    lines.push(Line::new(-1.0, n)); // the boxes of height 1, with no point above them
    let backwards = Tournament {
        sweep: [-1.0, 0.0],
        own: 0,
    };
    let few = backwards.height(&lines);
    many.max(few) / n
}

/// A line and the position where the sweep meets its point.
struct Line {
    event: f64,
    slope: f64,
}

impl Line {
    fn new(event: f64, slope: f64) -> Self {
        Self { event, slope }
    }
}

struct Tournament {
    /// First and last position of the sweep.
    sweep: [f64; 2],
    /// 1 if a point lifts its own line, 0 if only those after it.
    own: i32,
}

impl Tournament {
    /// Height of the highest line at the events, lines in the order of their slopes.
    fn height(&self, lines: &[Line]) -> f64 {
        let (mut history, mut other) = (Vec::new(), Vec::new());
        self.run(lines, &mut history, &mut other);
        // All lines fall between two events, so every stretch is highest at its start.
        history
            .iter()
            .fold(f64::MIN, |top, s| larger(top, s.at(s.start)))
    }

    /// Appends the history of these lines to `out`; `other` is scratch memory.
    fn run(&self, lines: &[Line], out: &mut Vec<Stretch>, other: &mut Vec<Stretch>) {
        if let [line] = lines {
            let begin = out.len();
            push(out, begin, line.stretch(self.sweep[0], 0, self.own - 1));
            push(out, begin, line.stretch(line.event, self.own, self.own));
            return;
        }
        let (lower, upper) = lines.split_at(lines.len() / 2);
        let begin = other.len();
        self.run(lower, other, out);
        let middle = other.len();
        self.run(upper, other, out);
        self.merge(&other[begin..middle], &other[middle..], out);
        other.truncate(begin);
    }

    /// Merges the winners of a lower and an upper half. Lower lines fall more slowly: without an
    /// event in either half, only the lower winner can overtake.
    fn merge(&self, lower: &[Stretch], upper: &[Stretch], out: &mut Vec<Stretch>) {
        let begin = out.len();
        let (mut i, mut j) = (0, 0);
        let mut start = self.sweep[0];
        let start_of =
            |half: &[Stretch], at: usize| half.get(at).map_or(f64::INFINITY, |s| s.start);
        let (mut next_lower, mut next_upper) = (start_of(lower, 1), start_of(upper, 1));
        loop {
            let lift = lower[i].lift + upper[j].lift;
            let a = Stretch {
                start,
                lift,
                ..lower[i]
            };
            let b = Stretch {
                start,
                lift,
                count: upper[j].count + lower[i].lift,
                ..upper[j]
            };
            let next = if next_lower < next_upper {
                next_lower
            } else {
                next_upper
            };
            if b.at(start) > a.at(start) {
                push(out, begin, b);
                let end = if next < self.sweep[1] {
                    next
                } else {
                    self.sweep[1]
                };
                if a.at(end) > b.at(end) {
                    let meet = f64::from(b.count - a.count) / (b.slope - a.slope);
                    let start = meet.clamp(start, end);
                    push(out, begin, Stretch { start, ..a });
                }
            } else {
                push(out, begin, a);
            }
            if next == f64::INFINITY {
                return;
            }
            start = next;
            if next_lower == next {
                i += 1;
                next_lower = start_of(lower, i + 1);
            }
            if next_upper == next {
                j += 1;
                next_upper = start_of(upper, j + 1);
            }
        }
    }
}

impl Line {
    fn stretch(&self, start: f64, count: i32, lift: i32) -> Stretch {
        let slope = self.slope;
        Stretch {
            start,
            slope,
            count,
            lift,
        }
    }
}

/// Adds a stretch to the history that begins at index `begin`: it replaces a stretch of zero
/// length, and is dropped if it continues the last one.
#[inline]
fn push(history: &mut Vec<Stretch>, begin: usize, next: Stretch) {
    if let Some(last) = history[begin..].last_mut() {
        if last.start == next.start {
            *last = next;
            return;
        }
        if (last.count, last.lift) == (next.count, next.lift) && last.slope == next.slope {
            return;
        }
    }
    history.push(next);
}

/// Maximum of two numbers that are never NaN: one instruction, where `f64::max` takes several.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

//! Winners, Pareto fronts and stopping rules against simulations of known truth.

use raystone::config::StopRule;
use raystone::measure::comparison::*;
use raystone::measure::interval::{Interval, Spread};
use raystone::measure::statistics::{leave_one_out, mean, variance};
use raystone::measure::stopping::is_met;
use raystone::random::Pcg32;

/// Approximately normal, mean 0, variance 1.
fn normal(generator: &mut Pcg32) -> f64 {
    (0..12).map(|_| generator.uniform()).sum::<f64>() - 6.0
}

fn mean_of(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

fn of_mean(samples: &[f64]) -> LogFigure {
    let logs = leave_one_out(samples).map(|rest| mean_of(&rest).ln());
    LogFigure::new(mean_of(samples).ln(), &[logs.collect()], Vec::new()).unwrap()
}

/// The mean error of replicates: log-normal, standard deviation about `spread` times the mean.
fn error(mean: f64, spread: f64, replicates: usize, g: &mut Pcg32) -> LogFigure {
    let mut draw = || mean * (spread * normal(g) - 0.5 * spread * spread).exp();
    of_mean(&(0..replicates).map(|_| draw()).collect::<Vec<_>>())
}

/// Seven times, each interrupted with a probability of one tenth.
fn times(median: f64, g: &mut Pcg32) -> Vec<f64> {
    let mut draw = || {
        let late = if g.uniform() < 0.1 { 1.5 } else { 1.0 };
        median * late * (0.02 * normal(g)).exp()
    };
    (0..7).map(|_| draw()).collect()
}

fn efficiency(error: LogFigure, time: &LogFigure) -> LogFigure {
    error.with_noise_of(time, 1.0).scaled(time.log.exp())
}

/// True if the smallest of some figures differs from all others.
fn has_winner(figures: &[LogFigure], differ: impl Fn(usize, usize) -> bool) -> bool {
    let least = (0..figures.len()).min_by(|a, b| figures[*a].log.total_cmp(&figures[*b].log));
    (0..figures.len()).all(|i| Some(i) == least || differ(least.unwrap(), i))
}

#[test]
fn among_equals_a_difference_is_named_as_rarely_as_promised() {
    let trials = 1000;
    for replicates in [4, 16] {
        let mut generator = Pcg32::new(61);
        let (mut corrected, mut plain, mut winners) = (0, 0, 0);
        for _ in 0..trials {
            let g = &mut generator;
            let figures: Vec<LogFigure> = (0..5)
                .map(|_| {
                    let time = LogFigure::of_times(&times(10.0, g)).unwrap();
                    efficiency(error(1.0, 0.1, replicates, g), &time)
                })
                .collect();
            let pairs = Pairs::of(&figures.iter().collect::<Vec<_>>());
            assert_eq!(pairs.count(), 10);
            let all = || (0..5).flat_map(|i| (0..i).map(move |j| (i, j)));
            corrected += usize::from(all().any(|(i, j)| pairs.differ(i, j)));
            let is_small = |(i, j): (usize, usize)| figures[i].compared_with(&figures[j]).p <= 0.05;
            plain += usize::from(all().any(is_small));
            winners += usize::from(has_winner(&figures, |i, j| pairs.differ(i, j)));
        }
        println!(
            "{replicates}: {corrected} corrected, {plain} plain, {winners} winners in {trials}"
        );
        // 5 % is 50, and the standard deviation 7.
        assert!(corrected <= 70, "{replicates}: {corrected}");
        assert!(winners <= 15, "{replicates}: {winners}");
        // Negative control: the tests without the correction.
        assert!(plain > 150, "{replicates}: {plain}");
    }
}

#[test]
fn a_time_taken_as_exact_makes_winners_of_equals() {
    let mut generator = Pcg32::new(62);
    let trials = 500;
    let (mut joined, mut median_alone) = (0, 0);
    for _ in 0..trials {
        let g = &mut generator;
        // Errors are known precisely, times are not.
        let mut pair = || {
            let time = LogFigure::of_times(&times(10.0, g)).unwrap();
            let error = error(1.0, 0.01, 16, g);
            let exact = error.clone().scaled(time.log.exp());
            [efficiency(error, &time), exact]
        };
        let (a, b) = (pair(), pair());
        joined += usize::from(a[0].compared_with(&b[0]).p <= 0.05);
        median_alone += usize::from(a[1].compared_with(&b[1]).p <= 0.05);
    }
    println!("{joined} with both, {median_alone} with errors alone, of {trials}");
    assert!(joined <= 40, "{joined}");
    assert!(median_alone > 150, "{median_alone}");
}

#[test]
fn a_sampler_that_is_a_fifth_better_wins_although_intervals_overlap() {
    let mut generator = Pcg32::new(63);
    let trials = 300;
    let (mut wins, mut apart) = (0, 0);
    for _ in 0..trials {
        let g = &mut generator;
        let figures = [0.8, 1.0, 1.0].map(|mean| error(mean, 0.15, 16, g));
        let pairs = Pairs::of(&figures.each_ref());
        wins += usize::from(has_winner(&figures, |i, j| pairs.differ(i, j)) && pairs.differ(0, 1));
        let ends = figures.each_ref().map(LogFigure::interval);
        apart += usize::from(ends[1..].iter().all(|other| ends[0].high < other.low));
    }
    println!("{wins} by the test, {apart} by intervals apart, of {trials}");
    assert!(wins > trials * 8 / 10, "{wins}");
    assert!(wins > apart, "{wins}, {apart} by intervals");
}

#[test]
fn an_interruption_moves_no_time() {
    let calm = LogFigure::of_times(&[1.0, 1.01, 0.99, 1.0, 1.02, 0.98, 1.0]).unwrap();
    let hit = LogFigure::of_times(&[1.0, 1.01, 0.99, 1.0, 90.0, 0.98, 1.0]).unwrap();
    assert!((calm.log - hit.log).abs() < 0.005, "{calm:?} {hit:?}");
    assert!(hit.spread().variance < 4.0 * calm.spread().variance);
    assert_eq!(calm.spread().freedom, 4.0);
    assert_eq!(LogFigure::of_times(&[1.0]), None);
    assert_eq!(LogFigure::of_times(&[0.0, 1.0, 1.0]), None);
}

#[test]
fn intervals_of_times_and_of_errors_per_second_cover_the_truth() {
    let mut generator = Pcg32::new(64);
    let trials = 2000;
    let mut covered = [0; 2];
    let mut narrowed = 0;
    for _ in 0..trials {
        let g = &mut generator;
        let even: Vec<f64> = (0..9).map(|_| 10.0 * (0.05 * normal(g)).exp()).collect();
        let time = LogFigure::of_times(&even).unwrap();
        let figures = [time.clone(), efficiency(error(2.0, 0.3, 8, g), &time)];
        for ((count, figure), truth) in covered.iter_mut().zip(&figures).zip([10.0, 20.0]) {
            let interval = figure.interval();
            *count += usize::from(interval.low <= truth && truth <= interval.high);
        }
        let half = 0.6 * (figures[1].interval().high / figures[1].interval().value).ln();
        narrowed += usize::from((figures[1].log - 20f64.ln()).abs() <= half);
    }
    println!("{covered:?} of {trials}");
    for count in covered {
        let share = count as f64 / trials as f64;
        assert!((0.93..=0.97).contains(&share), "{covered:?}");
    }
    // Negative control.
    assert!(narrowed < trials * 85 / 100, "{narrowed}");
}

fn known(value: f64, error: f64) -> LogFigure {
    LogFigure::exact(value).with_noise(Some(Spread {
        variance: error * error,
        freedom: 15.0,
    }))
}

#[test]
fn a_point_is_on_the_front_or_beaten_only_where_that_is_clear() {
    let point = |time: f64, error: f64| [known(time, 0.02), known(error, 0.02)];
    let slower = |time: f64, of: &[LogFigure; 2]| [known(time, 0.02), of[1].clone()];
    let best = point(1.0, 4.0);
    let points = [
        best.clone(),
        // As good, through a slower structure.
        slower(1.5, &best),
        // As good, through one with nearly the same time.
        slower(1.01, &best),
        point(4.0, 1.0),
        point(5.0, 2.0),
        // Faster than the fourth within the noise.
        point(3.95, 1.01),
    ];
    use Place::{Beaten, Front, Open};
    assert_eq!(places(&points), [Open, Beaten, Open, Open, Beaten, Open]);
    let clear = [point(1.0, 4.0), point(4.0, 1.0), point(2.0, 2.0)];
    assert_eq!(places(&clear), [Front; 3]);
    assert_eq!(places(&clear[..1]), [Front]);
    assert!(places(&[]).is_empty());
}

#[test]
fn what_is_said_of_a_point_is_as_rarely_wrong_as_promised() {
    let mut generator = Pcg32::new(65);
    let trials = 1000;
    // The first and last points are equal in error and in time: neither beats the other.
    let (mut false_beaten, mut false_front, mut by_value) = (0, 0, 0);
    for _ in 0..trials {
        let g = &mut generator;
        let mut point = |time: f64, mean: f64| {
            [
                LogFigure::of_times(&times(time, g)).unwrap(),
                error(mean, 0.1, 16, g),
            ]
        };
        let on_front = [point(1.0, 1.0), point(1.0, 1.0), point(2.0, 0.5)];
        false_beaten += usize::from(places(&on_front)[0] == Place::Beaten);
        // Truly beaten, but by so little that it is seldom detected.
        let behind = [point(1.001, 1.005), point(1.0, 1.0)];
        let found = places(&behind);
        false_front += usize::from(found[0] == Place::Front);
        let is_less = |k: usize| behind[0][k].log < behind[1][k].log;
        by_value += usize::from(is_less(0) || is_less(1));
    }
    println!("{false_beaten} beaten, {false_front} on the front, {by_value} by value, of {trials}");
    assert!(
        false_beaten <= 70 && false_front <= 70,
        "{false_beaten} {false_front}"
    );
    // Negative control: the front of the measured values.
    assert!(by_value > trials / 2, "{by_value}");
}

const RULE: StopRule = StopRule {
    tile: None,
    relmse: 1.0,
    confidence: 0.95,
};

/// The look at which a cell ends whose error falls as 1/samples from `first` on; replicates
/// accumulate samples, so looks are correlated. Also the look for `chance` at each look.
fn ends_at(first: f64, replicates: usize, looks: usize, g: &mut Pcg32) -> [Option<usize>; 2] {
    let mut sums = vec![0.0; replicates];
    let mut samples = 0;
    let mut ends = [None; 2];
    for look in 0..looks {
        while samples < 1 << look {
            samples += 1;
            // χ² with four degrees of freedom: the squared error of few pixels.
            for sum in &mut sums {
                *sum += (0..4).map(|_| normal(g).powi(2)).sum::<f64>() / 4.0;
            }
        }
        let scale = first / f64::from(samples) / f64::from(samples);
        let errors: Vec<f64> = sums.iter().map(|sum| sum * scale).collect();
        let error = of_mean(&errors);
        for (end, looks) in ends.iter_mut().zip([looks, 1]) {
            if end.is_none() && is_met(&RULE, &error, looks) {
                *end = Some(look);
            }
        }
    }
    ends
}

#[test]
fn a_cell_that_ends_has_its_target_as_often_as_promised_however_often_it_was_looked_at() {
    let mut generator = Pcg32::new(66);
    let trials = 1500;
    for replicates in [4, 16] {
        // The hardest case: the error is slightly above the target at the last look.
        let above = 1.001 * 2f64.powi(5);
        let ends = |g: &mut Pcg32| ends_at(above, replicates, 6, g);
        let wrong = (0..trials).filter(|_| ends(&mut generator)[0].is_some());
        let wrong = wrong.count();
        println!("{replicates}: {wrong} of {trials} end too early");
        assert!(wrong <= trials * 6 / 100, "{replicates}: {wrong}");
    }
    // Errors near the target at several looks, as from nested samples: each look has its own
    // chance, and divided among them they preserve the total.
    let mut chances = [0; 2];
    for _ in 0..trials {
        let mut met = [false; 2];
        for _ in 0..6 {
            let error = error(1.001, 0.3, 16, &mut generator);
            met[0] |= is_met(&RULE, &error, 6);
            met[1] |= is_met(&RULE, &error, 1);
        }
        chances[0] += usize::from(met[0]);
        chances[1] += usize::from(met[1]);
    }
    println!("{chances:?} of {trials}: shared out, and each look by itself");
    assert!(chances[0] <= trials * 6 / 100, "{chances:?}");
    // Negative control: the full confidence at each look.
    assert!(chances[1] > trials * 12 / 100, "{chances:?}");
}

#[test]
fn a_cell_with_room_to_its_target_ends_and_its_error_is_hardly_too_small() {
    let mut generator = Pcg32::new(67);
    let trials = 400;
    let mut ended = [0; 6];
    for _ in 0..trials {
        if let Some(look) = ends_at(4.0, 16, 6, &mut generator)[0] {
            ended[look] += 1;
        }
    }
    println!("ended at look {ended:?}");
    // The target is met exactly at the third look, so the fourth, with half the error, ends it.
    assert!(ended[3] > trials * 8 / 10, "{ended:?}");
    assert!(ended[0] + ended[1] == 0, "{ended:?}");
}

fn interval(low: f64, value: f64, high: f64) -> Interval {
    Interval { value, low, high }
}

fn summary(low: f64, value: f64, high: f64) -> LogFigure {
    LogFigure::of_interval(interval(low, value, high), f64::INFINITY).expect("a figure")
}

#[test]
fn a_ratio_of_intervals_has_its_side_up_and_the_spread_of_both_sides() {
    let r = summary(1.8, 2.0, 2.2)
        .compared_with(&summary(0.9, 1.0, 1.1))
        .ratio;
    assert!((r.value - 2.0).abs() < 1e-12);
    // Each side alone has a lower end 10 % down; together √2 of that (Zou and Donner 2008).
    let down = (f64::ln(2.0 / 1.8).powi(2) + f64::ln(1.1f64).powi(2)).sqrt();
    assert!((r.low - (2f64.ln() - down).exp()).abs() < 1e-12, "{r:?}");
    assert!(r.low > 1.8 / 1.1 && r.low < 1.8 && r.high > 2.2);
    let exact = |x: f64| summary(x, x, x);
    let ratio = |a: &LogFigure, b: &LogFigure| a.compared_with(b).ratio;
    // Exact figures stay exact, to the last digit.
    for (a, b) in [(3.0, 2.0), (30.0, 10.0), (7.0, 49.0), (0.0, 3.0)] {
        assert_eq!(ratio(&exact(a), &exact(b)), Interval::exact(a / b));
    }
    // An error whose interval reaches 0 has a ratio that is unbounded below.
    let open = ratio(&summary(0.0, 1.0, 2.0), &exact(1.0));
    assert_eq!(open.low, 0.0);
    assert!((open.high - 2.0).abs() < 1e-12);
    let above = ratio(&exact(1.0), &summary(0.0, 1.0, 2.0));
    assert!((above.low - 0.5).abs() < 1e-12 && above.high == f64::INFINITY);
    for bad in [
        interval(-2.0, -1.0, 0.0),
        interval(0.0, 0.0, 1.0),
        interval(2.0, 1.0, 3.0),
    ] {
        assert_eq!(LogFigure::of_interval(bad, 8.0), None, "{bad:?}");
    }
}

#[test]
fn an_exponent_is_that_of_the_power_law_and_an_uncertain_point_makes_it_uncertain() {
    let points = |ends: [f64; 3]| -> Vec<(f64, LogFigure)> {
        let points = [8.0f64, 16.0, 32.0].iter().zip(ends);
        let point = |(n, low): (&f64, f64)| {
            let y = 3.0 * n.powf(-0.7);
            (*n, summary(low * y, y, y))
        };
        points.map(point).collect()
    };
    let slope = |points: &[_]| LogFigure::exponent(points).expect("a slope").log_interval();
    let exact = slope(&points([1.0; 3]));
    assert!(
        (exact.value + 0.7).abs() < 1e-12 && exact.low == exact.high,
        "{exact:?}"
    );
    // A lower last point steepens the fall, by its logarithm over twice ln 2, its weight.
    let wide = slope(&points([1.0, 1.0, 0.8]));
    let down = 0.8f64.ln() / (2.0 * 2f64.ln());
    assert!(
        (wide.low - exact.low - down).abs() < 1e-12 && wide.high - exact.high < 1e-12,
        "{wide:?}"
    );
    // The middle point has no weight, however uncertain it is.
    let middle = slope(&points([1.0, 0.0, 1.0]));
    assert!((middle.low - exact.low).abs() < 1e-12, "{middle:?}");
    let open = slope(&points([1.0, 1.0, 0.0]));
    assert!(
        open.low == f64::NEG_INFINITY && open.high - exact.high < 1e-12,
        "{open:?}"
    );
    assert!(LogFigure::exponent(&[(8.0, LogFigure::exact(1.0))]).is_none());
    let zero = [(8.0, LogFigure::exact(1.0)), (16.0, LogFigure::exact(0.0))];
    assert!(LogFigure::exponent(&zero).is_none());
}

/// Slowdown of a machine in each round: up to three times, with long tails.
fn drift(rounds: usize, g: &mut Pcg32) -> Vec<f64> {
    (0..rounds)
        .map(|_| (0.3 * normal(g).powi(2)).exp())
        .collect()
}

/// Times of two cells in the same rounds, with 2 % independent noise.
fn rounds(ratio: f64, g: &mut Pcg32) -> [Vec<f64>; 2] {
    let machine = drift(7, g);
    [ratio, 1.0].map(|of| {
        machine
            .iter()
            .map(|d| of * d * (0.02 * normal(g)).exp())
            .collect()
    })
}

#[test]
fn rounds_of_one_sitting_are_paired_and_those_of_two_are_not() {
    let g = &mut Pcg32::new(71);
    let machine = drift(9, g);
    let twice: Vec<f64> = machine.iter().map(|ms| 2.0 * ms).collect();
    let of = |sitting: &str, ms: &[f64]| LogFigure::of_rounds(sitting, ms).expect("rounds");
    let paired = of("one", &twice).compared_with(&of("one", &machine));
    assert!((paired.ratio.value - 2.0).abs() < 1e-12 && paired.p == 0.0);
    assert_eq!(paired.ratio.low, paired.ratio.high);
    // The same numbers, not known to be from the same rounds.
    for (a, b) in [("one", "two"), ("", "")] {
        let apart = of(a, &twice).compared_with(&of(b, &machine));
        assert!(apart.ratio.low < 1.8 && apart.p > 0.0, "{apart:?}");
    }
    let fewer = of("one", &twice[..8]).compared_with(&of("one", &machine));
    assert!(fewer.ratio.low < 1.8, "{fewer:?}");
    // A growing gain involves four cells of the same rounds, as does a mean of samplers.
    let gain = LogFigure::product(&[(&of("one", &twice), 1.0), (&of("one", &machine), -1.0)]);
    let growth = gain.compared_with(&LogFigure::exact(1.0)).ratio;
    assert!((growth.low - 2.0).abs() < 1e-12 && (growth.high - 2.0).abs() < 1e-12);
    let mean = LogFigure::product(&[(&of("one", &twice), 0.5), (&of("one", &machine), 0.5)]);
    let half = mean.compared_with(&of("one", &machine)).ratio;
    assert!((half.low - 2f64.sqrt()).abs() < 1e-12, "{half:?}");
}

#[test]
fn intervals_of_paired_rounds_cover_the_truth_and_equals_differ_as_rarely_as_promised() {
    let mut generator = Pcg32::new(72);
    let trials = 4000;
    let (mut covered, mut alarms, mut found, mut found_apart) = (0, 0, 0, 0);
    for _ in 0..trials {
        let g = &mut generator;
        let compare = |ratio: f64, sittings: [&str; 2], g: &mut Pcg32| {
            let [a, b] = rounds(ratio, g);
            let a = LogFigure::of_rounds(sittings[0], &a).expect("rounds");
            a.compared_with(&LogFigure::of_rounds(sittings[1], &b).expect("rounds"))
        };
        let equal = compare(1.0, ["one"; 2], g);
        covered += usize::from(equal.ratio.low <= 1.0 && 1.0 <= equal.ratio.high);
        alarms += usize::from(equal.p <= 0.05);
        found += usize::from(compare(1.1, ["one"; 2], g).p <= 0.05);
        found_apart += usize::from(compare(1.1, ["one", "two"], g).p <= 0.05);
    }
    println!("{covered} covered, {alarms} alarms, {found} and {found_apart} found of {trials}");
    // 5 % is 200, and the standard deviation 14. The trimmed t of five is within 1 % of its level.
    assert!((140..=260).contains(&alarms), "{alarms}");
    assert_eq!(
        covered + alarms,
        trials,
        "the test and the interval are one"
    );
    assert!(found > trials * 95 / 100, "{found}");
    // Negative control: the same cells unpaired.
    assert!(found_apart < trials / 4, "{found_apart}");
}

#[test]
fn two_replicates_against_sixteen_are_no_surer_than_two() {
    // Two normal samples and an exact side: Student's t with one degree of freedom is Cauchy.
    let known = Spread {
        variance: 0.01,
        freedom: 1.0,
    };
    let exact = Spread {
        variance: 0.0,
        freedom: 15.0,
    };
    let p = Spread::of_difference(known, exact).p(0.3);
    let cauchy = 2.0 / std::f64::consts::PI * (1.0f64 / 3.0).atan();
    assert!((p - cauchy).abs() < 1e-12, "{p}");
    let mut generator = Pcg32::new(73);
    let trials = 4000;
    let (mut capped, mut swapped, mut plain) = (0, 0, 0);
    for _ in 0..trials {
        let mut sample = |n: usize| -> (f64, Spread) {
            let values: Vec<f64> = (0..n).map(|_| normal(&mut generator)).collect();
            (mean(&values).unwrap(), Spread::of_mean(&values).unwrap())
        };
        let ((a, few), (b, many)) = (sample(2), sample(16));
        let alarm = |spread: Spread, gap: f64| usize::from(spread.p(gap) <= 0.05);
        capped += alarm(Spread::of_difference(few, many), a - b);
        swapped += alarm(Spread::of_difference(many, few), b - a);
        plain += alarm(Spread::together(&[few, many]), a - b);
    }
    println!("{capped} capped, {plain} by Welch and Satterthwaite of {trials}");
    assert_eq!(capped, swapped);
    assert!(capped <= trials * 6 / 100, "{capped}");
    // Negative control: the degrees of freedom of the other side.
    assert!(plain > trials * 9 / 100, "{plain}");
}

#[test]
fn figures_of_groups_have_the_jackknife_of_their_quotient() {
    let groups = [[4.0, 2.0], [9.0, 3.0], [2.0, 2.0], [8.0, 4.0]];
    let figure = LogFigure::of_groups("groups", &groups);
    assert!((figure.log - (23.0f64 / 11.0).ln()).abs() < 1e-12);
    let without = [[19.0, 9.0], [14.0, 8.0], [21.0, 9.0], [15.0, 7.0]];
    let logs = without.map(|[sum, of]: [f64; 2]| (sum / of).ln());
    let by_hand = variance(&logs).unwrap() * 9.0 / 4.0;
    assert!((figure.spread().variance - by_hand).abs() < 1e-12);
    assert_eq!(figure.spread().freedom, 3.0);
    // The same groups on both sides: their shared part is not noise.
    let twice = groups.map(|[sum, of]| [2.0 * sum, of]);
    let ratio = |of: &str| {
        LogFigure::of_groups(of, &twice)
            .compared_with(&figure)
            .ratio
    };
    assert!((ratio("groups").low - 2.0).abs() < 1e-12 && ratio("others").low < 1.9);
    for unknown in [&groups[..1], &[[1.0, 0.0], [2.0, 1.0]]] {
        let i = LogFigure::of_groups("groups", unknown).interval();
        assert_eq!((i.low, i.high), (0.0, f64::INFINITY), "{unknown:?}");
    }
}

#[test]
fn sums_of_equal_numbers_have_no_noise_however_many_there_are() {
    for n in [2, 7, 30, 300, 1000] {
        let equal = vec![0.1; n];
        let figure = of_mean(&equal).interval();
        assert_eq!(figure.low, figure.high, "{n}");
        // Sums in different orders differ.
        let turned: Vec<f64> = (0..n).map(|i| 0.1 * f64::from((i % 7) as u32)).collect();
        let mut back = turned.clone();
        back.reverse();
        let [a, b] = [turned, back].map(|x| LogFigure::exact(mean_of(&x).max(0.01)));
        assert_eq!(a.compared_with(&b).p, 1.0, "{n}");
    }
    // A nanosecond in ten seconds is not rounding.
    let ms = [1e4, 1e4, 1e4 + 1e-6, 1e4, 1e4 + 1e-6, 1e4 + 1e-6];
    let time = LogFigure::of_times(&ms).expect("times").interval();
    assert!(time.low < time.high);
}

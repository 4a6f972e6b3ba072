//! Effects of other kernels, against the program's own, and the composition of kernels: features compiled in and out, and the
//! gain of leaving them out.

use super::specs::GAINS;
use crate::compare::facts::GATE;
use crate::compare::judge::ChangeVerdict;
use crate::compare::show::change;
use crate::compare::side::{EMBEDDED, Side};
use crate::compare::{Comparison, Confirmed, Finding, Options, compare_sides};
use crate::data::{FULL_CELLS, Measured, RunData, SceneGroup, View, grouped, without_repeats};
use crate::document::*;
use crate::format;
use crate::values::Value;
use raystone_record::figure::{self, Figure};
use raystone_record::{Interval, Key, Ran, TimeRecord, axis};
use raystone_stats::statistics::LEAST_FOR_MEDIAN;

/// The parameter that compiles features into a kernel that its scene does not need.
const CARRY: &str = "carry";

/// Answers the question of a run with several sets of kernels: each against the first, by the comparison of
/// docs/compare.md, structure by structure. Those whose composed kernels are equal to the letter are the unchanged control.
pub(crate) fn against_original(data: &RunData) -> Vec<(Table, Vec<String>)> {
    if ideas(data).is_empty() {
        return Vec::new();
    }
    let run = Side::new("this run", data.lines.to_vec(), Vec::new());
    let labels = run.kernels();
    let original = labels.iter().find(|label| *label == EMBEDDED);
    let Some(original) = original.or(labels.first()) else {
        return Vec::new();
    };
    let against = |idea: &String| {
        let sides = run
            .of_kernels(Some([original.as_str(), idea.as_str()]))
            .ok()?;
        let found = compare_sides(&sides[0], &sides[1], &Options::default(), &Confirmed::new());
        let caption = format!("What the kernels @{idea} change, against {original}");
        let heads = ["structure", ":answer", ":change [95 % interval]"];
        let table = Table::of(caption, &heads, structures(data, &found));
        let mut notes = Vec::from_iter(how_times(&found));
        notes.extend(found.notes.iter().cloned());
        notes.push(beside_times(&found));
        Some((table, notes)).filter(|(table, _)| !table.rows.is_empty())
    };
    let ideas = labels.iter().filter(|label| *label != original);
    ideas.filter_map(against).collect()
}

/// Returns the names of the sets of kernels that are compared with the first one.
pub(crate) fn ideas(data: &RunData) -> Vec<String> {
    let structures = data.scenes.iter().flat_map(|scene| &scene.structures);
    let times = data.views().flat_map(|(_, view)| &view.times);
    let labels = structures
        .map(|s| &s.key)
        .chain(times.map(|time| &time.key));
    let labels = labels.map(|key| key.label(axis::KERNELS).to_owned());
    let mut labels = without_repeats(labels.collect());
    let original = labels.iter().position(String::is_empty).unwrap_or(0);
    if !labels.is_empty() {
        labels.remove(original);
    }
    labels
}

/// Returns a row for each structure, those that the kernels change first.
fn structures(data: &RunData, found: &Comparison) -> Vec<[TableCell; 3]> {
    const WHERE: [&str; 6] = [
        axis::SCENE,
        axis::ACCEL,
        axis::TRIANGLE,
        axis::BOX_TEST,
        axis::WORKGROUP,
        axis::LOAD,
    ];
    let times = found.findings.iter().filter(|f| f.is_time);
    let mut groups = grouped(times, |f| f.key.only(&WHERE));
    groups.sort_by_key(|(_, findings)| findings.iter().all(|f| f.is_control));
    let row = |(key, findings): (Key, Vec<&Finding>)| {
        let scene = key.label(axis::SCENE);
        let structure = match key.label(axis::ACCEL) {
            "" => "compaction".to_owned(),
            _ => data.names.structure(&key),
        };
        let name = if data.scenes.len() > 1 && !scene.is_empty() {
            format!("{structure}, {scene}")
        } else {
            structure
        };
        let is_gate = |f: &&Finding| f.figure.id == GATE && f.key.only(&WHERE) == key;
        let mut gates = found.findings.iter().filter(is_gate);
        let (answer, tone) = if gates.any(|gate| gate.verdict == ChangeVerdict::Worse) {
            ("FAILED the gate".to_owned(), Tone::Bad)
        } else {
            answer(&findings)
        };
        // If some kernels of a structure changed, the times of the others are no part of the answer.
        let all_are = findings.iter().all(|f| f.is_control);
        let told = findings.iter().filter(|f| all_are || !f.is_control);
        let changed: Vec<String> = told.map(|f| change_of(f)).collect();
        let answer = TableCell::from(answer).toned(tone);
        [name.into(), answer, changed.join("; ").into()]
    };
    groups.into_iter().map(row).collect()
}

/// Sums up the verdicts on the times of one structure.
fn answer(findings: &[&Finding]) -> (String, Tone) {
    let changed: Vec<&&Finding> = findings.iter().filter(|f| !f.is_control).collect();
    if changed.is_empty() {
        let moved = findings
            .iter()
            .any(|f| f.verdict == ChangeVerdict::Undecided);
        let (text, tone) = if moved {
            ("unchanged control, which moved all the same", Tone::Bad)
        } else {
            ("unchanged control", Tone::Plain)
        };
        return (text.into(), tone);
    }
    let words = [
        (ChangeVerdict::Worse, "slower", Tone::Bad),
        (ChangeVerdict::Better, "faster", Tone::Good),
        (ChangeVerdict::Undecided, "undecided", Tone::Note),
        (ChangeVerdict::Same, "same", Tone::Plain),
    ];
    let counted = words.map(|(verdict, word, tone)| {
        let count = changed.iter().filter(|f| f.verdict == verdict).count();
        (count, word, tone)
    });
    let found = || counted.iter().filter(|(count, ..)| *count > 0);
    let tone = found().next().map_or(Tone::Note, |(.., tone)| *tone);
    let text = found().map(|(count, word, _)| match changed.len() {
        all if all == *count => (*word).to_owned(),
        _ => format!("{word} in {count}"),
    });
    let text: Vec<String> = text.collect();
    (text.join(", "), tone)
}

/// Describes one time: its subject, and its change.
fn change_of(finding: &Finding) -> String {
    let of = match finding.key.label(axis::RAYS) {
        "" => {
            let axes = [axis::INTEGRATOR, axis::SEQUENCE, axis::DECORRELATION];
            let labels = finding.key.labels_on(&axes);
            let labels = labels.into_iter().filter(|label| !label.is_empty());
            labels.collect::<Vec<_>>().join(" × ")
        }
        rays => format!("{rays} rays"),
    };
    let change = Some(change(finding)).filter(|change| !change.is_empty());
    let change = change.as_ref().unwrap_or(&finding.why);
    format!("{of}: {} {change}", finding.figure.title)
}

/// Says what the changes of times are of: the speeds of other tables may be by another clock.
fn how_times(found: &Comparison) -> Option<String> {
    let changed = found.findings.iter().filter(|f| f.is_time && !f.is_control);
    let whys = changed
        .filter(|f| f.measured.is_some())
        .map(|f| f.why.clone());
    let whys = without_repeats(whys.collect());
    (!whys.is_empty()).then(|| format!("the changes are of: {}", whys.join("; ")))
}

/// Counts the figures beside times that are not the same.
fn beside_times(found: &Comparison) -> String {
    let others = || found.findings.iter().filter(|f| !f.is_time);
    // A figure measured once is shown, and decides nothing.
    let is_other = |f: &&Finding| !matches!(f.verdict, ChangeVerdict::Same | ChangeVerdict::Told);
    let not_same = others().filter(is_other).count();
    let of = format!(
        "{not_same} of {} beside times are not the same",
        format::plural(others().count(), "figure")
    );
    format!("{of}; `raystone compare` on this run lists all.")
}

/// Returns `true` if a measurement repeats another, see [`repeats`].
pub(crate) fn is_repeat<T>(one: &Measured<T>, all: &[Measured<T>]) -> bool {
    repeats((&one.key, one.ran), all.iter().map(|of| (&of.key, of.ran)))
}

/// Returns `true` if a measurement repeats another: the same but for the label of its kernels, which are equal to the letter.
/// In a contest it would be a rival of itself.
pub(crate) fn repeats<'a>(
    (key, ran): (&Key, &Ran),
    all: impl IntoIterator<Item = (&'a Key, &'a Ran)>,
) -> bool {
    let bare = |key: &Key| key.clone().with(axis::KERNELS, "");
    let is_embedded = |key: &Key| key.label(axis::KERNELS).is_empty();
    if ran.kernel_hash.is_empty() || is_embedded(key) {
        return false;
    }
    let is_same =
        |of: &Key, with: &Ran| with.kernel_hash == ran.kernel_hash && bare(of) == bare(key);
    let all: Vec<_> = all.into_iter().collect();
    let own = all.iter().position(|(of, _)| *of == key);
    all.iter().enumerate().any(|(place, (of, with))| {
        let is_before = is_embedded(of) || own.is_some_and(|own| place < own);
        is_before && is_same(of, with)
    })
}

/// Returns the tables on the kernels of a scene.
pub fn blocks(data: &RunData, scene: &SceneGroup) -> Vec<Block> {
    let gains = scene.views.iter().flat_map(|view| gains(scene, view));
    let gains = GAINS.table(&data.names, &gains.collect::<Vec<_>>(), &[scene.name]);
    let tables = [features_table(scene), gains];
    tables.into_iter().filter_map(Table::into_block).collect()
}

/// Features of the kernels that full cells were timed with; cells with the same ones share a row.
pub(crate) fn features_table(scene: &SceneGroup) -> Table {
    let caption = format!(
        "Kernels of full cells on {}: features compiled in, and those that other scenes need and that were compiled out",
        scene.name
    );
    let heads = ["integrator", ":structures", ":compiled in", ":compiled out"];
    let listed = |names: &[String]| match names {
        [] => "nothing".to_owned(),
        names => names.join(", "),
    };
    let rows = scene.views.iter().flat_map(|view| {
        let is_known = |ran: &Ran| !(ran.features.is_empty() && ran.left_out.is_empty());
        let times = view.times.iter().filter(|time| is_known(time.ran));
        let alike = grouped(times, |time| (&time.ran.features, &time.ran.left_out));
        alike.into_iter().map(|((inside, left_out), times)| {
            let names = times.iter().map(|time| time.structure.clone()).collect();
            let names = without_repeats(names).join(", ");
            [view.name.clone(), names, listed(inside), listed(left_out)].map(TableCell::from)
        })
    });
    Table::of(caption, &heads, rows)
}

/// Id of the figure.
const GAIN: &Figure = &figure::SPECIALISATION;

/// Returns the time of each full cell of a view with more features than its scene needs, over that of the specialised
/// kernel: both timed in the same rounds, often enough for an interval.
pub(crate) fn gains(scene: &SceneGroup, view: &View) -> Vec<Value<'static>> {
    let mut gains = Vec::new();
    for time in view.valid_times() {
        let Some(plain) = without_carry(time.key.label(axis::INTEGRATOR)) else {
            continue;
        };
        let wanted = time.key.clone().with(axis::INTEGRATOR, plain);
        let times = scene.views.iter().flat_map(View::valid_times);
        let Some(specialised) = { times }.find(|other| other.key == wanted) else {
            continue;
        };
        let figure = (GAIN, time_over(time, specialised));
        gains.extend(Value::known(&time.key, [figure]));
    }
    gains
}

/// Returns the time of a full cell over that of another, if both were timed often enough for an interval.
pub(crate) fn time_over(
    time: &Measured<TimeRecord>,
    base: &Measured<TimeRecord>,
) -> Option<Interval> {
    let [own, base] = [time, base].map(|time| {
        let often = time.ms.len() >= LEAST_FOR_MEDIAN;
        time.rounds(FULL_CELLS, &time.ms).filter(|_| often)
    });
    Some(own?.compared_with(&base?).ratio)
}

/// Returns the label of an integrator without the parameter; `None` for one that does not have it.
fn without_carry(label: &str) -> Option<String> {
    let (name, rest) = label.split_once('(')?;
    let parameters = rest.strip_suffix(')')?.split(',');
    let is_carry = |p: &&str| p.split_once('=').is_some_and(|(name, _)| name == CARRY);
    let (carry, others): (Vec<&str>, Vec<&str>) = parameters.partition(is_carry);
    (!carry.is_empty()).then(|| {
        if others.is_empty() {
            name.to_owned()
        } else {
            format!("{name}({})", others.join(","))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_is_that_of_the_same_integrator_without_what_it_carries() {
        let of = |label: &str| without_carry(label);
        assert_eq!(of("path(carry=all)").as_deref(), Some("path"));
        let more = of("path(carry=all,max_depth=3)");
        assert_eq!(more.as_deref(), Some("path(max_depth=3)"));
        assert_eq!(of("path(max_depth=3)"), None);
        assert_eq!(of("path"), None);
    }
}

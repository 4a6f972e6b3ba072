//! What kernels were made of: features compiled in and out, and what leaving them out gained.

use crate::data::{SceneGroup, View};
use crate::document::*;
use crate::pivot::Rows;
use crate::values::Value;
use raystone_record::{Interval, Key, Ran, TimeRecord, axis};
use raystone_stats::comparison::LogFigure;
use raystone_stats::statistics::LEAST_FOR_MEDIAN;

/// The parameter that makes a kernel carry what its scene does not need.
const CARRY: &str = "carry";

/// The tables on the kernels of a scene.
pub fn blocks(scene: &SceneGroup, values: &[Value]) -> Vec<Block> {
    let tables = [features_table(scene), gains_table(scene, values)];
    tables.into_iter().filter_map(Table::into_block).collect()
}

/// Features of the kernels that full cells were timed with; cells with the same ones share a row.
pub(crate) fn features_table(scene: &SceneGroup) -> Table {
    let caption = format!(
        "Kernels of full cells on {}: features compiled in, and those that other scenes need and that were compiled out",
        scene.name
    );
    let heads = ["integrator", ":structures", ":compiled in", ":compiled out"];
    let mut table = Table::new(caption, &heads);
    for view in &scene.views {
        let mut known: Vec<(&Ran, Vec<&str>)> = Vec::new();
        for time in &view.times {
            let ran = time.ran;
            if ran.features.is_empty() && ran.left_out.is_empty() {
                continue;
            }
            let same = |(other, _): &&mut (&Ran, Vec<&str>)| {
                other.features == ran.features && other.left_out == ran.left_out
            };
            match known.iter_mut().find(same) {
                None => known.push((ran, vec![&time.structure])),
                Some((_, names)) if names.contains(&&*time.structure) => {}
                Some((_, names)) => names.push(&time.structure),
            }
        }
        let listed = |names: &[String]| match names.is_empty() {
            true => "nothing".to_owned(),
            false => names.join(", "),
        };
        table.rows.extend(known.into_iter().map(|(ran, names)| {
            vec![
                view.name.clone().into(),
                names.join(", ").into(),
                listed(&ran.features).into(),
                listed(&ran.left_out).into(),
            ]
        }));
    }
    table
}

/// Times of kernels that carry more than their scene needs, over those of the specialised ones.
pub(crate) fn gains_table(scene: &SceneGroup, values: &[Value]) -> Table {
    let caption = format!(
        "What compiling out gains on {}: time of the kernel that carries a group of features all the same, over that of \
         the specialised one [95 % interval]",
        scene.name
    );
    let gains = values.iter().filter(|v| v.figure.id == GAIN).cloned();
    let gains: Vec<Value> = gains.collect();
    let across = |key: &Key| {
        format!(
            "{} with {} × {}",
            key.label(axis::ACCEL),
            key.label(axis::SEQUENCE),
            key.label(axis::DECORRELATION)
        )
    };
    Rows::of_labels(&[axis::INTEGRATOR], &["integrator"], &gains).table(
        &gains,
        caption,
        &[GAIN],
        &across,
    )
}

/// Id of the figure.
const GAIN: &str = "specialisation/v1";

/// What each full cell of a view that carries more than its scene needs takes, over the cell of the specialised
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

/// What a full cell takes over another, if both were timed often enough for an interval.
pub(crate) fn time_over(time: &TimeRecord, base: &TimeRecord) -> Option<Interval> {
    let [own, base] = [time, base].map(|time| {
        let often = time.ms.len() >= LEAST_FOR_MEDIAN;
        LogFigure::of_times(&time.ms).filter(|_| often)
    });
    let (own, base) = own.zip(base)?;
    let noise = base.own.first().copied();
    Some(own.scaled((-base.log).exp()).with_noise(noise).interval())
}

/// The label of an integrator without the parameter; `None` for one that does not have it.
fn without_carry(label: &str) -> Option<String> {
    let (name, rest) = label.split_once('(')?;
    let parameters = rest.strip_suffix(')')?.split(',');
    let is_carry = |p: &&str| p.split_once('=').is_some_and(|(name, _)| name == CARRY);
    let (carry, others): (Vec<&str>, Vec<&str>) = parameters.partition(is_carry);
    (!carry.is_empty()).then(|| match others.is_empty() {
        true => name.to_owned(),
        false => format!("{name}({})", others.join(",")),
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

//! Media beside the first, as one parameter holds them: tables with the parameters of the first.

use crate::medium::{MOST_MEDIA, MediumParameters};
use crate::{SceneData, SceneError};
use raystone_core::params::{ParamError, ParamRange, ParamValue, Parameters as _, Params};
use toml::{Table, Value};

/// What a text of tables looks like, for messages.
const LIKE: &str = "write tables in braces, `{ medium = \"constant\", medium_box = [0, 0, 0, 1, 1, 1], scattering = 2 }, { medium = \"cloud\" }`";
const STRUCTURE: &str = "medium_structure";

/// The scene with the media of these tables beside those that it has.
///
/// # Errors
/// They are no tables, or too many; or one says no kind of medium, has a parameter that media do not have, or cannot be.
pub(super) fn added(mut scene: SceneData, text: &str) -> Result<SceneData, SceneError> {
    let name = scene.name.clone();
    let refused = |place: Option<usize>, problem: String| SceneError::MoreMedia {
        name: name.clone(),
        place,
        problem,
    };
    let tables = tables(text).map_err(|problem| refused(None, problem))?;
    let count = scene.media.len() + tables.len();
    if count > MOST_MEDIA {
        let problem = format!(
            "with them the scene holds {count} media, and paths are followed through {MOST_MEDIA} at most: put some into one grid"
        );
        return Err(refused(None, problem));
    }
    for (place, table) in (1..).zip(&tables) {
        let first = scene.media.first().map(|medium| medium.structure.as_str());
        let medium = parameters(table, first).map_err(|e| refused(Some(place), e))?;
        let unheard = medium.unheard();
        let unheard = unheard.map(|note| format!("medium {place} of `more_media`: {note}"));
        scene.report.warnings.extend(unheard);
        let medium = medium.made(&scene).map_err(|e| match e {
            SceneError::Medium { source, .. } => refused(Some(place), source.to_string()),
            other => refused(Some(place), other.to_string()),
        })?;
        scene.media.push(medium);
    }
    scene.hash = scene.content_hash();
    Ok(scene)
}

/// The tables of a text, which may be a list of them.
fn tables(text: &str) -> Result<Vec<Table>, String> {
    let text = text.trim();
    let listed = match text.strip_prefix('[') {
        Some(_) => format!("media = {text}"),
        None => format!("media = [{text}]"),
    };
    let document: Table = listed.parse().map_err(|e: toml::de::Error| {
        let said = e.message().replace('\n', " ");
        format!("`{text}` is no list of tables ({said}): {LIKE}")
    })?;
    let Some(Value::Array(items)) = document.get("media") else {
        return Err(format!("`{text}` is no list of tables: {LIKE}"));
    };
    if items.is_empty() {
        return Err(format!("it holds no medium: leave it out, or {LIKE}"));
    }
    let table = |item: &Value| match item {
        Value::Table(table) => Ok(table.clone()),
        other => Err(format!("`{other}` is no table: {LIKE}")),
    };
    items.iter().map(table).collect()
}

/// The parameters of a table; media of a scene have the structure of the first.
fn parameters(table: &Table, structure: Option<&str>) -> Result<MediumParameters, String> {
    let schema = MediumParameters::schema();
    let value = |(name, given): (&String, &Value)| {
        let known = schema.iter().find(|parameter| parameter.name == name);
        let range = known.map_or(&ParamRange::Text, |parameter| &parameter.range);
        (name.clone(), valued(given, range))
    };
    let mut params = Params(table.iter().map(value).collect());
    let kind = params.0.get("medium");
    if kind.is_none_or(|kind| *kind == ParamValue::Name(String::new())) {
        return Err(
            "it says no kind of medium: give `medium = \"constant\"`, for instance".to_owned(),
        );
    }
    if let Some(structure) = structure {
        let own = (params.0.entry(STRUCTURE.to_owned()))
            .or_insert_with(|| ParamValue::Name(structure.to_owned()))
            .to_string();
        if own != structure {
            return Err(format!(
                "its `{STRUCTURE}` is `{own}`, that of the scene's first medium `{structure}`: all have the same, so leave it out here"
            ));
        }
    }
    MediumParameters::from_params(&params).map_err(|e| match e {
        ParamError::Unknown { nearest: None, .. } => {
            let known: Vec<&str> = schema.iter().map(|parameter| parameter.name).collect();
            format!("{e}; a medium has {}", known.join(", "))
        }
        _ => e.to_string(),
    })
}

/// A value as a parameter of this range holds it; one that it cannot hold is refused later.
fn valued(given: &Value, range: &ParamRange) -> ParamValue {
    match (given, range) {
        (Value::Integer(x), ParamRange::Number { .. }) => ParamValue::Number(*x as f64),
        (Value::Integer(x), _) => ParamValue::Integer(*x),
        (Value::Float(x), _) => ParamValue::Number(*x),
        (Value::Boolean(x), _) => ParamValue::Flag(*x),
        (Value::String(x), _) => ParamValue::Name(x.clone()),
        (Value::Array(items), ParamRange::List(of, _)) => {
            ParamValue::List(items.iter().map(|item| valued(item, of)).collect())
        }
        (other, _) => ParamValue::Name(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use crate::builtin::tests::{load_default, load_with, try_load_with};
    use glam::{DVec3, Vec3};
    use raystone_core::params::ParamValue::{Integer, List, Name, Number};
    use raystone_volume::{Bounds, phase};

    fn with(first: Option<&str>, more: &str) -> Result<crate::SceneData, crate::SceneError> {
        let mut changes = vec![("more_media", Name(more.to_owned()))];
        changes.extend(first.map(|first| ("medium", Name(first.to_owned()))));
        try_load_with("cornell-box", &changes)
    }

    #[test]
    fn a_scene_takes_further_media_by_tables() {
        let text = "{ medium = 'cloud', medium_voxels = 8, medium_box = [1, 2, 3, 4, 5, 7.5], \
                    medium_shape = 'ball', scattering = 2, absorption = 0.5, phase = 'henyey-greenstein', \
                    anisotropy = 0.25, scattering_tint = [1, 0.5, 0] }, { medium = \"constant\" }";
        for text in [text.to_owned(), format!("  [{text}]\n")] {
            let scene = with(Some("constant"), &text).unwrap();
            assert_eq!(scene.media.len(), 3);
            let [first, second, third] = [0, 1, 2].map(|k| &scene.media[k]);
            assert_eq!(first.volume, third.volume);
            let volume = &second.volume;
            assert_eq!(volume.resolution, [8; 3]);
            assert_eq!(
                [volume.low, volume.high],
                [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 7.5)]
            );
            assert_eq!(volume.bounds, Bounds::Sphere);
            assert_eq!(volume.phase.kind, phase::HENYEY_GREENSTEIN);
            assert_eq!(volume.scattering.iter().copied().fold(0.0, f32::max), 2.0);
            assert_eq!(second.tints[0], Vec3::new(1.0, 0.5, 0.0));
        }
    }

    #[test]
    fn they_add_to_what_the_scene_has_and_change_its_hash() {
        let alone = load_with("cornell-box", &[("medium", Name("constant".to_owned()))]);
        let added = with(None, "{ medium = 'constant' }").unwrap();
        assert_eq!(alone.hash, added.hash);
        let two = with(Some("constant"), "{ medium = 'constant' }").unwrap();
        assert_ne!(alone.hash, two.hash);
        let fog = load_with(
            "fog",
            &[("more_media", Name("{ medium = 'cloud' }".to_owned()))],
        );
        let [first, second] = &fog.media[..] else {
            panic!("{} media", fog.media.len())
        };
        assert_eq!(*first, load_default("fog").media[0]);
        assert_eq!(second.volume.resolution, [32; 3]);
    }

    #[test]
    fn they_have_the_structure_of_the_first() {
        let load = |more: &str| {
            let changes = [
                ("medium", Name("cloud".to_owned())),
                ("medium_voxels", Integer(4)),
                ("medium_structure", Name("bricks".to_owned())),
                ("more_media", Name(more.to_owned())),
            ];
            try_load_with("cornell-box", &changes)
        };
        let scene = load("{ medium = 'constant' }").unwrap();
        assert_eq!(scene.media[1].structure, "bricks");
        let refused = load("{ medium = 'constant', medium_structure = 'dda' }").unwrap_err();
        let said = refused.to_string();
        assert!(
            said.contains("`dda`") && said.contains("`bricks`"),
            "{said}"
        );
    }

    #[test]
    fn wrong_tables_are_errors_that_say_what_and_where() {
        let good = "{ medium = 'constant' }";
        for (text, expected) in [
            ("medium = 'constant'".to_owned(), "no list of tables"),
            ("{ medium = 'constant'".to_owned(), "no list of tables"),
            (" ".to_owned(), "no medium"),
            ("[]".to_owned(), "no medium"),
            (format!("{good}, 3"), "`3` is no table"),
            (
                format!("{good}, {{ scattering = 2 }}"),
                "table 2: it says no kind",
            ),
            (
                format!("{good}, {{ medium = 'constant', scatering = 2 }}"),
                "table 2: there is no parameter `scatering`; did you mean `scattering`?",
            ),
            (
                "{ medium = 'constant', density = 2 }".to_owned(),
                "table 1: there is no parameter `density`; a medium has medium, absorber, medium_box",
            ),
            (
                "{ medium = 'constant', scattering = -1 }".to_owned(),
                "table 1: parameter `scattering` must be",
            ),
            (
                "{ medium = 'constant', medium_box = [0, 1] }".to_owned(),
                "table 1: parameter `medium_box` must be",
            ),
            (
                "{ medium = 'constant', medium_box = [0, 0, 0, 1, 0, 1] }".to_owned(),
                "table 1: the bounds of a medium need",
            ),
            ("{ medium = 'smoke' }".to_owned(), "`smoke`"),
            ("{ medium = 'no.ply' }".to_owned(), "no.ply"),
            ([good; 9].join(", "), "holds 9 media"),
        ] {
            let refused = with(None, &text).unwrap_err().to_string();
            assert!(
                refused.starts_with("cornell-box: `more_media` of the scene")
                    && refused.contains(expected),
                "{text}: {refused}"
            );
        }
        let box_of = List([0.0; 6].map(Number).to_vec());
        let silent = load_with("cornell-box", &[("medium_box", box_of)]);
        assert!(silent.media.is_empty());
    }
}

//! Every registry entry with parameters as a library user may pass them: none, unknown names, wrong
//! types, values out of range. Missing ones take their defaults; the rest is an error.

use crate::support::{Pcg, default_params, scenes};
use raystone::accel::{AccelRegistry, BuildLog, BuiltBvh, BvhParameters, TriangleSoup};
use raystone::params::{Length, ParamRange, ParamValue, ParameterSchema, Params, Step, Variant};
use raystone::sampling::{Demand, SamplerRegistry};
use raystone::scene::{LoadOptions, load};

/// Parameters that a schema does not allow, each with a word that the message must contain.
fn hostile(schema: &ParameterSchema) -> Vec<(Params, String)> {
    let alone = |name: &str, value| Params([(name.to_owned(), value)].into());
    let mut out = vec![(
        alone("leaf_sise", ParamValue::Integer(1)),
        "leaf_sise".to_owned(),
    )];
    for parameter in schema {
        let text = ParamValue::Name("no such choice".to_owned());
        let wrong = match &parameter.range {
            ParamRange::Number { min, max } => vec![
                ParamValue::Number(f64::NAN),
                ParamValue::Number(f64::INFINITY),
                ParamValue::Number(min - 1.0 - min.abs()),
                ParamValue::Number(max + 1.0 + max.abs()),
                ParamValue::Flag(true),
                text,
            ],
            ParamRange::Integer { min, max } => vec![
                ParamValue::Integer(min.saturating_sub(1)),
                ParamValue::Integer(max.saturating_add(1)),
                ParamValue::Integer(i64::MIN),
                ParamValue::Number(1.5),
                text,
            ],
            ParamRange::Stepped(Step::PowerOfTwo, range) => {
                let (min, max) = (*range.start(), *range.end());
                let whole = [min / 2, 2 * max, 3 * min, max - 1, -min];
                let mut wrong: Vec<_> = whole.map(ParamValue::Integer).into();
                wrong.extend([ParamValue::Number(min as f64 + 0.5), text]);
                wrong
            }
            ParamRange::Flag => vec![ParamValue::Integer(1), text],
            ParamRange::Choice(_) => vec![ParamValue::Integer(1), text],
            ParamRange::Text => vec![ParamValue::Flag(false), ParamValue::Number(0.5)],
            ParamRange::List(_, Length::Exactly(count)) => vec![
                ParamValue::Number(0.5),
                ParamValue::List(vec![ParamValue::Number(0.5); count + 1]),
                ParamValue::List(vec![ParamValue::Flag(true); *count]),
                text,
            ],
            range => panic!("{}: {range} has no wrong values here yet", parameter.name),
        };
        let within = |value: &ParamValue| match (&parameter.range, value) {
            (ParamRange::Integer { min, max }, ParamValue::Integer(x)) => (min..=max).contains(&x),
            _ => false,
        };
        let wrong = wrong.into_iter().filter(|value| !within(value));
        out.extend(wrong.map(|value| (alone(parameter.name, value), parameter.name.to_owned())));
    }
    out
}

#[test]
fn a_structure_completes_its_parameters_and_refuses_what_it_does_not_know() {
    let soups = [
        TriangleSoup::default(),
        scenes::lattice_soup(&mut Pcg::new(1), 40, 6),
    ];
    let mut refused = 0;
    for kind in AccelRegistry::default().iter() {
        let schema = kind.parameters();
        for soup in &soups {
            let build = |params: &Params| kind.build(soup, params, &mut BuildLog::default());
            let bare = build(&Params::default()).unwrap_or_else(|e| panic!("{}: {e}", kind.name()));
            let full = build(&default_params(&schema)).expect("its own defaults");
            let words = |built: &dyn raystone::accel::BuiltAccel| {
                let buffers = built.buffers();
                let arrays = buffers.arrays.iter();
                arrays
                    .map(|a| (a.name, a.words.to_vec()))
                    .collect::<Vec<_>>()
            };
            assert_eq!(words(&*bare), words(&*full), "{}", kind.name());
            bare.validate(soup)
                .unwrap_or_else(|e| panic!("{}: {e}", kind.name()));
            for (params, name) in hostile(&schema) {
                let error = build(&params).err();
                let error = error.unwrap_or_else(|| panic!("{}: {params:?}", kind.name()));
                assert!(error.to_string().contains(&format!("`{name}`")), "{error}");
                refused += 1;
            }
        }
    }
    assert!(refused > 200, "{refused}");
    let soup = &soups[1];
    assert!(BuiltBvh::build(soup, &BvhParameters::default(), &mut BuildLog::default()).is_ok());
}

fn variant(name: &str, params: Params) -> Variant {
    Variant {
        name: name.to_owned(),
        params,
        label: name.to_owned(),
    }
}

#[test]
fn a_sampler_completes_its_parameters_and_refuses_what_it_does_not_know() {
    let registry = SamplerRegistry::default();
    let demand = Demand {
        samples: Some(16),
        dimensions: 1,
        width: Some(8),
    };
    let plain = |name: &str| variant(name, Params::default());
    let mut made = 0;
    for sequence in registry.sequence_entries() {
        let none = plain("none");
        let bare = registry.sampler(&plain(&sequence.name), &none, &demand);
        let bare = bare.unwrap_or_else(|e| panic!("{e}"));
        let full = registry.sampler(&sequence.default_variant(), &none, &demand);
        assert_eq!(
            bare.table.words(),
            full.expect("its defaults").table.words()
        );
        made += 1;
        for (params, name) in hostile(&sequence.schema) {
            let sampler = registry.sampler(&variant(&sequence.name, params), &none, &demand);
            let error = sampler.err().expect("an error").to_string();
            assert!(error.contains(&format!("`{name}`")), "{error}");
        }
    }
    for decorrelation in registry.decorrelation_entries() {
        for sequence in registry.sequence_entries() {
            // A pair may be incompatible; that must be an error, not a panic.
            let sampler =
                registry.sampler(&plain(&sequence.name), &plain(&decorrelation.name), &demand);
            made += usize::from(sampler.is_ok());
        }
        for (params, name) in hostile(&decorrelation.schema) {
            let moved = variant(&decorrelation.name, params);
            let error = registry.is_random(&plain("halton"), &moved);
            let error = error.expect_err("an error").to_string();
            assert!(error.contains(&format!("`{name}`")), "{error}");
        }
    }
    assert!(made > 30, "{made}");
}

#[test]
fn a_built_in_scene_completes_its_parameters_and_refuses_what_it_does_not_know() {
    let mut scenes = 0;
    for entry in raystone::scene::builtin_scenes() {
        let load = |params| load(&variant(&entry.name, params), &LoadOptions::default());
        let bare = load(Params::default()).unwrap_or_else(|e| panic!("{}: {e}", entry.name));
        let full = raystone::scene::load(&entry.default_variant(), &LoadOptions::default());
        assert_eq!(
            bare.hash,
            full.expect("its defaults").hash,
            "{}",
            entry.name
        );
        for (params, name) in hostile(&entry.schema) {
            let error = load(params).expect_err("an error").to_string();
            assert!(error.contains(&format!("`{name}`")), "{error}");
        }
        scenes += 1;
    }
    assert!(scenes > 5);
}

//! Explains in words how a structure traces one ray: for `raystone trace`.

use super::bench;
use super::shot_meshes;
use raystone_accel::oracle::exact_truths;
use raystone_accel::watch::{Event, watch};
use raystone_accel::{AccelKind, BuiltAccel, Counters, Hit, NO_HIT, Ray, Space, TriangleSoup};
use raystone_core::params::Params;
use raystone_core::text::did_you_mean_or_known;
use raystone_scene::SceneData;
use std::fmt::Write as _;

/// Crossed triangles that are listed one by one.
const MOST_CROSSED: usize = 16;

/// Lists every node that the structure's twin visits, every triangle that it tests, its answer, brute force's and the
/// exact oracle's; returns `true` beside the text if the first two are equal to the bit.
///
/// # Errors
/// The structure cannot be built, is not valid, or has no twin; in words.
pub fn explain(
    scene: &SceneData,
    soup: &TriangleSoup,
    kind: &dyn AccelKind,
    params: &Params,
    ray: &Ray,
) -> Result<(String, bool), String> {
    let built = bench::build_with(kind, params, soup);
    let built = built.map_err(|e| format!("{} is {e}", kind.name()))?;
    let twin = built
        .cpu_twin(soup)
        .ok_or_else(|| format!("{} has no twin on the host", kind.name()))?;
    let mut counters = Counters::default();
    let is_ray = ray.is_ray();
    let (hit, events) = watch(|| {
        if is_ray {
            twin.closest_hit(ray, &mut counters)
        } else {
            Hit::miss(ray)
        }
    });
    let mut text = steps(&events);
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "\nnodes or cells {}, box tests {}, triangle tests {}, stack {}",
        counters.nodes, counters.box_tests, counters.triangle_tests, counters.stack_high_water
    );
    let expected = bench::Expected::new(soup, &[*ray]);
    let expected = expected.of(built.space())[0];
    let any = is_ray && twin.any_hit(ray, &mut Counters::default());
    let equal = hit.same_bits(&expected) && any == (expected.triangle != NO_HIT);
    let _ = writeln!(text, "{:12} {hit}", kind.name());
    let _ = writeln!(text, "{:12} {expected}", reference_name(&*built));
    let _ = writeln!(text, "{:12} {}", "any hit", if any { "yes" } else { "no" });
    text += &oracle_text(scene, ray);
    text += if equal {
        "equal to the bit\n"
    } else {
        "DIFFERENT: the structure does not answer what brute force does\n"
    };
    Ok((text, equal))
}

fn reference_name(built: &dyn BuiltAccel) -> &'static str {
    match built.space() {
        Space::World => "brute force",
        Space::Instances => "brute force over instances",
    }
}

/// Formats one line a node, with the triangles tested there.
fn steps(events: &[Event]) -> String {
    let mut text = String::new();
    for event in events {
        let _ = match event {
            Event::Read(_) => Ok(()),
            Event::Node(place) => write!(text, "\nnode {place}"),
            Event::Triangle(id) => write!(text, "\n  triangle {id}"),
            Event::Nearest(hit) => write!(
                text,
                "  nearest so far, t {:?} u {:?} v {:?}",
                hit.t, hit.u, hit.v
            ),
        };
    }
    text.trim_start().to_owned() + "\n"
}

fn oracle_text(scene: &SceneData, ray: &Ray) -> String {
    if !ray.is_ray() {
        return format!("{:12} this is no ray, and hits nothing\n", "oracle");
    }
    let truths = exact_truths(&scene.triangles, &[*ray]);
    let hits = truths.first().map_or(&[][..], |truth| &truth.hits);
    let mut text = if hits.is_empty() {
        format!("{:12} nothing is hit\n", "oracle")
    } else {
        format!("{:12} exactly hit, the nearest first:\n", "oracle")
    };
    for hit in hits.iter().take(MOST_CROSSED) {
        let _ = writeln!(
            text,
            "  triangle {} at t {:.12}: {:?}",
            hit.triangle, hit.t, hit.side
        );
    }
    if hits.len() > MOST_CROSSED {
        let _ = writeln!(text, "  and {} more", hits.len() - MOST_CROSSED);
    }
    text
}

/// Returns the case of an address, as a scene.
///
/// # Errors
/// No family or no case of that name; in words.
pub fn scene_of(address: &super::case::Address) -> Result<SceneData, String> {
    if address.family == shot_meshes::FAMILY {
        let mesh = shot_meshes::ShotMesh::labelled(&address.label, address.seed)?.mesh;
        return Ok(super::case::scene(mesh, None));
    }
    let (name, label) = (&address.family, &address.label);
    let family = super::families::Family::named(name).ok_or_else(|| {
        let known: Vec<&str> = super::family_names().collect();
        let near = did_you_mean_or_known(name, &known);
        format!("there is no family `{name}`{near}")
    })?;
    let mut cases = family.cases(address.seed, false, 0);
    let Some(at) = cases.iter().position(|case| case.label == *label) else {
        // Labels have commas.
        let known = cases.iter().map(|case| format!("`{}`", case.label));
        let known: Vec<String> = known.collect();
        let known = known.join(", ");
        return Err(format!(
            "family {name} has no case `{label}`; known: {known}"
        ));
    };
    Ok(cases.swap_remove(at).scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case;
    use crate::families::Family;
    use raystone_accel::AccelRegistry;

    #[test]
    fn every_twin_tells_as_many_nodes_and_triangles_as_it_counts_and_ends_with_brute_force() {
        let cases = Family::named("vertices").unwrap().cases(1, true, 3);
        let case = cases.first().unwrap();
        let soup = TriangleSoup::new(&case.scene);
        for kind in AccelRegistry::default().iter() {
            for ray in &case.rays {
                let built = bench::build_with(kind, &Params::default(), &soup).unwrap();
                let mut counters = Counters::default();
                let twin = built.cpu_twin(&soup).unwrap();
                let (_, events) = watch(|| twin.closest_hit(ray, &mut counters));
                let count = |is: fn(&Event) -> bool| events.iter().filter(|e| is(e)).count() as u32;
                let nodes = count(|e| matches!(e, Event::Node(_)));
                let triangles = count(|e| matches!(e, Event::Triangle(_)));
                let name = kind.name();
                assert_eq!(nodes, counters.nodes, "{name}");
                assert_eq!(triangles, counters.triangle_tests, "{name}");
                let params = Params::default();
                let (text, equal) = explain(&case.scene, &soup, kind, &params, ray).unwrap();
                assert!(equal && text.contains("exactly hit"), "{name}: {text}");
            }
        }
        assert!(watch(|| ()).1.is_empty());
    }

    #[test]
    fn an_address_leads_back_to_its_scene_and_an_unknown_one_says_what_is_missing() {
        let cases = Family::named("needles").unwrap().cases(4, true, 5);
        let scene_of = |family: &str, label: &str| {
            scene_of(&case::Address {
                family: family.into(),
                label: label.into(),
                seed: 4,
            })
        };
        for case in &cases {
            let scene = scene_of("needles", &case.label).unwrap();
            assert_eq!(scene.triangles, case.scene.triangles);
        }
        for (family, missing) in [("nails", "nails"), ("needles", "`x`")] {
            let error = scene_of(family, "x").unwrap_err();
            assert!(error.contains(missing), "{error}");
        }
    }
}

//! The checks check themselves: every run plants faults into copies of the data that its own
//! comparisons look at, and each must show. A comparison that has gone blind passes everything.

use crate::gate::{ReferenceTracer, compare, verdict};
use crate::image_gate::{Answer, differing_sum, differs, judge};
use crate::path_oracle::{PathOracle, View};
use crate::rays::RaySet;
use glam::{DVec3, Vec3};
use raystone_accel::oracle::{Fault, Verdict, judge_closest_hits};
use raystone_accel::{Hit, NO_HIT, Ray, Space, TriangleSoup};
use raystone_core::geometry::Triangle;
use raystone_gpu::KERNEL_ERRORS;
use raystone_image::Image;
use raystone_record::{ClassVerdict, ReferenceCheck};
use raystone_scene::SceneData;

/// Answers of a class: closest hits, and any hits.
type Answers = (Vec<Hit>, Vec<Option<bool>>);

/// A fault in the answer to one ray, and whether only bits show it, which adapters with other
/// arithmetic than the host's are not compared by.
type Plant = (&'static str, bool, fn(&mut Answers, usize));

const PLANTS: [Plant; 6] = [
    ("a distance one ulp too long", true, |(hits, _), at| {
        hits[at].t = f32::from_bits(hits[at].t.to_bits() ^ 1);
    }),
    ("a coordinate one ulp off", true, |(hits, _), at| {
        hits[at].u = f32::from_bits(hits[at].u.to_bits() ^ 1);
    }),
    ("a neighbour's triangle", true, |(hits, _), at| {
        hits[at].triangle ^= 1;
    }),
    ("a hit at half the distance", false, |(hits, _), at| {
        hits[at].t = 0.5 * hits[at].t.min(f32::MAX) - 0.1;
    }),
    ("an any-hit answer turned round", false, |(_, found), at| {
        found[at] = found[at].map(|is| !is);
    }),
    ("no any-hit answer", false, |(_, found), at| {
        found[at] = None
    }),
];

/// Rays of the reference that its own fault is planted among.
const OF_REFERENCE: usize = 64;

/// Plants wrong answers to single rays, error words, and a wrong reference. Returns what was not
/// seen, or `None`. `exact` is true for an adapter with the host's arithmetic.
pub fn unseen_hit(
    scene: &SceneData,
    soup: &TriangleSoup,
    reference: &ReferenceTracer,
    exact: bool,
) -> Option<String> {
    let hit = |set: &RaySet| set.truth.iter().position(|hit| hit.triangle != NO_HIT);
    let (set, first) = reference
        .sets
        .iter()
        .find_map(|set| Some((set, hit(set)?)))?;
    let exact = exact && soup.intersection.triangle.is_exact();
    let unseen = in_class(set, first, exact, &|(hits, found)| {
        compare(set, hits, found, soup, Space::World, exact).wrong
    });
    let unseen = unseen.or_else(|| in_verdict(set, reference));
    let first_of = |set: &RaySet| hit(set).map(|at| (set.rays[at], set.truth[at]));
    let hits: Vec<_> = reference.sets.iter().filter_map(first_of).collect();
    unseen.or_else(|| in_reference(scene, soup, reference, &hits))
}

/// At the first ray, at a hit, and at the last ray; `wrong` counts the wrong rays.
fn in_class(
    set: &RaySet,
    first: usize,
    exact: bool,
    wrong: &dyn Fn(&Answers) -> usize,
) -> Option<String> {
    let found = set.truth.iter().map(|hit| Some(hit.triangle != NO_HIT));
    let right: Answers = (set.truth.clone(), found.collect());
    if wrong(&right) != 0 {
        return Some("that right answers are right".to_owned());
    }
    for (name, of_bits, plant) in PLANTS {
        for at in [0, first, set.rays.len() - 1] {
            let mut answers = right.clone();
            plant(&mut answers, at);
            if (exact || !of_bits) && wrong(&answers) != 1 {
                return Some(format!("{name}, at ray {at}"));
            }
        }
    }
    let (mut hits, found) = right;
    hits.pop();
    (wrong(&(hits, found)) != 1).then(|| "a missing last answer".to_owned())
}

fn in_verdict(set: &RaySet, reference: &ReferenceTracer) -> Option<String> {
    let class = |wrong| ClassVerdict {
        class: set.class,
        rays: set.rays.len(),
        wrong,
        ties: 0,
        first_wrong: None,
    };
    let passed = |wrong, errors| verdict(vec![class(0), class(wrong)], errors, reference).passed;
    let sound = reference.is_sound();
    if passed(0, 0) != sound || passed(1, 0) {
        return Some("a class with a wrong ray".to_owned());
    }
    let unseen = KERNEL_ERRORS.iter().find(|(bit, _)| {
        let judged = verdict(vec![class(0)], *bit, reference);
        judged.passed || judged.kernel_errors.is_empty()
    });
    unseen.map(|(bit, text)| format!("the error word {bit} ({text})"))
}

fn in_reference(
    scene: &SceneData,
    soup: &TriangleSoup,
    reference: &ReferenceTracer,
    hits: &[(Ray, Hit)],
) -> Option<String> {
    let most = reference.sets.iter().map(|set| set.rays.len()).max()?;
    let right = reference.thinned(most.div_ceil(OF_REFERENCE));
    let mut wrong = right.thinned(1);
    wrong.brute_force = ReferenceCheck::default();
    let last = wrong.sets.last_mut()?.truth.last_mut()?;
    last.v += 0.25;
    let truth = right.subset(usize::MAX).into_iter().chain(right.hard());
    wrong.check_brute_force(u64::MAX, 1, |_| truth.map(|(_, hit)| hit).collect());
    if wrong.brute_force.wrong != 1 || wrong.is_sound() {
        return Some("a wrong answer of the reference tracer".to_owned());
    }
    let mut refuted_once = right.thinned(1);
    refuted_once.brute_force = ReferenceCheck::default();
    refuted_once.oracle = ReferenceCheck::default();
    let verdict = Verdict::Wrong(Fault::FalseBlock);
    refuted_once.note_oracle(&right.subset(1), vec![verdict]);
    if refuted_once.oracle.wrong != 1 || refuted_once.is_sound() {
        return Some("a distance that the oracle says is wrong".to_owned());
    }
    // As many as there are classes are some of each, the last one included.
    let timed = || right.sets.iter().filter(|set| set.is_timed());
    let few = right.subset(timed().count());
    let of_last = |set: &RaySet| few.last().is_some_and(|(ray, _)| set.rays.contains(ray));
    if !timed().next_back().is_some_and(of_last) {
        return Some("the last class of rays, which is left out of what is compared".to_owned());
    }
    let of_scene = refuted(&scene.triangles, soup, hits);
    let is_seen = of_scene.is_some() && refuted(&[PLAIN], soup, &plain()) == Some(1);
    (!is_seen).then(|| "a distance that double precision refutes".to_owned())
}

/// A triangle that a ray meets in its middle: in some scenes, rounding explains every answer.
const PLAIN: Triangle = Triangle {
    vertices: [
        Vec3::new(-1.0, -1.0, 0.0),
        Vec3::new(2.0, -1.0, 0.0),
        Vec3::new(-1.0, 2.0, 0.0),
    ],
};

fn plain() -> [(Ray, Hit); 1] {
    let ray = Ray {
        origin: [0.0, 0.0, 1.0],
        t_min: 0.0,
        direction: [0.0, 0.0, -1.0],
        t_max: 4.0,
    };
    let hit = Hit {
        t: 1.0,
        triangle: 0,
        ..Hit::miss(&ray)
    };
    [(ray, hit)]
}

/// The number of right distances that double precision confirms, if it refutes a wrong one for each. That is wrong by
/// the size of the scene: beside a triangle millions of times as large, rounding explains much.
fn refuted(triangles: &[Triangle], soup: &TriangleSoup, hits: &[(Ray, Hit)]) -> Option<usize> {
    let corners = triangles.iter().flat_map(|t| t.vertices);
    let (low, high) = corners.fold((Vec3::MAX, Vec3::MIN), |(low, high), corner| {
        (low.min(corner), high.max(corner))
    });
    let asked = |farther: bool| {
        let question = |(ray, hit): &(Ray, Hit)| {
            let length = Vec3::from(ray.direction).length();
            let wrong = (2.0 * hit.t + (high - low).length() / length).min(f32::MAX);
            let ray = Ray {
                t_max: ray.t_max.max(wrong),
                ..soup.intersection.raised(ray)
            };
            (
                ray,
                Some((hit.triangle, if farther { wrong } else { hit.t })),
            )
        };
        let questions: Vec<_> = hits.iter().map(question).collect();
        judge_closest_hits(triangles, &questions)
    };
    let (right, wrong) = (asked(false), asked(true));
    let pairs = right.iter().zip(&wrong);
    let confirmed: Vec<&Verdict> = pairs
        .filter_map(|(right, wrong)| (*right == Verdict::Agrees).then_some(wrong))
        .collect();
    let is_wrong = |verdict: &&&Verdict| matches!(verdict, Verdict::Wrong(_));
    (confirmed.iter().filter(is_wrong).count() == confirmed.len()).then_some(confirmed.len())
}

/// Lit paths that are tried: rounding may explain what is planted in one of them.
const TRIED: usize = 8;
/// Relative error of a planted pixel.
const OFF: f64 = 2e-3;

/// Plants a wrong pixel among these answers of kernels, and in a sum. Returns what was not seen, or
/// `None`, also where there is no light.
pub fn unseen_pixel(oracle: &PathOracle, view: &View, answers: &[Answer]) -> Option<String> {
    let is_lit = |answer: &&Answer| answer.radiance.min_element() > 0.0;
    let mut lit = answers.iter().rev().filter(is_lit).take(TRIED).peekable();
    let last = *lit.peek()?;
    let is_seen = |answer: &Answer| {
        let wrong = Answer {
            radiance: answer.radiance * (1.0 + OFF),
            ..*answer
        };
        let judged = judge(oracle, view, &[wrong]);
        // Textures leave few digits: rounding may explain it in each of these paths.
        judged.wrong == 1 || oracle.texturing() == 2 && judged.fault.is_some()
    };
    if !lit.any(is_seen) {
        return Some(format!("{}, {OFF} too bright", last.id));
    }
    let nothing = Answer {
        radiance: DVec3::NAN,
        ..*last
    };
    let path = oracle.trace(view, last.id, crate::path_oracle::Rounding::none());
    if !differs(&nothing, &path, 0.0) {
        return Some(format!("{}, no number", last.id));
    }
    let pixels: Vec<[f32; 3]> = answers
        .iter()
        .map(|a| a.radiance.as_vec3().to_array())
        .collect();
    let image = |pixels| Image {
        width: answers.len() as u32,
        height: 1,
        pixels,
    };
    let mut off = pixels.clone();
    let value = &mut off.last_mut()?[2];
    *value = *value * 1.001 + 0.001;
    let is_seen = differing_sum(&image(off), &[image(pixels)]).is_some();
    (!is_seen).then(|| "a sum whose last pixel is a thousandth off".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_record::RayClass;

    #[test]
    fn each_way_of_being_blind_is_told() {
        let ray = Ray::new(glam::Vec3::ZERO, glam::Vec3::Z);
        let hit = Hit {
            t: 2.0,
            triangle: 4,
            u: 0.25,
            v: 0.5,
        };
        let set = RaySet {
            class: RayClass::Primary,
            rays: vec![ray; 3],
            truth: vec![Hit::miss(&ray), hit, Hit::miss(&ray)],
            shadow: Vec::new(),
        };
        let truth = |at: usize| (set.truth[at], Some(set.truth[at].triangle != NO_HIT));
        let differ = |(hits, found): &Answers, is: &dyn Fn(&Hit, &Hit) -> bool| {
            let is_wrong = |at: &usize| {
                let (right, expected) = truth(*at);
                hits.get(*at).is_none_or(|hit| is(hit, &right)) || found[*at] != expected
            };
            (0..3).filter(is_wrong).count()
        };
        let said = |wrong: &dyn Fn(&Answers) -> usize| in_class(&set, 1, true, wrong);
        let by_bits = |a: &Hit, b: &Hit| !a.same_bits(b);
        assert_eq!(said(&|answers| differ(answers, &by_bits)), None);
        type Blind = fn(&Hit, &Hit) -> bool;
        let blind: [(Blind, &str); 3] = [
            (
                |a, b| (a.t - b.t).abs() > 1e-3 || a.triangle != b.triangle,
                "ulp too long",
            ),
            (
                |a, b| a.t != b.t || a.triangle != b.triangle,
                "coordinate one ulp off",
            ),
            (|a, b| a.t != b.t || a.u != b.u, "a neighbour's triangle"),
        ];
        for (is, part) in blind {
            let unseen = said(&|answers| differ(answers, &is)).unwrap_or_default();
            assert!(unseen.contains(part), "{part}: {unseen}");
        }
        let no_end = |(hits, found): &Answers| {
            let right = (set.truth[2], Some(false));
            let mut answers = (hits.clone(), found.clone());
            answers.0.resize(3, right.0);
            (answers.0[2], answers.1[2]) = right;
            differ(&answers, &by_bits)
        };
        assert!(said(&no_end).is_some_and(|fault| fault.contains("at ray 2")));
        let no_any = |(hits, _): &Answers| {
            let right = set.truth.iter().map(|hit| Some(hit.triangle != NO_HIT));
            differ(&(hits.clone(), right.collect()), &by_bits)
        };
        assert!(said(&no_any).is_some_and(|fault| fault.contains("any-hit")));
        assert!(said(&|_| 1).is_some_and(|fault| fault.contains("right answers")));
    }
}

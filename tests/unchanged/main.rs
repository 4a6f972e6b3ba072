//! Results stay the same: hits, counted work, images and discrepancies of every structure, integrator and sampler are
//! compared with hashes that were recorded once.
//!
//! After an intended change, write the table anew with `RAYSTONE_WRITE_HASHES=1 scripts/test --test unchanged`, and
//! list in the change log the figures that are no longer comparable.

#[path = "../support/mod.rs"]
mod support;

use blake3::Hasher;
use raystone::accel::{AccelKind, Query};
use raystone::discrepancy::{Budget, Measure, PointSet, measure};
use raystone::measure::gate::Checks;
use raystone::sampling::{Coordinate, to_unit};
use std::collections::BTreeMap;
use std::path::Path;
use support::*;

/// `kind subject hash`, one a line, in alphabetical order.
const HASHES: &str = include_str!("hashes.txt");
/// Images depend on the driver's sine and cosine: they are compared where the adapter is this one, which
/// the table names in a line of its own.
const ADAPTER: &str = "adapter";

/// The hashes computed, by kind and subject.
type Found = BTreeMap<String, String>;

fn short(hash: blake3::Hash) -> String {
    hash.to_hex()[..16].to_owned()
}

/// Compares with the table, or writes its lines of these kinds anew.
fn compare(kinds: &[&str], found: &Found) {
    let is_ours = |line: &str| kinds.iter().any(|k| line.split(' ').next() == Some(k));
    let line = |(k, v): (&String, &String)| format!("{k} {v}").trim_end().to_owned();
    let lines: Vec<String> = found.iter().map(line).collect();
    assert!(lines.len() > 20 && lines.iter().all(|line| is_ours(line)));
    if std::env::var_os("RAYSTONE_WRITE_HASHES").is_some() {
        static ONE_AT_A_TIME: std::sync::Mutex<()> = std::sync::Mutex::new(());
        let _guard = ONE_AT_A_TIME.lock();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/unchanged/hashes.txt");
        let old = std::fs::read_to_string(&path).expect("the table");
        let others = old.lines().filter(|line| !is_ours(line)).map(str::to_owned);
        let mut all: Vec<String> = others.chain(lines).collect();
        all.sort();
        return std::fs::write(&path, all.join("\n") + "\n").expect("the table is written");
    }
    if let Err(differences) = differences(HASHES, kinds, &lines) {
        panic!("{differences}");
    }
}

/// The hash in the table, for subjects not computed in this turn.
fn known(subject: &str) -> String {
    let line = HASHES
        .lines()
        .find_map(|line| line.strip_prefix(subject)?.strip_prefix(' '));
    line.unwrap_or("is not in the table").to_owned()
}

/// Lists the lines of one of the two that are not in the other.
fn differences(table: &str, kinds: &[&str], lines: &[String]) -> Result<(), String> {
    let ours = |line: &&str| kinds.iter().any(|k| line.split(' ').next() == Some(k));
    let known: Vec<&str> = table.lines().filter(ours).collect();
    let is_new = |line: &&String| !known.contains(&line.as_str());
    let new: Vec<_> = lines.iter().filter(is_new).collect();
    let is_gone = |known: &&&str| !lines.iter().any(|line| line == **known);
    let gone: Vec<_> = known.iter().filter(is_gone).collect();
    if new.is_empty() && gone.is_empty() {
        Ok(())
    } else {
        Err(format!(
            "changed or new: {new:#?}\nchanged or no longer there: {gone:#?}"
        ))
    }
}

#[test]
fn a_changed_a_new_and_a_missing_line_are_seen() {
    let table = "hits a 1\nhits b 2\nimage c 3\n";
    let lines = |texts: &[&str]| -> Vec<String> { texts.iter().map(|t| (*t).to_owned()).collect() };
    let check = |texts: &[&str]| differences(table, &["hits"], &lines(texts));
    assert_eq!(check(&["hits a 1", "hits b 2"]), Ok(()));
    assert!(check(&["hits a 1", "hits b 3"]).is_err());
    assert!(check(&["hits a 1"]).is_err());
    assert!(check(&["hits a 1", "hits b 2", "hits d 4"]).is_err());
}

fn adapter() -> String {
    let info = &gpu().info;
    format!("{ADAPTER} {} {}", info.name, info.driver_info)
        .replace(", ", " ")
        .trim_end()
        .to_owned()
}

/// Small scenes that lead through all there is: emitters, mirrors, the sky, instances, hard triangles.
fn scenes() -> Vec<(&'static str, Stage)> {
    use raystone::params::ParamValue::Integer;
    let sphere = [("triangles", Integer(2000))];
    let known: [(&str, &[_]); 5] = [
        ("cornell-box", &[]),
        ("displaced-sphere", &sphere),
        ("far-corners", &[]),
        ("furnace-box", &[]),
        ("instances", &[]),
    ];
    let stage =
        |(name, changes): (&'static str, &[_])| (name, Stage::builtin(gpu(), name, changes));
    known.into_iter().map(stage).collect()
}

/// A mirror, a tilted picture and a floor.
const MODEL: &str = "mtllib model.mtl
v -3 -1 3\nv 3 -1 3\nv 3 -1 -3\nv -3 -1 -3
v -2 -1 -1\nv 0 -1 -2\nv 0 1.5 -2\nv -2 1.5 -1
v 0.2 -1 0\nv 1.9 -1 -0.7\nv 1.7 1 -1.4\nv 0 1 -0.8
v -1 3 -1\nv 1 3 -1\nv 1 3 1\nv -1 3 1
vt 0 0\nvt 2.5 0\nvt 2.5 1.5\nvt 0 1.5
usemtl floor\nf 1 2 3 4\nusemtl mirror\nf 5 6 7 8\nusemtl picture\nf 9/1 10/2 11/3 12/4\n";
const LAMP: &str = "usemtl lamp\nf 13 14 15 16\n";
const MATERIALS: &str = "newmtl floor\nKd 0.6 0.5 0.4
newmtl mirror\nillum 3\nKd 0 0 0\nKs 0.9 0.8 0.7\nNs 1000
newmtl picture\nKd 0.9 1 0.8\nmap_Kd picture.png
newmtl lamp\nKd 0.1 0.1 0.1\nKe 7 6 5\n";

/// Models with mirror and texture, lit by a lamp and by the sky; and a scene under a plain sky. Images
/// alone: to rays they are nothing new.
fn looks() -> Vec<(&'static str, Stage)> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = image::RgbImage::from_fn(5, 3, |x, y| {
        image::Rgb([40 * x as u8 + 60, 100 * y as u8 + 30, 255 - 50 * x as u8])
    });
    let write = |name: &str, text: String| {
        std::fs::write(folder.path().join(name), text).expect("a writable folder");
    };
    let file = folder.path().join("picture.png");
    picture.save(file).expect("a picture");
    write("model.mtl", MATERIALS.to_owned());
    write("lit.obj", format!("{MODEL}{LAMP}"));
    write("unlit.obj", MODEL.to_owned());
    let load = |name: &str| Stage::new(gpu(), from_file(&folder.path().join(name)));
    vec![
        ("mirror-and-texture", load("lit.obj")),
        ("mirror-and-texture-under-the-sky", load("unlit.obj")),
        ("white-furnace", Stage::builtin(gpu(), "white-furnace", &[])),
    ]
}

/// The structures of the table: `auto` is one of the others, and another one with each table of advice.
fn pinned() -> Vec<&'static dyn AccelKind> {
    let all = inline_structures().into_iter();
    all.filter(|kind| kind.name() != "auto").collect()
}

#[test]
fn hits_and_counted_work() {
    if !is_exact(gpu()) {
        return;
    }
    let mut found = Found::new();
    let all = (0..scenes().len()).flat_map(|at| pinned().into_iter().map(move |k| (at, k.name())));
    let taken = in_turn("structures of unchanged hits", all);
    for (at, (scene, stage)) in scenes().into_iter().enumerate() {
        let judge = stage.judge(Checks::Kept, [256, 1, 1]);
        for kind in pinned() {
            let name = kind.name();
            if !taken.contains(&(at, name)) {
                for subject in ["hits", "work"].map(|what| format!("{what} {scene}/{name}")) {
                    found.insert(subject.clone(), known(&subject));
                }
                continue;
            }
            let traced = stage.traced(gpu(), kind);
            let (mut hits, mut work) = (Hasher::new(), Hasher::new());
            for set in &judge.of(traced.space).sets {
                for query in [Query::Closest, Query::Any] {
                    let rays = &set.rays;
                    let tracer = stage.tracer(&traced, query).expect("a tracer");
                    let batch = tracer.batch(rays).expect("a batch");
                    batch.trace().expect("answers");
                    hits.update(batch.digest().expect("answers").as_bytes());
                    assert_eq!(batch.error_word().expect("a status"), 0);
                    let counted = stage.count_work(&traced, query, rays);
                    for c in counted.expect("counters").expect("it counts") {
                        for word in [c.nodes, c.box_tests, c.triangle_tests, c.stack_high_water] {
                            work.update(&word.to_le_bytes());
                        }
                    }
                }
            }
            found.insert(format!("hits {scene}/{name}"), short(hits.finalize()));
            found.insert(format!("work {scene}/{name}"), short(work.finalize()));
        }
    }
    compare(&["hits", "work"], &found);
}

fn image_hash(
    stage: &Stage,
    traced: &raystone::integrator::Traced,
    sampler: &raystone::sampling::Sampler,
    what: &raystone::params::Variant,
) -> String {
    let renderer = stage.renderer(gpu(), traced, sampler, what, [24, 16], false);
    let mut hash = Hasher::new();
    for shot in renderer.render(&[1, 4], 9).expect("a render") {
        hash.update(bytemuck::cast_slice(&shot.image.pixels));
    }
    short(hash.finalize())
}

#[test]
fn images() {
    if !HASHES.lines().any(|line| line == adapter())
        && std::env::var_os("RAYSTONE_WRITE_HASHES").is_none()
    {
        let why = format!(
            "the images of the table were not made by this {}",
            adapter()
        );
        return support::needs::skip("known-driver", why);
    }
    let integrators = ["primary", "ao", "path"].map(|name| integrator_variant(name, &[]));
    let one = sampler("sobol", "cranley-patterson");
    let mut found = Found::new();
    found.insert(adapter(), String::new());
    let all = pinned()
        .into_iter()
        .flat_map(|k| (0..integrators.len()).map(move |i| (k.name(), i)));
    let taken = in_turn("kernels of unchanged images", all);
    for (scene, stage) in scenes() {
        for kind in pinned() {
            let traced = stage.traced(gpu(), kind);
            for (at, what) in integrators.iter().enumerate() {
                let subject = format!("image {scene}/{}/{what}", kind.name());
                let hash = if taken.contains(&(kind.name(), at)) {
                    image_hash(&stage, &traced, &one, what)
                } else {
                    known(&subject)
                };
                found.insert(subject, hash);
            }
        }
        if scene == "cornell-box" {
            let traced = stage.traced(gpu(), structure("bvh"));
            let samplers = samplers(4);
            let taken = in_turn("samplers of unchanged images", 0..samplers.len());
            for (at, sampler) in samplers.iter().enumerate() {
                let subject = format!("image {scene}/{}/path", sampler.label().replace(' ', ""));
                let hash = if taken.contains(&at) {
                    image_hash(&stage, &traced, sampler, &path(3))
                } else {
                    known(&subject)
                };
                found.insert(subject, hash);
            }
            for entry in raystone::integrator::IntegratorRegistry::default().entries() {
                if entry.name.starts_with("integrand") {
                    let subject = format!("image {scene}/bvh/{}", entry.name);
                    let hash = image_hash(&stage, &traced, &one, &entry.default_variant());
                    found.insert(subject, hash);
                }
            }
        }
    }
    for (scene, stage) in looks() {
        let traced = stage.traced(gpu(), structure("bvh"));
        for what in &integrators {
            let subject = format!("image {scene}/bvh/{what}");
            found.insert(subject, image_hash(&stage, &traced, &one, what));
        }
    }
    compare(&["image", ADAPTER], &found);
}

#[test]
fn discrepancies() {
    let measures = Measure::ALL;
    let mut found = Found::new();
    for sampler in samplers(256) {
        let word = |sample, dimension| {
            f64::from(to_unit(sampler.sample_u32(Coordinate {
                pixel: 3,
                sample,
                dimension,
                seed: 7,
            })))
        };
        for (count, dimensions) in [(256, [4, 5].as_slice()), (32, &[4, 5, 6])] {
            let coordinates = (0..count).flat_map(|i| dimensions.iter().map(move |d| word(i, *d)));
            let points = PointSet::new(dimensions.len(), coordinates.collect()).expect("points");
            let mut hash = Hasher::new();
            for kind in measures {
                let value = measure(&points, kind, &Budget::seconds(60.0));
                hash.update(format!("{kind:?} {value:?}").as_bytes());
            }
            let subject = format!(
                "discrepancy {}/{}d",
                sampler.label().replace(' ', ""),
                dimensions.len()
            );
            found.insert(subject, short(hash.finalize()));
        }
    }
    compare(&["discrepancy"], &found);
}

//! External tracers: registered ones are right, wrong ones detected, missing ones tolerated.

use crate::support;
use crate::support::{Stage, brute_force, builtin, from_file, gpu};
use raystone::accel::{Hit, NO_HIT, Query, Ray, TriangleSoup};
use raystone::gpu::{Elapsed, Gpu, GpuError, Stopwatch};
use raystone::measure::gate::Checks;
use raystone::measure::peer_check::{Differences, differences};
use raystone::measure::rays::RaySet;
use raystone::measure::record::{Body, PeerRecord, RayClass};
use raystone::params::ParamValue;
use raystone::peers::{BuiltPeer, Peer, PeerBatch, PeerRegistry};
use raystone::run::Registries;
use raystone::scene::SceneData;
use std::process::{Command, Output};
use tempfile::TempDir;

struct Subject {
    stage: Stage,
    sets: Vec<RaySet>,
}

fn subject(scene: SceneData) -> Subject {
    let stage = Stage::new(gpu(), scene);
    let sets = stage.judge(Checks::Repeated, [4096, 1_000, 16]).sets;
    let sets = sets.into_iter().filter(RaySet::is_timed).collect();
    Subject { stage, sets }
}

/// A peer's answers to all classes; `None` if it cannot run here.
fn answers(peer: &dyn Peer, subject: &Subject) -> Option<Vec<Vec<Hit>>> {
    let built = match peer.build(gpu(), &subject.stage.soup) {
        Ok(built) => built,
        Err(reason) => {
            support::needs::skip("embree", format!("{}: {reason}", peer.name()));
            return None;
        }
    };
    let of_set = |set: &RaySet| {
        let batch = built
            .batch(set.query(), &set.rays)
            .expect("it takes the rays");
        batch.trace().expect("it answers");
        let first = batch.hits().expect("answers");
        batch.trace().expect("it answers again");
        assert_eq!(first, batch.hits().expect("answers"), "{}", peer.name());
        first
    };
    Some(subject.sets.iter().map(of_set).collect())
}

fn judged(subject: &Subject, answers: &[Vec<Hit>]) -> Result<Vec<Differences>, String> {
    let pairs = subject.sets.iter().zip(answers);
    pairs
        .map(|(set, hits)| differences(&subject.stage.scene, &subject.stage.soup, set, hits))
        .collect()
}

#[test]
fn all_peers_answer_rightly() {
    let scenes = [
        builtin("cornell-box", &[]),
        builtin(
            "displaced-sphere",
            &[("triangles", ParamValue::Integer(20_000))],
        ),
        builtin("foliage", &[("plants", ParamValue::Integer(9))]),
    ];
    let mut ran = 0;
    for scene in scenes {
        let subject = subject(scene);
        for peer in PeerRegistry::default()
            .iter()
            .filter(|p| p.name() != "none")
        {
            let Some(answers) = answers(peer, &subject) else {
                continue;
            };
            let found = judged(&subject, &answers);
            println!("{} on {}: {found:?}", peer.name(), subject.stage.scene.name);
            let found = found.unwrap_or_else(|fault| panic!("{}: {fault}", peer.name()));
            let rays: usize = subject.sets.iter().map(|set| set.rays.len()).sum();
            let unlike: usize = found.iter().map(|f| f.unlike).sum();
            assert!(unlike * 200 < rays, "{}: {unlike} of {rays}", peer.name());
            ran += 1;
        }
    }
    assert!(ran >= 6, "obvhs runs everywhere: {ran}");
}

/// Maps a right answer to that of a faulty tracer.
type Fault = fn(&Subject, &RaySet, usize, Hit) -> Hit;

const FAULTS: [(&str, Fault); 9] = [
    ("a neighbour's triangle", |s, _, _, hit| Hit {
        triangle: match hit.triangle {
            NO_HIT => NO_HIT,
            id => (id + 1) % s.stage.soup.records.len() as u32,
        },
        ..hit
    }),
    ("every thousandth ray misses", |_, set, at, hit| {
        match at % 1000 {
            7 => Hit::miss(&set.rays[at]),
            _ => hit,
        }
    }),
    ("misses are hits of triangle 0", |_, set, _, hit| {
        match (hit.triangle, set.query()) {
            (NO_HIT, _) => Hit {
                t: 1.0,
                triangle: 0,
                ..hit
            },
            _ => hit,
        }
    }),
    ("distances of the ray before", |_, set, at, hit| {
        let before = set.truth[at.max(1) - 1];
        match hit.triangle {
            NO_HIT => hit,
            _ => Hit { t: before.t, ..hit },
        }
    }),
    ("distances half a percent too long", |_, _, _, hit| Hit {
        t: hit.t * 1.005,
        ..hit
    }),
    ("answers of the ray before", |_, set, at, _| {
        set.truth[at.max(1) - 1]
    }),
    ("no answers", |_, set, at, _| Hit::miss(&set.rays[at])),
    ("distances that are no numbers", |_, _, _, hit| Hit {
        t: f32::NAN,
        ..hit
    }),
    ("triangles that do not exist", |s, _, _, hit| {
        match hit.triangle {
            NO_HIT => hit,
            _ => Hit {
                triangle: s.stage.soup.records.len() as u32,
                ..hit
            },
        }
    }),
];

#[test]
fn a_wrong_peer_is_found_out() {
    let subject = subject(builtin("displaced-sphere", &[]));
    let right: Vec<Vec<Hit>> = subject.sets.iter().map(|set| set.truth.clone()).collect();
    assert!(judged(&subject, &right).is_ok());
    for (what, fault) in FAULTS {
        let of_set = |set: &RaySet| -> Vec<Hit> {
            let hits = set.truth.iter().enumerate();
            hits.map(|(at, hit)| fault(&subject, set, at, *hit))
                .collect()
        };
        let wrong: Vec<Vec<Hit>> = subject.sets.iter().map(of_set).collect();
        assert!(judged(&subject, &wrong).is_err(), "not seen: {what}");
    }
    let fewer: Vec<Vec<Hit>> = right.iter().map(|hits| hits[1..].to_vec()).collect();
    assert!(judged(&subject, &fewer).is_err());
}

/// A triangle of Crytek Sponza, 2,725 long and six high: near its middle our default test is off by
/// 3 % of a short distance, and a correct peer must not fail because of it.
#[test]
fn a_distance_that_is_more_exact_than_the_judges_is_right() {
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("sliver.obj");
    let text = "v 1297.64 419.964 570.747\nv -1427.16 419.964 570.746\nv -1431.72 424.466 575.3\nf 1 2 3\n";
    std::fs::write(&file, text).expect("a file");
    let stage = Stage::new(gpu(), from_file(&file));
    let ray = Ray {
        origin: [-5.347412, 420.28558, 571.26],
        direction: [0.7351374, -0.22235402, -0.6404153],
        t_min: 0.0,
        t_max: 1e30,
    };
    let ours = brute_force(&stage.soup, &[ray])[0];
    assert!((0.4525..0.4533).contains(&ours.t), "{ours}");
    // The average of the vertices' distances for this triangle.
    let ours = Hit { t: 0.4389, ..ours };
    let truth = vec![ours];
    let set = RaySet {
        class: RayClass::Chord,
        rays: vec![ray],
        truth,
        shadow: Vec::new(),
    };
    let judged = |t| differences(&stage.scene, &stage.soup, &set, &[Hit { t, ..ours }]);
    for right in [ours.t, 0.452_926, 0.454] {
        assert!(judged(right).is_ok(), "{right}");
    }
    for wrong in [0.0, 0.432, 0.446, 0.46, 1.0, -0.452_926, f32::NAN] {
        assert!(judged(wrong).is_err(), "{wrong}");
    }
}

/// For segments: a hit beyond the end or before the beginning does not count.
#[test]
fn ends_of_rays_are_kept() {
    let scene = builtin("displaced-sphere", &[]);
    let subject = subject(scene);
    let primary = &subject.sets[0];
    let hits = primary.rays.iter().zip(&primary.truth);
    let cut: Vec<Ray> = hits
        .filter(|(_, hit)| hit.triangle != NO_HIT)
        .flat_map(|(ray, hit)| {
            [
                ray.between(0.0, 0.9 * hit.t),
                ray.between(1.1 * hit.t, ray.t_max),
            ]
        })
        .collect();
    let truth = brute_force(&subject.stage.soup, &cut);
    for peer in PeerRegistry::default().iter() {
        let Ok(built) = peer.build(gpu(), &subject.stage.soup) else {
            continue;
        };
        for query in [Query::Closest, Query::Any] {
            let batch = built.batch(query, &cut).expect("it takes the rays");
            batch.trace().expect("it answers");
            let hits = batch.hits().expect("answers");
            let pairs = hits.iter().zip(&truth);
            let is_hit = |hit: &Hit| hit.triangle != NO_HIT;
            let unlike = pairs.filter(|(a, b)| is_hit(a) != is_hit(b)).count();
            assert!(unlike * 200 < hits.len(), "{}: {unlike}", peer.name());
        }
    }
}

const EXPERIMENT: &str = "[run]\nreplicates = 1\nresolution = [16, 16]\nspp = [1]\n\
    [axes]\nscene = [\"cornell-box\"]\naccel = [\"bvh\"]\npeer = [\"obvhs-bvh2\", \"embree\"]\nsequence = [\"sobol\"]\n\
    integrator = [\"primary\"]\n[timing]\nrays = 1024\nrounds = 6\n[gate]\nrays = 256\n[reference]\nspp = 2\n";

fn run(out: &TempDir, changes: &[&str]) -> Output {
    let file = out.path().join("peers.toml");
    std::fs::write(&file, EXPERIMENT).expect("a file");
    let mut command = Command::new(env!("CARGO_BIN_EXE_raystone"));
    command
        .arg("run")
        .arg(&file)
        .args(["--out", "results"])
        .args(changes)
        .current_dir(out.path());
    command.output().expect("the program starts")
}

/// A tracer that answers like obvhs for a number of queries, then misses everything. By its own clock it takes half the
/// time.
struct Tired(u32);

struct TiredBuilt<'a>(Box<dyn BuiltPeer + 'a>, u32);

struct TiredBatch<'a>(
    Box<dyn PeerBatch + 'a>,
    &'a [Ray],
    u32,
    std::cell::Cell<u32>,
);

impl Peer for Tired {
    fn name(&self) -> &'static str {
        "tired"
    }

    fn description(&self) -> &'static str {
        "a caster with a fault"
    }

    fn build<'a>(
        &self,
        gpu: &Gpu,
        soup: &'a TriangleSoup,
    ) -> Result<Box<dyn BuiltPeer + 'a>, String> {
        let registry = PeerRegistry::default();
        let honest = registry.named("peer", "obvhs-bvh2")?.build(gpu, soup)?;
        Ok(Box::new(TiredBuilt(honest, self.0)))
    }
}

impl BuiltPeer for TiredBuilt<'_> {
    fn about(&self) -> String {
        "tired".into()
    }

    fn build_ms(&self) -> f64 {
        1.0
    }

    fn batch<'a>(
        &'a self,
        query: Query,
        rays: &'a [Ray],
    ) -> Result<Box<dyn PeerBatch + 'a>, String> {
        let honest = self.0.batch(query, rays)?;
        Ok(Box::new(TiredBatch(honest, rays, self.1, 0.into())))
    }
}

impl PeerBatch for TiredBatch<'_> {
    fn trace(&self) -> Result<Elapsed, GpuError> {
        self.3.set(self.3.get() + 1);
        if self.3.get() > self.2 {
            Ok(Stopwatch::start().elapsed())
        } else {
            let elapsed = self.0.trace()?;
            let gpu_ms = Some(0.5 * elapsed.wall_ms);
            Ok(Elapsed { gpu_ms, ..elapsed })
        }
    }

    fn hits(&self) -> Result<Vec<Hit>, GpuError> {
        if self.3.get() > self.2 {
            Ok(self.1.iter().map(Hit::miss).collect())
        } else {
            self.0.hits()
        }
    }
}

/// The records of both peers of a run, obvhs and another.
fn with(peer: &'static Tired) -> [PeerRecord; 2] {
    let mut registries = Registries::default();
    registries.peers.register(peer);
    let out = TempDir::new().expect("a folder");
    let text = EXPERIMENT.replace("\"embree\"", "\"tired\"");
    let (_, lines) = support::run(&text, &registries, out.path(), None);
    ["obvhs-bvh2", "tired"].map(|name| {
        let mut found = lines.iter().filter(|line| line.key.label("peer") == name);
        match found.next().map(|line| &line.body) {
            Some(Body::Peer(record)) => record.clone(),
            other => panic!("{name}: {other:?}"),
        }
    })
}

#[test]
fn a_peer_that_is_wrong_from_the_beginning_or_later_gets_no_figures() {
    for peer in [&Tired(0), &Tired(4)] {
        let [honest, tired] = with(peer);
        assert!(honest.failure.is_none() && honest.timings.len() >= 4);
        assert!(
            tired.failure.is_some() && tired.timings.is_empty(),
            "{tired:?}"
        );
    }
}

#[test]
fn the_speed_of_a_peer_is_by_its_own_clock_where_it_has_one() {
    for (record, share) in with(&Tired(u32::MAX)).iter().zip([1.0, 0.5]) {
        assert!(record.timings.len() >= 4, "{record:?}");
        for timing in &record.timings {
            let halves = timing.wall_ms.iter().map(|ms| share * ms);
            assert_eq!(timing.ms, halves.collect::<Vec<_>>());
            let mut sorted = timing.ms.clone();
            sorted.sort_by(f64::total_cmp);
            let [.., low, high, _, _] = sorted[..] else {
                panic!("six rounds");
            };
            let rate = |ms: f64| timing.rays as f64 / ms * 1e-3;
            let speed = timing.mrays_s.value;
            assert!(rate(high) <= speed && speed <= rate(low), "{timing:?}");
        }
    }
}

#[test]
fn a_run_shows_peers_apart_and_goes_on_without_one() {
    let out = TempDir::new().expect("a folder");
    let ran = run(&out, &[]);
    let text = String::from_utf8_lossy(&ran.stderr);
    // The two-sample reference is too noisy, which fails a check; a missing or wrong peer does not.
    let checks: Vec<&str> = text.lines().filter(|l| l.starts_with("failed:")).collect();
    assert!(
        checks.iter().all(|l| l.contains("Reference noise")),
        "{text}"
    );
    let read =
        |name: &str| std::fs::read_to_string(out.path().join("results").join(name)).expect(name);
    let records = read("records.jsonl");
    let peers: Vec<&str> = records
        .lines()
        .filter(|l| l.contains("\"kind\":\"peer\""))
        .collect();
    assert_eq!(peers.len(), 2, "{records}");
    let is_native = |l: &&&str| l.contains("obvhs 0.4") && l.contains("cpu_ms");
    assert!(peers.iter().any(|l| is_native(&l)), "{peers:?}");
    let is_embree = |l: &&&str| l.contains("Embree ") || l.contains("is not found");
    assert!(peers.iter().any(|l| is_embree(&l)), "{peers:?}");
    let summary = read("summary.md");
    let verdict = summary.find("Verdict").expect("a verdict");
    let end = verdict + summary[verdict..].find("\n## ").expect("another section");
    assert!(
        !summary[verdict..end].contains("obvhs"),
        "a peer in the verdict"
    );
    assert!(summary.contains("Time of the processors over that of a peer"));
    let figures = read("figures.csv");
    assert!(figures.contains("cpu-over-peer/v1") && figures.contains("unlike-judge/v1"));
}

#[test]
fn an_unknown_peer_is_answered_with_the_known_ones() {
    let out = TempDir::new().expect("a folder");
    let ran = run(&out, &["--set", "axes.peer=[\"obvhs-bvh\"]"]);
    let text = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(2), "{text}");
    assert!(text.contains("obvhs-bvh2"), "{text}");
}

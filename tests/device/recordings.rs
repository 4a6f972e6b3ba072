//! Recordings: ordered steps, one submission, times per step, nothing made twice, limits.

use crate::support::{alone, open};
use raystone::gpu::{
    Bindings, Composition, Gpu, GpuError, Groups, KernelLibrary, Pipeline, Player, Recording,
    Storage, UniformValues,
};
use std::path::Path;
use std::sync::{Arc, OnceLock};

const WORDS: u32 = 256;
const BYTES: u64 = WORDS as u64 * 4;

fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/device/recordings/kernels");
        open(
            KernelLibrary::default()
                .with_folder(&folder)
                .expect("kernels"),
        )
    })
}

fn kernel(name: &str) -> Arc<Pipeline> {
    let pipeline = gpu().pipeline(&Composition::new(name), true);
    pipeline.unwrap_or_else(|e| panic!("{e}"))
}

fn adding(number: u32, words: &Storage) -> Bindings {
    let mut bindings = Bindings::new();
    let values = UniformValues::new()
        .u32("count", WORDS)
        .u32("number", number);
    bindings.buffer("words", words).uniform("add", values);
    bindings
}

/// Clears, adds 3 to all words, then 40 to those of as many workgroups as an earlier step decides.
fn recording(words: &Storage, wanted: u32) -> Recording {
    let groups = Storage::scratch("groups", 12);
    let mut plan = Bindings::new();
    let wanted = gpu().storage("wanted", &[wanted]).expect("a buffer");
    plan.buffer("wanted", &wanted).buffer("groups", &groups);
    let (add, copy) = (kernel("test/add"), Storage::scratch("copy", BYTES));
    let mut out = Recording::new();
    out.clear(words)
        .run("three", &add, &adding(3, words), [4, 1, 1])
        .copy(words, &copy)
        .run("plan", &kernel("test/plan"), &plan, [1, 1, 1])
        .run(
            "forty",
            &add,
            &adding(40, words),
            Groups::Indirect(groups, 0),
        )
        .download("before", &copy)
        .download("after", words);
    out
}

#[test]
fn steps_run_in_order_and_are_timed_one_by_one() {
    let player = Player::new(gpu());
    let words = Storage::scratch("words", BYTES);
    for _ in 0..2 {
        let played = player.play(&recording(&words, 1)).expect("it plays");
        let before: Vec<u32> = played.download("before").expect("words");
        let after: Vec<u32> = played.download("after").expect("words");
        assert_eq!(before, [3; WORDS as usize]);
        assert_eq!(after[..64], [43; 64]);
        assert_eq!(after[64..], [3; WORDS as usize - 64]);
        assert!(played.download::<u32>("words").is_err());
        let names: Vec<&str> = played.runs.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["three", "plan", "forty"]);
        let timed = gpu().timestamp_period.is_some();
        assert!(played.runs.iter().all(|(_, ms)| ms.is_some() == timed));
        assert!(played.wall_ms() > 0.0 && played.elapsed().gpu_ms.is_some() == timed);
    }
}

#[test]
fn what_is_played_again_makes_nothing_new() {
    let player = Player::new(gpu());
    let words = Storage::Own(gpu().zeroed("words", BYTES).expect("a buffer"));
    let recording = recording(&words, 4);
    player.play(&recording).expect("it plays");
    let made = player.made();
    assert!(made > 5, "{made}");
    for _ in 0..3 {
        let played = player.play(&recording).expect("it plays");
        assert_eq!(played.download::<u32>("after").expect("words"), [43; 256]);
    }
    assert_eq!(player.made(), made);
    // A larger scratch buffer is a new one.
    let mut larger = Recording::new();
    larger.clear(Storage::scratch("copy", 2 * BYTES));
    player.play(&larger).expect("it plays");
    assert!(player.made() > made);
}

#[test]
fn uniforms_of_two_runs_of_one_kernel_are_kept_apart() {
    let player = Player::new(gpu());
    let words = Storage::scratch("words", BYTES);
    for numbers in [[1, 20], [300, 20], [300, 4000]] {
        let mut recording = Recording::new();
        recording.clear(&words);
        for number in numbers {
            recording.run(
                "add",
                &kernel("test/add"),
                &adding(number, &words),
                [4, 1, 1],
            );
        }
        recording.download("words", &words);
        let played = player.play(&recording).expect("it plays");
        let found: Vec<u32> = played.download("words").expect("words");
        assert_eq!(found, [numbers[0] + numbers[1]; 256]);
    }
}

#[test]
fn more_workgroups_than_the_adapter_runs_are_refused() {
    let player = Player::new(gpu());
    let words = Storage::scratch("words", BYTES);
    let limit = gpu().limits.max_compute_workgroups_per_dimension;
    for (wanted, refused) in [(limit, false), (limit + 1, true)] {
        let mut direct = Recording::new();
        direct.run(
            "add",
            &kernel("test/add"),
            &adding(1, &words),
            [1, wanted, 1],
        );
        let played = player.play(&recording(&words, wanted));
        for (step, played) in [("forty", played), ("add", player.play(&direct))] {
            match played {
                Err(GpuError::TooManyGroups {
                    step: at, groups, ..
                }) => {
                    assert!(refused && at == step && groups.contains(&wanted), "{at}");
                }
                other => assert!(!refused, "{step}: {:?}", other.map(|played| played.runs)),
            }
        }
    }
}

#[test]
fn a_missing_binding_is_named_and_the_player_goes_on() {
    let player = Player::new(gpu());
    let mut faulty = Recording::new();
    faulty.run("add", &kernel("test/add"), &Bindings::new(), [1, 1, 1]);
    let error = player.play(&faulty).err().map(|e| e.to_string());
    assert!(
        error.as_deref().is_some_and(|e| e.contains("binds `")),
        "{error:?}"
    );
    let words = Storage::scratch("words", BYTES);
    assert!(player.play(&recording(&words, 1)).is_ok());
}

#[test]
fn the_first_use_of_a_kernel_is_told_on_its_own() {
    let own = alone(KernelLibrary::default());
    let kernel = Composition::new("common/loops").feature("loops_cut", true);
    let pipeline = own.pipeline(&kernel, false).expect("it compiles");
    assert_eq!(pipeline.cold_ms(), None);
    let mut bindings = Bindings::new();
    bindings
        .buffer("turns", Storage::scratch("turns", 8))
        .buffer("status", Storage::scratch("status", 64))
        .uniform(
            "loops",
            UniformValues::new().u32("outer", 1).u32("inner", 1),
        );
    let mut recording = Recording::new();
    recording.run("loops", &pipeline, &bindings, [1, 1, 1]);
    assert_eq!(recording.cold_ms(), [("common/loops".to_owned(), None)]);
    let player = Player::new(&own);
    let first = player.play(&recording).expect("it plays").wall_ms();
    let cold = pipeline.cold_ms().expect("it ran");
    println!("cold {cold:.2} ms, then {first:.2} ms");
    assert!(cold > 0.0);
    // Once: the next play changes nothing.
    player.play(&recording).expect("it plays");
    assert_eq!(
        recording.cold_ms(),
        [("common/loops".to_owned(), Some(cold))]
    );
}

#[test]
fn more_runs_than_timestamps_are_played_in_parts_and_all_of_them() {
    let words = Storage::scratch("many", BYTES);
    let mut recording = Recording::new();
    recording.clear(&words).download("before", &words);
    let add = kernel("test/add");
    for number in 0..2100 {
        recording.run("add", &add, &adding(number % 3, &words), [4, 1, 1]);
    }
    recording.download("after", &words);
    let player = Player::new(gpu());
    for _ in 0..2 {
        let played = player.play(&recording).expect("it plays");
        assert_eq!(played.runs.len(), 2100);
        assert!(played.elapsed().gpu_ms.is_none_or(|ms| ms > 0.0));
        // Each waits for the one before: all together take no longer than the host waited for all parts.
        let own: f64 = played.runs.iter().filter_map(|(_, ms)| *ms).sum();
        let waited = played.elapsed().wall_ms;
        assert!(own <= 1.5 * waited + 0.5, "{own} ms in {waited} ms");
        assert_eq!(
            played.download::<u32>("before").expect("words"),
            [0; WORDS as usize]
        );
        assert_eq!(
            played.download::<u32>("after").expect("words"),
            [2100; WORDS as usize]
        );
    }
}

#[test]
fn kernels_that_are_compared_are_compiled_apart_and_in_turns() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/device/recordings/kernels");
    let library = || {
        KernelLibrary::default()
            .with_folder(&folder)
            .expect("kernels")
    };
    // The same texts under another name: a separate library.
    let other = tempfile::tempdir().expect("a folder");
    std::fs::write(other.path().join("beside.wesl"), "const BESIDE = 1u;").expect("a file");
    let other = library().with_folder(other.path()).expect("kernels");
    let add = |gpu: &Gpu| {
        gpu.pipeline(&Composition::new("test/add"), true)
            .expect("a kernel")
    };
    let once = alone(library());
    let shared = [add(&once), add(&once.with_kernels(other.clone()))];
    assert!(Arc::ptr_eq(&shared[0], &shared[1]));
    let base = alone(library()).compiled_apart(3);
    let candidate = base.with_kernels(other);
    let kernels = [add(&base), add(&candidate)];
    assert!(!Arc::ptr_eq(&kernels[0], &kernels[1]));
    assert_eq!(kernels[0].kernel.wgsl, kernels[1].kernel.wgsl);
    let player = Player::new(&base);
    let words = Storage::scratch("words", BYTES);
    for round in 0..7 {
        base.take_turn(round);
        let mut recording = Recording::new();
        recording
            .clear(&words)
            .run("add", &kernels[0], &adding(3, &words), [4, 1, 1])
            .download("words", &words);
        let played = player.play(&recording).expect("it plays");
        let words: Vec<u32> = played.download("words").expect("words");
        assert_eq!(words, [3; WORDS as usize], "round {round}");
        assert_eq!(kernels[0].compilations(), 3.min(round + 1));
    }
    assert_eq!(kernels[1].compilations(), 1);
}

//! Every registered method against the host, at all boundary sizes.

use crate::support::{gpu, in_turn};
use raystone::compaction::{Compaction, CompactionRegistry, Passes, Stays, Stream};
use raystone::gpu::{Gpu, Groups, Player, Recording, Storage};
use raystone::measure::compaction::{Bench, Inputs, stream};
use raystone::params::{ParamValue, Params, Variant};
use std::sync::Arc;

pub fn variant(name: &str, params: &[(&str, i64)]) -> Variant {
    let params = params.iter();
    let params = params.map(|(name, x)| ((*name).to_owned(), ParamValue::Integer(*x)));
    Variant {
        name: name.to_owned(),
        params: Params(params.collect()),
        label: name.to_owned(),
    }
}

pub fn method(name: &str, params: &[(&str, i64)]) -> Arc<dyn Compaction> {
    let made = CompactionRegistry::default().configured(&variant(name, params));
    made.unwrap_or_else(|e| panic!("{e}"))
}

/// Each method with default parameters, and some with others; reports those that cannot run.
fn methods(gpu: &Gpu) -> Vec<(String, Arc<dyn Compaction>)> {
    let registry = CompactionRegistry::default();
    let mut variants: Vec<Variant> =
        (registry.0.iter().map(|kind| variant(kind.name(), &[]))).collect();
    assert!(variants.len() >= 9, "{} methods", variants.len());
    let further: [(&str, &[(&str, i64)]); 10] = [
        ("workgroup", &[("lanes", 32), ("per_lane", 4)]),
        ("reduce-scan-scatter", &[("lanes", 8), ("per_lane", 3)]),
        ("bucket-sort", &[("buckets", 9), ("per_lane", 4)]),
        ("bucket-sort", &[("buckets", 1), ("lanes", 33)]),
        ("radix-sort", &[("buckets", 255)]),
        ("roger", &[("block", 2)]),
        ("roger", &[("block", 16)]),
        ("roger", &[("block", 100)]),
        ("roger", &[("block", 256)]),
        ("roger", &[("block", 1024)]),
    ];
    variants.extend(further.map(|(name, params)| Variant {
        label: format!("{name}{params:?}"),
        ..variant(name, params)
    }));
    let mut bisection = variant("roger", &[]);
    bisection.label = "roger by bisection".to_owned();
    let halves = ParamValue::Name("bisection".to_owned());
    bisection.params.0.insert("search".to_owned(), halves);
    variants.push(bisection);
    let made = variants.iter().filter_map(|variant| {
        let made = registry
            .configured(variant)
            .unwrap_or_else(|e| panic!("{e}"));
        match made.refusal(gpu) {
            Some(reason) => println!("skipped: {reason}"),
            None => return Some((variant.label.clone(), made)),
        }
        None
    });
    made.collect()
}

/// The error of a method over the first `length` of these flags.
pub fn fault(
    gpu: &Gpu,
    method: &Arc<dyn Compaction>,
    flags: &[u32],
    bytes: u32,
    room: [u32; 2],
) -> Option<String> {
    let player = Arc::new(Player::new(gpu));
    let inputs = Inputs::upload(gpu, flags.to_vec(), bytes).expect("buffers that fit");
    let bench = Bench::new(&player, gpu, Arc::clone(method), &inputs, room);
    let bench = bench.unwrap_or_else(|e| panic!("{e}"));
    // Twice, so that leftovers of the first run interfere with the second.
    let judge = || bench.judge().unwrap_or_else(|e| panic!("{e}"));
    judge().or_else(judge)
}

pub fn drawn(count: u32, valid: f64, method: &dyn Compaction) -> Vec<u32> {
    stream::flags(count, valid, method.buckets(), u64::from(count) + 1)
}

#[test]
fn every_method_compacts_at_all_sizes_where_something_ends() {
    for (name, method) in in_turn("methods of compaction", methods(gpu())) {
        for count in [0, 1, 15, 16, 17, 63, 64, 65, 255, 257, 1023, 1025] {
            for valid in [0.0, 0.3, 1.0] {
                let flags = drawn(count, valid, &*method);
                let fault = fault(gpu(), &method, &flags, 4, [count, count]);
                assert_eq!(fault, None, "{name} of {count}, {valid} valid");
            }
        }
    }
}

#[test]
fn every_method_compacts_elements_of_all_sizes() {
    for (name, method) in in_turn("methods of compaction", methods(gpu())) {
        for bytes in [12, 16, 64] {
            let flags = drawn(1000, 0.6, &*method);
            let fault = fault(gpu(), &method, &flags, bytes, [1000, 1000]);
            assert_eq!(fault, None, "{name}, {bytes} bytes");
        }
    }
    let odd = Inputs::upload(gpu(), vec![1], 6).err();
    assert!(odd.is_some_and(|e| e.to_string().contains("6 bytes")));
}

#[test]
fn how_many_elements_there_are_may_stand_on_the_device_alone() {
    for (name, method) in methods(gpu()) {
        for length in [0, 1, 64, 700, 999] {
            let flags = drawn(1000, 0.5, &*method);
            let fault = fault(gpu(), &method, &flags, 4, [length, 1000]);
            assert_eq!(fault, None, "{name}, {length} of 1000");
        }
    }
}

/// Methods whose workgroups no longer fit into one row at the largest size: one kernel each with an
/// invocation per element, with tiles and with blocks.
const PAST_A_ROW: [&str; 3] = [
    "atomic",
    "reduce-scan-scatter[(\"lanes\", 8), (\"per_lane\", 3)]",
    "roger",
];

/// Three levels of sums, and more workgroups than fit into a row.
#[test]
fn every_method_compacts_streams_of_several_levels() {
    for (name, method) in in_turn("methods of compaction", methods(gpu())) {
        for count in [(1 << 17) + 77, 65_536 * 64 + 1] {
            if count > 1 << 18 && !PAST_A_ROW.contains(&&*name) {
                continue;
            }
            let flags = drawn(count, 0.5, &*method);
            let fault = fault(gpu(), &method, &flags, 4, [count, count]);
            assert_eq!(fault, None, "{name} of {count}");
        }
    }
}

/// Roger 2008, Fig. 4.8: four blocks of 16, of which 10, 9, 7 and 9 elements survive.
#[test]
fn the_worked_example_of_the_thesis_comes_out() {
    let text = "43X192XX7X6X58X5431X2X6XX7X98XX5X87XX235XXX6XX1X1XXX45X7X6X8329X";
    let flags: Vec<u32> = text.bytes().map(|c| u32::from(c != b'X')).collect();
    let roger = method("roger", &[("block", 16)]);
    assert_eq!(fault(gpu(), &roger, &flags, 4, [64, 64]), None);
    let kept: String = (stream::expected(&flags, &*roger).iter())
        .map(|element| char::from(text.as_bytes()[*element as usize]))
        .collect();
    assert_eq!(kept, "43192765854312679858723561145768329");
    let holes: Vec<usize> = (flags
        .chunks(16)
        .map(|block| block.iter().filter(|f| **f == 0).count()))
    .collect();
    assert_eq!(holes, [6, 7, 9, 7]);
}

/// Workgroups of 64 for the survivors, in rows of 256; none if there are none.
#[test]
fn an_indirect_dispatch_covers_what_stays() {
    let gpu = gpu();
    for (kept, wanted) in [
        (0, [0, 0, 1]),
        (1, [1, 1, 1]),
        (64, [1, 1, 1]),
        (65, [2, 1, 1]),
        (64 * 256, [256, 1, 1]),
        (64 * 256 + 1, [256, 2, 1]),
    ] {
        let word = |word: u32| Storage::from(&gpu.storage("word", &[word]).expect("a buffer"));
        let stream = Stream {
            capacity: 1,
            element_bytes: 4,
            length: word(1),
            flags: word(1),
            stays: Stays::All,
            elements: word(1),
            kept: word(0),
            count: word(kept),
        };
        let mut recording = Recording::new();
        let groups = Passes::new(gpu, &mut recording, &stream).groups_of_kept();
        let Groups::Indirect(groups, 0) = groups.expect("a kernel") else {
            panic!("not from the beginning of a buffer");
        };
        recording.download("groups", &groups);
        let played = gpu.play(&recording).expect("it plays");
        let found: Vec<u32> = played.download("groups").expect("words");
        assert_eq!(found[..3], wanted, "{kept} elements");
    }
}

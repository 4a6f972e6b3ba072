//! Every registered method against the host, at all sizes where something ends, and with planted faults.

use super::support::{gpu, kernels_with, open};
use raystone::compaction::{Compaction, CompactionRegistry, Order, Passes};
use raystone::gpu::{Bindings, Composition, Gpu, GpuError, Player};
use raystone::measure::compaction::{Bench, Inputs, stream};
use raystone::params::{ParamValue, Params, Variant};
use std::sync::Arc;

fn variant(name: &str, params: &[(&str, i64)]) -> Variant {
    let params = params.iter();
    let params = params.map(|(name, x)| ((*name).to_owned(), ParamValue::Integer(*x)));
    Variant {
        name: name.to_owned(),
        params: Params(params.collect()),
        label: name.to_owned(),
    }
}

fn method(name: &str, params: &[(&str, i64)]) -> Arc<dyn Compaction> {
    let made = CompactionRegistry::default().configured(&variant(name, params));
    made.unwrap_or_else(|e| panic!("{e}"))
}

/// Each method at its defaults, and some with other parameters; those that this adapter cannot run are said.
fn methods(gpu: &Gpu) -> Vec<(String, Arc<dyn Compaction>)> {
    let registry = CompactionRegistry::default();
    let mut variants: Vec<Variant> =
        (registry.0.iter().map(|kind| variant(kind.name(), &[]))).collect();
    assert!(variants.len() >= 9, "{} methods", variants.len());
    let further: [(&str, &[(&str, i64)]); 9] = [
        ("workgroup", &[("lanes", 32), ("per_lane", 4)]),
        ("reduce-scan-scatter", &[("lanes", 8), ("per_lane", 3)]),
        ("bucket-sort", &[("buckets", 9), ("per_lane", 4)]),
        ("bucket-sort", &[("buckets", 1), ("lanes", 33)]),
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

/// What is wrong with a method over the first `length` of these flags.
fn fault(
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
    // Twice, so that what the first left behind is in the way of the second.
    let judge = || bench.judge().unwrap_or_else(|e| panic!("{e}"));
    judge().or_else(judge)
}

fn drawn(count: u32, valid: f64, method: &dyn Compaction) -> Vec<u32> {
    stream::flags(count, valid, method.buckets(), u64::from(count) + 1)
}

#[test]
fn every_method_compacts_at_all_sizes_where_something_ends() {
    for (name, method) in methods(gpu()) {
        for count in [
            0, 1, 2, 15, 16, 17, 63, 64, 65, 255, 256, 257, 1023, 1024, 1025, 5000,
        ] {
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
    for (name, method) in methods(gpu()) {
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

/// More workgroups than lie in a row, and three levels of sums.
#[test]
fn every_method_compacts_streams_of_several_levels() {
    for (name, method) in methods(gpu()) {
        for count in [1 << 16, (1 << 17) + 77, 65_536 * 64 + 1] {
            if count > 1 << 17 && ["horn", "blelloch"].contains(&&*name) {
                continue;
            }
            let flags = drawn(count, 0.5, &*method);
            let fault = fault(gpu(), &method, &flags, 4, [count, count]);
            assert_eq!(fault, None, "{name} of {count}");
        }
    }
}

/// Roger 2008, Fig. 4.8: four blocks of 16, of which 10, 9, 7 and 9 elements stay.
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

/// Twice over many elements, with these texts in place of others in a kernel.
fn is_seen(module: &str, change: (&str, &str), name: &str, params: &[(&str, i64)]) {
    let gpu = open(kernels_with(module, &[change]));
    let method = method(name, params);
    let flags = drawn(70_000, 0.5, &*method);
    let seen = fault(&gpu, &method, &flags, 4, [69_999, 70_000]);
    assert!(
        seen.is_some(),
        "`{}` in {module} goes unseen through {name}",
        change.1
    );
    println!("{name}, {}: {}", change.1, seen.unwrap_or_default());
}

#[test]
fn planted_faults_are_seen() {
    let s = &[("block", 16)][..];
    for (module, from, to, name, params) in [
        // The count is one short.
        (
            "compaction/scatter",
            "= sums[BUCKETS * tiling.tiles]",
            "= sums[BUCKETS * tiling.tiles] - 1u",
            "reduce-scan-scatter",
            &[][..],
        ),
        (
            "compaction/gather",
            "kept_count[0] = count",
            "kept_count[0] = count - 1u",
            "horn",
            &[],
        ),
        (
            "compaction/roger_move",
            "- sums[blocked.blocks]",
            "- sums[blocked.blocks] - 1u",
            "roger",
            &[],
        ),
        (
            "compaction/workgroup",
            "found.total",
            "found.total - 1u",
            "workgroup",
            &[],
        ),
        // A hole is copied.
        (
            "compaction/tile",
            "if (flag_of(first + k) == bucket)",
            "if (flag_of(first + k) <= bucket)",
            "workgroup",
            &[],
        ),
        (
            "compaction/gather",
            "kept_up_to(middle) > slot",
            "kept_up_to(middle) >= slot",
            "blelloch",
            &[],
        ),
        (
            "compaction/roger_blocks",
            "excess == 0 && !is_hole(block_at, j)",
            "excess == 0",
            "roger",
            s,
        ),
        (
            "compaction/atomic",
            "flag_of(element) != 0u",
            "flag_of(element) != 7u",
            "atomic",
            &[],
        ),
        // An order is lost that was promised.
        (
            "compaction/scatter",
            "+ found.exclusive",
            "+ found.total - found.inclusive",
            "reduce-scan-scatter",
            &[],
        ),
        (
            "compaction/tile",
            "(tile * SCAN_LANES + lane) * PER_LANE",
            "tile * SCAN_LANES * PER_LANE + lane",
            "bucket-sort",
            &[],
        ),
        // The last block, which is not whole, is dropped.
        (
            "compaction/stream",
            "element < stream_length[0]",
            "element < (stream_length[0] / 64u) * 64u",
            "workgroup",
            &[],
        ),
        (
            "compaction/roger_blocks",
            "block >= blocked.blocks",
            "block + 1u >= blocked.blocks",
            "roger",
            s,
        ),
        (
            "compaction/holes",
            "element < stream_length[0] && ",
            "",
            "horn",
            &[],
        ),
        // A second level of sums is missing.
        (
            "compaction/add_totals",
            "sums[word] += totals[block]",
            "sums[word] += 0u * totals[block]",
            "roger",
            s,
        ),
        (
            "compaction/add_totals",
            "word < level.words",
            "word < level.words && level.blocks < 2u",
            "reduce-scan-scatter",
            &[("lanes", 64)],
        ),
        // A bucket is left out, or two are one.
        (
            "compaction/scatter",
            "bucket < BUCKETS",
            "bucket + 1u < BUCKETS",
            "bucket-sort",
            &[],
        ),
        (
            "compaction/reduce",
            "sums[bucket * tiling.tiles + tile]",
            "sums[tile]",
            "bucket-sort",
            &[],
        ),
        // The root of the tree keeps its sum.
        (
            "compaction/blelloch",
            "before = 0u",
            "before += 0u",
            "blelloch",
            &[],
        ),
        (
            "compaction/hillis_steele",
            "word >= scan_step.reach",
            "word > scan_step.reach",
            "horn",
            &[],
        ),
    ] {
        is_seen(module, (from, to), name, params);
    }
}

/// Promises a stable order, whatever the method does.
struct Promised(Arc<dyn Compaction>);

impl Compaction for Promised {
    fn order(&self) -> Order {
        Order::Stable
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        self.0.record(passes)
    }
}

/// Adds to whatever stands in the count.
struct Uncleared;

impl Compaction for Uncleared {
    fn order(&self) -> Order {
        Order::Any
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        let items = passes.stream.capacity;
        passes.run_for(
            Composition::new("compaction/atomic"),
            &Bindings::new(),
            items,
        )
    }
}

#[test]
fn a_counter_that_is_not_cleared_is_seen() {
    let method: Arc<dyn Compaction> = Arc::new(Uncleared);
    let flags = drawn(1000, 0.5, &*method);
    let seen = fault(gpu(), &method, &flags, 4, [1000, 1000]).unwrap_or_default();
    assert!(seen.contains("elements stay, not"), "{seen}");
}

#[test]
fn an_unstable_order_is_seen_where_a_stable_one_is_promised() {
    // The same elements in another order: backwards within each workgroup.
    let backwards = (
        "first_slot + found.exclusive",
        "first_slot + found.total - found.inclusive",
    );
    let gpu = open(kernels_with("compaction/workgroup", &[backwards]));
    let unstable = method("workgroup", &[]);
    let flags = drawn(5000, 0.5, &*unstable);
    assert_eq!(fault(&gpu, &unstable, &flags, 4, [5000, 5000]), None);
    let promised: Arc<dyn Compaction> = Arc::new(Promised(unstable));
    let seen = fault(&gpu, &promised, &flags, 4, [5000, 5000]).unwrap_or_default();
    assert!(seen.contains("the order is lost"), "{seen}");
}

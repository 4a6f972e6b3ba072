//! Faults planted in the kernels of compactions, and in their recording: each must be detected.

use super::methods::{drawn, fault, method};
use crate::support::{faults_in_turn, gpu, kernels_with, open};
use raystone::compaction::{Compaction, Order, Passes};
use raystone::gpu::{Bindings, Composition, GpuError};
use std::sync::Arc;

/// A kernel, a text and its replacement, and a method that runs it, with parameters.
type Fault = (
    &'static str,
    [&'static str; 2],
    &'static str,
    &'static [(&'static str, i64)],
);

#[rustfmt::skip]
const FAULTS: [Fault; 24] = [
    // The count is one short.
    ("scatter", ["= sums[BUCKETS * tiling.tiles]", "= sums[BUCKETS * tiling.tiles] - 1u"], "reduce-scan-scatter", &[]),
    ("gather", ["kept_count[0] = count", "kept_count[0] = count - 1u"], "horn", &[]),
    ("roger_move", ["- sums[blocked.blocks]", "- sums[blocked.blocks] - 1u"], "roger", &[]),
    ("workgroup", ["found.total", "found.total - 1u"], "workgroup", &[]),
    // A hole is copied.
    ("tile", ["copy_element(first + k, slot)", "copy_element(first, slot)"], "workgroup", &[("per_lane", 4)]),
    ("gather", ["kept_up_to(middle) > slot", "kept_up_to(middle) >= slot"], "blelloch", &[]),
    ("roger_blocks", ["excess == 0 && !is_hole(block_at, j)", "excess == 0"], "roger", &[("block", 16)]),
    ("atomic", ["flag != 0u", "flag != 7u"], "atomic", &[]),
    // A promised order is lost.
    ("scatter", ["+ found.exclusive", "+ found.total - found.inclusive"], "reduce-scan-scatter", &[]),
    ("tile", ["(tile * SCAN_LANES + lane) * PER_LANE", "tile * SCAN_LANES * PER_LANE + lane"], "bucket-sort", &[("per_lane", 4)]),
    // The last, partial block is dropped.
    ("stream", ["element < stream_length[0]", "element < stream_length[0] / 64u * 64u"], "workgroup", &[]),
    ("roger_blocks", ["block >= blocked.blocks", "block + 1u >= blocked.blocks"], "roger", &[("block", 16)]),
    // Elements beyond the end count as holes, and the search runs past them.
    ("holes", ["element < stream_length[0] && flag_of", "element < padded.words / 2u && flag_of"], "horn", &[]),
    // A second level of sums is missing.
    ("add_totals", ["sums[word] += totals[block]", "sums[word] += 0u * totals[block]"], "roger", &[("block", 16)]),
    ("add_totals", ["word < level.words", "word < level.words && level.blocks < 2u"], "reduce-scan-scatter", &[("lanes", 64)]),
    // A bucket is omitted, or two are merged.
    ("scatter", ["bucket < BUCKETS", "bucket + 1u < BUCKETS"], "bucket-sort", &[]),
    ("reduce", ["sums[bucket * tiling.tiles + tile]", "sums[tile]"], "bucket-sort", &[]),
    // Holes are sorted first, places of other elements, the count one short or one for all.
    ("keys", ["select(flag - 1u, HOLE, flag == 0u)", "flag"], "radix-sort", &[]),
    ("keys", ["places[element] = element", "places[element] = element ^ 1u"], "radix-sort", &[]),
    ("follow", ["kept_count[0] = slot + 1u", "kept_count[0] = slot"], "radix-sort", &[]),
    ("follow", ["slot >= sorting.count || keys[slot] == HOLE", "slot >= sorting.count"], "radix-sort", &[]),
    ("follow", ["copy_element(places[slot], slot)", "copy_element(slot, slot)"], "radix-sort", &[]),
    // Scans: the root of the tree keeps its sum, a step misses a word.
    ("blelloch", ["before = 0u", "before += 0u"], "blelloch", &[]),
    ("hillis_steele", ["word >= scan_step.reach", "word > scan_step.reach"], "horn", &[]),
];

#[test]
fn planted_faults_are_seen() {
    let mut unseen = Vec::new();
    for (module, [from, to], name, params) in faults_in_turn("faults of compactions", FAULTS) {
        let gpu = open(kernels_with(&format!("compaction/{module}"), &[(from, to)]));
        let method = method(name, params);
        let flags = drawn(70_000, 0.5, &*method);
        match fault(&gpu, &method, &flags, 4, [69_999, 70_000]) {
            Some(seen) => println!("{name}, `{to}`: {seen}"),
            None => unseen.push(format!("`{to}` in {module}, through {name}")),
        }
    }
    assert!(unseen.is_empty(), "{}", unseen.join("\n"));
}

/// Promises a stable order without a guarantee.
struct Promised(Arc<dyn Compaction>);

impl Compaction for Promised {
    fn order(&self) -> Order {
        Order::Stable
    }

    fn record(&self, passes: &mut Passes) -> Result<(), GpuError> {
        self.0.record(passes)
    }
}

/// Adds to the existing count.
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
    // The same elements in another order: reversed within each workgroup.
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

//! What a pass costs the host: empty passes in one recording against as many submissions.
//! `cargo bench -p raystone-benches --bench recordings`. The least of many plays is the one that the rest
//! of the machine disturbed least.

use raystone::gpu::{
    AdapterChoice, Bindings, Composition, KernelLibrary, Player, Recording, Storage, UniformValues,
    open,
};
use std::time::Instant;

const PLAYS: usize = 300;

/// Least and median microseconds of `work`.
fn microseconds(mut work: impl FnMut()) -> [f64; 2] {
    let mut all: Vec<f64> = (0..PLAYS)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    all.sort_by(f64::total_cmp);
    [all[0], all[PLAYS / 2]]
}

fn main() {
    let gpu = open(&AdapterChoice::Best, KernelLibrary::default()).expect("an adapter");
    let kernel = Composition::new("common/loops").feature("loops_cut", true);
    let pipeline = gpu.pipeline(&kernel, true).expect("a kernel");
    let mut bindings = Bindings::new();
    bindings
        .buffer("turns", Storage::scratch("turns", 8))
        .buffer("status", Storage::scratch("status", 64))
        .uniform(
            "loops",
            UniformValues::new().u32("outer", 0).u32("inner", 0),
        );
    let recording = |passes: usize| {
        let mut out = Recording::new();
        for _ in 0..passes {
            out.run("empty", &pipeline, &bindings, [1, 1, 1]);
        }
        out
    };
    println!("{}: microseconds per pass, least and median", gpu.info.name);
    let player = Player::new(&gpu);
    let play = |recording: &Recording| {
        player.play(recording).expect("it plays");
    };
    for passes in [1, 10, 100] {
        let (all, one) = (recording(passes), recording(1));
        play(&all);
        let together = microseconds(|| play(&all)).map(|us| us / passes as f64);
        let apart = microseconds(|| (0..passes).for_each(|_| play(&one)));
        let apart = apart.map(|us| us / passes as f64);
        println!(
            "{passes:4} passes: one recording {:7.1} {:7.1}, {passes} submissions {:7.1} {:7.1}",
            together[0], together[1], apart[0], apart[1]
        );
    }
}

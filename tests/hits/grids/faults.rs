//! Planted faults must fail on the rays that are hard for grids.

use super::{grid, slanted, with};
use crate::support::scenes;
use crate::support::{
    self, Pcg, brute_force, build, default_params, faults_in_turn, kernels_with, trace,
};
use raystone::gpu::Gpu;
use raystone::params::ParamValue;

/// A fault in a kernel: file, original and replacement text.
struct Fault {
    what: &'static str,
    grid: &'static str,
    skip: bool,
    file: &'static str,
    from: &'static str,
    to: &'static str,
}

const ACCEPT: &str = "if (hit.t * BOX_PAD < leave)";
const ACCEPT_EARLY: &str = "if (hit.triangle != NO_HIT || hit.t * BOX_PAD < leave)";

const FAULTS: &[Fault] = &[
    Fault {
        what: "a hit beyond the cell is accepted",
        grid: "uniform-grid",
        skip: false,
        file: "accel/uniform_grid",
        from: ACCEPT,
        to: ACCEPT_EARLY,
    },
    Fault {
        what: "a hit beyond the cell is accepted",
        grid: "two-level-grid",
        skip: false,
        file: "accel/two_level_grid",
        from: ACCEPT,
        to: ACCEPT_EARLY,
    },
    Fault {
        what: "a hit beyond the cell is accepted",
        grid: "irregular-grid",
        skip: false,
        file: "accel/irregular_grid",
        from: ACCEPT,
        to: ACCEPT_EARLY,
    },
    Fault {
        what: "one cell more than the empty cube is skipped",
        grid: "uniform-grid",
        skip: true,
        file: "accel/uniform_grid",
        from: "max(word >> START_BITS, 1u)",
        to: "(word >> START_BITS) + 1u",
    },
    Fault {
        what: "every empty cube is left at its far corner",
        grid: "uniform-grid",
        skip: true,
        file: "accel/uniform_grid",
        from: "min(max(in_cells(ray, leave), vec3<f32>(low)), vec3<f32>(high))",
        to: "select(low, high, forward)",
    },
    Fault {
        what: "every top cell is entered at its low corner",
        grid: "two-level-grid",
        skip: false,
        file: "accel/two_level_grid",
        from: "select(find_part(in_cells(ray, leave), cell, top.parts), first, along)",
        to: "select(vec3<i32>(0), first, along)",
    },
    Fault {
        what: "every box is left at its far corner",
        grid: "irregular-grid",
        skip: false,
        file: "accel/irregular_grid",
        from: "min(max(in_cells(ray, leave), low), high)",
        to: "select(low, high, forward)",
    },
    Fault {
        what: "half a top cell is skipped at every exit",
        grid: "irregular-grid",
        skip: false,
        file: "accel/irregular_grid",
        from: "select(exit - 1, exit, forward)",
        to: "select(exit - 1 - i32(1u << (voxels.shift - 1u)), exit + i32(1u << (voxels.shift - 1u)), forward)",
    },
    Fault {
        what: "the axis that is left is always x",
        grid: "uniform-grid",
        skip: false,
        file: "accel/grid",
        from: "let x = next.x == leave;",
        to: "let x = next.x >= leave;",
    },
];

/// A device whose kernel `fault.file` has the fault, if `planted`.
fn device(fault: &Fault, planted: bool) -> Gpu {
    let to = if planted { fault.to } else { fault.from };
    support::open(kernels_with(fault.file, &[(fault.from, to)]))
}

#[test]
fn planted_faults_turn_the_comparison_red() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let mut rng = Pcg::new(5);
    let soup = slanted(&mut rng, 600);
    let rays = scenes::aimed_rays(&mut rng, &soup, 4000);
    let expected = brute_force(&soup, &rays);
    for fault in faults_in_turn("faults of grids", FAULTS) {
        let kind = grid(fault.grid);
        let skip = ParamValue::Name("chebyshev".into());
        let params = if fault.skip {
            with(
                kind,
                &[("skip", skip), ("lambda", ParamValue::Number(100.0))],
            )
        } else {
            default_params(&kind.parameters())
        };
        let built = build(kind, &soup, &params);
        let wrong = |gpu: &Gpu| {
            let found = trace(gpu, &*built, &soup, &rays, &[]);
            support::differences(&expected, &found.hits).len()
        };
        assert_eq!(
            wrong(&device(fault, false)),
            0,
            "{} without a fault",
            fault.grid
        );
        let faulty = wrong(&device(fault, true));
        println!("{}: {}: {faulty} rays differ", fault.grid, fault.what);
        assert!(faulty > 0, "{}: not seen: {}", fault.grid, fault.what);
    }
}

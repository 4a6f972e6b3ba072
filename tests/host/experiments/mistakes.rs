//! What every kind of mistake is answered with.

use super::{AXES, assert_says, labels, parse, parse_with};
use raystone::config::Axis;

#[test]
fn text_that_is_not_toml_names_its_line() {
    assert_says(
        parse("[run]\nseed = 1\nseed = 2\n"),
        &[
            "dir/trial.toml:7",
            "duplicate key `seed`",
            "first in dir/trial.toml:6",
        ],
    );
    assert_says(
        parse("[run]\n[gate]\n[run]\n"),
        &[
            "dir/trial.toml:7",
            "duplicate key `run`",
            "first in dir/trial.toml:5",
        ],
    );
    assert_says(
        parse("[run]\nname = \"a\\u001bb\"\n"),
        &["dir/trial.toml:6", "`run.name`", "control characters"],
    );
    assert_says(parse("[run\n"), &["dir/trial.toml:5", "not valid TOML"]);
    assert_says(parse("[run]\nseed = \n"), &["dir/trial.toml:6"]);
}

#[test]
fn unknown_names_are_answered_with_the_nearest_known_one() {
    for (more, pieces) in [
        (
            "[rum]\nseed = 1\n",
            ["dir/trial.toml:5", "section `rum`", "`run`"],
        ),
        (
            "[run]\n\nsede = 1\n",
            ["dir/trial.toml:7", "key in [run] `sede`", "`seed`"],
        ),
        (
            "[run]\nspp = { pow = [0, 1] }\n",
            [":6", "key in `run.spp` `pow`", "`pow2`"],
        ),
        (
            "[camera]\neye = [0,0,0]\ntarget=[0,0,1]\nfovy = 3\n",
            [":8", "`fovy`", "`fov`"],
        ),
        (
            "[[exclude]]\naccell = \"bvh\"\n",
            [":6", "[exclude] `accell`", "`accel`"],
        ),
        (
            "[accel.uniform-gird]\nlambda = 2\n",
            [":5", "`uniform-gird`", "`uniform-grid`"],
        ),
        (
            "[accel.uniform-grid]\nlamda = 2\n",
            [":6", "uniform-grid `lamda`", "`lambda`"],
        ),
        (
            "[accel.bvh]\nlambda = 2\n",
            [":6", "accel bvh `lambda`", "nothing is known here"],
        ),
        (
            "[sequence.pixel-hash]\nhash = \"pgc\"\n",
            [":6", "`pgc`", "Known: `pcg`, `wang`"],
        ),
        (
            "[coherence]\nwarp_size = 32\n",
            [":6", "key in [coherence] `warp_size`", "`warp`"],
        ),
        (
            "[reference]\nsequence = \"soboll\"\n",
            [":6", "`soboll`", "`sobol`"],
        ),
        (
            "[accel]\nlambda = 2\n",
            [":6", "accel `lambda`", "Known: `brute-force`"],
        ),
    ] {
        assert_says(parse(more), &pieces);
    }
    let text = AXES.replace("cornell-box", "cornel-box");
    assert_says(
        parse_with(&text, &[]),
        &["trial.toml:2", "`cornel-box`", "`cornell-box`", ".obj"],
    );
    let text = AXES.replace("\"bvh\"", "\"bhv\"");
    assert_says(
        parse_with(&text, &[]),
        &["trial.toml:3", "accel `bhv`", "mean `bvh`"],
    );
    assert_says(
        parse_with(&format!("sed = 1\n{AXES}"), &[]),
        &["trial.toml:1", "key outside all sections `sed`"],
    );
}

#[test]
fn a_value_of_the_wrong_type_is_answered_with_the_right_one() {
    for (more, pieces) in [
        (
            "[run]\nseed = \"one\"\n",
            [":6", "`run.seed`", "the text \"one\""],
        ),
        (
            "[run]\nseed = 1.5\n",
            [":6", "an integer in [0, 4294967295]", "the number 1.5"],
        ),
        (
            "[run]\nseed = 99999999999999999999\n",
            [":6", "`run.seed`", "99999999999999999999"],
        ),
        (
            "[run]\nresolution = [64]\n",
            [":6", "a list of two integers", "a list of 1"],
        ),
        (
            "[run]\nresolution = [64,\n 4.5]\n",
            [":7", "a list of two integers", "4.5"],
        ),
        (
            "[run]\nspp = 4\n",
            [":6", "{ pow2 = [lo, hi] }", "the integer 4"],
        ),
        (
            "[run]\nruntime_checks = 1\n",
            [":6", "true or false", "the integer 1"],
        ),
        (
            "[run]\nname = 2024-01-01\n",
            [":6", "`run.name`", "the date 2024-01-01"],
        ),
        (
            "[camera]\neye = [0, 1]\ntarget = [0, 0, 0]\n",
            [":6", "`camera.eye`", "three"],
        ),
        (
            "[accel.uniform-grid]\nlambda = \"x\"\n",
            [":6", "`accel.uniform-grid.lambda`", "[0.1, 100]"],
        ),
        (
            "[accel.uniform-grid]\nmax_cells = 2.0\n",
            [":6", "an integer in [1, 65536]", "number 2"],
        ),
        (
            "[sequence.pixel-hash]\nshuffle = 1\n",
            [":6", "shuffle", "true or false"],
        ),
        (
            "[accel]\nbvh = 2\n",
            [":6", "`accel.bvh`", "a section of parameters"],
        ),
        (
            "[exclude]\naccel = \"bvh\"\n",
            [":5", "[[exclude]]", "a table"],
        ),
        (
            "[discrepancy]\npairs = [0, 1]\n",
            [":6", "`discrepancy.pairs`", "a list of pairs"],
        ),
    ] {
        assert_says(parse(more), &pieces);
    }
    assert_says(
        parse_with(&format!("timing = 1\n{AXES}"), &[]),
        &["trial.toml:1", "`timing` must be a section"],
    );
    assert_says(
        parse_with("[axes]\nscene = 3\n", &[]),
        &["trial.toml:2", "`axes.scene`", "the integer 3"],
    );
}

#[test]
fn a_value_out_of_range_is_answered_with_the_range() {
    for (more, pieces) in [
        (
            "[run]\nreplicates = 0\n",
            [":6", "`run.replicates` = 0", "[1, 1024]"],
        ),
        ("[run]\nreplicates = 1025\n", [":6", "= 1025", "[1, 1024]"]),
        (
            "[run]\nresolution = [15, 64]\n",
            [":6", "= 15", "[16, 8192]"],
        ),
        (
            "[run]\nspp = { pow2 = [0, 17] }\n",
            [":6", "`run.spp` = 17", "hi <= 16"],
        ),
        (
            "[run]\nspp = { pow2 = [3, 2] }\n",
            [":6", "[3, 2]", "lo <= hi"],
        ),
        (
            "[run]\nstop = { relmse = 0, confidence = 0.95 }\n",
            [":6", "`run.stop` = relmse = 0", "x > 0"],
        ),
        (
            "[run]\nstop = { relmse = 1e-3, confidence = 1 }\n",
            [":6", "confidence = 1", "p < 1"],
        ),
        ("[run]\nname = \"\"\n", [":6", "`run.name`", "not empty"]),
        (
            "[timing]\nmin_warmup_ms = 50\nmax_warmup_ms = 49\n",
            [":7", "49", "min_warmup_ms"],
        ),
        (
            "[discrepancy]\npoints = 100\n",
            [":6", "= 100", "a power of two"],
        ),
        (
            "[discrepancy]\npairs = [[1, 1]]\n",
            [":6", "[1, 1]", "different dimensions"],
        ),
        (
            "[camera]\neye = [0, 0, 0]\ntarget = [0, 0, 0]\n",
            [":7", "`camera.target`", "eye"],
        ),
        (
            "[camera]\neye = [0, 0, 0]\ntarget = [0, 2, 0]\n",
            ["default", "`camera.up`", "parallel"],
        ),
        (
            "[camera]\neye = [nan, 0, 0]\ntarget = [0, 2, 0]\n",
            [":6", "`camera.eye`", "finite"],
        ),
        (
            "[camera]\neye = [0, 0, 0]\ntarget = [0, 0, 1]\nfov = 180\n",
            [":8", "fov", "[1, 179]"],
        ),
        (
            "[accel.uniform-grid]\nlambda = [3, 101]\n",
            [":6", "lambda` = 101", "[0.1, 100]"],
        ),
        (
            "[accel.uniform-grid]\nlambda = nan\n",
            [":6", "lambda` = NaN", "[0.1, 100]"],
        ),
    ] {
        assert_says(parse(more), &pieces);
    }
}

#[test]
fn seeds_that_renders_share_are_refused_and_equal_numbers_that_do_not_meet_are_not() {
    let with = |run: u32, reference: u32| {
        parse(&format!(
            "[run]\nseed = {run}\n[reference]\nseed = {reference}\n"
        ))
    };
    let seeds = with(1, 9001).expect("no seed is shared").seeds();
    // PCG's hash of 9001, worked by hand.
    let first = 2_772_611_379;
    assert_eq!(seeds.replicates, (1..=16).collect::<Vec<u32>>());
    let parts: Vec<u32> = (first..first + 8).collect();
    assert_eq!(seeds.reference_parts, parts);
    for shared in [first - 7, first, first + 7] {
        let name = if shared < first { first } else { shared };
        assert_says(
            with(shared, 9001),
            &[
                ":8",
                "`reference.seed` = 9001",
                &name.to_string(),
                "replicates",
            ],
        );
    }
    for apart in [first - 16, first + 8, 9001, 9000, 8994] {
        assert!(with(apart, 9001).is_ok(), "{apart}");
    }
}

#[test]
fn the_former_section_of_tests_says_where_its_keys_are() {
    assert_says(
        parse("[intersection]\ntriangle = \"pluecker\"\n"),
        &[
            "trial.toml:5",
            "axes",
            "`triangle`, `box_test` and `offset`",
        ],
    );
    let text = AXES.replace("[axes]\n", "[axes]\ntriangle = \"watertigth\"\n");
    assert_says(
        parse_with(&text, &[]),
        &["trial.toml:2", "triangle", "`watertigth`", "`watertight`"],
    );
}

#[test]
fn missing_empty_and_repeated_things_are_named() {
    assert_says(
        parse_with("[run]\nseed = 1\n", &[]),
        &["trial.toml:1", "`axes.scene` is missing"],
    );
    assert_says(
        parse_with("[axes]\nscene = \"cornell-box\"\n", &[]),
        &["trial.toml:1", "`axes.accel` is missing"],
    );
    assert_says(
        parse("[camera]\neye = [0, 0, 0]\n"),
        &["trial.toml:5", "`camera.target` is missing"],
    );
    let text = AXES.replace("[\"cornell-box\"]", "[]");
    assert_says(
        parse_with(&text, &[]),
        &["trial.toml:2", "`axes.scene` is empty"],
    );
    assert_says(
        parse("[accel.uniform-grid]\nlambda = []\n"),
        &["trial.toml:6", "`accel.uniform-grid.lambda` is empty"],
    );
    assert_says(parse("[[exclude]]\n"), &["`exclude` is empty"]);
    let text = AXES.replace("\"uniform-grid\"", "\"bvh\"");
    assert_says(parse_with(&text, &[]), &["trial.toml:3", "\"bvh\" twice"]);
    assert_says(
        parse("[accel.uniform-grid]\nlambda = [3, 3.0]\n"),
        &["trial.toml:6", "lists 3 twice"],
    );
    assert_says(
        parse("[discrepancy]\npairs = [[0, 1], [0, 1]]\n"),
        &["trial.toml:6", "[0, 1] twice"],
    );
}

#[test]
fn parameters_of_an_entry_that_is_not_used_are_a_mistake() {
    let text = AXES.replace(", \"uniform-grid\"", "") + "[accel.uniform-grid]\nlambda = 3\n";
    assert_says(
        parse_with(&text, &[]),
        &[
            "trial.toml:5",
            "[accel.uniform-grid]",
            "not in axes.accel (`bvh`)",
        ],
    );
    // Left over rather than wrong, when the command line replaced the axis.
    let text = format!("{AXES}[accel.uniform-grid]\nlambda = 3\n");
    let narrowed = parse_with(&text, &["axes.accel=bvh"]).expect("left-over parameters");
    assert_eq!(labels(&narrowed.axes[Axis::Accel]), ["bvh"]);
    assert_says(
        parse_with(AXES, &["axes.accel=bvh", "accel.uniform-grid.lambda=4"]),
        &["--set accel.uniform-grid.lambda=4", "not in axes.accel"],
    );
}

#[test]
fn a_warp_that_is_no_part_of_a_workgroup_and_a_rule_that_nobody_knows_are_refused() {
    for (more, pieces) in [
        (
            "[coherence]\nwarp = [8, 3]\n",
            [":6", "`coherence.warp`", "divisors of 8"],
        ),
        (
            "[coherence]\nrule = \"while\"\n",
            [":6", "`coherence.rule`", "one of \"loop\", \"if-if\""],
        ),
        (
            "[coherence]\nline_bytes = 96\n",
            [
                ":6",
                "`coherence.line_bytes`",
                "a power of two in [16, 4096]",
            ],
        ),
    ] {
        assert_says(parse(more), &pieces);
    }
}

//! Kernels broken on purpose: the message names the author's file and the exact line.

use crate::support;
use raystone::gpu::{Composition, KernelLibrary};

/// A traversal kernel of the path tracer, with everything a kernel file may be part of.
fn composition(structure: &str) -> Composition {
    let mut out = Composition::new("integrator/render")
        .with("accel", structure)
        .with("sequence", "sampling/sobol")
        .with("decorrelation", "sampling/cranley_patterson")
        .with("integrator", "integrator/path")
        .with("structure", "volume/structure/level_map")
        .constant("STACK_ENTRIES", 32)
        .constant("SEQUENCE_SEEDING", 0)
        .constant("DECORRELATION_SEEDING", 0)
        .constant("MAX_DEPTH", 4)
        .constant("ROULETTE_DEPTH", 3)
        .constant("CLAMP", 0);
    for feature in [
        "next_event",
        "found_emission",
        "power_heuristic",
        "clamped",
        "mirror_connections",
        "sphere_lights",
        "roulette",
        "textures",
        "lights",
        "many_lights",
        "rectangle_lights",
        "background",
        "several_materials",
        "several_light_kinds",
        "transforms",
        "mirror",
        "dielectric",
        "daylight",
        "media",
    ] {
        out = out.feature(feature, true);
    }
    out
}

/// Composes with `text` as the kernel `file`; the message names `place` for it.
fn message(file: &str, text: &str, structure: &str) -> Result<(), String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(format!("{file}.wesl"));
    std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
    std::fs::write(&path, text).expect("a written kernel");
    let library = KernelLibrary::default().with_folder(folder.path());
    let composed = library
        .expect("the folder")
        .compose(&composition(structure));
    composed
        .map(|_| ())
        .map_err(|e| e.to_string().replace(&path.display().to_string(), "FILE"))
}

fn embedded(file: &str) -> String {
    let library = KernelLibrary::default();
    library.text(file).expect("an embedded kernel").to_owned()
}

/// Replaces the only occurrence of `from`; returns the text and the line of the change, from 1.
fn broken(file: &str, from: &str, to: &str) -> (String, usize) {
    let text = embedded(file);
    assert_eq!(text.matches(from).count(), 1, "`{from}` in {file}");
    let at = text.find(from).expect("counted above");
    (
        text.replacen(from, to, 1),
        text[..at].matches('\n').count() + 1,
    )
}

#[test]
fn faults_of_all_kinds_are_told_with_file_and_line() {
    let (bvh, pairs) = ("accel/bvh/stack", "accel/bvh/pairs");
    for (what, file, from, to, tells) in [
        (
            "a type error in the middle of a function",
            pairs,
            "min(left, right) < MISSED",
            "min(left, n0) < MISSED",
            "",
        ),
        (
            "a wrong type in an assignment",
            pairs,
            "inner.second = far",
            "inner.second = 1.5",
            "u32",
        ),
        (
            "an unknown identifier",
            pairs,
            "u32(swap)",
            "u32(swop)",
            "swop",
        ),
        (
            "an unknown member",
            bvh,
            "(inner.second != NONE)",
            "(inner.secund != NONE)",
            "secund",
        ),
        (
            "a syntax error",
            bvh,
            "let inner = visit(",
            "let inner = = visit(",
            "unexpected token",
        ),
        (
            "a module that does not exist",
            bvh,
            "import package::common::limits::limits",
            "import package::common::limitz::limits",
            "common::limitz",
        ),
        (
            "a constant of the wrong type",
            "accel/leaf",
            "COUNT_MASK: u32 = 31u",
            "COUNT_MASK: u32 = 31.5",
            "COUNT_MASK",
        ),
        (
            "a fault in a shared file",
            "accel/triangle",
            "let found = meet(triangle, ray, inverse)",
            "let found = meet(triangle, ray, inverse.x.x)",
            "",
        ),
        (
            "a fault in a shader",
            "shading/light/flat",
            "let towards = point.position - surface.position",
            "let towards = point.position - surface.position.w",
            "",
        ),
    ] {
        let (text, line) = broken(file, from, to);
        let told = message(file, &text, bvh).expect_err(what);
        println!("{what}: {told}\n");
        assert!(
            told.starts_with(&format!("FILE:{line}: ")),
            "{what}: line {line}, told {told}"
        );
        assert!(told.contains(tells), "{what}: told {told}");
        assert!(!told.contains("package_"), "{what}: mangled names: {told}");
    }
}

#[test]
fn a_fault_behind_a_feature_or_in_a_further_condition_has_its_own_line() {
    let file = "accel/bvh/stack";
    for (before, after) in [
        ("@if(!(nothing && textures))\n    ", "let odd = 1.5 + 2u;"),
        ("if swapped {\n    } ", "else if swopped {\n    }"),
        (
            "for (var i = 0u; i < 2u; i++) {\n    ",
            "let odd = 1.5 + 2u;\n    }",
        ),
        (
            "loop {\n        break;\n        continuing {\n        ",
            "break if 1.5;\n        }\n    }",
        ),
    ] {
        let swapped = "let swapped = true;\n    ";
        let to = format!("{swapped}{before}{after}\n    let inner = visit(");
        let (text, line) = broken(file, "let inner = visit(", &to);
        let line = line + format!("{swapped}{before}").matches('\n').count();
        let told = message(file, &text, file).expect_err(after);
        assert!(
            told.starts_with(&format!("FILE:{line}: ")),
            "{to}\nline {line}: {told}"
        );
    }
}

#[test]
fn sound_kernels_give_no_message() {
    for structure in ["accel/bvh/stack", "accel/bvh/roped", "accel/uniform_grid"] {
        assert_eq!(
            message(structure, &embedded(structure), structure),
            Ok(()),
            "{structure}"
        );
    }
}

#[test]
fn an_unknown_word_is_found_on_every_line_that_assigns() {
    let (mut checked, mut left_out) = (0, 0);
    let files = [
        ("accel/bvh/stack", "accel/bvh/stack"),
        ("accel/bvh/pairs", "accel/bvh/parent_pointer"),
        ("accel/bvh/short_stack", "accel/bvh/short_stack"),
        ("accel/bvh/parent_pointer", "accel/bvh/parent_pointer"),
        ("accel/bvh/roped", "accel/bvh/roped"),
        ("accel/bvh/octant_roped", "accel/bvh/octant_roped"),
        ("accel/two_level_grid", "accel/two_level_grid"),
        ("accel/brute_force", "accel/brute_force"),
        ("accel/triangle", "accel/bvh/stack"),
        ("accel/bounds", "accel/bvh/stack"),
        ("integrator/path", "accel/bvh/stack"),
        ("integrator/medium", "accel/bvh/stack"),
        ("integrator/frame", "accel/bvh/stack"),
        ("shading/texture", "accel/bvh/stack"),
        ("sampling/sobol", "accel/bvh/stack"),
    ];
    let files = support::in_turn("kernels with an unknown word", files);
    let least = 4 * files.len();
    // Of all files together a tenth of the lines is left out; one third of them has a fifth.
    let share = if support::is_full() { 10 } else { 3 };
    for (file, structure) in files {
        let text = embedded(file);
        for (index, line) in text.lines().enumerate() {
            let indented = line.starts_with("    ") && !line.trim_start().starts_with(['@', '/']);
            if !indented || !line.contains(" = ") || !line.ends_with(';') {
                continue;
            }
            let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
            lines[index] = line.replacen(" = ", " = unknown_word + ", 1);
            // A line under a feature that excludes one of these is not in the kernel.
            let Err(told) = message(file, &lines.join("\n"), structure) else {
                left_out += 1;
                continue;
            };
            assert!(
                told.starts_with(&format!("FILE:{}: ", index + 1)),
                "{file}:{}: `{line}`, told {told}",
                index + 1
            );
            checked += 1;
        }
    }
    assert!(
        checked > least && share * left_out < checked,
        "{checked} lines were broken, {left_out} are left out"
    );
}

//! Continuous integration and clusters: `scripts/ci-compare` with fake programs, the files that GitHub reads, and a sweep on a Slurm of
//! two nodes.
#![cfg(unix)]

use crate::support::{needs, tier};
use std::ffi::OsStr;
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// An executable script.
fn script(path: &Path, text: &str) {
    fs::write(path, format!("#!/bin/sh\n{text}")).expect("written");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("executable");
}

struct Kit {
    folder: tempfile::TempDir,
}

impl Kit {
    /// A program whose run and comparison end with these codes, and a `gh` that records its requests.
    fn new(run: i32, compare: i32, earlier_comment: &str) -> Self {
        let kit = Self {
            folder: tempfile::tempdir().expect("a folder"),
        };
        let program = format!(
            "echo 'error: <b>no</b> @someone' >&2; if [ \"$1\" = run ]; then mkdir -p \"$4\"; echo records > \"$4/records.jsonl\"; exit {run}; fi\n\
             shift; echo \"$@\" > {0}/arguments; while [ $# -gt 0 ]; do [ \"$1\" = --markdown ] && echo verdict > \"$2\"; shift; done; exit {compare}\n",
            kit.path("").display()
        );
        script(&kit.path("raystone"), &program);
        let gh = format!(
            "echo \"$@\" >> {0}/asked; case \"$*\" in *--paginate*) printf '{earlier_comment}';; esac\n",
            kit.path("").display()
        );
        script(&kit.path("gh"), &gh);
        kit
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn with_baseline(self) -> Self {
        fs::create_dir(self.path("base")).expect("a folder");
        fs::write(self.path("base/records.jsonl"), "records").expect("written");
        self
    }

    fn execute(&self, on: &str) -> Output {
        let paths = ["raystone", "", "base", "out"].map(|name| self.path(name));
        let search = format!(
            "{}:{}",
            self.folder.path().display(),
            std::env::var("PATH").expect("a path")
        );
        Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/ci-compare"))
            .args(paths)
            .args(["--times", "show"])
            .env("PATH", search)
            .env("GITHUB_STEP_SUMMARY", self.path("summary"))
            .env("GITHUB_REPOSITORY", "someone/something")
            .env("COMMENT_ON", on)
            .env("COMMENT_TITLE", "bvh")
            .output()
            .expect("the script starts")
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_default()
    }
}

#[test]
fn exit_codes_say_what_fails() {
    // Run, comparison, and the exit code of the job.
    for (run, compare, end) in [
        (0, 0, 0),
        (0, 1, 1),
        (0, 4, 0),
        (1, 0, 1),
        (1, 4, 1),
        (0, 2, 2),
        (0, 3, 3),
        (2, 0, 2),
        (3, 0, 3),
    ] {
        let kit = Kit::new(run, compare, "").with_baseline();
        let output = kit.execute("");
        let text = String::from_utf8_lossy(&output.stdout).into_owned()
            + &String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(end), "{run} {compare}: {text}");
        assert_eq!(
            text.contains("::warning::"),
            compare == 4 && run < 2,
            "{text}"
        );
        assert_eq!(kit.read("asked"), "");
        let told = run < 2 && [0, 1, 4].contains(&compare);
        assert_eq!(kit.read("summary") == "verdict\n", told, "{run} {compare}");
        // A failure is reported, too, with the words of the program as they are.
        let failed = format!("(exit code {end})\n\n    error: <b>no</b> @someone\n");
        assert_eq!(
            kit.read("summary").contains(&failed),
            !told,
            "{run} {compare}"
        );
        assert!(text.contains("error: <b>no</b> @someone"), "{text}");
    }
    let kit = Kit::new(0, 0, "").with_baseline();
    kit.execute("");
    let arguments = kit.read("arguments");
    assert!(
        arguments.contains("/base ") && arguments.ends_with("--times show\n"),
        "{arguments}"
    );
}

#[test]
fn a_file_of_records_is_a_baseline_too() {
    let kit = Kit::new(0, 1, "");
    fs::write(kit.path("base"), "records").expect("written");
    let output = kit.execute("");
    assert_eq!(
        output.status.code(),
        Some(1),
        "the comparison found it worse"
    );
    assert!(!kit.read("summary").contains("no baseline yet"));
}

#[test]
fn a_first_run_becomes_the_baseline() {
    for run in [0, 1] {
        let kit = Kit::new(run, 9, "");
        assert_eq!(kit.execute("").status.code(), Some(run));
        assert!(kit.read("summary").contains("no baseline yet"));
        assert_eq!(kit.read("out/run/records.jsonl"), "records\n");
    }
}

#[test]
fn a_packed_baseline_is_one() {
    let kit = Kit::new(0, 0, "").with_baseline();
    let plain = kit.path("base/records.jsonl");
    fs::rename(&plain, plain.with_added_extension("gz")).expect("renamed");
    assert_eq!(kit.execute("").status.code(), Some(0));
    assert_eq!(kit.read("summary"), "verdict\n");
}

#[test]
fn one_comment_is_written_and_then_replaced() {
    let kit = Kit::new(0, 1, "").with_baseline();
    assert_eq!(kit.execute("7").status.code(), Some(1));
    assert!(
        kit.read("asked")
            .contains("-X POST repos/someone/something/issues/7/comments"),
        "{}",
        kit.read("asked")
    );
    assert_eq!(
        kit.read("out/comment.md.marked"),
        "<!-- raystone compare: bvh -->\nverdict\n"
    );
    let kit = Kit::new(0, 0, "41\\n42\\n").with_baseline();
    assert_eq!(kit.execute("7").status.code(), Some(0));
    assert!(
        kit.read("asked")
            .contains("-X PATCH repos/someone/something/issues/comments/42"),
        "{}",
        kit.read("asked")
    );
    // A token that may not comment changes no verdict.
    let kit = Kit::new(0, 0, "").with_baseline();
    script(&kit.path("gh"), "exit 1\n");
    let output = kit.execute("7");
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stdout).contains("could not be written"));
}

#[test]
fn the_action_and_its_page_name_the_same_inputs() {
    let page = include_str!("../../docs/ci.md");
    let action = include_str!("../../action.yml");
    let inputs = action
        .split("inputs:\n")
        .nth(1)
        .and_then(|rest| rest.split("\nruns:").next())
        .expect("inputs");
    let names = inputs
        .lines()
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names: Vec<&str> = names
        .map(|line| line.trim().trim_end_matches(':'))
        .collect();
    assert!(names.len() >= 5, "{names:?}");
    for name in names {
        assert!(page.contains(&format!("| `{name}` |")), "{name}");
        let used = name == "token" || action.contains(&format!("inputs.{name}"));
        assert!(used, "{name} is read by no step");
    }
}

/// Exit code of a script that cannot do its work here (Automake's).
const SKIPPED: i32 = 77;

#[test]
fn a_sweep_on_slurm_outlives_a_node_and_equals_a_run_on_one_machine() {
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/scripts/slurm/test-on-loopback"
    );
    let output = Command::new(script)
        .env("RAYSTONE", env!("CARGO_BIN_EXE_raystone"))
        .output()
        .expect("the script starts");
    let told = String::from_utf8_lossy(&output.stderr);
    println!("{told}");
    if output.status.code() == Some(SKIPPED) {
        assert!(told.contains("skipped"), "{told}");
        return needs::skip("slurm", told);
    }
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{printed}\n{told}");
    assert!(told.contains("equal: "), "{told}");
}

/// Somebody who repeats one shard of eight by hand submits an array of one, and an option may hold spaces.
#[test]
fn an_element_of_an_array_runs_its_shard_of_all_with_whole_options() {
    let kit = Kit::new(0, 0, "");
    script(
        &kit.path("raystone"),
        "for a in \"$@\"; do echo \"<$a>\"; done\n",
    );
    script(
        &kit.path("sbatch"),
        "echo 1; [ -n \"$SHARDS\" ] && [ ! -e \"$OUT/ran\" ] && touch \"$OUT/ran\" && \
         SLURM_ARRAY_TASK_ID=3 SLURM_ARRAY_TASK_COUNT=1 bash \"$SWEEP\" > \"$OUT/printed\"; exit 0\n",
    );
    let scripts = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/slurm");
    let search = format!(
        "{}:{}",
        kit.folder.path().display(),
        std::env::var("PATH").expect("a path")
    );
    let output = Command::new(format!("{scripts}/submit"))
        .args(["my sweep.toml", "8"])
        .arg(kit.path("out"))
        .args(["--set", "run.spp=[1, 4]"])
        .env("PATH", search)
        .env("RAYSTONE", kit.path("raystone"))
        .env("SWEEP", format!("{scripts}/sweep.sbatch"))
        .output()
        .expect("the script starts");
    assert!(output.status.success(), "{output:?}");
    let printed = kit.read("out/printed");
    for word in [
        "<3/8>",
        "<my sweep.toml>",
        "<run.spp=[1, 4]>",
        "<--resume>",
        "<--wait>",
    ] {
        assert!(printed.contains(word), "{word} is not in {printed}");
    }
}

#[test]
fn what_is_required_is_not_skipped() {
    let refused = |required, need| needs::refusal(required, need, &"it is not there").unwrap_err();
    assert_eq!(needs::refusal("", "slurm", &"it is not there"), Ok(()));
    assert_eq!(
        needs::refusal("files chromium", "slurm", &"it is not there"),
        Ok(())
    );
    assert!(refused("files slurm", "slurm").contains("names slurm"));
    assert!(refused("slum", "files").contains("`slum`"));
    assert!(refused("", "slum").contains("`slum`"));
}

/// Every step of `scripts/gpu-run` once, the first experiment in little and the others planned. The full tier runs it: the kernels of
/// forty variants are compiled.
#[test]
fn every_step_of_a_run_on_a_gpu_can_be_taken_and_its_records_are_read() {
    if !tier::is_full() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let (out, site) = (folder.path().join("out"), folder.path().join("site"));
    let program = env!("CARGO_BIN_EXE_raystone");
    let took = Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/gpu-run"))
        .args(["--trial", "--budget", "1800", "--program", program, "--out"])
        .arg(&out)
        .output()
        .expect("a script");
    let steps = fs::read_to_string(out.join("steps.tsv")).expect("a list of steps");
    let failed: Vec<&str> = (steps.lines().skip(1))
        .filter(|step| step.split('\t').nth(1) != Some("0"))
        .collect();
    assert!(took.status.success() && failed.is_empty(), "{failed:?}");
    let of_folder: Vec<String> =
        fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/experiments/thesis"))
            .expect("experiments")
            .filter_map(|file| Some(file.ok()?.path().file_stem()?.to_str()?.to_owned()))
            .collect();
    for name in &of_folder {
        assert!(
            steps
                .lines()
                .any(|step| step.starts_with(&format!("{name}\t"))),
            "{name}"
        );
    }
    let first = out.join("gpu-first");
    for arguments in [
        vec![OsStr::new("compare"), first.as_os_str(), first.as_os_str()],
        vec![
            OsStr::new("gallery"),
            first.as_os_str(),
            OsStr::new("--out"),
            site.as_os_str(),
        ],
    ] {
        let read = Command::new(program)
            .args(&arguments)
            .output()
            .expect("the program");
        assert!(
            read.status.success(),
            "{arguments:?}: {}",
            String::from_utf8_lossy(&read.stderr)
        );
    }
}

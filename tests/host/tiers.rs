//! Lists tested in turn: nothing is skipped forever, and the page of the tests names each list.

use crate::support::tier::{one_of, places};
use std::collections::BTreeSet;
use std::path::Path;

#[test]
fn every_place_has_its_turn_and_no_turn_is_empty() {
    for count in 1..40 {
        for parts in 1..6 {
            let mut seen = BTreeSet::new();
            for turn in 1000..1000 + parts {
                let taken = places("a list", count, parts, turn);
                assert!(!taken.is_empty(), "{count} in {parts}");
                assert!(taken.len() <= count.div_ceil(parts), "{count} in {parts}");
                seen.extend(taken);
            }
            assert_eq!(seen, (0..count).collect(), "{count} in {parts}");
        }
    }
    assert_eq!(places("nothing", 0, 3, 7), [0; 0]);
    assert_eq!(one_of(1, "one part", ["a", "b"]), ["a", "b"]);
}

/// Names of lists in the sources below a folder, from the calls that use part of them.
fn lists(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            lists(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs")
            && !path.ends_with("host/tiers.rs")
        {
            let text = std::fs::read_to_string(&path).expect("a source");
            for call in ["in_turn(", "one_of(", "so_many("] {
                for after in text.split(call).skip(1) {
                    let name = after.split(',').take(2).find_map(|part| {
                        let part = part.trim().strip_prefix('"')?;
                        part.strip_suffix('"').map(str::to_owned)
                    });
                    found.extend(name);
                }
            }
        }
    }
}

#[test]
fn the_page_of_the_tests_names_what_is_taken_in_part() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("docs/testing.md")).expect("docs/testing.md");
    let (_, table) = page.split_once("| list |").expect("a table of lists");
    let rows = table.lines().filter_map(|line| line.strip_prefix("| `"));
    let rows: BTreeSet<String> = rows
        .filter_map(|row| Some(row.split_once('`')?.0.to_owned()))
        .collect();
    let mut found = BTreeSet::new();
    lists(&root.join("tests"), &mut found);
    lists(&root.join("src"), &mut found);
    assert!(found.len() > 10, "{found:?}");
    assert_eq!(rows, found, "docs/testing.md, and what the tests call");
}

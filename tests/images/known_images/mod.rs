//! Known images: those that need few kernels are right, and planted faults are detected.

mod faults;

use crate::support::in_turn;
use raystone::measure::known_images::Seen;
use raystone::run::{Registries, RunOptions, verify_images};
use std::path::Path;

/// The images of these names, rendered with the kernels of a folder.
fn seen(folder: Option<&Path>, names: &[&str]) -> Vec<Seen> {
    let only = |name: &str| names.contains(&name);
    let seen = verify_images(&Registries::default(), &RunOptions::default(), folder, only);
    let seen =
        seen.unwrap_or_else(|e| panic!("{e}; is there an adapter? run scripts/install-driver"));
    let shown = |name: &&str| seen.iter().any(|s| s.name.starts_with(*name));
    assert!(names.iter().all(shown), "{names:?}");
    seen
}

#[test]
fn a_few_images_are_as_they_are_known() {
    let names = [
        "unequal lamps, all",
        "wide lamp",
        "ball of facets",
        "grazing lamps",
        "occluded lamp",
        "sides of lamps",
        "points and spots",
        "occlusion",
        "mirrors",
        "furnace, two bounces",
        "textures",
    ];
    for view in seen(None, &in_turn("known images", names)) {
        println!("{view:?}");
        assert_eq!(view.fault, None, "{}", view.name);
    }
}

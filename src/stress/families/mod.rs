//! The families: kinds of scenes and rays that rounding makes hard.
//!
//! A family is a function that adds cases and one line of the list below.

mod closed;
mod degenerate;
mod directions;
mod extremes;
mod placed;

use super::case::{Case, Maker};

/// A kind of trouble.
pub(crate) struct Family {
    /// Name as a user types it.
    pub name: &'static str,
    /// One line: the difficulty.
    pub description: &'static str,
    make: fn(&mut Maker),
}

/// Lists the families, each with its description as doc comment.
macro_rules! families {
    ($(#[doc = $what:literal] $name:literal => $make:path,)*) => {
        /// Every family.
        pub(crate) const FAMILIES: &[Family] = &[$(Family {
            name: $name,
            description: $what.trim_ascii(),
            make: $make,
        }),*];
    };
}

families! {
    /// closed meshes from inside, random directions
    "watertight" => closed::watertight,
    /// shots at shared vertices of closed meshes, from inside and outside
    "vertices" => closed::vertices,
    /// shots at shared edges of closed meshes, from inside and outside
    "edges" => closed::edges,
    /// every ray of a hundred mirror bounces inside a box and a sphere
    "mirror-chains" => closed::mirror_chains,
    /// directions along axes and in planes of axes, zeros of both signs
    "axis-parallel" => directions::axis_parallel,
    /// closed meshes from inside, directions of length 1e-10 to 1e10, with next to nothing in them
    "lengths" => directions::lengths,
    /// the same with sin π and less for the 0 of a sphere's seams
    "seams" => directions::seams,
    /// origin and direction in the plane of triangles
    "in-plane" => directions::in_plane,
    /// origins on vertices, edges, triangles, boxes and cell borders
    "origins" => directions::origins,
    /// t_min and t_max exactly at the hit, and one ulp beside it
    "interval-ends" => directions::interval_ends,
    /// triangles up to a million times longer than wide
    "needles" => degenerate::needles,
    /// triangles of no area, nearly none, and duplicates, among ordinary ones
    "slivers" => degenerate::slivers,
    /// layers at equal distance, and one ulp apart
    "coincident" => degenerate::coincident,
    /// a small mesh in a scene a million times larger; the teapot in its stadium
    "huge-and-tiny" => degenerate::huge_and_tiny,
    /// triangles that shrink geometrically towards a corner
    "deep-trees" => degenerate::deep_trees,
    /// coordinates and directions below the smallest normal number
    "denormal" => extremes::denormal,
    /// NaN and infinity in every component of a ray
    "non-finite" => extremes::non_finite,
    /// random bits as vertices and rays, as far as a loader lets them pass
    "random-bits" => extremes::random_bits,
    /// closed objects under nearly degenerate transforms and scales up to a million, from inside
    "instances" => placed::instances,
}

/// Returns the names that `--family` takes: every family, and the shots at closed meshes.
pub fn family_names() -> impl Iterator<Item = &'static str> {
    let families = FAMILIES.iter().map(|family| family.name);
    families.chain([super::shot_meshes::FAMILY])
}

impl Family {
    /// Returns the family of this name.
    pub(crate) fn named(name: &str) -> Option<&'static Self> {
        FAMILIES.iter().find(|family| family.name == name)
    }

    /// Returns its cases with about `rays` rays each.
    pub(crate) fn cases(&self, seed: u64, quick: bool, rays: usize) -> Vec<Case> {
        let mut maker = Maker::new(self.name, seed, quick, rays);
        (self.make)(&mut maker);
        maker.cases
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_family_has_cases_with_rays_and_labels_that_differ() {
        for family in FAMILIES {
            let cases = family.cases(1, false, 24);
            assert!(!cases.is_empty(), "{}", family.name);
            let labels: BTreeSet<&str> = cases.iter().map(|c| c.label.as_str()).collect();
            assert_eq!(labels.len(), cases.len(), "{}", family.name);
            for case in &cases {
                assert!(!case.rays.is_empty(), "{} {}", family.name, case.label);
                let starts = case
                    .rays
                    .iter()
                    .all(|ray| ray.t_min >= 0.0 || ray.t_min.is_nan());
                assert!(starts, "{} {}", family.name, case.label);
                let finite = |t: &raystone_core::geometry::Triangle| {
                    t.vertices.iter().all(|v| v.is_finite())
                };
                assert!(
                    case.scene.triangles.iter().all(finite),
                    "{} {}",
                    family.name,
                    case.label
                );
                // A target at the origin leaves no direction, which hits nothing by any definition.
                let none = |ray: &&raystone_accel::Ray| !ray.is_ray() && ray.direction != [0.0; 3];
                let none = case.rays.iter().find(none);
                let strange = family.name == "non-finite";
                assert!(strange || none.is_none(), "{}: {none:?}", family.name);
            }
        }
        let names: BTreeSet<_> = FAMILIES.iter().map(|f| f.name).collect();
        assert_eq!(names.len(), FAMILIES.len());
    }

    #[test]
    fn a_mesh_does_not_depend_on_the_number_of_rays_or_on_the_other_cases() {
        for family in FAMILIES {
            let all = family.cases(3, false, 10);
            for case in family.cases(3, true, 50) {
                let same = all.iter().find(|c| c.label == case.label);
                let same = same.unwrap_or_else(|| panic!("{} {}", family.name, case.label));
                assert_eq!(
                    same.scene.triangles, case.scene.triangles,
                    "{} {}",
                    family.name, case.label
                );
            }
        }
    }
}

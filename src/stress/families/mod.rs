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
pub struct Family {
    /// Name as a user types it.
    pub name: &'static str,
    /// One line: what is hard.
    pub description: &'static str,
    make: fn(&mut Maker),
}

/// Every family.
pub const FAMILIES: [Family; 19] = [
    Family::new(
        "watertight",
        "closed meshes from inside, random directions",
        closed::watertight,
    ),
    Family::new(
        "vertices",
        "shots at shared vertices of closed meshes, from inside and outside",
        closed::vertices,
    ),
    Family::new(
        "edges",
        "shots at shared edges of closed meshes, from inside and outside",
        closed::edges,
    ),
    Family::new(
        "mirror-chains",
        "every ray of a hundred mirror bounces inside a box and a sphere",
        closed::mirror_chains,
    ),
    Family::new(
        "axis-parallel",
        "directions along axes and in planes of axes, zeros of both signs",
        directions::axis_parallel,
    ),
    Family::new(
        "lengths",
        "closed meshes from inside, directions of length 1e-10 to 1e10, with next to nothing in them",
        directions::lengths,
    ),
    Family::new(
        "seams",
        "the same with sin π and less for the 0 of a sphere's seams",
        directions::seams,
    ),
    Family::new(
        "in-plane",
        "origin and direction in the plane of triangles",
        directions::in_plane,
    ),
    Family::new(
        "origins",
        "origins on vertices, edges, triangles, boxes and cell borders",
        directions::origins,
    ),
    Family::new(
        "interval-ends",
        "t_min and t_max exactly at the hit, and one ulp beside it",
        directions::interval_ends,
    ),
    Family::new(
        "needles",
        "triangles up to a million times longer than wide",
        degenerate::needles,
    ),
    Family::new(
        "slivers",
        "triangles of no area, nearly none, and duplicates, among ordinary ones",
        degenerate::slivers,
    ),
    Family::new(
        "coincident",
        "layers at equal distance, and one ulp apart",
        degenerate::coincident,
    ),
    Family::new(
        "huge-and-tiny",
        "a small mesh in a scene a million times larger; the teapot in its stadium",
        degenerate::huge_and_tiny,
    ),
    Family::new(
        "deep-trees",
        "triangles that shrink geometrically towards a corner",
        degenerate::deep_trees,
    ),
    Family::new(
        "denormal",
        "coordinates and directions below the smallest normal number",
        extremes::denormal,
    ),
    Family::new(
        "non-finite",
        "NaN and infinity in every component of a ray",
        extremes::non_finite,
    ),
    Family::new(
        "random-bits",
        "random bits as vertices and rays, as far as a loader lets them pass",
        extremes::random_bits,
    ),
    Family::new(
        "instances",
        "closed objects under nearly degenerate transforms and scales up to a million, from inside",
        placed::instances,
    ),
];

impl Family {
    const fn new(name: &'static str, description: &'static str, make: fn(&mut Maker)) -> Self {
        Self {
            name,
            description,
            make,
        }
    }

    /// The family of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        FAMILIES.iter().find(|family| family.name == name)
    }

    /// Its cases with about `rays` rays each.
    pub fn cases(&self, seed: u64, quick: bool, rays: usize) -> Vec<Case> {
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
        for family in &FAMILIES {
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
                let finite =
                    |t: &crate::geometry::Triangle| t.vertices.iter().all(|v| v.is_finite());
                assert!(
                    case.scene.triangles.iter().all(finite),
                    "{} {}",
                    family.name,
                    case.label
                );
                // A target at the origin leaves no direction, which hits nothing by any definition.
                let none = |ray: &&crate::accel::Ray| !ray.is_ray() && ray.direction != [0.0; 3];
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
        for family in &FAMILIES {
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

//! The families: kinds of scenes and rays that rounding makes hard.
//!
//! A family is a function that adds cases and one line of the list below.

mod closed;
mod degenerate;
mod directions;
mod extremes;
mod placed;

use super::case::{Case, Maker};

pub(super) use closed::on_edge;

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
    Family {
        name: "watertight",
        description: "closed meshes from inside, random directions",
        make: closed::watertight,
    },
    Family {
        name: "vertices",
        description: "shots at shared vertices of closed meshes, from inside and outside",
        make: closed::vertices,
    },
    Family {
        name: "edges",
        description: "shots at shared edges of closed meshes, from inside and outside",
        make: closed::edges,
    },
    Family {
        name: "mirror-chains",
        description: "every ray of a hundred mirror bounces inside a box and a sphere",
        make: closed::mirror_chains,
    },
    Family {
        name: "axis-parallel",
        description: "directions along axes and in planes of axes, zeros of both signs",
        make: directions::axis_parallel,
    },
    Family {
        name: "lengths",
        description: "closed meshes from inside, directions of length 1e-10 to 1e10, with next to nothing in them",
        make: directions::lengths,
    },
    Family {
        name: "seams",
        description: "the same with sin π and less for the 0 of a sphere's seams",
        make: directions::seams,
    },
    Family {
        name: "in-plane",
        description: "origin and direction in the plane of triangles",
        make: directions::in_plane,
    },
    Family {
        name: "origins",
        description: "origins on vertices, edges, triangles, boxes and cell borders",
        make: directions::origins,
    },
    Family {
        name: "interval-ends",
        description: "t_min and t_max exactly at the hit, and one ulp beside it",
        make: directions::interval_ends,
    },
    Family {
        name: "needles",
        description: "triangles up to a million times longer than wide",
        make: degenerate::needles,
    },
    Family {
        name: "slivers",
        description: "triangles of no area, nearly none, and duplicates, among ordinary ones",
        make: degenerate::slivers,
    },
    Family {
        name: "coincident",
        description: "layers at equal distance, and one ulp apart",
        make: degenerate::coincident,
    },
    Family {
        name: "huge-and-tiny",
        description: "a small mesh in a scene a million times larger; the teapot in its stadium",
        make: degenerate::huge_and_tiny,
    },
    Family {
        name: "deep-trees",
        description: "triangles that shrink geometrically towards a corner",
        make: degenerate::deep_trees,
    },
    Family {
        name: "denormal",
        description: "coordinates and directions below the smallest normal number",
        make: extremes::denormal,
    },
    Family {
        name: "non-finite",
        description: "NaN and infinity in every component of a ray",
        make: extremes::non_finite,
    },
    Family {
        name: "random-bits",
        description: "random bits as vertices and rays, as far as a loader lets them pass",
        make: extremes::random_bits,
    },
    Family {
        name: "instances",
        description: "closed objects under nearly degenerate transforms and scales up to a million, from inside",
        make: placed::instances,
    },
];

impl Family {
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

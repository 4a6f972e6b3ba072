//! Tests of structures and walks: answers of every structure against the field, in f64, and against the device.

mod adaptive;
mod curved;
mod faults;
mod generality;
mod march;
mod measure;
mod pipeline;
mod pipeline_faults;
mod scatter;
pub(crate) mod segments;
#[allow(dead_code, unreachable_pub, reason = "other tests use the rest")]
#[path = "../../../tests/support/tier.rs"]
mod tier;
mod tracking;
mod voxels;

use crate::medium::{Homogeneity, Key, Medium};
use crate::{Volume, procedures, structure};

/// Triangles of a box, which turn outwards; corner `k` lies at the far end of axis `a` where bit `a` of `k` is set.
pub(crate) fn box_triangles() -> impl Iterator<Item = [u32; 3]> {
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    (faces.into_iter()).flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
}

/// Volumes of awkward sizes with every kind of content.
fn volumes() -> Vec<Volume> {
    let mut flat = procedures::cloud(20).unwrap();
    flat.resolution = [40, 20, 10];
    flat.high = glam::DVec3::new(2.0, 1.0, 0.7);
    vec![
        procedures::glass_ball(24).unwrap(),
        procedures::cloud(16).unwrap(),
        flat.checked().unwrap(),
        Volume::constant(2.0, 0.5, 1.3).unwrap(),
    ]
}

const KEYS: [Homogeneity; 5] = [
    Homogeneity {
        key: Key::Refraction,
        epsilon: 0.01,
    },
    Homogeneity {
        key: Key::Extinction,
        epsilon: 0.0,
    },
    Homogeneity {
        key: Key::Extinction,
        epsilon: 0.2,
    },
    Homogeneity {
        key: Key::Both,
        epsilon: 0.1,
    },
    Homogeneity {
        key: Key::Empty,
        epsilon: 0.0,
    },
];

/// Every structure over every volume, with every key.
fn media() -> Vec<(String, Volume, Medium)> {
    let mut all = Vec::new();
    for kind in structure::registry().iter() {
        for (k, volume) in volumes().into_iter().enumerate() {
            for homogeneity in KEYS {
                let structure = kind.make(&Default::default()).unwrap();
                let medium = Medium::new(&volume, structure, homogeneity);
                let name = format!("{} over volume {k}, {homogeneity:?}", kind.name());
                all.push((name, volume.clone(), medium));
            }
        }
    }
    assert_eq!(all.len(), 7 * 4 * 5);
    all
}

//! Faults in a built tree that `validate()` must find.

use super::*;
use crate::fixtures::lattice;

fn built(soup: &TriangleSoup, clip: bool) -> Built {
    let options = Options {
        clip,
        leaf_size: 4,
        ..Options::default()
    };
    let space = RootCell::around(soup);
    let tree = build::build(soup, &space, &options).expect("it builds");
    Built {
        space,
        clipped: clip,
        nodes: tree.nodes,
        references: tree.references,
        depth: tree.depth,
    }
}

fn first_leaf(built: &Built) -> usize {
    let is_leaf = |word: &u32| word & LEAF != 0;
    built.nodes.iter().position(is_leaf).expect("a leaf")
}

#[test]
fn validation_finds_planted_faults() {
    let soup = lattice(6);
    let plant = |what: &str, fault: &dyn Fn(&mut Built)| {
        for clip in [false, true] {
            let mut built = built(&soup, clip);
            assert_eq!(built.validate(&soup), Ok(()));
            fault(&mut built);
            assert!(built.validate(&soup).is_err(), "{what}, clip {clip}");
        }
    };
    plant("another triangle in the place of one", &|b| {
        b.references[0] ^= 1
    });
    plant("a triangle that does not exist", &|b| {
        let last = b.references.last_mut().expect("references");
        *last = LAST | 216;
    });
    plant("a leaf without an end", &|b| {
        let last = b.references.last_mut().expect("references");
        *last &= !LAST;
    });
    plant("a leaf beyond the array", &|b| {
        let leaf = first_leaf(b);
        b.nodes[leaf] = LEAF | b.references.len() as u32;
    });
    plant("a reference that no leaf lists", &|b| {
        b.references.push(LAST)
    });
    plant("a child that is said to be empty", &|b| {
        b.nodes[0] &= b.nodes[0] - 1;
    });
    plant("a block that does not exist", &|b| {
        b.nodes[0] = (b.nodes.len() as u32 / 8) << INNER_SHIFT | 255;
    });
    plant("a cycle", &|b| {
        let inner = (8..b.nodes.len()).find(|i| b.nodes[*i] != 0 && b.nodes[*i] & LEAF == 0);
        let root = b.nodes[0];
        b.nodes[inner.expect("an inner cell")] = root;
    });
    plant("a block that nothing refers to", &|b| {
        b.nodes.extend([0; 8])
    });
    plant("cells that lie elsewhere", &|b| b.space.low[0] -= 0.9);
    plant("a box that is too small", &|b| b.space.extent[1] -= 0.5);
}

#[test]
fn what_all_parts_of_a_side_would_list_is_not_divided() {
    // Across the middle of a square: four parts with all twenty cost as much as the whole, and a visit more.
    let across = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]].map(glam::Vec3::from);
    let triangles = [across.into(); 20];
    let params = raystone_core::params::Params::default();
    let found = crate::known_figures::stats_with("octree", &params, &triangles).unwrap();
    assert_eq!(found.references, 20);
}

//! Faults in a built tree that `validate()` must find, and the arithmetic of octants.

use super::*;
use crate::geometry::Triangle;
use glam::Vec3;

fn soup() -> TriangleSoup {
    let triangle = |i: usize| {
        let at = Vec3::new((i % 6) as f32, (i / 6 % 6) as f32, (i / 36) as f32);
        let vertices = [
            at,
            at + Vec3::new(1.2, 0.1, 0.3),
            at + Vec3::new(0.2, 1.3, 0.1),
        ];
        super::super::triangle::TriangleRecord::new(&Triangle { vertices }, i as u32, 0)
    };
    (0..216).map(triangle).collect::<Vec<_>>().into()
}

fn built(soup: &TriangleSoup, clip: bool) -> Built {
    let options = Options {
        clip,
        leaf_size: 4,
        ..Options::default()
    };
    let space = Space::around(soup);
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
    let soup = soup();
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
fn mirroring_exchanges_the_halves_of_the_axes_that_are_flipped() {
    for flip in 0..8 {
        for mask in 0..256 {
            let expected = (0..8).filter(|i| mask >> (i ^ flip) & 1 == 1);
            let expected: u32 = expected.map(|i| 1 << i).sum();
            assert_eq!(
                mirrored(mask, flip),
                expected,
                "{mask:#b} flipped by {flip:#b}"
            );
        }
    }
}

#[test]
fn visited_children_are_those_whose_interval_is_not_empty() {
    let distances = [-1.0, 0.0, 1.0, 2.0, 3.0, 4.0];
    let mut counts = [0; 9];
    for [x, y, z] in (0..216).map(|i| [i / 36, i / 6 % 6, i % 6].map(|k| distances[k])) {
        let pad = crate::accel::BoxTest::default().pad();
        for (enter, exit) in [(0.0, 4.0), (1.0, 3.0), (2.0, 2.0), (3.0, 2.0)] {
            let middle = [x, y, z];
            let overlaps = |octant: u32| {
                let (mut from, mut to) = (enter, exit);
                for (axis, plane) in middle.iter().enumerate() {
                    if octant >> axis & 1 == 1 {
                        from = f32::max(from, *plane);
                    } else {
                        to = f32::min(to, *plane);
                    }
                }
                from <= to * pad
            };
            let expected: u32 = (0..8).filter(|o| overlaps(*o)).map(|o| 1 << o).sum();
            assert_eq!(
                visited(enter, exit, middle, pad),
                expected,
                "{enter}..{exit} {middle:?}"
            );
            counts[expected.count_ones() as usize] += 1;
        }
    }
    // None, one and up to all eight come up.
    assert!(
        counts[0] > 0 && counts[1] > 0 && counts[4] > 0 && counts[8] > 0,
        "{counts:?}"
    );
}

#[test]
fn boxes_reach_the_octants_on_their_side_and_only_the_lower_one_where_they_end_in_a_plane() {
    let reaches = |min, max| build::by_box(&Bounds { min, max }, [1.0; 3]);
    assert_eq!(reaches([0.0; 3], [2.0; 3]), 255);
    assert_eq!(reaches([0.0; 3], [1.0; 3]), 1);
    assert_eq!(reaches([1.0; 3], [2.0; 3]), 128);
    assert_eq!(reaches([1.0; 3], [1.0; 3]), 1);
    assert_eq!(reaches([0.0, 1.5, 0.0], [2.0, 1.6, 1.0]), 0b1100);
}

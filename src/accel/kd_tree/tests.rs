//! Faults in a built tree that `validate()` must find.

use super::*;
use crate::geometry::Triangle;
use glam::Vec3;

/// A 6 × 6 × 2 lattice of triangles, two layers of each of which cross the planes between cells.
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
    (0..72).map(triangle).collect::<Vec<_>>().into()
}

fn built(soup: &TriangleSoup, clip: bool) -> Built {
    let options = Options {
        clip,
        ..Options::default()
    };
    let tree = build::build(soup, soup.bounds(), &options, &mut BuildLog::default());
    let tree = tree.expect("it builds");
    let mut built = Built {
        bounds: soup.bounds(),
        clipped: clip,
        nodes: tree.nodes,
        references: tree.references,
        stats: StructureStats::default(),
    };
    built.stats = built.measure();
    built
}

fn leaf_with(built: &Built, least: usize) -> usize {
    let fits = |n: &Node| matches!(n.content(), Content::Leaf { count, .. } if count >= least);
    built.nodes.iter().position(fits).expect("such a leaf")
}

fn first_of(node: Node) -> (usize, usize) {
    match node.content() {
        Content::Leaf { first, count } => (first, count),
        Content::Inner { .. } => panic!("no leaf"),
    }
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
    plant("a lost reference", &|b| {
        // Another triangle in the place of one, still ascending.
        let (first, _) = first_of(b.nodes[leaf_with(b, 1)]);
        let id = b.references[first];
        b.references[first] = if id == 0 { 1 } else { id - 1 };
    });
    plant("a triangle that does not exist", &|b| b.references[3] = 72);
    plant("references beyond the array", &|b| {
        let leaf = leaf_with(b, 1);
        b.nodes[leaf].word = b.references.len() as u32;
    });
    plant("a reference that no leaf lists", &|b| b.references.push(0));
    plant("a leaf that lists one less", &|b| {
        let leaf = leaf_with(b, 1);
        let (first, count) = first_of(b.nodes[leaf]);
        b.nodes[leaf] = Node::leaf(first, count - 1);
    });
    plant("a cycle", &|b| b.nodes[1].link = b.nodes[0].link);
    plant("children that do not exist", &|b| {
        b.nodes[0] = Node::inner(0, 3.0, b.nodes.len());
    });
    plant("nodes that nothing refers to", &|b| {
        b.nodes.extend([Node::EMPTY; 2])
    });
    plant("a plane outside its cell", &|b| {
        b.nodes[0].word = 99.0_f32.to_bits()
    });
    plant("a plane that was moved", &|b| {
        let Content::Inner {
            axis,
            position,
            children,
        } = b.nodes[0].content()
        else {
            panic!("the root is a leaf")
        };
        b.nodes[0] = Node::inner(axis, position + 0.7, children);
    });
    plant("a box that is too small", &|b| b.bounds.max[1] -= 0.5);
}

#[test]
fn a_node_is_eight_bytes_and_says_what_it_was_made_of() {
    assert_eq!(size_of::<Node>(), 8);
    let Content::Inner {
        axis,
        position,
        children,
    } = Node::inner(2, -0.5, 77).content()
    else {
        panic!("not inner")
    };
    assert_eq!((axis, position, children), (2, -0.5, 77));
    assert_eq!(first_of(Node::leaf(5, 9)), (5, 9));
    assert_eq!(first_of(Node::leaf(5, 9).moved_by(100, 20)), (25, 9));
    assert_eq!(
        Node::inner(1, 2.0, 3).moved_by(100, 20),
        Node::inner(1, 2.0, 103)
    );
}

#[test]
fn the_split_of_two_clusters_is_beside_the_greater_gap() {
    // Four unit triangles in x 0..1 and one in 9..10: an empty slab is cut off first.
    let triangle = |i: usize| {
        let x = if i < 4 { 0.0 } else { 9.0 };
        let at = Vec3::new(x, 0.0, i as f32);
        let vertices = [
            at,
            at + Vec3::new(1.0, 0.0, 1.0),
            at + Vec3::new(0.0, 1.0, 0.0),
        ];
        super::super::triangle::TriangleRecord::new(&Triangle { vertices }, i as u32, 0)
    };
    let soup: TriangleSoup = (0..5).map(triangle).collect::<Vec<_>>().into();
    let built = built(&soup, false);
    let Content::Inner { axis, position, .. } = built.nodes[0].content() else {
        panic!("the root is a leaf")
    };
    assert_eq!(axis, 0);
    assert!(position == 1.0 || position == 9.0, "{position}");
}

//! Faults in a built tree that `validate()` must find.

use super::*;
use crate::fixtures::lattice;

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
    let soup = lattice(2);
    let plant = |what: &str, fault: &dyn Fn(&mut Built)| {
        for clip in [false, true] {
            let mut built = built(&soup, clip);
            assert_eq!(built.validate(&soup), Ok(()));
            fault(&mut built);
            assert!(built.validate(&soup).is_err(), "{what}, clip {clip}");
        }
    };
    plant("a lost reference", &|b| {
        // Replaces one triangle by another, still ascending.
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

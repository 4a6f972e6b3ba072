//! The nodes at which a glTF scene begins.

use super::gltf_document::Item;
use super::gltf_notes::Notes;

/// The root nodes of the default scene, or else of the first; without scenes those of the file. A
/// node that is listed although another one leads to it is no root.
pub(super) fn roots(document: Item<'_>, nodes: &[Item<'_>], notes: &mut Notes) -> Vec<usize> {
    let scenes: Vec<Item<'_>> = document.list("scenes").collect();
    let named = document
        .index("scene")
        .filter(|scene| *scene < scenes.len());
    let shown = named.unwrap_or(0);
    if let (Some(missing), None) = (document.index("scene"), named) {
        let what = "the scene to show is not there";
        notes.tell(what, || format!("scene {missing}"));
    }
    for (index, scene) in scenes.iter().enumerate() {
        if index != shown && scene.list("nodes").len() > 0 {
            let what = "scenes that are not the one to show are left out";
            notes.tell(what, || scene.place("scene", index));
        }
    }
    let listed: Vec<usize> = match scenes.get(shown) {
        Some(scene) => scene.list("nodes").filter_map(Item::as_index).collect(),
        None => (0..nodes.len()).collect(),
    };
    if let Some(scene) = scenes.get(shown)
        && listed.is_empty()
        && !nodes.is_empty()
    {
        let what = "the scene to show has no nodes";
        notes.tell(what, || scene.place("scene", shown));
    }
    let children = |node: Item<'_>| -> Vec<usize> {
        let children = node.list("children").filter_map(Item::as_index);
        children.filter(|child| *child < nodes.len()).collect()
    };
    let mut has_parent = vec![false; nodes.len()];
    for child in nodes.iter().flat_map(|node| children(*node)) {
        has_parent[child] = true;
    }
    let is_child = |index: usize| has_parent.get(index) == Some(&true);
    // Those without a parent come first: only nodes that none of them leads to are roots, too.
    let (mut order, rest): (Vec<usize>, Vec<usize>) =
        listed.iter().partition(|index| !is_child(**index));
    order.extend(rest);
    let mut reached = vec![false; nodes.len()];
    let mut is_root = vec![false; nodes.len()];
    for root in order {
        let Some(node) = nodes.get(root) else {
            let what = "nodes that are named but not there are left out";
            notes.tell(what, || format!("node {root}"));
            continue;
        };
        if reached[root] {
            if !scenes.is_empty() {
                let what = "nodes are listed as roots although others lead to them: drawn once";
                notes.tell(what, || node.place("node", root));
            }
            continue;
        }
        is_root[root] = true;
        let mut stack = vec![root];
        while let Some(index) = stack.pop() {
            if !std::mem::replace(&mut reached[index], true) {
                stack.extend(children(nodes[index]));
            }
        }
    }
    // In the order of the file, each once.
    let mut is_new = |root: &usize| is_root.get_mut(*root).is_some_and(std::mem::take);
    listed.into_iter().filter(|root| is_new(root)).collect()
}

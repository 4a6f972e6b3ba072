//! Collapsing on the device: costs go up the binary tree and node indices down, one dispatch per
//! level; the kernels are in `kernels/accel/wide/device/`. The wide tree is bit-identical to that
//! of [`WideTree::collapse`]: costs are sums and products that no compiler can reassociate, and
//! every node derives its position from the counts below it.

use super::collapse::{Shape, WideChild, WideKind, WideTree};
use super::{MAX_LEAF, costs};
use crate::tree::parallel::device::{failed, play};
use crate::tree::{Tree, TreeParameters};
use crate::{AccelError, BuildLog};
use bytemuck::{Pod, Zeroable};
use raystone_core::clock::Instant;
use raystone_gpu::{
    Bindings, Composition, Gpu, GpuError, Recording, Storage, UniformValues, groups_for,
};

/// Maximum workgroups of a pass: an invocation handles several nodes of a long level.
const MOST_GROUPS: u32 = 128;

/// In the layout of `places.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Place {
    /// Slot index plus 1, or 0.
    slot: u32,
    /// Its own index, among nodes or triangles.
    own: u32,
    /// 0 for a leaf.
    first_node: u32,
    /// Number of triangles, for a leaf.
    triangles: u32,
}

/// Collapses `tree`, whose leaves hold one triangle each, on this device.
///
/// # Errors
/// The device reported an error, or an array exceeds its limits.
pub(super) fn collapse(
    gpu: &Gpu,
    tree: &Tree,
    shape: Shape,
    settings: &TreeParameters,
    log: &mut BuildLog,
) -> Result<WideTree, AccelError> {
    if tree.nodes.len() < 2 {
        return Ok(WideTree::collapse(tree, shape, settings));
    }
    let mut recording = Recording::new();
    let recorded = log.phase("upload of the tree", || {
        Passes::new(gpu, tree, settings)?.record(&mut recording, shape, tree.depth())
    });
    recorded.map_err(failed)?;
    let played = play(&recording, log)?;
    let start = Instant::now();
    let places: Vec<Place> = played.download("places").map_err(failed)?;
    let mut order: Vec<u32> = played.download("order").map_err(failed)?;
    log.note("transfer", start.elapsed().as_secs_f64() * 1e3);
    order.truncate(tree.order.len());
    log.phase("wide nodes", || {
        gather(tree, &places[..tree.nodes.len()], order, shape)
    })
}

struct Passes<'a> {
    gpu: &'a Gpu,
    bindings: Bindings,
    places: wgpu::Buffer,
    order: wgpu::Buffer,
    inner: u32,
}

impl<'a> Passes<'a> {
    fn new(gpu: &'a Gpu, tree: &Tree, settings: &TreeParameters) -> Result<Self, GpuError> {
        let (nodes, triangles) = (tree.nodes.len() as u64, tree.order.len() as u64);
        let levels = u64::from(tree.depth());
        let scratch = |name: &str, words: u64| Storage::scratch(name, 4 * words);
        // The root is the only node of the first level, and its index is 0.
        let mut counts = vec![0; levels as usize + 1];
        counts[0] = 1;
        let places = gpu.zeroed("tree places", 16 * nodes)?;
        let order = gpu.zeroed("wide order", 4 * triangles)?;
        let values = UniformValues::new()
            .f32("traversal_cost", settings.traversal_cost)
            .f32("intersection_cost", settings.intersection_cost)
            .u32("leaf_size", settings.leaf_size as u32)
            .u32("zero", 0);
        let mut bindings = Bindings::new();
        bindings
            .uniform("settings", values)
            .buffer("nodes", &gpu.storage("tree nodes", &tree.linked())?)
            .buffer("costs", scratch("tree costs", costs::WORDS * nodes))
            .buffer("below", scratch("tree below", 3 * nodes))
            .buffer("list", &gpu.zeroed("tree list", 4 * nodes)?)
            .buffer("starts", &gpu.zeroed("tree starts", 4 * (levels + 1))?)
            .buffer("counts", &gpu.storage("tree counts", &counts)?)
            .buffer("places", &places)
            .buffer("order", &order);
        Ok(Self {
            gpu,
            bindings,
            places,
            order,
            inner: tree.nodes.len() as u32 / 2,
        })
    }

    /// Down for the levels, up for the costs, down for the indices.
    fn record(
        mut self,
        recording: &mut Recording,
        shape: Shape,
        levels: u32,
    ) -> Result<(), GpuError> {
        let down: Vec<u32> = (0..levels).collect();
        let up: Vec<u32> = down.iter().rev().copied().collect();
        let [x, ..] = groups_for(self.inner);
        let groups = [x.min(MOST_GROUPS), 1, 1];
        for (pass, depths) in [("levels", &down), ("costs", &up), ("places", &down)] {
            let kernel = Composition::new(&format!("accel/wide/device/{pass}"))
                .constant("WIDTH", shape.width as u32)
                .constant("MAX_LEAF", MAX_LEAF as u32)
                .feature("octants", shape.by_octant);
            let pipeline = self.gpu.pipeline(&kernel, true)?;
            for depth in depths {
                let level = UniformValues::new().u32("depth", *depth);
                self.bindings.uniform("level", level);
                recording.run(pass, &pipeline, &self.bindings, groups);
            }
        }
        recording.download("places", &self.places);
        recording.download("order", &self.order);
        Ok(())
    }
}

/// The wide tree, from every binary node's index. Faulty kernel output must not cause a panic.
fn gather(
    tree: &Tree,
    places: &[Place],
    order: Vec<u32>,
    shape: Shape,
) -> Result<WideTree, AccelError> {
    let is_node = |place: &&Place| place.slot > 0 && place.first_node > 0;
    let count = 1 + places.iter().filter(is_node).count();
    let mut nodes = vec![vec![WideChild::NOTHING; shape.width]; count];
    let mut depths = vec![0_u32; count];
    for (node, place) in tree.nodes.iter().zip(places).filter(|(_, p)| p.slot > 0) {
        let (parent, slot) = (
            (place.slot - 1) as usize / shape.width,
            (place.slot - 1) as usize % shape.width,
        );
        let kind = if place.first_node > 0 {
            WideKind::Node(place.own)
        } else {
            WideKind::Leaf {
                first: place.own,
                count: place.triangles,
            }
        };
        let is_inside = match kind {
            WideKind::Node(own) => (own as usize) < count && own as usize > parent,
            WideKind::Leaf { first, count } => {
                (1..=MAX_LEAF as u32).contains(&count)
                    && u64::from(first) + u64::from(count) <= order.len() as u64
            }
        };
        ensure!(
            is_inside && parent < count && nodes[parent][slot].is_nothing(),
            "slot {slot} of wide node {parent} of {count} holds {kind:?}: a kernel is at fault"
        );
        nodes[parent][slot] = WideChild {
            bounds: node.bounds,
            kind,
        };
    }
    depths[0] = 1;
    for parent in 0..count {
        if !shape.by_octant {
            nodes[parent].retain(|child| !child.is_nothing());
        }
        for child in &nodes[parent] {
            if let WideKind::Node(own) = child.kind {
                depths[own as usize] = depths[parent] + 1;
            }
        }
    }
    let triangles = tree.order.len();
    let is_known = |id: &u32| (*id as usize) < triangles;
    ensure!(
        order.iter().all(is_known),
        "a wide leaf lists a triangle that is none of {triangles}: a kernel is at fault"
    );
    Ok(WideTree {
        nodes,
        order,
        depth: depths.into_iter().max().unwrap_or(1),
    })
}

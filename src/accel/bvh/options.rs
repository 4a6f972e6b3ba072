//! Parameters of `bvh` and `roped-bvh` beyond those of the tree: the traversal and its layout.

use crate::AccelError;
use crate::tracer::{Refill, RefillParameters};
use crate::tree::TreeParameters;
use raystone_core::parameters;

/// Invocations per workgroup, `LANES` of `kernels/common/lane.wesl`.
const LANES: u32 = raystone_gpu::WORKGROUP_SIZE;
/// Workgroup memory guaranteed by WebGPU, bytes.
const WORKGROUP_BYTES: u32 = 16384;
/// Levels that fit in the two words of a restart trail.
const TRAIL_LEVELS: u32 = 64;

parameters! {
    /// Parameters of `bvh`.
    pub struct BvhParameters {
        /// The tree.
        tree: TreeParameters;
        /// near child first with a stack (Aila & Laine 2009), parent pointers (Hapala 2011) or a short
        /// stack with a restart trail (Laine 2010); skip pointers in one order (Smits 1998) or in eight
        traversal: Traversal = Traversal::Stack;
        /// 64: boxes of both children, nearer first (octant-roped: own box, eight ropes); 32: own box,
        /// order by axis; auto: what the traversal does best
        node_bytes: NodeBytes = NodeBytes::Auto;
        /// where the stack lies (stack, short-stack)
        stack_memory: StackMemory = StackMemory::Function;
        /// entries of short-stack; no other traversal reads it
        short_stack_entries: u32 = 4, in 1..=32;
        /// Where nodes and triangles lie.
        layout: Layout;
        /// How the batch kernel hands out rays (stack).
        refill: RefillParameters;
    }

    /// Parameters of `roped-bvh`.
    pub struct RopedParameters {
        /// The tree.
        tree: TreeParameters;
        /// skip pointers in one order (Dufay 2017, Alg. 4.4) or in eight, by octant of the direction
        traversal: Ropes = Ropes::Roped;
        /// Where nodes and triangles lie.
        layout: Layout;
    }

    /// Parameters that all traversals read.
    pub(crate) struct Layout {
        /// leaves: copies of the triangles in leaf order, or indices
        triangles: LeafTriangles = LeafTriangles::Gathered;
        /// order of nodes in memory (van Emde Boas: halves of the height, recursively)
        node_order: NodeOrder = NodeOrder::DepthFirst;
    }

    /// How the tree is walked.
    pub(crate) enum Traversal {
        /// Near child first, with a stack.
        Stack = "stack",
        /// Near child first, back by parent pointers.
        ParentPointer = "parent-pointer",
        /// Skip pointers in one order.
        Roped = "roped",
        /// Skip pointers in eight orders.
        OctantRoped = "octant-roped",
        /// A short stack with a restart trail.
        ShortStack = "short-stack",
    }

    /// How `roped-bvh` is walked.
    pub(crate) enum Ropes {
        /// Skip pointers in one order.
        Roped = "roped",
        /// Skip pointers in eight orders.
        OctantRoped = "octant-roped",
    }

    /// Bytes of a node.
    pub(crate) enum NodeBytes {
        /// The best layout for the traversal.
        Auto = "auto",
        /// Its own box.
        Own = "32",
        /// Boxes of both children, or its own and eight ropes.
        Both = "64",
    }

    /// Location of a stack.
    pub(crate) enum StackMemory {
        /// In a variable of the function.
        Function = "function",
        /// In a private variable of the module.
        Private = "private",
        /// In workgroup memory.
        Workgroup = "workgroup",
    }

    /// Contents of leaves.
    pub(crate) enum LeafTriangles {
        /// Copies of the triangles.
        Gathered = "gathered",
        Indexed = "indexed",
    }

    /// In what order nodes lie in memory.
    pub(crate) enum NodeOrder {
        /// A node before its subtrees, one after the other.
        DepthFirst = "depth-first",
        /// Level by level.
        BreadthFirst = "breadth-first",
        /// Halves of the height, recursively.
        VanEmdeBoas = "van-emde-boas",
    }
}

impl From<RopedParameters> for BvhParameters {
    fn from(roped: RopedParameters) -> Self {
        Self {
            tree: roped.tree,
            traversal: match roped.traversal {
                Ropes::Roped => Traversal::Roped,
                Ropes::OctantRoped => Traversal::OctantRoped,
            },
            layout: roped.layout,
            ..Self::default()
        }
    }
}

impl BvhParameters {
    /// Checks that the options are compatible.
    ///
    /// # Errors
    /// Two of them contradict each other.
    pub(super) fn check(&self) -> Result<(), AccelError> {
        let contradiction = |why: &str| Err(AccelError::Contradiction(why.to_owned()));
        let has_stack = matches!(self.traversal, Traversal::Stack | Traversal::ShortStack);
        match (self.traversal, self.node_bytes) {
            _ if !has_stack && self.stack_memory != StackMemory::Function => contradiction(
                "stack_memory: this traversal has no stack; leave it at `function`, or take \
                 traversal = stack or short-stack",
            ),
            (Traversal::Stack, _) => Ok(()),
            _ if self.refill.refill == Refill::Always => contradiction(
                "refill = always: among the traversals of `bvh` the stack alone can be refilled; \
                 take traversal = stack or refill = auto",
            ),
            (Traversal::Roped, NodeBytes::Both) => contradiction(
                "node_bytes = 64: a rope leads to one box, not to a pair; traversal = roped takes 32",
            ),
            (Traversal::OctantRoped, NodeBytes::Own) => contradiction(
                "node_bytes = 32: a box and eight ropes need 64; traversal = parent-pointer with \
                 node_bytes = 32 walks in the same order",
            ),
            _ => Ok(()),
        }
    }

    /// Returns the refill rule of the batch kernel: only for traversals with a resumable state.
    pub(super) fn refill(&self) -> RefillParameters {
        match self.traversal {
            Traversal::Stack => self.refill.clone(),
            _ => RefillParameters::NONE,
        }
    }

    /// True if nodes have 32 bytes with their own box instead of 64 with both children's.
    pub(super) fn has_boxes(&self) -> bool {
        self.node_bytes == NodeBytes::Own || self.traversal == Traversal::Roped
    }

    /// Checks that a tree of this depth can be traversed.
    ///
    /// # Errors
    /// Its stack does not fit into workgroup memory, or its trail into two words.
    pub(super) fn check_depth(&self, depth: u32) -> Result<(), AccelError> {
        if self.traversal == Traversal::ShortStack {
            AccelError::check_limit(
                "levels of a restart trail",
                depth,
                TRAIL_LEVELS,
                "choose another `traversal`",
            )?;
        }
        if self.stack_memory == StackMemory::Workgroup {
            let bytes = self.stack_entries(depth) * LANES * 4;
            let what = "bytes of stacks in workgroup memory";
            AccelError::check_limit(
                what,
                bytes,
                WORKGROUP_BYTES,
                "choose another `stack_memory`",
            )?;
        }
        Ok(())
    }

    /// Entries of the kernel's stack for a tree of this depth; 0 if it has none. At most one entry
    /// is pushed per level; a multiple of 16, so that scenes of similar depth share a kernel.
    pub(super) fn stack_entries(&self, depth: u32) -> u32 {
        match self.traversal {
            Traversal::Stack => depth.max(1).next_multiple_of(16),
            Traversal::ShortStack => self.short_stack_entries,
            _ => 0,
        }
    }

    /// Maximum steps of a traversal of `nodes` nodes at this depth.
    pub(super) fn step_fuse(&self, nodes: usize, depth: u32) -> usize {
        match self.traversal {
            Traversal::Stack | Traversal::Roped | Traversal::OctantRoped => nodes + 1,
            // Down once, up from both children.
            Traversal::ParentPointer => 3 * nodes,
            // Every visit may begin with a restart.
            Traversal::ShortStack => nodes * (depth as usize + 2),
        }
        .min(u32::MAX as usize)
    }

    pub(super) fn kernel(&self) -> &'static str {
        match self.traversal {
            Traversal::Stack => "accel/bvh/stack",
            Traversal::ParentPointer => "accel/bvh/parent_pointer",
            Traversal::Roped => "accel/bvh/roped",
            Traversal::OctantRoped => "accel/bvh/octant_roped",
            Traversal::ShortStack => "accel/bvh/short_stack",
        }
    }

    /// Features of the kernel, except those of the leaves.
    pub(super) fn features(&self) -> Vec<&'static str> {
        let boxes = self.has_boxes() && self.traversal != Traversal::Roped;
        let features = [
            (self.stack_memory == StackMemory::Private, "stack_private"),
            (
                self.stack_memory == StackMemory::Workgroup,
                "stack_workgroup",
            ),
            (boxes, "boxes"),
            (self.traversal == Traversal::ShortStack, "short_stack"),
        ];
        let on = features.into_iter().filter(|(on, _)| *on);
        on.map(|(_, name)| name).collect()
    }
}

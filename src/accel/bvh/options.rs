//! Parameters of `bvh` and `roped-bvh` beyond those of the tree: which traversal reads which layout.

use super::super::AccelError;
use crate::params::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};

/// Invocations of a workgroup, `LANES` of `kernels/common/lane.wesl`.
const LANES: u32 = crate::gpu::WORKGROUP_SIZE;
/// Workgroup memory that WebGPU promises, bytes.
const WORKGROUP_BYTES: u32 = 16384;
/// Levels that the two words of a restart trail hold.
const TRAIL_LEVELS: u32 = 64;

/// How the tree is walked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Traversal {
    Stack,
    ParentPointer,
    Roped,
    OctantRoped,
    ShortStack,
}

/// In what order nodes lie in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NodeOrder {
    DepthFirst,
    BreadthFirst,
    VanEmdeBoas,
}

/// The choices of one built structure, free of contradictions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Options {
    pub traversal: Traversal,
    /// Nodes of 32 bytes with their own box instead of 64 with both children's.
    pub boxes: bool,
    pub indexed: bool,
    pub order: NodeOrder,
    /// Feature of the kernel for a stack outside function memory.
    stack_feature: Option<&'static str>,
    short_stack_entries: u32,
}

fn choice(
    name: &'static str,
    description: &'static str,
    names: &'static [&'static str],
) -> Parameter {
    Parameter {
        name,
        description,
        default: ParamValue::Name(names[0].to_owned()),
        range: ParamRange::Choice(names),
    }
}

/// Parameters that all traversals read.
fn layout_parameters() -> ParameterSchema {
    vec![
        choice(
            "triangles",
            "leaves: copies of the triangles in leaf order, or indices",
            &["gathered", "indexed"],
        ),
        choice(
            "node_order",
            "order of nodes in memory (van Emde Boas: halves of the height, recursively)",
            &["depth-first", "breadth-first", "van-emde-boas"],
        ),
    ]
}

/// Parameters of `bvh`.
pub(super) fn bvh_parameters() -> ParameterSchema {
    let mut out = vec![
        choice(
            "traversal",
            "near child first with a stack (Aila & Laine 2009), parent pointers (Hapala 2011) or a \
             short stack with a restart trail (Laine 2010); skip pointers in one order (Smits 1998) \
             or in eight",
            &[
                "stack",
                "parent-pointer",
                "roped",
                "octant-roped",
                "short-stack",
            ],
        ),
        choice(
            "node_bytes",
            "64: boxes of both children, nearer first (octant-roped: own box, eight ropes); 32: own \
             box, order by axis; auto: what the traversal does best",
            &["auto", "32", "64"],
        ),
        choice(
            "stack_memory",
            "where the stack lies (stack, short-stack)",
            &["function", "private", "workgroup"],
        ),
        Parameter {
            name: "short_stack_entries",
            description: "entries of short-stack; no other traversal reads it",
            default: ParamValue::Integer(4),
            range: ParamRange::Integer { min: 1, max: 32 },
        },
    ];
    out.extend(layout_parameters());
    out
}

/// Parameters of `roped-bvh`.
pub(super) fn roped_parameters() -> ParameterSchema {
    let mut out = vec![choice(
        "traversal",
        "skip pointers in one order (Dufay 2017, Alg. 4.4) or in eight, by octant of the direction",
        &["roped", "octant-roped"],
    )];
    out.extend(layout_parameters());
    out
}

impl Options {
    /// Reads the parameters of either schema.
    ///
    /// # Errors
    /// Two of them contradict each other.
    pub fn new(params: &Params) -> Result<Self, AccelError> {
        let traversal = match params.name("traversal") {
            "parent-pointer" => Traversal::ParentPointer,
            "roped" => Traversal::Roped,
            "octant-roped" => Traversal::OctantRoped,
            "short-stack" => Traversal::ShortStack,
            _ => Traversal::Stack,
        };
        let given = |name: &str| params.0.contains_key(name);
        let stack_memory = if given("stack_memory") {
            params.name("stack_memory")
        } else {
            "function"
        };
        let node_bytes = if given("node_bytes") {
            params.name("node_bytes")
        } else {
            "auto"
        };
        let contradiction = |why: &str| Err(AccelError::Contradiction(why.to_owned()));
        let has_stack = matches!(traversal, Traversal::Stack | Traversal::ShortStack);
        match (traversal, node_bytes) {
            _ if !has_stack && stack_memory != "function" => contradiction(
                "stack_memory: this traversal has no stack; leave it at `function`, or take \
                 traversal = stack or short-stack",
            ),
            (Traversal::Roped, "64") => contradiction(
                "node_bytes = 64: a rope leads to one box, not to a pair; traversal = roped takes 32",
            ),
            (Traversal::OctantRoped, "32") => contradiction(
                "node_bytes = 32: a box and eight ropes need 64; traversal = parent-pointer with \
                 node_bytes = 32 walks in the same order",
            ),
            _ => Ok(Self {
                traversal,
                boxes: node_bytes == "32" || traversal == Traversal::Roped,
                indexed: params.name("triangles") == "indexed",
                order: match params.name("node_order") {
                    "breadth-first" => NodeOrder::BreadthFirst,
                    "van-emde-boas" => NodeOrder::VanEmdeBoas,
                    _ => NodeOrder::DepthFirst,
                },
                stack_feature: match stack_memory {
                    "private" => Some("stack_private"),
                    "workgroup" => Some("stack_workgroup"),
                    _ => None,
                },
                short_stack_entries: if traversal == Traversal::ShortStack {
                    params.integer("short_stack_entries") as u32
                } else {
                    0
                },
            }),
        }
    }

    /// Whether a tree of this depth can be walked.
    ///
    /// # Errors
    /// Its stack does not fit into workgroup memory, or its trail into two words.
    pub fn check_depth(&self, depth: u32) -> Result<(), AccelError> {
        if self.traversal == Traversal::ShortStack {
            AccelError::check_limit("levels of a restart trail", depth, TRAIL_LEVELS)?;
        }
        if self.stack_feature == Some("stack_workgroup") {
            let bytes = self.stack_entries(depth) * LANES * 4;
            let what = "bytes of stacks in workgroup memory";
            AccelError::check_limit(what, bytes, WORKGROUP_BYTES)?;
        }
        Ok(())
    }

    /// Entries of the kernel's stack for a tree of this depth; 0 if it has none. One entry is pushed
    /// a level at most; a multiple of 16, so that scenes of like depth share a kernel.
    pub fn stack_entries(&self, depth: u32) -> u32 {
        match self.traversal {
            Traversal::Stack => depth.max(1).next_multiple_of(16),
            Traversal::ShortStack => self.short_stack_entries,
            _ => 0,
        }
    }

    /// Steps that a traversal of `nodes` nodes and this depth takes at most.
    pub fn step_fuse(&self, nodes: usize, depth: u32) -> usize {
        match self.traversal {
            Traversal::Stack | Traversal::Roped | Traversal::OctantRoped => nodes + 1,
            // Down once, up from both children.
            Traversal::ParentPointer => 3 * nodes,
            // Every visit may begin with a restart.
            Traversal::ShortStack => nodes * (depth as usize + 2),
        }
        .min(u32::MAX as usize)
    }

    /// Module of the kernel.
    pub fn kernel(&self) -> &'static str {
        match self.traversal {
            Traversal::Stack => "accel/bvh/stack",
            Traversal::ParentPointer => "accel/bvh/parent_pointer",
            Traversal::Roped => "accel/bvh/roped",
            Traversal::OctantRoped => "accel/bvh/octant_roped",
            Traversal::ShortStack => "accel/bvh/short_stack",
        }
    }

    /// Features of the kernel, less those of the leaves.
    pub fn features(&self) -> Vec<&'static str> {
        let mut out: Vec<_> = self.stack_feature.into_iter().collect();
        if self.boxes && self.traversal != Traversal::Roped {
            out.push("boxes");
        }
        if self.traversal == Traversal::ShortStack {
            out.push("short_stack");
        }
        out
    }
}

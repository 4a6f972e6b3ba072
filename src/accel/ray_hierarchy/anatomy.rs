//! What a descent costs, level by level, by the scalar twin of its passes.

use super::enclosing::enclosing;
use super::layout::Layout;
use super::node::{Bounding, FAR, Node, no_rays, node_of_ray};
use super::primitives::{Primitive, Primitives};
use super::start::Sample;
use super::{Bound, Options, Union};
use crate::{AccelError, Ray, TriangleSoup};
use rayon::prelude::*;
use raystone_core::params::{Parameters as _, Params};

/// A level of the tree over rays, and what passed through it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LevelAnatomy {
    /// Nodes with rays.
    pub nodes: u64,
    /// Pairs of a node of this level, with rays, and a primitive that were tested.
    pub tests: u64,
    /// Those that met: the stream of this level.
    pub pairs: u64,
    /// The most of them that come from one batch of primitives.
    pub longest: u64,
    /// Mean and greatest half opening angle of nodes, radians.
    pub angle: [f64; 2],
    /// Mean and greatest radius of nodes, scene units.
    pub radius: [f64; 2],
}

/// The levels of a descent, from the leaves up to where it began.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Anatomy {
    /// Rays with a direction.
    pub rays: u64,
    /// Levels, leaves first.
    pub levels: Vec<LevelAnatomy>,
    /// Tests of a sample of the primitives by which the level to begin at was chosen; 0 where it was given.
    pub pilots: u64,
}

impl Anatomy {
    /// Streams all triangles through a tree over `rays` on the host, in the order in which they are given, without chunks.
    ///
    /// # Errors
    /// Unknown parameters, or chunks, which only the device has.
    pub fn new(soup: &TriangleSoup, params: &Params, rays: &[Ray]) -> Result<Self, AccelError> {
        let options = Options::from_params(params)?;
        if options.chunks > 1 {
            return Err(AccelError::Contradiction(
                "the anatomy of a ray-hierarchy is that of chunks = 1".to_owned(),
            ));
        }
        let primitives = Primitives::new(soup, &options);
        let mut layout = Layout::new(rays.len() as u32, primitives.count, &options);
        let levels = tree(soup, &options, &layout, rays);
        let live = rays.iter().filter(|ray| ray.is_ray()).count() as u64;
        let mut pilots = 0;
        if options.chooses_start() {
            (layout.begin, pilots) = chosen(&layout, &levels, &primitives, &options);
        }
        let mut found: Vec<LevelAnatomy> = levels.iter().map(|nodes| shape(nodes)).collect();
        found.truncate(layout.begin + 1);
        let descent = Descent {
            layout: &layout,
            levels: &levels,
            primitives: primitives.levels(),
            bound: options.bound,
            bounding: options.bounding(),
            branching: options.branching as usize,
        };
        let [_, coming] = layout.primitives[layout.primitives.len() - 1];
        let counts = (0..coming as usize).into_par_iter().map(|primitive| {
            let mut counts = vec![[0_u64; 2]; layout.begin + 1];
            let nodes = (0..levels[layout.begin].len()).collect();
            descent.below(layout.begin, primitive, nodes, &mut counts);
            counts
        });
        for batch in counts.collect::<Vec<_>>().chunks(layout.batch as usize) {
            for (number, level) in found.iter_mut().enumerate() {
                let sum = |of: usize| batch.iter().map(|counts| counts[number][of]).sum::<u64>();
                let pairs = sum(1);
                level.tests += sum(0);
                level.pairs += pairs;
                level.longest = level.longest.max(pairs);
            }
        }
        Ok(Self {
            rays: live,
            levels: found,
            pilots,
        })
    }

    /// Tests of a node against a primitive, with those of pilots.
    pub fn tests(&self) -> u64 {
        let levels: u64 = self.levels.iter().map(|level| level.tests).sum();
        levels + self.pilots
    }

    /// Pairs of the longest stream, were all primitives one batch.
    pub fn peak(&self) -> u64 {
        self.levels
            .iter()
            .map(|level| level.pairs)
            .max()
            .unwrap_or(0)
    }
}

/// The scalar twin of `begin.wesl` and `expand.wesl`.
struct Descent<'a> {
    layout: &'a Layout,
    /// Nodes over rays.
    levels: &'a [Vec<Node>],
    /// Primitives of all levels.
    primitives: &'a [Primitive],
    bound: Bound,
    bounding: Bounding,
    branching: usize,
}

impl Descent<'_> {
    /// Tests nodes of a level against a primitive, which is numbered within its own level, and then the children of those that
    /// meet; adds tests and pairs of each level.
    fn below(
        &self,
        level: usize,
        primitive: usize,
        mut nodes: Vec<usize>,
        counts: &mut [[u64; 2]],
    ) {
        let of_level = &self.levels[level];
        let [first, _] = self.layout.primitives[self.layout.height(level)];
        let tested = &self.primitives[first as usize + primitive];
        nodes.retain(|node| of_level[*node].radius >= 0.0);
        counts[level][0] += nodes.len() as u64;
        nodes.retain(|node| tested.meets(&of_level[*node], self.bound, &self.bounding));
        counts[level][1] += nodes.len() as u64;
        if level == 0 || nodes.is_empty() {
            return;
        }
        let children = |at: usize| at * self.branching..(at + 1) * self.branching;
        let mut met: Vec<usize> = nodes.into_iter().flat_map(children).collect();
        met.retain(|child| *child < self.levels[level - 1].len());
        if !self.layout.is_dual(level) {
            return self.below(level - 1, primitive, met, counts);
        }
        let [_, many] = self.layout.primitives[self.layout.height(level - 1)];
        for child in children(primitive).filter(|child| *child < many as usize) {
            self.below(level - 1, child, met.clone(), counts);
        }
    }
}

/// The level with the fewest tests of a sample of the primitives, and the tests that it took. CPU version of `pilot.wesl`.
fn chosen(
    layout: &Layout,
    levels: &[Vec<Node>],
    primitives: &Primitives,
    options: &Options,
) -> (usize, u64) {
    let sample = Sample::of(primitives.count as u32);
    let sampled = || primitives.all().iter().step_by(sample.stride as usize);
    let bounding = options.bounding();
    let met = |level: usize| -> u32 {
        let meets = |node: &Node| {
            let met = sampled().filter(|of| of.meets(node, options.bound, &bounding));
            met.count() as u32
        };
        levels[level].iter().map(meets).sum()
    };
    let above = layout.beginnings().skip(1);
    let tests = above.clone().map(|level| levels[level].len() as u64);
    let tests = tests.sum::<u64>() * u64::from(sample.count);
    let met: Vec<u32> = above.map(met).collect();
    (layout.chosen(sample.count, &met), tests)
}

/// Nodes of all levels. CPU version of `leaves.wesl` and `unions.wesl`.
fn tree(soup: &TriangleSoup, options: &Options, layout: &Layout, rays: &[Ray]) -> Vec<Vec<Node>> {
    let bounding = options.bounding();
    let pairwise = options.union == Union::Pairwise;
    let leaf_of = |ray: &Ray| {
        if !ray.is_ray() {
            return no_rays();
        }
        let ray = soup.intersection.raised(ray);
        let end = if options.reach { ray.t_max } else { FAR };
        node_of_ray(ray.origin, ray.direction, end, &bounding)
    };
    let mut level: Vec<Node> = rays.iter().map(leaf_of).collect();
    level.resize(layout.rays as usize, no_rays());
    let widths = std::iter::once(options.bundle).chain(std::iter::repeat(options.branching));
    let mut levels: Vec<Vec<Node>> = Vec::new();
    for (_, width) in layout.levels.iter().zip(widths) {
        let around = |children: &mut [Node]| enclosing(children, pairwise, &bounding);
        level = level
            .clone()
            .par_chunks_mut(width as usize)
            .map(around)
            .collect();
        levels.push(level.clone());
    }
    levels
}

fn shape(nodes: &[Node]) -> LevelAnatomy {
    let live: Vec<&Node> = nodes.iter().filter(|node| node.radius >= 0.0).collect();
    let of = |value: &dyn Fn(&Node) -> f64| {
        let values = live.iter().map(|node| value(node));
        let sum: f64 = values.clone().sum();
        [sum / live.len().max(1) as f64, values.fold(0.0, f64::max)]
    };
    LevelAnatomy {
        nodes: live.len() as u64,
        angle: of(&Node::angle),
        radius: of(&|node| f64::from(node.radius)),
        ..LevelAnatomy::default()
    }
}

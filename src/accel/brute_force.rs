//! Tests every ray against every triangle. CPU version of `kernels/accel/brute_force.wesl`.

use super::intersection::Reciprocal;
use super::structure::prelude::*;
use super::triangle::watertight::{Shear, products, shear, sheared};
use super::triangle::{TriangleRecord, intersect_triangle};
use crate::oracle::{GROUP, Groups, Line};
use rayon::prelude::*;

parameters! {
    /// None.
    pub struct NoParameters {}
}

/// The registry entry.
pub struct BruteForce;

impl Structure for BruteForce {
    const NAME: &'static str = "brute-force";
    const DESCRIPTION: &'static str =
        "every triangle for every ray: the simplest reference, for small scenes";
    type Parameters = NoParameters;

    fn build(soup: &TriangleSoup, _: &NoParameters, _: &mut BuildLog) -> BuildResult {
        Ok(Box::new(Built {
            triangles: soup.records.len() as u32,
        }))
    }
}

struct Built {
    triangles: u32,
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let (built, given) = (self.triangles as usize, soup.records.len());
        ensure!(built == given, "built for {built} triangles, given {given}");
        Ok(())
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let triangles = self.triangles as usize;
        GpuBuffers {
            kernel: "accel/brute_force",
            uniforms: vec![limits(triangles, triangles)],
            ..Default::default()
        }
    }

    fn stats(&self) -> StructureStats {
        StructureStats {
            references: u64::from(self.triangles),
            ..Default::default()
        }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

impl Traverse for Built {
    fn trace(&self, soup: &TriangleSoup, walk: Walk) -> Hit {
        test_all(soup, walk)
    }
}

/// Tests the triangles of a soup one after the other.
pub(crate) fn test_all(soup: &TriangleSoup, mut walk: Walk) -> Hit {
    for triangle in &soup.records {
        walk.test(triangle);
        if walk.is_answered() {
            break;
        }
    }
    walk.hit
}

/// Number of neighbouring triangles stored together, so that the compiler tests several at once.
const LANES: usize = GROUP;
/// Minimum number of rays for which sorting triangles into groups pays off.
const MANY: usize = 256;

/// `LANES` triangles, by vertex and component; unused lanes are degenerate.
struct Block {
    vertices: [[[f32; LANES]; 3]; 3],
}

impl Block {
    fn new(records: &[TriangleRecord], ids: &[u32]) -> Self {
        let lanes = |vertex: usize, axis: usize| {
            std::array::from_fn(|lane| {
                let record = ids.get(lane).and_then(|id| records.get(*id as usize));
                record.map_or(0.0, |r| r.vertices()[vertex][axis])
            })
        };
        Self {
            vertices: [0, 1, 2].map(|vertex| [0, 1, 2].map(|axis| lanes(vertex, axis))),
        }
    }

    /// Lanes that may hit the ray: those that pass the sign tests of its triangle test, with the
    /// same products in the same order, or all lanes if signs are not cheaper than the test itself.
    fn candidates(&self, ray: &Ray, inverse: &Reciprocal) -> u32 {
        if !inverse.triangle.follows_watertight_signs() {
            return (1 << LANES) - 1;
        }
        let s = shear(ray, inverse);
        mask(std::array::from_fn(|l| self.sheared(l, &s)))
    }

    /// The compared products of [`super::triangle::Watertight`].
    fn sheared(&self, lane: usize, s: &Shear) -> u32 {
        let vertices = [0, 1, 2]
            .map(|vertex| sheared(s, [0, 1, 2].map(|axis| self.vertices[vertex][axis][lane])));
        let (p, q) = products(vertices);
        let all = |compare: fn(&f32, &f32) -> bool| {
            (0..3).fold(1, |all, i| all & u32::from(compare(&p[i], &q[i])))
        };
        all(f32::ge) | all(f32::le)
    }
}

/// One bit per lane.
fn mask(inside: [u32; LANES]) -> u32 {
    let lanes = inside.iter().enumerate();
    lanes.fold(0, |mask, (lane, bit)| mask | bit << lane)
}

/// All triangles of a soup, ready for brute force; the reference for the reference tracers.
///
/// A triangle is skipped only if its test cannot accept it. Hits are clamped into the slabs of the
/// triangle's box, so the further widened slabs of the box around its group contain every hit; the
/// rest must pass the sign tests with the same products as the test; and the test itself decides.
pub(crate) struct EveryTriangle<'a> {
    soup: &'a TriangleSoup,
    groups: Groups,
    blocks: Vec<Block>,
}

impl<'a> EveryTriangle<'a> {
    /// With `many` rays, sorting the triangles is worth its cost.
    pub(crate) fn new(soup: &'a TriangleSoup, many: bool) -> Self {
        let records = &soup.records;
        let groups = Groups::new(records.len(), many, |id| records[id].vertices());
        let block = |group| Block::new(records, groups.members(group));
        Self {
            soup,
            blocks: (0..groups.len()).into_par_iter().map(block).collect(),
            groups,
        }
    }

    /// Tests all triangles, with indices starting at `first`; a nearer hit replaces `hit`.
    pub(crate) fn intersect(&self, ray: &Ray, first: u32, hit: &mut Hit) {
        let ray = &self.soup.intersection.raised(ray);
        let inverse = self.soup.intersection.inverse(ray.direction);
        let masks = self.soup.masks.as_deref();
        // With infinite reciprocals slabs are inconclusive.
        let bounded = self.soup.intersection.box_test.finite;
        let line = if bounded {
            Line::new(ray.origin, *inverse, [ray.t_min, hit.t])
        } else {
            Line::new([0.0; 3], [0.0; 3], [f32::NEG_INFINITY, f32::INFINITY])
        };
        self.groups.visit(&line, |group| {
            if let Some(block) = self.blocks.get(group) {
                let mut mask = block.candidates(ray, &inverse);
                while mask != 0 {
                    let lane = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    if let Some(&index) = self.groups.members(group).get(lane) {
                        let record = &self.soup.records[index as usize];
                        let id = record.id + first;
                        let record = TriangleRecord { id, ..*record };
                        intersect_triangle((&record, masks), ray, inverse, hit);
                    }
                }
            }
            if bounded { hit.t } else { f32::INFINITY }
        });
    }
}

/// Nearest hits of many rays by testing every triangle, on all cores.
pub fn brute_force_hits(soup: &TriangleSoup, rays: &[Ray]) -> Vec<Hit> {
    let all = EveryTriangle::new(soup, rays.len() >= MANY);
    let closest = |ray: &Ray| {
        let mut hit = Hit::miss(ray);
        if ray.is_ray() {
            all.intersect(ray, 0, &mut hit);
        }
        hit
    };
    rays.par_iter().map(closest).collect()
}

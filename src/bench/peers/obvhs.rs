//! The `obvhs` crate: PLOC with reinsertion, as a binary tree and one of eight compressed children.

use super::native::Caster;
use super::{BuiltPeer, Peer};
use glam::Vec3A;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use obvhs::{BvhBuildParams, ray};
use raystone_accel::mask::is_cut_out;
use raystone_accel::{Hit, Query, Ray, TriangleSoup};
use raystone_core::clock::Instant;
use raystone_gpu::Gpu;
use std::time::Duration;

pub(super) enum Obvhs {
    Binary,
    /// Eight compressed children per node.
    Wide,
}

enum Tree {
    Binary(Bvh2),
    Wide(CwBvh),
}

struct Built<'a> {
    tree: Tree,
    /// In leaf order, with the scene index of each.
    triangles: Vec<RtTriangle>,
    ids: Vec<u32>,
    soup: &'a TriangleSoup,
    build_ms: f64,
}

impl Peer for Obvhs {
    fn name(&self) -> &'static str {
        match self {
            Self::Binary => "obvhs-bvh2",
            Self::Wide => "obvhs-cwbvh",
        }
    }

    fn description(&self) -> &'static str {
        match self {
            Self::Binary => "binary tree of the crate obvhs, its medium build, on the host",
            Self::Wide => "compressed wide tree of the crate obvhs, its medium build, on the host",
        }
    }

    fn build<'a>(
        &self,
        _gpu: &Gpu,
        soup: &'a TriangleSoup,
    ) -> Result<Box<dyn BuiltPeer + 'a>, String> {
        let corners = soup.records.iter().map(|r| r.vertices().map(Vec3A::from));
        let all: Vec<Triangle> = corners
            .map(|[v0, v1, v2]| Triangle { v0, v1, v2 })
            .collect();
        let start = Instant::now();
        let (params, mut core) = (BvhBuildParams::medium_build(), Duration::ZERO);
        let tree = match self {
            Self::Binary => Tree::Binary(build_bvh2_from_tris(&all, params, &mut core)),
            Self::Wide => Tree::Wide(build_cwbvh_from_tris(&all, params, &mut core)),
        };
        let ids = match &tree {
            Tree::Binary(tree) => tree.primitive_indices.clone(),
            Tree::Wide(tree) => tree.primitive_indices.clone(),
        };
        let triangles = ids.iter().map(|id| (&all[*id as usize]).into()).collect();
        Ok(Box::new(Built {
            tree,
            triangles,
            ids,
            soup,
            build_ms: start.elapsed().as_secs_f64() * 1e3,
        }))
    }
}

impl Built<'_> {
    /// Distance of the triangle at `place`, infinite for a miss or where a mask cuts it out.
    #[inline(always)]
    fn intersect(&self, ray: &ray::Ray, place: usize) -> f32 {
        let t = self.triangles[place].intersect(ray);
        let Some(masks) = self.soup.masks.as_deref().filter(|_| t.is_finite()) else {
            return t;
        };
        // Its weights belong to the second and third vertices.
        let weights = self.triangles[place].compute_barycentric(ray);
        let record = &self.soup.records[self.ids[place] as usize];
        let asked = self.soup.intersection.raised(&Ray {
            origin: ray.origin.into(),
            t_min: ray.tmin,
            direction: ray.direction.into(),
            t_max: ray.tmax,
        });
        if is_cut_out(Some(masks), record, &asked, [weights.x, weights.y]) {
            f32::INFINITY
        } else {
            t
        }
    }
}

impl Caster for Built<'_> {
    fn cast(&self, query: Query, ray: &Ray) -> Hit {
        let (origin, direction) = (ray.origin.into(), ray.direction.into());
        let asked = ray::Ray::new(origin, direction, ray.t_min, ray.t_max);
        let mut found = RayHit::none();
        let test = |ray: &ray::Ray, place: usize| self.intersect(ray, place);
        let is_hit = match (&self.tree, query) {
            (Tree::Binary(tree), Query::Closest) => tree.ray_traverse(asked, &mut found, test),
            (Tree::Wide(tree), Query::Closest) => tree.ray_traverse(asked, &mut found, test),
            (Tree::Binary(tree), Query::Any) => !tree.ray_traverse_miss(asked, test),
            (Tree::Wide(tree), Query::Any) => !tree.ray_traverse_miss(asked, test),
        };
        let miss = Hit::miss(ray);
        match (is_hit, query) {
            (false, _) => miss,
            (true, Query::Any) => Hit {
                triangle: 0,
                ..miss
            },
            (true, Query::Closest) => Hit {
                t: found.t,
                triangle: self.ids[found.primitive_id as usize],
                ..miss
            },
        }
    }

    fn version(&self) -> String {
        "obvhs 0.4".into()
    }

    fn build_ms(&self) -> f64 {
        self.build_ms
    }
}

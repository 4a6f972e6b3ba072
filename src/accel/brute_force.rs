//! No structure: every ray is tested against every triangle. Twin of
//! `kernels/accel/brute_force.wesl`.

use super::ray::{safe_inverse, Hit, Ray};
use super::triangle::intersect_triangle;
use super::{AccelError, AccelKind, BuildLog, BuiltAccel, Counters, CpuTwin, GpuBuffers, TriangleSoup};
use crate::config::{ParameterSchema, Params};
use crate::measure::record::StructureStats;

/// The registry entry.
pub struct BruteForce;

impl AccelKind for BruteForce {
    fn name(&self) -> &'static str {
        "brute-force"
    }

    fn description(&self) -> &'static str {
        "every triangle for every ray: the simplest judge, for small scenes"
    }

    fn kernel(&self) -> &'static str {
        "accel/brute_force"
    }

    fn parameters(&self) -> ParameterSchema {
        Vec::new()
    }

    fn build(&self, soup: &TriangleSoup, _: &Params, _: &mut BuildLog) -> Result<Box<dyn BuiltAccel>, AccelError> {
        Ok(Box::new(Built { triangles: soup.records.len() as u32 }))
    }
}

struct Built {
    triangles: u32,
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        if soup.records.len() == self.triangles as usize {
            Ok(())
        } else {
            Err(AccelError::Invalid(format!("built for {} triangles, given {}", self.triangles, soup.records.len())))
        }
    }

    fn buffers(&self) -> GpuBuffers {
        let triangles = self.triangles as usize;
        GpuBuffers { uniforms: vec![super::limits(triangles, triangles)], ..Default::default() }
    }

    fn stats(&self) -> StructureStats {
        StructureStats { references: u64::from(self.triangles), ..Default::default() }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin { soup }))
    }
}

struct Twin<'a> {
    soup: &'a TriangleSoup,
}

impl CpuTwin for Twin<'_> {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        let inverse = safe_inverse(ray.direction);
        let mut hit = Hit::miss(ray);
        for triangle in &self.soup.records {
            counters.triangle_tests += 1;
            intersect_triangle(triangle, ray, inverse, &mut hit);
        }
        hit
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        let inverse = safe_inverse(ray.direction);
        let mut hit = Hit::miss(ray);
        for triangle in &self.soup.records {
            counters.triangle_tests += 1;
            intersect_triangle(triangle, ray, inverse, &mut hit);
            if hit.triangle != super::NO_HIT {
                return true;
            }
        }
        false
    }
}

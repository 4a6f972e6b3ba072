//! The closed meshes that shots are aimed at, with points inside them to shoot from.

use super::case::towards;
use super::placement::Placement;
use super::shapes::{self, Mesh, RADIUS, on, on_edge, vertex};
use glam::Vec3;
use rayon::prelude::*;
use raystone_accel::Ray;
use raystone_accel::oracle::{Side, exact_truths};
use raystone_core::geometry::Triangle;
use raystone_core::random::Pcg32;
use raystone_scene::{self as scene, Bounds};

/// The family in the address of one of these meshes.
pub(crate) const FAMILY: &str = "shots";
/// The sphere and the plane; any other name is the path of a model.
pub(crate) const SPHERE: &str = "sphere";
/// See [`SPHERE`].
pub(crate) const PLANE: &str = "plane";

/// Targets of shots.
pub(crate) const AIMS: [&str; 3] = ["random", "vertices", "edges"];

/// Bands of the sphere: 16,256 triangles.
const BANDS: usize = 64;
/// Cells along an edge of the plane: 8,192 triangles.
const CELLS: usize = 64;
/// Side of the plane, as in Embree's test, units.
const SIDE: f64 = 200.0;
/// Points tried as origins inside a model, and how many are wanted at least.
const TRIED: usize = 384;
const LEAST_ORIGINS: usize = 8;

/// A mesh with points from which every ray that is shot hits it.
pub(crate) struct ShotMesh {
    name: String,
    /// Its scale and translation.
    pub place: Placement,
    /// Its triangles.
    pub mesh: Mesh,
    /// Its targets: a plane ends, and past its border lies nothing.
    aims: Mesh,
    origins: Vec<Vec3>,
}

impl ShotMesh {
    /// Returns the mesh of this name, at this place, with origins by this seed.
    ///
    /// # Errors
    /// A model that cannot be read, or that has hardly an inside; in words.
    pub(crate) fn named(name: &str, place: Placement, seed: u64) -> Result<Self, String> {
        let mut random = Pcg32::with_stream(seed, 77);
        let mut inside = |reach: f64, above: f64| -> Vec<Vec3> {
            (0..512)
                .map(|_| place.point(reach * random.in_cube() + above * glam::DVec3::Y))
                .collect()
        };
        let (mesh, origins) = match name {
            SPHERE => (shapes::sphere(BANDS, &place), inside(0.45 * RADIUS, 0.0)),
            PLANE => (
                shapes::plane(CELLS, SIDE, &place),
                inside(0.2 * SIDE, 0.3 * SIDE),
            ),
            path => model(path, place, seed)?,
        };
        Ok(Self {
            name: name.to_owned(),
            place,
            aims: if name == PLANE {
                within_border(&mesh)
            } else {
                mesh.clone()
            },
            mesh,
            origins,
        })
    }

    /// Returns the mesh of a label.
    ///
    /// # Errors
    /// As for [`ShotMesh::named`], or the label is none.
    pub(crate) fn labelled(label: &str, seed: u64) -> Result<Self, String> {
        let place = |place: &Placement| label.ends_with(&format!(", {place}"));
        let place = [Placement::ORDINARY, Placement::FAR]
            .into_iter()
            .find(place);
        let split = place.zip(label.rsplit_once(", "));
        let (place, (name, _)) =
            split.ok_or_else(|| format!("`{label}` is no mesh and place of shots"))?;
        Self::named(name, place, seed)
    }

    /// Returns its name in an address.
    pub(crate) fn label(&self) -> String {
        format!("{}, {}", self.name, self.place)
    }

    /// Returns its name in tables.
    pub(crate) fn short_name(&self) -> &str {
        match self.name.as_str() {
            name @ (SPHERE | PLANE) => name,
            path => {
                let path = std::path::Path::new(path);
                let stem = path.file_stem().and_then(|stem| stem.to_str());
                stem.unwrap_or("model")
            }
        }
    }

    /// Returns rays at a target, one of [`AIMS`], from random numbers of their own.
    pub(crate) fn shots(&self, aim: usize, seed: u64, stream: u64, count: usize) -> Vec<Ray> {
        const BLOCK: usize = 4096;
        let block = |block: usize| {
            let mut random = Pcg32::with_stream(seed, stream << 16 | block as u64);
            let rays = BLOCK.min(count - block * BLOCK);
            (0..rays)
                .map(|_| self.shot(aim, &mut random))
                .collect::<Vec<_>>()
        };
        (0..count.div_ceil(BLOCK))
            .into_par_iter()
            .flat_map_iter(block)
            .collect()
    }

    fn shot(&self, aim: usize, random: &mut Pcg32) -> Ray {
        let origin = random.one_of(&self.origins);
        let triangle = random.one_of(&self.aims);
        match aim {
            // Rays from above go down, not anywhere.
            0 if self.name == PLANE => towards(origin, on(&triangle, random)),
            0 => Ray::new(origin, random.direction().as_vec3()),
            1 => towards(origin, vertex(&triangle, random)),
            _ => towards(origin, on_edge(&triangle, random)),
        }
    }
}

/// Returns a model with its holes closed, and points inside it.
fn model(path: &str, place: Placement, seed: u64) -> Result<(Mesh, Vec<Vec3>), String> {
    let scene = scene::named(path).map_err(|e| e.to_string())?;
    let mesh = shapes::model(&scene.triangles, &place);
    let mut random = Pcg32::with_stream(seed, 78);
    let tried: Vec<Ray> = (0..TRIED)
        .map(|_| {
            let origin = place.point(0.7 * RADIUS * random.in_cube());
            Ray::new(origin, random.direction().as_vec3())
        })
        .collect();
    let origins = inside(&mesh, &tried);
    if origins.len() < LEAST_ORIGINS {
        return Err(format!(
            "only {} of {TRIED} points lie inside it",
            origins.len()
        ));
    }
    Ok((mesh, origins))
}

/// Returns the triangles that do not touch the border of a level plane.
fn within_border(plane: &[Triangle]) -> Mesh {
    let bounds = Bounds::of(plane);
    let is_inner = |v: &Vec3| {
        [0, 2]
            .iter()
            .all(|&a| v[a] > bounds.min[a] && v[a] < bounds.max[a])
    };
    let inner = plane.iter().filter(|t| t.vertices.iter().all(is_inner));
    inner.copied().collect()
}

/// Origins of those rays that leave the mesh an odd number of times, through insides only.
fn inside(mesh: &[Triangle], rays: &[Ray]) -> Vec<Vec3> {
    let truths = exact_truths(mesh, rays);
    let is_inside = |truth: &raystone_accel::oracle::ExactTruth| {
        truth.hits.len() % 2 == 1 && truth.hits.iter().all(|hit| hit.side == Side::Inside)
    };
    let pairs = rays.iter().zip(&truths);
    pairs
        .filter(|(_, truth)| is_inside(truth))
        .map(|(ray, _)| Vec3::from(ray.origin))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_is_found_again_by_its_label() {
        for place in [Placement::ORDINARY, Placement::FAR] {
            for name in [SPHERE, PLANE] {
                let mesh = ShotMesh::named(name, place, 3).unwrap();
                let again = ShotMesh::labelled(&mesh.label(), 3).unwrap();
                assert_eq!(again.mesh, mesh.mesh);
                assert_eq!(again.origins, mesh.origins);
            }
        }
        let wrong = |label: &str| ShotMesh::labelled(label, 3).err().unwrap();
        assert!(wrong("sphere, somewhere").contains("somewhere"));
        assert!(wrong("no/such/model.obj, ordinary").contains("no/such/model.obj"));
    }

    #[test]
    fn points_inside_a_closed_mesh_are_told_from_points_outside() {
        let mesh = shapes::sphere(8, &Placement::ORDINARY);
        let mut random = Pcg32::with_stream(1, 0);
        let mut rays = |radius: f64| -> Vec<Ray> {
            (0..40)
                .map(|_| {
                    let origin = (radius * random.direction()).as_vec3();
                    Ray::new(origin, random.direction().as_vec3())
                })
                .collect()
        };
        assert!(inside(&mesh, &rays(0.8 * RADIUS)).len() > 38);
        assert_eq!(inside(&mesh, &rays(1.1 * RADIUS)).len(), 0);
    }
}

//! One scene with rays that are hard for it.

use super::placement::Placement;
use super::shapes::{Mesh, cube, sphere};
use glam::Vec3;
use raystone_accel::Ray;
use raystone_core::geometry::Triangle;
use raystone_core::random::Pcg32;
use raystone_scene::{Assembly, MAX_COORDINATE, Material, SceneData};
use std::fmt;

/// The source of the right answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Truth {
    /// The exact oracle.
    Exact,
    /// The exact oracle; the mesh is closed and the rays start inside, so that every miss is a crack.
    Closed,
    /// Something is hit; only brute force knows which triangle.
    Hit,
    /// These are no rays: nothing may be hit.
    Miss,
}

/// Resolution of the meshes of most rays: a closed sphere and a closed box.
#[derive(Clone, Copy)]
pub(crate) struct Meshes {
    /// Bands of the sphere.
    pub bands: usize,
    /// Cells along an edge of the box.
    pub cells: usize,
}

impl Meshes {
    /// Returns both with their names, at a place.
    pub(crate) fn at(self, place: &Placement) -> [(&'static str, Mesh); 2] {
        [
            ("sphere", sphere(self.bands, place)),
            ("box", cube(self.cells, place)),
        ]
    }
}

/// A scene with rays.
pub struct Case {
    /// Family that it belongs to.
    pub family: &'static str,
    /// Its name, unique within the family.
    pub label: String,
    /// Scale and translation of the mesh.
    pub place: Placement,
    /// The triangles in world space, and the objects that they are copies of.
    pub scene: SceneData,
    /// The rays.
    pub rays: Vec<Ray>,
    /// The right answers.
    pub truth: Truth,
}

/// Makes the cases of a family, each from a random stream of its own, so that one can be made again
/// from its label and the seed.
pub(crate) struct Maker {
    family: &'static str,
    seed: u64,
    /// True for a quick suite, with only a few rungs.
    pub quick: bool,
    /// Rays a case.
    pub rays: usize,
    /// The cases so far.
    pub cases: Vec<Case>,
}

/// Returns a stream of random numbers of its own for a case and a purpose.
fn stream(seed: u64, family: &str, label: &str, what: u64) -> Pcg32 {
    let bytes = family.bytes().chain([0]).chain(label.bytes());
    // FNV-1a: the same on every machine.
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    Pcg32::with_stream(seed ^ hash, what)
}

/// Returns a ray through a point; its direction is the rounded difference.
pub fn towards(origin: Vec3, target: Vec3) -> Ray {
    Ray::new(origin, target - origin)
}

impl Maker {
    pub(super) fn new(family: &'static str, seed: u64, quick: bool, rays: usize) -> Self {
        Self {
            family,
            seed,
            quick,
            rays,
            cases: Vec::new(),
        }
    }

    /// Returns the rungs of the ladder.
    pub(crate) fn places(&self) -> Vec<Placement> {
        Placement::ladder(self.quick)
    }

    /// Adds a case: a mesh, and rays for it, each from random numbers of its own.
    pub(crate) fn add(
        &mut self,
        label: impl Into<String>,
        place: Placement,
        truth: Truth,
        mesh: impl FnOnce(&mut Pcg32) -> Mesh,
        rays: impl FnOnce(&[Triangle], &mut Pcg32, usize) -> Vec<Ray>,
    ) {
        let label = label.into();
        let random = |what| stream(self.seed, self.family, &label, what);
        let triangles = mesh(&mut random(0));
        let rays = rays(&triangles, &mut random(1), self.rays);
        self.push(label, place, truth, scene(triangles, None), rays);
    }

    /// Adds a case whose rays are made one by one.
    pub(crate) fn add_each(
        &mut self,
        label: impl Into<String>,
        place: Placement,
        truth: Truth,
        mesh: impl FnOnce(&mut Pcg32) -> Mesh,
        mut one: impl FnMut(&[Triangle], &mut Pcg32) -> Ray,
    ) {
        self.add(label, place, truth, mesh, |mesh, random, count| {
            (0..count).map(|_| one(mesh, random)).collect()
        });
    }

    /// Adds each of these meshes at each place.
    pub(crate) fn add_on_every_rung(
        &mut self,
        meshes: Meshes,
        suffix: &str,
        truth: fn(&Placement) -> Truth,
        one: fn(&Placement, &[Triangle], &mut Pcg32) -> Ray,
    ) {
        for place in self.places() {
            for (name, mesh) in meshes.at(&place) {
                let label = format!("{name}{suffix}, {place}");
                self.add_each(
                    label,
                    place,
                    truth(&place),
                    |_| mesh,
                    |mesh, random| one(&place, mesh, random),
                );
            }
        }
    }

    /// Adds a case of placed objects, if they can be placed.
    pub(crate) fn add_placed(
        &mut self,
        label: impl Into<String>,
        assembly: impl FnOnce(&mut Pcg32) -> Option<Assembly>,
        rays: impl FnOnce(&Assembly, &mut Pcg32, usize) -> Vec<Ray>,
    ) {
        let label = label.into();
        let random = |what| stream(self.seed, self.family, &label, what);
        let Some(assembly) = assembly(&mut random(0)) else {
            return;
        };
        let rays = rays(&assembly, &mut random(1), self.rays);
        let copies = assembly.instances().iter().flat_map(|i| assembly.copy(i));
        let triangles = copies.collect();
        let scene = scene(triangles, Some(assembly));
        self.push(label, Placement::ORDINARY, Truth::Hit, scene, rays);
    }

    fn push(
        &mut self,
        label: String,
        place: Placement,
        truth: Truth,
        scene: SceneData,
        rays: Vec<Ray>,
    ) {
        // Loaders let no greater ones pass.
        let [low, high] = [scene.bounds().min, scene.bounds().max].map(|v| v.abs().max_element());
        if low.max(high) > MAX_COORDINATE {
            return;
        }
        self.cases.push(Case {
            family: self.family,
            label,
            place,
            scene,
            rays,
            truth,
        });
    }
}

/// Returns the scene as a loader would, without data that only shading needs.
pub fn scene(triangles: Mesh, assembly: Option<Assembly>) -> SceneData {
    SceneData {
        colors: Vec::new(),
        name: "stress".into(),
        material_ids: vec![0; triangles.len()],
        triangles,
        uvs: Vec::new(),
        normals: Vec::new(),
        mirrored: Vec::new(),
        materials: vec![Material::diffuse("grey", Vec3::splat(0.5))],
        textures: Vec::new(),
        assembly,
        camera: None,
        environment: Vec3::ONE,
        lights: Vec::new(),
        daylight: None,
        media: Vec::new(),
        framing: None,
        hash: String::new(),
        report: Default::default(),
    }
}

/// A case in the notation of `raystone trace --scene`: `stress:FAMILY:LABEL:SEED`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// Family.
    pub family: String,
    /// Label of the case.
    pub label: String,
    /// Seed of the suite.
    pub seed: u64,
}

impl Address {
    /// The start of an address.
    const PREFIX: &'static str = "stress:";

    /// Reads an address; `None` if the text is none.
    pub fn parse(text: &str) -> Option<Self> {
        let (family, rest) = text.strip_prefix(Self::PREFIX)?.split_once(':')?;
        let (label, seed) = rest.rsplit_once(':')?;
        Some(Self {
            family: family.to_owned(),
            label: label.to_owned(),
            seed: seed.parse().ok()?,
        })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}{}:{}:{}",
            Self::PREFIX,
            self.family,
            self.label,
            self.seed
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_read_back() {
        let address = Address {
            family: "needles".into(),
            label: "scale 1e-8: a".into(),
            seed: 7,
        };
        assert_eq!(Address::parse(&address.to_string()), Some(address));
        assert_eq!(Address::parse("cornell-box"), None);
    }
}

//! Closed meshes as voxels, against generalised winding numbers in f64 (Jacobson et al. 2013) and closed forms.

use super::box_triangles;
use super::segments::adapter;
use super::tier::faults_in_turn;
use crate::voxels::{Counted, Mesh, VoxelError, coverage, covered};
use glam::{DVec3, UVec3};
use raystone_core::random::Pcg32;
use raystone_gpu::{Gpu, KernelLibrary};
use raystone_volume::solid::{OpenMesh, Triangle, solid};
use std::f64::consts::{PI, TAU};

const SIDE: u32 = 20;

/// How often a mesh winds around a point: signed solid angles of its triangles (van Oosterom & Strackee 1983).
fn winding(mesh: &Mesh, point: DVec3) -> f64 {
    let angle = |triangle: &[u32; 3]| {
        let [a, b, c] = mesh.corners(*triangle).map(|corner| corner - point);
        let [x, y, z] = [a, b, c].map(DVec3::length);
        let above = a.dot(b.cross(c));
        let below = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
        2.0 * above.atan2(below)
    };
    mesh.triangles.iter().map(angle).sum::<f64>() / (2.0 * TAU)
}

/// A mesh whose places along x and y are those that the device rounds to.
fn rounded(mut mesh: Mesh, side: u32) -> Mesh {
    let units = f64::from(side * 64);
    for p in &mut mesh.positions {
        (p.x, p.y) = ((p.x * units).round() / units, (p.y * units).round() / units);
    }
    mesh
}

/// A sphere, a torus beside the axes, a box on whole columns, and two nested spheres, one a hole of the other by its parity.
fn meshes() -> Vec<(&'static str, Mesh)> {
    let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
    let torus = Mesh::torus(DVec3::splat(0.5), axis, [0.28, 0.11], 48);
    let step = 1.0 / f64::from(SIDE * 4);
    // A face whose diagonal goes through the middles of columns: points on an edge of two triangles.
    let cube = Mesh::cuboid(
        DVec3::new(12.0, 12.0, 12.2) * step,
        DVec3::new(60.0, 60.0, 44.2) * step,
    );
    let mut shell = Mesh::sphere(DVec3::splat(0.5), 0.4, 16);
    let inner = Mesh::sphere(DVec3::new(0.45, 0.5, 0.55), 0.2, 12);
    let first = shell.positions.len() as u32;
    shell.positions.extend(inner.positions);
    // The other way round.
    let turned = inner
        .triangles
        .iter()
        .map(|[a, b, c]| [a, c, b].map(|k| k + first));
    shell.triangles.extend(turned.collect::<Vec<_>>());
    vec![
        (
            "sphere",
            Mesh::sphere(DVec3::new(0.52, 0.47, 0.5), 0.37, 24),
        ),
        ("torus", torus),
        ("cube", cube),
        ("shell", shell),
    ]
    .into_iter()
    .map(|(name, mesh)| (name, rounded(mesh, SIDE)))
    .collect()
}

/// Cells of random voxels that are inside by winding number and not by the device, or the opposite, of how many.
fn wrong_cells(gpu: &Gpu, mesh: &Mesh) -> Result<[u32; 2], VoxelError> {
    let found = coverage(gpu, mesh, SIDE)?;
    let mut random = Pcg32::new(5);
    let (mut wrong, mut all) = (0, 0);
    let step = 1.0 / f64::from(SIDE * 4);
    for _ in 0..600 {
        let voxel = [(); 3].map(|()| random.below(SIDE as usize) as u32);
        let place = voxel[0] + SIDE * (voxel[1] + SIDE * voxel[2]);
        let inside = (0..64_u32).filter(|k| {
            let cell = UVec3::from(voxel) * 4 + UVec3::new(k & 3, k >> 2 & 3, k >> 4);
            winding(mesh, (cell.as_dvec3() + 0.5) * step).abs() > 0.5
        });
        let inside = inside.count() as f32;
        wrong += (found[place as usize] * 64.0 - inside).abs() as u32;
        all += 64;
    }
    Ok([wrong, all])
}

#[test]
fn cells_of_a_mesh_are_those_around_which_it_winds() {
    let Some(gpu) = adapter() else { return };
    for (name, mesh) in meshes() {
        let [wrong, all] = wrong_cells(&gpu, &mesh).unwrap();
        println!("{name}: {wrong} of {all} cells");
        // The middle of a cell in a face may be on either side of it by rounding.
        assert!(wrong <= 2, "{name}: {wrong} of {all}");
    }
}

#[test]
fn voxels_of_a_sphere_a_torus_and_a_box_have_their_volumes() {
    let Some(gpu) = adapter() else { return };
    let middle = DVec3::splat(0.5);
    let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
    let exact = [
        (Mesh::sphere(middle, 0.4, 96), 4.0 / 3.0 * PI * 0.064),
        (
            Mesh::torus(middle, axis, [0.3, 0.1], 192),
            TAU * 0.3 * PI * 0.01,
        ),
        (
            Mesh::cuboid(middle - 0.3125, middle + 0.25),
            0.5625_f64.powi(3),
        ),
    ];
    for (mesh, volume) in exact {
        let found = coverage(&gpu, &mesh, 32).unwrap();
        let found = found.iter().map(|part| f64::from(*part)).sum::<f64>() / 32_f64.powi(3);
        println!("{found:.6}, {:.6} enclosed, {volume:.6}", mesh.volume());
        assert!(
            (found / mesh.volume() - 1.0).abs() < 1e-2,
            "{found} of {}",
            mesh.volume()
        );
        assert!((found / volume - 1.0).abs() < 1e-2, "{found} of {volume}");
    }
}

#[test]
fn the_host_covers_what_the_device_covers() {
    let Some(gpu) = adapter() else { return };
    for (name, mesh) in meshes() {
        let triangles: Vec<Triangle> = mesh.triangles.iter().map(|t| mesh.corners(*t)).collect();
        let host = solid(&triangles, [SIDE; 3], [DVec3::ZERO, DVec3::ONE]).unwrap();
        let device = coverage(&gpu, &mesh, SIDE).unwrap();
        let cells = (host.iter().zip(&device)).map(|(a, b)| (a - b).abs() * 64.0);
        let others: f32 = cells.sum();
        // The device rounds places along z to f32.
        assert!(others <= 2.0, "{name}: {others} cells");
        let covered: f32 = host.iter().sum();
        assert!(
            covered > 0.0 && covered < (SIDE * SIDE * SIDE) as f32,
            "{name}"
        );
    }
}

#[test]
fn a_mesh_that_is_open_or_beside_the_cube_is_refused() {
    let Some(gpu) = adapter() else { return };
    let middle = DVec3::splat(0.5);
    let sphere = Mesh::sphere(middle, 0.4, 16);
    let mut open = sphere.clone();
    open.triangles.swap_remove(40);
    let reason = coverage(&gpu, &open, 16).unwrap_err();
    assert!(
        matches!(reason, VoxelError::Open(OpenMesh { edges: 3, .. })),
        "{reason}"
    );
    assert!(
        reason.to_string().contains("the mesh is open: 3 edges"),
        "{reason}"
    );
    // Without that check columns tell: those of the triangle's area.
    let [a, b, c] = sphere.corners(sphere.triangles[40]).map(|p| p * 64.0);
    let area = ((b - a).cross(c - a).z / 2.0).abs();
    let Err(VoxelError::OddColumns { columns, x, y }) = covered(&gpu, &open, 16, Counted::Border)
    else {
        panic!("not seen");
    };
    assert!(
        (f64::from(columns) - area).abs() <= area.sqrt() + 2.0,
        "{columns} of {area}"
    );
    let at = DVec3::new(x.into(), y.into(), a.z);
    assert!(
        (at - a).length() < (b - a).length() + (c - a).length() + 2.0,
        "{at} {a}"
    );
    let beside = Mesh::sphere(middle, 0.6, 8);
    let reason = coverage(&gpu, &beside, 16).unwrap_err().to_string();
    assert!(reason.contains("is not inside the unit cube"), "{reason}");
    let mut wild = sphere.clone();
    wild.triangles[3][1] = 9999;
    let reason = coverage(&gpu, &wild, 16).unwrap_err().to_string();
    assert!(reason.contains("triangle 3 has a corner 9999"), "{reason}");
    let reason = coverage(&gpu, &sphere, 257).unwrap_err().to_string();
    assert!(reason.contains("1 to 256 voxels"), "{reason}");
    let none = coverage(&gpu, &Mesh::default(), 4).unwrap();
    assert!(none.len() == 64 && none.iter().all(|part| *part == 0.0));
}

/// Kernel, text, its replacement.
const FAULTS: [(&str, &str, &str); 9] = [
    // Points on edges in both triangles, or in none.
    (
        "flip",
        "side > 0 || (side == 0 && is_owner(a, b))",
        "side >= 0",
    ),
    (
        "flip",
        "side > 0 || (side == 0 && is_owner(a, b))",
        "side > 0",
    ),
    ("flip", "b.y == a.y && b.x < a.x", "b.y == a.y"),
    // Half a cell beside, along z and along x.
    ("flip", "floor(z + 0.5)", "floor(z)"),
    ("flip", "* UNITS + UNITS / 2", "* UNITS"),
    // What is below a word forgotten, bits that are not summed, and another nibble.
    (
        "fill",
        "summed(atomicLoad(&bits[at])) ^ before",
        "summed(atomicLoad(&bits[at]))",
    ),
    ("fill", "shift < 32u", "shift < 16u"),
    (
        "cover",
        "(word >> (voxel.z & 31u)) & 15u",
        "(word >> (voxel.x & 31u)) & 15u",
    ),
    // The bit of another voxel.
    (
        "cover",
        "border[i >> 5u] >> (i & 31u)",
        "border[i >> 5u] >> (i & 15u)",
    ),
];

#[test]
fn faults_of_voxels_are_seen() {
    let Some(gpu) = adapter() else { return };
    for (file, text, fault) in faults_in_turn("faults of voxels", FAULTS) {
        let library = KernelLibrary::default();
        let name = format!("media/voxels/{file}");
        let sound = library.text(&name).unwrap();
        assert_eq!(sound.matches(text).count(), 1, "{name}: `{text}`");
        let changed = sound.replace(text, fault);
        let faulty = gpu.with_kernels(library.with_sources(&[(&name, &changed)]));
        let is_seen = meshes()
            .iter()
            .any(|(_, mesh)| match wrong_cells(&faulty, mesh) {
                Ok([wrong, _]) => wrong > 2,
                Err(_) => true,
            });
        assert!(is_seen, "{file}: `{text}` as `{fault}` was not seen");
    }
}

#[test]
fn a_box_off_the_origin_has_the_area_and_volume_of_its_sides() {
    let sides = [2.0, 3.0, 5.0];
    let corner = |k: u32| {
        let side = |axis: usize| f64::from(k >> axis & 1) * sides[axis];
        DVec3::new(7.0 + side(0), side(1) - 11.0, side(2))
    };
    let mesh = Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: box_triangles().collect(),
    };
    assert!((mesh.area() - 62.0).abs() < 1e-9, "{}", mesh.area());
    assert!((mesh.volume() - 30.0).abs() < 1e-9, "{}", mesh.volume());
}

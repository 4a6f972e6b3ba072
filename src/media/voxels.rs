//! Closed meshes as volumes: the part of each voxel that is inside (Pfeuti 2009, §3.2). Kernels: `kernels/media/voxels/`.

use glam::{DVec2, DVec3, Vec3};
use raystone_gpu::{
    Bindings, Composition, Gpu, GpuError, Player, Recording, Storage, UniformValues, groups_for,
};
use raystone_scene::SceneData;
use raystone_volume::solid::{MOST_SIDE, OpenMesh, check_closed};
use std::f64::consts::TAU;

/// Cells of a voxel along each axis, and units of a cell: as in the kernels.
const CELLS: u32 = 4;
const UNITS: f64 = 16.0;

/// Reasons why a mesh is no volume.
#[derive(Debug, thiserror::Error)]
pub enum VoxelError {
    /// A side that cannot be used.
    #[error("a mesh becomes 1 to {MOST_SIDE} voxels along each axis, not {0}")]
    Side(u32),
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} has a corner {corner}, and there are {count} vertices")]
    Corner {
        /// The triangle.
        triangle: usize,
        /// What it names.
        corner: u32,
        /// Vertices.
        count: usize,
    },
    /// A vertex outside the unit cube, where its columns have no cells.
    #[error("vertex {vertex} at {at} is not inside the unit cube: scale or move the mesh")]
    Outside {
        /// The vertex.
        vertex: usize,
        /// Its position.
        at: DVec3,
    },
    /// A mesh that encloses nothing.
    #[error(transparent)]
    Open(#[from] OpenMesh),
    /// Columns that leave a mesh without entering it.
    #[error(
        "{columns} columns of cells cross the mesh an odd number of times, the last at ({x}, {y}): it is open"
    )]
    OddColumns {
        /// Columns.
        columns: u32,
        /// Place of the last along x.
        x: u32,
        /// And along y.
        y: u32,
    },
    /// A kernel does not run.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// Triangles in the unit cube.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Positions of vertices.
    pub positions: Vec<DVec3>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A sphere of so many rings from pole to pole, twice as many triangles around it.
    pub fn sphere(centre: DVec3, radius: f64, rings: u32) -> Self {
        let around = 2 * rings;
        let mut mesh = Self::default();
        let at = |polar: f64, angle: f64| {
            let r = polar.sin();
            centre + radius * DVec3::new(r * angle.cos(), r * angle.sin(), polar.cos())
        };
        mesh.positions.push(at(0.0, 0.0));
        for ring in 1..rings {
            for k in 0..around {
                let polar = f64::from(ring) / f64::from(rings) * TAU / 2.0;
                mesh.positions
                    .push(at(polar, f64::from(k) / f64::from(around) * TAU));
            }
        }
        mesh.positions.push(at(TAU / 2.0, 0.0));
        let last = mesh.positions.len() as u32 - 1;
        let of = |ring: u32, k: u32| 1 + (ring - 1) * around + k % around;
        for k in 0..around {
            mesh.triangles.push([0, of(1, k), of(1, k + 1)]);
            mesh.triangles
                .push([last, of(rings - 1, k + 1), of(rings - 1, k)]);
        }
        for ring in 1..rings - 1 {
            for k in 0..around {
                mesh.quad([
                    of(ring, k),
                    of(ring + 1, k),
                    of(ring + 1, k + 1),
                    of(ring, k + 1),
                ]);
            }
        }
        mesh
    }

    /// A torus around a line along a unit direction, of `around` by half as many quads.
    pub fn torus(centre: DVec3, axis: DVec3, [major, minor]: [f64; 2], around: u32) -> Self {
        let (across, on) = axis.any_orthonormal_pair();
        let other = around / 2;
        let mut mesh = Self::default();
        for k in 0..around {
            for j in 0..other {
                let a = f64::from(k) / f64::from(around) * TAU;
                let b = f64::from(j) / f64::from(other) * TAU;
                let out = across * a.cos() + on * a.sin();
                mesh.positions
                    .push(centre + out * (major + minor * b.cos()) + axis * (minor * b.sin()));
            }
        }
        let of = |k: u32, j: u32| k % around * other + j % other;
        for k in 0..around {
            for j in 0..other {
                mesh.quad([of(k, j), of(k + 1, j), of(k + 1, j + 1), of(k, j + 1)]);
            }
        }
        mesh
    }

    /// A box.
    pub fn cuboid(low: DVec3, high: DVec3) -> Self {
        let corner =
            |k: u32| DVec3::select(glam::BVec3::new(k & 1 > 0, k & 2 > 0, k & 4 > 0), high, low);
        let mut mesh = Self {
            positions: (0..8).map(corner).collect(),
            triangles: Vec::new(),
        };
        for quad in [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ] {
            mesh.quad(quad);
        }
        mesh
    }

    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|corner| self.positions[corner as usize])
    }

    /// What it encloses, by the divergence theorem.
    pub fn volume(&self) -> f64 {
        let part = |triangle: &[u32; 3]| {
            let [a, b, c] = self.corners(*triangle);
            a.dot(b.cross(c)) / 6.0
        };
        self.triangles.iter().map(part).sum::<f64>().abs()
    }

    /// The area of all triangles.
    pub fn area(&self) -> f64 {
        let part = |triangle: &[u32; 3]| {
            let [a, b, c] = self.corners(*triangle);
            (b - a).cross(c - a).length() / 2.0
        };
        self.triangles.iter().map(part).sum()
    }

    /// The triangles of a scene, moved so that the middle of their box is at `middle`, and scaled so that the greatest side of
    /// the box is `extent`. Triangles of which two corners are one have no inside, and are left out.
    pub fn of_scene(scene: &SceneData, middle: DVec3, extent: f64) -> Self {
        let corners = || scene.triangles.iter().flat_map(|t| t.vertices);
        let low = corners().fold(Vec3::INFINITY, Vec3::min).as_dvec3();
        let high = corners().fold(Vec3::NEG_INFINITY, Vec3::max).as_dvec3();
        let scale = extent / (high - low).max_element().max(f64::MIN_POSITIVE);
        let mut mesh = Self::default();
        for k in 0..scene.triangles.len() {
            let corners = scene.outward(k);
            if (0..3).any(|at| corners[at] == corners[(at + 1) % 3]) {
                continue;
            }
            let first = mesh.positions.len() as u32;
            let place = |p: Vec3| middle + scale * (p.as_dvec3() - 0.5 * (low + high));
            mesh.positions.extend(corners.map(place));
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        mesh
    }

    /// # Errors
    /// A corner or a vertex that cannot be used, or edges of an odd number of triangles: vertices at the same place are one.
    fn check(&self) -> Result<(), VoxelError> {
        let count = self.positions.len();
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(corner) = corners.iter().find(|corner| **corner as usize >= count) {
                let corner = *corner;
                return Err(VoxelError::Corner {
                    triangle,
                    corner,
                    count,
                });
            }
        }
        let is_inside = |p: &DVec3| (p.cmpgt(DVec3::ZERO) & p.cmplt(DVec3::ONE)).all();
        if let Some(vertex) = self.positions.iter().position(|p| !is_inside(p)) {
            let at = self.positions[vertex];
            return Err(VoxelError::Outside { vertex, at });
        }
        let triangles = self.triangles.iter();
        Ok(check_closed(triangles.map(|t| self.corners(*t)))?)
    }
}

/// Of each of `side`³ voxels of the unit cube, x fastest, the part that is inside a closed mesh: of 4³ cells whose middles are.
///
/// # Errors
/// The mesh is open, leaves the cube or names no vertices, the side is not allowed, or the device fails.
pub fn coverage(gpu: &Gpu, mesh: &Mesh, side: u32) -> Result<Vec<f32>, VoxelError> {
    if !(1..=MOST_SIDE).contains(&side) {
        return Err(VoxelError::Side(side));
    }
    mesh.check()?;
    covered(gpu, mesh, side, Counted::Border)
}

/// Voxels whose cells are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Counted {
    /// Those that a triangle comes near: all cells of any other are like its first.
    Border,
    /// All of them, though a mesh does not ask for it.
    All,
}

/// The same of a mesh whose edges nobody looked at: an open one shows by columns that are crossed an odd number of times, if it does.
///
/// # Errors
/// Columns are crossed an odd number of times, or the device fails.
pub fn covered(
    gpu: &Gpu,
    mesh: &Mesh,
    side: u32,
    counted: Counted,
) -> Result<Vec<f32>, VoxelError> {
    let fine = side * CELLS;
    let (corners, rows) = rows_of(mesh, fine);
    if rows.is_empty() {
        return Ok(vec![0.0; side.pow(3) as usize]);
    }
    let words = fine.div_ceil(32);
    let columns = fine * fine;
    let zeroed = |name: &str, count: u32| -> Result<Storage, GpuError> {
        Ok(Storage::from(&gpu.zeroed(name, u64::from(count) * 4)?))
    };
    let bits = zeroed("bits", columns * words)?;
    let odd = zeroed("odd", columns.div_ceil(32))?;
    let tally = zeroed("tally", 16)?;
    let found = Storage::scratch("covered", u64::from(side.pow(3)) * 4);
    let values = UniformValues::new()
        .u32("side", fine)
        .u32("words", words)
        .u32("rows", rows.len() as u32);
    let mut bindings = Bindings::new();
    bindings
        .uniform("cells", values)
        .buffer("corners", &gpu.storage("corners", &corners)?)
        .buffer("rows", &gpu.storage("rows", &rows)?)
        .buffer("bits", &bits)
        .buffer("odd", &odd)
        .buffer("tally", &tally)
        .buffer("covered", &found);
    if counted == Counted::Border {
        bindings.buffer("border", &gpu.storage("border", &border_of(mesh, side))?);
    }
    let mut recording = Recording::new();
    let passes = [
        ("flip", rows.len() as u32),
        ("fill", columns),
        ("cover", side.pow(3)),
    ];
    for (name, count) in passes {
        let kernel = Composition::new(&format!("media/voxels/{name}"))
            .feature("border", counted == Counted::Border);
        recording.run(
            name,
            &gpu.pipeline(&kernel, true)?,
            &bindings,
            groups_for(count),
        );
    }
    recording
        .download("tally", &tally)
        .download("covered", &found);
    let played = Player::new(gpu).play(&recording)?;
    let tally = played.download::<u32>("tally")?;
    if tally[0] > 0 {
        let last = tally[1] - 1;
        return Err(VoxelError::OddColumns {
            columns: tally[0],
            x: last % fine,
            y: last / fine,
        });
    }
    let counts = played.download::<u32>("covered")?;
    let all = CELLS.pow(3) as f32;
    Ok(counts.into_iter().map(|count| count as f32 / all).collect())
}

/// Triangles, counter-clockwise as seen along z, and the rows of columns that each may cover.
fn rows_of(mesh: &Mesh, fine: u32) -> (Vec<[[i32; 4]; 3]>, Vec<[u32; 2]>) {
    let (mut corners, mut rows) = (Vec::new(), Vec::new());
    for triangle in &mesh.triangles {
        let of = mesh.corners(*triangle).map(|p| {
            let units = (DVec2::new(p.x, p.y) * f64::from(fine) * UNITS)
                .round()
                .as_ivec2();
            let z = (p.z * f64::from(fine)) as f32;
            [units.x, units.y, z.to_bits() as i32, 0]
        });
        let [a, b, c] = of;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0 {
            continue;
        }
        let index = corners.len() as u32;
        corners.push(if area > 0 { [a, b, c] } else { [a, c, b] });
        let ys = of.map(|corner| corner[1]);
        let low = ys.into_iter().fold(i32::MAX, i32::min) / UNITS as i32;
        let high = ys.into_iter().fold(0, i32::max) / UNITS as i32;
        rows.extend((low as u32..=(high as u32).min(fine - 1)).map(|row| [index, row]));
    }
    (corners, rows)
}

/// How much more of a triangle's surroundings counts as near than the rounding of its corners moves it, in voxels.
const MARGIN: f64 = 1.0 / 32.0;

/// A bit for each of `side`³ voxels, x fastest: whether a triangle comes near it. In each column of voxels along z those between the
/// planes beside the triangle's, within its box.
pub(crate) fn border_of(mesh: &Mesh, side: u32) -> Vec<u32> {
    let mut bits = vec![0_u32; side.pow(3).div_ceil(32) as usize];
    let reach = 0.5 + MARGIN;
    let voxel = |x: f64| (x.floor().max(0.0) as u32).min(side - 1);
    for triangle in &mesh.triangles {
        let [a, b, c] = mesh.corners(*triangle).map(|p| p * f64::from(side));
        let [low, high] = [a.min(b).min(c) - MARGIN, a.max(b).max(c) + MARGIN];
        let normal = (b - a).cross(c - a);
        let wide = reach * (normal.x.abs() + normal.y.abs());
        for y in voxel(low.y)..=voxel(high.y) {
            for x in voxel(low.x)..=voxel(high.x) {
                let beside = DVec2::new(f64::from(x) + 0.5 - a.x, f64::from(y) + 0.5 - a.y);
                let off = normal.x * beside.x + normal.y * beside.y;
                // Heights at which the plane meets the column.
                let span = if normal.z != 0.0 {
                    let [middle, half] = [a.z - off / normal.z, wide / normal.z.abs() + MARGIN];
                    [(middle - half).max(low.z), (middle + half).min(high.z)]
                } else if off.abs() <= wide {
                    [low.z, high.z]
                } else {
                    continue;
                };
                if span[0] > span[1] {
                    continue;
                }
                for z in voxel(span[0])..=voxel(span[1]) {
                    let place = x + side * (y + side * z);
                    bits[(place / 32) as usize] |= 1 << (place % 32);
                }
            }
        }
    }
    bits
}

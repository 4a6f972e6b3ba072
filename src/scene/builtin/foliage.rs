//! Plants of crossed cards, a mesh fence and a lamp behind a lattice: surfaces with alpha masks.

use super::super::builder::{Look, SceneBuilder};
use super::super::{AlphaChannel, AlphaMask, Material, Texture, TextureUse, Transform, Wrap};
use super::BuiltinScene;
use super::numeric::sin_cos_turns;
use glam::{Mat2, Vec2, Vec3};
use raystone_core::geometry::{Camera, Triangle};
use raystone_core::parameters;
use raystone_core::random::Pcg32;

parameters! {
    /// `foliage`.
    pub(super) struct Foliage {
        /// number of plants, three cards each
        plants: usize = 48, in 1..=20_000;
        /// width and height of the image of leaves, texels
        texels: usize = 64, in 8..=1024;
        /// whether masks are followed; without them cards are whole
        masked: bool = true;
        /// seed of places and turns
        seed: u64 = 1, in 0..=i64::MAX as u64;
    }
}

const GROUND: u32 = 0;
const PLANT: u32 = 1;
const FENCE: u32 = 2;
const LAMP: u32 = 3;
const LEAVES: u32 = 0;
const MESH: u32 = 1;

impl BuiltinScene for Foliage {
    const NAME: &'static str = "foliage";
    const DESCRIPTION: &'static str =
        "plants of crossed cards, a mesh fence and a lamp behind a lattice, all cut out by masks";

    fn build(&self) -> (SceneBuilder, Look) {
        let mut builder = SceneBuilder::new(true, 6 * self.plants + 8);
        let (plant, leaves) = cards();
        let ground = quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X);
        let fence = quad(
            Vec3::new(-2.0, 0.0, -1.7),
            4.0 * Vec3::X,
            Vec3::new(0.0, 1.2, 0.1),
        );
        let lamp = quad(
            Vec3::new(0.2, 2.2, -0.5),
            Vec3::new(0.9, 0.0, 0.1),
            Vec3::new(0.0, 0.0, 0.9),
        );
        for object in [plant, ground, fence, lamp] {
            builder.add_object(object);
        }
        let mut pcg = Pcg32::with_stream(self.seed, Pcg32::DEFAULT_STREAM);
        for _ in 0..self.plants {
            builder.place_textured(0, somewhere(&mut pcg), PLANT, &leaves);
        }
        for (object, material) in [(1, GROUND), (2, FENCE), (3, LAMP)] {
            builder.place_textured(object, Transform::IDENTITY, material, &CORNERS);
        }
        let look = Look {
            materials: materials(self.masked),
            textures: vec![leaves_image(self.texels), mesh_image()],
            camera: Some(Camera::upright(
                Vec3::new(0.3, 1.0, 3.6),
                Vec3::new(0.0, 0.45, 0.0),
                42.0,
            )),
            environment: Vec3::splat(0.25),
            ..Look::default()
        };
        (builder, look)
    }
}

/// Texture coordinates of [`quad`].
const CORNERS: [[Vec2; 3]; 2] = [
    [
        Vec2::new(0.0, 1.0),
        Vec2::new(1.0, 1.0),
        Vec2::new(1.0, 0.0),
    ],
    [
        Vec2::new(0.0, 1.0),
        Vec2::new(1.0, 0.0),
        Vec2::new(0.0, 0.0),
    ],
];

fn quad(corner: Vec3, right: Vec3, up: Vec3) -> Vec<Triangle> {
    let [a, b, c, d] = [corner, corner + right, corner + right + up, corner + up];
    [[a, b, c], [a, c, d]].map(Triangle::from).into()
}

/// Three upright cards sharing an axis.
fn cards() -> (Vec<Triangle>, Vec<[Vec2; 3]>) {
    let card = |k: u32| {
        let (sin, cos) = sin_cos_turns(f64::from(k) / 6.0);
        let half = 0.5 * Vec3::new(cos as f32, 0.0, sin as f32);
        quad(-half, 2.0 * half, Vec3::Y)
    };
    ((0..3).flat_map(card).collect(), CORNERS.repeat(3))
}

/// Random placement of a plant: position, rotation, scale and lean.
fn somewhere(pcg: &mut Pcg32) -> Transform {
    let mut uniform = || f64::from(pcg.uniform_f32());
    let place = Vec3::new(
        (3.6 * uniform() - 1.8) as f32,
        0.0,
        (3.0 * uniform() - 1.5) as f32,
    );
    let (sin, cos) = sin_cos_turns(uniform());
    let size = (0.35 + 0.4 * uniform()) as f32;
    let lean = Vec3::new(
        (0.3 * uniform() - 0.15) as f32,
        1.0,
        (0.3 * uniform() - 0.15) as f32,
    );
    let (sin, cos) = (sin as f32, cos as f32);
    let columns = [Vec3::new(cos, 0.0, -sin), lean, Vec3::new(sin, 0.0, cos)];
    Transform::new(columns.map(|column| size * column), place)
}

fn materials(masked: bool) -> Vec<Material> {
    let tiled = |texture: u32, times: f32, wrap: Wrap| TextureUse {
        wrap: [wrap; 2],
        linear: Mat2::from_diagonal(Vec2::splat(times)),
        ..TextureUse::plain(texture)
    };
    // A margin beyond the image on all sides.
    let leaves = TextureUse {
        offset: Vec2::splat(-0.06),
        ..tiled(LEAVES, 1.12, Wrap::Clamp)
    };
    let mask = |used, channel, cutoff| masked.then_some(AlphaMask::of(used, channel, Some(cutoff)));
    let diffuse = |name, [r, g, b]: [f32; 3]| Material::diffuse(name, Vec3::new(r, g, b));
    let lattice = tiled(MESH, 3.0, Wrap::Repeat);
    vec![
        diffuse("ground", [0.55, 0.5, 0.4]),
        Material {
            base_color_texture: Some(leaves),
            mask: mask(leaves, AlphaChannel::Alpha, 0.4),
            ..diffuse("plant", [1.0; 3])
        },
        Material {
            mask: mask(tiled(MESH, 13.5, Wrap::Mirrored), AlphaChannel::Red, 0.6),
            ..diffuse("fence", [0.5; 3])
        },
        Material {
            mask: mask(lattice, AlphaChannel::Luminance, 0.3),
            ..diffuse("lamp", [0.0; 3])
        }
        .emitting(Vec3::new(9.0, 8.0, 6.0)),
    ]
}

/// Leaves on stalks: alpha falls off over a few texels, so the cutoff lies between texels.
fn leaves_image(size: usize) -> Texture {
    let mut pcg = Pcg32::new(7);
    let mut uniform = || f64::from(pcg.uniform_f32());
    let leaves: Vec<[f64; 5]> = (0..22)
        .map(|_| {
            let (sin, cos) = sin_cos_turns(uniform());
            let height = 0.08 + 0.72 * uniform();
            [
                0.5 + 0.38 * (uniform() - 0.5) * (1.6 - height),
                1.0 - height,
                sin,
                cos,
                0.05 + 0.05 * uniform(),
            ]
        })
        .collect();
    let inside = |x: f64, y: f64| {
        let stalk = 1.0 - (x - 0.5).abs() / 0.012 - (0.2 - y).max(0.0) * 20.0;
        let leaf = leaves.iter().map(|[cx, cy, sin, cos, reach]| {
            let (dx, dy) = (x - cx, y - cy);
            let (along, across) = (dx * cos + dy * sin, dy * cos - dx * sin);
            1.0 - (along / reach).abs() - (across * 3.0 / reach).powi(2)
        });
        leaf.fold(stalk, f64::max)
    };
    let texel = |i: usize| {
        let at = |k: usize| (k as f64 + 0.5) / size as f64;
        let depth = inside(at(i % size), at(i / size));
        let alpha = (0.5 + 2.0 * depth).clamp(0.0, 1.0);
        let light = (0.55 + 0.45 * depth).clamp(0.3, 1.0);
        [90.0 * light, 160.0 * light, 60.0 * light, 255.0 * alpha].map(|x| x as u8)
    };
    Texture {
        name: "leaves".to_owned(),
        width: size as u32,
        height: size as u32,
        texels: (0..size * size).map(texel).collect(),
    }
}

/// A wire mesh, wider than high, in the colours of an opaque image.
fn mesh_image() -> Texture {
    let texel = |i: u32| {
        let (x, y) = (f64::from(i % 12), f64::from(i / 12));
        let wire = (x - 3.0).abs().min((y - 5.0).abs());
        let value = (255.0 * (1.3 - 0.45 * wire).clamp(0.0, 1.0)) as u8;
        [value, value, value, 255]
    };
    Texture {
        name: "mesh".to_owned(),
        width: 12,
        height: 9,
        texels: (0..108).map(texel).collect(),
    }
}

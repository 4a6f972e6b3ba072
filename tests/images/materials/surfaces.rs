//! From hits to surfaces, in f64 from the table words: vertex normals, texture placement and
//! wrapping, normal maps, and the side on which light is reflected.

use super::Path;
use crate::support::{builtin, kernels_with, open};
use glam::{DVec2, DVec3, Mat2, Vec2, Vec3};
use raystone::accel::TriangleSoup;
use raystone::geometry::Triangle;
use raystone::gpu::{Composition, Gpu, KernelLibrary, Player, Recording, Storage, UniformValues};
use raystone::integrator::SceneBuffers;
use raystone::random::Pcg32;
use raystone::scene::{
    GEOMETRIC, Material, PRINCIPLED, SceneData, Texture, TextureUse, Wrap, decode_normal,
    encode_normal,
};

const TRIANGLES: u32 = 48;
const POINTS: usize = 24;

struct Random(Pcg32);

impl Random {
    fn unit(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 / 16_777_216.0
    }

    fn direction(&mut self) -> Vec3 {
        let z = 2.0 * self.unit() - 1.0;
        let (y, x) = (std::f32::consts::TAU * self.unit()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * x, r * y, z)
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }
}

fn random() -> Random {
    Random(Pcg32::with_stream(11, Pcg32::DEFAULT_STREAM))
}

/// Triangles in all directions, with all surface features.
fn scene() -> SceneData {
    let mut random = random();
    let mut scene = builtin("single-triangle", &[]);
    let texture = |name: &str, width: u32, height: u32, random: &mut Random| Texture {
        name: name.into(),
        width,
        height,
        texels: (0..width * height)
            .map(|_| [(); 4].map(|()| (255.0 * random.unit()) as u8))
            .collect(),
    };
    scene.textures = vec![
        texture("wide", 7, 3, &mut random),
        texture("tall", 2, 5, &mut random),
    ];
    scene.materials = (0..9).map(|k| material(k, &mut random)).collect();
    scene.triangles.clear();
    scene.material_ids.clear();
    for k in 0..TRIANGLES {
        let vertices = [(); 3].map(|()| 4.0 * random.vector());
        let triangle = Triangle { vertices };
        let [a, b, c] = vertices;
        let face = (b - a).cross(c - a).normalize();
        // On either side; one corner in four has none.
        let sign = if k % 3 == 0 { -1.0 } else { 1.0 };
        scene.normals.push([(); 3].map(|()| {
            if random.unit() < 0.25 {
                GEOMETRIC
            } else {
                encode_normal(sign * (face + 0.8 * random.direction()))
            }
        }));
        let uv =
            |random: &mut Random| Vec2::new(5.0 * random.unit() - 2.0, 5.0 * random.unit() - 2.0);
        scene.uvs.push([(); 3].map(|()| uv(&mut random)));
        scene.triangles.push(triangle);
        scene.material_ids.push(k % 9);
    }
    // One without area in texture space.
    scene.uvs[4] = [Vec2::new(0.3, 0.7); 3];
    scene
}

fn material(k: usize, random: &mut Random) -> Material {
    let wraps = [Wrap::Repeat, Wrap::Mirrored, Wrap::Clamp];
    let mut used = |texture| TextureUse {
        wrap: [wraps[k % 3], wraps[k / 3]],
        linear: Mat2::from_cols(
            Vec2::new(random.unit(), random.unit()),
            Vec2::new(random.unit(), -random.unit()),
        ),
        offset: Vec2::new(random.unit(), random.unit()),
        scale: 0.7,
        ..TextureUse::plain(texture)
    };
    let base = Vec3::new(0.9, 0.8, 0.7);
    let plain = match k % 2 {
        0 => Material::principled("p", base, 0.6, 0.9, 0.04),
        _ => Material::diffuse("d", base),
    };
    Material {
        base_color_texture: (k != 5).then(|| used(k as u32 % 2)),
        metallic_roughness_texture: k.is_multiple_of(2).then(|| used(1)),
        normal_texture: (k != 7).then(|| used(0)),
        emission_texture: (k != 8).then(|| used(1)),
        ..plain.emitting(Vec3::new(1.0, 2.0, 3.0))
    }
}

struct Point {
    triangle: u32,
    weights: [f32; 2],
    arriving: Vec3,
    numbers: [f32; 2],
    wanted: Vec3,
}

fn points() -> Vec<Point> {
    let mut random = random();
    let point = |k: usize| {
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if u + v > 1.0 {
            (1.0 - u, 1.0 - v)
        } else {
            (u, v)
        };
        Point {
            triangle: k as u32 % TRIANGLES,
            weights: [u, v],
            arriving: random.direction(),
            numbers: [random.unit(), random.unit()],
            wanted: random.direction(),
        }
    };
    (0..POINTS * TRIANGLES as usize).map(point).collect()
}

fn answers(gpu: &Gpu, library: &KernelLibrary, scene: &SceneData) -> Vec<[f32; 20]> {
    let soup = TriangleSoup::new(scene);
    let buffers = SceneBuffers::upload(gpu, scene, &soup).expect("buffers that fit");
    let row = |p: &Point| {
        [
            p.arriving.extend(p.triangle as f32).to_array(),
            [p.weights[0], p.weights[1], p.numbers[0], p.numbers[1]],
            p.wanted.extend(0.0).to_array(),
        ]
    };
    let rows: Vec<_> = points().iter().map(row).collect();
    let count = rows.len() as u32;
    let storage = Storage::scratch("answers", u64::from(count) * 80);
    let mut kernel = Composition::new("test/surface");
    for (feature, is_on) in buffers.features.flags() {
        kernel = kernel.feature(feature, is_on);
    }
    let kernel = gpu
        .pipeline(&kernel, true)
        .unwrap_or_else(|e| panic!("{e}"));
    let mut bindings = buffers.bindings.clone();
    bindings
        .buffer("asked", &gpu.storage("asked", &rows).expect("a buffer"))
        .buffer("answers", &storage)
        .uniform("asking", UniformValues::new().u32("count", count))
        .uniform("frame", frame(library, &buffers));
    let mut recording = Recording::new();
    recording
        .run("ask", &kernel, &bindings, [count.div_ceil(64), 1, 1])
        .download("answers", &storage);
    let played = Player::new(gpu).play(&recording).expect("it plays");
    played.download("answers").expect("answers")
}

/// A frame that is 0 except for the members used by surfaces.
fn frame(library: &KernelLibrary, buffers: &SceneBuffers) -> UniformValues {
    let text = library.text("integrator/frame").expect("the frame");
    let (_, members) = text.split_once("struct Frame {").expect("the struct");
    let (members, _) = members.split_once('}').expect("its end");
    let mut values = UniformValues::new();
    for line in members.lines().filter(|l| !l.trim().starts_with("//")) {
        if let Some((name, kind)) = line.trim().split_once(": ") {
            let words = if kind.starts_with("vec3") { 3 } else { 1 };
            values = values.uvec(name, &vec![0; words]);
        }
    }
    values
        .u32("first_uv", buffers.first_uv)
        .u32("first_normal", buffers.first_normal)
        .u32("first_color", buffers.first_color)
        .u32("first_mirrored", buffers.first_mirrored)
}

fn linear(c: f64) -> f64 {
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// Bilinear between texel centres, each looked up separately.
fn sampled(scene: &SceneData, used: &TextureUse, uv: DVec2, decode: fn(f64) -> f64) -> DVec3 {
    let texture = &scene.textures[used.texture as usize];
    let uv = used.linear.as_dmat2() * uv + used.offset.as_dvec2();
    let size = DVec2::new(texture.width.into(), texture.height.into());
    let place = uv * size - 0.5;
    let index = |at: f64, size: f64, wrap: Wrap| match wrap {
        Wrap::Repeat => at.rem_euclid(size),
        Wrap::Clamp => at.clamp(0.0, size - 1.0),
        Wrap::Mirrored => {
            let there = at.rem_euclid(2.0 * size);
            if there < size {
                there
            } else {
                2.0 * size - 1.0 - there
            }
        }
    };
    let texel = |at: DVec2| {
        let x = index(at.x, size.x, used.wrap[0]) as usize;
        let y = index(at.y, size.y, used.wrap[1]) as usize;
        let [r, g, b, _] = texture.texels[y * texture.width as usize + x];
        DVec3::from_array([r, g, b].map(|c| decode(f64::from(c) / 255.0)))
    };
    let (cell, part) = (place.floor(), place - place.floor());
    let upper = texel(cell).lerp(texel(cell + DVec2::X), part.x);
    let lower = texel(cell + DVec2::Y).lerp(texel(cell + DVec2::ONE), part.x);
    upper.lerp(lower, part.y)
}

/// Applies a normal map. The triangle's lines of constant v are perpendicular to the gradient of v,
/// and x runs along them; y is the negated direction of constant u, orthogonalised against x and
/// the normal (Gram and Schmidt).
fn bent(scene: &SceneData, used: &TextureUse, triangle: usize, uv: DVec2, normal: DVec3) -> DVec3 {
    let [a, b, c] = scene.triangles[triangle].vertices.map(|v| v.as_dvec3());
    let corners = scene.uvs[triangle].map(|uv| uv.as_dvec2());
    let face = (b - a).cross(c - a).normalize();
    // Of a function that is linear between these corner values, times twice the area.
    let gradient = |at: [f64; 3]| face.cross(at[0] * (c - b) + at[1] * (a - c) + at[2] * (b - a));
    let [of_u, of_v] = [corners.map(|t| t.x), corners.map(|t| t.y)].map(gradient);
    let (mut along_u, mut along_v) = (of_v.cross(face), face.cross(of_u));
    if along_u.dot(of_u) == 0.0 {
        return normal;
    }
    along_u *= along_u.dot(of_u).signum();
    along_v *= along_v.dot(of_v).signum();
    let x = along_u.reject_from(normal).normalize();
    let y = (-along_v).reject_from(normal).reject_from(x).normalize();
    let mapped = 2.0 * sampled(scene, used, uv, |c| c) - 1.0;
    let scale = f64::from(used.scale);
    (scale * (mapped.x * x + mapped.y * y) + mapped.z * normal).normalize()
}

fn faults_at(scene: &SceneData, p: &Point, answer: &[f32; 20]) -> Vec<&'static str> {
    let id = p.triangle as usize;
    let [a, b, c] = scene.triangles[id].vertices.map(|v| v.as_dvec3());
    let [u, v] = p.weights.map(f64::from);
    let weights = [1.0 - u - v, u, v];
    let face = (b - a).cross(c - a).normalize();
    let out = -p.arriving.as_dvec3();
    let geometric = face * face.dot(out).signum();
    let corners = scene.normals[id].map(|word| decode_normal(word).unwrap_or(face));
    let sum: DVec3 = (0..3).map(|k| corners[k] * weights[k]).sum();
    let uv: DVec2 = (0..3)
        .map(|k| scene.uvs[id][k].as_dvec2() * weights[k])
        .sum();
    let material = &scene.materials[scene.material_ids[id] as usize];
    let mut normal = sum.normalize();
    let mut margin = sum.length().min(normal.dot(geometric).abs());
    let side = normal.dot(geometric).signum();
    if let Some(used) = &material.normal_texture {
        normal = bent(scene, used, id, uv, normal);
    }
    normal *= side;
    margin = margin.min(normal.dot(out).abs()).min(face.dot(out).abs());
    if normal.dot(out) <= 0.0 {
        normal = geometric;
    }
    let vector = |k: usize| Vec3::from_slice(&answer[k..]).as_dvec3();
    let color = |constant: Vec3, used: &Option<TextureUse>| {
        let texture = used.map_or(DVec3::ONE, |used| sampled(scene, &used, uv, linear));
        constant.as_dvec3() * texture
    };
    let mut out = Vec::new();
    let mut expect = |holds: bool, what| {
        if !holds {
            out.push(what);
        }
    };
    // At a margin of 0, rounding decides.
    if margin > 2e-3 {
        expect(vector(0).distance(normal) < 2e-3, "normal");
        // Directions that a glossy surface would reflect behind itself are mirrored at it.
        let behind = |d: DVec3| d - 2.0 * d.dot(geometric) * geometric;
        let is_folded = |d: DVec3| material.kind == &PRINCIPLED && behind(d).dot(normal) > 0.0;
        let is_reflected =
            |d: DVec3| d.dot(geometric) > 0.0 && (d.dot(normal) > 0.0 || is_folded(d));
        let margin = |d: DVec3| {
            let all = [d.dot(normal), d.dot(geometric), behind(d).dot(normal)];
            all.into_iter()
                .fold(1.0, |least: f64, x| least.min(x.abs()))
        };
        let told = (f64::from(answer[10]), f64::from(answer[11]));
        let wanted = p.wanted.as_dvec3();
        if margin(wanted) > 2e-3 {
            let above = is_reflected(wanted);
            expect((told.0 > 0.0) == above, "side of a density");
            expect((told.0 * told.1 > 0.0) == above, "side of a value");
        }
        let found = vector(12);
        if margin(found) > 2e-3 {
            expect(
                (answer[15] > 0.0) == is_reflected(found),
                "side of a sample",
            );
        }
    }
    let base = color(material.base_color, &material.base_color_texture);
    expect(vector(4).distance(base) < 1e-3, "base colour");
    let used = material.metallic_roughness_texture;
    let varied = used.map_or(DVec3::ONE, |used| sampled(scene, &used, uv, |c| c));
    let found = DVec2::new(answer[8].into(), answer[9].into());
    expect(
        found.distance(DVec2::new(varied.z, varied.y)) < 1e-3,
        "metalness or roughness",
    );
    let emission = color(material.emission, &material.emission_texture);
    expect(vector(16).distance(emission) < 5e-3, "emission");
    out
}

fn all_faults(library: KernelLibrary) -> Vec<&'static str> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images/materials/kernels");
    let library = library.with_folder(&folder).expect("kernels");
    let gpu = open(library.clone());
    let scene = scene();
    let mut out = Vec::new();
    let answers = answers(&gpu, &library, &scene);
    for (point, answer) in points().iter().zip(&answers) {
        for fault in faults_at(&scene, point, answer) {
            if !out.contains(&fault) {
                println!("{fault}: triangle {} {answer:?}", point.triangle);
                out.push(fault);
            }
        }
    }
    out
}

#[test]
fn surfaces_are_those_of_the_formulas() {
    assert_eq!(all_faults(KernelLibrary::default()), [""; 0]);
}

#[test]
fn faults_of_surfaces_are_seen() {
    let texture = "shading/texture";
    let normals = "shading/normals";
    for (file, from, to, expected) in [
        (
            texture,
            "mix(top, bottom, f.y)",
            "mix(bottom, top, f.y)",
            "base colour",
        ),
        (
            texture,
            "vec2<f32>(place.yz) - 0.5",
            "vec2<f32>(place.yz)",
            "base colour",
        ),
        (
            texture,
            "2 * size - 1 - there",
            "2 * size - 2 - there",
            "base colour",
        ),
        (
            texture,
            "return 2.0 * fract(0.5 * x);",
            "return fract(x);",
            "base colour",
        ),
        (
            texture,
            "clamp(at, 0, size - 1)",
            "(at % size + size) % size",
            "base colour",
        ),
        (
            texture,
            "matrix.zw * mesh_uv.y + added",
            "matrix.zw * mesh_uv.y",
            "base colour",
        ),
        (
            texture,
            "matrix.xy * mesh_uv.x + matrix.zw",
            "matrix.xz * mesh_uv.x + matrix.yw",
            "base colour",
        ),
        (
            texture,
            "unwrapped(uv.y, place.w >> 2u)",
            "unwrapped(uv.y, place.w & 3u)",
            "base colour",
        ),
        (
            texture,
            "place.x + y * place.y + x",
            "place.x + y * place.z + x",
            "base colour",
        ),
        (
            texture,
            "pow((encoded + 0.055) / 1.055, vec3<f32>(2.4))",
            "pow(encoded, vec3<f32>(2.2))",
            "base colour",
        ),
        (
            texture,
            "return bilinear(at, uv, false);",
            "return bilinear(at, uv, true);",
            "metalness or roughness",
        ),
        (
            "shading/material",
            "sample_numbers(places.y, uv).zy",
            "sample_numbers(places.y, uv).yz",
            "metalness or roughness",
        ),
        (
            "shading/material",
            "emission *= sample_color(places.w, uv)",
            "emission *= sample_color(places.x, uv)",
            "emission",
        ),
        (
            normals,
            "(LARGEST - abs(y))",
            "(LARGEST - abs(x))",
            "normal",
        ),
        (
            normals,
            "table_word(at + 1u)",
            "table_word(at + 2u)",
            "normal",
        ),
        (normals, "1.0 - hit.u - hit.v", "hit.u", "normal"),
        (
            normals,
            "2.0 * sample_numbers(place, uv) - 1.0",
            "sample_numbers(place, uv)",
            "normal",
        ),
        (
            normals,
            "select(across, -across,",
            "select(-across, across,",
            "normal",
        ),
        (
            normals,
            "turn * (d2.y * e1 - d1.y * e2)",
            "d2.y * e1 - d1.y * e2",
            "normal",
        ),
        (normals, "scale * mapped.y", "mapped.y", "normal"),
        (
            normals,
            "along_u - dot(along_u, normal) * normal",
            "along_u",
            "normal",
        ),
        (
            "shading/surface",
            "select(filed, -filed, is_behind)",
            "filed",
            "normal",
        ),
        (
            "shading/surface",
            "dot(shading, ray.direction) >= 0.0",
            "false",
            "normal",
        ),
        (
            "shading/surface",
            "uv, -e1, e2, filed",
            "uv, e1, e2, filed",
            "normal",
        ),
        (
            "shading/bsdf",
            "select(found.weight, vec3<f32>(0.0), is_astray)",
            "found.weight",
            "side of a sample",
        ),
        (
            "shading/bsdf",
            "dot(surface.normal, direction) <= 0.0",
            "false",
            "side of a density",
        ),
    ] {
        let found = all_faults(kernels_with(file, &[(from, to)]));
        assert!(found.contains(&expected), "`{to}` for `{from}`: {found:?}");
    }
}

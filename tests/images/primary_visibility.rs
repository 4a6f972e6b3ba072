//! Paths that begin at rasterised triangles: nearly all pixels see the same triangle as a ray
//! through the same point, and then have bit-identical values; planted faults are detected.

use crate::support;
use crate::support::*;
use glam::Vec3;
use raystone::accel::{Query, Ray};
use raystone::geometry::Camera;
use raystone::gpu::{Gpu, GpuError, KernelLibrary};
use raystone::image::Image;
use raystone::integrator::{
    IntegratorRegistry, OrganisationRegistry, RayOffset, RenderJob, Renderer,
};
use raystone::params::{ParamValue, Params, Variant};

/// Not a multiple of a row's padding, and one that has no padding.
const SIZE: [u32; 2] = [101, 75];
const UNPADDED: [u32; 2] = [128, 40];
const SPP: u32 = 2;

fn begun_by(primary: &str) -> Variant {
    let primary = ParamValue::Name(primary.to_owned());
    let depth = ("max_depth", ParamValue::Integer(2));
    integrator_variant("path", &[("primary", primary), depth])
}

/// The image of some samples, and the rasterised triangles, if any.
fn rendered(
    stage: &Stage,
    size: [u32; 2],
    structure_name: &str,
    primary: &str,
) -> Result<(Image, Option<Vec<u32>>), GpuError> {
    let integrator = IntegratorRegistry::default().configured(&begun_by(primary));
    let job = RenderJob {
        size,
        camera: stage.camera,
        sampler: &sampler("owen-sobol", "none"),
        integrator: &integrator.unwrap_or_else(|e| panic!("{e}")),
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let traced = stage.traced(&stage.gpu, structure(structure_name));
    let renderer = Renderer::new(&stage.gpu, &stage.buffers, &traced, &job, false)?;
    let image = renderer.render(&[SPP], 3)?.remove(0).image;
    let seen = renderer.visibility().map(|v| v.triangles()).transpose()?;
    Ok((image, seen))
}

/// The triangles found by rays through pixel centres.
fn found(stage: &Stage, size: [u32; 2]) -> Vec<u32> {
    let [forward, right, up] = stage.camera.basis(size);
    let [width, height] = size.map(|edge| edge as f32);
    let ray = |x: u32, y: u32| {
        let across = 2.0 * (x as f32 + 0.5) / width - 1.0;
        let upwards = 1.0 - 2.0 * (y as f32 + 0.5) / height;
        let direction = forward + right * across + up * upwards;
        Ray::new(stage.camera.eye, direction.normalize())
    };
    let rays: Vec<Ray> = (0..size[1])
        .flat_map(|y| (0..size[0]).map(move |x| [x, y]))
        .map(|[x, y]| ray(x, y))
        .collect();
    let traced = stage.traced(&stage.gpu, structure("bvh"));
    let batch = stage
        .tracer(&traced, Query::Closest)
        .and_then(|t| t.batch(&rays));
    let batch = batch.expect("a batch");
    batch.trace().expect("answers");
    let hits = batch.hits().expect("hits");
    hits.iter().map(|hit| hit.triangle).collect()
}

#[derive(Debug)]
struct Difference {
    pixels: usize,
    /// Pixels that see another triangle.
    triangles: usize,
    /// Pixels that see the same one but have another value.
    unexplained: usize,
}

impl Difference {
    /// More than explained by a rasteriser's subpixel grid and rounding.
    fn is_too_great(&self) -> bool {
        // Measured: at most 0.2 % and none.
        200 * self.triangles > self.pixels || self.unexplained > 1
    }
}

fn difference(stage: &Stage, size: [u32; 2]) -> Result<Difference, GpuError> {
    let (rasterised, seen) = rendered(stage, size, "cwbvh", "raster")?;
    let (traced, none) = rendered(stage, size, "cwbvh", "centre")?;
    assert!(none.is_none());
    let (found, seen) = (found(stage, size), seen.expect("what was rasterised"));
    assert_eq!(found.len(), seen.len());
    let values = rasterised.pixels.iter().zip(&traced.pixels);
    let same_value = values.map(|(a, b)| a.map(f32::to_bits) == b.map(f32::to_bits));
    let same_triangle = found.iter().zip(&seen).map(|(a, b)| a == b);
    let pixels: Vec<(bool, bool)> = same_triangle.zip(same_value).collect();
    Ok(Difference {
        pixels: pixels.len(),
        triangles: pixels.iter().filter(|(triangle, _)| !triangle).count(),
        unexplained: pixels
            .iter()
            .filter(|(same, value)| *same && !value)
            .count(),
    })
}

/// Scenes viewed from outside, from inside with triangles all around, and from very close.
fn stages(gpu: &Gpu) -> Vec<(&'static str, [u32; 2], Stage)> {
    let sphere = [("triangles", ParamValue::Integer(2000))];
    let mut all = vec![
        ("cornell-box", SIZE, Stage::builtin(gpu, "cornell-box", &[])),
        (
            "unpadded",
            UNPADDED,
            Stage::builtin(gpu, "cornell-box", &[]),
        ),
        (
            "displaced-sphere",
            SIZE,
            Stage::builtin(gpu, "displaced-sphere", &sphere),
        ),
        (
            "stadium",
            SIZE,
            Stage::builtin(gpu, "teapot-in-a-stadium", &[]),
        ),
        (
            "instances",
            SIZE,
            Stage::builtin(gpu, "instances", &[("count", ParamValue::Integer(9))]),
        ),
    ];
    let plants = [("plants", ParamValue::Integer(6))];
    all.push(("foliage", SIZE, Stage::builtin(gpu, "foliage", &plants)));
    let mut near = Stage::builtin(gpu, "triangle-soup", &[]);
    let vertices = near.scene.triangles[7].vertices;
    let middle = vertices.iter().copied().sum::<Vec3>() / 3.0;
    let across = (vertices[0] - middle).normalize();
    let normal = (vertices[1] - vertices[0])
        .cross(vertices[2] - vertices[0])
        .normalize();
    // A thousandth of the scene away, and past the triangle's plane.
    near.camera = Camera::upright(middle + 1e-3 * normal, middle + 0.1 * across, 70.0);
    all.push(("near a triangle", SIZE, near));
    all
}

#[test]
fn a_rasteriser_sees_what_rays_find_and_paths_go_on_as_theirs_do() {
    if !is_exact(gpu()) {
        return;
    }
    for (name, size, stage) in stages(gpu()) {
        let difference = difference(&stage, size).unwrap_or_else(|e| panic!("{name}: {e}"));
        println!("{name}: {difference:?}");
        assert!(!difference.is_too_great(), "{name}: {difference:?}");
    }
}

#[test]
fn a_camera_that_moves_sees_what_is_there() {
    let stage = Stage::builtin(gpu(), "cornell-box", &[]);
    let traced = stage.traced(gpu(), structure("bvh"));
    let sampler = sampler("owen-sobol", "none");
    let from = |camera| {
        let mut stage = Stage::builtin(gpu(), "cornell-box", &[]);
        stage.camera = camera;
        rendered(&stage, SIZE, "bvh", "raster").expect("an image")
    };
    let mut other = stage.camera;
    other.eye += Vec3::new(0.3, 0.1, 0.0) * (other.target - other.eye).length();
    let mut renderer = stage.renderer(gpu(), &traced, &sampler, &begun_by("raster"), SIZE, false);
    renderer.look(other).expect("another view");
    let image = renderer
        .render(&[SPP], 3)
        .expect("an image")
        .remove(0)
        .image;
    assert!(image.pixels == from(other).0.pixels);
    assert!(image.pixels != from(stage.camera).0.pixels);
}

#[test]
fn what_cannot_be_rasterised_is_refused_with_the_reason() {
    let said = |stage: &Stage, structure: &str| {
        let refused = rendered(stage, SIZE, structure, "raster").expect_err("a refusal");
        refused.to_string()
    };
    let copies = Stage::builtin(gpu(), "instances", &[("count", ParamValue::Integer(9))]);
    assert!(said(&copies, "meta-bvh").contains("objects"));
    for (name, is_refused) in [
        ("single-kernel", false),
        ("regeneration", true),
        ("multi-kernel", true),
        ("wavefront", true),
    ] {
        let by = Variant {
            name: name.to_owned(),
            label: name.to_owned(),
            params: Params::default(),
        };
        let by = OrganisationRegistry::default().configured(&by);
        let integrator = IntegratorRegistry::default().configured(&begun_by("raster"));
        let organised = integrator
            .expect("an integrator")
            .organised(by.expect("a way"));
        assert_eq!(organised.is_err(), is_refused, "{name}");
        let error = organised.err().unwrap_or_default();
        assert_eq!(error.contains("primary = raster"), is_refused, "{error}");
    }
    let wide = begun_by("raster");
    let mut small = alone(KernelLibrary::default());
    small.limits.max_texture_dimension_2d = 64;
    let stage = Stage::builtin(&small, "cornell-box", &[]);
    let text = said(&stage, "bvh");
    assert!(
        text.contains("101") && text.contains("64"),
        "{wide}: {text}"
    );
}

/// True if this kernel fault makes rasterised paths differ from traced ones in some scene.
fn is_seen((module, from, to): (&str, &str, &str)) -> bool {
    let gpu = open(kernels_with(module, &[(from, to)]));
    let shows = |stage: &Stage, size| match difference(stage, size) {
        Ok(difference) => difference.is_too_great(),
        Err(error) => support::shows(&format!("{error:?}")),
    };
    (stages(&gpu).iter()).any(|(_, size, stage)| shows(stage, *size))
}

#[test]
fn planted_faults_are_seen() {
    if !is_exact(gpu()) {
        return;
    }
    const DRAWN: &str = "integrator/visibility";
    const READ: &str = "integrator/visible";
    let faults = [
        // Another triangle.
        (DRAWN, "index / 3u)", "index / 3u + 1u)"),
        // Upside down, from the other side, half a pixel away.
        (DRAWN, "(x, y, view.near,", "(x, -y, view.near,"),
        (DRAWN, "(x, y, view.near,", "(-x, y, view.near,"),
        (
            DRAWN,
            "(x, y, view.near,",
            "(x + 0.01 * distance, y, view.near,",
        ),
        // A near plane that cuts the scene, depth that grows with distance, none at all.
        (DRAWN, "(x, y, view.near,", "(x, y, view.near * 3e5,"),
        (DRAWN, "(x, y, view.near,", "(x, y, distance - view.near,"),
        (DRAWN, "(x, y, view.near,", "(x, y, 0.5 * distance,"),
        // Holes that do not exist, and vice versa; of another point.
        (
            DRAWN,
            "if (is_hole(at.triangle, at.place.xy)) {",
            "if (at.triangle == 0xfffffffeu) {",
        ),
        (DRAWN, "if (is_hole(", "if (!is_hole("),
        (DRAWN, "weights.x, weights.y)", "weights.y, weights.x)"),
        // Front faces only; back faces only.
        (
            DRAWN,
            "fn seen(at: Corner) -> @location(0) u32 {",
            "fn seen(at: Corner, @builtin(front_facing) front: bool) -> @location(0) u32 {\n    if (!front) { discard; }",
        ),
        (
            DRAWN,
            "fn seen(at: Corner) -> @location(0) u32 {",
            "fn seen(at: Corner, @builtin(front_facing) front: bool) -> @location(0) u32 {\n    if (front) { discard; }",
        ),
        // Rows without their padding, with padding where there is none, and of the pixel above.
        (
            READ,
            "/ ROW_WORDS * ROW_WORDS;",
            "/ ROW_WORDS * frame.width;",
        ),
        (
            READ,
            "(frame.width + ROW_WORDS - 1u) / ROW_WORDS",
            "(frame.width / ROW_WORDS + 1u)",
        ),
        (
            READ,
            "visible[pixel.y * stride",
            "visible[max(pixel.y, 1u) * stride - stride",
        ),
        // Weights of another corner.
        (
            READ,
            "    return hit;\n",
            "    return Hit(hit.t, hit.triangle, hit.v, hit.u);\n",
        ),
    ];
    let mut unseen = faults_in_turn("faults of rasterised paths", faults);
    unseen.retain(|fault| !is_seen(*fault));
    assert!(unseen.is_empty(), "not seen: {unseen:#?}");
    assert!(!is_seen((
        READ,
        "// Where a path begins",
        "// Where  a path begins"
    )));
}

//! Pixel orders: images are bit-identical to a single pass, and the first picture has no gaps.

use crate::support;
use crate::support::{Stage, sampler_of, variant};
use raystone::accel::AccelRegistry;
use raystone::gpu::{GpuError, KernelLibrary};
use raystone::image::Image;
use raystone::integrator::offset::RayOffset;
use raystone::integrator::order::splat;
use raystone::integrator::{IntegratorRegistry, Order, PartRenderer, RenderJob};
use raystone::params::Choice as _;

/// Not a multiple of a tile.
const SIZE: [u32; 2] = [53, 38];
const SPP: u32 = 3;

/// The image of three samples in an order, with a kernel library, first sums, and passes.
fn in_order(
    order: Order,
    kernels: Option<KernelLibrary>,
) -> Result<(Image, Vec<[f32; 4]>, usize), GpuError> {
    let gpu = support::gpu();
    let replaced = kernels.map(|kernels| gpu.with_kernels(kernels));
    let gpu = replaced.as_ref().unwrap_or(gpu);
    let stage = Stage::builtin(gpu, "cornell-box", &[]);
    let accel = AccelRegistry::default();
    let traced = stage.traced(gpu, accel.get("cwbvh").expect("a structure"));
    let integrators = IntegratorRegistry::default();
    let what = variant(&integrators.entries(), "path", &[]);
    let sampler = sampler_of("sobol", "cranley-patterson", SPP);
    let job = RenderJob {
        size: SIZE,
        camera: stage.camera,
        sampler: &sampler,
        integrator: &integrators.configured(&what).expect("an integrator"),
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = PartRenderer::new(gpu, &stage.buffers, &traced, &job)?;
    let mut first = Vec::new();
    let spent = renderer.render(order, (SPP, 7), |renderer| {
        first = renderer.sums()?;
        let gap = || GpuError::Kernels("the first picture has a gap".to_owned());
        renderer.preview()?.map(|_| ()).ok_or_else(gap)
    })?;
    assert!(spent.first_picture.wall_ms <= spent.total.wall_ms);
    Ok((renderer.image(SPP)?, first, spent.passes))
}

/// The image of the renderer with whole samples.
fn whole() -> Image {
    let gpu = support::gpu();
    let stage = Stage::builtin(gpu, "cornell-box", &[]);
    let accel = AccelRegistry::default();
    let traced = stage.traced(gpu, accel.get("cwbvh").expect("a structure"));
    let what = variant(&IntegratorRegistry::default().entries(), "path", &[]);
    let sampler = sampler_of("sobol", "cranley-patterson", SPP);
    let renderer = stage.renderer(gpu, &traced, &sampler, &what, SIZE, false);
    let mut snapshots = renderer.render(&[SPP], 7).expect("an image");
    snapshots.remove(0).image
}

#[test]
fn images_of_all_orders_equal_that_of_whole_samples_to_the_bit() {
    let expected = whole();
    for order in Order::ALL {
        let (image, first, passes) = in_order(*order, None).expect("an image");
        assert_eq!(image, expected, "{}", order.name());
        let taken = first.iter().filter(|sum| sum[3] > 0.0).count();
        let all = (SIZE[0] * SIZE[1]) as usize;
        let (first_picture, of_sample) = match order {
            Order::OnePass => (all, 1),
            Order::Blocks => (all, 16),
            Order::QuadTree => (4 * 3, 256),
        };
        assert_eq!(
            (taken, passes),
            (first_picture, of_sample),
            "{}",
            order.name()
        );
        // A single wrong bit is detected.
        let mut sums = vec![[1.0; 4]; all];
        let same = splat(&sums, SIZE);
        sums[all / 2][1] = 1.0 + f32::EPSILON;
        assert_ne!(splat(&sums, SIZE), same);
    }
}

#[test]
fn faults_of_the_kernel_are_seen() {
    let expected = whole();
    let faults = [
        // Each part is the first one, without displacement.
        ("part.first_x + part.step * id.x", "part.step * id.x"),
        // The last column of each part is missing.
        ("id.x >= part.columns", "id.x + 1u >= part.columns"),
        // The seed is that of the place within the part.
        (
            "SamplerState(pixel,",
            "SamplerState(id.y * part.columns + id.x,",
        ),
        // All samples are the first.
        ("frame.first_sample + i", "i"),
        // Sums restart.
        ("var sum = accumulation[pixel]", "var sum = vec4<f32>(0.0)"),
    ];
    for (from, to) in faults {
        let kernels = support::kernels_with("integrator/render_part", &[(from, to)]);
        let found = in_order(Order::QuadTree, Some(kernels));
        let is_seen = match found {
            Ok((image, ..)) => image != expected,
            Err(error) => support::shows(&format!("{error:?}")),
        };
        assert!(is_seen, "{from} -> {to}");
    }
}

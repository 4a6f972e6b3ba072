//! Sums and checks of a renderer: sample blocks, row bands, samples per pixel, error word.

use super::MAX_DEPTH;
use crate::support::*;
use raystone::gpu::{AdapterChoice, Gpu, GpuError, KernelLibrary};
use raystone::image::Image;
use raystone::integrator::{BLOCK_SAMPLES, Renderer, rounding_bound};

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

/// Renders the furnace box through the plain BVH.
fn with_renderer<T>(gpu: &Gpu, size: [u32; 2], work: impl FnOnce(&Renderer) -> T) -> T {
    let stage = Stage::builtin(gpu, "furnace-box", &[]);
    let traced = stage.traced(gpu, structure("bvh"));
    let sampler = sampler("pixel-hash", "none");
    work(&stage.renderer(gpu, &traced, &sampler, &path(MAX_DEPTH), size, false))
}

/// The error for an image whose sample loop was changed.
fn refused(loop_condition: &str, spps: &[u32]) -> GpuError {
    let planted = kernels_with(
        "integrator/render",
        &[("i < frame.samples", loop_condition)],
    );
    with_renderer(&open(planted), [16, 16], |renderer| {
        renderer.render(spps, 1).expect_err("samples are missing")
    })
}

#[test]
fn an_image_whose_pixels_took_other_samples_than_asked_for_is_an_error() {
    // None beyond the third, in however many slices the image is made.
    let error = refused(
        "i < min(frame.samples, 3u - min(frame.first_sample, 3u))",
        &[8],
    );
    assert!(
        matches!(
            error,
            GpuError::Samples {
                wrong: 256,
                wanted: 8,
                taken: 3.0,
                ..
            }
        ),
        "{error}"
    );
    let error = refused(
        "i < frame.samples + select(0u, 1u, pixel == 77u)",
        &[1, 2, 8],
    );
    let text = error.to_string();
    assert!(
        text.contains("1 pixels") && text.contains("(13, 4)"),
        "{text}"
    );
    // In a block that the host has already read.
    let error = refused(
        "i < frame.samples - select(0u, 1u, frame.first_sample == 0u)",
        &[2 * BLOCK_SAMPLES],
    );
    assert!(
        matches!(
            error,
            GpuError::Samples {
                wanted: BLOCK_SAMPLES,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn an_image_during_which_a_kernel_raised_its_error_word_is_an_error() {
    let impatient = kernels_with(
        "accel/bvh/stack",
        &[(
            "step < limits.step_fuse",
            "step < min(limits.step_fuse, 3u)",
        )],
    );
    with_renderer(&open(impatient), [16, 16], |renderer| {
        let error = renderer.render(&[1], 1).expect_err("a blown fuse");
        assert!(error.to_string().contains("step fuse"), "{error}");
        renderer.reset().expect("a device");
        renderer.add_samples(0, 1, 1).expect("samples");
        renderer.ray_counts().expect_err("a blown fuse");
    });
}

#[test]
fn a_sum_of_many_samples_stays_within_its_rounding_bound() {
    let planted = kernels_with(
        "integrator/render",
        &[(
            "radiance(vec2<u32>(x, y), &sampler)",
            "vec3<f32>(0.1, 0.7, 1.0e-3)",
        )],
    );
    let spps: Vec<u32> = (0..=16).map(|k| 1 << k).collect();
    let shots = with_renderer(&open(planted), [8, 8], |renderer| {
        renderer.render(&spps, 1).expect("a render")
    });
    for shot in shots {
        let bound = rounding_bound(shot.spp);
        assert!(bound < 1.6e-5, "{bound}");
        for (mean, exact) in shot.image.pixels[5].iter().zip([0.1_f32, 0.7, 1.0e-3]) {
            let error = (f64::from(*mean) / f64::from(exact) - 1.0).abs();
            assert!(
                error <= bound,
                "{} spp: {error:e} beyond {bound:e}",
                shot.spp
            );
        }
    }
}

#[test]
fn blocks_begin_at_fixed_samples_however_the_samples_are_cut() {
    let end = BLOCK_SAMPLES + 44;
    with_renderer(gpu(), [16, 16], |renderer| {
        let whole = bits(&renderer.render(&[end], 3).expect("a render")[0].image);
        for cuts in [&[100, end][..], &[BLOCK_SAMPLES, end], &[1, 255, 257, end]] {
            let shots = renderer.render(cuts, 3).expect("a render");
            assert_eq!(
                whole,
                bits(&shots.last().expect("a shot").image),
                "{cuts:?}"
            );
        }
    });
}

#[test]
fn an_image_too_large_for_one_buffer_is_summed_in_bands() {
    let whole = with_renderer(gpu(), [200, 100], |renderer| {
        bits(&renderer.render(&[3], 5).expect("a render")[0].image)
    });
    let mut small = alone(KernelLibrary::default());
    // 40 rows of 200 pixels; the scene needs less.
    small.limits.max_storage_buffer_binding_size = 128 << 10;
    with_renderer(&small, [200, 100], |renderer| {
        let banded = bits(&renderer.render(&[1, 3], 5).expect("a render")[1].image);
        assert!(whole == banded, "bands change the image");
    });
}

#[test]
fn a_driver_that_ends_loops_is_seen_and_what_it_cuts_is_refused() {
    // As if the closing loop of every kernel had been cut.
    let cut = alone(kernels_with(
        "common/errors",
        &[("turns != wanted", "turns == wanted")],
    ));
    assert_eq!((cut.loop_limit, gpu().loop_limit), (Some(1_000_000), None));
    let error = with_renderer(&cut, [16, 16], |renderer| {
        renderer.render(&[1], 1).expect_err("cut loops")
    });
    assert!(error.is_refusal(), "{error}");
    // Loops that end early without any kernel noticing.
    let silent = kernels_with(
        "common/loops",
        &[("k < loops.inner", "k < min(loops.inner, 70000u)")],
    );
    let error = raystone::gpu::open(&AdapterChoice::Best, silent).err();
    let error = error.expect("an unsound driver").to_string();
    assert!(error.contains("70000 of 1000000"), "{error}");
}

//! Where pilots pay: additions times squared error of both pipelines, by the number of photons.

use super::scene::{Scene, lamp};
use super::*;
use crate::pipeline::Pipeline;
use crate::scatter::Adding;
use crate::tests::segments::adapter;
use raystone_gpu::Gpu;

/// Additions to sums times the squared error of the image.
fn product(gpu: &Gpu, scene: &Scene, load: &Load) -> f64 {
    let medium = (&scene.volume, &scene.medium);
    let adding = Adding::new(Strategy::Fixed64, 0);
    let set = load.points(load.photons, 1);
    let set = set.unwrap_or_else(|_| panic!("no points"));
    let mut pipeline = Pipeline::new(gpu, medium, adding, lamp(), set).unwrap();
    pipeline.set_view(&scene.rays);
    pipeline.set_smoothing(load.smoothing());
    pipeline.set_adaptive(load.adaptive(1));
    let rendered = pipeline.render().unwrap();
    let adds: u64 = pipeline.additions().unwrap().iter().sum();
    scene.noise(&rendered.image).powi(2) * adds as f64
}

#[test]
fn the_mode_that_is_chosen_takes_less_work_for_its_error() {
    let Some(gpu) = adapter() else { return };
    for content in [Content::Shadow, Content::Cloud] {
        let of = |mode, filter, photons| Load {
            content,
            mode,
            filter,
            photons,
            ..Load::default()
        };
        let scene = Scene::new(&gpu, &of(Mode::Auto, Filter::None, 8), "");
        let scene = scene.unwrap_or_else(|_| panic!("no scene"));
        for (filter, photons, least) in [
            (Filter::None, 128, Mode::Reference),
            (Filter::Blur, 128, Mode::Reference),
            (Filter::Both, 48, Mode::Reference),
            (Filter::Both, 128, Mode::Adaptive),
        ] {
            let modes = [Mode::Reference, Mode::Adaptive];
            let [even, other] = modes.map(|mode| product(&gpu, &scene, &of(mode, filter, photons)));
            let ratio = other / even;
            println!(
                "{} {photons}² {}: {ratio:.2}",
                content.name(),
                filter.name()
            );
            assert_eq!(ratio < 1.0, least == Mode::Adaptive, "{ratio}");
            let auto = of(Mode::Auto, filter, photons);
            assert_eq!(auto.chosen(), least, "{} {photons}", filter.name());
            assert!(
                auto.choice()
                    .is_some_and(|why| why.starts_with(least.name()))
            );
            assert_eq!(of(least, filter, photons).choice(), None);
        }
    }
}

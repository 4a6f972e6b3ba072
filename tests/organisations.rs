//! Organisations of the path tracer: all make the image of the single kernel to the bit, whatever the structure, the queues' length,
//! compaction and sorting; and planted faults do not.

#[path = "adding_an_integrator/piped.rs"]
mod piped;
mod support;

use piped::PipedBvh;
use raystone::accel::Traced;
use raystone::gpu::{Gpu, GpuError, KernelLibrary};
use raystone::image::Image;
use raystone::integrator::{
    IntegratorRegistry, OrganisationRegistry, RayOffset, RenderJob, Renderer,
};
use raystone::params::{ParamValue, Params, Variant};
use raystone::scene::SceneData;
use support::*;

/// No multiple of the eight pixels of a workgroup's edge.
const SIZE: [u32; 2] = [37, 29];
const SPPS: [u32; 2] = [1, 3];

/// An organisation of this name with these parameters.
fn organisation(name: &str, changes: &[(&str, ParamValue)]) -> Variant {
    let changes = changes.iter().map(|(k, v)| ((*k).to_owned(), v.clone()));
    Variant {
        name: name.to_owned(),
        label: name.to_owned(),
        params: Params(changes.collect()),
    }
}

fn word(value: &str) -> ParamValue {
    ParamValue::Name(value.to_owned())
}

fn wavefront(changes: &[(&str, ParamValue)]) -> Variant {
    organisation("wavefront", changes)
}

fn small(more: &[(&str, ParamValue)]) -> Variant {
    let capacity = ("capacity", ParamValue::Integer(1024));
    wavefront(&[&[capacity], more].concat())
}

/// Bits of the images after [`SPPS`] samples, and rays by class.
fn rendered(
    gpu: &Gpu,
    stage: &Stage,
    traced: &Traced,
    what: &Variant,
    by: &Variant,
) -> Result<(Vec<Vec<[u32; 3]>>, Vec<u64>), GpuError> {
    let integrator = IntegratorRegistry::default()
        .configured(what)
        .expect("an integrator");
    let by = OrganisationRegistry::default().configured(by);
    let integrator = integrator.organised(by.expect("an organisation"));
    let job = RenderJob {
        size: SIZE,
        camera: stage.camera,
        sampler: &sampler("owen-sobol", "none"),
        integrator: &integrator.map_err(GpuError::Kernel)?,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(gpu, &stage.buffers, traced, &job, true)?;
    let shots = renderer.render(&SPPS, 9)?;
    let bits = |image: &Image| image.pixels.iter().map(|p| p.map(f32::to_bits)).collect();
    let images = shots.iter().map(|shot| bits(&shot.image)).collect();
    Ok((images, renderer.ray_counts()?.to_vec()))
}

/// A closed room with glass, and copies in the open.
fn scenes() -> [SceneData; 2] {
    [
        builtin("cornell-box", &[("glass", ParamValue::Flag(true))]),
        builtin("instances", &[("count", ParamValue::Integer(9))]),
    ]
}

fn all() -> Vec<Variant> {
    let never = ("regeneration", ParamValue::Flag(false));
    let mut all = vec![
        organisation("regeneration", &[]),
        organisation("multi-kernel", &[]),
        wavefront(&[]),
        small(&[]),
        small(&[never.clone()]),
        small(&[("sorting", word("material"))]),
        small(&[("sorting", word("ray-key")), never]),
    ];
    for method in ["atomic", "reduce-scan-scatter", "horn", "blelloch", "roger"] {
        all.push(small(&[("compaction", word(method))]));
    }
    all
}

#[test]
fn all_organisations_make_the_image_of_the_single_kernel_to_the_bit() {
    for scene in scenes() {
        let stage = Stage::new(gpu(), scene);
        let traced = stage.traced(gpu(), structure("bvh"));
        let single = organisation("single-kernel", &[]);
        let expected = rendered(gpu(), &stage, &traced, &path(5), &single).expect("an image");
        for by in all() {
            let found = rendered(gpu(), &stage, &traced, &path(5), &by);
            let found = found.unwrap_or_else(|e| panic!("{by:?}: {e}"));
            assert!(
                found.0 == expected.0,
                "{}: {by:?}: other pixels",
                stage.scene.name
            );
            assert_eq!(found.1, expected.1, "{}: {by:?}: rays", stage.scene.name);
        }
    }
}

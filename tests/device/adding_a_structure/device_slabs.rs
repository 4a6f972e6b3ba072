//! `device-slabs`: [`SortedSlabs`](super::sorted_slabs::SortedSlabs) whose boxes are made on the device and stay
//! there; the host gets a copy, for validation and twin.

use super::sorted_slabs::{Built, Run, Slabs, sorted};
use raystone::accel::bounds::Bounds;
use raystone::accel::{
    AccelError, BuildLog, BuildResult, BuiltAccel, CpuTwin, GpuBuffers, Structure, StructureStats,
    TriangleBuffers, TriangleSoup,
};
use raystone::gpu::{Composition, Gpu, GpuError, Recording, UniformValues, groups_for};
use raystone::params::Sources;

/// The registry entry.
pub struct DeviceSlabs;

impl Structure for DeviceSlabs {
    const NAME: &'static str = "device-slabs";
    const DESCRIPTION: &'static str = "sorted-slabs with boxes made on the device (an example)";
    const SOURCES: Sources = &[
        (
            "accel/sorted_slabs",
            include_str!("kernels/accel/sorted_slabs.wesl"),
        ),
        (
            "accel/device_slabs",
            include_str!("kernels/accel/device_slabs.wesl"),
        ),
    ];
    type Parameters = Slabs;

    fn build(soup: &TriangleSoup, slabs: &Slabs, log: &mut BuildLog) -> BuildResult {
        let order = log.phase("sort", || sorted(soup));
        let boxes = match log.gpu().cloned() {
            Some(gpu) => record(&gpu, soup, slabs, &order),
            // Without a device there is nothing to record, and playing it is an error.
            None => log.play(&Recording::new()).map(|_| unreachable!()),
        };
        let (recording, boxes) = boxes?;
        let words = log.play(&recording)?.download("boxes");
        let words: Vec<[u32; 8]> = words.map_err(failed)?;
        let runs = words[..order.len().div_ceil(slabs.run_length)].iter();
        Ok(Box::new(OnDevice {
            copy: Built {
                runs: runs.map(run).collect(),
                order,
            },
            boxes,
        }))
    }
}

fn failed(error: GpuError) -> AccelError {
    AccelError::Device(error.to_string())
}

/// The pass that makes the boxes, and the buffer that it leaves them in.
fn record(
    gpu: &Gpu,
    soup: &TriangleSoup,
    slabs: &Slabs,
    order: &[u32],
) -> Result<(Recording, wgpu::Buffer), AccelError> {
    let runs = order.len().div_ceil(slabs.run_length);
    let recorded = || {
        let boxes = gpu.zeroed("runs", 32 * runs.max(1) as u64)?;
        let mut bindings = TriangleBuffers::upload(gpu, soup)?.bindings;
        let size = UniformValues::new().u32("length", slabs.run_length as u32);
        bindings
            .buffer("runs", &boxes)
            .buffer("order", &gpu.storage("order", order)?)
            .uniform("slabs", size.u32("triangles", order.len() as u32));
        let kernel = soup
            .intersection
            .activate(Composition::new("accel/device_slabs"));
        let pipeline = gpu.pipeline(&bindings.compose(kernel), true)?;
        let mut recording = Recording::new();
        recording
            .run("boxes", &pipeline, &bindings, groups_for(runs as u32))
            .download("boxes", &boxes);
        Ok((recording, boxes))
    };
    recorded().map_err(failed)
}

fn run(&[x, y, z, first, u, v, w, end]: &[u32; 8]) -> Run {
    Run {
        bounds: Bounds {
            min: [x, y, z].map(f32::from_bits),
            max: [u, v, w].map(f32::from_bits),
        },
        first,
        end,
    }
}

struct OnDevice {
    copy: Built,
    boxes: wgpu::Buffer,
}

impl BuiltAccel for OnDevice {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.copy.validate(soup)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let mut buffers = self.copy.buffers();
        buffers.arrays.retain(|array| array.name != "runs");
        buffers
    }

    fn on_device(&self) -> Vec<(&'static str, wgpu::Buffer)> {
        vec![("runs", self.boxes.clone())]
    }

    fn stats(&self) -> StructureStats {
        self.copy.stats()
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        self.copy.cpu_twin(soup)
    }
}

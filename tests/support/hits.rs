//! Batches of rays through a structure's kernel, brute force on the host, and comparisons to the bit.

use raystone::accel::triangle::intersect_triangle;
use raystone::accel::{
    AccelKind, Access, Ask, BuildLog, BuiltAccel, Counters, Hit, Load, Query, Ray, Traced, Tracer,
    TriangleBuffers, TriangleSoup,
};
use raystone::gpu::Gpu;
use raystone::params::{ParamRange, ParamValue, ParameterSchema, Params};

/// A small deterministic generator (PCG-RXS-M-XS with 64 bits of state; O'Neill 2014).
pub struct Pcg(u64);

impl Pcg {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x853c_49e6_748f_ea9b)
    }

    pub fn next_u32(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let word = ((self.0 >> ((self.0 >> 59) + 5)) ^ self.0)
            .wrapping_mul(12_605_985_483_714_917_081)
            .rotate_left(17);
        (word >> 32) as u32 ^ word as u32
    }

    /// An integer in `0..n`.
    pub fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.next_u32()) * u64::from(n)) >> 32) as u32
    }

    /// An integer in `low..=high`.
    pub fn between(&mut self, low: i32, high: i32) -> i32 {
        low + self.below((high - low + 1) as u32) as i32
    }

    /// A number in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 * 2.0_f32.powi(-24)
    }

    /// A number in [-1, 1).
    pub fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }
}

/// Every parameter at its default.
pub fn default_params(schema: &ParameterSchema) -> Params {
    let value = |p: &raystone::params::Parameter| (p.name.to_owned(), p.default.clone());
    Params(schema.iter().map(value).collect())
}

/// The defaults, and each parameter in turn at other values: the ends of an integer's range, an eighth and eight
/// times a number, every choice except those that need a device.
pub fn param_variants(schema: &ParameterSchema) -> Vec<Params> {
    let mut out = vec![default_params(schema)];
    for parameter in schema {
        let values: Vec<ParamValue> = match (&parameter.range, &parameter.default) {
            (ParamRange::Integer { min, max }, _) => {
                vec![ParamValue::Integer(*min), ParamValue::Integer(*max)]
            }
            (ParamRange::Stepped(_, range), _) => [range.start(), range.end()]
                .map(|x| ParamValue::Integer(*x))
                .to_vec(),
            (ParamRange::Number { min, max }, ParamValue::Number(x)) => [x / 8.0, x * 8.0]
                .map(|x| ParamValue::Number(x.clamp(*min, *max)))
                .to_vec(),
            (ParamRange::Flag, _) => [false, true].map(ParamValue::Flag).to_vec(),
            (ParamRange::Choice(names), _) => {
                // Builders on a device have tests/device/device_builders.
                let names = names.iter().filter(|n| !n.starts_with("device-"));
                names.map(|n| ParamValue::Name((*n).to_owned())).collect()
            }
            // Texts name files, whose readers have tests of their own.
            (ParamRange::Text, _) => Vec::new(),
            (range, default) => panic!("{}: default {default} of {range}", parameter.name),
        };
        for value in values.into_iter().filter(|v| *v != parameter.default) {
            let mut params = default_params(schema);
            params.0.insert(parameter.name.to_owned(), value);
            out.push(params);
        }
    }
    out
}

/// Builds a structure and checks its invariants.
pub fn build(kind: &dyn AccelKind, soup: &TriangleSoup, params: &Params) -> Box<dyn BuiltAccel> {
    let name = kind.name();
    let built = kind
        .build(soup, params, &mut BuildLog::default())
        .unwrap_or_else(|e| panic!("{name} with {params:?} does not build: {e}"));
    built
        .validate(soup)
        .unwrap_or_else(|e| panic!("{name} with {params:?} is not valid: {e}"));
    built
}

/// True if its kernels count the work of each ray; passes that answer many rays together may not.
pub fn counts_work(built: &dyn BuiltAccel) -> bool {
    match built.access() {
        Access::Inline => true,
        Access::Pipeline(passes) => passes.counts_work(),
    }
}

/// The results of a batch; `work` is empty unless the feature `counters` was on.
pub struct Batch {
    /// Closest hits; with the feature `any`, `t.to_bits()` is 1 or 0.
    pub hits: Vec<Hit>,
    /// Counted work per ray.
    pub work: Vec<Counters>,
}

impl Batch {
    /// Answers of a batch with the feature `any`.
    pub fn found(&self) -> Vec<bool> {
        self.hits.iter().map(|h| h.t.to_bits() == 1).collect()
    }
}

/// Traces `rays` on the GPU. Features: `any` for any-hit queries, `counters` to count work.
/// Panics with the error word if the kernel raised one.
pub fn trace(
    gpu: &Gpu,
    built: &dyn BuiltAccel,
    soup: &TriangleSoup,
    rays: &[Ray],
    features: &[&str],
) -> Batch {
    trace_by(&Load::default(), gpu, built, soup, rays, features)
}

/// [`trace`] by a load path.
pub fn trace_by(
    load: &Load,
    gpu: &Gpu,
    built: &dyn BuiltAccel,
    soup: &TriangleSoup,
    rays: &[Ray],
    features: &[&str],
) -> Batch {
    let ask = Ask {
        query: if features.contains(&"any") {
            Query::Any
        } else {
            Query::Closest
        },
        counters: features.contains(&"counters"),
        coherent: false,
        runtime_checks: true,
    };
    let run = || {
        let triangles = TriangleBuffers::upload(gpu, soup)?;
        let traced = Traced::upload(gpu, built)?.loading(gpu, load)?;
        let batch = Tracer::new(gpu, &triangles, &traced, ask)?.batch(rays)?;
        batch.trace()?;
        gpu.check_error_word(batch.error_word()?)?;
        let (work, hits) = if ask.counters {
            batch.work()?
        } else {
            (Vec::new(), batch.hits()?)
        };
        Ok::<_, raystone::gpu::GpuError>(Batch { hits, work })
    };
    run().unwrap_or_else(|e| panic!("{} {features:?}: {e}", built.buffers().kernel))
}

/// The reference tracer: every triangle for every ray.
pub fn brute_force(soup: &TriangleSoup, rays: &[Ray]) -> Vec<Hit> {
    let closest = |ray: &Ray| {
        let ray = &soup.intersection.raised(ray);
        let inverse = soup.intersection.inverse(ray.direction);
        let mut hit = Hit::miss(ray);
        if !ray.is_ray() {
            return hit;
        }
        for triangle in &soup.records {
            intersect_triangle((triangle, soup.masks.as_deref()), ray, inverse, &mut hit);
        }
        hit
    };
    rays.iter().map(closest).collect()
}

/// Indices of the rays whose hits differ in any bit.
pub fn differences(expected: &[Hit], found: &[Hit]) -> Vec<usize> {
    assert_eq!(expected.len(), found.len());
    let differs = |i: &usize| !expected[*i].same_bits(&found[*i]);
    (0..expected.len()).filter(differs).collect()
}

/// Panics with the first difference and how many there are.
pub fn assert_same_hits(what: &str, rays: &[Ray], expected: &[Hit], found: &[Hit]) {
    let different = differences(expected, found);
    if let Some(&first) = different.first() {
        panic!(
            "{what}: {} of {} rays differ; ray {first} {:?}: expected {:?}, found {:?}",
            different.len(),
            rays.len(),
            rays[first],
            expected[first],
            found[first]
        );
    }
}

//! `sorted-slabs`: triangles sorted along x, cut into runs of equal length, one box a run; a ray
//! tests every box. The example of `docs/adding-a-structure.md`.

use raystone::accel::bounds::Bounds;
use raystone::accel::twin::{Traverse, Twin, Walk};
use raystone::accel::{
    AccelError, BuildLog, BuildResult, BuiltAccel, CpuTwin, GpuBuffers, Hit, NamedWords, Structure,
    StructureStats, TriangleSoup, limits,
};
use raystone::parameters;
use raystone::params::Sources;

parameters! {
    /// The parameters.
    pub struct Slabs {
        /// triangles in a run
        run_length: usize = 16, in 1..=1024;
    }
}

/// The registry entry.
pub struct SortedSlabs;

impl Structure for SortedSlabs {
    const NAME: &'static str = "sorted-slabs";
    const DESCRIPTION: &'static str =
        "triangles sorted along x in runs with one box each (an example)";
    const SOURCES: Sources = &[(
        "accel/sorted_slabs",
        include_str!("kernels/accel/sorted_slabs.wesl"),
    )];
    type Parameters = Slabs;

    fn build(soup: &TriangleSoup, slabs: &Slabs, log: &mut BuildLog) -> BuildResult {
        let length = slabs.run_length;
        let order = log.phase("sort", || sorted(soup));
        let runs = log.phase("boxes", || {
            let run = |(index, ids): (usize, &[u32])| {
                let bounds = ids.iter().map(|&id| soup.records[id as usize].bounds());
                let bounds = bounds.fold(Bounds::EMPTY, |all, b| all.union(&b));
                let first = (index * length) as u32;
                Run {
                    bounds,
                    first,
                    end: first + ids.len() as u32,
                }
            };
            order.chunks(length).enumerate().map(run).collect()
        });
        Ok(Box::new(Built { runs, order }))
    }
}

/// Triangles by their centres along x; of equal ones the lower index goes first.
pub fn sorted(soup: &TriangleSoup) -> Vec<u32> {
    let centre = |id: u32| soup.records[id as usize].bounds().doubled_centre()[0];
    let mut order: Vec<u32> = (0..soup.records.len() as u32).collect();
    order.sort_by(|&a, &b| centre(a).total_cmp(&centre(b)).then(a.cmp(&b)));
    order
}

pub struct Run {
    pub bounds: Bounds,
    pub first: u32,
    pub end: u32,
}

pub struct Built {
    pub runs: Vec<Run>,
    pub order: Vec<u32>,
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let wrong = |text: String| Err(AccelError::Invalid(text));
        let mut seen = vec![false; soup.records.len()];
        for (index, run) in self.runs.iter().enumerate() {
            let Some(ids) = self.order.get(run.first as usize..run.end as usize) else {
                return wrong(format!("run {index} leaves the order"));
            };
            for &id in ids {
                let Some(record) = soup.records.get(id as usize) else {
                    return wrong(format!("run {index}: triangle {id} does not exist"));
                };
                if !run.bounds.contains(&record.bounds()) {
                    return wrong(format!("run {index}: triangle {id} sticks out of its box"));
                }
                seen[id as usize] = true;
            }
        }
        match seen.iter().position(|seen| !seen) {
            Some(lost) => wrong(format!("triangle {lost} is in no run")),
            None => Ok(()),
        }
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let words = |run: &Run| {
            let [low, high] = [run.bounds.min, run.bounds.max].map(|v| v.map(f32::to_bits));
            [
                low[0], low[1], low[2], run.first, high[0], high[1], high[2], run.end,
            ]
        };
        let runs: Vec<u32> = self.runs.iter().flat_map(words).collect();
        GpuBuffers {
            kernel: "accel/sorted_slabs",
            features: Vec::new(),
            arrays: vec![
                NamedWords {
                    name: "runs",
                    words: runs.into(),
                    element_bytes: 32,
                },
                NamedWords::new("order", &self.order),
            ],
            uniforms: vec![limits(self.runs.len(), self.runs.len())],
            constants: Vec::new(),
        }
    }

    fn stats(&self) -> StructureStats {
        StructureStats {
            nodes: self.runs.len() as u64,
            leaves: self.runs.len() as u64,
            references: self.order.len() as u64,
            bytes: self.buffers().bytes(),
            ..Default::default()
        }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

impl Traverse for Built {
    fn trace(&self, soup: &TriangleSoup, mut walk: Walk) -> Hit {
        for (index, run) in self.runs.iter().enumerate() {
            walk.visit(index, run);
            if walk.enter(&run.bounds).is_none() {
                continue;
            }
            for &id in &self.order[run.first as usize..run.end as usize] {
                walk.test(&soup.records[id as usize]);
            }
            if walk.is_answered() {
                break;
            }
        }
        walk.hit
    }
}

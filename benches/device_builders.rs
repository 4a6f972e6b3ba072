//! Building on the device against building on the host: processor time, rate, SAH and EPO, and the passes:
//! `cargo bench -p raystone-benches --bench device_builders MODEL…`. Refitting is measured by
//! `experiments/animation.toml`.
//!
//! Times are those of the processor, all threads of the process together, since a software adapter computes there and
//! machines are shared; all builders are built once in each round. Passes are by the clock of the device. On a real
//! adapter only the passes count.

use raystone::accel::tree::{Tree, TreeParameters};
use raystone::accel::{BuildLog, TriangleSoup};
use raystone::gpu::{AdapterChoice, Gpu, KernelLibrary, open};
use raystone::measure::processor::processor_ms;
use raystone::measure::statistics::{median, median_interval};
use raystone::params::{ParamValue, Parameters as _, Params, Variant};
use raystone::scene::{LoadOptions, load};
use std::collections::BTreeMap;

const ROUNDS: usize = 7;
/// Name in the table, builder, and what differs from the defaults.
const ROWS: [(&str, &str, Option<(&str, ParamValue)>); 8] = [
    ("binned", "binned", None),
    ("ploc", "ploc", None),
    ("host-lbvh", "host-lbvh", None),
    ("device-lbvh", "device-lbvh", None),
    ("device-lbvh, 60-bit codes", "device-lbvh", LONG),
    ("host-ploc", "host-ploc", None),
    ("device-ploc", "device-ploc", None),
    ("device-ploc, radius 4", "device-ploc", NEAR),
];
const LONG: Option<(&str, ParamValue)> = Some(("long_codes", ParamValue::Flag(true)));
const NEAR: Option<(&str, ParamValue)> = Some(("search_radius", ParamValue::Integer(4)));

/// A builder, and what its builds took.
struct Row {
    name: &'static str,
    parameters: TreeParameters,
    processor_ms: Vec<f64>,
    phases: BTreeMap<String, Vec<f64>>,
}

impl Row {
    fn new((name, builder, change): &(&'static str, &str, Option<(&str, ParamValue)>)) -> Self {
        let schema = TreeParameters::schema();
        let defaults = schema.iter();
        let defaults = defaults.map(|p| (p.name.to_owned(), p.default.clone()));
        let mut params = Params(defaults.collect());
        let builder = ("builder", ParamValue::Name((*builder).to_owned()));
        for (name, value) in change.iter().cloned().chain([builder]) {
            params.0.insert(name.to_owned(), value);
        }
        Self {
            name,
            parameters: TreeParameters::from_params(&params).expect("parameters"),
            processor_ms: Vec::new(),
            phases: BTreeMap::new(),
        }
    }

    fn build(&mut self, gpu: &Gpu, soup: &TriangleSoup) -> Tree {
        let mut log = BuildLog::with_gpu(gpu);
        let start = processor_ms().expect("a system that tells processor time");
        let tree = Tree::build(soup, &self.parameters, &mut log).expect("a tree");
        let ms = processor_ms().expect("a system that tells processor time") - start;
        self.processor_ms.push(ms);
        for phase in log.phases {
            self.phases.entry(phase.name).or_default().push(phase.ms);
        }
        tree
    }

    fn print(&mut self, gpu: &Gpu, soup: &TriangleSoup) {
        let interval = median_interval(&self.processor_ms).expect("rounds");
        let count = soup.records.len() as f64;
        let phases = std::mem::take(&mut self.phases);
        let mut tree = self.build(gpu, soup);
        tree.note_epo(soup);
        let stats = tree.stats();
        println!(
            "| `{}` | {:.0} [{:.0}, {:.0}] | {:.2} | {:.2} | {:.2} | {} |",
            self.name,
            interval.value,
            interval.low,
            interval.high,
            count / interval.value * 1e-3,
            stats.sah_cost.unwrap_or(f64::NAN),
            stats.epo.unwrap_or(f64::NAN),
            stats.depth.unwrap_or(0),
        );
        let parts = phases.iter();
        let parts = parts.map(|(name, ms)| format!("{name} {:.1}", median(ms).unwrap_or(f64::NAN)));
        eprintln!("{}: {}", self.name, parts.collect::<Vec<_>>().join(", "));
    }
}

fn main() {
    let gpu = open(&AdapterChoice::Best, KernelLibrary::default()).expect("an adapter");
    eprintln!("{}", gpu.info.name);
    for model in std::env::args().skip(1).filter(|a| !a.starts_with('-')) {
        let variant = Variant {
            name: model.clone(),
            params: Params::default(),
            label: model.clone(),
        };
        let options = LoadOptions {
            textures: false,
            ..LoadOptions::default()
        };
        let scene = load(&variant, &options).unwrap_or_else(|e| panic!("{model}: {e}"));
        let soup = TriangleSoup::new(&scene);
        let mut rows: Vec<Row> = ROWS.iter().map(Row::new).collect();
        for round in 0..=ROUNDS {
            for row in &mut rows {
                row.build(&gpu, &soup);
                if round == 0 {
                    // It compiles.
                    row.processor_ms.clear();
                    row.phases.clear();
                }
            }
        }
        println!("\n{model}, {} triangles\n", soup.records.len());
        println!("| builder | processor ms | Mtris/s | SAH | EPO | depth |");
        println!("|---|---:|---:|---:|---:|---:|");
        rows.iter_mut().for_each(|row| row.print(&gpu, &soup));
    }
}

//! The passes of a strategy.

use super::{Adding, ScatterError, Strategy, Tallies};
use glam::Vec3;
use raystone_gpu::{
    Bindings, Composition, Elapsed, Gpu, GpuError, Pairs, Pipeline, Played, RadixSort, Recording,
    Storage, UniformValues, groups_for,
};
use std::sync::Arc;

/// Units of what is dropped are so many times coarser, as in `kernels/media/scatter/tallies.wesl`.
const COARSE: f64 = 256.0;

/// Energy for a voxel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deposit {
    /// The voxel's place.
    pub place: u32,
    /// Red, green and blue.
    pub energy: Vec3,
    /// Direction of travel, of length 1 at most.
    pub direction: Vec3,
}

/// A grid of radiance with the passes of one strategy.
pub struct Scatter {
    adding: Adding,
    cells: u32,
    units: f32,
    module: &'static str,
    /// What is added to: the grid, or the list of deposits.
    target: (&'static str, Storage),
    tallies: Storage,
    /// Two vectors for each voxel: sums of energy, and of direction times its mean.
    pub(crate) radiance: Storage,
    after: After,
}

/// What comes after the deposits.
enum After {
    Resolve(Arc<Pipeline>),
    Sum(Box<(RadixSort, Arc<Pipeline>, Arc<Pipeline>)>),
}

impl Scatter {
    /// A grid of so many voxels, for deposits of which no component is above `largest`.
    ///
    /// # Errors
    /// A number is not allowed, or an array exceeds what the adapter binds.
    pub fn new(gpu: &Gpu, adding: Adding, cells: u32, largest: f32) -> Result<Self, ScatterError> {
        check(&adding, largest)?;
        let module = adding.strategy.module();
        let after = match adding.strategy {
            Strategy::Sort => {
                let kernel = |name: &str| {
                    let kernel = Composition::new(name).feature("undirected", !adding.directed);
                    gpu.pipeline(&kernel, true)
                };
                let sum = kernel("media/scatter/sum")?;
                let passes = (RadixSort::new(gpu)?, kernel("media/scatter/keys")?, sum);
                After::Sum(Box::new(passes))
            }
            of => {
                let form = match of {
                    Strategy::Fixed32 => "words",
                    Strategy::Swap => "floats",
                    _ => "wide",
                };
                let kernel = Composition::new("media/scatter/resolve")
                    .feature(form, true)
                    .feature("undirected", !adding.directed);
                After::Resolve(gpu.pipeline(&kernel, true)?)
            }
        };
        let target = match adding.strategy {
            Strategy::Sort => ("deposits", u64::from(adding.capacity) * 32),
            _ => ("grid", u64::from(cells) * adding.words() * 4),
        };
        let own = |name: &str, bytes: u64| -> Result<Storage, GpuError> {
            Ok(Storage::from(&gpu.zeroed(name, bytes)?))
        };
        Ok(Self {
            adding,
            cells,
            // A power of two, so that no digit is lost.
            units: (f32::from(adding.bits as u16) - largest.log2().ceil()).exp2(),
            module,
            target: (target.0, own(target.0, target.1)?),
            tallies: own("tallies", 64)?,
            radiance: own("radiance", u64::from(cells) * 32)?,
            after,
        })
    }

    /// Bytes of what the strategy writes to and reads again, without the grid of sums that all have.
    pub fn bytes(&self) -> u64 {
        match self.adding.strategy {
            Strategy::Sort => {
                let count = self.adding.capacity;
                u64::from(count) * (32 + 8) + RadixSort::scratch_bytes(count)
            }
            _ => u64::from(self.cells) * self.adding.words() * 4,
        }
    }

    /// Energy of a unit of whole numbers.
    pub fn unit(&self) -> f64 {
        1.0 / f64::from(self.units)
    }

    /// The kernel with this strategy as its module `scatter`.
    pub(crate) fn compose(&self, composition: Composition) -> Composition {
        composition
            .with("scatter", self.module)
            .feature("undirected", !self.adding.directed)
    }

    /// Binds what is added to.
    pub(crate) fn bind(&self, bindings: &mut Bindings) {
        let values = UniformValues::new()
            .f32("units", self.units)
            .u32("attempts", self.adding.attempts)
            .u32("capacity", self.adding.capacity)
            .u32("cells", self.cells);
        bindings
            .uniform("scatter", values)
            .buffer("tallies", &self.tallies)
            .buffer(self.target.0, &self.target.1);
    }

    /// Clears what is added to.
    pub(crate) fn record_before(&self, recording: &mut Recording) {
        recording.clear(&self.tallies);
        if self.adding.strategy != Strategy::Sort {
            recording.clear(&self.target.1);
        }
    }

    /// Makes sums of what was added, and downloads what was counted. Where a driver cuts loops, a kernel tells so by `status`.
    pub(crate) fn record_after(&self, recording: &mut Recording, status: &Storage) {
        let mut bindings = Bindings::new();
        self.bind(&mut bindings);
        bindings
            .buffer("radiance", &self.radiance)
            .buffer("status", status);
        let groups = groups_for(self.cells);
        match &self.after {
            After::Resolve(pipeline) => {
                recording.run("resolve", pipeline, &bindings, groups);
            }
            After::Sum(passes) => {
                let (sort, keys, sum) = &**passes;
                let count = self.adding.capacity;
                let [k, v] = ["deposit keys", "deposit places"]
                    .map(|name| Storage::scratch(name, u64::from(count) * 4));
                bindings.buffer("keys", &k).buffer("values", &v);
                recording.run("keys", keys, &bindings, groups_for(count));
                let pairs = Pairs {
                    keys: k,
                    values: v,
                    count,
                };
                // One key more than voxels: that of no deposit.
                let bits = 32 - self.cells.leading_zeros();
                let sorted = sort.record(recording, &pairs, bits);
                bindings
                    .buffer("keys", &sorted.keys)
                    .buffer("values", &sorted.values);
                recording.run("sum", sum, &bindings, groups);
            }
        }
        recording.download("tallies", &self.tallies);
    }

    /// What was counted in a recording that was played.
    ///
    /// # Errors
    /// There is no download, the list was too short, or sums went round.
    pub fn tallies(&self, played: &Played) -> Result<Tallies, ScatterError> {
        let words = played.download::<u32>("tallies")?;
        let dropped = f64::from(words[4]) + f64::from(words[5]) * 4_294_967_296.0;
        let word = |k: usize| u64::from(words[k]);
        Ok(Tallies {
            deposits: word(0),
            retries: word(1),
            drops: word(2),
            wraps: word(3),
            dropped: dropped * self.unit() * COARSE,
        })
    }

    /// The tallies, if what was added is whole but for attempts that were used up.
    ///
    /// # Errors
    /// The list was too short, or sums went round.
    pub fn checked(&self, tallies: Tallies) -> Result<Tallies, ScatterError> {
        if tallies.wraps > 0 {
            return Err(ScatterError::WentRound {
                wraps: tallies.wraps,
                bits: self.adding.bits,
            });
        }
        if self.adding.strategy == Strategy::Sort && tallies.drops > 0 {
            return Err(ScatterError::Full {
                capacity: self.adding.capacity,
                needed: tallies.deposits,
            });
        }
        Ok(tallies)
    }
}

fn check(adding: &Adding, largest: f32) -> Result<(), ScatterError> {
    let value = |what, value, range| Err(ScatterError::Value { what, value, range });
    if !(1..=24).contains(&adding.bits) {
        return value("the bits", f64::from(adding.bits), "1 to 24");
    }
    if !(largest.is_finite() && largest > 0.0) {
        let range = "a number above 0";
        return value("the largest deposit", f64::from(largest), range);
    }
    if adding.strategy == Strategy::Sort && adding.capacity == 0 {
        return value("the capacity", 0.0, "at least 1");
    }
    Ok(())
}

/// Adds a list of deposits to a grid of `cells` voxels; returns six sums for each.
///
/// # Errors
/// A deposit is no energy or outside the grid, or as [`Scatter::new`].
pub fn scatter_list(
    gpu: &Gpu,
    adding: Adding,
    cells: u32,
    deposits: &[Deposit],
) -> Result<(Vec<[f32; 6]>, Tallies, Elapsed), ScatterError> {
    let mut largest = f32::MIN_POSITIVE;
    for (at, deposit) in deposits.iter().enumerate() {
        check_deposit(at, deposit, cells)?;
        largest = largest.max(deposit.energy.max_element());
    }
    let scatter = Scatter::new(gpu, adding, cells, largest)?;
    let word = |d: &Deposit| {
        let ([r, g, b], [x, y, z]) = (d.energy.to_array(), d.direction.to_array());
        let [low, high] = [d.place & 0xffff, d.place >> 16].map(|half| half as f32);
        [r, g, b, low, x, y, z, high]
    };
    let list: Vec<[f32; 8]> = deposits.iter().map(word).collect();
    let count = deposits.len() as u32;
    let status = Storage::scratch("status", 64);
    let mut bindings = Bindings::new();
    scatter.bind(&mut bindings);
    bindings
        .uniform("of_list", UniformValues::new().u32("count", count))
        .buffer("list", &gpu.storage("list", &list)?)
        .buffer("status", &status);
    let kernel = scatter.compose(Composition::new("media/scatter/of_list"));
    let pipeline = gpu.pipeline(&kernel, true)?;
    let mut recording = Recording::new();
    recording.clear(&status);
    scatter.record_before(&mut recording);
    recording.run("scatter", &pipeline, &bindings, groups_for(count));
    scatter.record_after(&mut recording, &status);
    recording
        .download("radiance", &scatter.radiance)
        .download("status", &status);
    let played = gpu.play(&recording)?;
    gpu.check_error_word(played.download::<u32>("status")?[0])?;
    let tallies = scatter.tallies(&played)?;
    let radiance = played.download::<[f32; 8]>("radiance")?;
    let sums = radiance
        .iter()
        .take(cells as usize)
        .map(|[r, g, b, _, x, y, z, _]| [*r, *g, *b, *x, *y, *z]);
    Ok((sums.collect(), tallies, played.elapsed()))
}

fn check_deposit(at: usize, deposit: &Deposit, cells: u32) -> Result<(), ScatterError> {
    let wrong = |problem: String| Err(ScatterError::Deposit { at, problem });
    if deposit.place >= cells {
        return wrong(format!(
            "is for voxel {} of a grid of {cells}",
            deposit.place
        ));
    }
    if !deposit.energy.is_finite() || deposit.energy.min_element() < 0.0 {
        return wrong(format!(
            "has the energy {}: it has to be finite and not negative",
            deposit.energy
        ));
    }
    if !deposit.direction.is_finite() || deposit.direction.length() > 1.0 + 1e-5 {
        return wrong(format!(
            "has the direction {}: its length has to be 1 at most",
            deposit.direction
        ));
    }
    Ok(())
}

/// The same sums in f64, on the host.
pub fn sums_in_f64(cells: u32, deposits: &[Deposit]) -> Vec<[f64; 6]> {
    let mut sums = vec![[0.0; 6]; cells as usize];
    for deposit in deposits {
        let energy = deposit.energy.as_dvec3();
        let direction = deposit.direction.as_dvec3() * (energy.element_sum() / 3.0);
        let sum = &mut sums[deposit.place as usize];
        for (channel, value) in [energy.to_array(), direction.to_array()]
            .into_iter()
            .flatten()
            .enumerate()
        {
            sum[channel] += value;
        }
    }
    sums
}

//! Tracing of host rays: uploaded once, traced any number of times.

use super::{Ask, Query, RayBuffers, Traced, Tracer, TriangleBuffers};
use crate::{Counters, Hit, Ray};
use bytemuck::Pod;
use raystone_gpu::{Elapsed, Gpu, GpuError, Played, Player, Recording, Slices, Storage, wait_for};
use std::cell::Cell;

/// Fill word of the output before a trace; no answer of either query begins with it (as a distance
/// it is NaN), which exposes rays that a dispatch omits.
const POISON: u32 = 0xffff_dead;

/// Workgroups in a row of [`RayBatch::trace_in_rows`].
const NARROW_ROW: u32 = 3;

/// Rays of the first dispatch: few, as it may be brute force over a million triangles.
const FIRST_SLICE: u64 = 64;

/// Answers with the error word of the kernels.
pub struct Answers<T> {
    /// One per ray.
    pub answers: Vec<T>,
    /// The error word; 0 for none.
    pub errors: u32,
}

/// A tracer with rays on the device and a buffer for their answers.
pub struct RayBatch {
    tracer: Tracer,
    player: Player,
    buffers: RayBuffers,
    /// As large as the answers, copied over them before each trace.
    poison: Storage,
    rays: u32,
    /// Maximum workgroups in a row.
    row: Cell<u32>,
    slices: Slices,
}

impl Tracer {
    /// Uploads rays.
    ///
    /// # Errors
    /// The rays or their answers exceed the adapter's binding limit.
    pub fn batch(self, rays: &[Ray]) -> Result<RayBatch, GpuError> {
        let gpu = &self.gpu;
        let bytes_per_ray = if self.ask.counters { 32 } else { 16 };
        let answers = gpu.zeroed("answers", rays.len() as u64 * bytes_per_ray)?;
        let poison = gpu.storage("poison", &vec![POISON; answers.size() as usize / 4])?;
        let buffers = RayBuffers {
            rays: Storage::Own(gpu.storage("rays", rays)?),
            answers: Storage::Own(answers),
            status: Storage::Own(gpu.zeroed("status", 64)?),
        };
        Ok(RayBatch {
            player: Player::new(gpu),
            buffers,
            poison: Storage::Own(poison),
            rays: rays.len() as u32,
            row: Cell::new(u32::MAX),
            slices: Slices::starting_with(FIRST_SLICE)
                .at_least(FIRST_SLICE)
                .on(gpu),
            tracer: self,
        })
    }
}

impl RayBatch {
    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.tracer.gpu
    }

    /// The tracer.
    pub fn tracer(&self) -> &Tracer {
        &self.tracer
    }

    /// Traces all rays, in as many dispatches as needed to limit the time of each. Overwrites
    /// earlier answers before the clock starts, but not the error word. Times are sums over all
    /// passes.
    ///
    /// # Errors
    /// The device is lost, hangs, or the driver complains.
    pub fn trace(&self) -> Result<Elapsed, GpuError> {
        wait_for(self.trace_async())
    }

    /// The same as a future, as are all that end in `_async`: see [`Player::play_async`].
    ///
    /// # Errors
    /// As [`RayBatch::trace`].
    pub async fn trace_async(&self) -> Result<Elapsed, GpuError> {
        let mut total = Elapsed::nothing(self.tracer.gpu.has_clock());
        self.trace_slices(|played| total += played.elapsed())
            .await?;
        Ok(total)
    }

    /// Traces all rays, and passes on what each slice took.
    async fn trace_slices(&self, mut note: impl FnMut(Played)) -> Result<(), GpuError> {
        self.player.play_async(&self.wipe()).await?;
        let mut first = 0;
        while first < self.rays {
            let count = self.slices.next(first, self.rays);
            let played = self.play(first, count).await?;
            self.slices.learn(u64::from(count), played.elapsed());
            note(played);
            first += count;
        }
        Ok(())
    }

    /// [`RayBatch::trace`], with the milliseconds of each pass by its name, of all slices and in the order in which they first
    /// ran. These are of the same trace: the player marks each pass, whoever asks. None on an adapter without timestamps.
    ///
    /// # Errors
    /// As [`RayBatch::trace`].
    pub fn trace_by_pass(&self) -> Result<(Elapsed, Vec<(String, f64)>), GpuError> {
        let mut total = Elapsed::nothing(self.tracer.gpu.has_clock());
        let mut passes: Vec<(String, f64)> = Vec::new();
        let note = |played: Played| {
            total += played.elapsed();
            for (name, ms) in played.runs {
                let Some(ms) = ms else { continue };
                match passes.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, sum)) => *sum += ms,
                    None => passes.push((name, ms)),
                }
            }
        };
        wait_for(self.trace_slices(note))?;
        Ok((total, passes))
    }

    fn wipe(&self) -> Recording {
        let mut wipe = Recording::new();
        wipe.copy(&self.poison, &self.buffers.answers);
        wipe
    }

    /// Traces all rays `times` times in one submission, each time in one dispatch, and tells the time from the beginning
    /// of the first to the end of the last: for clocks that tick too coarsely for one. A trace must be known to be short.
    ///
    /// # Errors
    /// As [`RayBatch::trace`].
    pub async fn trace_times_async(&self, times: u32) -> Result<Elapsed, GpuError> {
        self.player.play_async(&self.wipe()).await?;
        let mut recording = Recording::new();
        for _ in 0..times {
            self.tracer
                .record(&mut recording, &self.buffers, 0..self.rays)?;
        }
        let played = self.player.play_async(&recording).await?;
        Ok(Elapsed {
            gpu_ms: played.gpu_span_ms,
            ..played.elapsed()
        })
    }

    /// Milliseconds of the longest slice so far: no dispatch took longer.
    pub fn longest_slice_ms(&self) -> f64 {
        self.slices.longest_ms()
    }

    /// Traces all rays again in dispatches with narrow rows of workgroups, in the same way that the
    /// row limit splits dispatches of millions of rays.
    ///
    /// # Errors
    /// The device is lost, hangs, or the driver complains.
    pub fn trace_in_rows(&self) -> Result<(), GpuError> {
        wait_for(self.trace_in_rows_async())
    }

    /// See [`RayBatch::trace_in_rows`].
    ///
    /// # Errors
    /// As [`RayBatch::trace_in_rows`].
    pub async fn trace_in_rows_async(&self) -> Result<(), GpuError> {
        self.row.set(NARROW_ROW);
        let traced = self.trace_async().await;
        self.row.set(u32::MAX);
        traced.map(|_| ())
    }

    /// A recording that traces nothing: the fixed cost of a measurement.
    ///
    /// # Errors
    /// The device is lost, hangs, or the driver complains.
    pub fn trace_nothing(&self) -> Result<Elapsed, GpuError> {
        wait_for(self.trace_nothing_async())
    }

    /// See [`RayBatch::trace_nothing`].
    ///
    /// # Errors
    /// As [`RayBatch::trace_nothing`].
    pub async fn trace_nothing_async(&self) -> Result<Elapsed, GpuError> {
        Ok(self.play(0, 0).await?.elapsed())
    }

    async fn play(&self, first: u32, count: u32) -> Result<Played, GpuError> {
        let mut recording = Recording::new();
        let (range, row) = (first..first + count, self.row.get());
        self.tracer
            .record_in_rows(&mut recording, &self.buffers, range, row)?;
        self.player.play_async(&recording).await
    }

    async fn read<T: Pod>(&self, buffer: &Storage) -> Result<Vec<T>, GpuError> {
        let mut recording = Recording::new();
        recording.download("", buffer);
        self.player.play_async(&recording).await?.download("")
    }

    /// Hits of the last trace of a closest-hit query.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn hits(&self) -> Result<Vec<Hit>, GpuError> {
        wait_for(self.hits_async())
    }

    /// See [`RayBatch::hits`].
    ///
    /// # Errors
    /// As [`RayBatch::hits`].
    pub async fn hits_async(&self) -> Result<Vec<Hit>, GpuError> {
        let mut hits: Vec<Hit> = self.read(&self.buffers.answers).await?;
        hits.truncate(self.rays as usize);
        Ok(hits)
    }

    /// Answers of the last trace of an any-hit query; `None` for a missing answer.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn found(&self) -> Result<Vec<Option<bool>>, GpuError> {
        wait_for(self.found_async())
    }

    /// See [`RayBatch::found`].
    ///
    /// # Errors
    /// As [`RayBatch::found`].
    pub async fn found_async(&self) -> Result<Vec<Option<bool>>, GpuError> {
        let words: Vec<[u32; 4]> = self.read(&self.buffers.answers).await?;
        let answer = |w: &[u32; 4]| (w[0] <= 1).then_some(w[0] == 1);
        Ok(words.iter().take(self.rays as usize).map(answer).collect())
    }

    /// Hash of the output of the last trace.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn digest(&self) -> Result<blake3::Hash, GpuError> {
        wait_for(self.digest_async())
    }

    /// See [`RayBatch::digest`].
    ///
    /// # Errors
    /// As [`RayBatch::digest`].
    pub async fn digest_async(&self) -> Result<blake3::Hash, GpuError> {
        Ok(blake3::hash(&self.read::<u8>(&self.buffers.answers).await?))
    }

    /// Counted work of the last trace, and the corresponding answers.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn work(&self) -> Result<(Vec<Counters>, Vec<Hit>), GpuError> {
        wait_for(self.work_async())
    }

    /// See [`RayBatch::work`].
    ///
    /// # Errors
    /// As [`RayBatch::work`].
    pub async fn work_async(&self) -> Result<(Vec<Counters>, Vec<Hit>), GpuError> {
        let words: Vec<[[u32; 4]; 2]> = self.read(&self.buffers.answers).await?;
        let counters =
            |&[nodes, box_tests, triangle_tests, stack_high_water]: &[u32; 4]| Counters {
                nodes,
                box_tests,
                triangle_tests,
                stack_high_water,
            };
        let of_rays = words.iter().take(self.rays as usize);
        Ok(of_rays
            .map(|[work, hit]| (counters(work), bytemuck::cast::<_, Hit>(*hit)))
            .unzip())
    }

    /// The error word of the kernels.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn error_word(&self) -> Result<u32, GpuError> {
        wait_for(self.error_word_async())
    }

    /// See [`RayBatch::error_word`].
    ///
    /// # Errors
    /// As [`RayBatch::error_word`].
    pub async fn error_word_async(&self) -> Result<u32, GpuError> {
        Ok(self.read::<u32>(&self.buffers.status).await?[0])
    }
}

/// Counted work of every ray, from separate kernels; `None` if the structure does not count work.
///
/// # Errors
/// A kernel does not compile, or the device is lost or hangs.
pub fn count_work(
    gpu: &Gpu,
    triangles: &TriangleBuffers,
    traced: &Traced,
    query: Query,
    rays: &[Ray],
) -> Result<Option<Vec<Counters>>, GpuError> {
    wait_for(count_work_async(gpu, triangles, traced, query, rays))
}

/// See [`count_work`].
///
/// # Errors
/// As [`count_work`].
pub async fn count_work_async(
    gpu: &Gpu,
    triangles: &TriangleBuffers,
    traced: &Traced,
    query: Query,
    rays: &[Ray],
) -> Result<Option<Vec<Counters>>, GpuError> {
    if !traced.passes.counts_work() {
        return Ok(None);
    }
    let ask = Ask {
        counters: true,
        ..query.into()
    };
    let batch = Tracer::new(gpu, triangles, traced, ask)?.batch(rays)?;
    batch.trace_async().await?;
    Ok(Some(batch.work_async().await?.0))
}

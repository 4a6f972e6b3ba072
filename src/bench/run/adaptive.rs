//! Adaptive sampling by tile: the first samples decide how many more each tile takes.

use super::error::Fault;
use super::reference::ReferenceImage;
use super::replicates::{
    Pass, Replicates, add_error, blank_record, check_finite, draw, replicate_s, replicates,
    same_at_once,
};
use super::session::Session;
use raystone_config::{Cell, StopRule};
use raystone_image::Image;
use raystone_record::{Body, ErrorRecord, Line};
use raystone_render::{BLOCK_EDGE, Snapshot};
use raystone_stats::adaptive::{LEAST_GROUP, Tiles, samples_needed, tile_error};

/// Groups of replicates, each of which decides for the other.
const GROUPS: usize = 2;
/// Replicates that tiles need to end on their own.
pub const LEAST_FOR_TILES: usize = GROUPS * LEAST_GROUP;

/// The records of all replicates, with no error yet.
fn blank_records(session: &Session, cell: &Cell) -> Result<Vec<ErrorRecord>, Fault> {
    let seeds = replicates(session, cell);
    if seeds.len() < LEAST_FOR_TILES {
        return Err(Fault::Cell(format!(
            "tiles are ended by what {LEAST_FOR_TILES} replicates or more say of each other, and there are {}: raise `run.replicates`",
            seeds.len()
        )));
    }
    let records = seeds.iter().map(|of| blank_record(session, cell, *of));
    Ok(records.collect())
}

/// Renders all replicates of one sampler, each tile with as many samples as it needs. Errors are
/// recorded at the mean number of samples per pixel.
pub(super) fn by_tile(
    session: &mut Session,
    cell: &Cell,
    reference_image: &ReferenceImage,
    pass: &Pass,
    line: &impl Fn(Body) -> Line,
    (rule, edge): (StopRule, u32),
) -> Result<Replicates, Fault> {
    let tiles = Tiles {
        size: session.experiment.run.resolution,
        edge,
    };
    let mut records = blank_records(session, cell)?;
    let mut images: Vec<Image> = Vec::new();
    let mut needed = vec![vec![pass.spps[0]; tiles.len()]; GROUPS];
    let mut done = 0;
    for (step, &spp) in pass.spps.iter().enumerate() {
        for (index, record) in records.iter().enumerate() {
            let needed = &needed[index % GROUPS];
            let further = || further(pass, tiles, needed, (done, spp), record.seed);
            let image = session.clock.time("gpu", further);
            let image = image.map_err(|e| e.to_string())?;
            match images.get_mut(index) {
                Some(before) => add(before, &image, tiles, needed, (done, spp)),
                None => images.push(image),
            }
            if (step, index) == (1, 0) {
                let at_once = || self::further(pass, tiles, needed, (0, spp), record.seed);
                let at_once = session.clock.time("gpu", at_once);
                let at_once = at_once.map_err(|e| e.to_string())?;
                let took = |pixel| needed[tiles.of_pixel(pixel)] >= spp;
                same_at_once([&images[0], &at_once], spp, took)?;
            }
        }
        if step == 0 {
            needed = decided(&images, tiles, &pass.spps, &rule);
        }
        done = spp;
        let mean = mean_samples(tiles, &needed, done);
        for (record, image) in records.iter_mut().zip(&images) {
            record.errors.retain(|at| at.spp < mean);
            let snapshot = Snapshot {
                spp: mean,
                image: image.clone(),
            };
            add_error(session, cell, reference_image, record, &snapshot, None)?;
            check_finite(session, cell, record, line)?;
        }
    }
    let spp = mean_samples(tiles, &needed, done);
    for (mut record, image) in records.into_iter().zip(&images) {
        record.stop = Some(rule);
        let snapshot = Snapshot {
            spp,
            image: image.clone(),
        };
        draw(session, cell, reference_image, &mut record, &snapshot)?;
        session.recorder.write(&line(Body::Error(record)))?;
        session.progress.add(replicate_s(session, cell));
    }
    Ok(Replicates { spp, images })
}

/// The samples that the tiles of each group need, decided by the other group.
fn decided(images: &[Image], tiles: Tiles, counts: &[u32], rule: &StopRule) -> Vec<Vec<u32>> {
    let of_group = |group: usize| {
        let others = images.iter().enumerate();
        let others = others.filter(|(index, _)| index % GROUPS != group);
        let others: Vec<&Image> = others.map(|(_, image)| image).collect();
        let needs = |tile| {
            let error = tile_error(&others, &tiles.pixels(tile));
            samples_needed(error.as_ref(), counts, rule.relmse, rule.confidence)
        };
        (0..tiles.len()).map(needs).collect()
    };
    (0..GROUPS).map(of_group).collect()
}

/// Mean of samples `done` to `spp` in the tiles that need them; black elsewhere.
fn further(
    pass: &Pass,
    tiles: Tiles,
    needed: &[u32],
    (done, spp): (u32, u32),
    seed: u32,
) -> Result<Image, raystone_gpu::GpuError> {
    let [columns, rows] = tiles.size.map(|pixels| pixels.div_ceil(BLOCK_EDGE));
    let all = (0..rows).flat_map(|y| (0..columns).map(move |x| [x, y]));
    let takes = |[x, y]: &[u32; 2]| {
        let pixel = (y * BLOCK_EDGE * tiles.size[0] + x * BLOCK_EDGE) as usize;
        needed[tiles.of_pixel(pixel)] >= spp
    };
    let blocks: Vec<[u32; 2]> = all.filter(takes).collect();
    pass.renderer.only(&blocks);
    pass.renderer.reset()?;
    if !blocks.is_empty() {
        pass.renderer.add_samples(done, spp - done, seed)?;
    }
    if blocks.is_empty() {
        Ok(Image {
            width: tiles.size[0],
            height: tiles.size[1],
            pixels: vec![[0.0; 3]; (tiles.size[0] * tiles.size[1]) as usize],
        })
    } else {
        pass.renderer.image()
    }
}

/// Combines the samples before `done` with those up to `spp`, in the tiles that took them.
fn add(before: &mut Image, new: &Image, tiles: Tiles, needed: &[u32], (done, spp): (u32, u32)) {
    let share = f64::from(done) / f64::from(spp);
    let pairs = before.pixels.iter_mut().zip(&new.pixels).enumerate();
    for (_, (old, new)) in pairs.filter(|(pixel, _)| needed[tiles.of_pixel(*pixel)] >= spp) {
        for (old, new) in old.iter_mut().zip(new) {
            *old = (share * f64::from(*old) + (1.0 - share) * f64::from(*new)) as f32;
        }
    }
}

/// Mean samples per pixel over the image and the groups, after the step to `done`; rounded.
fn mean_samples(tiles: Tiles, needed: &[Vec<u32>], done: u32) -> u32 {
    let taken = |tile: usize| {
        let of_groups = needed.iter().map(|of| f64::from(of[tile].min(done)));
        of_groups.sum::<f64>() * tiles.pixels(tile).len() as f64
    };
    let total: f64 = (0..tiles.len()).map(taken).sum();
    let [width, height] = tiles.size.map(f64::from);
    (total / (needed.len() as f64 * width * height))
        .round()
        .max(1.0) as u32
}

/// Tiles of known images: their samples, and that a group is ended by the images of the other.
///
/// # Errors
/// What is wrong.
pub(super) fn check() -> Result<(), String> {
    let tiles = Tiles {
        size: [16, 8],
        edge: 8,
    };
    let needed = [vec![4, 4], vec![16, 16]];
    let means = [8, 16].map(|done| mean_samples(tiles, &needed, done));
    let image = |seed: usize, contrast: f32| Image {
        width: 16,
        height: 8,
        pixels: (0..128)
            .map(|k| [1.0 + contrast * ((seed * 7 + k * 5) % 8) as f32; 3])
            .collect(),
    };
    let rule = StopRule {
        relmse: 0.02,
        confidence: 0.95,
        tile: Some(8),
    };
    let decided_with = |contrasts: [f32; GROUPS]| {
        let images = (0..4 * GROUPS).map(|k| image(k, contrasts[k % GROUPS]));
        decided(&images.collect::<Vec<_>>(), tiles, &[4, 8, 4096], &rule)
    };
    let (even, one_noisy) = (decided_with([1e-3; GROUPS]), decided_with([1e-3, 1.0]));
    let is_blind = even[0] == [4, 4] && one_noisy == [[4096, 4096], [4, 4]];
    if means == [6, 10] && is_blind {
        return Ok(());
    }
    Err(format!(
        "known tiles have {means:?} samples on average where they should have 6 and 10, and need {one_noisy:?}, of which the \
         first group is decided by the images of the second: this program ends tiles wrongly; build it anew, and report what \
         stays wrong"
    ))
}

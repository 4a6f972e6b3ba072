//! Verdicts and hashes of a run, as figures.

use super::taken::{Evidence, Taken};
use crate::data::{Measured, RunData};
use crate::samplers::MeasuredSampler;
use raystone_record::figure::{Better, Figure, Shown, Spread};
use raystone_record::*;
use raystone_stats::bias::BiasVerdict;

/// The id of the verdict of a structure's gate.
pub(crate) const GATE: &str = "gate/v1";

/// Returns verdicts and hashes of a run.
pub(super) fn facts(data: &RunData) -> Vec<Taken> {
    let mut all = Vec::new();
    for scene in &data.scenes {
        for s in scene.structures.iter().filter(|s| !s.refused) {
            let fault = s.fault();
            let text = fault.as_deref().unwrap_or("PASS");
            all.push(fact(&s.key, GATE, "gate", text, fault.is_some()));
        }
        for view in &scene.views {
            view.times.iter().for_each(|t| all.extend(of_cell(t)));
            view.samplers.iter().for_each(|s| all.extend(of_images(s)));
        }
        let peers = scene.peers.iter().map(|p| (p.key, &p.failure));
        let moving = scene.animations.iter().map(|a| (&a.key, &a.failure));
        all.extend(peers.chain(moving).map(of_failure));
    }
    all.extend(data.measured.iter().map(|cell| {
        let key = cell.key.clone().with(axis::SUBJECT, &cell.measurement);
        of_failure((&key, &cell.failure))
    }));
    all.extend(data.paths.iter().map(|p| {
        let text = p.fault.as_deref().unwrap_or(p.verdict().word());
        fact(
            p.key,
            "paths/v1",
            "paths of the integrator",
            text,
            p.fault.is_some(),
        )
    }));
    all.extend(data.failed.iter().map(|failed| {
        let key = Key::default().with(axis::SUBJECT, &failed.cell);
        fact(&key, "cell/v1", "cell", &failed.reason, true)
    }));
    all
}

fn of_failure((key, failure): (&Key, &Option<String>)) -> Taken {
    let text = failure.as_deref().unwrap_or("PASS");
    fact(key, "cell/v1", "cell", text, failure.is_some())
}

fn of_cell(time: &Measured<TimeRecord>) -> Vec<Taken> {
    let mut all = vec![of_failure((&time.key, &time.failure))];
    if !time.image_hash.is_empty() {
        let mut image = fact(&time.key, IMAGE, "image", &time.image_hash, false);
        image.work = format!("{} at {} spp", pixels(time.resolution), time.spp);
        all.push(image);
    }
    all
}

/// Id of the verdict on bias.
pub(super) const BIAS: &str = "bias/v1";

/// Id of the fact of an image: a hash, which may change intentionally.
pub(super) const IMAGE: &str = "image/v1";

/// The size of an image, in words.
pub(super) fn pixels([width, height]: [u32; 2]) -> String {
    format!("{width} × {height} pixels")
}

fn of_images(sampler: &MeasuredSampler) -> Vec<Taken> {
    let mut replicates = sampler.replicates.clone();
    replicates.sort_by_key(|r| r.seed);
    let hashes: Vec<&str> = replicates.iter().map(|r| r.image_hash.as_str()).collect();
    let drawn = replicates.iter().filter(|r| r.randomised);
    let seeds: Vec<String> = drawn.map(|r| r.seed.to_string()).collect();
    let bad: usize = replicates.iter().map(|r| r.non_finite_pixels).sum();
    let mut images = fact(
        &sampler.key,
        IMAGE,
        "images of the replicates",
        &hashes.join(" "),
        false,
    );
    let pixels = replicates
        .first()
        .map_or(String::new(), |r| pixels(r.resolution));
    images.work = match &seeds[..] {
        [] => pixels,
        seeds => format!("{pixels}, seeds {}", seeds.join(", ")),
    };
    let text = if bad == 0 {
        "PASS".into()
    } else {
        format!("{bad} NaN or infinite pixels")
    };
    let mut all = vec![fact(
        &sampler.key,
        "finite/v1",
        "finite pixels",
        &text,
        bad > 0,
    )];
    if !replicates.is_empty() {
        all.push(images);
    }
    all.extend(sampler.bias.as_ref().map(|bias| {
        let fails = bias.verdict == BiasVerdict::Biased && !bias.by_design;
        fact(&sampler.key, BIAS, "bias", &bias.verdict.to_string(), fails)
    }));
    all
}

/// Returns a figure that is a verdict or a hash.
pub(super) fn fact(
    key: &Key,
    id: &'static str,
    title: &'static str,
    text: &str,
    fails: bool,
) -> Taken {
    Taken {
        key: key.clone(),
        figure: Figure::new(id, title, "", Better::Neither, Shown::Count, Spread::Exact),
        shown: if id == IMAGE {
            text.chars().take(8).collect()
        } else {
            text.to_owned()
        },
        evidence: Evidence::Fact {
            text: text.to_owned(),
            fails,
        },
        work: String::new(),
        seed: None,
        kernel: String::new(),
    }
}

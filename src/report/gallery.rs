//! Records of many devices on one page: which structure is fastest where.
//!
//! Only what passed its gate has figures, and only whole folders stand on the page; what is left out is told with the reason.
//! Software adapters stand apart: their times compare structures, not devices.

use crate::data::grouped;
use crate::document::{Banner, Block, Document, Section, Table, TableCell, Tone};
use crate::format;
use raystone_config::{Axis, Cell};
use raystone_record::figure::MRAYS_PER_S;
use raystone_record::{
    Environment, Interval, Line, RayClass, Recorded, RunRecord, SceneRecord, StructureRecord,
    all_of, axis,
};
use serde_json::{Value as Json, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// A folder that was offered, with what was found in it.
pub struct Offer {
    /// The folder.
    pub dir: PathBuf,
    /// Its records, or why they do not count.
    pub lines: Result<Vec<Line>, String>,
}

/// What stands on the page.
#[derive(Default)]
pub struct Gallery {
    devices: Vec<Device>,
    /// What and why.
    left_out: Vec<[String; 2]>,
}

/// A device with what was measured on it in one run.
struct Device {
    name: String,
    about: String,
    version: String,
    clock: String,
    software: bool,
    scenes: Vec<Scene>,
}

struct Scene {
    name: String,
    triangles: usize,
    structures: Vec<Structure>,
}

struct Structure {
    name: String,
    /// Why it has no figures.
    fault: Option<String>,
    rates: BTreeMap<RayClass, Interval>,
}

impl Gallery {
    /// Sorts what was offered into devices and what is left out.
    pub fn new(offers: &[Offer]) -> Self {
        let mut gallery = Self::default();
        for offer in offers {
            let dir = offer.dir.display().to_string();
            match offer
                .lines
                .as_deref()
                .map_err(String::clone)
                .and_then(Device::of)
            {
                Ok(device) => {
                    gallery.left_out.extend(device.faults(&dir));
                    gallery.devices.push(device);
                }
                Err(reason) => gallery.left_out.push([dir, reason]),
            }
        }
        let key = |device: &Device| (device.software, device.name.to_lowercase());
        gallery.devices.sort_by_key(key);
        gallery
    }

    /// True if no folder counts.
    pub fn is_empty(&self) -> bool {
        self.devices.is_empty()
    }

    /// Returns the page.
    pub fn document(&self) -> Document {
        let (software, hardware): (Vec<_>, Vec<_>) = self.devices.iter().partition(|d| d.software);
        let mut document = Document {
            title: "Raystone: rays per second by device".into(),
            subtitle: self.counted(),
            ..Document::default()
        };
        let mut devices = Section::new("devices", "Devices");
        devices.blocks.push(Block::Paragraph(
            "Every structure gave the hits of the reference tracer on each device before it was timed. Figures are medians \
             with the 95 % interval of their order statistics; where a browser measured, of batches."
                .into(),
        ));
        devices.blocks.extend(self.table().into_block());
        document.sections.push(devices);
        document.sections.extend(sections(&hardware, ""));
        if !software.is_empty() {
            document.banners.push(Banner::new(
                Tone::Note,
                "Software adapters stand apart below: the processor stands in for a GPU, and their times compare structures only",
            ));
        }
        let apart = sections(&software, "software adapters: ");
        document.sections.extend(apart);
        let mut left_out = Section::new("left-out", "Left out");
        let rows = self.left_out.iter();
        let rows = rows.map(|of| of.each_ref().map(|text| text.as_str().into()));
        let table = Table::of("What does not count, and why", &["what", ":reason"], rows);
        left_out.blocks.extend(table.into_block());
        if !left_out.blocks.is_empty() {
            document.sections.push(left_out);
        }
        document
    }

    /// How many devices there are, and runs where some device has several.
    fn counted(&self) -> String {
        let named = self
            .devices
            .iter()
            .map(|device| (&device.name, &device.about));
        let devices = named.collect::<BTreeSet<_>>().len();
        let text = format::plural(devices, "device");
        match self.devices.len() {
            runs if runs == devices => text,
            runs => format!("{text}, {}", format::plural(runs, "run")),
        }
    }

    /// Returns the devices, a row for each run.
    pub fn table(&self) -> Table {
        let heads = ["adapter", ":of", ":version", ":clock", ":gate"];
        let row = |device: &Device| {
            [
                device.name.as_str().into(),
                device.about.as_str().into(),
                device.version.as_str().into(),
                device.clock.as_str().into(),
                device.gate(None),
            ]
        };
        Table::of("Devices", &heads, self.devices.iter().map(row))
    }

    /// Returns what was left out, in words.
    pub fn left_out(&self) -> impl Iterator<Item = String> {
        self.left_out
            .iter()
            .map(|[what, reason]| format!("{what}: {reason}"))
    }

    /// Returns devices and what was left out as JSON.
    pub fn json(&self) -> Json {
        let devices = self.devices.iter().map(|device| {
            json!({ "adapter": device.name, "version": device.version, "software": device.software })
        });
        let left_out = self.left_out.iter();
        let left_out = left_out.map(|[what, reason]| json!({ "what": what, "reason": reason }));
        json!({ "devices": devices.collect::<Vec<_>>(), "left_out": left_out.collect::<Vec<_>>() })
    }
}

impl Device {
    fn of(lines: &[Line]) -> Result<Self, String> {
        let run = all_of::<RunRecord>(lines).next();
        let environment = &run
            .ok_or("it does not say what measured it")?
            .body
            .environment;
        let scenes = grouped_structures(lines);
        if scenes.is_empty() {
            return Err("no structure was measured".into());
        }
        let of = environment;
        Ok(Self {
            name: match of.adapter.as_str() {
                "" => "not named by its browser".into(),
                name => name.into(),
            },
            about: about(of),
            version: match &of.commit {
                Some(commit) => format!("{} ({commit})", of.version),
                None => of.version.clone(),
            },
            clock: clock(of),
            software: of.software,
            scenes,
        })
    }

    fn faults(&self, dir: &str) -> Vec<[String; 2]> {
        let of_scene = |scene: &Scene| {
            let of = format!("{dir}: {}", scene.name);
            let faults = scene.structures.iter();
            let faults = faults.filter_map(|s| Some((&s.name, s.fault.as_ref()?)));
            faults
                .map(|(name, fault)| [format!("{of}, {name}"), fault.clone()])
                .collect::<Vec<_>>()
        };
        self.scenes.iter().flat_map(of_scene).collect()
    }

    /// How many structures passed, of one scene or of all.
    fn gate(&self, scene: Option<&str>) -> TableCell {
        let scenes = self.scenes.iter();
        let of = scenes.filter(|s| scene.is_none_or(|name| s.name == name));
        let structures: Vec<&Structure> = of.flat_map(|s| &s.structures).collect();
        let passed = structures.iter().filter(|s| s.fault.is_none()).count();
        let all = structures.len();
        let text = if passed == all {
            format!("{all} passed")
        } else {
            format!("{passed} of {all} passed")
        };
        TableCell::from(text).toned(if passed == all { Tone::Good } else { Tone::Bad })
    }

    fn scene(&self, name: &str) -> Option<&Scene> {
        self.scenes.iter().find(|scene| scene.name == name)
    }
}

/// The structures of all scenes, in the order of the records.
fn grouped_structures(lines: &[Line]) -> Vec<Scene> {
    let triangles: BTreeMap<&str, usize> = all_of::<SceneRecord>(lines)
        .map(|scene| (scene.key.label(axis::SCENE), scene.triangles))
        .collect();
    let all: Vec<Recorded<StructureRecord>> = all_of(lines).collect();
    let scenes = grouped(&all, |line| line.key.label(axis::SCENE).to_owned());
    let scene = |(name, lines): (String, Vec<&Recorded<StructureRecord>>)| Scene {
        triangles: triangles.get(name.as_str()).copied().unwrap_or_default(),
        structures: lines.into_iter().map(Structure::of).collect(),
        name,
    };
    scenes.into_iter().map(scene).collect()
}

impl Structure {
    fn of(line: &Recorded<StructureRecord>) -> Self {
        let fault = line.fault();
        let timings = line.timings.iter().filter(|_| fault.is_none());
        Self {
            name: Cell::from(line.key).labels(&[Axis::Accel]).join(", "),
            rates: timings
                .map(|timing| (timing.class, timing.mrays_s))
                .collect(),
            fault,
        }
    }
}

fn about(of: &Environment) -> String {
    match &of.browser {
        Some(browser) => browser.clone(),
        None => format!(
            "{}, {} {}, {}",
            of.backend, of.driver, of.driver_info, of.os
        ),
    }
}

fn clock(of: &Environment) -> String {
    match (of.timestamps, of.clock_step_ns) {
        (false, _) => "wall clock".into(),
        (true, None) => "GPU clock".into(),
        (true, Some(step)) => format!("GPU clock in steps of {} ns", format::count(step)),
    }
}

/// A section for each scene, with a table for each class of rays.
fn sections(devices: &[&Device], before: &str) -> Vec<Section> {
    let scenes: Vec<&Scene> = devices.iter().flat_map(|d| &d.scenes).collect();
    let scenes = grouped(&scenes, |scene| scene.name.clone());
    let section = |(name, scenes): (String, Vec<&&Scene>)| {
        let triangles = scenes.iter().map(|s| s.triangles).max().unwrap_or_default();
        let title = format!(
            "{before}{name}, {} triangles",
            format::count(triangles as u64)
        );
        let id = format!("{before}{name}").replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        let mut section = Section::new(id, title);
        let structures: Vec<&Structure> = scenes.iter().flat_map(|s| &s.structures).collect();
        let classes = structures.iter().flat_map(|s| s.rates.keys().copied());
        let classes: std::collections::BTreeSet<RayClass> = classes.collect();
        let tables = classes.into_iter();
        let tables = tables.map(|class| table(devices, &name, &structures, class));
        section.blocks.extend(tables.filter_map(Table::into_block));
        section
    };
    let sections = scenes.into_iter().map(section);
    sections
        .filter(|section| !section.blocks.is_empty())
        .collect()
}

/// Devices down, structures across.
fn table(devices: &[&Device], scene: &str, structures: &[&Structure], class: RayClass) -> Table {
    let mut names: Vec<&str> = Vec::new();
    for structure in structures {
        if !names.contains(&structure.name.as_str()) {
            names.push(&structure.name);
        }
    }
    let caption = format!("{}: {}", class.name(), MRAYS_PER_S.heading());
    let mut table = Table::new(caption, &["adapter", ":version", ":gate"]);
    names.iter().for_each(|name| table.add_column(*name));
    for device in devices {
        let Some(measured) = device.scene(scene) else {
            continue;
        };
        let mut row = vec![
            TableCell::from(&*device.name),
            TableCell::from(&*device.version),
            device.gate(Some(scene)),
        ];
        let rate = |name: &&str| {
            let structure = measured.structures.iter().find(|s| s.name == **name);
            structure.and_then(|s| s.rates.get(&class)).copied()
        };
        let rates: Vec<Option<Interval>> = names.iter().map(rate).collect();
        let most = rates.iter().flatten().map(|rate| rate.value);
        let most = most.fold(f64::NEG_INFINITY, f64::max);
        row.extend(rates.iter().map(|rate| match rate {
            Some(rate) if rate.value == most => rate_cell(rate).toned(Tone::Good),
            Some(rate) => rate_cell(rate),
            None => TableCell::from("–"),
        }));
        table.rows.push(row);
    }
    table
}

fn rate_cell(rate: &Interval) -> TableCell {
    TableCell::with_detail(
        format::figure(&MRAYS_PER_S, rate.value),
        format::bounds(rate),
    )
}

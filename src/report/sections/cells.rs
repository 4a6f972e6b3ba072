//! Every cell: its key, its kernels, its figures, and the command that repeats it.

use crate::compare::side::EMBEDDED;
use crate::data::RunData;
use crate::document::*;
use crate::format;
use crate::values::Value;
use raystone_config::Axis;
use raystone_record::{Key, Ran, axis};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Cells that the page itself holds; more are in a file of their own.
pub(crate) const MOST_INSIDE: usize = 200;
/// That file.
pub const FILE: &str = "cells.html";
/// Digits of a hash that distinguish two kernels.
const SHORT_HASH: usize = 16;

/// All cells of a run, in the order of their values.
pub struct Cells<'a> {
    values: &'a [Value<'a>],
    found: Vec<Cell<'a>>,
}

struct Cell<'a> {
    key: Key,
    /// The key by labels that no other cell fits.
    alone: Key,
    ran: Option<&'a Ran>,
    values: Vec<&'a Value<'a>>,
}

/// Returns the axes that a cell is chosen by; the rest of a key distinguishes its figures.
fn of_cell(key: &Key) -> Key {
    let axes = Axis::ALL.map(Axis::name);
    key.only(&axes)
}

/// Returns the anchor of the cell that a key belongs to.
fn anchor(key: &Key) -> String {
    let hash = blake3::hash(key.to_string().as_bytes()).to_hex();
    format!("cell-{}", &hash[..12])
}

impl<'a> Cells<'a> {
    /// Returns the cells of these values.
    pub fn new(data: &RunData<'a>, values: &'a [Value<'a>]) -> Self {
        let mut ran: HashMap<String, &Ran> = HashMap::new();
        for scene in &data.scenes {
            for s in &scene.structures {
                ran.insert(of_cell(&s.key).to_string(), s.ran);
            }
            for time in scene.views.iter().flat_map(|view| &view.times) {
                ran.insert(of_cell(&time.key).to_string(), time.ran);
            }
        }
        let mut places: HashMap<String, usize> = HashMap::new();
        let mut found: Vec<Cell> = Vec::new();
        for value in values {
            let key = of_cell(&value.key);
            if key.is_empty() {
                continue;
            }
            let name = key.to_string();
            let place = *places.entry(name.clone()).or_insert_with(|| {
                let ran = ran.get(&name).copied();
                found.push(Cell {
                    alone: key.clone(),
                    key,
                    ran,
                    values: Vec::new(),
                });
                found.len() - 1
            });
            found[place].values.push(value);
        }
        // A failure has no figure, but a key.
        let views = data.scenes.iter().flat_map(|scene| &scene.views);
        for time in views.flat_map(|view| &view.times) {
            let key = of_cell(&time.key);
            if !places.contains_key(&key.to_string()) {
                found.push(Cell {
                    alone: key.clone(),
                    key,
                    ran: Some(time.ran),
                    values: Vec::new(),
                });
            }
        }
        tell_apart(&mut found);
        Self { values, found }
    }

    /// Returns the address of the cell of a key.
    pub fn link(&self, key: &Key) -> String {
        let file = if self.is_inside() { "" } else { FILE };
        format!("{file}#{}", anchor(&of_cell(key)))
    }

    /// Returns `true` if all of them are in the page itself.
    fn is_inside(&self) -> bool {
        self.found.len() <= MOST_INSIDE
    }

    /// Returns the values of all cells.
    pub(crate) fn values(&self) -> &'a [Value<'a>] {
        self.values
    }

    /// Returns the section of the page: the cells, or where they are.
    pub fn section(&self, data: &RunData) -> Option<Section> {
        if self.found.is_empty() {
            return None;
        }
        let mut section = Section::new("cells", "Every cell, and how to repeat it");
        if self.is_inside() {
            section.blocks = self.blocks(data)
        } else {
            section.blocks.push(Block::Paragraph(format!(
                "{} stand in {FILE} beside this page: what each is, which kernel ran, its figures, and the command that \
                 repeats it.",
                format::plural(self.found.len(), "cell")
            )))
        }
        Some(section)
    }

    /// Returns the page of the cells, where there are too many for the other.
    pub fn document(&self, data: &RunData) -> Option<Document> {
        let mut section = Section::new("cells", "Every cell, and how to repeat it");
        section.blocks = self.blocks(data);
        let name = data.run.map(|run| format!("Cells of {}", run.name));
        (!self.is_inside()).then(|| Document {
            title: name.unwrap_or("Cells".into()),
            subtitle: format::plural(self.found.len(), "cell"),
            sections: vec![section],
            ..Document::default()
        })
    }

    fn blocks(&self, data: &RunData) -> Vec<Block> {
        self.found.iter().map(|cell| cell.fold(data)).collect()
    }
}

impl Cell<'_> {
    fn fold(&self, data: &RunData) -> Block {
        // Several axes may be `auto`.
        let labels = self.key.labels().map(|(axis, label)| match label {
            "auto" => format!("{axis} auto"),
            label => label.to_owned(),
        });
        let mut blocks = Vec::new();
        let of_kernel = self.ran.into_iter().flat_map(|ran| {
            let hash = ran.kernel_hash.chars().take(SHORT_HASH).collect();
            let (inside, left_out) = (ran.features.join(", "), ran.left_out.join(", "));
            [
                ("kernel", hash),
                ("features in it", inside),
                ("features left out", left_out),
            ]
        });
        let of_key = self.key.labels();
        let of_key = of_key.map(|(axis, label)| (axis, label.to_owned()));
        let facts = of_key.chain(of_kernel.filter(|(_, text)| !text.is_empty()));
        let facts = facts.map(|(what, text)| [what.into(), text.into()]);
        blocks.extend(Table::of("What it is", &["axis", ":value"], facts).into_block());
        if let Some(run) = data.run {
            let command = command(&run.experiment, &run.experiment_text, &self.alone);
            blocks.push(Block::Verbatim(command));
        }
        blocks.extend(self.figures().into_block());
        Block::Fold(Fold {
            id: anchor(&self.key),
            title: labels.collect::<Vec<_>>().join(" · "),
            note: format::plural(self.values.len(), "figure"),
            blocks,
            ..Fold::default()
        })
    }

    fn figures(&self) -> Table {
        let row = |value: &&Value| {
            let labels = value.key.labels();
            let further: BTreeMap<&str, &str> = labels
                .filter(|(axis, _)| Axis::from_name(axis).is_none())
                .collect();
            let of = |(axis, label): (&&str, &&str)| match *axis {
                axis::RAYS | axis::SUBJECT => (*label).to_owned(),
                axis => format!("{axis} {label}"),
            };
            let of: Vec<String> = further.iter().map(of).collect();
            let (title, unit) = (&*value.figure.title, &*value.figure.unit);
            [
                title.into(),
                of.join(", ").into(),
                value.cell(),
                unit.into(),
            ]
        };
        let heads = ["figure", ":of", "value", ":unit"];
        Table::of("What was found", &heads, self.values.iter().map(row))
    }
}

/// Cells whose labels are the names of others, too, get labels that fit them alone: `bvh()` beside `bvh(leaf_size=2)`, and the
/// embedded kernels beside others.
fn tell_apart(cells: &mut [Cell]) {
    let labels = cells.iter().flat_map(|cell| cell.key.labels());
    let labels: BTreeSet<(String, String)> = labels
        .map(|(axis, label)| (axis.to_owned(), checked(label).to_owned()))
        .collect();
    let has_kernels = labels.iter().any(|(axis, _)| axis == axis::KERNELS);
    let has_variants = |axis: &str, name: &str| {
        let begin = format!("{name}(");
        let mut others = labels.iter().filter(|(other, _)| other == axis);
        others.any(|(_, label)| label.starts_with(&begin))
    };
    for cell in cells {
        for (axis, label) in cell.key.labels() {
            if has_variants(axis, checked(label)) {
                let alone = cell.alone.clone();
                cell.alone = alone.with(axis, format!("{}()", checked(label)));
            }
        }
        if has_kernels && cell.key.label(axis::KERNELS).is_empty() {
            cell.alone = cell.alone.clone().with(axis::KERNELS, EMBEDDED);
        }
    }
}

/// Returns a label as an experiment names it.
fn checked(label: &str) -> &str {
    label.strip_suffix(" (unchecked)").unwrap_or(label)
}

/// Returns the command that repeats a cell: names with special characters of patterns or shells are replaced by
/// patterns that match them.
fn command(file: &str, text: &str, key: &Key) -> String {
    let mut command = format!("raystone run {}", quoted(file));
    let sets = text
        .lines()
        .filter_map(|line| line.strip_prefix("# --set "));
    for set in sets {
        command += &format!(" --set {}", quoted(&visible(set)));
    }
    let of = |(axis, label): (&str, &str)| format!("{axis}={}", pattern(checked(label)));
    let only = key.labels().map(of);
    let only: Vec<String> = only.collect();
    command + &format!(" --only {}", quoted(&only.join(",")))
}

/// Returns a pattern of `--only` that matches a label.
fn pattern(label: &str) -> String {
    let mut depth = 0usize;
    let plain = |(i, c): (usize, char)| {
        match c {
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        let separates = c == ',' && depth == 0;
        let negates = c == '!' && i == 0;
        if separates || negates || !is_visible(c) {
            '*'
        } else {
            c
        }
    };
    label.chars().enumerate().map(plain).collect()
}

/// Returns `true` if a character is visible as itself, and does not change the direction of text.
fn is_visible(c: char) -> bool {
    let turns = matches!(c, '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}');
    !c.is_control() && !turns
}

fn visible(text: &str) -> String {
    text.chars().filter(|c| is_visible(*c)).collect()
}

/// Quotes one word for a POSIX shell.
fn quoted(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:@%+".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text.to_owned()
    } else {
        format!("'{}'", visible(text).replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_repeats_its_cell_alone() {
        let cell = |accel: &str, kernels: Option<&str>| {
            let key = Key::default()
                .with(axis::SCENE, "box")
                .with(axis::ACCEL, accel);
            let key = match kernels {
                Some(label) => key.with(axis::KERNELS, label),
                None => key,
            };
            Cell {
                alone: key.clone(),
                key,
                ran: None,
                values: Vec::new(),
            }
        };
        let only = |mut cells: Vec<Cell>| {
            tell_apart(&mut cells);
            let line = |cell: &Cell| command("a.toml", "", &cell.alone);
            let lines = cells.iter().map(line);
            lines
                .map(|line| line.replace("raystone run a.toml --only ", ""))
                .collect::<Vec<_>>()
        };
        assert_eq!(
            only(vec![
                cell("bvh (unchecked)", None),
                cell("bvh(leaf_size=2) (unchecked)", None),
                cell("bvh4", Some("idea"))
            ]),
            [
                "'scene=box,accel=bvh(),kernels=embedded'",
                "'scene=box,accel=bvh(leaf_size=2),kernels=embedded'",
                "scene=box,accel=bvh4,kernels=idea"
            ]
        );
        assert_eq!(only(vec![cell("bvh", None)]), ["scene=box,accel=bvh"]);
    }

    #[test]
    fn a_command_is_one_line_whatever_stands_in_names() {
        let key = Key::default()
            .with(axis::SCENE, "a'; rm -rf ~\n\u{202e}.obj")
            .with(axis::ACCEL, "!grid(a=1,b=2),x");
        let text = "[run]\n# --set run.replicates=4\n";
        let line = command("my file.toml", text, &key);
        assert_eq!(
            line,
            r"raystone run 'my file.toml' --set run.replicates=4 --only 'scene=a'\''; rm -rf ~**.obj,accel=*grid(a=1,b=2)*x'"
        );
        assert_eq!(
            command("a.toml", "", &Key::default().with(axis::ACCEL, "bvh")),
            "raystone run a.toml --only accel=bvh"
        );
    }
}

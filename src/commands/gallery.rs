//! `raystone gallery`.

use super::failure::ended;
use super::output::{OutputArguments, screen, warn};
use anyhow::Result;
use clap::Args;
use raystone::measure::record::read_records;
use raystone::report::gallery::{Gallery, Offer};
use raystone::report::write_page;
use raystone::run::{Inventory, Registries, records_in};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Make a page of the records of many devices, by scene and class of rays; what does not hold is left out with the reason
#[derive(Args)]
pub struct GalleryOf {
    /// Folders with records.jsonl, which runs wrote or the web page; one a device
    #[arg(required = true)]
    dirs: Vec<PathBuf>,
    /// Folder for the page
    #[arg(long, short, value_name = "SITE")]
    out: PathBuf,
    #[command(flatten)]
    output: OutputArguments,
}

impl GalleryOf {
    pub fn execute(self) -> Result<ExitCode> {
        let registries = raystone::registries();
        let dirs = self.dirs.into_iter().map(|dir| records_in(&dir));
        let offers = dirs.map(|dir| Offer {
            lines: fault(&dir, &registries).map_or_else(
                || read_records(&dir).map_or_else(|e| Err(e.to_string()), |r| Ok(r.lines)),
                Err,
            ),
            dir,
        });
        let gallery = Gallery::new(&offers.collect::<Vec<_>>());
        for reason in gallery.left_out() {
            warn(&format!("left out: {reason}"));
        }
        let page = write_page(&self.out, &mut gallery.document())?.0;
        let mut fields = gallery.json();
        fields["page"] = json!(page);
        let text = format!(
            "{}\npage: {}\n",
            screen().table(&gallery.table()),
            page.display()
        );
        self.output.show("gallery", fields, &text)?;
        Ok(ended(!gallery.is_empty()))
    }
}

/// Why the records of a folder do not count: `raystone inspect` finds them damaged, unfinished or contradicted.
fn fault(dir: &Path, registries: &Registries) -> Option<String> {
    let inventory = match Inventory::read(dir, registries) {
        Ok(inventory) => inventory,
        Err(error) => return Some(error.to_string()),
    };
    let missing = inventory.missing().count();
    if let Some(reason) = &inventory.interrupted {
        return Some(format!("the run ended early: {reason}"));
    }
    if missing > 0 {
        let all = inventory.states.len();
        return Some(format!("{missing} of {all} cells are missing"));
    }
    let contradicted = inventory.contradicted.first();
    let contradicted =
        contradicted.map(|name| format!("{name} was measured twice with different inputs"));
    contradicted.or_else(|| inventory.warnings.first().cloned())
}

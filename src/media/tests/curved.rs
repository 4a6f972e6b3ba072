//! Photons that are refracted.

use super::measure::pipeline_run;

#[test]
fn explore() {
    let folder = tempfile::tempdir().unwrap();
    for content in ["fog", "ball", "cube", "lens"] {
        for (side, photons) in [(12, 48), (32, 128)] {
            let start = std::time::Instant::now();
            let load = format!("photons = {photons}\ncontent = \"{content}\"").replace("SIDE", "");
            let (failed, reason) = pipeline_run_side(folder.path(), side, &load);
            println!("{content} {side}: {failed} {reason} {:?}", start.elapsed());
        }
    }
}

fn pipeline_run_side(folder: &std::path::Path, side: u32, load: &str) -> (usize, String) {
    let load = format!("strategy = \"fixed-64\"\n{load}");
    super::measure::pipeline_run_of(folder, "", side, &load)
}

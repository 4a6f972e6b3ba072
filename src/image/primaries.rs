//! The primaries that a file of linear colours names.

use std::io::{BufReader, Read as _};
use std::path::Path;

/// x and y of red, green, blue and white: those of Rec. 709, in which colours are counted.
const REC_709: [f32; 8] = [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290];

/// Largest difference that names the same primaries: Radiance's own have 0.29 and an equal-energy
/// white.
const SAME: f32 = 0.025;

/// Bytes in which a header ends.
const HEADER: u64 = 1 << 16;

/// The primaries of an OpenEXR or Radiance file (x and y of red, green, blue and white) where they
/// are not those of Rec. 709. [`read_linear`](super::read_linear) does not convert them.
pub fn other_primaries(path: &Path) -> Option<[f32; 8]> {
    let start = start_of(path)?;
    let ending = path.extension()?.to_ascii_lowercase();
    let found = match ending.to_str()? {
        "hdr" => of_radiance(&start),
        #[cfg(feature = "exr")]
        "exr" => of_exr(&start),
        _ => None,
    }?;
    let mut pairs = found.iter().zip(REC_709);
    (!pairs.all(|(x, known)| (x - known).abs() <= SAME)).then_some(found)
}

/// Says so where the colours of a file have [other primaries](other_primaries) than those that they are taken for.
pub fn primaries_note(path: &Path) -> Option<String> {
    let [rx, ry, gx, gy, bx, by, wx, wy] = other_primaries(path)?;
    Some(format!(
        "{}: its colours have the primaries ({rx}, {ry}), ({gx}, {gy}), ({bx}, {by}) and the white ({wx}, {wy}); they are \
         taken for those of Rec. 709",
        path.display()
    ))
}

/// True for an OpenEXR file whose `envmap` says that it has the six sides of a cube, as `exrenvmap` writes by default.
#[cfg(feature = "exr")]
pub fn is_cube_map(path: &Path) -> bool {
    let is_exr = path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("exr"));
    let meta = start_of(path)
        .filter(|_| is_exr)
        .and_then(|start| exr::meta::MetaData::read_from_buffered(&start[..], false).ok());
    let map = meta.and_then(|meta| meta.headers.first()?.own_attributes.environment_map);
    map == Some(exr::meta::attribute::EnvironmentMap::Cube)
}

/// OpenEXR files are not read.
#[cfg(not(feature = "exr"))]
pub fn is_cube_map(_: &Path) -> bool {
    false
}

/// The bytes in which a header is.
fn start_of(path: &Path) -> Option<Vec<u8>> {
    let (file, _) = raystone_core::files::files().open(path).ok()?;
    let mut start = Vec::new();
    let mut reader = BufReader::new(file).take(HEADER);
    reader.read_to_end(&mut start).ok()?;
    Some(start)
}

fn of_radiance(start: &[u8]) -> Option<[f32; 8]> {
    let text = String::from_utf8_lossy(start);
    let header = text
        .lines()
        .map(str::trim)
        .take_while(|line| !line.is_empty());
    let values = header.filter_map(|line| {
        line.strip_prefix("PRIMARIES")?
            .trim_start()
            .strip_prefix('=')
    });
    let numbers = values
        .last()?
        .split_whitespace()
        .map_while(|word| word.parse().ok());
    numbers.collect::<Vec<f32>>().try_into().ok()
}

#[cfg(feature = "exr")]
fn of_exr(start: &[u8]) -> Option<[f32; 8]> {
    let meta = exr::meta::MetaData::read_from_buffered(start, false).ok()?;
    let named = meta.headers.first()?.shared_attributes.chromaticities?;
    let [red, green, blue, white] = [named.red, named.green, named.blue, named.white];
    Some([
        red.0, red.1, green.0, green.1, blue.0, blue.1, white.0, white.1,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str, bytes: &[u8]) -> Option<[f32; 8]> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        other_primaries(&path)
    }

    #[test]
    fn primaries_of_other_spaces_are_found_and_those_of_rec_709_are_not() {
        let file = |line: &str| format!("#?RADIANCE\n{line}FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n");
        let aces = [0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767];
        let words = aces.map(|x: f32| x.to_string()).join(" ");
        for (line, expected) in [
            ("", None),
            (
                "PRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333\n",
                None,
            ),
            ("PRIMARIES= 0.64 0.33\n", None),
            (&format!("PRIMARIES = {words}\n"), Some(aces)),
        ] {
            assert_eq!(of("a.hdr", file(line).as_bytes()), expected, "{line}");
        }
        assert_eq!(of("a.pfm", file(&words).as_bytes()), None);
        assert_eq!(of("a.exr", b"short"), None);
    }

    #[cfg(feature = "exr")]
    #[test]
    fn cube_maps_of_exr_are_told_from_others() {
        use exr::meta::attribute::EnvironmentMap::{Cube, LatitudeLongitude};
        use exr::prelude::*;
        let folder = tempfile::tempdir().unwrap();
        for (kind, expected) in [
            (None, false),
            (Some(LatitudeLongitude), false),
            (Some(Cube), true),
        ] {
            let pixel = |_| (1.0_f32, 1.0_f32, 1.0_f32);
            let mut image = Image::from_channels((2, 12), SpecificChannels::rgb(pixel));
            image.layer_data.attributes.environment_map = kind;
            let path = folder.path().join("a.exr");
            image.write().to_file(&path).unwrap();
            assert_eq!(is_cube_map(&path), expected, "{kind:?}");
        }
    }

    #[cfg(feature = "exr")]
    #[test]
    fn chromaticities_of_exr_are_read() {
        use exr::prelude::*;
        let wide = [0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329];
        let written = |named: Option<[f32; 8]>| {
            let pixel = |_| (1.0_f32, 1.0_f32, 1.0_f32);
            let mut image = Image::from_channels((1, 1), SpecificChannels::rgb(pixel));
            image.attributes.chromaticities = named.map(|v| attribute::Chromaticities {
                red: Vec2(v[0], v[1]),
                green: Vec2(v[2], v[3]),
                blue: Vec2(v[4], v[5]),
                white: Vec2(v[6], v[7]),
            });
            let mut bytes = std::io::Cursor::new(Vec::new());
            image.write().to_buffered(&mut bytes).unwrap();
            bytes.into_inner()
        };
        assert_eq!(of("a.exr", &written(None)), None);
        assert_eq!(of("a.exr", &written(Some(REC_709))), None);
        assert_eq!(of("a.exr", &written(Some(wide))), Some(wide));
    }
}

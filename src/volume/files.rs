//! Volumes from files: raw arrays of NumPy and grids of Mitsuba.

use crate::MediaError;
use glam::DVec3;
use raystone_core::files;
use raystone_image::read_npy_array;
use std::path::Path;

/// One quantity on a grid, as a file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Voxels along x, y, z.
    pub resolution: [u32; 3],
    /// Values, x fastest.
    pub values: Vec<f32>,
    /// The corners of its box, where the file says so.
    pub corners: Option<[DVec3; 2]>,
}

/// Reads a grid by the ending of the file's name: `.npy` with an array `[z, y, x]` or `[z, y, x, 1]` of
/// numbers, or Mitsuba's `.vol` with
/// one channel.
///
/// # Errors
/// It cannot be opened, has another format, another number of dimensions or channels, or ends early.
pub fn read_grid(path: &Path) -> Result<Grid, MediaError> {
    let failed = |problem: String| MediaError::Read {
        path: path.to_owned(),
        problem,
    };
    let bytes = files::read(path).map_err(|e| failed(e.to_string()))?;
    let ending = path.extension().and_then(|ending| ending.to_str());
    match ending.map(str::to_ascii_lowercase).as_deref() {
        Some("npy") => from_npy(&bytes),
        Some("vol") => from_vol(&bytes),
        _ => Err("its name ends in neither `.npy` nor `.vol`".to_owned()),
    }
    .map_err(failed)
}

fn from_npy(bytes: &[u8]) -> Result<Grid, String> {
    let (shape, values) = read_npy_array(bytes)?;
    let (&[z, y, x] | &[z, y, x, 1]) = shape.as_slice() else {
        return Err(format!("its shape is {shape:?}, not [z, y, x]"));
    };
    let axis = |n: u64| u32::try_from(n).map_err(|_| format!("{n} voxels along an axis"));
    Ok(Grid {
        resolution: [axis(x)?, axis(y)?, axis(z)?],
        values,
        corners: None,
    })
}

/// The binary grids of Mitsuba 0.6 and 3: `VOL`, version 3, type, resolution, channels, box, values with x fastest.
fn from_vol(bytes: &[u8]) -> Result<Grid, String> {
    const HEADER: usize = 48;
    let (header, data) = (bytes.split_at_checked(HEADER)).ok_or("it ends within its header")?;
    if !header.starts_with(b"VOL\x03") {
        return Err("it does not begin with `VOL` and the version 3".to_owned());
    }
    let word = |at: usize| [0, 1, 2, 3].map(|k| header[at + k]);
    let whole = |at: usize| i32::from_le_bytes(word(at));
    let real = |at: usize| f64::from(f32::from_le_bytes(word(at)));
    let corner = |at: usize| DVec3::new(real(at), real(at + 4), real(at + 8));
    let (kind, channels) = (whole(4), whole(20));
    if channels != 1 {
        return Err(format!("it has {channels} channels, not one"));
    }
    let axis = |at: usize| {
        let n = whole(at);
        u32::try_from(n).map_err(|_| format!("{n} voxels along an axis"))
    };
    let resolution = [axis(8)?, axis(12)?, axis(16)?];
    let each = match kind {
        1 => 4,
        2 => 2,
        _ => 1,
    };
    if data.len() % each != 0 {
        let length = data.len();
        return Err(format!("{length} bytes of values of {each} bytes each"));
    }
    let values: Vec<f32> = match kind {
        1 => (data.as_chunks().0.iter())
            .map(|b| f32::from_le_bytes(*b))
            .collect(),
        2 => (data.as_chunks().0.iter())
            .map(|b| half::f16::from_le_bytes(*b).to_f32())
            .collect(),
        3 => data.iter().map(|b| f32::from(*b) / 255.0).collect(),
        _ => return Err(format!("its values are of type {kind}, not 1, 2 or 3")),
    };
    // Three numbers of 31 bits.
    let expected: u128 = resolution.iter().map(|n| u128::from(*n)).product();
    if values.len() as u128 != expected {
        return Err(format!(
            "{} values where {resolution:?} voxels have {expected}",
            values.len()
        ));
    }
    Ok(Grid {
        resolution,
        values,
        corners: Some([corner(24), corner(36)]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, bytes: &[u8]) -> Result<Grid, MediaError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        read_grid(&path)
    }

    fn vol(kind: i32, channels: i32, data: &[u8]) -> Vec<u8> {
        vol_of([3, 2, 1], kind, channels, data)
    }

    fn vol_of([x, y, z]: [i32; 3], kind: i32, channels: i32, data: &[u8]) -> Vec<u8> {
        let mut out = b"VOL\x03".to_vec();
        for word in [kind, x, y, z, channels] {
            out.extend(word.to_le_bytes());
        }
        for real in [0.0_f32, 0.0, 0.0, 3.0, 2.0, 1.0] {
            out.extend(real.to_le_bytes());
        }
        out.extend(data);
        out
    }

    fn npy(shape: &str, data: &[f32]) -> Vec<u8> {
        let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({shape}), }}\n");
        let mut out = b"\x93NUMPY\x01\x00".to_vec();
        out.extend((header.len() as u16).to_le_bytes());
        out.extend(header.as_bytes());
        out.extend(bytemuck::cast_slice(data));
        out
    }

    #[test]
    fn grids_read_with_x_fastest() {
        let values = [0.0_f32, 1.0, 2.0, 3.0, 4.0, 5.0];
        let read_npy = read("a.npy", &npy("1, 2, 3", &values)).unwrap();
        assert_eq!(
            (read_npy.resolution, &*read_npy.values),
            ([3, 2, 1], &values[..])
        );
        let with_channel = read("a.npy", &npy("1, 2, 3, 1", &values)).unwrap();
        assert_eq!(with_channel, read_npy);
        let read_vol = read("a.VOL", &vol(1, 1, bytemuck::cast_slice(&values))).unwrap();
        assert_eq!(
            (read_vol.resolution, &*read_vol.values),
            ([3, 2, 1], &values[..])
        );
        assert_eq!(
            read_vol.corners,
            Some([DVec3::ZERO, DVec3::new(3.0, 2.0, 1.0)])
        );
        let bytes = read("b.vol", &vol(3, 1, &[0, 255, 51, 0, 0, 0])).unwrap();
        assert_eq!(&bytes.values[..3], [0.0, 1.0, 0.2]);
        let halves: Vec<u8> = values
            .iter()
            .flat_map(|v| half::f16::from_f32(*v).to_le_bytes())
            .collect();
        assert_eq!(read("c.vol", &vol(2, 1, &halves)).unwrap().values, values);
    }

    #[test]
    fn what_is_no_grid_is_refused_with_the_reason() {
        let refused = |name: &str, bytes: &[u8]| read(name, bytes).unwrap_err().to_string();
        let values = [0.0_f32; 6];
        let data: &[u8] = bytemuck::cast_slice(&values);
        for (bytes, reason) in [
            (vol(1, 3, data), "3 channels"),
            (vol(4, 1, data), "type 4"),
            (vol(1, 1, &data[..20]), "5 values"),
            (vol(1, 1, &data[..23]), "23 bytes"),
            // 2^64 voxels.
            (vol_of([1 << 22, 1 << 22, 1 << 20], 1, 1, &[]), "0 values"),
            (vol_of([-1, 1, 1], 1, 1, data), "-1 voxels"),
            (b"VOL\x03".to_vec(), "within its header"),
            ([b"GRD\x03", &[0; 44][..]].concat(), "`VOL`"),
        ] {
            let message = refused("a.vol", &bytes);
            assert!(message.contains(reason), "{message}");
        }
        assert!(refused("a.npy", &npy("2, 3", &values)).contains("[z, y, x]"));
        assert!(refused("a.npy", &npy("1, 2, 4", &values)).contains("bytes"));
        assert!(refused("a.raw", data).contains("neither"));
        assert!(read_grid(Path::new("/nothing/a.vol")).is_err());
    }
}

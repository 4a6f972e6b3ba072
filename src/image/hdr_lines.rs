//! Scan lines of Radiance files: pixel by pixel, with runs of equal ones, or component by component with runs of each
//! (Radiance, `color.c`).

use std::ops::RangeInclusive;

/// Lengths of scan lines that Radiance codes component by component.
const BY_COMPONENTS: RangeInclusive<usize> = 8..=0x7fff;

/// Red, green, blue and exponent.
type Pixel = [u8; 4];

const ENDS: &str = "it ends before its last pixel";
const BEYOND: &str = "a run goes beyond its end";

/// The pixels behind the header, line by line.
///
/// # Errors
/// The data ends, or the line that is wrong.
pub(super) fn pixels(data: &[u8], [width, height]: [u32; 2]) -> Result<Vec<Pixel>, String> {
    let mut rest = data;
    let mut pixels = Vec::new();
    let mut line = vec![[0; 4]; width as usize];
    for number in 1..=height {
        read_line(&mut rest, &mut line).map_err(|problem| match problem.as_str() {
            ENDS => problem,
            _ => format!("line {number} of its pixels: {problem}"),
        })?;
        pixels.extend_from_slice(&line);
    }
    Ok(pixels)
}

/// The value of each colour of a pixel.
pub(super) fn radiance([r, g, b, exponent]: Pixel) -> [f32; 3] {
    let unit = match exponent {
        0 => 0.0,
        _ => 2.0_f64.powi(i32::from(exponent) - 136),
    };
    [r, g, b].map(|mantissa| (f64::from(mantissa) * unit) as f32)
}

fn read_line(rest: &mut &[u8], line: &mut [Pixel]) -> Result<(), String> {
    let Some(&[2, 2, high @ 0..128, low]) = rest.first_chunk() else {
        return by_pixels(rest, line);
    };
    let length = usize::from(u16::from_be_bytes([high, low]));
    if length == line.len() {
        *rest = &rest[4..];
        return by_components(rest, line);
    }
    // In other lines these four bytes are a pixel.
    if !BY_COMPONENTS.contains(&line.len()) {
        return by_pixels(rest, line);
    }
    let width = line.len();
    Err(format!(
        "it has {length} of them, and the image is {width} wide"
    ))
}

fn by_components(rest: &mut &[u8], line: &mut [Pixel]) -> Result<(), String> {
    for component in 0..4 {
        let mut at = 0;
        while at < line.len() {
            let code = take(rest, 1)?[0];
            let (count, is_run) = match code {
                129.. => (usize::from(code) - 128, true),
                _ => (usize::from(code), false),
            };
            let part = line.get_mut(at..at + count).ok_or(BEYOND)?;
            let values = take(rest, if is_run { 1 } else { count })?;
            for (pixel, value) in part.iter_mut().zip(values.iter().cycle()) {
                pixel[component] = *value;
            }
            at += count;
        }
    }
    Ok(())
}

fn by_pixels(rest: &mut &[u8], line: &mut [Pixel]) -> Result<(), String> {
    let (mut at, mut shift) = (0, 0);
    while at < line.len() {
        let pixel: Pixel = take(rest, 4)?.try_into().map_err(|_| ENDS)?;
        if let [1, 1, 1, count] = pixel {
            let before = at
                .checked_sub(1)
                .ok_or("it begins with a run, before which there is no pixel")?;
            let last = line[before];
            // Runs behind runs count the next eight bits.
            let end = usize::try_from(at as u64 + (u64::from(count) << shift));
            let run = line.get_mut(at..end.map_err(|_| BEYOND)?);
            let run = run.ok_or(BEYOND)?;
            run.fill(last);
            (at, shift) = (at + run.len(), 32.min(shift + 8));
        } else {
            line[at] = pixel;
            (at, shift) = (at + 1, 0);
        }
    }
    Ok(())
}

fn take<'a>(rest: &mut &'a [u8], count: usize) -> Result<&'a [u8], String> {
    let (taken, after) = rest.split_at_checked(count).ok_or(ENDS)?;
    *rest = after;
    Ok(taken)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: Pixel = [200, 2, 3, 130];
    const GREY: Pixel = [128, 128, 128, 129];

    /// A line whose components are one run each.
    fn even(marked: [u8; 2], run: u8, pixel: Pixel) -> Vec<u8> {
        let runs = pixel.into_iter().flat_map(|value| [128 + run, value]);
        [2, 2].into_iter().chain(marked).chain(runs).collect()
    }

    #[test]
    fn all_codings_give_the_same_pixels() {
        let long: Vec<u8> = [GREY, RED, [1, 1, 1, 43], [1, 1, 1, 1]].concat();
        let mut expected = vec![RED; 301];
        expected[0] = GREY;
        assert_eq!(pixels(&long, [301, 1]).unwrap(), expected);
        let lines = [even([0, 9], 9, RED), [RED; 9].concat(), {
            let literal = |value| [vec![8], vec![value; 8], vec![129, value]].concat();
            [
                vec![2, 2, 0, 9],
                RED.into_iter().flat_map(literal).collect(),
            ]
            .concat()
        }];
        assert_eq!(pixels(&lines.concat(), [9, 3]).unwrap(), [RED; 27]);
    }

    #[test]
    fn a_pixel_that_looks_like_the_mark_of_a_coding_is_one_where_it_cannot_be_that() {
        let dark: Pixel = [2, 2, 10, 129];
        for width in [1, 7, 40_000] {
            let line = vec![dark; width as usize];
            let data = line.concat();
            assert_eq!(pixels(&data, [width, 1]).unwrap(), line, "{width}");
        }
        assert_eq!(pixels(&even([0, 4], 4, RED), [4, 1]).unwrap(), [RED; 4]);
    }

    #[test]
    fn lines_of_another_length_are_refused_and_not_read_as_others() {
        // Eight of the sixteen in each run: its second half would be taken for the next component.
        let half = |value| [136, value, 136, value];
        let sixteen = [vec![2, 2, 0, 16], RED.into_iter().flat_map(half).collect()].concat();
        for (data, width, problem) in [
            (
                &sixteen[..],
                8,
                "it has 16 of them, and the image is 8 wide",
            ),
            (&even([0, 8], 9, RED), 8, BEYOND),
            (&[RED, [1, 1, 1, 8]].concat(), 8, BEYOND),
            (&[[1, 1, 1, 8]].concat(), 8, "begins with a run"),
            (&[RED; 7].concat(), 8, ENDS),
            (&even([0, 8], 8, RED)[..9], 8, ENDS),
            (&[], 8, ENDS),
        ] {
            let found = pixels(data, [width, 1]).unwrap_err();
            assert!(found.contains(problem), "{found}");
            assert!(
                problem == ENDS || found.starts_with("line 1 of its pixels: "),
                "{found}"
            );
        }
    }

    #[test]
    fn the_exponent_scales_all_three() {
        assert_eq!(radiance(GREY), [1.0; 3]);
        assert_eq!(radiance([255, 1, 0, 0]), [0.0; 3]);
        assert_eq!(
            radiance([255, 1, 0, 1]),
            [255.0 * 2.0_f32.powi(-135), 2.0_f32.powi(-135), 0.0]
        );
        assert_eq!(radiance([255, 0, 0, 255])[0], 255.0 * 2.0_f32.powi(119));
    }
}

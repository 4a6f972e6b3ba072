//! Parser for LM-63.

use super::{IesProfile, Photometry};
use crate::obj_statements::number;
use thiserror::Error;

/// Errors of reading a photometric file.
#[derive(Debug, Error)]
pub enum IesError {
    /// The operating system could not read the file.
    #[error(
        "{file}: cannot read the photometric file ({source}); check the path and its permissions"
    )]
    Read {
        /// The file.
        file: String,
        /// The reason.
        source: std::io::Error,
    },
    /// The content violates LM-63.
    #[error(
        "{file}, line {line}: {problem}; repair the file or ask the maker of the luminaire for another"
    )]
    Malformed {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The problem.
        problem: String,
    },
}

/// Limit on the number of angles and intensities.
const MOST_ANGLES: usize = 10_000;
/// Tolerance for equal angles, degrees.
pub(super) const SAME: f32 = 1e-3;

/// The numbers after `TILT=`, with their lines.
struct Numbers<'a> {
    file: &'a str,
    words: Vec<(usize, &'a str)>,
    next: usize,
    last_line: usize,
    /// True if commas stand between digits.
    has_commas: bool,
}

impl<'a> Numbers<'a> {
    fn error(&self, line: usize, problem: impl Into<String>) -> IesError {
        let mut problem = problem.into();
        if self.has_commas {
            problem += " (commas separate numbers here; write decimals with a point)";
        }
        IesError::Malformed {
            file: self.file.to_owned(),
            line,
            problem,
        }
    }

    fn line(&self) -> usize {
        let read = self.next.saturating_sub(1);
        self.words
            .get(read)
            .map_or(self.last_line, |(line, _)| *line)
    }

    fn here(&self, problem: impl Into<String>) -> IesError {
        self.error(self.line(), problem)
    }

    fn number(&mut self, what: &str) -> Result<f64, IesError> {
        let Some((line, word)) = self.words.get(self.next) else {
            return Err(self.error(
                self.last_line,
                format!("the file ends where {what} should be"),
            ));
        };
        self.next += 1;
        match number::<f64>(word) {
            Some(x) if (x as f32).is_finite() => Ok(x),
            _ => Err(self.error(*line, format!("{what} should be a number, not `{word}`"))),
        }
    }

    fn count(&mut self, what: &str) -> Result<usize, IesError> {
        let x = self.number(what)?;
        if x >= 1.0 && x <= MOST_ANGLES as f64 && x.fract() == 0.0 {
            Ok(x as usize)
        } else {
            Err(self.here(format!(
                "{what} is {x}, not an integer from 1 to {MOST_ANGLES}"
            )))
        }
    }

    fn list(&mut self, count: usize, what: &str) -> Result<Vec<f32>, IesError> {
        let one = |k| {
            let number = self.number(&format!("{what} {} of {count}", k + 1));
            number.map(|x| x as f32)
        };
        (0..count).map(one).collect()
    }

    fn angles(&mut self, count: usize, what: &str) -> Result<Vec<f32>, IesError> {
        let angles = self.list(count, what)?;
        match angles.windows(2).find(|pair| pair[1] <= pair[0]) {
            None => Ok(angles),
            Some(pair) => Err(self.here(format!(
                "{what}s must ascend, but {} follows {}",
                pair[1], pair[0]
            ))),
        }
    }
}

impl IesProfile {
    /// Parses the text of a file called `file`.
    ///
    /// # Errors
    /// The text violates the standard: names the line and the problem.
    pub fn parse(file: &str, text: &str) -> Result<Self, IesError> {
        let malformed = |line, problem: String| IesError::Malformed {
            file: file.to_owned(),
            line,
            problem,
        };
        let lines: Vec<&str> = text.lines().collect();
        let Some((tilt, value)) = (0..)
            .zip(&lines)
            .find_map(|(k, line)| Some((k, tilt(line)?)))
        else {
            let problem = "there is no line `TILT=`: this is no LM-63 file".to_owned();
            return Err(malformed(lines.len().max(1), problem));
        };
        let separators = |c: char| c.is_whitespace() || c == ',';
        let words = (tilt + 2..)
            .zip(&lines[tilt + 1..])
            .flat_map(|(line, text)| {
                let words = text.split(separators).filter(|word| !word.is_empty());
                words.map(move |word| (line, word))
            });
        let mut numbers = Numbers {
            file,
            words: words.collect(),
            next: 0,
            last_line: lines.len(),
            has_commas: lines[tilt + 1..].iter().any(|line| has_comma(line)),
        };
        let value = value.to_ascii_uppercase();
        if value == "INCLUDE" {
            skip_tilt(&mut numbers)?;
        }
        let mut found = profile(file, year(&lines[..tilt]), &mut numbers)?;
        if value != "NONE" {
            found.warnings.push(format!(
                "{file}, line {}: factors for tilted lamps are not read; the luminaire shines as measured",
                tilt + 1
            ));
        }
        Ok(found)
    }
}

/// True if a comma stands between two digits.
fn has_comma(line: &str) -> bool {
    let is_digit = |c: Option<&u8>| c.is_some_and(u8::is_ascii_digit);
    line.as_bytes()
        .array_windows()
        .any(|[a, comma, b]| *comma == b',' && is_digit(Some(a)) && is_digit(Some(b)))
}

/// The value of `TILT=`, which ends the labels; those of 1986 are free text.
fn tilt(line: &str) -> Option<&str> {
    let (name, value) = line.split_once('=')?;
    let is_tilt = name.trim().eq_ignore_ascii_case("TILT");
    is_tilt.then(|| value.trim())
}

/// The year of the standard in the first line, such as `IESNA91`, `IESNA:LM-63-2002` or
/// `IES:LM-63-2019`; 1986, which has no such line, if there is none.
fn year(labels: &[&str]) -> u32 {
    const FIRST: u32 = 1986;
    let first = labels.iter().find(|line| !line.trim().is_empty());
    let first = first.map_or(String::new(), |line| line.trim().to_ascii_uppercase());
    let behind = |mark: &str| first.split_once(mark).map(|(_, rest)| rest);
    let digits = first.strip_prefix("IESNA").and_then(|rest| {
        let is_short = rest.starts_with(|c: char| c.is_ascii_digit());
        is_short.then_some(rest)
    });
    let Some(digits) = digits.or_else(|| behind("LM-63-")) else {
        return FIRST;
    };
    let end = digits.find(|c: char| !c.is_ascii_digit());
    match digits[..end.unwrap_or(digits.len())].parse() {
        Ok(year @ 86..100) => 1900 + year,
        Ok(year @ 0..86) => 2000 + year,
        Ok(year) => year,
        Err(_) => FIRST,
    }
}

/// First year in which the number between ballast factor and watts is not the ballast-lamp factor.
/// LM-63-1995 and LM-63-2002 reserve it; in LM-63-2019 it states the origin (1.1: laboratory).
const NO_LAMP_FACTOR: u32 = 1995;
/// First year in which it states how the file was made.
const GENERATION_TYPE: u32 = 2019;

/// Skips the factors for tilted lamps.
fn skip_tilt(numbers: &mut Numbers) -> Result<(), IesError> {
    numbers.number("the lamp-to-luminaire geometry")?;
    let pairs = numbers.count("the number of tilt angles")?;
    numbers.angles(pairs, "tilt angle")?;
    numbers.list(pairs, "tilt factor")?;
    Ok(())
}

/// Reads which angles the file's are.
fn photometry(numbers: &mut Numbers) -> Result<Photometry, IesError> {
    match numbers.number("the photometric type")? {
        1.0 => Ok(Photometry::C),
        2.0 => Ok(Photometry::B),
        3.0 => Ok(Photometry::A),
        other => Err(numbers.here(format!("the photometric type is {other}, not 1, 2 or 3"))),
    }
}

/// Reads the candela values of so many horizontal and vertical angles, times a factor.
fn candela(
    numbers: &mut Numbers,
    [horizontal, vertical]: [usize; 2],
    factor: f64,
) -> Result<Vec<f32>, IesError> {
    // The counts promise more than a file may hold.
    let mut candela = Vec::new();
    for _ in 0..horizontal {
        for value in numbers.list(vertical, "candela value")? {
            if value < 0.0 {
                return Err(numbers.here(format!("the candela value {value} is below 0")));
            }
            let intensity = (f64::from(value) * factor) as f32;
            if !intensity.is_finite() {
                return Err(numbers.here(format!("{value} times {factor} candela is no number")));
            }
            candela.push(intensity);
        }
    }
    Ok(candela)
}

fn profile(file: &str, year: u32, numbers: &mut Numbers) -> Result<IesProfile, IesError> {
    let lamps = numbers.number("the number of lamps")?;
    let lumens = numbers.number("the lumens per lamp")?;
    let multiplier = numbers.number("the candela multiplier")?;
    let vertical_count = numbers.count("the number of vertical angles")?;
    let horizontal_count = numbers.count("the number of horizontal angles")?;
    let photometry = photometry(numbers)?;
    let unit = numbers.number("the unit of length")?;
    let opening = opening(unit, numbers)?;
    let ballast = numbers.number("the ballast factor")?;
    let third = numbers.number("the number behind the ballast factor")?;
    let third_line = numbers.line();
    // A factor of 0 would be no light: it is the reserved number, under a label of another year or none.
    let is_factor = year < NO_LAMP_FACTOR && third != 0.0;
    let ballast_lamp = if is_factor { third } else { 1.0 };
    let factor = multiplier * ballast * ballast_lamp;
    if factor <= 0.0 {
        return Err(numbers.here(format!(
            "its factors multiply to {factor}, which is not above 0"
        )));
    }
    let input_watts = numbers.number("the input watts")?;
    let vertical = numbers.angles(vertical_count, "vertical angle")?;
    check_vertical(photometry, &vertical).map_err(|problem| numbers.here(problem))?;
    let horizontal = numbers.angles(horizontal_count, "horizontal angle")?;
    let last_angle = numbers.line();
    let candela = candela(numbers, [horizontal_count, vertical_count], factor)?;
    let mut warnings: Vec<String> = opening.into_iter().collect();
    if (NO_LAMP_FACTOR..GENERATION_TYPE).contains(&year) && third != 1.0 {
        warnings.push(format!(
            "{file}, line {third_line}: the number behind the ballast factor is {third}; LM-63-{year} keeps it for future use, so it is not read"
        ));
    }
    if photometry != Photometry::C && is(vertical[0], 0.0) {
        warnings.push(format!(
            "{file}, line {last_angle}: the vertical angles of a luminaire of type A or B begin at 0: nothing is known of those below, which stay dark"
        ));
    }
    if candela.iter().all(|candela| *candela == 0.0) {
        let line = numbers.line();
        warnings.push(format!(
            "{file}, line {line}: all candela values are 0: the luminaire gives no light"
        ));
    }
    if let Some((line, word)) = numbers.words.get(numbers.next) {
        warnings.push(format!(
            "{file}, line {line}: `{word}` and what follows stands behind the last candela value and is not read"
        ));
    }
    let mut out = IesProfile {
        name: file.to_owned(),
        photometry,
        vertical,
        horizontal,
        candela,
        rated_lumens: (lumens > 0.0).then_some(lumens * lamps),
        input_watts,
        warnings,
    };
    out.unfold(last_angle)
        .map_err(|problem| numbers.error(last_angle, problem))?;
    Ok(out)
}

/// Reads the luminous opening, and says that it is not drawn if it has an extent.
fn opening(unit: f64, numbers: &mut Numbers) -> Result<Option<String>, IesError> {
    let [width, length, height] = ["the width", "the length", "the height"];
    let sides = [
        numbers.number(width)?,
        numbers.number(length)?,
        numbers.number(height)?,
    ];
    let unit = if unit == 1.0 { "feet" } else { "metres" };
    // Negative numbers tell round openings.
    let [width, length, height] = sides.map(f64::abs);
    Ok(sides.iter().any(|side| *side != 0.0).then(|| {
        format!(
            "{}, line {}: the luminous opening of {width} × {length} × {height} {unit} is not drawn; all light comes from one point",
            numbers.file,
            numbers.line()
        )
    }))
}

pub(super) fn is(a: f32, b: f32) -> bool {
    (a - b).abs() < SAME
}

fn check_vertical(photometry: Photometry, angles: &[f32]) -> Result<(), String> {
    let (first, last) = (angles[0], angles[angles.len() - 1]);
    let (starts, ends): (&[f32], &[f32]) = match photometry {
        Photometry::C => (&[0.0, 90.0], &[90.0, 180.0]),
        _ => (&[-90.0, 0.0, -last], &[90.0]),
    };
    // In practice, files of luminaires that shine only slightly upwards are truncated.
    // Beams of floodlights are, too.
    let fits = starts.iter().any(|s| is(*s, first)) && last <= ends[ends.len() - 1] + SAME;
    if fits && last > first {
        Ok(())
    } else {
        Err(format!(
            "vertical angles from {first} to {last} are none of the standard"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(tilt: &str, kind: u32, horizontal: &str, candela: &str) -> String {
        let count = horizontal.split(' ').count();
        format!(
            "IESNA:LM-63-2002\n[TEST] none\nTILT={tilt}\n1 1000 2.0 3 {count} {kind} 2 0 0 0\n0.5 1 40\n0 45 90\n{horizontal}\n{candela}\n"
        )
    }

    #[test]
    fn symmetric_ranges_are_unfolded() {
        let read = |horizontal: &str, candela: &str| {
            IesProfile::parse("x.ies", &file("NONE", 1, horizontal, candela)).expect("a profile")
        };
        let axial = read("0", "5 4 3");
        assert_eq!(
            (axial.horizontal, axial.candela),
            (vec![0.0], vec![5.0, 4.0, 3.0])
        );
        let quadrant = read("0 45 90", "5 1 1 5 2 2 5 3 3");
        assert_eq!(
            quadrant.horizontal,
            [0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0, 360.0]
        );
        let at_45: Vec<f32> = quadrant.candela.chunks(3).map(|c| c[1]).collect();
        assert_eq!(at_45, [1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 2.0, 1.0]);
        let half = read("0 90 180", "5 1 1 5 2 2 5 3 3");
        assert_eq!(half.horizontal, [0.0, 90.0, 180.0, 270.0, 360.0]);
        let other = read("90 180 270", "5 1 1 5 2 2 5 3 3");
        let at_45: Vec<f32> = other.candela.chunks(3).map(|c| c[1]).collect();
        assert_eq!(other.horizontal, [0.0, 90.0, 180.0, 270.0, 360.0]);
        assert_eq!(at_45, [2.0, 1.0, 2.0, 3.0, 2.0]);
        // What is given at 330° and at 90° is a quarter of the way from the first to the second at 0°.
        let uneven = read("-90 -30 90", "5 4 4 5 2 2 5 6 6");
        let at_45: Vec<f32> = uneven.candela.chunks(3).map(|c| c[1]).collect();
        assert_eq!(uneven.horizontal, [0.0, 90.0, 210.0, 270.0, 330.0, 360.0]);
        assert_eq!(at_45, [3.0, 6.0, 2.0, 4.0, 2.0, 3.0]);
        let open = read("0 90 180 270", "5 1 1 5 2 2 5 3 3 5 4 4");
        assert_eq!((open.horizontal[4], open.candela[13]), (360.0, 1.0));
        assert_eq!(open.warnings.len(), 1);
        assert_eq!(open.rated_lumens, Some(1000.0));
    }

    #[test]
    fn tilt_factors_are_skipped_and_factors_multiplied() {
        let text = file("INCLUDE\n1\n2\n0 90\n1 0.9", 2, "0 90", "2 1 0 2 1 0");
        let found = IesProfile::parse("x.ies", &text).expect("a profile");
        let elsewhere = file("lamp.tlt", 2, "0 90", "2 1 0 2 1 0");
        let elsewhere = IesProfile::parse("x.ies", &elsewhere).expect("a profile");
        assert_eq!(found.candela, elsewhere.candela);
        assert_eq!(found.warnings.len(), elsewhere.warnings.len());
        assert!(
            found
                .warnings
                .iter()
                .any(|note| note.starts_with("x.ies, line 3: ")),
            "{found:?}"
        );
        assert_eq!(found.horizontal, [-90.0, 0.0, 90.0]);
        assert_eq!((found.candela[0], found.input_watts), (2.0, 40.0));
    }

    #[test]
    fn the_first_line_says_what_the_numbers_of_the_ballast_mean() {
        // Candela multiplier 2, ballast factor 0.5, then 0.9; 100 straight down, 50 at 45 degrees.
        let read = |labels: &str| {
            let text = format!(
                "{labels}TILT=NONE\n1 1000 2 3 1 1 2 0 0 0\n0.5 0.9 40\n0 45 90\n0\n100 50 0\n"
            );
            IesProfile::parse("x.ies", &text).expect("a profile")
        };
        for (labels, down) in [
            // Ballast-lamp factor until 1991: 100 · 2 · 0.5 · 0.9.
            ("", 90.0),
            ("own measurement 12\nTILTED DOWNLIGHT, WHITE\n", 90.0),
            ("IESNA91\n[TEST] own\n", 90.0),
            ("IESNA:LM-63-1986\n", 90.0),
            ("iesna:lm-63-1991\n", 90.0),
            // Reserved, and since 2019 how the file was made: 100 · 2 · 0.5.
            ("IESNA:LM-63-1995\n[TEST] own\n", 100.0),
            ("IESNA:LM-63-2002\n", 100.0),
            ("\nIESNA:LM-63-02\n", 100.0),
            ("IES:LM-63-2019\n", 100.0),
            ("IES:LM-63-19 \n", 100.0),
        ] {
            let found = read(labels);
            let at = |degrees: f64| {
                let (sin, cos) = degrees.to_radians().sin_cos();
                found.intensity(glam::DVec3::new(sin, 0.0, cos))
            };
            for (degrees, expected) in [(0.0, down), (22.5, 0.75 * down), (45.0, 0.5 * down)] {
                let error = at(degrees) - expected;
                assert!(error.abs() < 1e-4, "{labels:?} {degrees}: {}", at(degrees));
            }
            let is_named = labels.contains("1995") || labels.contains("02");
            assert_eq!(found.warnings.len(), usize::from(is_named), "{labels:?}");
        }
    }

    #[test]
    fn only_tilt_ends_the_labels_and_what_is_left_over_is_named() {
        let good = file("none", 1, "0 90", "5 1 1 5 2 2");
        let odd = good.replacen("[TEST] none", "TILTED, 45 = steep\ntilt", 1);
        let found = IesProfile::parse("x.ies", &odd.replacen("TILT=", " Tilt = ", 1));
        assert_eq!(found.expect("a profile").warnings, [""; 0]);
        let more = IesProfile::parse("x.ies", &format!("{good}7 8\n"));
        let told = more.expect("a profile").warnings.join("; ");
        assert!(told.contains("line 9") && told.contains("`7`"), "{told}");
    }

    #[test]
    fn errors_name_file_and_line() {
        let good = file("NONE", 1, "0 90", "5 1 1 5 2 2");
        for (from, to, line, what) in [
            ("TILT=NONE", "no tilt", 8, "TILT"),
            ("0.5 1 40", "1,0 1,0 40", 6, "with a point"),
            ("1000", "many", 4, "`many`"),
            (" 1 2 0 0 0", " 4 2 0 0 0", 4, "photometric type"),
            ("0 45 90", "0 45 45", 6, "ascend"),
            ("0 45 90", "0 45 200", 6, "vertical"),
            ("\n0 90\n", "\n0 80\n", 7, "horizontal"),
            ("5 2 2", "5 2", 8, "candela value 3 of 3"),
            ("5 2 2", "5 -2 2", 8, "below 0"),
            ("1000 2.0", "1000 0", 5, "not above 0"),
            ("1000 2.0", "1000 nan", 4, "`nan`"),
            ("2.0 3 2", "2.0 3.5 2", 4, "integer"),
        ] {
            assert!(good.contains(from), "{from}");
            let error = IesProfile::parse("x.ies", &good.replacen(from, to, 1));
            let text = error.expect_err(to).to_string();
            let place = format!("x.ies, line {line}: ");
            assert!(
                text.starts_with(&place) && text.contains(what),
                "{to}: {text}"
            );
        }
    }
}

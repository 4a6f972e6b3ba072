//! Point sets in the unit cube, and their text format.

use super::DiscrepancyError;

/// N points in `[0, 1]^d`, N ≥ 1, d ≥ 1. Repeated points count repeatedly.
#[derive(Debug, Clone, PartialEq)]
pub struct PointSet {
    dim: usize,
    coordinates: Vec<f64>,
}

impl PointSet {
    /// Points of `dim` coordinates, stored consecutively.
    ///
    /// # Errors
    /// No point, an incomplete point, or a coordinate that is NaN or outside `[0, 1]`.
    pub fn new(dim: usize, coordinates: Vec<f64>) -> Result<Self, DiscrepancyError> {
        if dim == 0 || !coordinates.len().is_multiple_of(dim) {
            let count = coordinates.len();
            return Err(DiscrepancyError::Ragged { count, dim });
        }
        if coordinates.is_empty() {
            return Err(DiscrepancyError::Empty);
        }
        match coordinates.iter().position(|c| !(0.0..=1.0).contains(c)) {
            None => Ok(Self { dim, coordinates }),
            Some(at) => {
                let index = at / dim;
                let point = coordinates[index * dim..][..dim].to_vec();
                Err(DiscrepancyError::Outside { index, point })
            }
        }
    }

    /// Points given one by one, all of `D` coordinates.
    ///
    /// # Errors
    /// As [`PointSet::new`].
    pub fn from_points<const D: usize>(points: &[[f64; D]]) -> Result<Self, DiscrepancyError> {
        Self::new(D, points.as_flattened().to_vec())
    }

    /// Parses one point per line, with coordinates separated by blanks, commas or tabs. Empty lines
    /// are skipped, and so is the rest of a line after `#`.
    ///
    /// # Errors
    /// [`DiscrepancyError::Line`] for the first line that is not a point of as many coordinates as
    /// those before it, all in `[0, 1]`; [`DiscrepancyError::Empty`] if there is no point.
    pub fn parse(text: &str) -> Result<Self, DiscrepancyError> {
        // Accepts all line endings, and the byte order mark of some editors.
        let text = text.trim_start_matches('\u{feff}');
        let text = text.replace("\r\n", "\n").replace('\r', "\n");
        let mut dim = 0;
        let mut coordinates = Vec::new();
        for (index, content) in text.lines().enumerate() {
            let refuse = |reason: String| DiscrepancyError::Line {
                line: index + 1,
                reason,
            };
            let before = coordinates.len();
            let content = content.split('#').next().unwrap_or_default();
            if has_decimal_commas(content) {
                let reason =
                    "commas within and blanks between numbers: write decimals with a point";
                return Err(refuse(reason.to_owned()));
            }
            for word in words(content) {
                coordinates.push(coordinate(word).map_err(refuse)?);
            }
            let found = coordinates.len() - before;
            if found == 0 {
                continue;
            }
            if dim == 0 {
                dim = found;
            } else if found != dim {
                let reason = format!("{found} coordinates, but the lines before have {dim}");
                return Err(refuse(reason));
            }
        }
        if coordinates.is_empty() {
            return Err(DiscrepancyError::Empty);
        }
        Self::new(dim, coordinates)
    }

    /// Number of points.
    #[expect(clippy::len_without_is_empty, reason = "a set is never empty")]
    pub fn len(&self) -> usize {
        self.coordinates.len() / self.dim
    }

    /// Number of dimensions.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// The points in order, each a slice of [`PointSet::dim`] coordinates.
    pub fn points(&self) -> impl ExactSizeIterator<Item = &[f64]> + Clone {
        self.coordinates.chunks_exact(self.dim)
    }

    /// One coordinate of all points; dimensions count from 0.
    pub(super) fn column(&self, dim: usize) -> Vec<f64> {
        self.points().map(|p| p[dim]).collect()
    }

    /// The projection of all points to these dimensions, which count from 0.
    ///
    /// # Errors
    /// A dimension that the points do not have.
    pub fn project(&self, dims: &[usize]) -> Result<Self, DiscrepancyError> {
        if let Some(&beyond) = dims.iter().find(|&&dim| dim >= self.dim) {
            return Err(DiscrepancyError::NoSuchDimension {
                dim: beyond + 1,
                available: self.dim,
            });
        }
        let select = |point: &'_ [f64]| dims.iter().map(|&dim| point[dim]).collect::<Vec<_>>();
        Self::new(dims.len(), self.points().flat_map(select).collect())
    }

    /// The points as pairs, if they have two coordinates.
    pub(super) fn pairs(&self) -> Option<&[[f64; 2]]> {
        (self.dim == 2).then(|| self.coordinates.as_chunks().0)
    }

    /// The points as pairs, for a measure that needs them.
    pub(super) fn pairs_for(&self, measure: &'static str) -> Result<&[[f64; 2]], DiscrepancyError> {
        let reason = format!("needs points of 2 dimensions, these have {}", self.dim);
        let missing = DiscrepancyError::NotDefined { measure, reason };
        self.pairs().ok_or(missing)
    }
}

/// Other white space may be meant as a line end, and joining lines would change the dimension: such
/// a word is not a number.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split([' ', '\t', ',']).filter(|word| !word.is_empty())
}

/// True if all numbers of a line look like `0,5`: coordinates would part at the comma unnoticed.
fn has_decimal_commas(line: &str) -> bool {
    let mut words = line.split_ascii_whitespace();
    let is_one = |word: &str| {
        let parts = word.split_once(',');
        let is_whole = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
        parts.is_some_and(|(whole, decimals)| is_whole(whole) && is_whole(decimals))
    };
    line.trim().contains([' ', '\t']) && words.all(is_one)
}

fn coordinate(word: &str) -> Result<f64, String> {
    match word.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        Ok(value) => Err(format!("coordinate {value} does not lie in [0, 1]")),
        Err(_) => Err(format!("`{word}` is not a number")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blanks_commas_tabs_comments_and_empty_lines_are_understood() {
        let text = "# x y\n0.25 0.5\n\n1,0 # corner\n0.125,\t1e-3\r\n";
        let points = PointSet::parse(text).unwrap();
        let expected = PointSet::from_points(&[[0.25, 0.5], [1.0, 0.0], [0.125, 0.001]]);
        assert_eq!(Ok(points), expected);
    }

    #[test]
    fn decimals_with_commas_are_refused_and_lists_with_commas_are_not() {
        for text in ["0,5 0,25\n", "0,1\t1,0 # corner\n"] {
            let refused = PointSet::parse(text).unwrap_err().to_string();
            assert!(refused.contains("with a point"), "{refused}");
            let advised = PointSet::parse(&text.replace(',', ".")).unwrap();
            assert_eq!(advised.dim(), 2);
        }
        for text in ["0,1\n", "0, 1\n", "0,1 \n", "0,1 0.5\n", "0.5,1 1,0\n"] {
            assert!(PointSet::parse(text).is_ok(), "{text}");
        }
    }

    #[test]
    fn lines_end_in_any_way_and_never_run_together() {
        let expected = PointSet::from_points(&[[0.25, 0.5], [1.0, 0.0]]);
        let text = "# x y\n0.25 0.5\n1 0\n";
        for end in ["\r", "\r\n", "\n\r"] {
            let other = format!("\u{feff}{}", text.replace('\n', end));
            assert_eq!(PointSet::parse(&other), expected, "{end:?}");
        }
        // A character that is neither a gap nor a line end must not join two points.
        for odd in ["\u{b}", "\u{c}", "\u{85}", "\u{2028}", "\u{2029}", ";"] {
            let joined = format!("0.25 0.5{odd}1 0\n");
            let found = PointSet::parse(&joined);
            let is_refused = matches!(found, Err(DiscrepancyError::Line { line: 1, .. }));
            assert!(is_refused, "{odd:?}: {found:?}");
        }
        let ragged = PointSet::parse("0.1 0.2\r0.3\r");
        let is_second = matches!(ragged, Err(DiscrepancyError::Line { line: 2, .. }));
        assert!(is_second, "{ragged:?}");
    }

    #[test]
    fn seventeen_digits_are_read_to_the_bit() {
        let value = 0.1 + 0.2;
        let points = PointSet::parse(&format!("{value:.16e}")).unwrap();
        assert_eq!(points.column(0), [value]);
    }

    #[test]
    fn projections_name_the_dimension_that_is_not_there() {
        let points = PointSet::from_points(&[[0.1, 0.2, 0.3]]).unwrap();
        let pair = points.project(&[2, 0]).unwrap();
        assert_eq!(pair.pairs(), Some(&[[0.3, 0.1]][..]));
        let message = points.project(&[0, 3]).unwrap_err().to_string();
        assert_eq!(message, "dimension 4 is asked for, but the points have 3");
    }
}

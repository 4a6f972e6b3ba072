//! A page about one point set: the set, its projections, disc and hemisphere, superposed pixels,
//! spectra and the star discrepancy of all pairs of dimensions.

use super::document::{Block, Document, Illustration, Section};
use super::format;
use super::plot::heat::HeatMap;
use super::plot::panels::{self, Panel};
use super::plot::points::{Cloud, Domain, Pair, drawn_in_words, interval_counts};
use super::plot::spectrum::{ColorBar, PeriodogramMap, RadialCurve, highest_frequency};
use rayon::prelude::*;
use raystone_discrepancy::{Budget, DiscrepancyError, PointSet, periodogram, star_2d};

/// Dimensions whose projections are drawn at most.
pub(crate) const MOST_PROJECTED: usize = 8;
/// Points for which elementary intervals are drawn at most: more lines would hide the points.
const MOST_INTERVALS: usize = 1024;
/// Maximum number of points of the first pixel that are drawn over those of the others.
const MOST_HIGHLIGHTED: usize = 1024;
/// Time for the spectra, seconds.
const SPECTRUM_SECONDS: f64 = 60.0;

/// The content of the page.
#[derive(Debug, Clone)]
pub struct PointPage {
    /// Name of the sampler.
    pub label: String,
    /// Origin of the points: pixel, seed, parameters.
    pub origin: String,
    /// Dimensions of the sampler, one for each coordinate of `points`; two at least.
    pub dims: Vec<u32>,
    /// The points of one pixel.
    pub points: PointSet,
    /// The first two coordinates of the points of several pixels, that of `points` first.
    pub copies: Vec<Vec<Pair>>,
}

/// Returns the page; star discrepancies and spectra are computed here, on all cores.
///
/// # Errors
/// Coordinates outside `[0, 1]`, or fewer than two dimensions.
pub fn document(page: &PointPage) -> Result<Document, DiscrepancyError> {
    let n = page.points.len();
    let mut set = Section::new("set", "Point set");
    set.blocks.push(Block::Figures(page.sets()?));
    let mut projections = Section::new("projections", "Projections");
    projections.blocks.push(Block::Figures(page.projections()?));
    let mut pixels = Section::new("pixels", "Superposed pixels");
    pixels.blocks.push(Block::Figures(vec![page.copies()]));
    let mut spectrum = Section::new("spectrum", "Power spectrum");
    spectrum.blocks.push(page.spectra()?);
    let sections = [set, projections, pixels, spectrum];
    let dims: Vec<String> = page.dims.iter().map(u32::to_string).collect();
    Ok(Document {
        title: page.label.clone(),
        subtitle: format!(
            "{n} points, dimensions {}; {}",
            dims.join(", "),
            page.origin
        ),
        banners: Vec::new(),
        sections: sections.into(),
    })
}

impl PointPage {
    /// Returns the coordinates at two positions of `dims`.
    fn pairs(&self, i: usize, j: usize) -> Result<Vec<Pair>, DiscrepancyError> {
        let projected = self.points.project(&[i, j])?;
        Ok(projected.points().map(|p| [p[0], p[1]]).collect())
    }

    /// Returns `dimensions 0 and 1` of two positions.
    fn names(&self, i: usize, j: usize) -> String {
        format!("dimensions {} and {}", self.dims[i], self.dims[j])
    }

    /// Returns m, if there are 2^m points and not too many for elementary intervals.
    fn net(&self) -> Option<u32> {
        let n = self.points.len();
        (n.is_power_of_two() && n <= MOST_INTERVALS).then(|| n.trailing_zeros())
    }

    /// Plots the first two dimensions: square, discs and dome, then every shape of elementary intervals.
    fn sets(&self) -> Result<Vec<Illustration>, DiscrepancyError> {
        let points = self.pairs(0, 1)?;
        let cloud = |domain| Cloud::new(domain, points.clone());
        let square = Cloud {
            intervals: self.net().map(|m| [m.div_ceil(2), m / 2]),
            ..cloud(Domain::Square)
        };
        let panels = [
            Panel::new("unit square", self.names(0, 1), square),
            Panel::new(
                "disc, radius √x, angle 2πy",
                "the path tracer's",
                cloud(Domain::PolarDisc),
            ),
            Panel::new(
                "cosine hemisphere",
                "the disc lifted; far side pale",
                cloud(Domain::Hemisphere),
            ),
            Panel::new(
                "concentric disc",
                "for comparison, used nowhere",
                cloud(Domain::ConcentricDisc),
            ),
        ];
        let mut caption = format!("{}, {}.", drawn_in_words(points.len()), self.names(0, 1));
        if self.net().is_some() {
            caption += " Lines: elementary intervals; tinted: an interval without a point.";
        }
        let mut figures = vec![panels::figure("point-set", caption, &panels, 2)];
        figures.extend(self.net().map(|m| intervals(&points, m)));
        Ok(figures)
    }

    /// Plots all pairs of the first dimensions, and the star discrepancy of all pairs.
    fn projections(&self) -> Result<Vec<Illustration>, DiscrepancyError> {
        let shown = self.dims.len().min(MOST_PROJECTED);
        let mut panels = Vec::new();
        for (i, j) in pairs_below(shown) {
            let title = format!("x: {}, y: {}", self.dims[i], self.dims[j]);
            let cloud = Cloud::new(Domain::Square, self.pairs(i, j)?);
            panels.push(Panel::new(title, "", cloud));
        }
        let of = if self.dims.len() > shown {
            format!("the first {shown} dimensions given")
        } else {
            "all dimensions given".into()
        };
        let caption = format!("Every pair of {of}: {}.", drawn_in_words(self.points.len()));
        let projections = panels::figure("projections", caption, &panels, 4);
        let stars = self.stars()?;
        let names: Vec<String> = self.dims.iter().map(u32::to_string).collect();
        let worst = stars.iter().max_by(|a, b| a.2.total_cmp(&b.2));
        let drawing = HeatMap::of_pairs(&names, &stars).draw();
        let discrepancies = drawing.zip(worst).map(|(drawing, (i, j, worst))| {
            let caption = format!(
                "Exact star discrepancy of each pair of dimensions; the worst are {} and {} with {}.",
                names[*i],
                names[*j],
                format::number(*worst)
            );
            Illustration::new("pair-discrepancy", caption, drawing)
        });
        // The only pair of two dimensions is the set itself.
        let projections = (shown > 2).then_some(projections);
        Ok(projections.into_iter().chain(discrepancies).collect())
    }

    /// Returns D* of every pair of positions in `dims`.
    fn stars(&self) -> Result<Vec<(usize, usize, f64)>, DiscrepancyError> {
        let star = |(i, j)| Ok((i, j, star_2d(&self.pairs(i, j)?)?));
        let pairs: Vec<_> = pairs_below(self.dims.len()).collect();
        pairs.into_par_iter().map(star).collect()
    }

    /// Plots all pixels on top of each other (Dufay 2017, Figs. 5.7 and 5.13).
    fn copies(&self) -> Illustration {
        let all: Vec<Pair> = self.copies.concat();
        let own = self.copies.first().cloned().unwrap_or_default();
        let first = own.len();
        let highlighted = if first <= MOST_HIGHLIGHTED {
            own
        } else {
            Vec::new()
        };
        let cloud = |domain| Cloud {
            highlighted: highlighted.clone(),
            ..Cloud::new(domain, all.clone())
        };
        let pixels = format::plural(self.copies.len(), "pixel");
        let panels = [
            Panel::new(pixels.clone(), "unit square", cloud(Domain::Square)),
            Panel::new(pixels.clone(), "disc", cloud(Domain::PolarDisc)),
        ];
        let caption = format!(
            "The points of {pixels} in a row upon each other, {first} of {} each; the first pixel's in \
             another colour. Holes and stripes are directions that no pixel looks into.",
            self.points.len()
        );
        panels::figure("pixels", caption, &panels, 2)
    }

    /// Returns the periodogram and its radial mean, or why there are none.
    fn spectra(&self) -> Result<Block, DiscrepancyError> {
        let highest = highest_frequency(self.points.len());
        let pair = self.points.project(&[0, 1])?;
        let found = match periodogram(&pair, highest, &Budget::seconds(SPECTRUM_SECONDS)) {
            Ok(found) => found,
            Err(reason @ DiscrepancyError::OverBudget { .. }) => {
                return Ok(Block::Paragraph(format!("No spectrum: {reason}.")));
            }
            Err(reason) => return Err(reason),
        };
        let range = format!("frequencies up to ±{highest}");
        let panels = [
            Panel::new(
                "radial mean",
                format!("frequency 1 to {highest}"),
                RadialCurve(found.radial()),
            ),
            Panel::new("periodogram", range, PeriodogramMap(found)),
            Panel::new("power", "", ColorBar),
        ];
        let caption = format!(
            "Power of the {} points in {}: |Σ exp(−2πi k·x)|² / N at integer frequencies k. \
             Dashed: white noise. What lies beyond the scale lies on its edge.",
            pair.len(),
            self.names(0, 1)
        );
        Ok(Block::Figures(vec![panels::figure(
            "spectrum", caption, &panels, 3,
        )]))
    }
}

/// Returns every pair `i < j` below `n`.
fn pairs_below(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(move |i| (i + 1..n).map(move |j| (i, j)))
}

/// Plots all shapes of elementary intervals of volume 1/N of 2^m points.
fn intervals(points: &[Pair], m: u32) -> Illustration {
    let panel = |a: u32| {
        let shape = [a, m - a];
        let empty = interval_counts(points, shape)
            .iter()
            .filter(|&&count| count == 0)
            .count();
        let note = match empty {
            0 => "one point in each".into(),
            empty => format!("{empty} of {} empty", points.len()),
        };
        let cloud = Cloud {
            intervals: Some(shape),
            ..Cloud::new(Domain::Square, points.to_vec())
        };
        Panel::new(format!("{} × {}", 1u32 << a, 1u32 << (m - a)), note, cloud)
    };
    let panels: Vec<Panel> = (0..=m).rev().map(panel).collect();
    let caption =
        "Every shape of elementary intervals of volume 1/N. A (0, m, 2)-net has one point in each.";
    panels::figure("elementary-intervals", caption, &panels, 4)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a page of four points that distinguish the three dimensions, two pixels.
    fn page() -> PointPage {
        let points = [
            [0.0, 0.0, 0.9],
            [0.5, 0.5, 0.9],
            [0.25, 0.75, 0.9],
            [0.75, 0.25, 0.9],
        ];
        let own: Vec<Pair> = points.iter().map(|p| [p[0], p[1]]).collect();
        PointPage {
            label: "known".into(),
            origin: "by hand".into(),
            dims: vec![4, 5, 9],
            points: PointSet::from_points(&points).unwrap(),
            copies: vec![own.clone(), own],
        }
    }

    #[test]
    fn projections_take_the_dimensions_that_they_name() {
        let page = page();
        assert_eq!(page.pairs(0, 2).unwrap()[3], [0.75, 0.9]);
        assert_eq!(page.pairs(1, 2).unwrap()[3], [0.25, 0.9]);
        let figures = page.projections().unwrap();
        let texts = figures[0].drawing.texts();
        let titles: Vec<_> = texts.iter().filter(|text| text.starts_with("x:")).collect();
        assert_eq!(titles, [&"x: 4, y: 5", &"x: 4, y: 9", &"x: 5, y: 9"]);
        // The third dimension is bad with both others: D* is that of its one value.
        let stars = page.stars().unwrap();
        let good = star_2d(&page.pairs(0, 1).unwrap()).unwrap();
        assert_eq!(stars[0], (0, 1, good));
        assert!(stars[1].2 >= 0.9 && stars[2].2 >= 0.9 && good < 0.6);
        assert!(page.pairs(0, 3).is_err());
    }

    #[test]
    fn the_page_holds_every_picture_and_says_how_many_pixels() {
        let document = document(&page()).unwrap();
        let blocks = document.sections.iter().flat_map(|section| &section.blocks);
        let figures: Vec<&Illustration> = blocks
            .flat_map(|block| match block {
                Block::Figures(figures) => figures.as_slice(),
                _ => &[],
            })
            .collect();
        let names: Vec<&str> = figures.iter().map(|figure| figure.name.as_str()).collect();
        let expected = [
            "point-set",
            "elementary-intervals",
            "projections",
            "pair-discrepancy",
            "pixels",
            "spectrum",
        ];
        assert_eq!(names, expected);
        let caption = &figures[4].caption;
        assert!(caption.contains("2 pixels") && caption.contains("4 of 4 each"));
        let texts = figures[1].drawing.texts();
        let full = texts.iter().filter(|text| **text == "one point in each");
        assert_eq!(full.count(), 3);
        assert_eq!(document.subtitle, "4 points, dimensions 4, 5, 9; by hand");
    }
}

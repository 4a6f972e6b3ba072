//! The report as a document that HTML, Markdown and the terminal show alike.

use super::ReportError;
use super::plot::drawing::Drawing;
use super::plot::paint::{to_png, to_svg};
use rayon::prelude::*;
use raystone_record::Verdict;
use serde::Serialize;

/// Figures whose PNG files are as fine as print wants them, and those that have one at all: with hundreds, painting and packing
/// would cost a report more time than everything else. The files of those between have their own size; SVG files are all sharp.
const MOST_FOR_PRINT: usize = 48;
const MOST_PNG: usize = 192;

/// Figures that are painted before they are written: painted ones are larger than their data.
const AT_ONCE: usize = 64;

/// Bytes of plots that a page holds.
const MOST_INLINE: usize = 4_000_000;

/// The whole report.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Document {
    /// Title.
    pub title: String,
    /// One line: when and where.
    pub subtitle: String,
    /// Notes for the top of the page.
    pub banners: Vec<Banner>,
    /// Sections in order.
    pub sections: Vec<Section>,
}

impl Document {
    /// Paints every figure, on all cores, and hands each to `write` with its files: SVG, and PNG unless there are too many. The first
    /// figures stand in the page, as many as it has room for; the others, to which it links, are dropped once written.
    ///
    /// # Errors
    /// If the drawing backend fails, or `write` does.
    pub(crate) fn paint(
        &mut self,
        mut write: impl FnMut(&str, &Painted) -> Result<(), ReportError>,
    ) -> Result<(), ReportError> {
        let mut figures = Vec::new();
        for section in &mut self.sections {
            figures_among(&mut section.blocks, &mut figures);
        }
        let mut room = MOST_INLINE;
        for (batch, figures) in figures.chunks_mut(AT_ONCE).enumerate() {
            let first = batch * AT_ONCE;
            let painted = figures.par_iter().enumerate();
            let painted = painted.map(|(i, figure)| Painted::of(&figure.drawing, first + i));
            let painted: Vec<Painted> = painted.collect::<Result<_, _>>()?;
            for (figure, painted) in figures.iter_mut().zip(painted) {
                write(&figure.name, &painted)?;
                figure.drawing = Drawing::new(0.0, 0.0);
                figure.has_png = painted.png.is_some();
                let left = room.checked_sub(painted.svg.len());
                figure.inline = left.is_some();
                if let Some(left) = left {
                    (room, figure.svg) = (left, painted.svg);
                }
            }
        }
        Ok(())
    }
}

/// The files of a figure.
pub(crate) struct Painted {
    /// SVG document.
    pub svg: String,
    /// PNG file.
    pub png: Option<Vec<u8>>,
}

impl Painted {
    /// Returns the files of the figure in this place of its report.
    fn of(drawing: &Drawing, place: usize) -> Result<Self, ReportError> {
        let png = (place < MOST_PNG).then(|| to_png(drawing, place < MOST_FOR_PRINT));
        Ok(Self {
            svg: to_svg(drawing)?,
            png: png.transpose()?,
        })
    }
}

/// Gathers the figures among some blocks and in their folds.
fn figures_among<'a>(blocks: &'a mut [Block], found: &mut Vec<&'a mut Illustration>) {
    for block in blocks {
        match block {
            Block::Figures(figures) => found.extend(figures),
            Block::Fold(fold) => figures_among(&mut fold.blocks, found),
            Block::Beside(beside) => figures_among(&mut beside.blocks, found),
            _ => {}
        }
    }
}

/// A line across the page.
#[derive(Debug, Clone, Serialize)]
pub struct Banner {
    /// `bad` or `note`.
    pub tone: Tone,
    /// The text.
    pub text: String,
}

impl Banner {
    /// Returns a line of this tone.
    pub fn new(tone: Tone, text: impl Into<String>) -> Self {
        let text = text.into();
        Self { tone, text }
    }
}

/// A section.
#[derive(Debug, Clone, Serialize)]
pub struct Section {
    /// Anchor, unique in the document.
    pub id: String,
    /// Heading.
    pub title: String,
    /// Content.
    pub blocks: Vec<Block>,
}

impl Section {
    /// Returns an empty section.
    pub fn new(id: impl Into<String>, title: impl Into<String>) -> Self {
        Self {
            id: id.into(),
            title: title.into(),
            blocks: Vec::new(),
        }
    }
}

/// A piece of a section.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "kind", content = "value", rename_all = "kebab-case")]
pub enum Block {
    /// A smaller heading.
    Heading(String),
    /// A paragraph.
    Paragraph(String),
    /// Statements with a verdict.
    Checks(Vec<Check>),
    /// A table.
    Table(Table),
    /// Plots; narrow ones side by side.
    Figures(Vec<Illustration>),
    /// Pictures.
    Gallery(Gallery),
    /// Text as typed.
    Verbatim(String),
    /// Blocks that open on demand.
    Fold(Fold),
    /// Pictures beside other blocks.
    Beside(Beside),
    /// Terms of the field, explained at their first use.
    Terms(Vec<Term>),
    /// Images of one scene, to be compared pixel by pixel.
    Comparer(Comparer),
}

impl Block {
    /// Blocks that open on demand, if there are any.
    pub fn fold(title: impl Into<String>, blocks: Vec<Self>) -> Option<Self> {
        let title = title.into();
        (!blocks.is_empty()).then(|| {
            Self::Fold(Fold {
                title,
                blocks,
                ..Fold::default()
            })
        })
    }

    /// Returns the block, or those inside of it.
    pub fn leaves(&self) -> Vec<&Self> {
        match self {
            Self::Fold(fold) => fold.blocks.iter().flat_map(Self::leaves).collect(),
            Self::Beside(beside) => beside.blocks.iter().flat_map(Self::leaves).collect(),
            leaf => vec![leaf],
        }
    }

    /// Returns plots, if any could be drawn.
    pub fn figures(figures: impl IntoIterator<Item = Option<Illustration>>) -> Option<Self> {
        let figures: Vec<Illustration> = figures.into_iter().flatten().collect();
        (!figures.is_empty()).then_some(Self::Figures(figures))
    }

    /// Returns pictures, if there are any.
    pub(crate) fn gallery(
        caption: impl Into<String>,
        items: Vec<Picture>,
        scale: Option<ColorScale>,
    ) -> Option<Self> {
        let caption = caption.into();
        (!items.is_empty()).then_some(Self::Gallery(Gallery {
            caption,
            items,
            scale,
        }))
    }
}

/// Blocks that open on demand; print, Markdown and a search of the page see all of them.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Fold {
    /// Anchor, unique in the document, or empty.
    pub id: String,
    /// Its heading.
    pub title: String,
    /// The gist of it in a few words.
    pub note: String,
    /// True if it is open at first.
    pub open: bool,
    /// Content.
    pub blocks: Vec<Block>,
}

/// Pictures beside other blocks.
#[derive(Debug, Clone, Serialize)]
pub struct Beside {
    /// The pictures, one below the other.
    pub pictures: Vec<Picture>,
    /// The blocks beside them.
    pub blocks: Vec<Block>,
}

/// A term and its meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Term {
    /// The word.
    pub word: &'static str,
    /// One plain sentence.
    pub meaning: &'static str,
}

/// The tone of a text.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tone {
    /// As it is.
    #[default]
    Plain,
    /// A pass or a win.
    Good,
    /// A failure.
    Bad,
    /// Worth knowing.
    Note,
}

/// A statement that passes, fails, or could not be tested.
#[derive(Debug, Clone, Serialize)]
pub struct Check {
    /// True, false or open.
    pub verdict: Verdict,
    /// The claim.
    pub title: String,
    /// The evidence.
    pub detail: String,
}

impl Check {
    /// Returns the check as a line of a terminal.
    pub fn line(&self) -> String {
        format!("{}  {}: {}\n", self.verdict.word(), self.title, self.detail)
    }
}

/// A table.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Table {
    /// Its subject, with units.
    pub caption: String,
    /// Heads of the columns; all but the first are aligned to the right unless `text`.
    pub columns: Vec<Column>,
    /// Rows, as long as `columns`.
    pub rows: Vec<Vec<TableCell>>,
}

/// Head of a column.
#[derive(Debug, Clone, Serialize)]
pub struct Column {
    /// Its text.
    pub title: String,
    /// True if it holds text (left) and not figures (right).
    pub text: bool,
}

/// A cell of a table.
#[derive(Debug, Clone, Default, Serialize)]
pub struct TableCell {
    /// Main text.
    pub text: String,
    /// Smaller text after it, for instance an interval.
    pub detail: String,
    /// Its tone.
    pub tone: Tone,
    /// Address that the text leads to, or empty.
    pub link: String,
}

impl TableCell {
    /// Returns a figure with its interval or another smaller text.
    pub(crate) fn with_detail(text: impl Into<String>, detail: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            detail: detail.into(),
            ..Self::default()
        }
    }

    /// Returns the same cell as a link.
    pub fn linked(mut self, address: impl Into<String>) -> Self {
        self.link = address.into();
        self
    }

    /// Returns the number of replicates or seeds.
    pub(crate) fn repeats(n: usize, randomised: bool) -> Self {
        let detail = if randomised { "" } else { "deterministic" };
        Self::with_detail(n.to_string(), detail)
    }

    /// Returns the same cell with a tone.
    pub(crate) fn toned(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }

    /// Returns both texts in one line.
    pub fn flat(&self) -> String {
        if self.detail.is_empty() {
            self.text.clone()
        } else {
            format!("{} {}", self.text, self.detail)
        }
    }
}

impl<T: Into<String>> From<T> for TableCell {
    fn from(text: T) -> Self {
        Self {
            text: text.into(),
            ..Self::default()
        }
    }
}

impl Table {
    /// Returns a table whose first column and those named with a leading `:` hold text.
    pub fn new(caption: impl Into<String>, columns: &[&str]) -> Self {
        let mut table = Self {
            caption: caption.into(),
            ..Self::default()
        };
        for (i, title) in columns.iter().enumerate() {
            let marked = title.strip_prefix(':');
            table.columns.push(Column {
                title: marked.unwrap_or(title).into(),
                text: i == 0 || marked.is_some(),
            });
        }
        table
    }

    /// Returns a table of these rows.
    pub fn of<const N: usize>(
        caption: impl Into<String>,
        columns: &[&str; N],
        rows: impl IntoIterator<Item = [TableCell; N]>,
    ) -> Self {
        let mut table = Self::new(caption, columns);
        table.rows.extend(rows.into_iter().map(Vec::from));
        table
    }

    /// Adds a column of figures.
    pub fn add_column(&mut self, title: impl Into<String>) {
        self.columns.push(Column {
            title: title.into(),
            text: false,
        });
    }

    /// Returns the table as a block, or nothing if it has no rows.
    pub fn into_block(self) -> Option<Block> {
        (!self.rows.is_empty()).then_some(Block::Table(self))
    }
}

/// A plot.
#[derive(Debug, Clone, Serialize)]
pub struct Illustration {
    /// File stem under `plots/`, unique.
    pub name: String,
    /// Its caption.
    pub caption: String,
    /// Description for readers who do not see it.
    pub alt: String,
    /// True if it has the full width.
    pub wide: bool,
    /// The drawing.
    #[serde(skip)]
    pub drawing: Drawing,
    /// SVG document; empty until `paint`.
    pub svg: String,
    /// True if the page holds it; else it links to the file.
    pub inline: bool,
    /// True if it has a PNG file, too.
    pub has_png: bool,
}

impl Illustration {
    /// Returns a plot that is not painted yet; wide drawings take the full width.
    pub fn new(name: impl Into<String>, caption: impl Into<String>, drawing: Drawing) -> Self {
        Self {
            name: name.into(),
            caption: caption.into(),
            alt: drawing.says.clone(),
            wide: drawing.width > 600.0,
            drawing,
            svg: String::new(),
            inline: true,
            has_png: true,
        }
    }
}

/// Pictures in a grid.
#[derive(Debug, Clone, Serialize)]
pub struct Gallery {
    /// Their caption.
    pub caption: String,
    /// The pictures.
    pub items: Vec<Picture>,
    /// Colour scale they share.
    pub scale: Option<ColorScale>,
}

/// One picture.
#[derive(Debug, Clone, Serialize)]
pub struct Picture {
    /// Its caption.
    pub caption: String,
    /// Description for readers who do not see it.
    pub alt: String,
    /// File relative to the run's folder.
    pub path: String,
    /// `data:` address, or `None` with the reason in `missing`.
    pub data: Option<String>,
    /// The reason why there is no picture.
    pub missing: String,
}

/// A colour bar.
#[derive(Debug, Clone, Serialize)]
pub struct ColorScale {
    /// CSS gradient.
    pub gradient: String,
    /// The quantity of the numbers.
    pub title: String,
    /// Numbers at equal distances from left to right.
    pub labels: Vec<String>,
}

/// Images of one scene under one integrator.
#[derive(Debug, Clone, Serialize)]
pub struct Comparer {
    /// Their caption.
    pub caption: String,
    /// Anchor, unique in the document.
    pub id: String,
    /// Pixels in x and y.
    pub size: [u32; 2],
    /// Factor of radiance before tone mapping.
    pub exposure: f32,
    /// The reference first.
    pub layers: Vec<Layer>,
    /// Missing layers, in words; empty if there are none.
    pub note: String,
}

/// One image of a [`Comparer`].
#[derive(Debug, Clone, Serialize)]
pub struct Layer {
    /// Its source.
    pub name: String,
    /// Linear radiance: 16-bit floats, red, green, blue, row by row from the top, low byte first, in Base64.
    pub radiance: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_figures_the_first_have_fine_files_and_all_are_written_in_order() {
        let plot = |i: usize| {
            let mut drawing = Drawing::new(40.0, 30.0);
            drawing.says = format!("plot {i}");
            Illustration::new(format!("p{i}"), "", drawing)
        };
        let mut section = Section::new("s", "S");
        let inner = Block::fold(
            "more",
            vec![Block::Figures((100..MOST_PNG + 3).map(plot).collect())],
        );
        section.blocks = vec![Block::Figures((0..100).map(plot).collect())];
        section.blocks.extend(inner);
        let mut document = Document {
            sections: vec![section],
            ..Document::default()
        };
        let mut widths = Vec::new();
        let write = |name: &str, painted: &Painted| {
            assert_eq!(name, format!("p{}", widths.len()));
            assert!(painted.svg.starts_with("<svg"));
            let read = |png: &Vec<u8>| image::load_from_memory(png).map(|p| p.width());
            widths.push(
                painted
                    .png
                    .as_ref()
                    .map(|png| read(png).expect("a PNG file")),
            );
            Ok(())
        };
        document.paint(write).expect("painted");
        let expected = |i: usize| match i {
            0..MOST_FOR_PRINT => Some(80),
            MOST_FOR_PRINT..MOST_PNG => Some(40),
            _ => None,
        };
        assert_eq!(widths, (0..MOST_PNG + 3).map(expected).collect::<Vec<_>>());
        let mut figures = Vec::new();
        figures_among(&mut document.sections[0].blocks, &mut figures);
        assert!(figures.iter().all(|f| f.inline && !f.svg.is_empty()));
        let files = figures.iter().filter(|f| f.has_png).count();
        assert_eq!(files, MOST_PNG);
        assert_eq!(figures[0].alt, "plot 0");
    }
}

//! Terms of the field, each explained at its first use.

use super::document::{Block, Document, Term};

/// A term with other forms by which it is found, and its meaning.
type Entry = (&'static str, &'static [&'static str], &'static str);

#[rustfmt::skip]
const TERMS: &[Entry] = &[
    ("gate", &["gate"],
        "Before anything is timed, every structure answers the same recorded rays as the reference tracer; each answer must be equal to \
         the bit. A structure that differs once fails the gate and gets no speed."),
    ("reference tracer", &["reference tracer"],
        "Plain code on the processor that answers the recorded rays; it is itself compared with testing every triangle and \
         with exact arithmetic."),
    ("relMSE", &["relMSE"],
        "Relative mean squared error: the mean over pixels of (value − reference)² / (reference² + 0.01). Half of it means \
         half of the samples for the same quality. It is called unbiased where the noise of the reference is taken out."),
    ("spp", &["spp"], "Samples per pixel."),
    ("Mrays/s", &["Mrays/s", "million rays per second"],
        "Million rays answered per second, by the median of repeated timings of the same rays."),
    ("chord", &["chord"],
        "Rays between two random points of the scene's bounding box: they come from nowhere that a camera looks from."),
    ("bounce", &["bounce rays", "bounce"],
        "Rays that leave a surface in a random direction, as a path tracer sends them: neighbours have little in common."),
    ("D*", &["D*"],
        "Star discrepancy: by how much the share of points in any box at the origin differs at most from the box's area. Less \
         is more even."),
    ("EPO", &["EPO", "end-point overlap"],
        "End-point overlap (Aila et al. 2013): the expected cost of boxes that lie over surfaces of other subtrees; less is \
         better."),
    ("SAH", &["SAH"],
        "Surface area heuristic: the expected number of steps and triangle tests of a random line through the tree; less is \
         better."),
    ("f64 oracle", &["f64 oracle"], "The same hits computed in double precision with a bound on their error."),
    ("95 % interval", &["95 % interval"],
        "If the run were repeated many times, 95 of 100 such intervals would hold the true figure."),
    ("Pareto front", &["Pareto front"], "The cells that no other beats in time and error at once."),
    ("ulp", &["ulp"], "The distance from one floating-point number to the next."),
    ("crack", &["cracks"], "A ray from inside of a closed mesh that leaves it without a hit."),
];

/// Adds an explanation after each block that is the first to use a term.
pub fn explain(document: &mut Document) {
    let mut left: Vec<&Entry> = TERMS.iter().collect();
    for section in &mut document.sections {
        explain_among(&mut section.blocks, &mut left);
    }
}

fn explain_among(blocks: &mut Vec<Block>, left: &mut Vec<&Entry>) {
    let mut explained = Vec::with_capacity(blocks.len());
    for mut block in blocks.drain(..) {
        match &mut block {
            Block::Fold(fold) => explain_among(&mut fold.blocks, left),
            Block::Beside(beside) => explain_among(&mut beside.blocks, left),
            _ => {}
        }
        let texts = texts(&block);
        let stands = |entry: &&Entry| {
            entry
                .1
                .iter()
                .any(|word| texts.iter().any(|t| has_word(t, word)))
        };
        let (found, rest): (Vec<&Entry>, Vec<&Entry>) = left.iter().copied().partition(stands);
        *left = rest;
        explained.push(block);
        if !found.is_empty() {
            let term = |(word, _, meaning): &&Entry| Term { word, meaning };
            explained.push(Block::Terms(found.iter().map(term).collect()));
        }
    }
    *blocks = explained;
}

/// Returns `true` if a word occurs in a text by itself.
fn has_word(text: &str, word: &str) -> bool {
    let outside = |c: Option<char>| c.is_none_or(|c| !c.is_alphanumeric() && c != '-' && c != '_');
    text.match_indices(word).any(|(at, _)| {
        outside(text[..at].chars().next_back()) && outside(text[at + word.len()..].chars().next())
    })
}

/// Returns the texts of a block, without names of files and typed text.
fn texts(block: &Block) -> Vec<&str> {
    match block {
        Block::Heading(text) | Block::Paragraph(text) => vec![text],
        Block::Checks(checks) => {
            let both = checks.iter().map(|check| [&*check.title, &*check.detail]);
            both.flatten().collect()
        }
        Block::Table(table) => {
            let first = table
                .rows
                .iter()
                .filter_map(|row| Some(&*row.first()?.text));
            let heads = table.columns.iter().map(|column| &*column.title);
            heads.chain([&*table.caption]).chain(first).collect()
        }
        Block::Figures(figures) => {
            let of = figures.iter();
            of.flat_map(|f| [&*f.caption, &*f.alt]).collect()
        }
        Block::Gallery(gallery) => vec![&gallery.caption],
        Block::Comparer(comparer) => vec![&comparer.caption],
        Block::Verbatim(_) | Block::Fold(_) | Block::Beside(_) | Block::Terms(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Section;

    #[test]
    fn a_word_is_explained_once_behind_the_block_that_first_uses_it() {
        let paragraph = |text: &str| Block::Paragraph(text.into());
        let mut first = Section::new("a", "A");
        first.blocks = vec![
            paragraph("nothing"),
            paragraph("at 16 spp"),
            paragraph("gates"),
        ];
        let mut second = Section::new("b", "B");
        second
            .blocks
            .extend(Block::fold("t", vec![paragraph("64 spp through the gate")]));
        let mut document = Document {
            sections: vec![first, second],
            ..Document::default()
        };
        explain(&mut document);
        let words = |blocks: &[Block]| -> Vec<Vec<&str>> {
            let of = |block: &Block| match block {
                Block::Terms(terms) => terms.iter().map(|t| t.word).collect(),
                _ => Vec::new(),
            };
            blocks.iter().map(of).collect()
        };
        let none = Vec::<&str>::new;
        let expected = vec![none(), none(), vec!["spp"], none()];
        assert_eq!(words(&document.sections[0].blocks), expected);
        let Block::Fold(fold) = &document.sections[1].blocks[0] else {
            panic!("no fold")
        };
        assert_eq!(words(&fold.blocks), [none(), vec!["gate"]]);
    }
}

//! What a draw depends on, and the words that sequence and decorrelation read. Twin of
//! `kernels/sampling/state.wesl`.

/// What one coordinate is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coordinate {
    /// Linear pixel index.
    pub pixel: u32,
    /// Sample within the pixel.
    pub sample: u32,
    /// Dimension, see [`super::dimensions`].
    pub dimension: u32,
    /// Seed of the replicate.
    pub seed: u32,
}

/// Words before those of the sequence: where the words of the decorrelation begin.
const HEADER: u32 = 1;

/// The words that kernels read as the texture `sampler_table`: the header, the sequence's, the width of the image, the
/// decorrelation's, and zeros up to a whole texel of four.
/// Lengths are data, not constants, so that neither the number of samples nor that of dimensions
/// makes another kernel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SamplerTable(Vec<u32>);

impl SamplerTable {
    /// A table of the words of a sequence and those of a decorrelation, for images of this width (0 if that is not known).
    pub fn new(sequence: &[u32], width: u32, decorrelation: &[u32]) -> Self {
        let header = [HEADER + sequence.len() as u32 + 1];
        let mut words = [&header, sequence, &[width], decorrelation].concat();
        words.resize(words.len().next_multiple_of(4), 0);
        Self(words)
    }

    /// All words, as the device gets them.
    pub fn words(&self) -> &[u32] {
        &self.0
    }

    fn word(&self, i: u32) -> u32 {
        self.0[i as usize]
    }

    /// Word `i` of the sequence.
    ///
    /// # Panics
    /// Beyond the table: a dimension that the sampler was not made for.
    pub fn sequence_word(&self, i: u32) -> u32 {
        self.word(HEADER + i)
    }

    /// Width of the image, pixels.
    pub(crate) fn image_width(&self) -> u32 {
        self.word(self.word(0) - 1)
    }

    /// Word `i` of the decorrelation.
    ///
    /// # Panics
    /// Beyond the table.
    pub(crate) fn decorrelation_word(&self, i: u32) -> u32 {
        self.word(self.word(0) + i)
    }
}

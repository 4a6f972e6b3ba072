//! The coordinates of a draw, and the words that sequence and decorrelation read. CPU version of
//! `kernels/sampling/state.wesl`.

/// The coordinates of one draw.
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

/// Words before those of the sequence: the start of the decorrelation's words.
const HEADER: u32 = 1;

/// The words that kernels read as the texture `sampler_table`: the header, the sequence's, the
/// width of the image, the decorrelation's, and zeros up to a whole texel of four. Lengths are
/// data, not constants, so that the numbers of samples and dimensions do not require other kernels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SamplerTable(Vec<u32>);

impl SamplerTable {
    /// A table of both words, for images of this width (0 if unknown).
    pub fn new(sequence: &[u32], width: u32, decorrelation: &[u32]) -> Self {
        let header = [HEADER + sequence.len() as u32 + 1];
        let mut words = [&header, sequence, &[width], decorrelation].concat();
        words.resize(words.len().next_multiple_of(4), 0);
        Self(words)
    }

    /// All words, as uploaded to the device.
    pub fn words(&self) -> &[u32] {
        &self.0
    }

    fn word(&self, i: u32) -> u32 {
        self.0[i as usize]
    }

    /// Word `i` of the sequence.
    ///
    /// # Panics
    /// Beyond the table: a dimension outside the sampler's demand.
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

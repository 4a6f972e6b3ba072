//! Load paths: kernels read nodes and triangles from storage buffers, or as texels of textures.
//!
//! The choice affects times, but not hits and images. It holds for the arrays of `vec4<u32>`: nodes,
//! triangles and the cells of the irregular grid.

use raystone_core::params::{Kinds, Named};
use raystone_gpu::{Gpu, GpuError};

/// A value of the `load` axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Load {
    /// Name used in configurations.
    pub name: &'static str,
    /// One-line description.
    pub description: &'static str,
    /// True for textures; `None`: the faster one on the adapter.
    texels: Option<bool>,
}

/// The values of the `load` axis.
pub type LoadRegistry = Kinds<Load>;

impl Named for Load {
    fn built_in() -> Vec<&'static Self> {
        Self::ALL.iter().collect()
    }

    fn name(&self) -> &'static str {
        self.name
    }

    fn description(&self) -> &'static str {
        self.description
    }
}

impl Default for Load {
    fn default() -> Self {
        Self::ALL[0]
    }
}

impl Load {
    /// All load paths, the default first.
    pub const ALL: [Self; 3] = [
        Self {
            name: "auto",
            description: "the faster one on the adapter: textures on software adapters, on others measured once",
            texels: None,
        },
        Self {
            name: "buffer",
            description: "nodes and triangles from storage buffers",
            texels: Some(false),
        },
        Self {
            name: "texture",
            description: "nodes and triangles as texels of textures",
            texels: Some(true),
        },
    ];

    /// True if kernels read texels on this adapter.
    ///
    /// # Errors
    /// The measurement does not run.
    pub fn reads_texels(&self, gpu: &Gpu) -> Result<bool, GpuError> {
        match self.texels {
            Some(texels) => Ok(texels),
            None => gpu.reads_texels_faster(),
        }
    }
}

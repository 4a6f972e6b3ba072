//! Structures that wrap a real one and plant a fault.

use raystone::accel::StructureStats;
use raystone::accel::{
    AccelError, AccelKind, BuildLog, BuiltAccel, Bvh, GpuBuffers, RopedBvh, TriangleSoup,
};
use raystone::params::{ParameterSchema, Params};

#[derive(Clone, Copy)]
pub enum Fault {
    /// The leaf with this triangle uses an invalid index for it.
    TriangleIndex(u32),
    /// A kernel constant has another value.
    Constant(&'static str, u32),
    Structural,
    Build,
}

pub struct Faulty {
    pub name: &'static str,
    pub inner: &'static dyn AccelKind,
    pub fault: Fault,
}

pub static WRONG_INDEX: Faulty = Faulty {
    name: "wrong-index",
    inner: &Bvh,
    fault: Fault::TriangleIndex(0),
};
pub static WRONG_INDEX_ROPED: Faulty = Faulty {
    name: "wrong-index-roped",
    inner: &RopedBvh,
    fault: Fault::TriangleIndex(0),
};
pub static SHORT_STACK: Faulty = Faulty {
    name: "short-stack",
    inner: &Bvh,
    fault: Fault::Constant("STACK_ENTRIES", 1),
};
pub static NOT_VALID: Faulty = Faulty {
    name: "not-valid",
    inner: &Bvh,
    fault: Fault::Structural,
};
pub static NOT_BUILT: Faulty = Faulty {
    name: "not-built",
    inner: &Bvh,
    fault: Fault::Build,
};

/// The invalid triangle index: the largest, so that it loses all ties.
pub const NOBODY: u32 = u32::MAX - 1;

impl AccelKind for Faulty {
    fn name(&self) -> &'static str {
        self.name
    }

    fn description(&self) -> &'static str {
        "a real structure with a planted fault"
    }

    fn parameters(&self) -> ParameterSchema {
        self.inner.parameters()
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        if matches!(self.fault, Fault::Build) {
            return Err(AccelError::Limit {
                what: "planted limit".to_owned(),
                needed: 2,
                limit: 1,
                remedy: "plant another",
            });
        }
        let inner = self.inner.build(soup, params, log)?;
        Ok(Box::new(Built {
            inner,
            fault: self.fault,
        }))
    }
}

struct Built {
    inner: Box<dyn BuiltAccel>,
    fault: Fault,
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        match self.fault {
            Fault::Structural => Err(AccelError::Invalid("node 3: planted fault".to_owned())),
            _ => self.inner.validate(soup),
        }
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let mut buffers = self.inner.buffers();
        match self.fault {
            Fault::TriangleIndex(triangle) => {
                let leaves = buffers
                    .arrays
                    .iter_mut()
                    .find(|a| a.name == "leaf_triangles");
                let words = leaves.expect("a leaf array").words.to_mut();
                // A record has twelve words, its index the fourth.
                let found = words.chunks_exact_mut(12).find(|r| r[3] == triangle);
                found.expect("the triangle in a leaf")[3] = NOBODY;
            }
            Fault::Constant(name, value) => {
                let constant = buffers.constants.iter_mut().find(|c| c.0 == name);
                constant.expect("the constant").1 = value;
            }
            Fault::Structural | Fault::Build => {}
        }
        buffers
    }

    fn stats(&self) -> StructureStats {
        self.inner.stats()
    }
}

//! Declared parameters of registry entries.
//!
//! The macro [`parameters!`](crate::parameters) declares an entry's parameters once, as a struct
//! with types, defaults, ranges and a line of meaning each; choices are enums in the same
//! declaration. The parser, `raystone list`, sweeps and the docs use [`Parameters::schema`]; code
//! uses the fields of the struct returned by [`Parameters::from_params`]. A misspelt name does not
//! compile:
//!
//! ```compile_fail
//! raystone_core::parameters! {
//!     /// A grid.
//!     pub struct Grid {
//!         /// cells per triangle
//!         lambda: f64 = 3.0, in 0.1..=64.0;
//!     }
//! }
//! let cells = Grid::default().lamda;
//! ```
//!
//! ```
//! use raystone_core::params::{Parameters as _, Params};
//! raystone_core::parameters! {
//!     /// A grid.
//!     pub struct Grid {
//!         /// cells per triangle
//!         lambda: f64 = 3.0, in 0.1..=64.0;
//!         /// what a ray does at empty cells
//!         skip: Skip = Skip::None;
//!     }
//!     /// How empty cells are skipped.
//!     pub enum Skip {
//!         /// one by one
//!         None = "none",
//!         /// by the distance to the next full cell
//!         Chebyshev = "chebyshev",
//!     }
//! }
//! let grid = Grid::from_params(&Params::default())?;
//! assert_eq!((grid.lambda, grid.skip), (3.0, Skip::None));
//! assert_eq!(Grid::schema()[1].description, "what a ray does at empty cells");
//! # Ok::<(), raystone_core::params::ParamError>(())
//! ```

mod declare;
mod entry;
mod kinds;
mod registry;
mod schema;
mod types;
mod value;

pub use declare::{Parameters, named, read, redeclare};
pub use entry::{Entry, Variant};
pub use kinds::{Kinds, Named, Sources};
pub use registry::{Registered, Registry};
pub use schema::{Length, ParamError, ParamRange, Parameter, ParameterSchema, Step, repeated};
pub use types::{Bounded, Choice, ParameterType, Unbounded};
pub use value::{ParamValue, Params};

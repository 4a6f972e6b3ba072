//! The numerical stress suite: every intersector and structure on scenes and rays that rounding makes
//! hard, judged exactly.

pub mod case;
pub mod families;
pub mod place;
pub mod shapes;

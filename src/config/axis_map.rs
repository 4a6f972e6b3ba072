//! A value for each axis.

use super::keys::Axis;
use std::ops::{Index, IndexMut};

/// A value for each axis, read as `map[axis]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AxisMap<T>([T; Axis::ALL.len()]);

impl<T> AxisMap<T> {
    /// The value of each axis by `make`, in their order.
    ///
    /// # Errors
    /// The first one of `make`.
    pub(crate) fn try_new<E>(make: impl FnMut(Axis) -> Result<T, E>) -> Result<Self, E>
    where
        T: Default,
    {
        let mut map = Self(std::array::from_fn(|_| T::default()));
        let values = Axis::ALL.into_iter().map(make);
        for (place, value) in map.0.iter_mut().zip(values) {
            *place = value?;
        }
        Ok(map)
    }

    /// Each axis with its value.
    pub fn iter(&self) -> impl Iterator<Item = (Axis, &T)> {
        Axis::ALL.into_iter().zip(&self.0)
    }
}

impl<T> Index<Axis> for AxisMap<T> {
    type Output = T;

    fn index(&self, axis: Axis) -> &T {
        &self.0[axis as usize]
    }
}

impl<T> IndexMut<Axis> for AxisMap<T> {
    fn index_mut(&mut self, axis: Axis) -> &mut T {
        &mut self.0[axis as usize]
    }
}

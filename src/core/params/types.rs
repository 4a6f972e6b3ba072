//! Types of declared parameters.

use super::{Length, ParamRange, ParamValue, Variant};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// A type of declared parameters.
pub trait ParameterType: Sized {
    /// The value as stored in files and records.
    fn value(&self) -> ParamValue;

    /// Parses a written value; `None` if it has another type.
    fn parse(value: &ParamValue) -> Option<Self>;
}

/// A type whose parameters need a range: `in low..=high`.
pub trait Bounded: ParameterType {
    /// Type of the bounds: the value itself, or an element of a list.
    type Bound;

    /// The range for parser and help.
    fn range(range: RangeInclusive<Self::Bound>) -> ParamRange;
}

/// A type whose parameters accept any of its values.
pub trait Unbounded: ParameterType {
    /// All of its values.
    fn range() -> ParamRange;
}

/// An enum of names, declared by [`parameters!`](crate::parameters).
pub trait Choice: Copy + 'static {
    /// All choices in order of declaration.
    const ALL: &'static [Self];
    /// Their names.
    const NAMES: &'static [&'static str];

    /// Name as typed.
    fn name(self) -> &'static str;

    /// Finds a choice by name.
    fn from_name(name: &str) -> Option<Self> {
        let index = Self::NAMES.iter().position(|known| *known == name)?;
        Self::ALL.get(index).copied()
    }
}

impl ParameterType for f64 {
    fn value(&self) -> ParamValue {
        ParamValue::Number(*self)
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Number(x) => Some(*x),
            ParamValue::Integer(x) => Some(*x as f64),
            _ => None,
        }
    }
}

impl Bounded for f64 {
    type Bound = Self;

    fn range(range: RangeInclusive<Self>) -> ParamRange {
        let (min, max) = range.into_inner();
        ParamRange::Number { min, max }
    }
}

/// The f64 with the same decimal digits, so that 0.2 is 0.2 in a file.
fn widen(x: f32) -> f64 {
    x.to_string().parse().unwrap_or_else(|_| f64::from(x))
}

impl ParameterType for f32 {
    fn value(&self) -> ParamValue {
        ParamValue::Number(widen(*self))
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        f64::parse(value).map(|x| x as f32)
    }
}

impl Bounded for f32 {
    type Bound = Self;

    fn range(range: RangeInclusive<Self>) -> ParamRange {
        f64::range(widen(*range.start())..=widen(*range.end()))
    }
}

macro_rules! integers {
    ($($type:ty),*) => {$(
        impl ParameterType for $type {
            fn value(&self) -> ParamValue {
                ParamValue::Integer(i64::try_from(*self).unwrap_or(i64::MAX))
            }

            fn parse(value: &ParamValue) -> Option<Self> {
                match value {
                    ParamValue::Integer(x) => Self::try_from(*x).ok(),
                    _ => None,
                }
            }
        }

        impl Bounded for $type {
            type Bound = Self;

            fn range(range: RangeInclusive<Self>) -> ParamRange {
                let bound = |x: &Self| i64::try_from(*x).unwrap_or(i64::MAX);
                ParamRange::Integer {
                    min: bound(range.start()),
                    max: bound(range.end()),
                }
            }
        }
    )*};
}

integers!(u32, u64, usize);

impl ParameterType for bool {
    fn value(&self) -> ParamValue {
        ParamValue::Flag(*self)
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Flag(x) => Some(*x),
            _ => None,
        }
    }
}

impl ParameterType for String {
    fn value(&self) -> ParamValue {
        ParamValue::Name(self.clone())
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Name(x) => Some(x.clone()),
            _ => None,
        }
    }
}

macro_rules! unbounded {
    ($($type:ty: $range:expr),*) => {$(
        impl Unbounded for $type {
            fn range() -> ParamRange {
                $range
            }
        }
    )*};
}

unbounded!(
    bool: ParamRange::Flag,
    String: ParamRange::Text,
    PathBuf: ParamRange::Text,
    Variant: ParamRange::Filled
);

/// A path as written.
impl ParameterType for PathBuf {
    fn value(&self) -> ParamValue {
        ParamValue::Name(self.display().to_string())
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        String::parse(value).map(Self::from)
    }
}

/// A registry entry by name; the reader looks up its parameters.
impl ParameterType for Variant {
    fn value(&self) -> ParamValue {
        ParamValue::Name(self.name.clone())
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        String::parse(value).map(|name| Self::plain(&name))
    }
}

/// Optional; the empty text means `None`, as in [`ParamRange::Text`], and cannot be written.
impl<T: ParameterType> ParameterType for Option<T> {
    fn value(&self) -> ParamValue {
        let nothing = ParamValue::Name(String::new());
        self.as_ref().map_or(nothing, ParameterType::value)
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Name(x) if x.is_empty() => Some(None),
            value => T::parse(value).map(Some),
        }
    }
}

impl<T: Bounded> Bounded for Option<T> {
    type Bound = T::Bound;

    fn range(range: RangeInclusive<T::Bound>) -> ParamRange {
        T::range(range)
    }
}

impl<T: Unbounded> Unbounded for Option<T> {
    fn range() -> ParamRange {
        match T::range() {
            ParamRange::Text => ParamRange::Filled,
            range => range,
        }
    }
}

impl<T: ParameterType> ParameterType for Vec<T> {
    fn value(&self) -> ParamValue {
        ParamValue::List(self.iter().map(ParameterType::value).collect())
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::List(items) => items.iter().map(T::parse).collect(),
            _ => None,
        }
    }
}

impl<T: Bounded> Bounded for Vec<T> {
    type Bound = T::Bound;

    fn range(range: RangeInclusive<T::Bound>) -> ParamRange {
        ParamRange::List(Box::new(T::range(range)), Length::Any)
    }
}

impl<T: ParameterType, const N: usize> ParameterType for [T; N] {
    fn value(&self) -> ParamValue {
        ParamValue::List(self.iter().map(ParameterType::value).collect())
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        Vec::parse(value)?.try_into().ok()
    }
}

impl<T: Bounded, const N: usize> Bounded for [T; N] {
    type Bound = T::Bound;

    fn range(range: RangeInclusive<T::Bound>) -> ParamRange {
        ParamRange::List(Box::new(T::range(range)), Length::Exactly(N))
    }
}

impl<C: Choice> ParameterType for C {
    fn value(&self) -> ParamValue {
        ParamValue::Name(self.name().to_owned())
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Name(x) => Self::from_name(x),
            _ => None,
        }
    }
}

impl<C: Choice> Unbounded for C {
    fn range() -> ParamRange {
        ParamRange::Choice(C::NAMES)
    }
}

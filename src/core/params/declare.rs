//! The macro that declares parameters, and the traits that it implements.

use super::{
    Length, ParamError, ParamRange, ParamValue, Parameter, ParameterSchema, Params, Variant,
};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// A struct of parameters, declared by [`parameters!`](crate::parameters). Its default has every parameter
/// at its own.
pub trait Parameters: Default + Sized {
    /// Its doc comment in one line: what a registry says of it.
    const ABOUT: &'static str;

    /// Names, meanings, defaults and ranges, in the order of the declaration.
    fn schema() -> ParameterSchema;

    /// Reads the values of all parameters, none of which may be missing. [`Parameters::from_params`] is
    /// what callers want.
    ///
    /// # Errors
    /// A value that is missing or of another type.
    fn read(params: &Params) -> Result<Self, ParamError>;

    /// The parameters with these values, and the defaults of those that are missing.
    ///
    /// # Errors
    /// An unknown parameter, or a value out of its range.
    fn from_params(params: &Params) -> Result<Self, ParamError> {
        Self::read(&params.completed(&Self::schema())?)
    }

    /// The same for parameters that were checked before; where they do not fit, all have their defaults.
    fn from_checked(params: &Params) -> Self {
        Self::from_params(params).unwrap_or_default()
    }
}

/// A type that a declared parameter can have.
pub trait ParameterType: Sized {
    /// The value as files and records hold it.
    fn value(&self) -> ParamValue;

    /// The value that was written, if it is one of this type.
    fn parse(value: &ParamValue) -> Option<Self>;
}

/// A type whose parameters need a range: `in low..=high`.
pub trait Bounded: ParameterType {
    /// What is bounded: the value itself, or each one in a list.
    type Bound;

    /// The range as parser and help read it.
    fn range(range: RangeInclusive<Self::Bound>) -> ParamRange;
}

/// A type whose parameters take any of its values.
pub trait Unbounded: ParameterType {
    /// All of its values.
    fn range() -> ParamRange;
}

/// An enum of names, declared by [`parameters!`](crate::parameters).
pub trait Choice: Copy + 'static {
    /// All choices, in the order of the declaration.
    const ALL: &'static [Self];
    /// Their names.
    const NAMES: &'static [&'static str];

    /// Name as a user types it.
    fn name(self) -> &'static str;

    /// The choice of this name.
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

/// The f64 of the same decimal digits, so that 0.2 is what a file calls 0.2.
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

/// A path, as it is written.
impl ParameterType for PathBuf {
    fn value(&self) -> ParamValue {
        ParamValue::Name(self.display().to_string())
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        String::parse(value).map(Self::from)
    }
}

/// A registry entry by its name; whoever reads it looks up its parameters.
impl ParameterType for Variant {
    fn value(&self) -> ParamValue {
        ParamValue::Name(self.name.clone())
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        String::parse(value).map(|name| Self::plain(&name))
    }
}

/// What may be left out. The empty text stands for nothing, as in [`ParamRange::Text`], and cannot be written.
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

/// The name of a field as a user types it: `loop` where Rust has to write `r#loop`.
pub fn named(field: &'static str) -> &'static str {
    field.strip_prefix("r#").unwrap_or(field)
}

/// Reads one parameter. For [`parameters!`](crate::parameters).
///
/// # Errors
/// It is missing, or of another type.
pub fn read<T: ParameterType>(params: &Params, field: &'static str) -> Result<T, ParamError> {
    let name = named(field);
    let found = params.0.get(name);
    found.and_then(T::parse).ok_or_else(|| ParamError::Value {
        name,
        expected: format!("a value of the type {}", std::any::type_name::<T>()),
        found: found.map_or("missing".to_owned(), ParamValue::to_string),
    })
}

/// Gives a parameter of a struct `S` within a struct another default and range. For
/// [`parameters!`](crate::parameters).
pub fn redeclare<S, T: Bounded>(
    schema: &mut [Parameter],
    field: &'static str,
    _: fn(&S) -> &T,
    default: T,
    range: RangeInclusive<T::Bound>,
) {
    let range = T::range(range);
    for parameter in schema.iter_mut().filter(|p| p.name == named(field)) {
        parameter.default = default.value();
        parameter.range = range.clone();
    }
}

/// Declares structs of parameters and enums of choices; see [the module](crate::params).
///
/// A field is `name: type = default;` with its meaning as doc comment; numbers have a range,
/// `name: type = default, in low..=high;`, which one of [`ParamRange`]'s methods can narrow behind it:
/// `in 2..=64, where power_of_two();`. Types are those of [`ParameterType`]: numbers, switches, texts, choices, lists and arrays of
/// them, and `Option`, whose default may be `None`. A default need not be in the range: it then stands for nothing
/// that could be written, and the meaning says what it does. A field without a default,
/// `name: Struct;`, holds another declared struct, whose parameters join these under their own names;
/// `name: Struct { field = default, in low..=high; };` gives one of them another default and range.
/// Choices are `Variant = "name"`. Structs and enums may derive more, and their fields have an attribute of serde, for records.
#[macro_export]
macro_rules! parameters {
    () => {};
    (
        $(#[$meta:meta])*
        $vis:vis enum $name:ident {
            $($(#[doc = $doc:literal])* $choice:ident = $text:literal),+ $(,)?
        }
        $($rest:tt)*
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        $vis enum $name {
            $($(#[doc = $doc])* $choice,)+
        }

        impl $crate::params::Choice for $name {
            const ALL: &'static [Self] = &[$(Self::$choice),+];
            const NAMES: &'static [&'static str] = &[$($text),+];

            fn name(self) -> &'static str {
                match self {
                    $(Self::$choice => $text,)+
                }
            }
        }

        $crate::parameters! { $($rest)* }
    };
    (
        $(#[doc = $about:literal])*
        $(#[derive $derive:tt])?
        $vis:vis struct $name:ident {
            $(
                $(#[doc = $doc:literal])*
                $(#[serde $serde:tt])?
                $field:ident : $type:ty
                    $({ $($inner:ident = $inner_default:expr, in $inner_range:expr;)+ })?
                    $(= $default:expr $(, in $range:expr)? $(, where $rule:ident $arguments:tt)?)?
                ;
            )*
        }
        $($rest:tt)*
    ) => {
        $(#[doc = $about])*
        #[derive(Debug, Clone, PartialEq)]
        $(#[derive $derive])?
        $vis struct $name {
            $($(#[doc = $doc])* $(#[serde $serde])? pub $field: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self {
                    $($field: $crate::__parameter!(
                        default $type, $(= $default)? $({ $($inner = $inner_default;)+ })?
                    ),)*
                }
            }
        }

        impl $crate::params::Parameters for $name {
            const ABOUT: &'static str = concat!($($about),*).trim_ascii();

            fn schema() -> $crate::params::ParameterSchema {
                #[allow(unused_mut)]
                let mut schema = Vec::new();
                $($crate::__parameter!(
                    schema schema, $field, $type, [$($doc),*]
                    $(= $default, [$(, $range)?] [$(. $rule $arguments)?])?
                    $({ $($inner = $inner_default, in $inner_range;)+ })?
                );)*
                schema
            }

            #[allow(unused_variables)]
            fn read(
                params: &$crate::params::Params,
            ) -> Result<Self, $crate::params::ParamError> {
                Ok(Self {
                    $($field: $crate::__parameter!(read params, $field, $type, $(= $default)?),)*
                })
            }
        }

        $crate::parameters! { $($rest)* }
    };
}

/// One field of [`parameters!`](crate::parameters).
#[doc(hidden)]
#[macro_export]
macro_rules! __parameter {
    (default $type:ty, = $default:expr) => {
        $default
    };
    (default $type:ty, $({ $($inner:ident = $default:expr;)+ })?) => {{
        #[allow(unused_mut)]
        let mut inner = <$type>::default();
        $($(inner.$inner = $default;)+)?
        inner
    }};
    (read $params:ident, $field:ident, $type:ty, = $default:expr) => {
        $crate::params::read($params, stringify!($field))?
    };
    (read $params:ident, $field:ident, $type:ty,) => {
        <$type as $crate::params::Parameters>::read($params)?
    };
    (schema $schema:ident, $field:ident, $type:ty, [$($doc:literal),*]
        = $default:expr, [$(, $range:expr)?] [$($rule:tt)*]) => {{
        let default: $type = $default;
        $schema.push($crate::params::Parameter {
            name: $crate::params::named(stringify!($field)),
            description: concat!($($doc),*).trim(),
            default: $crate::params::ParameterType::value(&default),
            range: $crate::__parameter!(range $type $(, $range)?) $($rule)*,
        });
    }};
    (schema $schema:ident, $field:ident, $type:ty, [$($doc:literal),*]
        $({ $($inner:ident = $default:expr, in $range:expr;)+ })?) => {
        $schema.extend(<$type as $crate::params::Parameters>::schema());
        $($($crate::params::redeclare(
            &mut $schema,
            stringify!($inner),
            |inner: &$type| &inner.$inner,
            $default,
            $range,
        );)+)?
    };
    (range $type:ty) => {
        <$type as $crate::params::Unbounded>::range()
    };
    (range $type:ty, $range:expr) => {
        <$type as $crate::params::Bounded>::range($range)
    };
}

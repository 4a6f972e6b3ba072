//! The macro that declares parameters, and the traits it implements.

use super::{Bounded, ParamError, ParamValue, Parameter, ParameterSchema, ParameterType, Params};
use std::ops::RangeInclusive;

/// A parameter struct declared by [`parameters!`](crate::parameters), with defaults.
pub trait Parameters: Default + Sized {
    /// Its doc comment on one line, shown by registries.
    const ABOUT: &'static str;

    /// Names, meanings, defaults and ranges, in order of declaration.
    fn schema() -> ParameterSchema;

    /// Reads the values of all parameters. Callers use [`Parameters::from_params`].
    ///
    /// # Errors
    /// A value is missing or has another type.
    fn read(params: &Params) -> Result<Self, ParamError>;

    /// Creates the struct from these values, with defaults for missing ones.
    ///
    /// # Errors
    /// An unknown parameter, or a value out of its range.
    fn from_params(params: &Params) -> Result<Self, ParamError> {
        Self::read(&params.completed(&Self::schema())?)
    }

    /// [`Parameters::from_params`] for checked parameters; all defaults if they do not fit.
    fn from_checked(params: &Params) -> Self {
        Self::from_params(params).unwrap_or_default()
    }
}

/// The name of a field as typed: `loop` for `r#loop`.
pub fn named(field: &'static str) -> &'static str {
    field.strip_prefix("r#").unwrap_or(field)
}

/// Reads one parameter. For [`parameters!`](crate::parameters).
///
/// # Errors
/// It is missing or has another type.
pub fn read<T: ParameterType>(params: &Params, field: &'static str) -> Result<T, ParamError> {
    let name = named(field);
    let found = params.0.get(name);
    found.and_then(T::parse).ok_or_else(|| ParamError::Value {
        name,
        expected: format!("a value of the type {}", std::any::type_name::<T>()),
        found: found.map_or("missing".to_owned(), ParamValue::to_string),
    })
}

/// Gives a parameter of a nested struct `S` another default and range. For
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

/// Declares parameter structs and choice enums; see [the module](crate::params).
///
/// A field is `name: type = default;` with its meaning as doc comment; numbers have a range, `name:
/// type = default, in low..=high;`, which one of [`ParamRange`](crate::params::ParamRange)'s
/// methods can restrict: `in 2..=64, where power_of_two();`. Types are those of [`ParameterType`]:
/// numbers, flags, texts, choices, lists and arrays of them, and `Option`, whose default may be
/// `None`. A default outside the range represents a value that cannot be written, as explained by
/// the meaning. A field without a default, `name: Struct;`, embeds another declared struct, whose
/// parameters join these under their own names; `name: Struct { field = default, in low..=high; };`
/// gives one of them another default and range. Choices are `Variant = "name"`. Structs and enums
/// may derive more, and fields have a serde attribute, for records.
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

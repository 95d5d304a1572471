//! A block of a scenario, declared once: documentation, ranges and defaults of its keys in one place.

/// Declares a struct whose fields are the keys of a JSON block, each with its documentation, its range and its default.
///
/// The struct derives `Debug`, `Clone`, `Serialize`, `Deserialize` and `JsonSchema`, and implements `Default`; unknown keys are
/// refused and absent keys take their defaults. The documentation of a field becomes its description in the schema. Ranges are
/// JSON-schema keywords in base units: `minimum`, `exclusiveMinimum`, `maximum`, `exclusiveMaximum` for what is possible (refused
/// outside), `x-typical` for what is usual (a hint outside). A key that is `null` in a scene is absent and takes its default, so an
/// `Option` should default to `None`.
///
/// ```
/// use tropism::prelude::*;
/// keys! {
///     /// Repulsion along the borders.
///     pub struct Borders {
///         /// The weight of the pull.
///         #[schemars(extend("minimum" = 0.0, "x-typical" = [0.0, 4.0]))]
///         pub weight: Factor = Factor(4.0),
///         /// The distance over which it decays.
///         #[schemars(extend("exclusiveMinimum" = 0.0))]
///         pub length: Length = Length(5.0),
///     }
/// }
/// let borders: Borders = serde_json::from_str(r#"{ "length": "2 um" }"#).unwrap();
/// assert_eq!((borders.weight, borders.length), (Factor(4.0), Length(2.0)));
/// ```
#[macro_export]
macro_rules! keys {
    ($(
        $(#[$meta:meta])*
        $visibility:vis struct $name:ident {
            $( $(#[$key_meta:meta])* $key_visibility:vis $key:ident : $kind:ty = $default:expr ),* $(,)?
        }
    )+) => { $(
        $(#[$meta])*
        #[derive(
            ::core::fmt::Debug,
            ::core::clone::Clone,
            $crate::prelude::serde::Serialize,
            $crate::prelude::serde::Deserialize,
            $crate::prelude::schemars::JsonSchema,
        )]
        #[serde(deny_unknown_fields, default, crate = "tropism::prelude::serde")]
        #[schemars(crate = "tropism::prelude::schemars")]
        $visibility struct $name {
            $( $(#[$key_meta])* $key_visibility $key: $kind, )*
        }

        impl ::core::default::Default for $name {
            fn default() -> Self {
                Self { $( $key: $default, )* }
            }
        }
    )+ };
}

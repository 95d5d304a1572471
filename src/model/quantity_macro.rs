//! The macro that declares a quantity.

/// Declares a quantity: a newtype over `f64` with its name in messages and its base unit, readable from JSON with units.
///
/// ```
/// use tropism::prelude::*;
/// quantity! {
///     /// A force per length of membrane.
///     Tension, "tension", "nN/um"
/// }
/// assert_eq!(serde_json::from_str::<Tension>("\"2 pN/nm\"").unwrap(), Tension(2.0));
/// ```
#[macro_export]
macro_rules! quantity {
    ($(#[$meta:meta])* $name:ident, $kind:literal, $unit:literal) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
        pub struct $name(pub f64);

        impl $crate::prelude::Quantity for $name {
            const KIND: $crate::prelude::Kind<'static> = $crate::prelude::Kind { name: $kind, unit: $unit };

            fn new(value: f64) -> Self {
                Self(value)
            }

            fn value(self) -> f64 {
                self.0
            }
        }

        impl ::core::fmt::Display for $name {
            fn fmt(&self, formatter: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                formatter.write_str(&<Self as $crate::prelude::Quantity>::KIND.display(self.0))
            }
        }

        impl $crate::prelude::serde::Serialize for $name {
            fn serialize<S: $crate::prelude::serde::Serializer>(&self, serializer: S) -> ::core::result::Result<S::Ok, S::Error> {
                $crate::prelude::serialize_quantity(self.0, serializer)
            }
        }

        impl<'de> $crate::prelude::serde::Deserialize<'de> for $name {
            fn deserialize<D: $crate::prelude::serde::Deserializer<'de>>(
                deserializer: D,
            ) -> ::core::result::Result<Self, D::Error> {
                $crate::prelude::deserialize_quantity(deserializer)
            }
        }

        impl $crate::prelude::schemars::JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> ::std::borrow::Cow<'static, str> {
                ::std::borrow::Cow::Borrowed(::core::stringify!($name))
            }

            fn schema_id() -> ::std::borrow::Cow<'static, str> {
                ::std::borrow::Cow::Borrowed(::core::concat!(::core::module_path!(), "::", ::core::stringify!($name)))
            }

            fn json_schema(_: &mut $crate::prelude::schemars::SchemaGenerator) -> $crate::prelude::schemars::Schema {
                $crate::prelude::quantity_schema(<Self as $crate::prelude::Quantity>::KIND)
            }
        }
    };
}

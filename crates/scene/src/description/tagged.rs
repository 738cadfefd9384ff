//! Tables of a scene file whose key `type` selects an enum variant.

use toml::Table;

use crate::tree::ReadError;

/// An enum whose variant is selected by the key `type`.
pub(crate) trait Tagged: Sized {
    /// The values of `type`.
    const TYPES: &'static [&'static str];

    /// Reads a table whose key `type` has the value `tag`; `body` contains the other keys. Returns `None` if the type
    /// is unknown.
    fn read(tag: &str, body: Table) -> Option<Result<Self, ReadError>>;
}

/// Defines a [`Tagged`] enum. With serde's `tag` alone, errors lose the path of the key.
macro_rules! tagged {
    ($(#[$doc:meta])* $name:ident {
        $($(#[doc = $variant_doc:literal])* $tag:literal => $variant:ident($body:ident),)+
    }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[serde(tag = "type")]
        #[allow(clippy::large_enum_variant, reason = "a scene has few values of this type")]
        pub enum $name {
            $($(#[doc = $variant_doc])* #[serde(rename = $tag)] $variant($body),)+
        }

        $(
            impl From<$body> for $name {
                fn from(body: $body) -> Self {
                    Self::$variant(body)
                }
            }
        )+

        impl Tagged for $name {
            const TYPES: &'static [&'static str] = &[$($tag),+];

            fn read(tag: &str, body: toml::Table) -> Option<Result<Self, crate::tree::ReadError>> {
                let body = toml::Value::Table(body);
                match tag {
                    $($tag => Some(crate::tree::read(body).map(Self::$variant)),)+
                    _ => None,
                }
            }
        }

        #[cfg(test)]
        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                let types = vec![$(($tag, concat!($($variant_doc),*), generator.subschema_for::<$body>()),)+];
                crate::description::tagged_schema::tagged(generator, stringify!($name), types)
            }
        }
    };
}

pub(super) use tagged;

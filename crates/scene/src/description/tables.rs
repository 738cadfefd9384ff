//! Deserializer of descriptions from tables of a scene file. Unlike the deserializer of the crate `toml`, this
//! deserializer does not accept a list of values instead of a table.

use serde::de::value::{MapDeserializer, SeqDeserializer};
use serde::de::{DeserializeOwned, Deserializer, Error as _, IntoDeserializer, Unexpected, Visitor};
use serde::forward_to_deserialize_any;
use toml::de::Error;
use toml::{Table, Value};

/// A serde error with the path of the value.
pub(crate) type ReadError = serde_path_to_error::Error<Error>;

/// Reads a description from a table.
pub(crate) fn read<T: DeserializeOwned>(table: Table) -> Result<T, ReadError> {
    serde_path_to_error::deserialize(ValueReader(Value::Table(table)))
}

struct ValueReader(Value);

impl IntoDeserializer<'_, Error> for ValueReader {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for ValueReader {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.0 {
            Value::Array(list) => {
                let length = list.len();
                let mut values = SeqDeserializer::new(list.into_iter().map(ValueReader));
                let read = visitor.visit_seq(&mut values)?;
                let end = values.end();
                end.map_err(|_: Error| Error::invalid_length(length, &"fewer elements in array"))?;
                Ok(read)
            }
            Value::Table(table) => {
                let pairs = table.into_iter().map(|(key, value)| (key, ValueReader(value)));
                visitor.visit_map(MapDeserializer::new(pairs))
            }
            // `Value::deserialize_any` would generate the derived code of tables and lists a second time.
            Value::Boolean(value) => visitor.visit_bool(value),
            Value::Integer(value) => visitor.visit_i64(value),
            Value::Float(value) => visitor.visit_f64(value),
            Value::String(value) => visitor.visit_string(value),
            Value::Datetime(value) => visitor.visit_string(value.to_string()),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match self.0 {
            Value::Array(_) => Err(Error::invalid_type(Unexpected::Seq, &visitor)),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(self)
    }

    /// Enums of a scene file are strings.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match self.0 {
            Value::String(name) => visitor.visit_enum(name.into_deserializer()),
            _ => Err(Error::invalid_type(Unexpected::UnitVariant, &"string only")),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple tuple_struct map
        identifier ignored_any
    }
}

//! Deserializer of the values of TOML and JSON files. Its errors have a type, and the key path of the value.
//!
//! serde generates code for each pair of a type and a deserializer, which dominated the compile time of this crate.
//! This deserializer therefore tracks the path itself, and asks for lists and tables only where a type expects them.
//! It does not accept a list instead of a struct, unlike those of the crates `toml` and `serde_json`.

use std::fmt;
use std::vec;

use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Error as _, Expected, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, Visitor,
};
use serde::forward_to_deserialize_any;

use crate::key_path::{KeyPath, Segment};

/// A value of a file.
pub trait Tree: Sized {
    /// The keys and values of a table.
    type Entries: Iterator<Item = (String, Self)>;

    fn node(self) -> Node<Self>;
}

/// The kinds of values.
pub enum Node<T: Tree> {
    Null,
    Bool(bool),
    Signed(i64),
    Unsigned(u64),
    Float(f64),
    Text(String),
    List(vec::IntoIter<T>),
    Table(T::Entries),
}

impl Tree for toml::Value {
    type Entries = toml::map::IntoIter<String, Self>;

    fn node(self) -> Node<Self> {
        match self {
            Self::Boolean(value) => Node::Bool(value),
            Self::Integer(value) => Node::Signed(value),
            Self::Float(value) => Node::Float(value),
            Self::String(text) => Node::Text(text),
            Self::Datetime(time) => Node::Text(time.to_string()),
            Self::Array(list) => Node::List(list.into_iter()),
            Self::Table(table) => Node::Table(table.into_iter()),
        }
    }
}

impl Tree for serde_json::Value {
    type Entries = serde_json::map::IntoIter;

    fn node(self) -> Node<Self> {
        match self {
            Self::Null => Node::Null,
            Self::Bool(value) => Node::Bool(value),
            Self::Number(number) => match (number.as_u64(), number.as_i64()) {
                (Some(value), _) => Node::Unsigned(value),
                (None, Some(value)) => Node::Signed(value),
                (None, None) => Node::Float(number.as_f64().unwrap_or(f64::NAN)),
            },
            Self::String(text) => Node::Text(text),
            Self::Array(list) => Node::List(list.into_iter()),
            Self::Object(table) => Node::Table(table.into_iter()),
        }
    }
}

/// The error of a value, a table or a key.
#[derive(Debug)]
pub struct ReadError {
    /// Key path; of a missing key, that of its table.
    pub key: KeyPath,
    pub fault: Fault,
}

#[derive(Debug)]
pub enum Fault {
    /// The last segment of the path is unknown; the names of all keys.
    UnknownKey(&'static [&'static str]),
    MissingKey(&'static str),
    /// The value in terms of JSON, and what serde expected.
    Mismatch {
        found: String,
        expected: String,
    },
    Other(String),
}

/// Reads a value as a type.
pub fn read<T: DeserializeOwned>(value: impl Tree) -> Result<T, ReadError> {
    T::deserialize(Reader(value.node())).map_err(|mut error| {
        error.key.0.reverse();
        error
    })
}

impl From<Fault> for ReadError {
    fn from(fault: Fault) -> Self {
        let key = KeyPath::default();
        Self { key, fault }
    }
}

impl ReadError {
    /// Adds the outer segment of the path; [`read`] reverses the segments.
    #[cold]
    fn within(mut self, segment: Segment) -> Self {
        self.key.0.push(segment);
        self
    }
}

impl std::error::Error for ReadError {}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.fault {
            Fault::UnknownKey(_) => f.write_str("unknown key"),
            Fault::MissingKey(key) => write!(f, "{key:?} is missing"),
            Fault::Mismatch { found, expected } => write!(f, "expected {expected}, found {found}"),
            Fault::Other(message) => f.write_str(message),
        }
    }
}

impl serde::de::Error for ReadError {
    #[cold]
    fn custom<M: fmt::Display>(message: M) -> Self {
        Self::from(Fault::Other(message.to_string()))
    }

    #[cold]
    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::from(Fault::Mismatch {
            found: in_json(found),
            expected: expected.to_string(),
        })
    }

    #[cold]
    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    #[cold]
    fn invalid_length(count: usize, expected: &dyn Expected) -> Self {
        let plural = if count == 1 { "" } else { "s" };
        Self::from(Fault::Mismatch {
            found: format!("a list of {count} value{plural}"),
            expected: expected.to_string(),
        })
    }

    #[cold]
    fn unknown_variant(name: &str, names: &'static [&'static str]) -> Self {
        Self::from(Fault::Mismatch {
            found: in_json(Unexpected::Str(name)),
            expected: choice(names),
        })
    }

    #[cold]
    fn unknown_field(_: &str, names: &'static [&'static str]) -> Self {
        Self::from(Fault::UnknownKey(names))
    }

    #[cold]
    fn missing_field(key: &'static str) -> Self {
        Self::from(Fault::MissingKey(key))
    }
}

fn in_json(value: Unexpected<'_>) -> String {
    match value {
        Unexpected::Unit => "null".to_owned(),
        Unexpected::Bool(value) => value.to_string(),
        Unexpected::Signed(value) => value.to_string(),
        Unexpected::Unsigned(value) => value.to_string(),
        Unexpected::Float(value) => format!("{value:?}"),
        Unexpected::Str(text) => format!("{text:?}"),
        Unexpected::Seq => "a list".to_owned(),
        Unexpected::Map => "an object".to_owned(),
        other => other.to_string(),
    }
}

/// Formats names as `one of "a", "b"`.
fn choice(names: &[&str]) -> String {
    match names {
        [name] => format!("{name:?}"),
        [first, second] => format!("{first:?} or {second:?}"),
        names => {
            let quoted: Vec<String> = names.iter().map(|name| format!("{name:?}")).collect();
            format!("one of {}", quoted.join(", "))
        }
    }
}

/// Deserializer of a value.
struct Reader<T: Tree>(Node<T>);

impl<T: Tree> Reader<T> {
    /// Reads a value that is neither a list nor a table.
    fn scalar<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        match self.0 {
            Node::Null => visitor.visit_unit(),
            Node::Bool(value) => visitor.visit_bool(value),
            Node::Signed(value) => visitor.visit_i64(value),
            Node::Unsigned(value) => visitor.visit_u64(value),
            Node::Float(value) => visitor.visit_f64(value),
            Node::Text(text) => visitor.visit_string(text),
            Node::List(_) | Node::Table(_) => Err(self.mismatch(&visitor)),
        }
    }

    fn list<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        let Node::List(values) = self.0 else {
            return Err(self.mismatch(&visitor));
        };
        let count = values.len();
        let mut list = List { values, index: 0 };
        let read = visitor.visit_seq(&mut list)?;
        match list.values.len() {
            0 => Ok(read),
            _ => Err(ReadError::invalid_length(count, &"fewer elements in array")),
        }
    }

    fn table<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        match self.0 {
            Node::Table(entries) => visitor.visit_map(Table::<T> { entries, entry: None }),
            _ => Err(self.mismatch(&visitor)),
        }
    }

    #[cold]
    fn mismatch(&self, expected: &dyn Expected) -> ReadError {
        let found = match &self.0 {
            Node::Null => Unexpected::Unit,
            Node::Bool(value) => Unexpected::Bool(*value),
            Node::Signed(value) => Unexpected::Signed(*value),
            Node::Unsigned(value) => Unexpected::Unsigned(*value),
            Node::Float(value) => Unexpected::Float(*value),
            Node::Text(text) => Unexpected::Str(text),
            Node::List(_) => Unexpected::Seq,
            Node::Table(_) => Unexpected::Map,
        };
        ReadError::invalid_type(found, expected)
    }
}

/// Defines methods that call a method of [`Reader`].
macro_rules! methods {
    ($target:ident: $($name:ident($($_:ty),*))*) => {
        $(fn $name<V: Visitor<'de>>(self, $(_: $_,)* visitor: V) -> Result<V::Value, ReadError> {
            self.$target(visitor)
        })*
    };
}

impl<'de, T: Tree> Deserializer<'de> for Reader<T> {
    type Error = ReadError;

    methods! { scalar: deserialize_bool() deserialize_u32() deserialize_u64() deserialize_f32() deserialize_f64() }
    methods! { scalar: deserialize_str() deserialize_string() }
    methods! { list: deserialize_seq() deserialize_tuple(usize) deserialize_tuple_struct(&'static str, usize) }
    methods! { table: deserialize_map() deserialize_struct(&'static str, &'static [&'static str]) }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        match self.0 {
            Node::List(_) => self.list(visitor),
            Node::Table(_) => self.table(visitor),
            _ => self.scalar(visitor),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        match self.0 {
            Node::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_newtype_struct(self)
    }

    /// Enums are strings.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        names: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        match self.0 {
            Node::Text(name) => visitor.visit_enum(name.into_deserializer()),
            _ => Err(self.mismatch(&&*choice(names))),
        }
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! { i8 i16 i32 i64 i128 u8 u16 u128 char bytes byte_buf unit unit_struct identifier }
}

struct List<T> {
    values: vec::IntoIter<T>,
    /// Index of the next value.
    index: usize,
}

impl<'de, T: Tree> SeqAccess<'de> for &mut List<T> {
    type Error = ReadError;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, ReadError> {
        let Some(value) = self.values.next() else {
            return Ok(None);
        };
        let index = self.index;
        self.index += 1;
        let read = seed.deserialize(Reader(value.node()));
        read.map(Some).map_err(|error| error.within(index.into()))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.values.len())
    }
}

struct Table<T: Tree> {
    entries: T::Entries,
    /// The entry whose key was read last.
    entry: Option<(String, T)>,
}

impl<'de, T: Tree> MapAccess<'de> for Table<T> {
    type Error = ReadError;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, ReadError> {
        let Some((key, value)) = self.entries.next() else {
            return Ok(None);
        };
        let read = seed.deserialize(key.as_str().into_deserializer());
        match read {
            Ok(read) => {
                self.entry = Some((key, value));
                Ok(Some(read))
            }
            Err(error) => Err(ReadError::within(error, Segment::Key(key))),
        }
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, ReadError> {
        let Some((key, value)) = self.entry.take() else {
            return Err(ReadError::custom("a value is read without its key"));
        };
        let read = seed.deserialize(Reader(value.node()));
        read.map_err(|error: ReadError| error.within(Segment::Key(key)))
    }
}

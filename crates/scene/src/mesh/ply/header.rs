//! PLY headers: elements and property types.

use super::super::damage::{self, Defects};
use super::super::error::{Location, MeshFault, quoted};
use super::super::tokens::Tokens;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    Binary { is_big_endian: bool },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn from_name(name: &[u8]) -> Option<Scalar> {
        Some(match name {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    pub fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// Returns the maximum of an integer type; `None` for floats.
    pub fn max_value(self) -> Option<f64> {
        Some(match self {
            Scalar::I8 => i8::MAX.into(),
            Scalar::U8 => u8::MAX.into(),
            Scalar::I16 => i16::MAX.into(),
            Scalar::U16 => u16::MAX.into(),
            Scalar::I32 => i32::MAX.into(),
            Scalar::U32 => u32::MAX.into(),
            Scalar::F32 | Scalar::F64 => return None,
        })
    }

    pub fn is_integer(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }
}

pub(super) struct Property {
    pub name: String,
    /// Type of the length of a list; `None` if the property is not a list.
    pub count: Option<Scalar>,
    pub scalar: Scalar,
}

pub(super) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
    pub location: Location,
}

pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
}

impl Header {
    /// Returns the number of rows with values.
    pub fn rows(&self) -> u128 {
        let with_values = self.elements.iter().filter(|element| !element.properties.is_empty());
        with_values.map(|element| element.count as u128).sum()
    }
}

pub(super) fn header(words: &mut Tokens, defects: &mut Defects) -> Result<Header, MeshFault> {
    if words.next_on_line() != Some(&b"ply"[..]) {
        return Err(words.fault("the file must begin with \"ply\""));
    }
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        if !words.skip_line() {
            return Err(words.fault("the file ends inside the header; \"end_header\" is missing"));
        }
        match words.next_on_line() {
            None | Some(b"comment" | b"obj_info") => {}
            Some(b"format") => {
                let name = words.next_on_line().unwrap_or_default();
                format = Some(match name {
                    b"ascii" => Format::Ascii,
                    b"binary_little_endian" => Format::Binary { is_big_endian: false },
                    b"binary_big_endian" => Format::Binary { is_big_endian: true },
                    _ => {
                        let rule = "must be ascii, binary_little_endian or binary_big_endian";
                        return Err(words.fault(format!("format: {} {rule}", quoted(name))));
                    }
                });
                let version = words.next_on_line().unwrap_or_default();
                if version != &b"1.0"[..] {
                    return Err(words.fault(format!("format: version {} must be 1.0", quoted(version))));
                }
            }
            Some(b"element") => {
                let name = String::from_utf8_lossy(words.next_on_line().unwrap_or_default()).into_owned();
                let count = words.next_on_line().unwrap_or_default();
                let count = std::str::from_utf8(count)
                    .ok()
                    .and_then(|count| count.parse().ok())
                    .ok_or_else(|| {
                        let rule = "must be a non-negative whole number that fits into memory";
                        words.fault(format!("element {name:?}: count {} {rule}", quoted(count)))
                    })?;
                elements.push(Element {
                    name,
                    count,
                    properties: Vec::new(),
                    location: words.location(),
                });
            }
            Some(b"property") => {
                let property = property(words)?;
                match elements.last_mut() {
                    Some(element) => element.properties.push(property),
                    None => return Err(words.fault("a property must follow its element")),
                }
            }
            Some(b"end_header") => break,
            Some(word) => {
                let rule = "must be \"format\", \"comment\", \"obj_info\", \"element\", \"property\" or \"end_header\"";
                defects.add(damage::LINE, || words.fault(format!("{} {rule}", quoted(word))));
            }
        }
    }
    words.skip_line();
    match format {
        Some(format) => Ok(Header { format, elements }),
        None => Err(words.fault("the header must have a line \"format\"")),
    }
}

fn property(words: &mut Tokens) -> Result<Property, MeshFault> {
    let scalar = |words: &Tokens, name: &[u8]| {
        Scalar::from_name(name).ok_or_else(|| {
            let rule = "must be a type: char, uchar, short, ushort, int, uint, float or double";
            words.fault(format!("property: {} {rule}", quoted(name)))
        })
    };
    let mut kind = words.next_on_line().unwrap_or_default();
    let mut count = None;
    if kind == &b"list"[..] {
        let word = words.next_on_line().unwrap_or_default();
        let length_type = scalar(words, word)?;
        if !length_type.is_integer() {
            return Err(words.fault(format!("property: {} must be an integer type", quoted(word))));
        }
        count = Some(length_type);
        kind = words.next_on_line().unwrap_or_default();
    }
    let scalar = scalar(words, kind)?;
    match words.next_on_line() {
        Some(name) => Ok(Property {
            name: String::from_utf8_lossy(name).into_owned(),
            count,
            scalar,
        }),
        None => Err(words.fault("property: the name is missing")),
    }
}

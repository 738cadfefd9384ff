//! PLY values: ASCII, or binary with either byte order.

use super::super::error::{Location, MeshFault, quoted};
use super::super::tokens::{self, Tokens};
use super::header::Scalar;

pub(super) trait Values {
    fn next(&mut self, scalar: Scalar) -> Result<f64, MeshFault>;
    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), MeshFault>;
    fn min_bytes(&self, scalar: Scalar) -> usize;
    fn bytes_left(&self) -> usize;
    fn location(&mut self) -> Location;
    /// Ends a row. Returns the location of the row if the row has unread values.
    fn end_row(&mut self) -> Option<Location> {
        None
    }
}

pub(super) struct Ascii<'a> {
    pub words: Tokens<'a>,
    /// True if each row is one line.
    pub row_per_line: bool,
}

impl Values for Ascii<'_> {
    #[inline]
    fn next(&mut self, _: Scalar) -> Result<f64, MeshFault> {
        match self.words.next_word() {
            Some(word) => {
                tokens::number(word).ok_or_else(|| self.words.fault(format!("{} must be a number", quoted(word))))
            }
            None => Err(self.words.fault("the file ends too early: values are missing")),
        }
    }

    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), MeshFault> {
        (0..count).try_for_each(|_| self.next(scalar).map(|_| ()))
    }

    /// A value has at least a digit and a separator; `bytes_left` includes a separator for the last value.
    fn min_bytes(&self, _: Scalar) -> usize {
        2
    }

    fn bytes_left(&self) -> usize {
        self.words.bytes_left() + 1
    }

    fn location(&mut self) -> Location {
        self.words.find_next_word();
        self.words.location()
    }

    fn end_row(&mut self) -> Option<Location> {
        let location = self.words.location();
        (self.row_per_line && self.words.skip_rest()).then_some(location)
    }
}

pub(super) struct Binary<'a> {
    pub bytes: &'a [u8],
    pub offset: usize,
    pub is_big_endian: bool,
}

impl Binary<'_> {
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], MeshFault> {
        let Some(bytes) = self.bytes[self.offset..].first_chunk::<N>() else {
            return Err(self.truncated());
        };
        self.offset += N;
        let mut bytes = *bytes;
        if self.is_big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    #[cold]
    fn truncated(&self) -> MeshFault {
        Location::Byte(self.offset).fault("the file ends too early: values are missing")
    }
}

impl Values for Binary<'_> {
    #[inline]
    fn next(&mut self, scalar: Scalar) -> Result<f64, MeshFault> {
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.take()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.take()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.take()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.take()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.take()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.take()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.take()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), MeshFault> {
        match count.checked_mul(scalar.size()) {
            Some(size) if size <= self.bytes_left() => {
                self.offset += size;
                Ok(())
            }
            _ => Err(self.truncated()),
        }
    }

    fn min_bytes(&self, scalar: Scalar) -> usize {
        scalar.size()
    }

    fn bytes_left(&self) -> usize {
        self.bytes.len() - self.offset
    }

    fn location(&mut self) -> Location {
        Location::Byte(self.offset)
    }
}

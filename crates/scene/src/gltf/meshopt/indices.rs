//! Decoder of meshopt modes 1 (triangle lists) and 2 (index sequences) (`KHR_meshopt_compression`, appendix A).

use super::{TOO_LONG, TOO_SHORT};

/// Decodes a triangle list of `count` indices with `size` bytes each.
pub(super) fn triangles(stream: &[u8], count: usize, size: usize) -> Result<Vec<u8>, &'static str> {
    if stream.first() != Some(&0xe1) {
        return Err("the stream must begin with the byte 0xe1");
    }
    let (codes, rest) = stream[1..].split_at_checked(count / 3).ok_or(TOO_SHORT)?;
    let (data, table) = rest.split_last_chunk::<16>().ok_or(TOO_SHORT)?;
    if table[14..] != [0, 0] || table.iter().any(|entry| entry >> 4 == 15 || entry & 15 == 15) {
        return Err("the table of the stream must not contain the nibble 15, and must end with two zero bytes");
    }
    let mut decoder = Decoder {
        numbers: Numbers { data },
        next: 0,
        last: 0,
        edges: Fifo::default(),
        vertices: Fifo::default(),
    };
    let mut bytes = Vec::with_capacity(count * size);
    for code in codes {
        for index in decoder.triangle(*code, table)? {
            bytes.extend_from_slice(&index.to_le_bytes()[..size]);
        }
    }
    match decoder.numbers.data.is_empty() {
        true => Ok(bytes),
        false => Err(TOO_LONG),
    }
}

/// Decodes a sequence of `count` indices with `size` bytes each.
pub(super) fn indices(stream: &[u8], count: usize, size: usize) -> Result<Vec<u8>, &'static str> {
    if stream.first() != Some(&0xd1) {
        return Err("the stream must begin with the byte 0xd1");
    }
    let (data, _) = stream[1..].split_last_chunk::<4>().ok_or(TOO_SHORT)?;
    if count > data.len() {
        return Err(TOO_SHORT);
    }
    let mut numbers = Numbers { data };
    let mut last = [0u32; 2];
    let mut bytes = Vec::with_capacity(count * size);
    for _ in 0..count {
        let number = numbers.next()?;
        let last = &mut last[(number & 1) as usize];
        *last = last.wrapping_add(zigzag_decoded(number >> 1));
        bytes.extend_from_slice(&last.to_le_bytes()[..size]);
    }
    match numbers.data.is_empty() {
        true => Ok(bytes),
        false => Err(TOO_LONG),
    }
}

/// Decodes a zigzag-encoded integer, which has its sign in the lowest bit.
fn zigzag_decoded(number: u32) -> u32 {
    (number >> 1) ^ (number & 1).wrapping_neg()
}

/// Reads bytes, and variable-length integers with 7 bits per byte.
struct Numbers<'a> {
    data: &'a [u8],
}

impl Numbers<'_> {
    fn byte(&mut self) -> Result<u8, &'static str> {
        let (byte, rest) = self.data.split_first().ok_or(TOO_SHORT)?;
        self.data = rest;
        Ok(*byte)
    }

    fn next(&mut self) -> Result<u32, &'static str> {
        let mut number = 0;
        for i in 0..5 {
            let byte = self.byte()?;
            number |= u32::from(byte & 127) << (7 * i);
            if byte < 128 {
                return Ok(number);
            }
        }
        Err("the numbers of the stream must have at most 5 bytes")
    }
}

#[derive(Default)]
struct Fifo<T> {
    entries: [T; 16],
    pushed: usize,
}

impl<T: Copy> Fifo<T> {
    fn push(&mut self, entry: T) {
        self.entries[self.pushed % 16] = entry;
        self.pushed += 1;
    }

    /// Returns an entry by its age: 0 for the newest, at most 15.
    fn get(&self, age: u8) -> Result<T, &'static str> {
        let age = usize::from(age);
        match age < self.pushed {
            true => Ok(self.entries[(self.pushed - 1 - age) % 16]),
            false => Err("the stream must only refer to earlier edges and vertices"),
        }
    }
}

struct Decoder<'a> {
    numbers: Numbers<'a>,
    /// The next new index; new indices are in ascending order.
    next: u32,
    /// The last index that was coded as a delta.
    last: u32,
    edges: Fifo<[u32; 2]>,
    vertices: Fifo<u32>,
}

impl Decoder<'_> {
    fn triangle(&mut self, code: u8, table: &[u8; 16]) -> Result<[u32; 3], &'static str> {
        let (high, low) = (code >> 4, code & 15);
        if high == 15 {
            return self.corners(low, table);
        }
        let [a, b] = self.edges.get(high)?;
        let c = match low {
            0 => self.next_index(),
            1..13 => self.vertices.get(low)?,
            13 | 14 => {
                let step = if low == 13 { u32::MAX } else { 1 };
                self.last = self.last.wrapping_add(step);
                self.last
            }
            _ => self.explicit_index()?,
        };
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        if !(1..13).contains(&low) {
            self.vertices.push(c);
        }
        Ok([a, b, c])
    }

    /// Decodes a triangle that shares no edge of the FIFO.
    fn corners(&mut self, low: u8, table: &[u8; 16]) -> Result<[u32; 3], &'static str> {
        let codes = match low {
            0..14 => table[usize::from(low)],
            _ => {
                let codes = self.numbers.byte()?;
                if codes == 0 {
                    self.next = 0;
                }
                codes
            }
        };
        let (second, third) = (codes >> 4, codes & 15);
        let a = if low == 15 {
            self.explicit_index()?
        } else {
            self.next_index()
        };
        let b = self.corner(second)?;
        let c = self.corner(third)?;
        self.edges.push([b, a]);
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        self.vertices.push(a);
        for (code, vertex) in [(second, b), (third, c)] {
            if code == 0 || code == 15 {
                self.vertices.push(vertex);
            }
        }
        Ok([a, b, c])
    }

    fn corner(&mut self, code: u8) -> Result<u32, &'static str> {
        match code {
            0 => Ok(self.next_index()),
            15 => self.explicit_index(),
            _ => self.vertices.get(code - 1),
        }
    }

    /// Returns the next new index.
    fn next_index(&mut self) -> u32 {
        let index = self.next;
        self.next = index.wrapping_add(1);
        index
    }

    /// Reads an index that is coded as a delta.
    fn explicit_index(&mut self) -> Result<u32, &'static str> {
        self.last = self.last.wrapping_add(zigzag_decoded(self.numbers.next()?));
        Ok(self.last)
    }
}

//! Decoder of delta-coded attributes, meshopt mode 0 (`KHR_meshopt_compression`, appendix A).

use super::{TOO_LONG, TOO_SHORT};

/// Number of elements in a group; the deltas of a group have the same width.
const GROUP: usize = 16;
/// Maximum number of elements in a block.
const BLOCK: usize = 256;

/// Delta widths in bits by group header: for version 0, and for control modes 0 and 1 of version 1.
const WIDTHS: [[u32; 4]; 3] = [[0, 2, 4, 8], [0, 1, 2, 4], [1, 2, 4, 8]];

/// Delta coding of four bytes of an element.
#[derive(Clone, Copy)]
enum Channel {
    Bytes,
    Pairs,
    /// Rotation of the delta in bits.
    Xor(u32),
}

/// Decodes `count` elements of `stride` bytes, a multiple of 4 and at most 256.
pub(super) fn attributes(stream: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, &'static str> {
    let (version, channels, min_tail) = match stream.first() {
        Some(0xa0) => (0, 0, 32),
        Some(0xa1) => (1, stride / 4, 24),
        _ => return Err("the stream must begin with the byte 0xa0 or 0xa1"),
    };
    let tail = (stride + channels).max(min_tail);
    let Some(end) = stream.len().checked_sub(tail).filter(|end| *end >= 1) else {
        return Err(TOO_SHORT);
    };
    let mut data = &stream[1..end];
    let (rest, modes) = stream.split_at(stream.len() - channels);
    let mut last = [0; 256];
    last[..stride].copy_from_slice(&rest[rest.len() - stride..]);
    let mut kinds = [Channel::Bytes; 64];
    for (kind, mode) in kinds.iter_mut().zip(modes) {
        *kind = match (mode & 15, mode >> 4) {
            (0, 0) => Channel::Bytes,
            (1, 0) => Channel::Pairs,
            (2, bits) => Channel::Xor(u32::from(bits)),
            _ => return Err("the channel modes of the stream must be 0, 1 or 2, and only mode 2 may have a rotation"),
        };
    }
    let max_elements = ((8192 / stride) & !(GROUP - 1)).min(BLOCK);
    // Each block has at least one byte per channel, so this check limits the size of `elements`.
    if count.div_ceil(max_elements).saturating_mul(stride / 4) > data.len() {
        return Err(TOO_SHORT);
    }
    let mut elements = vec![0; count * stride];
    for block in elements.chunks_mut(max_elements * stride) {
        let length = block.len() / stride;
        let groups = length.div_ceil(GROUP);
        let controls = match version {
            0 => &[],
            _ => take(&mut data, stride / 4)?,
        };
        for (channel, kind) in kinds[..stride / 4].iter().enumerate() {
            let mut deltas = [[0; BLOCK]; 4];
            for (k, deltas) in deltas.iter_mut().enumerate() {
                let widths = match controls.get(channel).map(|control| control >> (2 * k) & 3) {
                    None => WIDTHS[0],
                    Some(0) => WIDTHS[1],
                    Some(1) => WIDTHS[2],
                    Some(2) => continue, // all deltas are zero
                    Some(_) => {
                        deltas[..length].copy_from_slice(take(&mut data, length)?);
                        continue;
                    }
                };
                let headers = take(&mut data, groups.div_ceil(4))?;
                for (i, group) in deltas.as_chunks_mut::<GROUP>().0[..groups].iter_mut().enumerate() {
                    let width = widths[usize::from(headers[i / 4] >> (2 * (i % 4)) & 3)];
                    *group = read_group(&mut data, width)?;
                }
            }
            let offset = 4 * channel;
            let before = [last[offset], last[offset + 1], last[offset + 2], last[offset + 3]];
            let after = decode_channel(*kind, &deltas, before, &mut block[offset..], stride, length);
            last[offset..offset + 4].copy_from_slice(&after);
        }
    }
    match data.is_empty() {
        true => Ok(elements),
        false => Err(TOO_LONG),
    }
}

fn take<'a>(data: &mut &'a [u8], count: usize) -> Result<&'a [u8], &'static str> {
    let (taken, rest) = data.split_at_checked(count).ok_or(TOO_SHORT)?;
    *data = rest;
    Ok(taken)
}

/// Decodes the deltas of a group. A delta with all bits set is an escape code: the value follows as a byte.
fn read_group(data: &mut &[u8], width: u32) -> Result<[u8; GROUP], &'static str> {
    let mut deltas = [0; GROUP];
    if width == 0 {
        return Ok(deltas);
    }
    let packed = take(data, 2 * width as usize)?;
    if width == 8 {
        deltas.copy_from_slice(packed);
        return Ok(deltas);
    }
    let escape = (1 << width) - 1;
    let per_byte = 8 / width;
    for (i, delta) in deltas.iter_mut().enumerate() {
        let i = i as u32;
        let byte = packed[(i / per_byte) as usize];
        let slot = i % per_byte;
        // Single-bit deltas start at the lowest bit of a byte, wider deltas at the highest bit.
        let shift = if width == 1 { slot } else { 8 - width * (slot + 1) };
        *delta = byte >> shift & escape;
    }
    for delta in &mut deltas {
        if *delta == escape {
            *delta = take(data, 1)?[0];
        }
    }
    Ok(deltas)
}

/// Decodes a channel of a block; returns the channel of the last element.
fn decode_channel(
    kind: Channel,
    deltas: &[[u8; BLOCK]; 4],
    before: [u8; 4],
    elements: &mut [u8],
    stride: usize,
    length: usize,
) -> [u8; 4] {
    let mut values = before;
    for (i, element) in elements.chunks_mut(stride).take(length).enumerate() {
        let delta = [deltas[0][i], deltas[1][i], deltas[2][i], deltas[3][i]];
        values = match kind {
            Channel::Bytes => std::array::from_fn(|k| {
                let delta = (delta[k] >> 1) ^ (delta[k] & 1).wrapping_neg();
                values[k].wrapping_add(delta)
            }),
            Channel::Pairs => {
                let pair = |k: usize| {
                    let delta = u16::from_le_bytes([delta[k], delta[k + 1]]);
                    let delta = (delta >> 1) ^ (delta & 1).wrapping_neg();
                    u16::from_le_bytes([values[k], values[k + 1]])
                        .wrapping_add(delta)
                        .to_le_bytes()
                };
                let ([a, b], [c, d]) = (pair(0), pair(2));
                [a, b, c, d]
            }
            Channel::Xor(bits) => {
                let delta = u32::from_le_bytes(delta).rotate_right(bits);
                (u32::from_le_bytes(values) ^ delta).to_le_bytes()
            }
        };
        element[..4].copy_from_slice(&values);
    }
    values
}

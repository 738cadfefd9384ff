//! Tests of the meshopt decoder with reference streams and damaged streams.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::{Compression, parse_compression};
use crate::gltf::made::{container, read};

/// Output of `tests/gltf/meshopt.mjs`.
const STREAMS: &str = include_str!("streams.txt");

struct Stream {
    name: &'static str,
    compression: Compression,
    bytes: Vec<u8>,
    expected: &'static str,
}

fn compression_of(mode: &str, filter: &str, stride: u64, count: u64) -> Result<Compression, String> {
    let extension = json!({
        "buffer": 0, "byteLength": 0, "byteStride": stride, "count": count, "mode": mode, "filter": filter,
    });
    let extensions = json!({ "KHR_meshopt_compression": extension });
    match parse_compression("v", extensions.as_object().unwrap(), stride.wrapping_mul(count)) {
        Ok(compression) => Ok(compression.unwrap()),
        Err(fault) => Err(fault.of("a".as_ref()).to_string()),
    }
}

fn streams() -> Vec<Stream> {
    let streams = STREAMS.lines().map(|line| {
        let fields: Vec<&str> = line.split(' ').collect();
        let [name, mode, filter, stride, count, bytes, expected] = fields[..] else {
            panic!("{line}");
        };
        let compression = compression_of(mode, filter, stride.parse().unwrap(), count.parse().unwrap()).unwrap();
        let bytes = STANDARD.decode(bytes).unwrap();
        Stream {
            name,
            compression,
            bytes,
            expected,
        }
    });
    streams.collect()
}

/// 64-bit FNV-1a.
fn hash(bytes: &[u8]) -> String {
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}

#[test]
fn streams_decode_to_the_results_of_the_reference_decoder() {
    let all = streams();
    assert!(all.len() > 50, "{}", all.len());
    for Stream {
        name,
        compression,
        bytes,
        expected,
    } in all
    {
        let found = compression
            .decode(&bytes)
            .unwrap_or_else(|rule| panic!("{name}: {rule}"));
        assert_eq!(found.len() as u64, compression.size());
        if compression.filter == super::Filter::None {
            assert_eq!(hash(&found), expected, "{name}");
            continue;
        }
        let expected = STANDARD.decode(expected).unwrap();
        assert_eq!(found.len(), expected.len());
        if compression.filter == super::Filter::Exponential {
            // Values must be equal, except for the sign of zeros.
            let floats = |bytes: &[u8]| -> Vec<f32> {
                let words = bytes.as_chunks::<4>().0.iter();
                words.map(|word| f32::from_le_bytes(*word)).collect()
            };
            assert_eq!(floats(&found), floats(&expected), "{name}");
            continue;
        }
        // The specification allows a difference of one unit in the last place.
        let is_color = compression.filter == super::Filter::Color;
        let numbers = |bytes: &[u8]| -> Vec<i32> {
            match (compression.stride, is_color) {
                (4, false) => bytes.iter().map(|x| i32::from(*x as i8)).collect(),
                (4, true) => bytes.iter().map(|x| i32::from(*x)).collect(),
                _ => bytes
                    .as_chunks::<2>()
                    .0
                    .iter()
                    .map(|x| match is_color {
                        false => i32::from(i16::from_le_bytes(*x)),
                        true => i32::from(u16::from_le_bytes(*x)),
                    })
                    .collect(),
            }
        };
        let (found, expected) = (numbers(&found), numbers(&expected));
        for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!((found - expected).abs() <= 1, "{name}: {i}: {found}, not {expected}");
        }
    }
}

#[test]
fn examples_of_the_specification_are_decoded() {
    // Sixteen 4-bit deltas of the first byte.
    let mut stream = vec![0xa0, 2, 0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
    stream.extend([0; 3 + 32]);
    let bytes = compression_of("ATTRIBUTES", "NONE", 4, 16)
        .unwrap()
        .decode(&stream)
        .unwrap();
    let mut sum = 0i32;
    let deltas = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0];
    let expected: Vec<u8> = deltas
        .iter()
        .flat_map(|delta| {
            sum += delta;
            [sum as u8, 0, 0, 0]
        })
        .collect();
    assert_eq!(bytes, expected);
    // Zigzag-coded deltas from the first baseline, with 7 bits per byte.
    let indices = |numbers: &[u8]| {
        let mut stream = vec![0xd1];
        stream.extend(numbers);
        stream.extend([0; 4]);
        compression_of("INDICES", "NONE", 4, 1).unwrap().decode(&stream)
    };
    let word = |x: u32| Ok(x.to_le_bytes().to_vec());
    assert_eq!(indices(&[0x7c]), word(0x7c >> 2));
    assert_eq!(indices(&[0x80, 0x04]), word(0x200 >> 2));
    assert_eq!(indices(&[0xfc, 0xa0, 0x05]), word(0x1507c >> 2));
    assert_eq!(indices(&[0xff, 0xff, 0xff, 0xff, 0x0f]), word(!(u32::MAX >> 2)));
    assert_eq!(
        indices(&[0xff, 0xff, 0xff, 0xff, 0x8f, 0x00]),
        Err("the numbers of the stream must have at most 5 bytes")
    );
    // A triangle with three new indices, and a triangle that shares an edge with the first triangle.
    let mut stream = vec![0xe1, 0xf0, 0x00];
    stream.extend([0; 16]);
    let bytes = compression_of("TRIANGLES", "NONE", 2, 6)
        .unwrap()
        .decode(&stream)
        .unwrap();
    assert_eq!(bytes, [0, 0, 1, 0, 2, 0, 0, 0, 2, 0, 3, 0]);
    // A triangle that shares an edge, although the FIFO is empty.
    let mut stream = vec![0xe1, 0x00];
    stream.extend([0; 16]);
    assert!(
        compression_of("TRIANGLES", "NONE", 2, 3)
            .unwrap()
            .decode(&stream)
            .is_err()
    );
}

#[test]
fn damaged_streams_do_not_panic() {
    let (mut accepted, mut rejected) = (0, 0);
    for Stream {
        name,
        compression,
        bytes,
        ..
    } in streams()
    {
        for length in 0..bytes.len() {
            // In a truncated stream, the tail is at the wrong position.
            if compression.decode(&bytes[..length]).is_ok() {
                panic!("{name}: {length} of {} bytes", bytes.len());
            }
            rejected += 1;
        }
        let mut longer = bytes.clone();
        longer.push(0);
        assert!(compression.decode(&longer).is_err(), "{name}");
        let step = 1 + bytes.len() / 300;
        for position in (0..bytes.len()).step_by(step) {
            for change in [1, 0x10, 0x80, 0xff] {
                let mut bytes = bytes.clone();
                bytes[position] ^= change;
                match compression.decode(&bytes) {
                    Ok(found) => {
                        assert_eq!(found.len() as u64, compression.size());
                        accepted += 1;
                    }
                    Err(_) => rejected += 1,
                }
            }
        }
    }
    assert!(
        accepted > 1000 && rejected > 1000,
        "accepted: {accepted}, rejected: {rejected}"
    );
}

#[test]
fn small_streams_allocate_little_memory() {
    let huge = 1 << 40;
    for (mode, first) in [
        ("ATTRIBUTES", 0xa0),
        ("ATTRIBUTES", 0xa1),
        ("TRIANGLES", 0xe1),
        ("INDICES", 0xd1),
    ] {
        let compression = compression_of(mode, "NONE", 4, 3 * huge).unwrap();
        let mut stream = vec![0; 100];
        stream[0] = first;
        assert!(compression.decode(&stream).is_err());
    }
    let compression = compression_of("ATTRIBUTES", "NONE", 4, 256 * 10).unwrap();
    let mut stream = vec![0xaa; 1 + 10 + 24];
    stream[0] = 0xa1;
    stream[11..].fill(0);
    assert_eq!(compression.decode(&stream).unwrap(), vec![0; 4 * 2560]);
}

#[test]
fn filters_accept_any_values() {
    let all: Vec<u8> = (0..=255u8)
        .flat_map(|a| [a, a ^ 0x80, 255 - a, 0, 0, a, 1, a])
        .collect();
    for stride in [4, 8] {
        for filter in [
            super::Filter::Octahedral,
            super::Filter::Quaternion,
            super::Filter::Exponential,
            super::Filter::Color,
        ] {
            let mut bytes = all.clone();
            filter.apply(&mut bytes, stride);
            assert_ne!(bytes, all);
        }
    }
    let decoded = |value: i32| {
        let mut bytes = value.to_le_bytes();
        super::Filter::Exponential.apply(&mut bytes, 4);
        f32::from_le_bytes(bytes)
    };
    assert_eq!(decoded(0x0200_0003), 12.0);
    assert_eq!(decoded((-2i32 << 24) | 0x00ff_fffd), -0.75);
    for value in [i32::MIN, i32::MAX, -1, 0x7f00_0001, 0x8000_0001u32 as i32] {
        assert!(!decoded(value).is_nan());
    }
}

#[test]
fn extension_values_are_validated() {
    for (mode, filter, stride, count, expected) in [
        (
            "POINTS",
            "NONE",
            4,
            3,
            "mode: \"POINTS\" must be ATTRIBUTES, TRIANGLES or INDICES",
        ),
        (
            "ATTRIBUTES",
            "NONE",
            0,
            3,
            "byteStride: 0 must be a multiple of 4, from 4 to 256",
        ),
        (
            "ATTRIBUTES",
            "NONE",
            6,
            3,
            "byteStride: 6 must be a multiple of 4, from 4 to 256",
        ),
        (
            "ATTRIBUTES",
            "NONE",
            260,
            3,
            "byteStride: 260 must be a multiple of 4, from 4 to 256",
        ),
        ("TRIANGLES", "NONE", 8, 3, "byteStride: 8 must be 2 or 4 for indices"),
        ("INDICES", "NONE", 1, 3, "byteStride: 1 must be 2 or 4 for indices"),
        ("TRIANGLES", "NONE", 4, 4, "count: 4 must be a multiple of 3"),
        (
            "INDICES",
            "COLOR",
            4,
            3,
            "filter: a filter requires the mode ATTRIBUTES",
        ),
        (
            "ATTRIBUTES",
            "OCTAHEDRAL",
            12,
            3,
            "byteStride: 12 must be 4 or 8 for this filter",
        ),
        (
            "ATTRIBUTES",
            "COLOR",
            12,
            3,
            "byteStride: 12 must be 4 or 8 for this filter",
        ),
        (
            "ATTRIBUTES",
            "QUATERNION",
            4,
            3,
            "byteStride: 4 must be 8 for this filter",
        ),
        (
            "ATTRIBUTES",
            "BLUR",
            4,
            3,
            "filter: \"BLUR\" must be NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL or COLOR",
        ),
        (
            "ATTRIBUTES",
            "NONE",
            4,
            u64::MAX / 2,
            "count: 9223372036854775807 times byteStride 4 must be 18446744073709551612, the size of the view",
        ),
    ] {
        assert_eq!(
            compression_of(mode, filter, stride, count).unwrap_err(),
            format!("a: v.extensions.KHR_meshopt_compression.{expected}")
        );
    }
    assert!(compression_of("ATTRIBUTES", "EXPONENTIAL", 256, 3).is_ok());
}

#[test]
fn compressed_views_are_decoded_once_and_validated() {
    let streams = streams();
    let stream = streams
        .iter()
        .find(|stream| stream.name == "shorts-12-100-0-v0")
        .unwrap();
    let view = |name: &str, changes: &[(&str, Value)]| {
        let mut extension = json!({
            "buffer": 0, "byteOffset": 4, "byteLength": stream.bytes.len(), "byteStride": 12, "count": 100,
            "mode": "ATTRIBUTES",
        });
        for (key, value) in changes {
            extension[*key] = value.clone();
        }
        let mut binary = vec![1; 4];
        binary.extend(&stream.bytes);
        let json = json!({
            "asset": { "version": "2.0" },
            "extensionsRequired": [name],
            "buffers": [
                { "byteLength": binary.len() },
                { "byteLength": 1200, "extensions": { name: { "fallback": true } } },
            ],
            "bufferViews": [
                { "buffer": 1, "byteLength": 1200, "byteStride": 12, "extensions": { name: extension } },
            ],
            "accessors": [
                { "bufferView": 0, "byteOffset": 2, "componentType": 5123, "count": 100, "type": "SCALAR" },
            ],
        });
        read(container(&json, &binary)).map_err(|fault| fault.of("a".as_ref()).to_string())
    };
    for name in super::NAMES {
        let document = view(name, &[]).unwrap();
        let bytes = document.view(0).unwrap();
        assert_eq!(hash(bytes), stream.expected);
        assert_eq!(bytes.as_ptr(), document.view(0).unwrap().as_ptr()); // decoded once
        assert_eq!(
            document.indices(0).unwrap()[99],
            u32::from(bytes[99 * 12 + 2]) + 256 * u32::from(bytes[99 * 12 + 3])
        );
    }
    let name = "EXT_meshopt_compression";
    let message = |key: &str, value: Value| match view(name, &[(key, value)]) {
        Err(message) => message,
        Ok(document) => document.view(0).unwrap_err().to_string(),
    };
    let length = stream.bytes.len();
    let key = format!("bufferViews[0].extensions.{name}");
    assert_eq!(
        message("buffer", json!(2)),
        "a: bufferViews[0]: 2 is out of range; number of buffers: 2"
    );
    assert_eq!(
        message("buffer", json!(1)),
        "a: buffers[1]: has no uri, but buffer views refer to it"
    );
    assert!(message("buffer", json!(-1)).starts_with(&format!("a: {key}.buffer: ")));
    assert!(message("count", json!(99)).starts_with(&format!("a: {key}.count: 99 times byteStride 12 ")));
    let invalid_ranges = [(5, length), (u64::MAX, length), (0, usize::MAX)];
    for (offset, length) in invalid_ranges {
        let message = match view(name, &[("byteOffset", json!(offset)), ("byteLength", json!(length))]) {
            Err(message) => message,
            Ok(document) => document.view(0).unwrap_err().to_string(),
        };
        assert!(
            message.contains(&format!("{key}: offset {offset} and length {length} exceed")),
            "{message}"
        );
    }
    let message = message("byteLength", json!(length - 1));
    assert!(message.contains(&format!("{key}: the stream must ")), "{message}");
    assert!(message.starts_with("/none/a.gltf: "), "{message}");
}

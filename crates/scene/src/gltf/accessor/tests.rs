//! Tests of accessors: component types, layouts and errors.

use serde_json::{Value, json};

use crate::gltf::made::{accessor, document};

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn error_of<T: std::fmt::Debug>(result: Result<T, crate::gltf::error::GltfError>) -> String {
    let text = result.unwrap_err().to_string();
    text.strip_prefix("/none/a.gltf: ").unwrap_or(&text).to_owned()
}

#[test]
fn every_component_type_is_read() {
    let bytes: Vec<u8> = [0x00, 0x01, 0x7f, 0x80, 0x81, 0xff, 0x00, 0x80].to_vec();
    let values = |component: u32, count: usize, normalized: bool| -> Vec<f32> {
        let description = json!({
            "bufferView": 0, "componentType": component, "count": count, "type": "SCALAR", "normalized": normalized
        });
        let document = accessor(&bytes, description);
        assert_eq!(document.components(0).unwrap(), 1);
        document.vectors::<1>(0).unwrap().into_flattened()
    };
    assert_eq!(
        values(5120, 8, false),
        [0.0, 1.0, 127.0, -128.0, -127.0, -1.0, 0.0, -128.0]
    );
    assert_eq!(
        values(5121, 8, false),
        [0.0, 1.0, 127.0, 128.0, 129.0, 255.0, 0.0, 128.0]
    );
    assert_eq!(values(5122, 4, false), [256.0, -32641.0, -127.0, -32768.0]);
    assert_eq!(values(5123, 4, false), [256.0, 32895.0, 65409.0, 32768.0]);
    assert_eq!(values(5125, 2, false), [2_155_807_000.0, 2_147_549_057.0]);
    // Computed with the formulas of section 3.6.2.2, in f64.
    let assert_near = |found: Vec<f32>, expected: &[f64]| {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!((f64::from(*found) - expected).abs() <= 1e-7, "{found} {expected}");
        }
    };
    let bytes = [0.0, 1.0, 127.0, -128.0, -127.0, -1.0, 0.0, -128.0];
    assert_near(values(5120, 8, true), &bytes.map(|c: f64| (c / 127.0).max(-1.0)));
    assert_near(
        values(5121, 8, true),
        &[0.0, 1.0, 127.0, 128.0, 129.0, 255.0, 0.0, 128.0].map(|c| c / 255.0),
    );
    let shorts = [256.0, -32641.0, -127.0, -32768.0];
    assert_near(values(5122, 4, true), &shorts.map(|c: f64| (c / 32767.0).max(-1.0)));
    assert_near(
        values(5123, 4, true),
        &[256.0, 32895.0, 65409.0, 32768.0].map(|c| c / 65535.0),
    );
    assert_eq!(values(5120, 4, true)[3], -1.0);
    assert_eq!(values(5121, 6, true)[5], 1.0);
    assert_eq!(values(5122, 4, true)[3], -1.0);
}

#[test]
fn floats_are_copied_bit_for_bit() {
    let values = [0.0, -0.0, 1.5, f32::MIN_POSITIVE, f32::NAN, f32::INFINITY];
    let document = accessor(
        &floats(&values),
        json!({ "bufferView": 0, "componentType": 5126, "count": 2, "type": "VEC3" }),
    );
    let found = document.vectors::<3>(0).unwrap();
    assert_eq!(found.as_flattened().map_bits(), values.map_bits());
}

trait Bits {
    fn map_bits(&self) -> Vec<u32>;
}

impl Bits for [f32] {
    fn map_bits(&self) -> Vec<u32> {
        self.iter().map(|x| x.to_bits()).collect()
    }
}

#[test]
fn every_type_is_read() {
    let all: Vec<f32> = (0..16).map(|i| i as f32).collect();
    let description = |kind: &str| json!({ "bufferView": 0, "componentType": 5126, "count": 1, "type": kind });
    let bytes = floats(&all);
    assert_eq!(
        accessor(&bytes, description("SCALAR")).vectors::<1>(0).unwrap(),
        [[0.0]]
    );
    assert_eq!(
        accessor(&bytes, description("VEC2")).vectors::<2>(0).unwrap(),
        [[0.0, 1.0]]
    );
    assert_eq!(
        accessor(&bytes, description("VEC3")).vectors::<3>(0).unwrap(),
        [[0.0, 1.0, 2.0]]
    );
    assert_eq!(
        accessor(&bytes, description("VEC4")).vectors::<4>(0).unwrap(),
        [[0.0, 1.0, 2.0, 3.0]]
    );
    assert_eq!(
        accessor(&bytes, description("MAT2")).vectors::<4>(0).unwrap(),
        [[0.0, 1.0, 2.0, 3.0]]
    );
    assert_eq!(
        accessor(&bytes, description("MAT3")).vectors::<9>(0).unwrap()[0],
        all[..9]
    );
    assert_eq!(
        accessor(&bytes, description("MAT4")).vectors::<16>(0).unwrap()[0],
        all[..]
    );
    for (kind, count) in [("SCALAR", 1), ("VEC2", 2), ("MAT2", 4), ("MAT3", 9), ("MAT4", 16)] {
        assert_eq!(accessor(&bytes, description(kind)).components(0).unwrap(), count);
    }
    assert_eq!(
        error_of(accessor(&bytes, description("VEC4")).vectors::<3>(0)),
        "accessors[0].type: number of components of the elements: 4; expected 3"
    );
    assert_eq!(
        error_of(accessor(&bytes, description("VEC4")).vectors::<3>(1)),
        "accessors: 1 is out of range; number of accessors: 1"
    );
}

#[test]
fn columns_of_matrices_begin_at_multiples_of_4_bytes() {
    // The layouts of section 3.6.2.4.
    let matrix = |kind: &str, component: u32, bytes: &[u8]| {
        accessor(
            bytes,
            json!({ "bufferView": 0, "componentType": component, "count": 2, "type": kind }),
        )
    };
    let pad = 99;
    let bytes = [1, 2, pad, pad, 3, 4, pad, pad, 5, 6, pad, pad, 7, 8];
    let found = matrix("MAT2", 5121, &bytes).vectors::<4>(0).unwrap();
    assert_eq!(found, [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]]);
    let bytes = [
        1, 2, 3, pad, 4, 5, 6, pad, 7, 8, 9, pad, 10, 11, 12, pad, 13, 14, 15, pad, 16, 17, 18, pad,
    ];
    let found = matrix("MAT3", 5121, &bytes).vectors::<9>(0).unwrap();
    let nine_from = |first: usize| -> [f32; 9] { std::array::from_fn(|i| (first + i) as f32) };
    assert_eq!(found, [nine_from(1), nine_from(10)]);
    let shorts = |values: &[u16]| -> Vec<u8> { values.iter().flat_map(|x| x.to_le_bytes()).collect() };
    let bytes = shorts(&bytes.map(u16::from));
    let found = matrix("MAT3", 5123, &bytes).vectors::<9>(0).unwrap();
    assert_eq!(found, [nine_from(1), nine_from(10)]);
    // Columns of 4 bytes need no padding.
    let bytes = shorts(&[1, 2, 3, 4, 5, 6, 7, 8]);
    let found = matrix("MAT2", 5123, &bytes).vectors::<4>(0).unwrap();
    assert_eq!(found, [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]]);
    let bytes: Vec<u8> = (0..32).collect();
    let found = matrix("MAT4", 5121, &bytes).vectors::<16>(0).unwrap();
    assert_eq!(found[1], std::array::from_fn(|i| (16 + i) as f32));
}

#[test]
fn elements_are_located_by_offsets_and_strides() {
    // Interleaved positions and colors, unaligned.
    let mut bytes = vec![7; 5];
    for i in 0..3u8 {
        bytes.extend(floats(&[f32::from(i), 10.0, 20.0]));
        bytes.extend([i, 2 * i, 255]);
    }
    let views = json!([{ "buffer": 0, "byteOffset": 4, "byteLength": bytes.len() - 4, "byteStride": 15 }]);
    let accessors = json!([
        { "bufferView": 0, "byteOffset": 1, "componentType": 5126, "count": 3, "type": "VEC3" },
        { "bufferView": 0, "byteOffset": 13, "componentType": 5121, "count": 3, "type": "VEC3" },
    ]);
    let document = document(&bytes, views, accessors);
    assert_eq!(
        document.vectors::<3>(0).unwrap(),
        [[0.0, 10.0, 20.0], [1.0, 10.0, 20.0], [2.0, 10.0, 20.0]]
    );
    assert_eq!(
        document.vectors::<3>(1).unwrap(),
        [[0.0, 0.0, 255.0], [1.0, 2.0, 255.0], [2.0, 4.0, 255.0]]
    );
}

#[test]
fn indices_are_unsigned_integers_below_the_restart_value() {
    let bytes = [1, 0, 2, 0, 3, 0, 0, 0];
    let accessor_of = |component: u32, count: usize| {
        let description = json!({ "bufferView": 0, "componentType": component, "count": count, "type": "SCALAR" });
        accessor(&bytes, description)
    };
    assert_eq!(accessor_of(5121, 5).indices(0).unwrap(), [1, 0, 2, 0, 3]);
    assert_eq!(accessor_of(5123, 4).indices(0).unwrap(), [1, 2, 3, 0]);
    assert_eq!(accessor_of(5125, 2).indices(0).unwrap(), [131_073, 3]);
    for component in [5120, 5122, 5126] {
        assert_eq!(
            error_of(accessor_of(component, 2).indices(0)),
            "accessors[0].componentType: indices must be unsigned bytes, shorts or ints"
        );
    }
    let vector = json!({ "bufferView": 0, "componentType": 5121, "count": 2, "type": "VEC2" });
    assert_eq!(
        error_of(accessor(&bytes, vector).indices(0)),
        "accessors[0].type: indices must be SCALAR"
    );
    for (component, size) in [(5121, 1), (5123, 2), (5125, 4)] {
        let mut bytes = vec![0; size];
        bytes.extend(vec![0xff; size]);
        let description = json!({ "bufferView": 0, "componentType": component, "count": 2, "type": "SCALAR" });
        let message = error_of(accessor(&bytes, description.clone()).indices(0));
        assert!(message.starts_with("accessors[0]: element 1 is "), "{message}");
        assert!(message.contains("restart"), "{message}");
        // The next smaller value is a valid index.
        bytes[size] = 0xfe;
        assert_eq!(accessor(&bytes, description).indices(0).unwrap().len(), 2);
    }
}

fn read_sparse(has_base: bool, indices: &[u8], count: usize) -> Result<Vec<[f32; 2]>, String> {
    let mut bytes = floats(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    bytes.extend(indices);
    bytes.resize(40, 0);
    bytes.extend(floats(&[10.0, 11.0, 12.0, 13.0]));
    let views = json!([
        { "buffer": 0, "byteLength": 32 },
        { "buffer": 0, "byteOffset": 32, "byteLength": 8 },
        { "buffer": 0, "byteOffset": 40, "byteLength": 16 },
    ]);
    let mut description = json!({
        "componentType": 5126, "count": 4, "type": "VEC2",
        "sparse": {
            "count": count,
            "indices": { "bufferView": 1, "componentType": 5121 },
            "values": { "bufferView": 2 },
        },
    });
    if has_base {
        description["bufferView"] = json!(0);
    }
    document(&bytes, views, json!([description]))
        .vectors::<2>(0)
        .map_err(|error| error.to_string().replace("/none/a.gltf: ", ""))
}

#[test]
fn sparse_elements_replace_elements() {
    let base = [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0], [6.0, 7.0]];
    let replaced = [[0.0, 1.0], [10.0, 11.0], [4.0, 5.0], [12.0, 13.0]];
    assert_eq!(read_sparse(true, &[1, 3], 2).unwrap(), replaced);
    assert_eq!(read_sparse(true, &[1, 3], 0).unwrap(), base);
    let zero = [[0.0, 0.0], [10.0, 11.0], [0.0, 0.0], [12.0, 13.0]];
    assert_eq!(read_sparse(false, &[1, 3], 2).unwrap(), zero);
    let error_of = |indices: &[u8], count: usize| read_sparse(true, indices, count).unwrap_err();
    assert_eq!(
        error_of(&[1, 4], 2),
        "accessors[0].sparse.indices: element 1 is 4; it must be less than 4, the count of all elements"
    );
    for indices in [[1, 1], [3, 1]] {
        let message = error_of(&indices, 2);
        assert!(
            message.ends_with("must be greater than the previous element"),
            "{message}"
        );
    }
    assert_eq!(
        error_of(&[0, 1, 2, 3], 5),
        "accessors[0].sparse.count: 5 must be at most 4, the count of all elements"
    );
    assert_eq!(
        error_of(&[0, 1, 2, 3], 3),
        "accessors[0].sparse.values: count 3, element size 8, stride 8 and offset 0 exceed the 16 bytes of bufferViews[2]"
    );
}

#[test]
fn an_accessor_without_bytes_is_zero() {
    let accessor_of = |count: u64| accessor(&[0], json!({ "componentType": 5123, "count": count, "type": "VEC2" }));
    assert_eq!(accessor_of(2).vectors::<2>(0).unwrap(), [[0.0; 2]; 2]);
    assert_eq!(
        error_of(accessor_of(u64::from(u32::MAX)).vectors::<2>(0)),
        "accessors[0].count: 4294967295 elements without a bufferView; there must be at most 4194304"
    );
    assert!(accessor_of(u64::MAX).vectors::<2>(0).is_err());
    // An accessor is not zero if an unsupported extension contains the data.
    let with_extension = json!({ "componentType": 5126, "count": 2, "type": "VEC2", "extensions": { "X_bytes": {} } });
    assert_eq!(
        error_of(accessor(&[0], with_extension).vectors::<2>(0)),
        "accessors[0]: \"X_bytes\" is not supported, but contains the only data; export the file without this extension"
    );
}

#[test]
fn lengths_offsets_and_counts_are_checked_against_the_buffer() {
    let bytes = floats(&[1.0; 6]);
    let read_with = |changes: &[(&str, Value)]| {
        let mut description = json!({ "bufferView": 0, "componentType": 5126, "count": 2, "type": "VEC3" });
        for (key, value) in changes {
            description[*key] = value.clone();
        }
        accessor(&bytes, description).vectors::<3>(0)
    };
    assert_eq!(read_with(&[]).unwrap().len(), 2);
    assert_eq!(
        error_of(read_with(&[("count", json!(3))])),
        "accessors[0]: count 3, element size 12, stride 12 and offset 0 exceed the 24 bytes of bufferViews[0]"
    );
    let huge = [u64::from(u32::MAX), 1 << 40, (1 << 61) + 1, u64::MAX / 12, u64::MAX];
    for offset in [1, 24, 25].into_iter().chain(huge) {
        assert!(error_of(read_with(&[("byteOffset", json!(offset))])).starts_with("accessors[0]: count 2, "));
    }
    for count in huge {
        let message = error_of(read_with(&[("count", json!(count)), ("byteOffset", json!(4))]));
        assert!(
            message.starts_with(&format!("accessors[0]: count {count}, ")),
            "{message}"
        );
    }
    assert_eq!(
        read_with(&[("count", json!(1)), ("byteOffset", json!(12))])
            .unwrap()
            .len(),
        1
    );
    assert!(read_with(&[("count", json!(1)), ("byteOffset", json!(13))]).is_err());
    assert!(read_with(&[("count", json!(0))]).unwrap().is_empty());
    assert!(
        read_with(&[("count", json!(0)), ("byteOffset", json!(24))])
            .unwrap()
            .is_empty()
    );
    assert!(read_with(&[("count", json!(0)), ("byteOffset", json!(25))]).is_err());
    let read_view = |view: Value| {
        let accessors = json!([{ "bufferView": 0, "componentType": 5126, "count": 2, "type": "VEC3" }]);
        document(&bytes, json!([view]), accessors).vectors::<3>(0)
    };
    for (offset, length) in [(0, 25), (1, 24), (25, 0), (u64::MAX, 1), (1, u64::MAX), (1 << 40, 4)] {
        let message = error_of(read_view(
            json!({ "buffer": 0, "byteOffset": offset, "byteLength": length }),
        ));
        assert_eq!(
            message,
            format!("bufferViews[0]: offset {offset} and length {length} exceed the 24 bytes of buffers[0]")
        );
    }
    let read_with_stride = |stride: u64| read_view(json!({ "buffer": 0, "byteLength": 24, "byteStride": stride }));
    assert_eq!(
        error_of(read_with_stride(11)),
        "accessors[0]: the stride of 11 bytes must be at least 12, the size of an element"
    );
    assert_eq!(read_with_stride(0).unwrap(), read_with_stride(12).unwrap());
    for stride in [13, 252, 1 << 40, u64::MAX] {
        assert!(read_with_stride(stride).is_err());
    }
}

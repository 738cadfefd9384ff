//! Merges a part file with valid hashes after random changes to its header and to the words and values of its pieces.
#![no_main]

use libfuzzer_sys::fuzz_target;
use serde_json::{Value, json};
use wgray::image::{Format, Pending, SaveOptions, Target, save};
use wgray_fuzz::{Choices, changed, file};
use wgray_render::job::Parts;

fn header() -> Value {
    json!({
        "format": 1,
        "identity": {
            "version": "0.1.0", "shaders": "", "scene": "abc", "picture": [4, 3], "region": [0, 0, 4, 3],
            "pixel_samples": 16, "adaptive": false, "layers": false, "exact_rounding": false,
        },
        "part": {
            "tile": { "number": 1, "of": 1 }, "aovs": ["normal", "depth"], "alpha": false, "middle_depth": 1_065_353_216,
            "view_transform": "gamma22", "exposure": 0, "told": [["wgray version", "0.1.0"]],
        },
    })
}

fn encode_part(header: &Value, pieces: &[[u32; 14]], data: &[u8]) -> Vec<u8> {
    let text = header.to_string().into_bytes();
    let mut hashed = (text.len() as u32).to_le_bytes().to_vec();
    hashed.extend(&text);
    let key = *blake3::hash(&hashed).as_bytes();
    let mut file = b"\x89wgray pieces\r\n\x1a".to_vec();
    file.extend(&hashed);
    file.extend(key);
    for words in pieces {
        let mut piece: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        piece.extend(blake3::keyed_hash(&key, &piece).as_bytes());
        let [x0, y0, x1, y1, fx0, fy0, fx1, fy1, _, _, _, _, flags, _] = words.map(u64::from);
        let pixels = |x0: u64, y0: u64, x1: u64, y1: u64| x1.saturating_sub(x0).saturating_mul(y1.saturating_sub(y0));
        let bytes_per_pixel = 16 + if flags & 1 != 0 { 32 } else { 0 } + if flags & 2 != 0 { 64 } else { 0 };
        let hits = if flags & 4 != 0 { pixels(x0, y0, x1, y1) } else { 0 };
        let bytes = pixels(fx0, fy0, fx1, fy1)
            .saturating_mul(bytes_per_pixel)
            .saturating_add(hits.saturating_mul(FIRST_HIT_BYTES));
        let bytes = bytes.min(1 << 16) as usize;
        piece.extend((0..bytes).map(|i| data.get(i % data.len().max(1)).copied().unwrap_or(0)));
        piece.extend(blake3::keyed_hash(&key, &piece).as_bytes());
        file.extend(piece);
    }
    file
}

/// Size of a first hit in bytes.
const FIRST_HIT_BYTES: u64 = size_of::<wgray_trace::records::FirstHit>() as u64;

fuzz_target!(|bytes: &[u8]| {
    let mut choices = Choices(bytes);
    let mut header = header();
    for _ in 0..choices.below(4) {
        changed(&mut header, &mut |count| choices.below(count));
    }
    let mut pieces = vec![
        [0, 0, 4, 2, 0, 0, 4, 2, 16, 16, 0, 0, 4, 0],
        [0, 2, 4, 3, 0, 2, 4, 3, 16, 16, 0, 2, 4, 0],
    ];
    for _ in 0..choices.below(4) {
        let piece = choices.below(2);
        let word = choices.below(14);
        pieces[piece][word] = match choices.below(3) {
            0 => choices.word(),
            _ => u32::from(choices.byte()),
        };
    }
    if choices.below(8) == 1 {
        pieces.pop();
    }
    let ending = ["png", "exr", "jpg", "webp"][choices.below(4)];
    let path = file("a.part", &encode_part(&header, &pieces, choices.0));
    if let Ok(parts) = Parts::open(&[path], false) {
        let layout = parts.layout();
        let region = layout.region;
        let _ = parts.read(&mut |_| Ok(()));
        // The same checks as the command line performs before writing.
        let out = file(&format!("out.{ending}"), b"");
        let Some(format) = Format::of(&out) else { return };
        if format.check_size(region.width(), region.height()).is_err() {
            return;
        }
        let paths = wgray::image::files(&out, format, &layout.aovs);
        let files = paths
            .iter()
            .map(|path| Pending::start(wgray::image::Output::find(path)?));
        let Ok(files) = files.collect::<Result<Vec<_>, std::io::Error>>() else {
            return;
        };
        let options = SaveOptions {
            metadata: parts.metadata(),
            ..SaveOptions::default()
        };
        let _ = save(vec![Target { format, files }], &layout, &options, &mut |sink| {
            parts.read(sink)
        });
    }
});

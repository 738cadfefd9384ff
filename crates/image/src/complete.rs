//! Detects image files that are truncated, because the writer was killed or the disk was full.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

use crate::panic_guard::catch_panic;

/// The last chunk of a PNG file (PNG, third edition, 11.2.5).
const PNG_END: &[u8] = b"\0\0\0\0IEND\xae\x42\x60\x82";
/// The marker at the end of a JPEG file (ITU-T T.81, B.1.1.3).
const JPEG_END: &[u8] = &[0xff, 0xd9];

/// Returns true if a file is a PNG, JPEG, WebP or OpenEXR image that ends as its format requires. Pixels are not
/// decoded. Without the cargo feature `formats`, OpenEXR images are not recognized.
pub fn is_complete(path: &Path) -> bool {
    let check = || {
        let mut file = File::open(path).ok()?;
        let length = file.metadata().ok()?.len();
        let mut start = [0; 12];
        file.read_exact(&mut start).ok()?;
        let mut ends_with = |end: &[u8]| {
            let mut last = vec![0; end.len()];
            file.seek(SeekFrom::End(-(end.len() as i64))).ok()?;
            file.read_exact(&mut last).ok()?;
            Some(last == end)
        };
        match start {
            [0x89, b'P', b'N', b'G', ..] => ends_with(PNG_END),
            [0xff, 0xd8, ..] => ends_with(JPEG_END),
            [b'R', b'I', b'F', b'F', a, b, c, d, b'W', b'E', b'B', b'P'] => {
                Some(8 + u64::from(u32::from_le_bytes([a, b, c, d])) == length)
            }
            #[cfg(feature = "formats")]
            [0x76, 0x2f, 0x31, 0x01, ..] => {
                file.rewind().ok()?;
                let chunks = exr::block::read(std::io::BufReader::new(file), false).ok()?;
                let mut chunks = chunks.all_chunks(false).ok()?;
                Some(chunks.all(|chunk| chunk.is_ok()))
            }
            _ => None,
        }
    };
    catch_panic(check).ok().flatten().unwrap_or(false)
}

//! File format of checkpoints and parts: a header that identifies the job, then hashed pieces. Numbers are
//! little-endian. Files are only appended to, so that complete pieces stay intact.
//!
//! | structure | contents |
//! | --- | --- |
//! | file | [`MAGIC`], header, pieces |
//! | header | length (u32), JSON of a [`Header`], BLAKE3 hash of both |
//! | piece | 14 words (see `Head`), their hash, lists of the film, first hits, hash of the piece's preceding bytes |
//!
//! The hashes of pieces are keyed with the hash of the header, so that pieces of other files are rejected.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};

use bytemuck::{cast_slice, cast_slice_mut};
use glam::Vec4;
use serde::{Deserialize, Serialize};

use super::identity::Identity;
use super::part::PartHeader;
use super::piece::FilmPiece;
use super::steps::SampleProgress;
use wgray_image::Region;
use wgray_trace::film::{Film, FilmLayout};
use wgray_trace::records::{FirstHit, SMOOTH_NEIGHBOR_RADIUS};

/// First bytes of the file. As in PNG, a conversion of line endings or to 7-bit characters changes these bytes, so that
/// such damage is detected.
pub const MAGIC: &[u8; 16] = b"\x89wgray pieces\r\n\x1a";

pub const FORMAT: u32 = 3;

const MAX_HEADER_BYTES: u32 = 1 << 20;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// [`FORMAT`].
    pub format: u32,
    pub identity: Identity,
    /// Data that a merge needs besides the films; `None` in a checkpoint.
    pub part: Option<PartHeader>,
}

/// Location and contents of a piece.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Rows of the piece.
    pub region: Region,
    /// Region of the piece's film.
    pub film_region: Region,
    /// Samples that the film's pixels have so far.
    pub reached: SampleProgress,
    /// True if first hits follow the film.
    pub has_hits: bool,
    pub start: u64,
    pub end: u64,
}

impl Entry {
    /// Creates the entry of a piece without first hits.
    pub fn of(piece: &FilmPiece, start: u64, bytes: u64) -> Entry {
        Entry {
            region: piece.region,
            film_region: piece.film.region,
            reached: piece.reached.clone(),
            has_hits: false,
            start,
            end: start + bytes,
        }
    }
}

/// Result of scanning a file.
pub struct Contents {
    /// Complete pieces, in file order.
    pub entries: Vec<Entry>,
    /// Offset after the last complete piece or the header.
    pub end: u64,
    /// Number of damaged or incomplete bytes after `end`.
    pub damaged: u64,
}

const WORDS: usize = 14;
const HASH: usize = blake3::OUT_LEN;
const HEAD: u64 = (4 * WORDS + HASH) as u64;

/// Counts and hashes the bytes of a reader or writer.
struct HashingStream<T> {
    inner: T,
    hasher: blake3::Hasher,
    bytes: u64,
}

/// Hash of the header.
pub type Key = [u8; HASH];

impl<T> HashingStream<T> {
    fn new(inner: T) -> HashingStream<T> {
        HashingStream {
            inner,
            hasher: blake3::Hasher::new(),
            bytes: 0,
        }
    }

    fn keyed(inner: T, key: &Key) -> HashingStream<T> {
        HashingStream {
            hasher: blake3::Hasher::new_keyed(key),
            ..HashingStream::new(inner)
        }
    }

    fn hash(&self) -> [u8; HASH] {
        *self.hasher.finalize().as_bytes()
    }
}

impl<W: Write> HashingStream<W> {
    fn write_and_hash(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.inner.write_all(bytes)?;
        self.hasher.update(bytes);
        self.bytes += bytes.len() as u64;
        Ok(())
    }

    /// Writes the hash of all bytes so far, including hashes.
    fn write_hash(&mut self) -> io::Result<()> {
        let hash = self.hash();
        self.write_and_hash(&hash)
    }

    fn write_words(&mut self, words: &[u32]) -> io::Result<()> {
        const CHUNK: usize = 4096;
        for chunk in words.chunks(CHUNK) {
            let mut copy = [0; CHUNK];
            for (copied, word) in copy.iter_mut().zip(chunk) {
                *copied = word.to_le();
            }
            self.write_and_hash(cast_slice(&copy[..chunk.len()]))?;
        }
        Ok(())
    }
}

impl<R: Read> HashingStream<R> {
    fn read_and_hash(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.inner.read_exact(bytes)?;
        self.hasher.update(bytes);
        self.bytes += bytes.len() as u64;
        Ok(())
    }

    fn read_words(&mut self, words: &mut [u32]) -> io::Result<()> {
        self.read_and_hash(cast_slice_mut(words))?;
        for word in words {
            *word = u32::from_le(*word);
        }
        Ok(())
    }

    /// Reads a hash. Returns true if the hash matches the bytes so far.
    fn hash_matches(&mut self) -> io::Result<bool> {
        let (hash, mut found) = (self.hash(), [0; HASH]);
        self.read_and_hash(&mut found)?;
        Ok(found == hash)
    }
}

/// Writes the magic and the header. Returns the header's hash and the number of bytes.
pub fn write_header(out: &mut impl Write, header: &Header) -> io::Result<(Key, u64)> {
    let text = serde_json::to_vec(header)?;
    let mut out = HashingStream::new(out);
    out.inner.write_all(MAGIC)?;
    out.write_words(&[text.len() as u32])?;
    out.write_and_hash(&text)?;
    let key = out.hash();
    out.write_hash()?;
    Ok((key, MAGIC.len() as u64 + out.bytes))
}

/// Reads what [`write_header`] writes. Errors distinguish damaged headers from files of other formats.
pub fn read_header(input: &mut impl Read) -> io::Result<(Header, Key, u64)> {
    let invalid = |message: &str| io::Error::new(io::ErrorKind::InvalidData, message.to_owned());
    let unknown_format = |_| invalid("it is not a part or checkpoint that wgray wrote");
    let damaged = |_| invalid("its header is damaged or truncated");
    let mut magic = [0; MAGIC.len()];
    input.read_exact(&mut magic).map_err(unknown_format)?;
    if magic != *MAGIC {
        return Err(unknown_format(io::ErrorKind::InvalidData.into()));
    }
    let mut input = HashingStream::new(input);
    let mut length = [0];
    input.read_words(&mut length).map_err(damaged)?;
    if length[0] > MAX_HEADER_BYTES {
        return Err(damaged(io::ErrorKind::InvalidData.into()));
    }
    let mut text = vec![0; length[0] as usize];
    input.read_and_hash(&mut text).map_err(damaged)?;
    let key = input.hash();
    if !input.hash_matches().map_err(damaged)? {
        return Err(damaged(io::ErrorKind::InvalidData.into()));
    }
    // If the header has other fields, the message names the version of the program that wrote the file.
    let header: Header = serde_json::from_slice(&text).map_err(|_| {
        let version = serde_json::from_slice(&text).ok().and_then(|value: serde_json::Value| {
            let version = value.get("identity")?.get("version")?.as_str()?;
            Some(version.to_owned())
        });
        let version = version.unwrap_or("an unknown version".to_owned());
        invalid(&format!("it was written by another version of wgray: {version}"))
    })?;
    if header.format != FORMAT {
        let (found, version) = (header.format, header.identity.version);
        return Err(invalid(&format!(
            "it has format {found} (wgray {version}); this program reads format {FORMAT}"
        )));
    }
    header.identity.check().map_err(|rule| invalid(&rule))?;
    Ok((header, key, MAGIC.len() as u64 + input.bytes))
}

struct Head {
    region: Region,
    film_region: Region,
    reached: SampleProgress,
    film_layout: FilmLayout,
    has_hits: bool,
}

impl Head {
    fn words(&self) -> [u32; WORDS] {
        let Region { x0, y0, x1, y1 } = self.region;
        let film = self.film_region;
        let SampleProgress { pass, next } = &self.reached;
        let FilmLayout {
            adaptive,
            layers,
            noise,
        } = self.film_layout;
        let flags = [adaptive, layers, self.has_hits, noise];
        let flags = (0..).zip(flags).map(|(i, flag)| u32::from(flag) << i).sum();
        let regions = [x0, y0, x1, y1, film.x0, film.y0, film.x1, film.y1];
        let progress = [pass.start, pass.end, next[0], next[1], flags, 0];
        std::array::from_fn(|i| {
            if i < regions.len() {
                regions[i]
            } else {
                progress[i - regions.len()]
            }
        })
    }

    /// Returns `None` if the words are not valid for the job.
    fn of(words: &[u32; WORDS], identity: &Identity) -> Option<Head> {
        let &[x0, y0, x1, y1, fx0, fy0, fx1, fy1, start, end, x, y, flags, _] = words;
        let region = |x0, y0, x1, y1| Region { x0, y0, x1, y1 };
        let head = Head {
            region: region(x0, y0, x1, y1),
            film_region: region(fx0, fy0, fx1, fy1),
            reached: SampleProgress {
                pass: start..end,
                next: [x, y],
            },
            film_layout: FilmLayout {
                adaptive: flags & 1 != 0,
                layers: flags & 2 != 0,
                noise: flags & 8 != 0,
            },
            has_hits: flags & 4 != 0,
        };
        let (job_region, [width, height]) = (identity.region(), identity.picture);
        let picture = Region::whole(width, height);
        let rows = head.region;
        let lies_in = |inner: Region, outer: Region| !inner.is_empty() && inner.within(outer) == inner;
        let is_valid = lies_in(rows, job_region)
            && (rows.x0, rows.x1) == (job_region.x0, job_region.x1)
            && lies_in(rows, head.film_region)
            && lies_in(head.film_region, rows.with_border(SMOOTH_NEIGHBOR_RADIUS))
            && lies_in(head.film_region, picture)
            && start <= end
            && end <= identity.pixel_samples
            && (head.film_region.x0..head.film_region.x1).contains(&x)
            && (head.film_region.y0..=head.film_region.y1).contains(&y)
            && head.film_layout == identity.film_layout();
        is_valid.then_some(head)
    }

    fn data_bytes(&self) -> u64 {
        let hits = if self.has_hits { self.region.pixels() } else { 0 };
        self.film_region.pixels() * self.film_layout.bytes() as u64 + hits * size_of::<FirstHit>() as u64
    }
}

/// Writes a piece, with first hits unless `hits` is empty. Returns the number of bytes.
pub fn write_piece(out: &mut impl Write, key: &Key, piece: &FilmPiece, hits: &[FirstHit]) -> io::Result<u64> {
    let lists: Vec<_> = piece.film.lists().collect();
    let head = Head {
        region: piece.region,
        film_region: piece.film.region,
        reached: piece.reached.clone(),
        film_layout: piece.film.film_layout(),
        has_hits: !hits.is_empty(),
    };
    let mut out = HashingStream::keyed(out, key);
    out.write_words(&head.words())?;
    out.write_hash()?;
    for list in lists {
        out.write_words(cast_slice(list))?;
    }
    out.write_words(cast_slice(hits))?;
    out.write_hash()?;
    Ok(out.bytes)
}

/// Scans the pieces up to the first incomplete or damaged piece. `header_end` is the offset after the header.
pub fn scan(file: &File, identity: &Identity, key: &Key, header_end: u64) -> io::Result<Contents> {
    let length = file.metadata()?.len();
    let mut input = BufReader::with_capacity(1 << 20, file);
    let mut contents = Contents {
        entries: Vec::new(),
        end: header_end,
        damaged: 0,
    };
    input.seek(SeekFrom::Start(header_end))?;
    loop {
        match next_entry(&mut input, identity, key, contents.end, length) {
            Ok(Some(entry)) => {
                contents.end = entry.end;
                contents.entries.push(entry);
            }
            Ok(None) => break,
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => break,
            Err(error) => return Err(error),
        }
    }
    contents.damaged = length.saturating_sub(contents.end);
    Ok(contents)
}

fn next_entry(
    input: &mut impl Read,
    identity: &Identity,
    key: &Key,
    start: u64,
    length: u64,
) -> io::Result<Option<Entry>> {
    let mut input = HashingStream::keyed(input, key);
    let mut words = [0; WORDS];
    input.read_words(&mut words)?;
    if !input.hash_matches()? {
        return Ok(None);
    }
    let Some(head) = Head::of(&words, identity) else {
        return Ok(None);
    };
    let end = start + HEAD + head.data_bytes() + HASH as u64;
    if end > length {
        return Ok(None);
    }
    let mut remaining = head.data_bytes();
    let mut buffer = vec![0; 1 << 18];
    while remaining > 0 {
        let count = remaining.min(buffer.len() as u64) as usize;
        input.read_and_hash(&mut buffer[..count])?;
        remaining -= count as u64;
    }
    Ok(input.hash_matches()?.then_some(Entry {
        region: head.region,
        film_region: head.film_region,
        reached: head.reached,
        has_hits: head.has_hits,
        start,
        end,
    }))
}

/// Reads a piece and its first hits, if any.
pub fn read_piece(
    file: &File,
    key: &Key,
    entry: &Entry,
    film_layout: FilmLayout,
) -> io::Result<(FilmPiece, Vec<FirstHit>)> {
    let mut input = BufReader::with_capacity(1 << 20, file);
    input.seek(SeekFrom::Start(entry.start))?;
    let mut input = HashingStream::keyed(input, key);
    let mut head = [0; HEAD as usize];
    input.read_and_hash(&mut head)?;
    let mut film = Film::of(entry.film_region, film_layout);
    for list in film.lists_mut() {
        input.read_words(cast_slice_mut::<Vec4, u32>(list))?;
    }
    let count = if entry.has_hits {
        entry.region.pixels() as usize
    } else {
        0
    };
    let mut hits = vec![<FirstHit as bytemuck::Zeroable>::zeroed(); count];
    input.read_words(cast_slice_mut(&mut hits))?;
    if !input.hash_matches()? {
        return Err(io::Error::new(
            io::ErrorKind::InvalidData,
            "a piece has changed since the file was opened",
        ));
    }
    let piece = FilmPiece {
        region: entry.region,
        reached: entry.reached.clone(),
        film,
    };
    Ok((piece, hits))
}

/// Returns the pieces that no later piece replaces, from top to bottom. `entries` are in file order.
pub fn latest(entries: &[Entry]) -> Vec<usize> {
    let mut rows = std::collections::BTreeMap::<u32, usize>::new();
    for (number, entry) in entries.iter().enumerate() {
        replace(&mut rows, entries, number, entry.region);
    }
    rows.into_values().collect()
}

/// Adds a piece to a map from first rows to piece numbers. Removes the pieces that share rows with the new piece.
pub fn replace(rows: &mut std::collections::BTreeMap<u32, usize>, entries: &[Entry], number: usize, region: Region) {
    // The pieces in the map are disjoint: of the pieces that start above the region, only the last can overlap the
    // region.
    let last_above = rows
        .range(..region.y0)
        .next_back()
        .filter(|(_, i)| entries[**i].region.y1 > region.y0);
    let first = last_above.map_or(region.y0, |(y, _)| *y);
    let replaced: Vec<u32> = rows.range(first..region.y1).map(|(y, _)| *y).collect();
    for y in replaced {
        rows.remove(&y);
    }
    rows.insert(region.y0, number);
}

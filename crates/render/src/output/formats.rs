//! The formats of the cargo feature `formats`; `no_formats.rs` replaces this module without the feature.

pub(super) mod exif;
pub(super) mod exr;
pub(super) mod webp;

use super::Metadata;

impl Metadata {
    /// Inverse of [`Metadata::software`] and [`Metadata::lines`].
    fn from_lines(software: Option<String>, lines: &str) -> Metadata {
        let software = software.map(|text| (Metadata::SOFTWARE.to_owned(), text));
        let pairs = lines.lines().filter_map(|line| line.split_once(": "));
        let pairs = pairs.map(|(name, text)| (name.to_owned(), text.to_owned()));
        Metadata {
            pairs: software.into_iter().chain(pairs).collect(),
        }
    }

    /// Returns all pairs except the program's name, one per line, such as `seed: 0`.
    fn lines(&self) -> Option<String> {
        let pairs = self.pairs.iter().filter(|(name, _)| name != Metadata::SOFTWARE);
        let lines: Vec<String> = pairs.map(|(name, text)| format!("{name}: {text}")).collect();
        (!lines.is_empty()).then(|| lines.join("\n"))
    }
}

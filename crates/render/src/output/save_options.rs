//! How pictures become bytes, whatever they show: depth, precision, compression, and what is told about them.

use ::exr::compression::Compression;

use wgray_scene::ViewSettings;

/// How picture files are written. Each setting is of one format, and without effect on the others.
#[derive(Clone, Debug, PartialEq)]
pub struct SaveOptions {
    /// Of PNG files.
    pub bit_depth: BitDepth,
    /// Of OpenEXR files.
    pub exr_type: ExrType,
    /// Of OpenEXR files.
    pub exr_compression: ExrCompression,
    /// Of JPEG files, 1 to 100.
    pub quality: u8,
    /// What is told in all of them.
    pub metadata: Metadata,
}

impl Default for SaveOptions {
    fn default() -> SaveOptions {
        SaveOptions {
            bit_depth: BitDepth::default(),
            exr_type: ExrType::default(),
            exr_compression: ExrCompression::default(),
            quality: SaveOptions::QUALITY,
            metadata: Metadata::default(),
        }
    }
}

impl SaveOptions {
    /// The quality of JPEG files, if nothing else is said: of pictures without text or sharp edges nobody sees a loss.
    pub const QUALITY: u8 = 90;

    /// The same for files that show light, which tell how, if they tell anything.
    pub(super) fn of(&self, view: ViewSettings) -> SaveOptions {
        let mut shown = self.clone();
        let pairs = &mut shown.metadata.pairs;
        if !pairs.is_empty() {
            pairs.push(("view_transform".to_owned(), view.transform.name().to_owned()));
            pairs.push(("exposure".to_owned(), view.exposure.to_string()));
        }
        shown
    }
}

/// Bits of a channel of a PNG file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitDepth {
    /// 256 steps.
    #[default]
    Eight,
    /// 65,536 steps.
    Sixteen,
}

/// The numbers of an OpenEXR file's measures. Whole numbers are 32 bits without sign whatever these are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrType {
    /// 32 bits: what was computed.
    #[default]
    Float,
    /// 16 bits: eleven binary digits, up to 65,504; half the size.
    Half,
}

impl ExrType {
    /// All of them.
    pub const ALL: [ExrType; 2] = [ExrType::Float, ExrType::Half];

    /// The name in options.
    pub const fn name(self) -> &'static str {
        match self {
            ExrType::Float => "float",
            ExrType::Half => "half",
        }
    }
}

/// How an OpenEXR file is compressed: all of these without loss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrCompression {
    /// Not at all.
    None,
    /// Runs of equal bytes, row by row.
    Rle,
    /// Deflate, row by row.
    Zips,
    /// Deflate, 16 rows at a time.
    #[default]
    Zip,
    /// Wavelets, 32 rows at a time: small where there is noise.
    Piz,
}

impl ExrCompression {
    /// All of them.
    pub const ALL: [ExrCompression; 5] = [
        ExrCompression::None,
        ExrCompression::Rle,
        ExrCompression::Zips,
        ExrCompression::Zip,
        ExrCompression::Piz,
    ];

    /// The name in options, which is the format's own.
    pub const fn name(self) -> &'static str {
        match self {
            ExrCompression::None => "none",
            ExrCompression::Rle => "rle",
            ExrCompression::Zips => "zips",
            ExrCompression::Zip => "zip",
            ExrCompression::Piz => "piz",
        }
    }

    /// What the library calls it.
    pub(super) fn method(self) -> Compression {
        match self {
            ExrCompression::None => Compression::Uncompressed,
            ExrCompression::Rle => Compression::RLE,
            ExrCompression::Zips => Compression::ZIP1,
            ExrCompression::Zip => Compression::ZIP16,
            ExrCompression::Piz => Compression::PIZ,
        }
    }
}

/// What is told in a picture file about how it came to be: names and texts, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Metadata {
    /// The name of the program that wrote it is under [`Metadata::SOFTWARE`], all else under names of one's own: 1 to 79
    /// letters of ASCII, without spaces at the ends.
    pub pairs: Vec<(String, String)>,
}

impl Metadata {
    /// The name that PNG and others have for the program.
    pub const SOFTWARE: &'static str = "Software";

    /// Returns the text under a name.
    pub fn get(&self, name: &str) -> Option<&str> {
        let pair = self.pairs.iter().find(|(known, _)| known == name);
        pair.map(|(_, text)| text.as_str())
    }

    /// The program's name.
    pub(super) fn software(&self) -> Option<&str> {
        self.get(Metadata::SOFTWARE)
    }

    /// Inverse of [`Metadata::software`] and [`Metadata::lines`].
    pub(super) fn from_lines(software: Option<String>, lines: &str) -> Metadata {
        let software = software.map(|text| (Metadata::SOFTWARE.to_owned(), text));
        let others = lines.lines().filter_map(|line| line.split_once(": "));
        let others = others.map(|(name, text)| (name.to_owned(), text.to_owned()));
        Metadata {
            pairs: software.into_iter().chain(others).collect(),
        }
    }

    /// All else, a line each: `seed: 0`.
    pub(super) fn lines(&self) -> Option<String> {
        let others = self.pairs.iter().filter(|(name, _)| name != Metadata::SOFTWARE);
        let lines: Vec<String> = others.map(|(name, text)| format!("{name}: {text}")).collect();
        (!lines.is_empty()).then(|| lines.join("\n"))
    }
}

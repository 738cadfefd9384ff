//! Encoding of image files: bit depth, precision, compression, quality and metadata.

use wgray_scene::ViewSettings;

/// Encoding of image files. Settings of other formats have no effect.
#[derive(Clone, Debug, PartialEq)]
pub struct SaveOptions {
    /// Bits per channel of PNG files.
    pub bit_depth: BitDepth,
    /// Type of float channels of OpenEXR files.
    pub exr_type: ExrType,
    /// Compression of OpenEXR files.
    pub exr_compression: ExrCompression,
    /// Quality of JPEG files, 1 to 100.
    pub quality: u8,
    /// Metadata of all files; of PNG files only, without the cargo feature `formats`.
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
    /// Default JPEG quality. Losses are invisible in images without text or sharp edges.
    pub const QUALITY: u8 = 90;

    /// Returns the options for files with display values: adds the view settings to metadata, unless the metadata is
    /// empty.
    pub(super) fn with_view(&self, view: ViewSettings) -> SaveOptions {
        let mut options = self.clone();
        let pairs = &mut options.metadata.pairs;
        if !pairs.is_empty() {
            pairs.push(("view_transform".to_owned(), view.transform.name().to_owned()));
            pairs.push(("exposure".to_owned(), view.exposure.to_string()));
        }
        options
    }
}

/// Bits per channel of a PNG file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum BitDepth {
    /// 256 steps.
    #[default]
    Eight,
    /// 65,536 steps.
    Sixteen,
}

/// Float channels of an OpenEXR file. Integer channels are always u32.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExrType {
    /// 32 bits, as computed.
    #[default]
    Float,
    /// 16 bits: 11 bits of precision, at most 65,504.
    Half,
}

impl ExrType {
    /// All types.
    pub const ALL: [ExrType; 2] = [ExrType::Float, ExrType::Half];

    /// Returns the name in options.
    pub const fn name(self) -> &'static str {
        match self {
            ExrType::Float => "float",
            ExrType::Half => "half",
        }
    }
}

/// Lossless compression of an OpenEXR file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExrCompression {
    /// Uncompressed.
    None,
    /// Run-length encoding, row by row.
    Rle,
    /// Deflate, row by row.
    Zips,
    /// Deflate, in blocks of 16 rows.
    #[default]
    Zip,
    /// Wavelets, in blocks of 32 rows: efficient for noise.
    Piz,
}

impl ExrCompression {
    /// All methods.
    pub const ALL: [ExrCompression; 5] = [
        ExrCompression::None,
        ExrCompression::Rle,
        ExrCompression::Zips,
        ExrCompression::Zip,
        ExrCompression::Piz,
    ];

    /// Returns the name in options and in the format.
    pub const fn name(self) -> &'static str {
        match self {
            ExrCompression::None => "none",
            ExrCompression::Rle => "rle",
            ExrCompression::Zips => "zips",
            ExrCompression::Zip => "zip",
            ExrCompression::Piz => "piz",
        }
    }
}

/// Metadata of an image file: pairs of key and text, in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Metadata {
    /// The text of the key [`Metadata::SOFTWARE`] is the program's name. Other keys are 1 to 79 ASCII characters, without leading or trailing
    /// spaces.
    pub pairs: Vec<(String, String)>,
}

impl Metadata {
    /// Key of the program's name, as in PNG.
    pub const SOFTWARE: &'static str = "Software";

    /// Returns the text of a name.
    pub fn get(&self, name: &str) -> Option<&str> {
        let pair = self.pairs.iter().find(|(key, _)| key == name);
        pair.map(|(_, text)| text.as_str())
    }

    pub(super) fn software(&self) -> Option<&str> {
        self.get(Metadata::SOFTWARE)
    }
}

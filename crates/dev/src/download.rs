//! The displayed image as a file: a PNG as displayed, or an EXR with the linear values.

use std::io::{self, Cursor};

use ::exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer, LayerAttributes,
    SmallVec, WritableImage,
};

use super::picture::{Content, Frame, png, png_of};
use wgray_image::Pixels;
use wgray_render::output::{Channel, channels_of};

/// Encodes a frame as PNG, without marks. For a comparison, encodes the first image.
pub fn encode_png(frame: &Frame) -> Vec<u8> {
    match &frame.content {
        Content::Color(pixels) | Content::Compare(pixels, _) => png_of(pixels, frame.display),
        Content::Film(layer) => png(layer.values.width, layer.values.height, &layer.bytes(&frame.display)),
        content => {
            let [width, height] = frame.header.sent;
            png(width, height, &content.plain_bytes([width, height]))
        }
    }
}

/// Encodes the values of a frame as EXR with 32-bit channels, named as in files of `wgray render`.
///
/// # Errors
///
/// Errors of the EXR library.
pub fn encode_exr(frame: &Frame) -> io::Result<Vec<u8>> {
    let [width, height] = frame.header.sent;
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = match &frame.content {
        Content::Color(pixels) | Content::Compare(pixels, _) => colors(pixels, ["R", "G", "B"]),
        Content::Film(layer) => {
            let names: Vec<&str> = layer.aov.channel_names().collect();
            colors(&layer.values, names)
        }
        Content::Samples(counts, _) => [AnyChannel::new("sample_count.N", FlatSamples::U32(counts.clone()))]
            .into_iter()
            .collect(),
        Content::Hits(aov, hits) => channels_of(*aov)
            .iter()
            .filter_map(|channel| {
                let values = match channel {
                    Channel::Float(_, value) => FlatSamples::F32(hits.iter().map(value).collect()),
                    Channel::Integer(_, value) => FlatSamples::U32(hits.iter().map(value).collect()),
                    Channel::ShadingNormal(_, component) => {
                        FlatSamples::F32(hits.iter().map(|hit| hit.shading_normal[*component]).collect())
                    }
                    // Channels of films.
                    Channel::Mean(..) | Channel::Count(_) | Channel::Variance(..) | Channel::Denoised(..) => {
                        return None;
                    }
                };
                Some(AnyChannel::new(channel.name(), values))
            })
            .collect(),
    };
    let size = (width as usize, height as usize);
    let layer = Layer::new(
        size,
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let image = Image::empty(ImageAttributes::new(IntegerBounds::from_dimensions(size))).with_layer(layer);
    let mut file = Cursor::new(Vec::new());
    image.write().to_buffered(&mut file).map_err(io::Error::other)?;
    Ok(file.into_inner())
}

fn colors(pixels: &Pixels, names: impl IntoIterator<Item = &'static str>) -> SmallVec<[AnyChannel<FlatSamples>; 4]> {
    let channel = |(name, i): (&'static str, usize)| {
        AnyChannel::new(
            name,
            FlatSamples::F32(pixels.colors.iter().map(|color| color[i]).collect()),
        )
    };
    names.into_iter().zip(0..3).map(channel).collect()
}

#[cfg(test)]
mod tests {
    use ::exr::prelude::{ReadChannels as _, ReadLayers as _};

    use super::*;
    use crate::display_settings::DisplaySettings;
    use crate::film_layer::FilmLayer;
    use crate::picture::{Header, Names};
    use wgray_render::output::Aov;

    #[test]
    fn a_downloaded_film_layer_has_the_channels_of_a_rendered_file() {
        for (aov, names) in [
            (Aov::Direct, ["direct.B", "direct.G", "direct.R"]),
            (
                Aov::ShadingNormal,
                ["shading_normal.X", "shading_normal.Y", "shading_normal.Z"],
            ),
            (Aov::Variance, ["variance.B", "variance.G", "variance.R"]),
        ] {
            let layer = FilmLayer {
                aov,
                values: Pixels {
                    width: 2,
                    height: 1,
                    colors: vec![[1.0, 2.0, -3.0], [4.0, 5.0, 6.0]],
                },
                hit_fractions: vec![1.0; 2],
            };
            let header = Header {
                width: 2,
                height: 1,
                sent: [2, 1],
                ..Header::default()
            };
            let frame = Frame::new(
                header,
                Content::Film(layer),
                Names::default(),
                DisplaySettings::default(),
            );
            let file = encode_exr(&frame).unwrap();
            let image = ::exr::prelude::read()
                .no_deep_data()
                .largest_resolution_level()
                .all_channels()
                .first_valid_layer()
                .all_attributes()
                .from_buffered(Cursor::new(file))
                .unwrap();
            let channels = &image.layer_data.channel_data.list;
            let found: Vec<(String, Vec<f32>)> = channels
                .iter()
                .map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().collect()))
                .collect();
            let mut expected = [[1.0, 4.0], [2.0, 5.0], [-3.0, 6.0]];
            if names[0].ends_with('B') {
                expected.reverse(); // alphabetical order
            }
            let expected: Vec<_> = names
                .into_iter()
                .map(String::from)
                .zip(expected.map(Vec::from))
                .collect();
            assert_eq!(found, expected);
            assert_eq!(encode_png(&frame)[1..4], *b"PNG");
        }
    }
}

//! Validation of textures and of references to them.

use glam::DVec3;

use super::images::Images;
use super::{
    At, BTreeMap, BTreeSet, Checked, Collector, Color, Problem, Problems, between, check, color, number, show_pair,
};
use crate::image_file::Part;
use crate::limits::{ANISOTROPIES, FACTORS, FRACTIONS, LINE_WIDTHS, OFFSETS, ROTATIONS, SCALES, STRENGTHS, UV_SETS};
use crate::suggest::Suggestions;
use crate::{
    Channel, ChannelReference, ColorDescription, Encoding, ImageTextureDescription, Integrator, MaterialDescription,
    NormalMap, NormalMapDescription, Texels, Texture, TextureDescription, TextureKind, TextureReference, Value,
    ValueDescription,
};

/// Returns the textures, and the indices of textures that were replaced by a constant: the factor of a damaged image,
/// or an arbitrary color if the image is invalid or was not read.
pub(super) fn textures(
    descriptions: &BTreeMap<String, TextureDescription>,
    images: &mut Images,
) -> (Vec<Texture>, BTreeSet<usize>, Result<(), Problems>) {
    let mut problems = Collector::default();
    let mut replaced = BTreeSet::new();
    let mut textures = Vec::with_capacity(descriptions.len());
    for (name, description) in descriptions {
        let mut texture = texture(description, images).at(name.as_str());
        if let (Err(problem), TextureDescription::Image(image)) = (&texture, description)
            && problem.is_damage
        {
            let tolerated = images.tolerate(problem.clone(), "the texture is replaced by its factor");
            texture = tolerated.map(|()| constant(DVec3::from_slice(&image.factor)));
            replaced.insert(textures.len());
        }
        if texture.is_err() || (!images.reads_files && matches!(description, TextureDescription::Image(_))) {
            replaced.insert(textures.len());
        }
        textures.push(problems.value(texture).unwrap_or_else(|| constant(DVec3::ONE)));
    }
    (textures, replaced, problems.end(()))
}

fn constant(color: DVec3) -> Texture {
    Texture {
        kind: TextureKind::Constant(color),
        transform: [DVec3::X, DVec3::Y],
        uv_set: 0,
    }
}

pub(super) fn texture(description: &TextureDescription, images: &mut Images) -> Checked<Texture> {
    Ok(match description {
        TextureDescription::Constant(description) => constant(color(description.color).at("color")?),
        TextureDescription::Checker(checker) => Texture {
            kind: TextureKind::Checker {
                even: color(checker.even).at("even")?,
                odd: color(checker.odd).at("odd")?,
            },
            transform: transform(checker.scale, checker.rotate, checker.offset)?,
            uv_set: 0,
        },
        TextureDescription::Lines(grid) => {
            let line_width = grid.line_width;
            let (low, high) = LINE_WIDTHS;
            check(line_width > low && line_width < high, || {
                format!("{} must be greater than {low} and less than {high}", number(line_width))
            })
            .at("line_width")?;
            Texture {
                kind: TextureKind::Lines {
                    cell: color(grid.cell).at("cell")?,
                    line: color(grid.line).at("line")?,
                    line_width,
                },
                transform: transform(grid.scale, grid.rotate, grid.offset)?,
                uv_set: 0,
            }
        }
        TextureDescription::Image(texture) => image_texture(texture, Part::Colors(texture.encoding), images)?,
    })
}

pub(super) fn image_texture(texture: &ImageTextureDescription, part: Part, images: &mut Images) -> Checked<Texture> {
    let max_anisotropy = between(texture.max_anisotropy, ANISOTROPIES).at("max_anisotropy")?;
    let transform = transform(texture.scale, texture.rotate, texture.offset)?;
    for x in texture.factor {
        between(x, FACTORS).at("factor")?;
    }
    check(texture.uv_set < UV_SETS, || {
        format!("{} must be from 0 to {}", texture.uv_set, UV_SETS - 1)
    })
    .at("uv_set")?;
    let image = images.image(texture, part).at("file")?;
    Ok(Texture {
        kind: TextureKind::Image {
            image,
            wrap: texture.wrap.each(),
            filter: texture.filter,
            max_anisotropy,
            factor: match part {
                Part::Colors(_) => DVec3::from_slice(&texture.factor),
                Part::Alpha => DVec3::splat(texture.factor[3]),
            },
        },
        transform,
        uv_set: texture.uv_set,
    })
}

/// Returns the transform of (u, v): first the scale, then the rotation, then the offset.
fn transform(scale: [f64; 2], rotate: f64, offset: [f64; 2]) -> Checked<[DVec3; 2]> {
    let is_valid = scale.iter().all(|s| (SCALES.0..=SCALES.1).contains(&s.abs()));
    check(is_valid, || {
        let (low, high) = (number(SCALES.0), number(SCALES.1));
        format!("{} must have magnitudes from {low} to {high}", show_pair(scale))
    })
    .at("scale")?;
    let rotate = between(rotate, ROTATIONS).at("rotate")?;
    let (low, high) = OFFSETS;
    check(offset.iter().all(|x| (low..=high).contains(x)), || {
        let (low, high) = (number(low), number(high));
        format!("{} must be from {low} to {high}", show_pair(offset))
    })
    .at("offset")?;
    let (sin, cos) = rotate.to_radians().sin_cos();
    Ok([
        DVec3::new(cos * scale[0], -sin * scale[1], offset[0]),
        DVec3::new(sin * scale[0], cos * scale[1], offset[1]),
    ])
}

/// The textures of a scene, in which the texture names of materials are looked up.
pub(super) struct Textures<'a> {
    pub(super) names: Vec<&'a str>,
    pub(super) textures: &'a [Texture],
    /// For each name, the index of the alpha texture, or an error message. Alpha textures follow the other textures.
    pub(super) alphas: BTreeMap<&'a str, Result<usize, String>>,
    /// Indices of textures that are replaced by a constant.
    pub(super) replaced: BTreeSet<usize>,
    /// The integrator, which determines the valid materials.
    pub(super) integrator: Integrator,
    pub(super) suggestions: Suggestions,
}

/// Adds the alpha textures for `channel = "a"`. Returns their indices, or error messages, by name.
pub(super) fn alphas<'a>(
    materials: &'a BTreeMap<String, MaterialDescription>,
    descriptions: &BTreeMap<String, TextureDescription>,
    images: &mut Images,
    textures: &mut Vec<Texture>,
) -> BTreeMap<&'a str, Result<usize, String>> {
    let mut alphas = BTreeMap::new();
    for value in materials.values().flat_map(MaterialDescription::values) {
        let ValueDescription::Texture(ChannelReference { texture, channel }) = value else {
            continue;
        };
        let (Channel::A, Some(description)) = (channel, descriptions.get(texture)) else {
            continue;
        };
        alphas.entry(texture.as_str()).or_insert_with(|| match description {
            TextureDescription::Image(image) => {
                textures.push(match image_texture(image, Part::Alpha, images) {
                    Err(problem) if problem.is_damage => constant(DVec3::splat(image.factor[3])),
                    alpha => alpha.map_err(|problem| problem.message)?,
                });
                Ok(textures.len() - 1)
            }
            _ => Err(format!(
                "{texture:?} must be a texture of type \"image\" to have an alpha channel"
            )),
        });
    }
    alphas
}

impl Textures<'_> {
    fn find(&self, name: &str) -> Checked<usize> {
        self.find_name(name).at("texture")
    }

    fn find_name(&self, name: &str) -> Checked<usize> {
        let unknown = || Problem::new(self.suggestions.unknown("texture", name, self.names.iter().copied()));
        // The names are sorted, because they are the keys of a map.
        self.names.binary_search(&name).map_err(|_| unknown())
    }

    pub(super) fn color(&self, description: &ColorDescription) -> Checked<Color> {
        Ok(match description {
            ColorDescription::Plain(plain) => Color::Plain(color(*plain)?),
            ColorDescription::Texture(reference) => Color::Texture(self.find(&reference.texture)?),
        })
    }

    /// Validates a color that light is multiplied by, such as a reflectance: energy conservation limits its channels to
    /// 0 ... 1.
    pub(super) fn tint(&self, description: &ColorDescription) -> Checked<Color> {
        if let ColorDescription::Plain(tint) = description {
            for x in tint.to_array() {
                between(x, FRACTIONS)?;
            }
        }
        let color = self.color(description)?;
        if let Color::Texture(texture) = color {
            for x in self.factor_of(texture).to_array() {
                bounded_factor(x)?;
            }
        }
        Ok(color)
    }

    fn factor_of(&self, texture: usize) -> DVec3 {
        match self.textures[texture].kind {
            TextureKind::Image { factor, .. } => factor,
            _ => DVec3::ONE,
        }
    }

    pub(super) fn normal_map(&self, description: &Option<NormalMapDescription>) -> Checked<Option<NormalMap>> {
        let Some(NormalMapDescription {
            texture: name,
            strength,
        }) = description
        else {
            return Ok(None);
        };
        let texture = self.find(name)?;
        if self.replaced.contains(&texture) {
            return Ok(None);
        }
        let TextureKind::Image { image, factor, .. } = &self.textures[texture].kind else {
            return Err(Problem::new(format!("{name:?} must be a texture of type \"image\"")).at("texture"));
        };
        check(!matches!(image.texels, Texels::Bytes(Encoding::Srgb, _)), || {
            format!("{name:?} is used as a normal map; its encoding must be \"linear\"")
        })
        .at("texture")?;
        check(*factor == DVec3::ONE, || {
            format!("{name:?} is used as a normal map; its factor must be 1; use strength instead")
        })
        .at("texture")?;
        let strength = between(*strength, STRENGTHS).at("strength")?;
        Ok(Some(NormalMap { texture, strength }))
    }

    pub(super) fn direction(&self, description: &Option<TextureReference>) -> Checked<Option<usize>> {
        let Some(TextureReference { texture: name }) = description else {
            return Ok(None);
        };
        let texture = self.find_name(name)?;
        if self.replaced.contains(&texture) {
            return Ok(None);
        }
        let TextureKind::Image { image, factor, .. } = &self.textures[texture].kind else {
            return Err(Problem::new(format!("{name:?} must be a texture of type \"image\"")));
        };
        check(!matches!(image.texels, Texels::Bytes(Encoding::Srgb, _)), || {
            format!("{name:?} is used as an anisotropy direction; its encoding must be \"linear\"")
        })?;
        check(factor.x == 1.0 && factor.y == 1.0, || {
            format!("{name:?} is used as an anisotropy direction; the red and green components of its factor must be 1")
        })?;
        Ok(Some(texture))
    }

    pub(super) fn value(&self, description: &ValueDescription) -> Checked<Value> {
        Ok(match description {
            ValueDescription::Plain(plain) => Value::Plain(between(*plain, FRACTIONS)?),
            ValueDescription::Texture(reference) => {
                let colors = self.find(&reference.texture)?;
                let texture = match (reference.channel, self.alphas.get(reference.texture.as_str())) {
                    (Channel::A, Some(alpha)) => alpha.clone().map_err(Problem::new).at("channel")?,
                    _ => colors,
                };
                let factor = self.factor_of(texture);
                bounded_factor(match reference.channel {
                    Channel::R | Channel::A => factor.x,
                    Channel::G => factor.y,
                    Channel::B => factor.z,
                })?;
                Value::Texture(texture, reference.channel)
            }
        })
    }
}

/// Checks the factor of an image whose values, multiplied by the factor, must be from 0 to 1.
fn bounded_factor(factor: f64) -> Checked<()> {
    check(factor <= 1.0, || {
        format!("the texture's factor of {} must be from 0 to 1 here", number(factor))
    })
}

//! Validation of materials and textures.

use std::sync::Arc;

use glam::DVec3;

use super::super::decode::Header;
use super::super::image_file::{File, Part, Place};
use super::super::limits::{
    ABSORPTIONS, ANISOTROPIES, ETAS, FACTORS, IORS, KS, LINE_WIDTHS, OFFSETS, SCALES, SHARES, SHININESS, STRENGTHS,
    TURNS, UV_SETS,
};
use super::super::suggest::Suggestions;
use super::super::texture::{levels, words, words_around};
use super::super::{
    Assets, Channel, ChannelReference, ColorDescription, ConductorDescription, Encoding, Facets, Image,
    ImageTextureDescription, Integrator, Material, MaterialDescription, MetalIndex, NormalMap, NormalMapDescription,
    PhongDescription, Reflection, Texels, Texture, TextureDescription, TextureKind, TextureReference, Value,
    ValueDescription,
};
use super::path::needs_path;
use super::{
    At, BTreeMap, BTreeSet, Checked, Collector, Color, Problem, Problems, between, check, color, number, show_pair,
};

/// Memory limit of all texels in their render format, in bytes.
pub(crate) const TEXEL_MEMORY: u64 = 1 << 30;

/// Returns the textures, and the indices of those that are replaced by a constant: the factor of a damaged image, or
/// any color for an invalid or unread texture.
pub(super) fn textures(
    descriptions: &BTreeMap<String, TextureDescription>,
    images: &mut Images,
) -> (Vec<Texture>, BTreeSet<usize>, Result<(), Problems>) {
    let mut found = Collector::default();
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
        textures.push(found.value(texture).unwrap_or_else(|| constant(DVec3::ONE)));
    }
    (textures, replaced, found.end(()))
}

fn constant(color: DVec3) -> Texture {
    Texture {
        kind: TextureKind::Constant(color),
        transform: [DVec3::X, DVec3::Y],
        uv_set: 0,
    }
}

/// Cache of images: each file is read and stored once.
pub(super) struct Images<'a> {
    pub(super) assets: &'a Assets,
    /// False if the scene is invalid already: 1 x 1 images then replace those of files.
    reads_files: bool,
    /// Images by location, each with its size in 32-bit words.
    files: BTreeMap<Place, Vec<(File, u64)>>,
    /// Size of all images in bytes.
    taken: u64,
    /// Warnings about damaged files, without duplicates.
    pub(super) notes: Vec<String>,
}

impl<'a> Images<'a> {
    pub(super) fn new(assets: &'a Assets, reads_files: bool) -> Images<'a> {
        Images {
            assets,
            reads_files,
            files: BTreeMap::new(),
            taken: 0,
            notes: Vec::new(),
        }
    }

    /// Warns of a damaged file, or returns it as an error ([`Assets::tolerate`]).
    fn tolerate(&mut self, damage: Problem, stand_in: &str) -> Checked<()> {
        let note = self.assets.tolerate(damage, stand_in)?;
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
        Ok(())
    }

    fn image(&mut self, texture: &ImageTextureDescription, part: Part) -> Checked<Arc<Image>> {
        let needs_levels = texture.filter.needs_levels();
        self.with_words(&texture.file, part, |header| {
            let Header { width, height, is_deep } = header;
            let levels = if needs_levels { levels(width, height) } else { 1 };
            words(width, height, levels, is_deep)
        })
    }

    /// Returns the environment map. Its texels are separate from those of a texture of the same file.
    pub(super) fn around(&mut self, file: &str) -> Checked<Arc<Image>> {
        let others = self.taken;
        let image = self.with_words(file, Part::Colors(None), |header| {
            words_around(header.width, header.height)
        })?;
        let words = words_around(image.width, image.height);
        // The file was counted as that of a texture.
        if self.taken - others < 4 * words {
            let bytes = others + 4 * words;
            if bytes > TEXEL_MEMORY {
                return Err(too_much(file, (image.width, image.height), 4 * words, others).into());
            }
            self.taken = bytes;
        }
        Ok(image)
    }

    /// Counts the memory of a built-in environment.
    pub(super) fn own(&mut self, name: &str, image: &Image) -> Result<(), String> {
        let bytes = 4 * words_around(image.width, image.height);
        if self.taken + bytes > TEXEL_MEMORY {
            return Err(too_much(name, (image.width, image.height), bytes, self.taken));
        }
        self.taken += bytes;
        Ok(())
    }

    /// Returns an image. `wanted` is its size in 32-bit words.
    fn with_words(&mut self, file: &str, part: Part, wanted: impl Fn(Header) -> u64) -> Checked<Arc<Image>> {
        let place = self.assets.find(file)?;
        if !self.reads_files {
            return Ok(Arc::new(Image {
                width: 1,
                height: 1,
                texels: Texels::Floats(vec![[0.0; 3]]),
            }));
        }
        let taken = self.taken;
        // `before` is the size that is counted already.
        let fits = |header: Header, before: u64| {
            let words = wanted(header).max(before);
            let (bytes, others) = (4 * words, taken - 4 * before);
            match bytes + others <= TEXEL_MEMORY {
                true => Ok(words),
                false => Err(too_much(file, (header.width, header.height), bytes, others)),
            }
        };
        let known = self
            .files
            .get_mut(&place)
            .and_then(|files| files.iter_mut().find(|(known, _)| known.is(part)));
        if let Some((known, before)) = known {
            known.check_name(file)?;
            let words = fits(Header::of(&known.image), *before)?;
            self.taken += 4 * (words - *before);
            *before = words;
            return Ok(Arc::clone(&known.image));
        }
        let read = self
            .assets
            .image(file, &place, part, |header| fits(header, 0).map(|_| ()))?;
        if let Some(damage) = &read.damage {
            self.tolerate(Problem::damage(damage), "they are clamped")?;
        }
        let words = fits(Header::of(&read.image), 0)?;
        let known = self.files.entry(place).or_default();
        self.taken += 4 * words;
        let image = Arc::clone(&read.image);
        known.push((read, words));
        Ok(image)
    }
}

fn too_much(file: &str, (width, height): (u32, u32), bytes: u64, others: u64) -> String {
    let mib = |bytes: u64| format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20));
    let (bytes, others, limit) = (mib(bytes), mib(others), mib(TEXEL_MEMORY));
    format!(
        "{file:?} ({width} x {height} texels) needs {bytes} and the textures before it {others}; the limit is {limit}"
    )
}

pub(super) fn texture(description: &TextureDescription, images: &mut Images) -> Checked<Texture> {
    Ok(match description {
        TextureDescription::Constant(plain) => constant(color(plain.color).at("color")?),
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
    let valid = scale.iter().all(|s| (SCALES.0..=SCALES.1).contains(&s.abs()));
    check(valid, || {
        let (low, high) = (number(SCALES.0), number(SCALES.1));
        format!(
            "{} must be nonzero, with magnitudes from {low} to {high}",
            show_pair(scale)
        )
    })
    .at("scale")?;
    let rotate = between(rotate, TURNS).at("rotate")?;
    let (low, high) = OFFSETS;
    check(offset.iter().all(|x| (low..=high).contains(x)), || {
        let (low, high) = (number(low), number(high));
        format!("{} must be finite, from {low} to {high}", show_pair(offset))
    })
    .at("offset")?;
    let (sin, cos) = rotate.to_radians().sin_cos();
    Ok([
        DVec3::new(cos * scale[0], -sin * scale[1], offset[0]),
        DVec3::new(sin * scale[0], cos * scale[1], offset[1]),
    ])
}

pub(super) struct Textures<'a> {
    pub(super) names: Vec<&'a str>,
    pub(super) textures: &'a [Texture],
    /// Alpha textures of images, which follow the others, by name, or their errors.
    pub(super) alphas: BTreeMap<&'a str, Result<usize, String>>,
    /// Textures that are replaced by a constant.
    pub(super) replaced: BTreeSet<usize>,
    /// Determines the valid materials.
    pub(super) integrator: Integrator,
    pub(super) suggestions: Suggestions,
}

/// Adds the alpha textures of images that materials use by `channel = "a"`.
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
                    added => added.map_err(|problem| problem.message)?,
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
        // The names are sorted: they are the keys of a map.
        self.names.binary_search(&name).map_err(|_| unknown())
    }

    pub(super) fn color(&self, description: &ColorDescription) -> Checked<Color> {
        Ok(match description {
            ColorDescription::Plain(plain) => Color::Plain(color(*plain)?),
            ColorDescription::Texture(reference) => Color::Texture(self.find(&reference.texture)?),
        })
    }

    /// Validates a factor that must conserve energy.
    pub(super) fn tint(&self, description: &ColorDescription) -> Checked<Color> {
        if let ColorDescription::Plain(tint) = description {
            for x in tint.to_array() {
                between(x, SHARES)?;
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
            format!("{name:?} must have encoding = \"linear\" as a normal map")
        })
        .at("texture")?;
        check(*factor == DVec3::ONE, || {
            format!("{name:?} must have no factor as a normal map; use strength instead")
        })
        .at("texture")?;
        let strength = between(*strength, STRENGTHS).at("strength")?;
        Ok(Some(NormalMap { texture, strength }))
    }

    /// Validates an image of directions.
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
            format!("{name:?} must have encoding = \"linear\" as a direction map")
        })?;
        check(factor.x == 1.0 && factor.y == 1.0, || {
            format!("{name:?} must have a red and green factor of 1 as a direction map")
        })?;
        Ok(Some(texture))
    }

    pub(super) fn value(&self, description: &ValueDescription) -> Checked<Value> {
        Ok(match description {
            ValueDescription::Plain(plain) => Value::Plain(between(*plain, SHARES)?),
            ValueDescription::Texture(reference) => {
                let found = self.find(&reference.texture)?;
                let texture = match (reference.channel, self.alphas.get(reference.texture.as_str())) {
                    (Channel::A, Some(alpha)) => alpha.clone().map_err(Problem::new).at("channel")?,
                    _ => found,
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

    fn emission(&self, description: &Option<ColorDescription>) -> Checked<Color> {
        let Some(emission) = description else {
            return Ok(Color::BLACK);
        };
        needs_path(self.integrator)?;
        let color = self.color(emission)?;
        // Usually only parts of a surface emit; the factor alone would make all of it an emitter.
        let is_replaced = matches!(color, Color::Texture(texture) if self.replaced.contains(&texture));
        Ok(if is_replaced { Color::BLACK } else { color })
    }

    /// Validates a type that needs the path integrator.
    fn of_path(&self, tag: &str) -> Checked<()> {
        let named = |problem: Problem| Problem::new(format!("{tag:?} {}", problem.message));
        needs_path(self.integrator).map_err(named).at("type")
    }

    pub(super) fn material(&self, description: &MaterialDescription) -> Checked<Material> {
        let (reflection, normal_map, emission) = match description {
            MaterialDescription::Phong(phong) => {
                if let Some(all) = &phong.color {
                    self.color(all).at("color")?;
                }
                let reflection = Reflection::Phong {
                    ambient: self.factor(phong, &phong.ambient, "ambient")?,
                    diffuse: self.factor(phong, &phong.diffuse, "diffuse")?,
                    specular: self.factor(phong, &phong.specular, "specular")?,
                    shininess: between(phong.shininess, SHININESS).at("shininess")?,
                };
                (reflection, &phong.normal_map, &phong.emission)
            }
            MaterialDescription::Mirror(mirror) => {
                let tint = self.tint(&mirror.tint).at("tint")?;
                (Reflection::Mirror { tint }, &mirror.normal_map, &mirror.emission)
            }
            MaterialDescription::Glass(glass) => {
                let reflection = Reflection::Glass {
                    ior: ior(glass.ior).at("ior")?,
                    tint: self.tint(&glass.tint).at("tint")?,
                };
                (reflection, &glass.normal_map, &glass.emission)
            }
            MaterialDescription::Diffuse(diffuse) => {
                self.of_path("diffuse")?;
                let reflection = Reflection::Diffuse {
                    color: self.tint(&diffuse.color).at("color")?,
                    roughness: self.value(&diffuse.roughness).at("roughness")?,
                };
                (reflection, &diffuse.normal_map, &diffuse.emission)
            }
            MaterialDescription::Conductor(conductor) => {
                self.of_path("conductor")?;
                let white = ColorDescription::default();
                let reflection = Reflection::Conductor {
                    color: self.tint(conductor.color.as_ref().unwrap_or(&white)).at("color")?,
                    index: metal_index(conductor)?,
                    facets: self.facets(
                        &conductor.roughness,
                        conductor.anisotropy,
                        conductor.anisotropy_rotation,
                        conductor.energy_compensation,
                    )?,
                };
                (reflection, &conductor.normal_map, &conductor.emission)
            }
            MaterialDescription::Dielectric(dielectric) => {
                self.of_path("dielectric")?;
                let reflection = Reflection::Dielectric {
                    ior: ior(dielectric.ior).at("ior")?,
                    color: self.tint(&dielectric.color).at("color")?,
                    absorption: absorption(dielectric.absorption).at("absorption")?,
                    thin: dielectric.thin,
                    facets: self.facets(
                        &dielectric.roughness,
                        dielectric.anisotropy,
                        dielectric.anisotropy_rotation,
                        dielectric.energy_compensation,
                    )?,
                };
                check(!dielectric.thin || dielectric.absorption == DVec3::ZERO, || {
                    "must be 0 if thin is true: a thin sheet has no interior".to_owned()
                })
                .at("absorption")?;
                (reflection, &dielectric.normal_map, &dielectric.emission)
            }
            MaterialDescription::Principled(principled) => {
                self.of_path("principled")?;
                let reflection = Reflection::Principled(Box::new(self.principled(principled)?));
                (reflection, &principled.normal_map, &principled.emission)
            }
        };
        Ok(Material {
            reflection,
            emission: self.emission(emission).at("emission")?,
            normal_map: self.normal_map(normal_map).at("normal_map")?,
            visible: is_visible(description),
        })
    }

    fn facets(
        &self,
        roughness: &ValueDescription,
        anisotropy: f64,
        rotation: f64,
        compensated: bool,
    ) -> Checked<Facets> {
        Ok(Facets {
            roughness: self.value(roughness).at("roughness")?,
            anisotropy: between(anisotropy, SHARES).at("anisotropy")?,
            rotation: between(rotation, TURNS).at("anisotropy_rotation")?,
            compensated,
        })
    }

    fn factor(&self, phong: &PhongDescription, own: &Option<ColorDescription>, key: &str) -> Checked<Color> {
        let missing = || Problem::predicate("is missing; set it or color");
        let factor = own.as_ref().or(phong.color.as_ref()).ok_or_else(missing);
        factor.and_then(|factor| self.color(factor)).at(key)
    }
}

/// Validates a texture's factor if the product must be from 0 to 1.
fn bounded_factor(factor: f64) -> Checked<()> {
    check(factor <= 1.0, || {
        format!("the texture's factor of {} must be from 0 to 1 here", number(factor))
    })
}

fn is_visible(description: &MaterialDescription) -> bool {
    let visible = match description {
        MaterialDescription::Phong(material) => material.visible,
        MaterialDescription::Mirror(material) => material.visible,
        MaterialDescription::Glass(material) => material.visible,
        MaterialDescription::Diffuse(material) => material.visible,
        MaterialDescription::Conductor(material) => material.visible,
        MaterialDescription::Dielectric(material) => material.visible,
        MaterialDescription::Principled(material) => material.visible,
    };
    visible.unwrap_or(true)
}

fn ior(ior: f64) -> Checked<f64> {
    between(ior, IORS)
}

fn absorption(absorption: DVec3) -> Checked<DVec3> {
    for x in absorption.to_array() {
        let (low, high) = ABSORPTIONS;
        check((low..=high).contains(&x), || {
            format!("{} must be finite, from {} to {}", number(x), number(low), number(high))
        })?;
    }
    Ok(absorption)
}

/// Returns the index of a conductor. Only one kind of key may set the reflectance.
fn metal_index(conductor: &ConductorDescription) -> Checked<Option<MetalIndex>> {
    let other = |own: &str| {
        let said = [
            ("color", conductor.color.is_some()),
            ("metal", conductor.metal.is_some()),
            ("eta", conductor.eta.is_some()),
        ];
        said.into_iter()
            .find(|(key, said)| *said && *key != own)
            .map(|(key, _)| key)
    };
    if let Some(name) = &conductor.metal {
        check(other("metal").is_none(), || {
            format!("cannot be combined with {}", other("metal").unwrap_or_default())
        })
        .at("metal")?;
        let index = MetalIndex::named(name).ok_or_else(|| {
            let names: Vec<String> = MetalIndex::names().map(|name| format!("{name:?}")).collect();
            Problem::new(format!("{name:?} must be one of {}", names.join(", ")))
        });
        return index.at("metal").map(Some);
    }
    let (eta, k) = match (conductor.eta, conductor.k) {
        (None, None) => return Ok(None),
        (Some(eta), Some(k)) => (eta, k),
        (Some(_), None) => return Err(Problem::predicate("is missing; eta needs it")).at("k"),
        (None, Some(_)) => return Err(Problem::predicate("is missing; k needs it")).at("eta"),
    };
    check(other("eta").is_none(), || {
        format!("cannot be combined with {}", other("eta").unwrap_or_default())
    })
    .at("eta")?;
    for x in eta.to_array() {
        between(x, ETAS).at("eta")?;
    }
    for x in k.to_array() {
        between(x, KS).at("k")?;
    }
    Ok(Some(MetalIndex { eta, k }))
}

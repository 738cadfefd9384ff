//! Packs materials and their textures into records, and images into mip pyramids.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DVec3, UVec2, Vec3};

use super::energy::{TableLobes, aniso_table, energy_table};
use super::pyramid::pyramid;
use super::*;
use wgray_scene::{
    self as scene, self, AlphaMode, Channel, Color, Encoding, Facets, Image, Integrator, Reflection, Scene, Texels,
    TextureFilter, TextureKind, Value, VertexColors, Wrap,
};
use wgray_trace::cpu::lobe::{facet_alpha, is_polished};

/// Packed materials, texture lookups, textures and texels.
#[derive(Debug, Default)]
pub struct Appearances {
    pub materials: Vec<Material>,
    /// Texture lookups; the lookups of a material are consecutive.
    pub lookups: Vec<Lookup>,
    pub textures: Vec<Texture>,
    pub texels: Vec<u32>,
    /// Offset of each image's pyramid; the key is the address of the image.
    pyramids: BTreeMap<usize, u32>,
    /// Number of levels that each image needs; the key is the address of the image.
    levels: BTreeMap<usize, u32>,
    /// Index of each texture's record; a normal map has one record per strength.
    records: BTreeMap<(usize, Option<u64>), u32>,
    /// Tables of rough glass; the key is the index of refraction and alpha (`None` if textured).
    albedo_tables: BTreeMap<(u32, Option<u32>), u32>,
    /// Tables of anisotropic microfacets; the key is the lobes, the roughness and the anisotropy.
    aniso_tables: BTreeMap<(TableLobes, Option<u32>, Option<u32>), u32>,
}

fn camera_culling(material: &scene::Material) -> u32 {
    match &material.reflection {
        _ if !material.visible => CULL_BOTH_FACES,
        Reflection::Principled(principled) if !principled.double_sided => CULL_BACKFACE,
        _ => 0,
    }
}

/// Returns a material record with only its microfacet fields set; the other fields are zero. `resolve` looks up a
/// textured roughness.
fn microfacet_record(
    facets: &Facets,
    resolve: &mut impl FnMut(&Color, u32, Option<(Channel, u32)>) -> Vec3,
) -> Material {
    Material {
        roughness: resolve_scalar(&facets.roughness, FOR_ROUGHNESS, ROUGHNESS_CHANNEL, resolve),
        anisotropy: facets.anisotropy as f32,
        rotation: (facets.rotation / 180.0) as f32,
        energy: if facets.compensated { 0 } else { NO_INDEX },
        ..bytemuck::Zeroable::zeroed()
    }
}

/// Reduces smooth microfacets, and glass that hardly refracts, to a delta BSDF.
fn reduce_to_delta(record: Material, textured: bool) -> Material {
    let polished = !textured && is_polished(&record);
    let kind = match record.kind {
        METAL if polished && record.eta == Vec3::ZERO => MIRROR,
        ROUGH_GLASS if polished || (record.ior - 1.0).abs() < SMALLEST_ALPHA => GLASS,
        _ => return record,
    };
    Material {
        roughness: 0.0,
        anisotropy: 0.0,
        rotation: 0.0,
        energy: 0,
        kind,
        ..record
    }
}

impl Appearances {
    pub fn of(scene: &Scene) -> Appearances {
        let mut appearances = Appearances::default();
        for texture in &scene.textures {
            if let TextureKind::Image { image, filter, .. } = &texture.kind {
                let levels = appearances.levels.entry(address(image)).or_default();
                *levels = levels_of(image, *filter).max(*levels);
            }
        }
        for material in &scene.materials {
            let material = appearances.material(scene, material);
            appearances.materials.push(material);
        }
        appearances
    }

    /// Returns the maximum number of lookups of materials that are neither mirror nor glass, and of mirrors and glass.
    /// With `path`, both numbers are the overall maximum, because `path` evaluates all materials with the same code.
    pub fn lookups(&self, integrator: Integrator) -> (u32, u32) {
        let max = |specular: bool| {
            let materials = self
                .materials
                .iter()
                .filter(|m| specular == (m.kind == MIRROR || m.kind == GLASS));
            let lookups = materials.map(|material| material.lookups.y);
            lookups.max().unwrap_or(0)
        };
        let (non_specular, specular) = (max(false), max(true));
        match integrator.follows_paths() {
            true => (non_specular.max(specular), non_specular.max(specular)),
            false => (non_specular, specular),
        }
    }

    pub fn has_normal_maps(&self) -> bool {
        self.any_material_has_lookup(FOR_NORMAL | FOR_CLEARCOAT_NORMAL)
    }

    /// Returns true if any lookup has any of the purposes.
    pub fn any_material_has_lookup(&self, purposes: u32) -> bool {
        self.lookups.iter().any(|lookup| lookup.purposes & purposes != 0)
    }

    pub fn has_lookup(&self, material: &Material, purposes: u32) -> bool {
        let [first, count] = material.lookups.to_array().map(|x| x as usize);
        let mut lookups = self.lookups.iter().skip(first).take(count);
        lookups.any(|lookup| lookup.purposes & purposes != 0)
    }

    pub fn kinds(&self) -> u32 {
        self.textures.iter().fold(0, |bits, texture| bits | 1 << texture.kind)
    }

    pub fn formats(&self) -> u32 {
        let images = self.textures.iter().filter(|texture| texture.kind >= NEAREST);
        images.fold(0, |bits, texture| bits | 1 << texture.format)
    }

    pub fn needs_footprints(&self) -> bool {
        self.kinds() & !(1 << NEAREST | 1 << BILINEAR) != 0
    }

    fn material(&mut self, scene: &Scene, material: &scene::Material) -> Material {
        let mut lookups = Lookups::default();
        let uv_set = |i: usize| scene.textures[i].uv_set;
        let mut resolve = |color: &Color, purpose: u32, channel: Option<(Channel, u32)>| match *color {
            Color::Plain(color) => color.as_vec3(),
            Color::Texture(i) => match scene.textures[i].kind {
                TextureKind::Constant(color) => color.as_vec3(),
                _ => {
                    lookups.add(self.texture(scene, i, None), uv_set(i), purpose, channel);
                    Vec3::ZERO
                }
            },
        };
        let mut record = match &material.reflection {
            Reflection::Phong {
                ambient,
                diffuse,
                specular,
                shininess,
            } => Material {
                ambient: match scene.render.integrator.follows_paths() {
                    true => Vec3::ZERO, // not used
                    false => resolve(ambient, FOR_AMBIENT, None),
                },
                kind: PHONG,
                diffuse: resolve(diffuse, FOR_DIFFUSE, None),
                shininess: *shininess as f32,
                specular: resolve(specular, FOR_SPECULAR, None),
                exponent: *shininess as u32,
                ..bytemuck::Zeroable::zeroed()
            },
            Reflection::Mirror { tint } => Material {
                kind: MIRROR,
                tint: resolve(tint, FOR_TINT, None),
                ..bytemuck::Zeroable::zeroed()
            },
            Reflection::Glass { ior, tint } => Material {
                kind: GLASS,
                tint: resolve(tint, FOR_TINT, None),
                ior: *ior as f32,
                ..bytemuck::Zeroable::zeroed()
            },
            Reflection::Conductor {
                color: tint,
                index,
                facets,
            } => Material {
                kind: METAL,
                tint: resolve(tint, FOR_TINT, None),
                eta: index.map_or(Vec3::ZERO, |index| index.eta.as_vec3()),
                k: index.map_or(Vec3::ZERO, |index| index.k.as_vec3()),
                ..microfacet_record(facets, &mut resolve)
            },
            Reflection::Dielectric {
                ior,
                color: tint,
                absorption,
                thin,
                facets,
            } => Material {
                kind: if *thin { THIN } else { ROUGH_GLASS },
                tint: resolve(tint, FOR_TINT, None),
                ior: *ior as f32,
                absorption: absorption.as_vec3(),
                ..microfacet_record(facets, &mut resolve)
            },
            Reflection::Principled(principled) => self::principled(principled, &mut resolve),
            Reflection::Diffuse {
                color: albedo,
                roughness,
            } => Material {
                kind: DIFFUSE,
                diffuse: resolve(albedo, FOR_DIFFUSE, None),
                roughness: resolve_scalar(roughness, FOR_ROUGHNESS, ROUGHNESS_CHANNEL, &mut resolve),
                ..bytemuck::Zeroable::zeroed()
            },
        };
        record.emission = resolve(&material.emission, FOR_EMISSION, None);
        let has = |purpose: u32| lookups.0.iter().any(|lookup| lookup.purposes & purpose != 0);
        let textured = has(FOR_ROUGHNESS);
        let mut record = reduce_to_delta(record, textured);
        record.camera_culling = camera_culling(material);
        let transmits = record.thin == 0 && (record.transmission > 0.0 || has(FOR_TRANSMISSION));
        let lobes = match record.kind {
            METAL | THIN if record.energy != NO_INDEX => Some(TableLobes::Reflection),
            ROUGH_GLASS if record.energy != NO_INDEX => Some(TableLobes::Glass(record.ior.to_bits())),
            PRINCIPLED => Some(TableLobes::Principled(transmits.then_some(record.ior.to_bits()))),
            _ => None,
        };
        if let Some(lobes) = lobes {
            if record.anisotropy > 0.0 || has(FOR_ANISOTROPY) {
                record.aniso_table = 1 + self.aniso_table(&record, lobes, textured, has(FOR_ANISOTROPY));
            } else if record.kind == ROUGH_GLASS || record.kind == PRINCIPLED && transmits {
                record.energy = self.energy(&record, textured);
            }
        }
        if let Some(map) = material.normal_map {
            let texture = self.texture(scene, map.texture, Some(map.strength));
            lookups.add(texture, uv_set(map.texture), FOR_NORMAL, None);
        }
        if let Reflection::Principled(principled) = &material.reflection
            && let Some(texture) = principled.anisotropy_direction
        {
            lookups.add(self.texture(scene, texture, None), uv_set(texture), FOR_DIRECTION, None);
        }
        if let Reflection::Principled(principled) = &material.reflection
            && let Some(map) = principled.clearcoat_normal_map
        {
            let texture = self.texture(scene, map.texture, Some(map.strength));
            lookups.add(texture, uv_set(map.texture), FOR_CLEARCOAT_NORMAL, None);
        }
        record.lookups = UVec2::new(self.lookups.len() as u32, lookups.0.len() as u32);
        self.lookups.extend(lookups.0);
        record
    }

    /// Returns the albedo table of rough glass, created on first use.
    fn energy(&mut self, record: &Material, textured: bool) -> u32 {
        let square = 0.5 * facet_alpha(record).length_squared();
        let alpha = if textured { None } else { Some(square.sqrt()) };
        let key = (record.ior.to_bits(), alpha.map(f32::to_bits));
        let texels = &mut self.texels;
        *self.albedo_tables.entry(key).or_insert_with(|| {
            let start = texels.len() as u32;
            texels.extend(energy_table(record.ior, alpha).iter().map(|x| x.to_bits()));
            start
        })
    }

    /// Like `energy`, for anisotropic microfacets. The flags are true if roughness or anisotropy are textured.
    fn aniso_table(
        &mut self,
        record: &Material,
        lobes: TableLobes,
        textured_roughness: bool,
        textured_anisotropy: bool,
    ) -> u32 {
        let constant = |value: f32, textured: bool| (!textured).then_some(value);
        let roughness = constant(record.roughness, textured_roughness);
        let anisotropy = constant(record.anisotropy, textured_anisotropy);
        let key = (lobes, roughness.map(f32::to_bits), anisotropy.map(f32::to_bits));
        let texels = &mut self.texels;
        *self.aniso_tables.entry(key).or_insert_with(|| {
            let start = texels.len() as u32;
            texels.extend(aniso_table(lobes, roughness, anisotropy));
            start
        })
    }

    /// Returns the record of a color texture or, if there is a strength, of a normal map.
    fn texture(&mut self, scene: &Scene, i: usize, strength: Option<f64>) -> u32 {
        let key = (i, strength.map(f64::to_bits));
        if let Some(record) = self.records.get(&key) {
            return *record;
        }
        let texture = &scene.textures[i];
        let plain = Texture {
            u: texture.transform[0].as_vec3(),
            v: texture.transform[1].as_vec3(),
            ..bytemuck::Zeroable::zeroed()
        };
        let endpoints = |first: DVec3, second: DVec3| (first.as_vec3(), second.as_vec3());
        let record = match &texture.kind {
            TextureKind::Constant(color) => {
                let (first, second) = endpoints(*color, *color);
                Texture {
                    first,
                    kind: CHECKER,
                    second,
                    ..plain
                }
            }
            TextureKind::Checker { even, odd } => {
                let (first, second) = endpoints(*even, *odd);
                Texture {
                    first,
                    kind: CHECKER,
                    second,
                    ..plain
                }
            }
            TextureKind::Lines { cell, line, line_width } => {
                let (first, second) = endpoints(*cell, *line);
                Texture {
                    first,
                    kind: LINES,
                    second,
                    parameter: *line_width as f32,
                    ..plain
                }
            }
            TextureKind::Image {
                image,
                wrap,
                filter,
                max_anisotropy,
                factor,
            } => {
                let (first, second) = match strength {
                    Some(s) => endpoints(DVec3::new(-s, -s, -1.0), DVec3::new(s, s, 1.0)),
                    None => endpoints(DVec3::ZERO, *factor),
                };
                let levels = levels_of(image, *filter);
                let address = address(image);
                let max_levels = self.levels.get(&address).map_or(levels, |max| levels.max(*max));
                let texels = &mut self.texels;
                Texture {
                    first,
                    kind: match filter {
                        TextureFilter::Nearest => NEAREST,
                        TextureFilter::Bilinear => BILINEAR,
                        TextureFilter::Trilinear => TRILINEAR,
                        TextureFilter::Ewa => EWA,
                    },
                    second,
                    parameter: *max_anisotropy as f32,
                    format: match image.texels {
                        Texels::Bytes(Encoding::Srgb, _) => SRGB8,
                        Texels::Bytes(Encoding::Linear, _) => LINEAR8,
                        Texels::Floats(_) => FLOAT,
                    },
                    wrap: self::wrap(wrap[0]) + 4 * self::wrap(wrap[1]),
                    texels: *(self.pyramids.entry(address)).or_insert_with(|| pyramid(image, max_levels, texels)),
                    width: image.width,
                    height: image.height,
                    levels,
                    ..plain
                }
            }
        };
        let number = self.textures.len() as u32;
        self.textures.push(record);
        self.records.insert(key, number);
        number
    }
}

fn wrap(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => REPEAT,
        Wrap::Clamp => CLAMP,
        Wrap::Mirror => MIRRORED,
    }
}

/// Returns an image's key, unique during the lifetime of the scene.
fn address(image: &Arc<Image>) -> usize {
    Arc::as_ptr(image).addr()
}

fn levels_of(image: &Image, filter: TextureFilter) -> u32 {
    if filter.needs_levels() { image.levels() } else { 1 }
}

/// A material's lookups: one lookup per texture, with all purposes.
#[derive(Default)]
struct Lookups(Vec<Lookup>);

impl Lookups {
    /// Adds a purpose to the lookup of a texture. `channel` is a scalar's channel, and its index in `Lookup::channels`.
    fn add(&mut self, texture: u32, uv_set: u32, purpose: u32, channel: Option<(Channel, u32)>) {
        let position = self.0.iter().position(|lookup| lookup.texture == texture);
        let position = position.unwrap_or_else(|| {
            self.0.push(Lookup {
                texture,
                uv_set,
                ..bytemuck::Zeroable::zeroed()
            });
            self.0.len() - 1
        });
        let lookup = &mut self.0[position];
        lookup.purposes |= purpose;
        if let Some((channel, index)) = channel {
            lookup.channels |= channel_number(channel) << (2 * index);
        }
    }
}

fn principled(
    p: &scene::Principled,
    resolve: &mut impl FnMut(&Color, u32, Option<(Channel, u32)>) -> Vec3,
) -> Material {
    let has_alpha = p.alpha_mode != AlphaMode::Opaque;
    Material {
        kind: PRINCIPLED,
        diffuse: resolve(&p.base_color, FOR_DIFFUSE, None),
        specular: resolve(&p.specular_color, FOR_SPECULAR, None),
        ior: p.ior as f32,
        absorption: p.absorption.as_vec3(),
        roughness: resolve_scalar(&p.roughness, FOR_ROUGHNESS, ROUGHNESS_CHANNEL, resolve),
        anisotropy: resolve_scalar(&p.anisotropy, FOR_ANISOTROPY, ANISOTROPY_CHANNEL, resolve),
        rotation: (p.anisotropy_rotation / std::f64::consts::PI) as f32,
        thin: p.thin.into(),
        sheen: resolve(&p.sheen_color, FOR_SHEEN, None),
        sheen_roughness: resolve_scalar(
            &p.sheen_roughness,
            FOR_SHEEN_ROUGHNESS,
            SHEEN_ROUGHNESS_CHANNEL,
            resolve,
        ),
        metallic: resolve_scalar(&p.metallic, FOR_METALLIC, METALLIC_CHANNEL, resolve),
        transmission: resolve_scalar(&p.transmission, FOR_TRANSMISSION, TRANSMISSION_CHANNEL, resolve),
        clearcoat: resolve_scalar(&p.clearcoat, FOR_CLEARCOAT, CLEARCOAT_CHANNEL, resolve),
        clearcoat_roughness: resolve_scalar(
            &p.clearcoat_roughness,
            FOR_CLEARCOAT_ROUGHNESS,
            CLEARCOAT_ROUGHNESS_CHANNEL,
            resolve,
        ),
        specular_weight: resolve_scalar(&p.specular, FOR_SPECULAR_WEIGHT, SPECULAR_WEIGHT_CHANNEL, resolve),
        opacity: match has_alpha {
            true => resolve_scalar(&p.alpha, FOR_OPACITY, OPACITY_CHANNEL, resolve),
            false => 1.0,
        },
        cutoff: p.alpha_cutoff as f32,
        alpha_mode: match p.alpha_mode {
            AlphaMode::Opaque => OPAQUE,
            AlphaMode::Mask => MASK,
            AlphaMode::Blend => BLEND,
        },
        vertex_colors: match p.vertex_colors {
            VertexColors::None => NO_COLORS,
            VertexColors::BaseColor => COLORS_OF_BASE,
            VertexColors::Emission => COLORS_OF_EMISSION,
        },
        ..bytemuck::Zeroable::zeroed()
    }
}

/// Resolves a scalar: a constant, or a texture channel that `resolve` looks up.
fn resolve_scalar(
    value: &Value,
    purpose: u32,
    channel_index: u32,
    resolve: &mut impl FnMut(&Color, u32, Option<(Channel, u32)>) -> Vec3,
) -> f32 {
    match *value {
        Value::Plain(number) => number as f32,
        Value::Texture(i, channel) => {
            let color = resolve(&Color::Texture(i), purpose, Some((channel, channel_index)));
            color[channel_number(channel) as usize]
        }
    }
}

fn channel_number(channel: Channel) -> u32 {
    match channel {
        Channel::R | Channel::A => 0,
        Channel::G => 1,
        Channel::B => 2,
    }
}

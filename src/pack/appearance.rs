//! Materials and their textures as records, and images as pyramids of texels.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DVec3, UVec4, Vec3};

use super::pyramid::pyramid;
use super::{
    CHECKER, CLAMP, DIFFUSE, EWA, FLOAT, FOR_AMBIENT, FOR_DIFFUSE, FOR_EMISSION, FOR_NORMAL, FOR_ROUGHNESS,
    FOR_SPECULAR, FOR_TINT, GLASS, LINEAR8, LINES, MIRROR, MIRRORED, Material, NEAREST, PHONG, REPEAT, SRGB8,
    TRILINEAR, Texture,
};
use crate::pack::BILINEAR;
use crate::scene::{
    self, Color, Encoding, Image, Integrator, Reflection, Scene, Texels, TextureFilter, TextureKind, Value, Wrap,
};

/// The records of a scene's materials and of the textures that they use.
#[derive(Default)]
pub struct Appearances {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub texels: Vec<u32>,
    /// Where the pyramids of the scene's images are, by the images' addresses.
    places: BTreeMap<usize, u32>,
    /// How many levels their textures need.
    levels: BTreeMap<usize, u32>,
    /// The records of the scene's textures, apart for each strength as a normal map.
    records: BTreeMap<(usize, Option<u64>), u32>,
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

    /// Most lookups of a material, and of one of mirrors or glass; of any, twice, where all are looked up in one place.
    pub fn lookups(&self, integrator: Integrator) -> (u32, u32) {
        let most = |specular: bool| {
            let materials = self
                .materials
                .iter()
                .filter(|m| specular == (m.kind == MIRROR || m.kind == GLASS));
            let lookups = materials.map(|m| m.lookups.to_array().iter().filter(|lookup| **lookup != 0).count());
            lookups.max().unwrap_or(0) as u32
        };
        let (others, specular) = (most(false), most(true));
        match integrator {
            Integrator::Path => (others.max(specular), others.max(specular)),
            _ => (others, specular),
        }
    }

    pub fn has_normal_maps(&self) -> bool {
        self.materials
            .iter()
            .any(|m| m.lookups.to_array().iter().any(|lookup| lookup & FOR_NORMAL != 0))
    }

    /// Bits of the textures' kinds.
    pub fn kinds(&self) -> u32 {
        self.textures.iter().fold(0, |bits, texture| bits | 1 << texture.kind)
    }

    /// Bits of the texels' formats.
    pub fn formats(&self) -> u32 {
        let images = self.textures.iter().filter(|texture| texture.kind >= NEAREST);
        images.fold(0, |bits, texture| bits | 1 << texture.format)
    }

    /// Whether any texture is filtered over footprints.
    pub fn needs_footprints(&self) -> bool {
        self.kinds() & !(1 << NEAREST | 1 << BILINEAR) != 0
    }

    fn material(&mut self, scene: &Scene, material: &scene::Material) -> Material {
        let mut lookups = Lookups::default();
        let mut color = |color: &Color, purpose: u32| match *color {
            Color::Plain(color) => color.as_vec3(),
            Color::Texture(i) => match scene.textures[i].kind {
                TextureKind::Constant(color) => color.as_vec3(),
                _ => {
                    lookups.add(self.texture(scene, i, None), purpose);
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
                ambient: match scene.render.integrator {
                    Integrator::Path => Vec3::ZERO, // without effect
                    _ => color(ambient, FOR_AMBIENT),
                },
                kind: PHONG,
                diffuse: color(diffuse, FOR_DIFFUSE),
                shininess: *shininess as f32,
                specular: color(specular, FOR_SPECULAR),
                exponent: *shininess as u32,
                ..bytemuck::Zeroable::zeroed()
            },
            Reflection::Mirror { tint } | Reflection::Conductor { color: tint } => Material {
                kind: MIRROR,
                tint: color(tint, FOR_TINT),
                ..bytemuck::Zeroable::zeroed()
            },
            Reflection::Glass { ior, tint } => Material {
                kind: GLASS,
                tint: color(tint, FOR_TINT),
                ior: *ior as f32,
                ..bytemuck::Zeroable::zeroed()
            },
            Reflection::Dielectric {
                ior,
                color: tint,
                absorption,
            } => Material {
                kind: GLASS,
                tint: color(tint, FOR_TINT),
                ior: *ior as f32,
                absorption: absorption.as_vec3(),
                ..bytemuck::Zeroable::zeroed()
            },
            Reflection::Diffuse {
                color: albedo,
                roughness,
            } => Material {
                kind: DIFFUSE,
                diffuse: color(albedo, FOR_DIFFUSE),
                roughness: match *roughness {
                    Value::Plain(roughness) => roughness as f32,
                    Value::Texture(i) => color(&Color::Texture(i), FOR_ROUGHNESS).x,
                },
                ..bytemuck::Zeroable::zeroed()
            },
        };
        record.emission = color(&material.emission, FOR_EMISSION);
        if let Some(map) = material.normal_map {
            lookups.add(self.texture(scene, map.texture, Some(map.strength)), FOR_NORMAL);
        }
        record.lookups = lookups.0;
        record
    }

    /// The record of a texture that gives a colour, or a normal if it has a strength.
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
        let between = |first: DVec3, second: DVec3| (first.as_vec3(), second.as_vec3());
        let record = match &texture.kind {
            TextureKind::Constant(color) => {
                let (first, second) = between(*color, *color);
                Texture {
                    first,
                    kind: CHECKER,
                    second,
                    ..plain
                }
            }
            TextureKind::Checker { even, odd } => {
                let (first, second) = between(*even, *odd);
                Texture {
                    first,
                    kind: CHECKER,
                    second,
                    ..plain
                }
            }
            TextureKind::Lines { cell, line, line_width } => {
                let (first, second) = between(*cell, *line);
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
            } => {
                let (first, second) = match strength {
                    Some(s) => between(DVec3::new(-s, -s, -1.0), DVec3::new(s, s, 1.0)),
                    None => between(DVec3::ZERO, DVec3::ONE),
                };
                let levels = levels_of(image, *filter);
                let address = address(image);
                let most_levels = self.levels.get(&address).map_or(levels, |most| levels.max(*most));
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
                    wrap: match wrap {
                        Wrap::Repeat => REPEAT,
                        Wrap::Clamp => CLAMP,
                        Wrap::Mirror => MIRRORED,
                    },
                    texels: *(self.places.entry(address)).or_insert_with(|| pyramid(image, most_levels, texels)),
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

/// What tells a scene's images apart while it stands.
fn address(image: &Arc<Image>) -> usize {
    Arc::as_ptr(image).addr()
}

fn levels_of(image: &Image, filter: TextureFilter) -> u32 {
    if filter.needs_levels() { image.levels() } else { 1 }
}

/// The lookups of a material: each texture once, with all its purposes.
#[derive(Default)]
struct Lookups(UVec4);

impl Lookups {
    fn add(&mut self, texture: u32, purpose: u32) {
        let same = |lookup: u32| lookup == 0 || lookup & super::TEXTURE_NUMBER == texture;
        // No material has more than four, so that there is always a place.
        if let Some(i) = (0..4).find(|i| same(self.0[*i])) {
            self.0[i] |= texture | purpose;
        }
    }
}

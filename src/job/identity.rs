//! What a picture is of: two jobs with the same identity make the same bits, so that one may go on with what another left.

use bytemuck::{bytes_of, cast_slice};
use serde::{Deserialize, Serialize};

use crate::film::Region;
use crate::pack::{Packed, PackedMesh, Specialization};

/// The longest side of a picture, and the most samples of a pixel: those of scenes.
const LARGEST: u32 = 65_536;

/// All that decides on the bits of a film, and not the device that renders it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identity {
    /// The program's version.
    pub version: String,
    /// The hash of the shaders' files; empty without the feature `gpu`, which has none.
    pub shaders: String,
    /// The hash of the scene as backends read it: what it is made of, and the values of the options that stand in for its own.
    pub scene: String,
    /// Width and height of the whole picture in pixels.
    pub picture: [u32; 2],
    /// The pixels that are rendered: x0, y0, x1, y1.
    pub region: [u32; 4],
    /// Samples of every pixel; under adaptive sampling the most of one.
    pub pixel_samples: u32,
    /// Whether sampling is adaptive.
    pub adaptive: bool,
    /// Whether the film has layers that are means over the samples.
    pub layers: bool,
    /// Whether rounding is done in software.
    pub exact_rounding: bool,
}

impl Identity {
    /// That of a scene and the pixels of it that are rendered.
    pub fn of(scene: &Packed, region: Region, exact_rounding: bool) -> Identity {
        let form = scene.form();
        Identity {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            shaders: hash_of_shaders(),
            scene: hash_of_scene(scene),
            picture: [scene.camera.width, scene.camera.height],
            region: [region.x0, region.y0, region.x1, region.y1],
            pixel_samples: scene.pixel_samples,
            adaptive: form.adaptive,
            layers: form.layers,
            exact_rounding,
        }
    }

    /// The name of a file that is of this job alone.
    pub fn file_name(&self) -> String {
        let Identity {
            version,
            shaders,
            scene,
            picture,
            region,
            pixel_samples,
            adaptive,
            layers,
            exact_rounding,
        } = self;
        let mut hasher = blake3::Hasher::new();
        for text in [version, shaders, scene] {
            list(&mut hasher, text.as_bytes());
        }
        list(&mut hasher, bytes_of(picture));
        list(&mut hasher, bytes_of(region));
        list(&mut hasher, bytes_of(pixel_samples));
        list(&mut hasher, &[*adaptive, *layers, *exact_rounding].map(u8::from));
        format!("{}.checkpoint", &hasher.finalize().to_hex()[..16])
    }

    /// The pixels that are rendered.
    pub fn region(&self) -> Region {
        let [x0, y0, x1, y1] = self.region;
        Region { x0, y0, x1, y1 }
    }

    /// Refuses what no job of this program has: sizes and regions that are none, of a file that somebody made.
    pub fn check(&self) -> Result<(), String> {
        let [width, height] = self.picture;
        let sides = 1..=LARGEST;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(format!(
                "its picture of {width} x {height} pixels must have from 1 to {LARGEST} along a side"
            ));
        }
        let region = self.region();
        if region.is_empty() || region.within(Region::whole(width, height)) != region {
            return Err(format!(
                "its pixels, {region}, must lie in its picture of {width} x {height}"
            ));
        }
        match sides.contains(&self.pixel_samples) {
            true => Ok(()),
            false => Err(format!(
                "its {} samples of a pixel must be from 1 to {LARGEST}",
                self.pixel_samples
            )),
        }
    }

    /// In what another job differs from this one, in words that end "it is of ..."; `None` if it is the same.
    pub fn difference(&self, other: &Identity) -> Option<String> {
        let told = |what: &str, this: &dyn std::fmt::Display, that: &dyn std::fmt::Display| {
            Some(format!("another {what}: {that}, and this is {this}"))
        };
        let size = |[width, height]: [u32; 2]| format!("{width} x {height}");
        let with = |there: bool| if there { "with" } else { "without" };
        let short = |hash: &str| hash.get(..16).unwrap_or(hash).to_owned();
        if self.version != other.version {
            told("version of wgray", &self.version, &other.version)
        } else if self.picture != other.picture {
            told("size", &size(self.picture), &size(other.picture))
        } else if self.region != other.region {
            told("crop", &self.region(), &other.region())
        } else if self.pixel_samples != other.pixel_samples {
            told("number of samples", &self.pixel_samples, &other.pixel_samples)
        } else if self.adaptive != other.adaptive {
            let [this, that] = [self, other].map(|job| format!("{} adaptive sampling", with(job.adaptive)));
            told("kind of sampling", &this, &that)
        } else if self.layers != other.layers {
            let [this, that] = [self, other].map(|job| format!("{} layers of the samples", with(job.layers)));
            told("form", &this, &that)
        } else if self.exact_rounding != other.exact_rounding {
            let [this, that] = [self, other].map(|job| format!("{} --exact-rounding", with(job.exact_rounding)));
            told("rounding", &this, &that)
        } else if self.shaders != other.shaders {
            let rule = "other shaders: their hash is";
            let [this, that] = [self, other].map(|job| short(&job.shaders));
            Some(format!("{rule} {that}, and this program's is {this}"))
        } else if self.scene != other.scene {
            let [this, that] = [self, other].map(|job| short(&job.scene));
            Some(format!(
                "another scene, or of other options in place of its own (seed, integrator ...): its hash is {that}, and this \
                 one's is {this}"
            ))
        } else {
            None
        }
    }
}

/// The hash of all shaders of the program, their names with them.
pub fn hash_of_shaders() -> String {
    #[cfg(feature = "gpu")]
    {
        let mut hasher = blake3::Hasher::new();
        for (name, text) in crate::gpu::compose::built_in() {
            list(&mut hasher, name.as_bytes());
            list(&mut hasher, text.as_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }
    #[cfg(not(feature = "gpu"))]
    {
        String::new()
    }
}

/// The hash of a scene as backends read it.
pub fn hash_of_scene(scene: &Packed) -> String {
    // Every field, so that a new one cannot be forgotten.
    let Packed {
        origin,
        camera,
        integrator,
        environment,
        primitives,
        bounds,
        nodes,
        items,
        instances,
        meshes,
        group_words,
        materials,
        lights,
        emitters,
        light_nodes,
        light_leaves,
        counts,
        lookups,
        textures,
        texels,
        filter_table,
        pixel_samples,
        adaptive,
        specialization,
    } = scene;
    let mut hasher = blake3::Hasher::new();
    let records: [&[u8]; 19] = [
        bytes_of(camera),
        bytes_of(environment),
        bytes_of(counts),
        cast_slice(primitives),
        cast_slice(bounds),
        cast_slice(nodes),
        cast_slice(items),
        cast_slice(instances),
        cast_slice(group_words),
        cast_slice(materials),
        cast_slice(lights),
        cast_slice(emitters),
        cast_slice(light_nodes),
        cast_slice(light_leaves),
        cast_slice(lookups),
        cast_slice(textures),
        cast_slice(texels),
        cast_slice(filter_table),
        integrator.name().as_bytes(),
    ];
    for bytes in records {
        list(&mut hasher, bytes);
    }
    for coordinate in origin.to_array() {
        hasher.update(&coordinate.to_le_bytes());
    }
    for mesh in meshes {
        hash_mesh(&mut hasher, mesh);
    }
    hasher.update(&pixel_samples.to_le_bytes());
    hasher.update(&[u8::from(*adaptive)]);
    // With layers and without, the scene is the same.
    let specialization = Specialization {
        layers: 0,
        ..*specialization
    };
    for (name, value) in specialization.constants() {
        list(&mut hasher, name.as_bytes());
        hasher.update(&value.to_le_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

fn hash_mesh(hasher: &mut blake3::Hasher, mesh: &PackedMesh) {
    let PackedMesh {
        nodes,
        triangles,
        vertices,
        attributes,
        tangents,
        colors,
        more_uvs,
        groups,
        low,
        high,
    } = mesh;
    let records: [&[u8]; 10] = [
        cast_slice(nodes),
        cast_slice(triangles),
        cast_slice(vertices),
        cast_slice(attributes),
        cast_slice(tangents),
        cast_slice(colors),
        cast_slice(more_uvs),
        cast_slice(groups),
        bytes_of(low),
        bytes_of(high),
    ];
    for bytes in records {
        list(hasher, bytes);
    }
}

/// Bytes and how many they are, so that no two lists of lists are the same bytes.
fn list(hasher: &mut blake3::Hasher, bytes: &[u8]) {
    hasher.update(&(bytes.len() as u64).to_le_bytes());
    hasher.update(bytes);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_jobs_that_cannot_be_are_refused() {
        let good = Identity {
            version: String::new(),
            shaders: String::new(),
            scene: String::new(),
            picture: [65_536, 3],
            region: [1, 0, 65_536, 3],
            pixel_samples: 65_536,
            adaptive: false,
            layers: false,
            exact_rounding: false,
        };
        good.check().unwrap();
        for (picture, region, pixel_samples) in [
            ([0, 3], [0, 0, 0, 3], 1),
            ([65_537, 3], [0, 0, 1, 1], 1),
            ([4, u32::MAX], [0, 0, 4, u32::MAX], 1),
            ([4, 3], [0, 0, 4, 4], 1),
            ([4, 3], [0, 0, 0, 3], 1),
            ([4, 3], [3, 0, 2, 3], 1),
            ([4, 3], [u32::MAX, 0, u32::MAX, 3], 1),
            ([4, 3], [0, 0, 4, 3], 0),
            ([4, 3], [0, 0, 4, 3], 65_537),
        ] {
            let bad = Identity {
                picture,
                region,
                pixel_samples,
                ..good.clone()
            };
            assert!(bad.check().unwrap_err().contains("must "), "{bad:?}");
        }
    }
}

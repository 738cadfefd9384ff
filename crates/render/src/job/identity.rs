//! Identity of a job: jobs with the same identity produce the same bits, so that one job can resume another.

use bytemuck::bytes_of;
use serde::{Deserialize, Serialize};

use wgray_image::Region;
use wgray_trace::film::FilmLayout;
use wgray_trace::records::{Packed, PackedMesh, Specialization};

/// Maximum width and height of an image in pixels, and maximum number of samples per pixel. Scenes have equal limits.
const MAX_COUNT: u32 = 65_536;

/// Everything that determines the bits of a film. The device is not included, because it does not affect the bits.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identity {
    /// Program version.
    pub version: String,
    /// Hash of the shader files.
    pub shaders: String,
    /// Hash of the packed scene, in which options have overridden values of the scene file.
    pub scene: String,
    /// Width and height of the full image.
    pub picture: [u32; 2],
    /// Rendered pixels: x0, y0, x1, y1.
    pub region: [u32; 4],
    /// Number of samples per pixel; with adaptive sampling, the maximum number.
    pub pixel_samples: u32,
    /// True with adaptive sampling.
    pub adaptive: bool,
    /// True if the film contains layers in addition to the image.
    pub layers: bool,
    /// True if the film has noise estimates.
    pub noise: bool,
    /// True if square roots and divisions are rounded in software.
    pub exact_rounding: bool,
}

impl Identity {
    /// Returns the identity of rendering `region`.
    pub fn of(scene: &Packed, region: Region, exact_rounding: bool) -> Identity {
        let film_layout = scene.film_layout();
        Identity {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            shaders: wgray_shaders::hash(),
            scene: hash_of_scene(scene),
            picture: [scene.camera.width, scene.camera.height],
            region: [region.x0, region.y0, region.x1, region.y1],
            pixel_samples: scene.sampling.pixel_samples,
            adaptive: film_layout.adaptive,
            layers: film_layout.layers,
            noise: film_layout.noise,
            exact_rounding,
        }
    }

    /// Returns a file name unique to this job.
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
            noise,
            exact_rounding,
        } = self;
        let mut hasher = blake3::Hasher::new();
        for text in [version, shaders, scene] {
            hash_list(&mut hasher, text.as_bytes());
        }
        hash_list(&mut hasher, bytes_of(picture));
        hash_list(&mut hasher, bytes_of(region));
        hash_list(&mut hasher, bytes_of(pixel_samples));
        hash_list(
            &mut hasher,
            &[*adaptive, *layers, *noise, *exact_rounding].map(u8::from),
        );
        format!("{}.checkpoint", &hasher.finalize().to_hex()[..16])
    }

    /// Returns the layout of the film.
    pub fn film_layout(&self) -> FilmLayout {
        FilmLayout {
            adaptive: self.adaptive,
            layers: self.layers,
            noise: self.noise,
        }
    }

    /// Returns the rendered pixels.
    pub fn region(&self) -> Region {
        let [x0, y0, x1, y1] = self.region;
        Region { x0, y0, x1, y1 }
    }

    /// Rejects sizes and regions that this program never writes, because files are untrusted.
    pub fn check(&self) -> Result<(), String> {
        let [width, height] = self.picture;
        let sides = 1..=MAX_COUNT;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(format!(
                "its image size, {width} x {height}, must be from 1 to {MAX_COUNT} pixels along each side"
            ));
        }
        let region = self.region();
        if region.is_empty() || region.within(Region::whole(width, height)) != region {
            return Err(format!(
                "its region, {region}, must lie within its image of {width} x {height} pixels"
            ));
        }
        match sides.contains(&self.pixel_samples) {
            true => Ok(()),
            false => Err(format!(
                "its samples per pixel, {}, must be from 1 to {MAX_COUNT}",
                self.pixel_samples
            )),
        }
    }

    /// Describes the first difference of another job from this job: "its size is A, not B".
    pub fn difference(&self, other: &Identity) -> Option<String> {
        let size = |[width, height]: [u32; 2]| format!("{width} x {height}");
        let short = |hash: &str| hash.get(..16).unwrap_or(hash).to_owned();
        let either = |is_set: bool, set: &str, unset: &str| match is_set {
            true => format!("{set}, not {unset}"),
            false => format!("{unset}, not {set}"),
        };
        Some(if self.version != other.version {
            format!("its version of wgray is {}, not {}", other.version, self.version)
        } else if self.picture != other.picture {
            format!("its size is {}, not {}", size(other.picture), size(self.picture))
        } else if self.region != other.region {
            format!("its crop is {}, not {}", other.region(), self.region())
        } else if self.pixel_samples != other.pixel_samples {
            format!(
                "its number of samples is {}, not {}",
                other.pixel_samples, self.pixel_samples
            )
        } else if self.adaptive != other.adaptive {
            format!("its sampling is {}", either(other.adaptive, "adaptive", "uniform"))
        } else if self.layers != other.layers {
            format!(
                "its layers are {}",
                either(other.layers, "means over the samples", "first hits only")
            )
        } else if self.noise != other.noise {
            let text = either(other.noise, "with", "without");
            format!("it was rendered {text}, noise estimates")
        } else if self.exact_rounding != other.exact_rounding {
            let text = either(other.exact_rounding, "with", "without");
            format!("it was rendered {text}, --exact-rounding")
        } else if self.shaders != other.shaders {
            format!(
                "its shaders differ: their hash is {}, not {}",
                short(&other.shaders),
                short(&self.shaders)
            )
        } else if self.scene != other.scene {
            format!(
                "its scene or an option (seed, integrator, ...) differs: the hash is {}, not {}",
                short(&other.scene),
                short(&self.scene)
            )
        } else {
            return None;
        })
    }
}

/// Returns a packed scene's hash.
pub fn hash_of_scene(scene: &Packed) -> String {
    let Packed {
        origin,
        camera,
        integrator,
        environment,
        counts,
        sampling,
        specialization,
        ..
    } = scene;
    let mut hasher = blake3::Hasher::new();
    let records: [&[u8]; 4] = [
        bytes_of(camera),
        bytes_of(environment),
        bytes_of(counts),
        integrator.name().as_bytes(),
    ];
    for bytes in records.into_iter().chain(scene.lists()) {
        hash_list(&mut hasher, bytes);
    }
    for coordinate in origin.to_array() {
        hasher.update(&coordinate.to_le_bytes());
    }
    for mesh in &scene.bvh.meshes {
        hash_mesh(&mut hasher, mesh);
    }
    hasher.update(&sampling.pixel_samples.to_le_bytes());
    hasher.update(&[u8::from(sampling.adaptive)]);
    // Layers and noise estimates do not change the scene.
    let specialization = Specialization {
        layers: 0,
        noise: 0,
        ..*specialization
    };
    for (name, value) in specialization.constants() {
        hash_list(&mut hasher, name.as_bytes());
        hasher.update(&value.to_le_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

fn hash_mesh(hasher: &mut blake3::Hasher, mesh: &PackedMesh) {
    for bytes in mesh.lists() {
        hash_list(hasher, bytes);
    }
    hasher.update(bytes_of(&[mesh.low, mesh.high]));
}

/// Minimum number of bytes of a list that all threads hash together.
const PARALLEL_BYTES: usize = 1 << 20;

/// Hashes the length of a list, then its bytes, so that different sequences of lists never give the same hashed bytes.
fn hash_list(hasher: &mut blake3::Hasher, bytes: &[u8]) {
    hasher.update(&(bytes.len() as u64).to_le_bytes());
    match bytes.len() >= PARALLEL_BYTES {
        true => hasher.update_rayon(bytes),
        false => hasher.update(bytes),
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identities_with_invalid_sizes_or_regions_are_rejected() {
        let valid = Identity {
            version: String::new(),
            shaders: String::new(),
            scene: String::new(),
            picture: [65_536, 3],
            region: [1, 0, 65_536, 3],
            pixel_samples: 65_536,
            adaptive: false,
            layers: false,
            noise: false,
            exact_rounding: false,
        };
        valid.check().unwrap();
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
            let invalid = Identity {
                picture,
                region,
                pixel_samples,
                ..valid.clone()
            };
            assert!(invalid.check().unwrap_err().contains("must "), "{invalid:?}");
        }
    }
}

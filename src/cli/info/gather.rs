//! The data of `wgray info`, which `--json` prints.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use crate::device_plan::DevicePlan;
use crate::scene::{
    Camera, CameraPath, Geometry, Light, ModelContents, Projection, Reflection, Scene, Texels, TextureKind,
};
use serde::Serialize;
use wgray_image::Region;
use wgray_render::denoise;
use wgray_render::job::{WorkSplit, bands};
use wgray_trace::records::Packed;

use super::kernel::features;

type Counts = BTreeMap<&'static str, u64>;

/// The output of `wgray info`. Angles are in degrees, and memory is in bytes.
#[derive(Debug, Serialize)]
pub struct Info {
    pub scene: String,
    pub picture: ImageInfo,
    pub camera: CameraInfo,
    /// Minimum and maximum corner of the bounds of all shapes except planes.
    pub bounds: Option<[[f64; 3]; 2]>,
    pub shapes: Shapes,
    pub materials: Kinds,
    pub material_names: Vec<String>,
    pub textures: Vec<TextureInfo>,
    pub lights: Lights,
    pub models: Vec<ModelContents>,
    pub memory: Memory,
    pub kernel: Kernel,
    pub device: Device,
    /// Warnings that a render prints.
    pub notes: Vec<String>,
    pub files: Vec<String>,
}

#[derive(Debug, Serialize)]
pub struct ImageInfo {
    pub width: u32,
    pub height: u32,
    pub integrator: &'static str,
    pub pixel_pattern: &'static str,
    pub pixel_samples: u32,
    /// Maximum number of samples per pixel; differs from `pixel_samples` if sampling is adaptive.
    pub max_samples: u32,
    /// The former name of `max_samples`, kept until version 0.3.
    #[serde(rename = "most_samples")]
    former_max_samples: u32,
    /// Light samples per hit, summed over all lights.
    pub light_samples: u64,
    pub max_depth: u32,
    pub seed: u32,
}

#[derive(Debug, Serialize)]
pub struct CameraInfo {
    #[serde(rename = "type")]
    pub kind: &'static str,
    pub position: [f64; 3],
    pub look_at: [f64; 3],
    pub up: [f64; 3],
    /// Vertical field of view of a perspective camera.
    pub fov: Option<f64>,
    /// Height of the view of an orthographic camera.
    pub height: Option<f64>,
    /// Diameter of the lens.
    pub aperture: Option<f64>,
    pub focus_distance: Option<f64>,
    /// First and last frame of the camera's path.
    pub frames: Option<[f64; 2]>,
}

#[derive(Debug, Serialize)]
pub struct Kinds {
    pub count: u64,
    pub by_type: Counts,
}

impl Kinds {
    fn of(names: impl Iterator<Item = &'static str>) -> Kinds {
        let mut by_type = Counts::new();
        for name in names {
            *by_type.entry(name).or_default() += 1;
        }
        Kinds {
            count: by_type.values().sum(),
            by_type,
        }
    }
}

#[derive(Debug, Serialize)]
pub struct Shapes {
    #[serde(flatten)]
    pub kinds: Kinds,
    pub meshes: u64,
    pub mesh_triangles: u64,
    pub instanced_triangles: u64,
    /// The former name of `instanced_triangles`, kept until version 0.3.
    #[serde(rename = "placed_mesh_triangles")]
    former_instanced_triangles: u64,
    /// Number of triangles of all mesh instances, triangle shapes and tetrahedra.
    pub triangles: u64,
    /// Number of primitives that are not part of meshes: shapes (a tetrahedron is four triangles) and area lights.
    pub primitives: u64,
}

#[derive(Debug, Serialize)]
pub struct TextureInfo {
    #[serde(rename = "type")]
    pub kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub texels: Option<&'static str>,
}

#[derive(Debug, Serialize)]
pub struct Lights {
    #[serde(flatten)]
    pub kinds: Kinds,
    /// Emitters that the path tracer samples: lights, emissive surfaces, the environment.
    pub emitters: u64,
    /// `color`, or the size of the environment map.
    pub environment: Option<String>,
}

#[derive(Debug, Serialize)]
pub struct Memory {
    /// Bytes of the packed scene and the largest film.
    pub total: u64,
    /// The packed scene, which includes BVHs and texels.
    pub scene: u64,
    pub trees: u64,
    pub texels: u64,
    /// The scene in device memory; `None` for the CPU.
    pub scene_on_device: Option<u64>,
    /// Memory of the largest band, and of the whole film and the denoiser if the image is denoised.
    pub film: u64,
    pub bands: u64,
}

#[derive(Debug, Serialize)]
pub struct Kernel {
    /// False for the CPU, which needs no kernel.
    pub compiled: bool,
    pub entry: Option<&'static str>,
    /// True if the scene is compiled into the kernel as constants.
    pub baked: Option<bool>,
    /// Number of lines of WGSL before dead code is removed.
    pub lines: Option<usize>,
    pub uses: Vec<&'static str>,
    pub leaves_out: Vec<&'static str>,
    /// Values of the shaders' overrides, by name.
    pub constants: BTreeMap<&'static str, u32>,
}

#[derive(Debug, Serialize)]
pub struct Device {
    pub name: String,
    pub driver: String,
    #[serde(rename = "interface")]
    pub backend: String,
    pub why: String,
}

impl Info {
    pub fn of(path: &Path, scene: &Scene, packed: &Packed, plan: &DevicePlan) -> Info {
        let full = Region::whole(scene.width, scene.height);
        let split = WorkSplit::of(packed.film_layout());
        let films: Vec<u64> = bands(full, &split, u64::MAX).map(|band| band.pixels()).collect();
        let band = films.iter().max().unwrap_or(&0) * packed.film_layout().bytes() as u64;
        let film = match scene.render.denoise {
            true => denoise::memory(full, packed.film_layout()).saturating_add(band),
            false => band,
        };
        let kernel = kernel(packed, plan);
        Info {
            scene: path.display().to_string(),
            picture: ImageInfo {
                width: scene.width,
                height: scene.height,
                integrator: scene.render.integrator.name(),
                pixel_pattern: scene.render.pixel_samples.pattern.name(),
                pixel_samples: scene.render.pixel_samples.count,
                max_samples: packed.sampling.pixel_samples,
                former_max_samples: packed.sampling.pixel_samples,
                light_samples: packed.light_samples(),
                max_depth: scene.render.max_depth,
                seed: scene.render.seed,
            },
            camera: camera(&scene.camera, scene.camera_path.as_ref()),
            bounds: scene
                .bounds()
                .map(|(low, high)| [low, high].map(|corner| corner.to_array())),
            shapes: shapes(scene, packed),
            materials: Kinds::of(
                scene
                    .materials
                    .iter()
                    .map(|material| reflection_name(&material.reflection)),
            ),
            material_names: scene.material_names.clone(),
            textures: scene
                .textures
                .iter()
                .map(|texture| texture_info(&texture.kind))
                .collect(),
            lights: lights(scene, packed),
            models: scene.models().cloned().collect(),
            memory: Memory {
                total: packed.bytes() + film,
                scene: packed.bytes(),
                trees: packed.tree_bytes(),
                texels: packed.texel_bytes(),
                scene_on_device: scene_on_device(plan),
                film,
                bands: films.len() as u64,
            },
            kernel,
            device: Device {
                name: plan.info.name.clone(),
                driver: plan.info.driver.clone(),
                backend: plan.info.interface.clone(),
                why: plan.reason.clone(),
            },
            notes: (scene.notes.iter().map(ToString::to_string))
                .chain(scene.visibility_warnings())
                .collect(),
            files: scene.files.iter().map(|file| file.display().to_string()).collect(),
        }
    }
}

fn camera(camera: &Camera, path: Option<&CameraPath>) -> CameraInfo {
    let (kind, fov, height) = match camera.projection {
        Projection::Perspective { fov } => ("perspective", Some(fov.to_degrees()), None),
        Projection::Orthographic { height } => ("orthographic", None, Some(height)),
        Projection::Panorama => ("panorama", None, None),
    };
    CameraInfo {
        kind,
        position: camera.position.to_array(),
        look_at: camera.look_at.to_array(),
        up: camera.up.to_array(),
        fov,
        height,
        aperture: camera.lens.map(|lens| 2.0 * lens.radius),
        focus_distance: camera.lens.map(|lens| lens.focus),
        frames: path.map(|path| path.frames().into()),
    }
}

fn shapes(scene: &Scene, packed: &Packed) -> Shapes {
    let mut meshes = HashSet::new();
    let (mut mesh_triangles, mut instanced_triangles, mut other_triangles) = (0, 0, 0);
    for shape in &scene.shapes {
        match &shape.geometry {
            Geometry::Mesh { mesh, .. } => {
                let count = mesh.triangles.len() as u64;
                instanced_triangles += count;
                if meshes.insert(Arc::as_ptr(mesh)) {
                    mesh_triangles += count;
                }
            }
            Geometry::Triangles(triangles) => other_triangles += triangles.len() as u64,
            _ => {}
        }
    }
    Shapes {
        kinds: Kinds::of(scene.shapes.iter().map(|shape| shape.geometry.name())),
        meshes: meshes.len() as u64,
        mesh_triangles,
        instanced_triangles,
        former_instanced_triangles: instanced_triangles,
        triangles: instanced_triangles + other_triangles,
        primitives: packed.primitives.len() as u64,
    }
}

fn reflection_name(reflection: &Reflection) -> &'static str {
    match reflection {
        Reflection::Phong { .. } => "phong",
        Reflection::Mirror { .. } => "mirror",
        Reflection::Glass { .. } => "glass",
        Reflection::Diffuse { .. } => "diffuse",
        Reflection::Conductor { .. } => "conductor",
        Reflection::Dielectric { .. } => "dielectric",
        Reflection::Principled(_) => "principled",
    }
}

fn texture_info(kind: &TextureKind) -> TextureInfo {
    let without_image = |kind| TextureInfo {
        kind,
        size: None,
        texels: None,
    };
    match kind {
        TextureKind::Constant(_) => without_image("constant"),
        TextureKind::Checker { .. } => without_image("checker"),
        TextureKind::Lines { .. } => without_image("grid"),
        TextureKind::Image { image, .. } => TextureInfo {
            size: Some([image.width, image.height]),
            texels: Some(match image.texels {
                Texels::Bytes(..) => "8 bits",
                Texels::Floats(_) => "floats",
            }),
            ..without_image("image")
        },
    }
}

fn lights(scene: &Scene, packed: &Packed) -> Lights {
    let kind = |light: &Light| match light {
        Light::Rectangle { .. } => "rectangle",
        Light::Point { .. } => "point",
        Light::Directional { .. } => "directional",
        Light::Spot { .. } => "spot",
    };
    let environment = scene.environment.as_ref().map(|environment| match &environment.image {
        Some(image) => format!("image, {} x {} texels", image.image.width, image.image.height),
        None => "color".to_owned(),
    });
    Lights {
        kinds: Kinds::of(scene.lights.iter().map(kind)),
        emitters: packed.emitter_count(),
        environment,
    }
}

#[cfg(feature = "gpu")]
fn scene_on_device(plan: &DevicePlan) -> Option<u64> {
    let (_, kernel) = plan.adapter.as_ref()?;
    Some(kernel.scene_bytes)
}

#[cfg(not(feature = "gpu"))]
fn scene_on_device(_: &DevicePlan) -> Option<u64> {
    None
}

fn kernel(packed: &Packed, plan: &DevicePlan) -> Kernel {
    let features = features(packed);
    let names = |used: bool| {
        let matching = features.iter().filter(move |(_, is_used)| *is_used == used);
        matching.map(|(name, _)| *name).collect()
    };
    let uncompiled = Kernel {
        compiled: false,
        entry: None,
        baked: None,
        lines: None,
        uses: names(true),
        leaves_out: names(false),
        constants: packed.specialization.constants().into_iter().collect(),
    };
    with_adapter(uncompiled, plan)
}

#[cfg(feature = "gpu")]
fn with_adapter(uncompiled: Kernel, plan: &DevicePlan) -> Kernel {
    match &plan.adapter {
        None => uncompiled,
        Some((_, kernel)) => Kernel {
            compiled: true,
            entry: Some(kernel.entry),
            baked: Some(kernel.baked),
            lines: Some(kernel.lines),
            ..uncompiled
        },
    }
}

#[cfg(not(feature = "gpu"))]
fn with_adapter(uncompiled: Kernel, _: &DevicePlan) -> Kernel {
    uncompiled
}

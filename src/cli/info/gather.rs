//! What `wgray info` tells, as its JSON has it.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;
use wgray::device::Foreseen;
use wgray::film::Region;
use wgray::job::{Cut, bands};
use wgray::pack::Packed;
use wgray::scene::{Camera, CameraPath, Geometry, Light, Projection, Reflection, Scene, Texels, TextureKind};

use super::kernel::features;

type Counts = BTreeMap<&'static str, u64>;

/// All of it. Angles are in degrees, memory in bytes.
#[derive(Debug, Serialize)]
pub struct Info {
    pub scene: String,
    pub picture: Picture,
    pub camera: Seen,
    /// The box around all shapes but planes: its lowest and its highest corner.
    pub bounds: Option<[[f64; 3]; 2]>,
    pub shapes: Shapes,
    pub materials: Kinds,
    pub textures: Vec<Textured>,
    pub lights: Lights,
    pub memory: Memory,
    pub kernel: Kernel,
    pub device: Device,
    /// What a render warns of.
    pub notes: Vec<String>,
    /// All that the scene is made of besides its own file.
    pub files: Vec<String>,
}

#[derive(Debug, Serialize)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub integrator: &'static str,
    pub pixel_pattern: &'static str,
    pub pixel_samples: u32,
    /// Under adaptive sampling the most of a pixel.
    pub most_samples: u32,
    /// At every hit, over all lights.
    pub light_samples: u64,
    pub max_depth: u32,
    pub seed: u32,
}

#[derive(Debug, Serialize)]
pub struct Seen {
    #[serde(rename = "type")]
    pub kind: &'static str,
    pub position: [f64; 3],
    pub look_at: [f64; 3],
    pub up: [f64; 3],
    /// Vertical, of perspective cameras.
    pub fov: Option<f64>,
    /// Of the seen rectangle, of orthographic cameras.
    pub height: Option<f64>,
    /// The diameter of its lens, and where it is sharp.
    pub aperture: Option<f64>,
    pub focus_distance: Option<f64>,
    /// The first and the last frame of its path.
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
    /// Different meshes.
    pub meshes: u64,
    /// Their triangles, each counted once, and as often as its mesh is there.
    pub mesh_triangles: u64,
    pub placed_mesh_triangles: u64,
    /// All triangles that there are: these, and those of triangles and tetrahedra.
    pub triangles: u64,
    /// What rays are tested with besides meshes: shapes, four triangles of a tetrahedron, and rectangles that are lights.
    pub primitives: u64,
}

#[derive(Debug, Serialize)]
pub struct Textured {
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Of an image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub texels: Option<&'static str>,
}

#[derive(Debug, Serialize)]
pub struct Lights {
    #[serde(flatten)]
    pub kinds: Kinds,
    /// What paths sample light of: these, surfaces that shine, the surroundings.
    pub emitters: u64,
    /// `color`, or the size of an image.
    pub environment: Option<String>,
}

#[derive(Debug, Serialize)]
pub struct Memory {
    /// The scene as it is rendered from, all below among it.
    pub scene: u64,
    pub trees: u64,
    pub texels: u64,
    /// The scene on the device, if it is not the CPU.
    pub scene_on_device: Option<u64>,
    /// The largest film at a time.
    pub film: u64,
    /// In how many parts the picture is rendered.
    pub bands: u64,
}

#[derive(Debug, Serialize)]
pub struct Kernel {
    /// Nothing is compiled for the CPU.
    pub compiled: bool,
    pub entry: Option<&'static str>,
    /// Whether the scene is written into it as constants.
    pub baked: Option<bool>,
    /// Lines of WGSL, before what is not needed is left out.
    pub lines: Option<usize>,
    pub uses: Vec<&'static str>,
    pub leaves_out: Vec<&'static str>,
    /// What it takes as constant, by the names in the shaders.
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
    /// Gathers it.
    pub fn of(path: &Path, scene: &Scene, packed: &Packed, foreseen: &Foreseen) -> Info {
        let whole = Region::whole(scene.width, scene.height);
        let cut = Cut::of(packed.form());
        let films: Vec<u64> = bands(whole, &cut, u64::MAX).map(|band| band.pixels()).collect();
        let kernel = kernel(packed, foreseen);
        Info {
            scene: path.display().to_string(),
            picture: Picture {
                width: scene.width,
                height: scene.height,
                integrator: scene.render.integrator.name(),
                pixel_pattern: scene.render.pixel_samples.pattern.name(),
                pixel_samples: scene.render.pixel_samples.count,
                most_samples: packed.pixel_samples,
                light_samples: packed.light_samples(),
                max_depth: scene.render.max_depth,
                seed: scene.render.seed,
            },
            camera: seen(&scene.camera, scene.camera_path.as_ref()),
            bounds: scene
                .bounds()
                .map(|(low, high)| [low, high].map(|corner| corner.to_array())),
            shapes: shapes(scene, packed),
            materials: Kinds::of(scene.materials.iter().map(|material| reflection(&material.reflection))),
            textures: scene.textures.iter().map(|texture| textured(&texture.kind)).collect(),
            lights: lights(scene, packed),
            memory: Memory {
                scene: packed.bytes(),
                trees: packed.tree_bytes(),
                texels: packed.texel_bytes(),
                scene_on_device: scene_on_device(foreseen),
                film: films.iter().max().unwrap_or(&0) * packed.form().bytes() as u64,
                bands: films.len() as u64,
            },
            kernel,
            device: Device {
                name: foreseen.info.name.clone(),
                driver: foreseen.info.driver.clone(),
                backend: foreseen.info.interface.clone(),
                why: foreseen.why.clone(),
            },
            notes: scene.notes.clone(),
            files: scene.files.iter().map(|file| file.display().to_string()).collect(),
        }
    }
}

fn seen(camera: &Camera, path: Option<&CameraPath>) -> Seen {
    let (kind, fov, height) = match camera.projection {
        Projection::Perspective { fov } => ("perspective", Some(fov.to_degrees()), None),
        Projection::Orthographic { height } => ("orthographic", None, Some(height)),
        Projection::Panorama => ("panorama", None, None),
    };
    Seen {
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
    let mut known = HashSet::new();
    let (mut mesh_triangles, mut placed_mesh_triangles, mut others) = (0, 0, 0);
    for shape in &scene.shapes {
        match &shape.geometry {
            Geometry::Mesh { mesh, .. } => {
                let count = mesh.triangles.len() as u64;
                placed_mesh_triangles += count;
                if known.insert(Arc::as_ptr(mesh)) {
                    mesh_triangles += count;
                }
            }
            Geometry::Triangles(all) => others += all.len() as u64,
            _ => {}
        }
    }
    Shapes {
        kinds: Kinds::of(scene.shapes.iter().map(|shape| form(&shape.geometry))),
        meshes: known.len() as u64,
        mesh_triangles,
        placed_mesh_triangles,
        triangles: placed_mesh_triangles + others,
        primitives: packed.primitives.len() as u64,
    }
}

fn form(geometry: &Geometry) -> &'static str {
    match geometry {
        Geometry::Rectangle(_) => "rectangle",
        Geometry::Disk(_) => "disk",
        Geometry::Ellipsoid { axes, .. } if is_sphere(axes) => "sphere",
        Geometry::Ellipsoid { .. } => "ellipsoid",
        Geometry::Triangles(all) if all.len() == 1 => "triangle",
        Geometry::Triangles(_) => "tetrahedron",
        Geometry::Mesh { .. } => "mesh",
        Geometry::Plane { .. } => "plane",
    }
}

/// Whether half axes are those that a sphere has, along x, y and z.
fn is_sphere(axes: &[DVec3; 3]) -> bool {
    *axes == [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * axes[0].x)
}

fn reflection(reflection: &Reflection) -> &'static str {
    match reflection {
        Reflection::Phong { .. } => "phong",
        Reflection::Mirror { .. } => "mirror",
        Reflection::Glass { .. } => "glass",
        Reflection::Diffuse { .. } => "diffuse",
        Reflection::Conductor { .. } => "conductor",
        Reflection::Dielectric { .. } => "dielectric",
        Reflection::Principled(_) => "principled",
        _ => "other",
    }
}

fn textured(kind: &TextureKind) -> Textured {
    let plain = |kind| Textured {
        kind,
        size: None,
        texels: None,
    };
    match kind {
        TextureKind::Constant(_) => plain("constant"),
        TextureKind::Checker { .. } => plain("checker"),
        TextureKind::Lines { .. } => plain("grid"),
        TextureKind::Image { image, .. } => Textured {
            size: Some([image.width, image.height]),
            texels: Some(match image.texels {
                Texels::Bytes(..) => "8 bits",
                Texels::Floats(_) => "floats",
            }),
            ..plain("image")
        },
    }
}

fn lights(scene: &Scene, packed: &Packed) -> Lights {
    let kind = |light: &Light| match light {
        Light::Rectangle { .. } => "rectangle",
        Light::Point { .. } => "point",
        Light::Directional { .. } => "directional",
        Light::Spot { .. } => "spot",
        _ => "other",
    };
    let environment = scene.environment.as_ref().map(|environment| match &environment.image {
        Some(image) => format!("image, {} x {} texels", image.image.width, image.image.height),
        None => "color".to_owned(),
    });
    // Where they are many all but what is infinitely far away is one emitter, a tree.
    let in_tree = packed
        .light_leaves
        .iter()
        .filter(|leaf| **leaf != wgray::pack::NOTHING)
        .count();
    Lights {
        kinds: Kinds::of(scene.lights.iter().map(kind)),
        emitters: packed.emitters.len().saturating_sub(usize::from(in_tree > 0)) as u64 + in_tree as u64,
        environment,
    }
}

#[cfg(feature = "gpu")]
fn scene_on_device(foreseen: &Foreseen) -> Option<u64> {
    let (_, foreseen) = foreseen.adapter.as_ref()?;
    Some(foreseen.scene_bytes)
}

#[cfg(not(feature = "gpu"))]
fn scene_on_device(_: &Foreseen) -> Option<u64> {
    None
}

fn kernel(packed: &Packed, foreseen: &Foreseen) -> Kernel {
    let features = features(packed);
    let those = |wanted: bool| {
        let all = features.iter().filter(move |(_, has)| *has == wanted);
        all.map(|(name, _)| *name).collect()
    };
    let plain = Kernel {
        compiled: false,
        entry: None,
        baked: None,
        lines: None,
        uses: those(true),
        leaves_out: those(false),
        constants: packed.specialization.constants().into_iter().collect(),
    };
    with_adapter(plain, foreseen)
}

#[cfg(feature = "gpu")]
fn with_adapter(plain: Kernel, foreseen: &Foreseen) -> Kernel {
    match &foreseen.adapter {
        None => plain,
        Some((_, foreseen)) => Kernel {
            compiled: true,
            entry: Some(foreseen.entry),
            baked: Some(foreseen.baked),
            lines: Some(foreseen.lines),
            ..plain
        },
    }
}

#[cfg(not(feature = "gpu"))]
fn with_adapter(plain: Kernel, _: &Foreseen) -> Kernel {
    plain
}

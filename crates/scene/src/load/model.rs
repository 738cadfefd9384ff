//! Mesh files as scenes: a mesh is described as one shape in a neutral studio, with a camera that frames the mesh.

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::gltf_choice::GltfChoice;
use super::overrides::Overrides;
use crate::error::SceneError;
use crate::framing::check_extent;
use crate::mesh::{Mesh, MeshError, MeshFormat};
use crate::problem::Problem;
use crate::validate::to_z_up;
use crate::{
    Assets, CameraDescription, Description, EnvironmentDescription, EnvironmentName, Framing, ImageDescription,
    Integrator, MeshDescription, RenderDescription, SamplesDescription, ShapeDescription, Up, ViewTransform, framed,
    is_gltf,
};

/// Default length of the longer side of the image in pixels.
pub(super) const SIDE: u32 = 720;
/// Default number of samples per pixel; the image is denoised.
const SAMPLES: u32 = 32;
/// Largest number of pixels of an image that is denoised by default, because the denoiser needs the whole film in
/// memory.
const MAX_DENOISED_PIXELS: u64 = 1 << 24;
/// Radiance of the background: middle gray.
const BACKGROUND: DVec3 = DVec3::splat(0.18);

/// Maximum number of vertices of a mesh whose vertices the camera frames. For larger meshes, the camera frames the
/// bounding box.
const MAX_POINTS: usize = 1 << 20;

/// Extensions of unsupported file types, with advice for the user.
const UNSUPPORTED: [(&[&str], &str); 4] = [
    (
        &[
            "3ds", "3mf", "abc", "blend", "c4d", "dae", "fbx", "iges", "igs", "lwo", "ma", "max", "mb", "off", "step",
            "stp", "usd", "usda", "usdc", "usdz", "wrl", "x3d",
        ],
        "not supported; export glTF (.glb), OBJ, PLY or STL",
    ),
    (
        &[
            "avif", "bmp", "exr", "gif", "hdr", "jpeg", "jpg", "ktx2", "png", "tga", "tif", "tiff", "webp",
        ],
        "an image, not a scene; use it as a texture in a scene, or with --environment",
    ),
    (&["mtl"], "a material library; render the .obj file that names it"),
    (&["bin"], "a buffer of a glTF file; render the .gltf file that names it"),
];

/// Returns true if the file has the extension of a mesh file: `.obj`, `.ply` or `.stl`.
pub fn is_mesh(name: &Path) -> bool {
    MeshFormat::of(name).is_some()
}

/// Returns true if the file has the extension of a model: a glTF or mesh file, which needs no scene file.
pub fn is_model(name: &Path) -> bool {
    is_gltf(name) || is_mesh(name)
}

fn has_extension(name: &Path, extension: &str) -> bool {
    name.extension()
        .is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

/// Returns the usual up axis of a mesh file, because the formats do not define one: +y for OBJ and PLY, as in viewers,
/// and +z for STL, as in 3D printing.
fn up_axis(format: MeshFormat) -> Up {
    match format {
        MeshFormat::Obj | MeshFormat::Ply => Up::Y,
        MeshFormat::Stl => Up::Z,
    }
}

/// Rejects files whose extension belongs to a format that cannot be a scene.
pub(super) fn check_format(path: &Path) -> Result<(), SceneError> {
    let has_any = |extensions: &[&str]| extensions.iter().any(|extension| has_extension(path, extension));
    let Some((_, advice)) = UNSUPPORTED.into_iter().find(|(extensions, _)| has_any(extensions)) else {
        return Ok(());
    };
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    Err(SceneError::Unsupported {
        path: path.to_owned(),
        message: format!(".{extension} is {advice}"),
    })
}

/// Describes a mesh file as a scene. Also returns the mesh, which must be kept alive until the scene refers to it.
pub(super) fn describe(
    path: &Path,
    assets: &Assets,
    overrides: &Overrides,
) -> Result<(Description, Arc<Mesh>), SceneError> {
    let gltf_only = GltfChoice {
        view: None,
        ..overrides.gltf.clone()
    };
    if let Some(option) = gltf_only.first_option() {
        let rule = format!("only applies to glTF files, and {} is a mesh", path.display());
        return Err(SceneError::Override(Problem::of(option, rule)));
    }
    let canonical = assets
        .file_system
        .canonical_file(path)
        .map_err(|error| SceneError::Read {
            path: path.to_owned(),
            error,
        })?;
    let mesh = crate::mesh_file::load(&assets.file_system, &canonical, None)
        .map_err(|error| SceneError::Mesh(error.at(path)))?;
    if let (true, Some(defect)) = (overrides.strict, mesh.defects.first()) {
        return Err(SceneError::Mesh(defect.clone().of(path)));
    }
    let presentation = &overrides.presentation;
    let mut shape = MeshDescription {
        up: MeshFormat::of(path).map(up_axis).unwrap_or_default(),
        material: None,
        ..MeshDescription::new("", path.file_name().unwrap_or_default().to_string_lossy())
    };
    let z_up = to_z_up(shape.up);
    let up_rotation = (presentation.up).and_then(|up| up.rotation(|axis| z_up.transform_vector3(axis)));
    let mut to_world = z_up;
    if let Some((rotation, matrix)) = up_rotation {
        shape.rotate = Some(rotation);
        to_world = DAffine3::from_mat3(matrix) * z_up;
    }
    let mut points = points(&mesh);
    points
        .iter_mut()
        .for_each(|point| *point = to_world.transform_point3(*point));
    let size = overrides.size.unwrap_or((SIDE, SIDE));
    let aspect = f64::from(size.0.max(1)) / f64::from(size.1.max(1));
    let framing = Framing {
        turns: overrides.turntable.is_some(),
        ..(presentation.framing(overrides.gltf.view, aspect)).map_err(SceneError::Override)?
    };
    check_extent(points.iter().copied()).map_err(|rule| {
        SceneError::Mesh(MeshError::File {
            path: path.to_owned(),
            message: rule,
        })
    })?;
    let camera = framed(points.iter().copied(), framing);
    Ok((
        scene(overrides, size, camera, shape, &points).with_environment(studio(overrides)?),
        mesh,
    ))
}

/// Describes a model as a scene without lights.
pub(super) fn scene(
    overrides: &Overrides,
    (width, height): (u32, u32),
    camera: impl Into<CameraDescription>,
    shape: impl Into<ShapeDescription>,
    points: &[DVec3],
) -> Description {
    let mut description = Description::new(width, height, camera)
        .with_render(RenderDescription {
            integrator: Some(Integrator::Path),
            pixel_samples: SamplesDescription::new(SAMPLES),
            denoise: (u64::from(width) * u64::from(height) <= MAX_DENOISED_PIXELS).then_some(true),
            ..RenderDescription::default()
        })
        .with_shape(shape);
    overrides.presentation.add_ground(&mut description, points);
    description.image = ImageDescription {
        view_transform: ViewTransform::KhronosPbrNeutral,
        ..description.image
    };
    description
}

/// Returns the environment for models that have no lights. The camera sees gray, unless the overrides set an
/// environment.
pub(super) fn studio(overrides: &Overrides) -> Result<EnvironmentDescription, SceneError> {
    if overrides
        .integrator
        .is_some_and(|integrator| !integrator.needs_emitters())
    {
        let rule = "phong does not support environment light, and this model has no other light; use path";
        return Err(SceneError::Override(Problem::of("integrator", rule)));
    }
    Ok(EnvironmentDescription {
        background: overrides.environment.is_none().then_some(BACKGROUND),
        ..EnvironmentDescription::named(EnvironmentName::Studio)
    })
}

/// Returns the vertices in file coordinates, or the corners of their bounding box if there are more than [`MAX_POINTS`]
/// vertices.
fn points(mesh: &Arc<Mesh>) -> Vec<DVec3> {
    match mesh.positions.len() <= MAX_POINTS {
        true => (mesh.positions.iter())
            .map(|point| point.as_dvec3() + mesh.center)
            .collect(),
        false => mesh.corners().collect(),
    }
}

/// Converts a problem of the scene into an error of its mesh file.
pub(super) fn error_of(path: &Path, problem: Problem) -> SceneError {
    SceneError::Mesh(MeshError::File {
        path: path.to_owned(),
        message: match problem.key.to_string() == "shapes[0].file" {
            true => problem.message,
            false => problem.to_string(),
        },
    })
}

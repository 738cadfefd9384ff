//! Scene files, mesh files and glTF files, loaded as validated scenes.
//!
//! Text is parsed into a [`Description`], field by field. [`Description::validate`] returns a [`Scene`] with resolved
//! names and values in range, so that code that uses a scene need not validate the values again.

mod assets;
mod builder;
mod camera_at;
mod camera_path;
mod content;
mod course;
mod decode;
mod define;
mod defines;
mod description;
pub mod downsample;
mod environment_override;
mod error;
mod expand;
mod file_system;
pub mod framing;
mod geometry;
pub mod gltf;
mod gltf_shape;
mod image_file;
mod key_path;
pub mod limits;
mod load;
mod material;
pub mod mesh;
mod mesh_file;
mod metals;
mod note;
mod parse;
mod presentation;
mod problem;
mod read;
mod scene;
mod schema;
mod sky;
mod spline;
mod studio;
mod suggest;
pub mod texture;
mod tree;
mod turntable;
mod validate;
mod visibility;
mod write;

pub use assets::Assets;
pub use builder::{ImageId, MaterialId, MeshId, SceneBuilder, TextureId};
pub use camera_path::CameraPath;
pub use define::Define;
pub use description::*;
pub use environment_override::Background;
pub use error::SceneError;
pub use file_system::{AssetSource, FolderFiles, MemoryFiles, NoFiles};
pub use framing::{Framing, Orbit, View, framed};
pub use geometry::{Bounds, Geometry, Parallelogram, Shape};
pub use gltf::ModelContents;
pub use key_path::KeyPath;
pub use key_path::{Segment, cut};
pub use load::{GltfChoice, LoadOptions, Overrides, SceneFormat, is_gltf, is_mesh, is_model};
pub use load::{PendingScene, folder_of, read_bytes, read_text};
pub use material::{Facets, Material, Principled, Reflection};
pub use metals::MetalIndex;
pub use note::Note;
pub use parse::{Pieces, Places, is_json_scene};
pub use presentation::{Presentation, UpAxis};
pub use problem::{ErrorPlace, Problem, UnreadableFile};
pub use scene::*;
pub use schema::{
    fields::{Field, Kind as FieldKind, Names, fields},
    schema,
};
pub use texture::{
    Channel, Color, Encoding, Image, NormalMap, Texels, Texture, TextureFilter, TextureKind, Value, Wrap,
};
pub use wgray_image::{ViewSettings, ViewTransform};

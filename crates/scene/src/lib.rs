//! Scene files, mesh files and glTF files as validated scenes.
//!
//! Text is parsed into a [`Description`], the contents of the file field for field; [`Description::validate`] makes a [`Scene`] of it, with every
//! name resolved and every value in range. Nothing behind a `Scene` checks again.

mod around;
mod bounds;
mod camera_path;
mod course;
mod decode;
mod define;
mod description;
mod error;
pub mod framing;
pub mod gltf;
mod gltf_shape;
mod gray_exr;
pub mod halves;
pub mod image_file;
pub mod ktx2;
pub mod limits;
mod load;
pub mod mesh;
mod mesh_file;
mod metals;
mod model;
mod note;
mod parse;
mod presentation;
mod scene;
mod schema;
mod sky;
mod spline;
mod studio;
mod suggest;
pub mod texture;
mod turntable;
mod validate;
mod visibility;
mod write;

pub use around::Background;
pub use bounds::Bounds;
pub use camera_path::CameraPath;
pub use course::is_course;
pub use define::Define;
pub use description::*;
pub use error::{ErrorPlace, KeyPath, Problem, SceneError};
pub use error::{Segment, cut};
pub use framing::{Framing, Orbit, View, framed};
pub use gltf::ModelContents;
pub use image_file::Assets;
pub use load::{Draft, folder_of, read_bytes, read_text};
pub use load::{GltfChoice, Overrides, is_gltf};
pub use metals::MetalIndex;
pub use model::{is_mesh, is_model};
pub use note::Note;
pub use parse::{Pieces, Places};
pub use presentation::{Presentation, UpAxis};
pub use scene::*;
pub use schema::fields::Kind as FieldKind;
pub use schema::fields::{Field, Names, fields};
pub use schema::schema;
pub use texture::{
    Channel, Color, Encoding, Image, NormalMap, Texels, Texture, TextureFilter, TextureKind, Value, Wrap,
};
pub use wgray_image::{ViewSettings, ViewTransform};

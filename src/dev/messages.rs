//! What reaches the thread that renders, and what it tells those who look.

use std::num::NonZeroU32;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::build::Built;
use super::camera::{Move, Viewpoint};
use super::diagnostic::Diagnostic;
use super::look::Choice;
use super::picture::{LayerName, View};
use super::reference::{Apart, Reference};
use super::sliders::SliderState;
use super::source::Snapshot;
use crate::gpu::marks::Value;
use crate::scene::ViewTransform;

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// Something is wrong.
    Problem(Diagnostic),
    /// Nothing is wrong any more.
    Mended,
    /// The first picture of a saved file was shown, so many seconds after the save was noticed; if a kernel was compiled,
    /// that took so many.
    Reloaded {
        /// From the save to the picture.
        seconds: f64,
        /// To compile.
        compiled: Option<f64>,
    },
    /// The picture has all its samples.
    Finished {
        /// Since the first picture.
        seconds: f64,
    },
    /// Something to know of the scene.
    Note(String),
    /// The picture is larger than what can be shown: the size asked for, and the size of what is shown.
    Smaller([u32; 2], [u32; 2]),
    /// The values of sliders were written into the shaders, or that was taken back, as is said here; or why not.
    Written(&'static str, Result<(), String>),
    /// Something was written into the scene file, the camera or a value; or why it could not be.
    Wrote(String, Result<(), String>),
    /// What was written last was taken back, or what was taken back last was made again; or why not.
    Turned(String, Result<(), String>),
}

/// A value for a key of the scene file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Set {
    /// The way to it: `materials.red.color`.
    pub path: String,
    /// The value; null takes the key out of the file.
    pub value: serde_json::Value,
    /// Changes of the same key with the same number are one step of undo.
    #[serde(default)]
    pub gesture: Option<u64>,
}

/// What someone who looks asks for.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    /// A hand takes hold of the camera: the moves that follow are one step of its history.
    Grab,
    /// To move the camera.
    Move(Move),
    /// To put the camera elsewhere.
    Viewpoint(Viewpoint),
    /// To see the whole of the object at a pixel of the whole picture, or of all that there is.
    Frame(Option<[u32; 2]>),
    /// To take the last step of the camera back.
    Back,
    /// To make the step again that was taken back.
    Forth,
    /// The scene file's camera.
    ResetCamera,
    /// To write the camera into the scene file.
    SaveCamera,
    /// To write a value into the scene file.
    Set(Set),
    /// To take back what was written into the scene file last.
    UndoWrite,
    /// To write again what was taken back last.
    RedoWrite,
    /// Another view.
    View(View),
    /// The factor of the difference of [`View::Compare`].
    Gain(f32),
    /// Whether pixels that are no light are marked.
    Marks(bool),
    /// Another value of a slider of the shaders.
    Slide {
        /// The file of its constant.
        file: String,
        /// The constant's name.
        name: String,
        /// The value.
        value: Value,
    },
    /// The value of the file for a slider, given as file and name.
    ResetSlider(String, String),
    /// The values of the files for all.
    ResetSliders,
    /// To write the sliders' values into the shaders.
    WriteSliders,
    /// To take that back.
    UndoSliders,
    /// How light is shown.
    Look(Choice),
    /// Whether nothing but first pictures is rendered.
    Pause(bool),
    /// To render the picture anew.
    Restart,
    /// The most samples of a pixel; all of the scene's if absent.
    Samples(Option<NonZeroU32>),
    /// Pixels of the picture along each side of one that is shown.
    Preview(Preview),
    /// To keep the picture as the reference.
    Keep,
}

/// How coarse the picture is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Preview(u32);

impl Preview {
    /// Pixels of the picture along each side of one that is shown, one at least.
    pub fn scale(self) -> u32 {
        self.0.max(1)
    }
}

impl From<Preview> for u32 {
    fn from(preview: Preview) -> u32 {
        preview.scale()
    }
}

impl TryFrom<u32> for Preview {
    type Error = String;

    fn try_from(scale: u32) -> Result<Preview, String> {
        match (1..=64).contains(&scale) {
            true => Ok(Preview(scale)),
            false => Err(format!("preview: {scale} must be from 1 to 64")),
        }
    }
}

/// What is known beside the picture; it goes to the page as JSON.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct State {
    /// The scene file.
    pub scene: String,
    /// The shaders' folder; the program's own if absent.
    pub shaders: Option<String>,
    /// The device and its driver.
    pub device: String,
    /// What is shown.
    pub view: View,
    /// The factor of the difference of [`View::Compare`].
    pub gain: f32,
    /// Whether pixels that are no light are marked.
    pub marks: bool,
    /// The camera, as the section of a scene file.
    pub camera: String,
    /// The same for whoever keeps it.
    pub viewpoint: Option<Viewpoint>,
    /// Whether it is not that of the file.
    pub camera_moved: bool,
    /// Counts the scenes that were right.
    pub scenes: u64,
    /// What was written into the scene file last, and can be taken back: `camera`, `materials.red.color`.
    pub undo: Option<String>,
    /// Why nothing can be undone, if another program's change of the file dropped the history.
    pub undo_blocked: Option<String>,
    /// Why the scene file cannot be edited here, if that is so: it is glTF or JSON.
    pub read_only: Option<String>,
    /// What was taken back last, and can be written again.
    pub redo: Option<String>,
    /// Whether the camera's last step can be taken back, and one be made again.
    pub steps: [bool; 2],
    /// How light is shown, as it was chosen.
    pub look: Choice,
    /// How the scene has it: exposure in stops, and the transform.
    pub scene_look: (f64, ViewTransform),
    /// Whether nothing but first pictures is rendered.
    pub paused: bool,
    /// The most samples of a pixel, and those of the scene.
    pub samples: (Option<NonZeroU32>, u32),
    /// How coarse the picture is shown.
    pub preview: Preview,
    /// What there is to compare with, beside the CPU: whether a picture before the last change, and the reference's name.
    pub comparable: (bool, Option<String>),
    /// Why there is nothing to compare with, where that was asked for.
    pub no_comparison: Option<String>,
    /// How far the two pictures of a comparison are apart.
    pub apart: Option<Apart>,
    /// What is wrong now.
    pub problems: Vec<Diagnostic>,
    /// The sliders of the shaders.
    pub sliders: Vec<SliderState>,
    /// Whether the last writing of their values can be taken back.
    pub sliders_undo: bool,
    /// The layers of the shaders that can be shown.
    pub layers: Vec<LayerName>,
    /// The views that the scene does not have, and why.
    pub missing_views: Vec<(View, &'static str)>,
    /// The form of links that open an editor, with `{file}`, `{line}` and `{column}`; none if there are no such links.
    pub editor: Option<String>,
    /// Whether a kernel is being compiled.
    pub compiling: bool,
    /// Seconds that the last one took.
    pub compile_seconds: Option<f64>,
    /// How many commands have been followed.
    pub heard: u64,
    /// The number of the last frame.
    pub frame: u64,
    /// Whether there will be more frames without anything happening.
    pub busy: bool,
    /// The last thing that was said, and how many were before it.
    pub notice: Option<Notice>,
}

/// An answer to a command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Notice {
    /// Counts them.
    pub number: u64,
    /// Which command it answers, counted as [`State::heard`] does.
    pub command: u64,
    /// What is said; nothing where what was said before holds no more.
    pub text: String,
    /// Whether it is bad.
    pub bad: bool,
}

/// What reaches the thread that renders.
pub enum Event {
    /// The files have changed; noticed at that time, when so many writes of this session were known.
    Files(Box<Snapshot>, Instant, u64),
    /// A kernel has been compiled.
    Built(Box<Built>),
    /// Someone asks for something.
    Command(Command),
    /// Someone gave a picture to compare with.
    Reference(Reference),
    /// Two pictures were measured.
    Measured(Apart),
    /// Someone came who looks.
    Viewers,
    /// A driver loses its device.
    #[cfg(test)]
    Lose,
    /// The session ends.
    Stop,
}

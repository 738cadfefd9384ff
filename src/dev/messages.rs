//! What reaches the thread that renders, and what it tells those who look.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::build::Built;
use super::camera::Move;
use super::diagnostic::Diagnostic;
use super::picture::{LayerName, View};
use super::sliders::SliderState;
use super::source::Snapshot;
use crate::gpu::marks::Value;

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
    /// The camera was written into the scene file, or could not be.
    Saved(Result<(), String>),
    /// The last save was taken back, or could not be.
    Unsaved(Result<(), String>),
    /// The values of sliders were written into the shaders, or that was taken back, as is said here; or why not.
    Written(&'static str, Result<(), String>),
}

/// What someone who looks asks for.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    /// To move the camera.
    Move(Move),
    /// The scene file's camera.
    ResetCamera,
    /// To write the camera into the scene file.
    SaveCamera,
    /// To take the last save back.
    UndoSave,
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
    /// Whether it is not that of the file.
    pub camera_moved: bool,
    /// Whether a save of it can be taken back.
    pub can_undo: bool,
    /// What is wrong now.
    pub problems: Vec<Diagnostic>,
    /// The sliders of the shaders.
    pub sliders: Vec<SliderState>,
    /// Whether the last writing of their values can be taken back.
    pub sliders_undo: bool,
    /// The layers of the shaders that can be shown.
    pub layers: Vec<LayerName>,
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
    /// What is said.
    pub text: String,
    /// Whether it is bad.
    pub bad: bool,
}

/// What reaches the thread that renders.
pub enum Event {
    /// The files have changed; noticed at that time.
    Files(Box<Snapshot>, Instant),
    /// A kernel has been compiled.
    Built(Box<Built>),
    /// Someone asks for something.
    Command(Command),
    /// Someone came who looks.
    Viewers,
    /// A driver loses its device.
    #[cfg(test)]
    Lose,
    /// The session ends.
    Stop,
}

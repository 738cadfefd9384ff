//! The events that reach the painter, and the messages for viewers and the terminal.

use std::num::NonZeroU32;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::build::BuildResult;
use super::camera::{Move, Viewpoint};
use super::diagnostic::Diagnostic;
use super::display_settings::DisplayOverrides;
use super::picture::View;
use super::reference::{ErrorMeasures, Reference};
use super::sliders::SliderState;
use super::source::Snapshot;
use wgray_render::gpu::sliders::Value;
use wgray_scene::ViewTransform;

/// A report for the terminal.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// An error.
    Problem(Diagnostic),
    /// All errors are fixed.
    AllFixed,
    /// The first image after a save was shown.
    Reloaded {
        /// Seconds from the change to the image, including compilation.
        seconds: f64,
        /// Seconds spent on compiling.
        compiled: Option<f64>,
    },
    /// The image has all its samples.
    Finished {
        /// Seconds since the first image.
        seconds: f64,
    },
    /// A note about the scene.
    Note(String),
    /// The image is too large to display at full size: the full size, and the displayed size.
    ReducedImage([u32; 2], [u32; 2]),
    /// The camera or a value was saved to the scene file, or could not be saved.
    Saved(String, Result<(), String>),
    /// A change of the scene file was undone or redone, or the undo or redo failed.
    UndoRedo(String, Result<(), String>),
}

/// A value for a key of the scene file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Set {
    /// The path of the key: `materials.red.color`.
    pub path: String,
    /// The value; null removes the key from the file.
    pub value: serde_json::Value,
    /// Changes of the same key with the same gesture number form one undo step.
    #[serde(default)]
    pub gesture: Option<u64>,
}

/// A command of a viewer.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    /// Starts a camera drag: the following moves are one step of the viewpoint history.
    Grab,
    /// Moves the camera.
    Move(Move),
    /// Sets the viewpoint.
    Viewpoint(Viewpoint),
    /// Frames the object at a pixel of the full-size image, or the whole scene.
    Frame(Option<[u32; 2]>),
    /// Returns to the previous viewpoint.
    Back,
    /// Returns to the next viewpoint.
    Forth,
    /// Resets the camera to the camera of the scene file.
    ResetCamera,
    /// Saves the camera to the scene file.
    SaveCamera,
    /// Sets a value in the scene file.
    Set(Set),
    /// Undoes the last change of the scene file.
    UndoWrite,
    /// Redoes the last undone change of the scene file.
    RedoWrite,
    /// Selects a view.
    View(View),
    /// Sets the gain of the difference in [`View::Compare`].
    Gain(f32),
    /// Shows or hides the marks of invalid pixels.
    Marks(bool),
    /// Moves a slider of the shaders.
    Slide {
        /// The file of the override.
        file: String,
        /// The name of the override.
        name: String,
        /// The value.
        value: Value,
    },
    /// Resets a slider, given by file and name, to the value of its file.
    ResetSlider(String, String),
    /// Resets all sliders.
    ResetSliders,
    /// Overrides exposure, transform and false colors.
    #[serde(rename = "look")]
    DisplaySettings(DisplayOverrides),
    /// Starts or ends the pause: while paused, only the first image of a change is rendered.
    Pause(bool),
    /// Renders the image again.
    Restart,
    /// Sets the maximum number of samples per pixel; if absent, the scene's number is used.
    Samples(Option<NonZeroU32>),
    /// Sets the scale of the preview.
    Preview(Preview),
    /// Sets the image as the reference.
    Keep,
}

/// The scale of the preview: number of image pixels along each side of a displayed pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Preview(u32);

impl Preview {
    /// Returns the scale, at least 1.
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

/// Everything that the page shows except the images, sent as JSON.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct State {
    /// The scene file.
    pub scene: String,
    /// The folder of the shaders; absent for the built-in ones.
    pub shaders: Option<String>,
    /// The device and its driver.
    pub device: String,
    /// The selected view.
    pub view: View,
    /// The factor by which [`View::Compare`] multiplies differences.
    pub gain: f32,
    /// True if invalid pixels are marked.
    pub marks: bool,
    /// The camera, as a section of a scene file.
    pub camera: String,
    /// The viewpoint of the camera, for bookmarks.
    pub viewpoint: Option<Viewpoint>,
    /// True if the camera differs from the camera in the file.
    pub camera_moved: bool,
    /// Number of valid scenes read so far.
    pub scene_revision: u64,
    /// The last change of the scene file, which can be undone: `camera`, `materials.red.color`.
    pub undo: Option<String>,
    /// The reason if nothing can be undone because another program changed the file.
    pub undo_blocked: Option<String>,
    /// The reason if the page cannot edit the scene file, for example because it is glTF or JSON.
    pub read_only: Option<String>,
    /// The last change that was undone, which can be redone.
    pub redo: Option<String>,
    /// Availability of a previous and of a next viewpoint.
    pub steps: [bool; 2],
    /// The display settings that the viewer overrides.
    pub look: DisplayOverrides,
    /// The exposure in stops and the transform of the scene.
    pub scene_look: (f64, ViewTransform),
    /// True if rendering pauses after the first image of a change.
    pub paused: bool,
    /// The viewers' maximum number of samples per pixel, if set, and the scene's number.
    pub samples: (Option<NonZeroU32>, u32),
    /// The scale of the preview.
    pub preview: Preview,
    /// The images that can be compared with, besides the CPU's image: whether an image from before the last change
    /// exists, and the name of the reference.
    pub comparable: (bool, Option<String>),
    /// The reason if the selected comparison cannot be shown.
    pub no_comparison: Option<String>,
    /// The error measures of the two compared images; absent without a comparison.
    pub apart: Option<ErrorMeasures>,
    /// The current errors.
    pub problems: Vec<Diagnostic>,
    /// The sliders of the shaders.
    pub sliders: Vec<SliderState>,
    /// The views that the scene does not provide, and the reasons.
    pub missing_views: Vec<(View, &'static str)>,
    /// The template of links to an editor, with `{file}`, `{line}` and `{column}`; absent if there are no links.
    pub editor: Option<String>,
    /// True during the compilation of a kernel.
    pub compiling: bool,
    /// True while the session reads changed files of the scene.
    pub reading: bool,
    /// Seconds spent on the last compilation.
    pub compile_seconds: Option<f64>,
    /// Number of executed commands.
    pub executed: u64,
    /// The number of the last frame.
    pub frame: u64,
    /// True if more frames will follow without a new event.
    pub busy: bool,
    /// The last notice.
    pub notice: Option<Notice>,
}

/// A notice for the viewers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Notice {
    /// The number of the notice.
    pub number: u64,
    /// The number of the command that the notice answers, as counted by [`State::executed`].
    pub command: u64,
    /// The text; empty if the previous notice no longer applies.
    pub text: String,
    /// True if the notice reports an error.
    pub bad: bool,
}

pub enum Event {
    /// The files of the scene and the shaders were read, at the start or after a change. Contains the new state, the
    /// time when the start or the change was noticed, and the number of writes by this session up to that time.
    Files(Box<Snapshot>, Instant, u64),
    /// Changed files of the scene are being read, or turned out to be unchanged.
    Reading(bool),
    BuildResult(Box<BuildResult>),
    Command(Command),
    /// A viewer uploaded an image to compare with.
    Reference(Reference),
    /// A comparison was measured.
    Measured(ErrorMeasures),
    /// A viewer was added.
    Viewers,
    /// Destroys the device, as if the driver had lost the device.
    #[cfg(test)]
    Lose,
    Stop,
}

//! Comparison of the image with a second image, and the difference between the two.

use std::sync::Arc;

use super::Painter;
use crate::messages::Event;
use crate::picture::{Against, Content, Frame, View};
use crate::reference::{Apart, Reference};
use wgray_image::Pixels;

#[derive(Default)]
pub struct Comparison {
    /// The last complete image from before the last saved change.
    pub before: Option<Reference>,
    /// The reference: an image that was kept or uploaded.
    pub reference: Option<Reference>,
    apart: Option<Apart>,
    measuring: bool,
}

impl Comparison {
    /// Returns whether an image from before the last change exists, and the name of the reference.
    pub fn comparable(&self) -> (bool, Option<String>) {
        let name = self.reference.as_ref().map(|reference| reference.name.clone());
        (self.before.is_some(), name)
    }

    fn with(&self, against: Against) -> Option<&Reference> {
        match against {
            Against::Cpu => None,
            Against::Before => self.before.as_ref(),
            Against::Reference => self.reference.as_ref(),
        }
    }
}

impl Painter {
    /// Returns the displayed image if it is complete, in color and up to date.
    fn whole_picture(&self) -> Option<Pixels> {
        let frame = self.frame_sender.borrow().clone()?;
        let header = &frame.header;
        let is_whole = header.sent == header.finest && header.samples > 0 && header.revision == self.revision;
        match &frame.content {
            Content::Color(pixels) | Content::Compare(pixels, _) if is_whole => Some(pixels.clone()),
            _ => None,
        }
    }

    pub(super) fn keep_before(&mut self) {
        if let Some(pixels) = self.whole_picture() {
            self.comparison.before = Some(Reference {
                name: "before the change".to_string(),
                pixels: Arc::new(pixels),
            });
        }
    }

    pub(super) fn keep(&mut self) {
        match self.whole_picture() {
            Some(pixels) => {
                self.take_reference(Reference {
                    name: "kept image".to_string(),
                    pixels: Arc::new(pixels),
                });
                self.notice(&Ok(()), "Image set as the reference".to_string());
            }
            None => self.notice(&Err("No complete color image yet".to_string()), String::new()),
        }
    }

    pub(super) fn take_reference(&mut self, reference: Reference) {
        self.comparison.reference = Some(reference);
        self.comparison.apart = None;
        if self.view == View::Compare(Against::Reference) && self.running.is_some() {
            self.show();
        }
    }

    /// Returns the content together with the image to compare with, and the names of both images.
    pub(super) fn beside(&self, content: Content, whole: [u32; 2]) -> (Content, Option<[String; 2]>) {
        let View::Compare(against) = self.view else {
            return (content, None);
        };
        let picture = "picture".to_string();
        match (content, self.comparison.with(against)) {
            (Content::Color(pixels), Some(other)) => match other.at(whole, [pixels.width, pixels.height]) {
                Some(second) => (Content::Compare(pixels, second), Some([picture, other.name.clone()])),
                None => (Content::Color(pixels), None),
            },
            (content @ Content::Compare(..), _) => (content, Some(["GPU".to_string(), "CPU".to_string()])),
            (content, _) => (content, None),
        }
    }

    /// Measures a finished comparison on a separate thread, because this takes longer than a frame.
    pub(super) fn measure(&mut self, frame: &Arc<Frame>) {
        if frame.header.done && !self.comparison.measuring && matches!(frame.content, Content::Compare(..)) {
            self.comparison.measuring = true;
            let (frame, events) = (frame.clone(), self.events.clone());
            let work = move || {
                if let Content::Compare(first, second) = &frame.content {
                    let apart = Apart::of(frame.header.number, first, second);
                    let _ = events.send(Event::Measured(apart)); // fails only after the end of the session
                }
            };
            let started = std::thread::Builder::new().name("measure".to_string()).spawn(work);
            self.comparison.measuring = started.is_ok();
        }
    }

    pub(super) fn take_measured(&mut self, apart: Apart) {
        self.comparison.measuring = false;
        self.comparison.apart = Some(apart);
        // A different image may be shown by now.
        let newest = self.frame_sender.borrow().clone();
        if let Some(frame) = newest.filter(|frame| frame.header.number != apart.frame) {
            self.measure(&frame);
        }
    }

    pub(super) fn apart(&self) -> Option<Apart> {
        self.comparison.apart.filter(|apart| apart.frame == self.frames)
    }

    /// Returns the reason if the comparison cannot be shown.
    pub(super) fn no_comparison(&self) -> Option<String> {
        let View::Compare(against) = self.view else { return None };
        let whole = self.running.as_ref()?.canvas.finest_size();
        let missing = match against {
            Against::Cpu => return None,
            Against::Before => "No change has been saved since the camera moved",
            Against::Reference => "No reference yet. Set the image as the reference, or open a file.",
        };
        match self.comparison.with(against) {
            None => Some(missing.to_string()),
            Some(other) if other.at(whole, [1, 1]).is_none() => {
                let Pixels { width, height, .. } = *other.pixels;
                let [w, h] = whole;
                Some(format!(
                    "{} is {width} × {height}, but the image is {w} × {h}",
                    other.name
                ))
            }
            Some(_) => None,
        }
    }
}

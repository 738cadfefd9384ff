//! Comparison of the image with a second image, and the difference between the two.

use std::sync::Arc;

use super::Painter;
use crate::messages::Event;
use crate::picture::{Against, Content, Frame, View};
use crate::reference::{ErrorMeasures, Reference};
use wgray_image::Pixels;

#[derive(Default)]
pub struct Comparison {
    /// The last complete image from before the last saved change.
    pub before: Option<Reference>,
    /// An image that a viewer kept or uploaded.
    pub reference: Option<Reference>,
    errors: Option<ErrorMeasures>,
    measuring: bool,
}

impl Comparison {
    /// Returns whether an image from before the last change exists, and the name of the reference.
    pub fn comparable(&self) -> (bool, Option<String>) {
        let name = self.reference.as_ref().map(|reference| reference.name.clone());
        (self.before.is_some(), name)
    }

    fn counterpart(&self, against: Against) -> Option<&Reference> {
        match against {
            Against::Cpu => None,
            Against::Before => self.before.as_ref(),
            Against::Reference => self.reference.as_ref(),
        }
    }
}

impl Painter {
    /// Returns the displayed image if it is complete, in color and up to date.
    fn complete_image(&self) -> Option<Pixels> {
        let frame = self.frame_sender.borrow().clone()?;
        let header = &frame.header;
        let is_complete = header.sent == header.finest && header.samples > 0 && header.revision == self.revision;
        match &frame.content {
            Content::Color(pixels) | Content::Compare(pixels, _) if is_complete => Some(pixels.clone()),
            _ => None,
        }
    }

    pub(super) fn keep_previous_image(&mut self) {
        if let Some(pixels) = self.complete_image() {
            self.comparison.before = Some(Reference {
                name: "before the change".to_string(),
                pixels: Arc::new(pixels),
            });
        }
    }

    pub(super) fn keep_reference(&mut self) {
        match self.complete_image() {
            Some(pixels) => {
                self.set_reference(Reference {
                    name: "kept image".to_string(),
                    pixels: Arc::new(pixels),
                });
                self.notice(&Ok(()), "Image set as the reference".to_string());
            }
            None => self.notice(&Err("No complete color image yet".to_string()), String::new()),
        }
    }

    pub(super) fn set_reference(&mut self, reference: Reference) {
        self.comparison.reference = Some(reference);
        self.comparison.errors = None;
        if self.view == View::Compare(Against::Reference) && self.running.is_some() {
            self.show();
        }
    }

    /// Adds the second image to the content if the view is a comparison. Also returns the names of both images.
    pub(super) fn with_counterpart(&self, content: Content, full_size: [u32; 2]) -> (Content, Option<[String; 2]>) {
        let View::Compare(against) = self.view else {
            return (content, None);
        };
        match (content, self.comparison.counterpart(against)) {
            (Content::Color(pixels), Some(reference)) => {
                match reference.scaled(full_size, [pixels.width, pixels.height]) {
                    Some(second) => {
                        let names = ["picture".to_string(), reference.name.clone()];
                        (Content::Compare(pixels, second), Some(names))
                    }
                    None => (Content::Color(pixels), None),
                }
            }
            (content @ Content::Compare(..), _) => (content, Some(["GPU".to_string(), "CPU".to_string()])),
            (content, _) => (content, None),
        }
    }

    /// Measures a finished comparison on a separate thread, because the measurement takes longer than a frame.
    pub(super) fn measure(&mut self, frame: &Arc<Frame>) {
        if frame.header.done && !self.comparison.measuring && matches!(frame.content, Content::Compare(..)) {
            self.comparison.measuring = true;
            let (frame, events) = (frame.clone(), self.events.clone());
            let measure = move || {
                if let Content::Compare(first, second) = &frame.content {
                    let errors = ErrorMeasures::of(frame.header.number, first, second);
                    let _ = events.send(Event::Measured(errors)); // fails only after the end of the session
                }
            };
            let started = std::thread::Builder::new().name("measure".to_string()).spawn(measure);
            self.comparison.measuring = started.is_ok();
        }
    }

    pub(super) fn set_errors(&mut self, errors: ErrorMeasures) {
        self.comparison.measuring = false;
        self.comparison.errors = Some(errors);
        // Meanwhile, a newer frame may have replaced the measured frame.
        let newest = self.frame_sender.borrow().clone();
        if let Some(frame) = newest.filter(|frame| frame.header.number != errors.frame) {
            self.measure(&frame);
        }
    }

    /// Returns the error measures of the current frame, if the frame has been measured.
    pub(super) fn errors(&self) -> Option<ErrorMeasures> {
        self.comparison.errors.filter(|errors| errors.frame == self.frames)
    }

    /// Returns the reason if the comparison cannot be shown.
    pub(super) fn no_comparison(&self) -> Option<String> {
        let View::Compare(against) = self.view else { return None };
        let size = self.running.as_ref()?.canvas.final_size();
        let missing = match against {
            Against::Cpu => return None,
            Against::Before => "No change has been saved since the camera moved",
            Against::Reference => "No reference yet. Set the image as the reference, or open a file.",
        };
        match self.comparison.counterpart(against) {
            None => Some(missing.to_string()),
            Some(reference) if reference.size() != size => {
                let ([width, height], [image_width, image_height]) = (reference.size(), size);
                Some(format!(
                    "{} is {width} × {height}, but the image is {image_width} × {image_height}",
                    reference.name
                ))
            }
            Some(_) => None,
        }
    }
}

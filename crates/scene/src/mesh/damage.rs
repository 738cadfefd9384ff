//! Defects of mesh files that do not prevent reading. A note reports the defect and its remedy.

use super::error::{Location, MeshFault};
use crate::note::Note;

pub(super) const VERTEX: &str = "faces with this vertex were removed";
pub(super) const FACE: &str = "the face was removed";
pub(super) const UV: &str = "the texture coordinates (0, 0) are used instead";
pub(super) const NORMAL: &str = "the normal of the triangles is used instead";
pub(super) const COLOR: &str = "white is used instead";
pub(super) const LINE: &str = "the line was ignored";
pub(super) const TRUNCATED: &str = "the facets before the end are used";
pub(super) const EXTRA_VALUES: &str = "the extra values were ignored";

#[derive(Default)]
pub(super) struct Defects(Vec<Defect>);

/// Faults with the same remedy, counted together.
struct Defect {
    remedy: &'static str,
    first: MeshFault,
    count: usize,
}

impl Defects {
    /// Records a fault. `fault` is only called for the first fault with each remedy.
    #[cold]
    pub fn add(&mut self, remedy: &'static str, fault: impl FnOnce() -> MeshFault) {
        match self.0.iter_mut().find(|defect| defect.remedy == remedy) {
            Some(defect) => defect.count += 1,
            None => self.0.push(Defect {
                remedy,
                first: fault(),
                count: 1,
            }),
        }
    }

    /// Returns, for each remedy, the first fault and a note with the number of faults.
    pub fn into_parts(self) -> (Vec<MeshFault>, Vec<Note>) {
        let notes = self.0.iter().map(Defect::note).collect();
        (self.0.into_iter().map(|defect| defect.first).collect(), notes)
    }

    pub fn first(&self) -> Option<&MeshFault> {
        self.0.first().map(|defect| &defect.first)
    }
}

impl Defect {
    fn note(&self) -> Note {
        let (line, location) = match self.first.location {
            Location::File => (None, String::new()),
            Location::Line(line) => (Some(line), String::new()),
            Location::Byte(offset) => (None, format!("byte {offset}: ")),
        };
        let more = match self.count {
            1 => String::new(),
            2 => " (and 1 similar problem)".to_owned(),
            count => format!(" (and {} similar problems)", count - 1),
        };
        Note {
            line,
            ..Note::from(format!("{location}{}; {}{more}", self.first.message, self.remedy))
        }
    }
}

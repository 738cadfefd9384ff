//! Incremental parsing after a small change to a scene file, such as an edit of one shape out of 100,000.

use std::borrow::Cow;
use std::path::Path;

use toml::{Table, Value};

use super::parts::{Kind, Part, Parts, Rest, SyntaxFault};
use super::{Problems, Read, invalid, is_json_scene, read, read_camera, read_file, tagged};
use crate::defines::Defines;
use crate::error::SceneError;
use crate::key_path::{KeyPath, Segment};
use crate::problem::At;
use crate::{CameraDescription, Description};

impl Description {
    /// Parses a text after a change of the table at the first two segments of a path; `None` if the whole text must be
    /// parsed.
    pub(crate) fn parse_change(
        text: &str,
        origin: &str,
        defines: &mut Defines,
        before: &Description,
        path: &KeyPath,
    ) -> Result<Option<Change>, SceneError> {
        if is_json_scene(Path::new(origin)) {
            return Ok(None);
        }
        let to_error = |fault: SyntaxFault| fault.into_error(text, origin);
        let parts = Parts::of(text);
        if let Some(fault) = parts.too_large() {
            return Err(to_error(fault));
        }
        let part = parts.find(path).map(|(part, _)| part);
        let parsed_rest = part.is_none();
        let read = match part {
            Some(part) => read_changed_part(&parts, part, path, defines, before).map_err(to_error)?,
            None => read_changed_rest(&parts, defines, before).map_err(to_error)?,
        };
        match read {
            Some(Ok(description)) => Ok(Some(Change {
                description,
                parsed_rest,
                places: Places(parts.parts.into_owned()),
            })),
            Some(Err(problems)) => Err(invalid(text, origin, problems, defines)),
            None => Ok(None),
        }
    }

    /// Parses only the camera of a text, without overrides.
    pub fn parse_camera(text: &str, origin: &str) -> Result<CameraDescription, SceneError> {
        let parts = Parts::of(text);
        let rest = parts.read_rest().map_err(|fault| fault.into_error(text, origin))?;
        let camera = rest
            .get("camera")
            .and_then(Value::as_table)
            .cloned()
            .unwrap_or_default();
        let read = read_camera(camera).at("camera");
        read.map_err(|problem| invalid(text, origin, problem, &Defines::new(&[])))
    }
}

/// The description of a changed text, and the locations of its parts.
pub struct Change {
    pub description: Description,
    /// True if the text outside of the parts was parsed again.
    pub parsed_rest: bool,
    pub places: Places,
}

/// Locations of the parts of a text.
#[derive(Debug)]
pub struct Places(Vec<Part>);

impl Places {
    /// Finds the parts of a text.
    pub fn of(text: &str) -> Places {
        Places(Parts::of(text).parts.into_owned())
    }
}

/// Parses a changed part; `None` if the part is not a standalone table.
fn read_changed_part(
    parts: &Parts,
    part: &Part,
    path: &KeyPath,
    defines: &mut Defines,
    before: &Description,
) -> Result<Option<Result<Description, Problems>>, SyntaxFault> {
    let (Some((_, mut table)), Some(name)) = (parts.read(part)?, path.0.get(1)) else {
        return Ok(None);
    };
    let table_path = [Segment::from(part.kind.name()), name.clone()];
    if let Err(problem) = defines.apply(&table_path, &mut table, |_| false) {
        return Ok(Some(Err(problem.into())));
    }
    let mut after = before.clone();
    let replaced = match (part.kind, name) {
        (Kind::Textures, Segment::Key(name)) => replace(after.textures.get_mut(name), table, tagged),
        (Kind::Materials, Segment::Key(name)) => replace(after.materials.get_mut(name), table, tagged),
        (Kind::Meshes, Segment::Key(name)) => replace(after.meshes.get_mut(name), table, read),
        (Kind::Lights, Segment::Index(i)) => replace(after.lights.get_mut(*i), table, tagged),
        (Kind::Shapes, Segment::Index(i)) => replace(after.shapes.get_mut(*i), table, tagged),
        (Kind::Instances, Segment::Index(i)) => replace(after.instances.get_mut(*i), table, read),
        _ => None,
    };
    let result = replaced.map(|read| {
        read.map_err(|problem| problem.at(name.clone()).at(part.kind.name()))
            .map(|()| after)
    });
    Ok(result)
}

fn replace<T>(target: Option<&mut T>, table: Table, read: fn(Table) -> Read<T>) -> Option<Read<()>> {
    target.map(|target| read(table).map(|new| *target = new))
}

/// Parses the text outside of the parts; `None` if this text contains elements of sections that are split into parts.
fn read_changed_rest(
    parts: &Parts,
    defines: &mut Defines,
    before: &Description,
) -> Result<Option<Result<Description, Problems>>, SyntaxFault> {
    let mut rest = parts.read_rest()?;
    if Kind::ALL.into_iter().any(|kind| rest.contains_key(kind.name())) {
        return Ok(None);
    }
    let is_in_parts = |key: &str| Kind::ALL.into_iter().any(|kind| kind.name() == key);
    let applied = defines.apply(&[], &mut rest, is_in_parts);
    let read = applied.map_err(Problems::from).and_then(|()| read_file(rest));
    Ok(Some(read.map(|rest| Description {
        image: rest.image,
        camera: rest.camera,
        render: rest.render,
        environment: rest.environment,
        ..before.clone()
    })))
}

/// A standalone part of a text: a table with its header, or everything outside of such tables.
pub struct Piece<'a> {
    pub text: Cow<'a, str>,
    /// Path of the requested value within the piece.
    pub path: KeyPath,
    /// The start of the part in the text, or the text outside of the parts.
    origin: Result<usize, Rest>,
}

impl Piece<'_> {
    /// Converts a byte offset in the piece to a byte offset in the file.
    pub fn place(&self, offset: usize) -> usize {
        match &self.origin {
            Ok(start) => start + offset,
            Err(rest) => rest.file_offset(offset),
        }
    }
}

/// The pieces of a scene file's text.
pub struct Pieces<'a>(Parts<'a>);

impl<'a> Pieces<'a> {
    /// Locates the parts of a scene file's text.
    pub fn of(text: &'a str) -> Pieces<'a> {
        Pieces(Parts::of(text))
    }

    /// Uses the part locations of an earlier parse of the text.
    pub fn with_places(text: &'a str, places: &'a Places) -> Pieces<'a> {
        let parts = places.0.as_slice().into();
        Pieces(Parts { text, parts })
    }

    /// Returns the complete text.
    pub fn whole(&self) -> &'a str {
        self.0.text
    }

    /// Returns the piece that contains a path.
    pub fn find(&self, path: &KeyPath) -> Piece<'a> {
        match self.0.find(path) {
            Some((part, path)) => Piece {
                text: self.0.text(part).into(),
                path,
                origin: Ok(part.range.start),
            },
            None => {
                let rest = self.0.rest();
                Piece {
                    text: rest.text.clone().into(),
                    path: path.clone(),
                    origin: Err(rest),
                }
            }
        }
    }
}

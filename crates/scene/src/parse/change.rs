//! Reading again what a small change of a scene file's text touches: of a hundred thousand shapes one.

use std::borrow::Cow;
use std::path::Path;

use toml::{Table, Value};

use super::parts::{Broken, Kind, Part, Parts, Rest};
use super::{Problems, Read, invalid, is_course, read, read_camera, read_file, tagged};
use crate::define::Defines;
use crate::error::SceneError;
use crate::key_path::{KeyPath, Segment};
use crate::problem::At;
use crate::{CameraDescription, Description};

impl Description {
    /// What a text says after a change inside of the table at the first two steps of a path; `before` is what it said.
    /// `None` if all of it has to be read.
    pub(crate) fn parse_change(
        text: &str,
        origin: &str,
        defines: &mut Defines,
        before: &Description,
        at: &KeyPath,
    ) -> Result<Option<Change>, SceneError> {
        if is_course(Path::new(origin)) {
            return Ok(None);
        }
        let broken = |broken: Broken| broken.into_error(text, origin);
        let parts = Parts::of(text);
        if let Some(large) = parts.too_large() {
            return Err(broken(large));
        }
        let part = parts.find(at).map(|(part, _)| part);
        let is_rest = part.is_none();
        let read = match part {
            Some(part) => read_changed_part(&parts, part, at, defines, before).map_err(broken)?,
            None => read_changed_rest(&parts, defines, before).map_err(broken)?,
        };
        match read {
            Some(Ok(description)) => Ok(Some(Change {
                description,
                is_rest,
                places: Places(parts.parts.into_owned()),
            })),
            Some(Err(problems)) => Err(invalid(text, origin, problems, defines)),
            None => Ok(None),
        }
    }

    /// The camera that a text describes, without other values.
    pub fn parse_camera(text: &str, origin: &str) -> Result<CameraDescription, SceneError> {
        let parts = Parts::of(text);
        let rest = parts.read_rest().map_err(|broken| broken.into_error(text, origin))?;
        let camera = rest
            .get("camera")
            .and_then(Value::as_table)
            .cloned()
            .unwrap_or_default();
        let read = read_camera(camera).at("camera");
        read.map_err(|problem| invalid(text, origin, problem, &Defines::new(&[])))
    }
}

/// What was read again of a text.
pub struct Change {
    /// What the text says.
    pub description: Description,
    /// Whether that was read again which is outside of the parts.
    pub is_rest: bool,
    /// Where the parts are.
    pub places: Places,
}

/// Where the parts of a text are, once it has been looked through.
#[derive(Debug)]
pub struct Places(Vec<Part>);

impl Places {
    /// Those of a text.
    pub fn of(text: &str) -> Places {
        Places(Parts::of(text).parts.into_owned())
    }
}

/// The description after a change in one of the parts; `None` if that is no table by itself.
fn read_changed_part(
    parts: &Parts,
    part: &Part,
    at: &KeyPath,
    defines: &mut Defines,
    before: &Description,
) -> Result<Option<Result<Description, Problems>>, Broken> {
    let (Some((_, mut table)), Some(step)) = (parts.read(part)?, at.0.get(1)) else {
        return Ok(None);
    };
    let place = [Segment::from(part.kind.name()), step.clone()];
    if let Err(problem) = defines.put(&place, &mut table, |_| false) {
        return Ok(Some(Err(problem.into())));
    }
    let mut after = before.clone();
    let there = match (part.kind, step) {
        (Kind::Textures, Segment::Key(name)) => replace(after.textures.get_mut(name), table, tagged),
        (Kind::Materials, Segment::Key(name)) => replace(after.materials.get_mut(name), table, tagged),
        (Kind::Meshes, Segment::Key(name)) => replace(after.meshes.get_mut(name), table, read),
        (Kind::Lights, Segment::Index(i)) => replace(after.lights.get_mut(*i), table, tagged),
        (Kind::Shapes, Segment::Index(i)) => replace(after.shapes.get_mut(*i), table, tagged),
        (Kind::Instances, Segment::Index(i)) => replace(after.instances.get_mut(*i), table, read),
        _ => None,
    };
    let done = there.map(|read| {
        read.map_err(|problem| problem.at(step.clone()).at(part.kind.name()))
            .map(|()| after)
    });
    Ok(done)
}

/// Puts what a table says in place of what was there.
fn replace<T>(place: Option<&mut T>, table: Table, read: fn(Table) -> Read<T>) -> Option<Read<()>> {
    place.map(|place| read(table).map(|new| *place = new))
}

/// The description after a change outside of the parts; `None` if kinds of them are there too.
fn read_changed_rest(
    parts: &Parts,
    defines: &mut Defines,
    before: &Description,
) -> Result<Option<Result<Description, Problems>>, Broken> {
    let mut rest = parts.read_rest()?;
    if Kind::ALL.into_iter().any(|kind| rest.contains_key(kind.name())) {
        return Ok(None);
    }
    let is_in_parts = |key: &str| Kind::ALL.into_iter().any(|kind| kind.name() == key);
    let put = defines.put(&[], &mut rest, is_in_parts);
    let read = put.map_err(Problems::from).and_then(|()| read_file(rest));
    Ok(Some(read.map(|rest| Description {
        image: rest.image,
        camera: rest.camera,
        render: rest.render,
        environment: rest.environment,
        ..before.clone()
    })))
}

/// A part of a text that is a document by itself: a table with a header of its own, or all that is outside of such tables.
pub struct Piece<'a> {
    /// Its text.
    pub text: Cow<'a, str>,
    /// The way in it to what was asked for.
    pub path: KeyPath,
    place: Result<usize, Rest>,
}

impl Piece<'_> {
    /// Where a byte of it is in the whole text.
    pub fn place(&self, at: usize) -> usize {
        match &self.place {
            Ok(start) => start + at,
            Err(rest) => rest.place(at),
        }
    }
}

/// The pieces of a scene file's text.
pub struct Pieces<'a>(Parts<'a>);

impl<'a> Pieces<'a> {
    /// Those of a text.
    pub fn of(text: &'a str) -> Pieces<'a> {
        Pieces(Parts::of(text))
    }

    /// Those of a text whose parts are known.
    pub fn known(text: &'a str, places: &'a Places) -> Pieces<'a> {
        let parts = places.0.as_slice().into();
        Pieces(Parts { text, parts })
    }

    /// The whole text.
    pub fn whole(&self) -> &'a str {
        self.0.text
    }

    /// The piece that a path leads into.
    pub fn find(&self, path: &KeyPath) -> Piece<'a> {
        match self.0.find(path) {
            Some((part, path)) => Piece {
                text: self.0.text(part).into(),
                path,
                place: Ok(part.place.start),
            },
            None => {
                let rest = self.0.rest();
                Piece {
                    text: rest.text.clone().into(),
                    path: path.clone(),
                    place: Err(rest),
                }
            }
        }
    }
}

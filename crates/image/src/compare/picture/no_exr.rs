//! OpenEXR without the cargo feature `formats`.

use super::Picture;
use super::read::{Source, Unreadable};
use crate::formats;

pub(super) fn read(_: &mut dyn Source, _: u64) -> Result<Picture, Unreadable> {
    Err(Unreadable::Kind(formats::rule("OpenEXR")))
}

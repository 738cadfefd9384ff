//! The module `kinds` without the cargo feature `schema`.

pub(crate) use wgray_no_schema::JsonSchema;

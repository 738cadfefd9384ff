//! The module `kinds` of builds that do not generate the schema.

pub(crate) use wgray_no_schema::JsonSchema;

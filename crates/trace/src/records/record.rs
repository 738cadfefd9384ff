//! Macros that expand a single declaration of a record or constant to Rust and to WGSL. `layout.rs` declares the
//! records, `constants.rs` the constants, and `specialization.rs` the override constants.

use super::KINDS;
use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};

/// A type of record fields.
pub trait Field: Copy {
    /// Name of the type in WGSL.
    const WGSL: &'static str;
    /// Returns the value as a WGSL expression.
    fn constant(self) -> String;
    /// Returns the WGSL expression that reads a value from `words`, which are components of a row.
    fn from_row(words: &str) -> String;
}

macro_rules! fields {
    ($($ty:ty: $wgsl:literal, |$value:ident| $constant:expr, |$words:ident| $from_row:expr;)*) => {
        $(impl Field for $ty {
            const WGSL: &'static str = $wgsl;
            fn constant(self) -> String {
                let $value = self;
                $constant
            }
            fn from_row($words: &str) -> String {
                $from_row
            }
        })*
    };
}

fields! {
    f32: "f32", |x| literal(x), |words| format!("bitcast<f32>({words})");
    u32: "u32", |n| format!("{n}u"), |words| words.to_string();
    Vec2: "vec2f", |v| format!("vec2f({})", literals(&v.to_array())), |words| format!("bitcast<vec2f>({words})");
    Vec3: "vec3f", |v| format!("vec3f({})", literals(&v.to_array())), |words| format!("bitcast<vec3f>({words})");
    Vec4: "vec4f", |v| format!("vec4f({})", literals(&v.to_array())), |words| format!("bitcast<vec4f>({words})");
    UVec2: "vec2u", |v| format!("vec2u({}u, {}u)", v.x, v.y), |words| words.to_string();
    [UVec4; KINDS as usize]: "array<vec4u, KINDS>",
        |ranges| format!("array({})", ranges.map(Field::constant).join(", ")), |words| words.to_string();
    UVec4: "vec4u", |v| format!("vec4u({}u, {}u, {}u, {}u)", v.x, v.y, v.z, v.w), |words| words.to_string();
}

/// Returns a WGSL literal. The shortest decimal form of the largest float is above this float, which browsers reject.
fn literal(x: f32) -> String {
    match x.abs() == f32::MAX {
        true => format!("{:?}f", f64::from(x)),
        false => format!("{x:?}f"),
    }
}

fn literals(values: &[f32]) -> String {
    values.iter().map(|x| literal(*x)).collect::<Vec<_>>().join(", ")
}

/// A record that the shaders declare under [`Record::NAME`].
pub trait Record: bytemuck::Pod {
    /// Name of the record.
    const NAME: &'static str;
    /// Returns the declaration of the record in WGSL.
    fn declaration() -> String;
    /// Returns the record as a WGSL expression.
    fn constant(&self) -> String;
    /// Returns the WGSL expression that reads a record from the 16-byte rows `r0`, `r1` and so on.
    fn from_rows() -> String;
}

/// Returns the WGSL expression of a field's words in the rows of the record; `offset` and `size` are in bytes.
pub fn words_of_row(offset: usize, size: usize) -> String {
    let (row, first, count) = (offset / 16, offset % 16 / 4, size / 4);
    match count {
        4 => format!("r{row}"),
        _ => format!("r{row}.{}", &"xyzw"[first..first + count]),
    }
}

/// Declares records as Rust structs that implement [`Record`]; `WGSL` lists their declarations.
macro_rules! records {
    ($($(#[$doc:meta])* pub struct $name:ident { $($(#[$field_doc:meta])* pub $field:ident: $ty:ty,)* })*) => {
        $(
            $(#[$doc])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
            pub struct $name { $($(#[$field_doc])* pub $field: $ty,)* }

            impl Record for $name {
                const NAME: &'static str = stringify!($name);

                fn declaration() -> String {
                    let fields = [$(format!("    {}: {},\n", stringify!($field), <$ty as Field>::WGSL)),*];
                    format!("struct {} {{\n{}}}\n", stringify!($name), fields.concat())
                }

                fn constant(&self) -> String {
                    let fields = [$(Field::constant(self.$field)),*];
                    format!("{}({})", stringify!($name), fields.join(", "))
                }

                fn from_rows() -> String {
                    let fields = [$({
                        let offset = std::mem::offset_of!($name, $field);
                        <$ty as Field>::from_row(&words_of_row(offset, size_of::<$ty>()))
                    }),*];
                    format!("{}({})", stringify!($name), fields.join(", "))
                }
            }
        )*

        /// Returns the WGSL declarations of all records.
        pub fn declarations() -> String {
            [$($name::declaration()),*].join("\n")
        }
    };
}

/// Declares constants, and `constant_declarations` for WGSL.
macro_rules! constants {
    ($($(#[$doc:meta])* pub const $name:ident: $ty:ty = $value:expr;)*) => {
        $($(#[$doc])* pub const $name: $ty = $value;)*

        /// Returns the WGSL declarations of these constants.
        pub fn constant_declarations() -> String {
            let declarations = [$(format!(
                "const {}: {} = {};\n",
                stringify!($name), <$ty as super::record::Field>::WGSL, super::record::Field::constant($value)
            )),*];
            declarations.concat()
        }
    };
}

pub(super) use {constants, records};

#[cfg(test)]
mod tests {
    use super::*;

    /// WGSL rejects literals beyond the range of their type, even if the nearest float is in the range.
    #[test]
    fn literals_are_floats_in_range_with_the_same_bits() {
        for x in [
            f32::MAX,
            -f32::MAX,
            f32::MAX.next_down(),
            f32::MIN_POSITIVE,
            1e-45,
            0.1,
            -0.0,
        ] {
            let text = x.constant();
            let number = text.strip_suffix('f').expect("a literal of the type f32");
            assert!(number.parse::<f64>().unwrap().abs() <= f64::from(f32::MAX), "{text}");
            assert_eq!(number.parse::<f32>().unwrap().to_bits(), x.to_bits(), "{text}");
        }
        assert_eq!(Vec2::new(1.0, 0.5).constant(), "vec2f(1.0f, 0.5f)");
    }
}

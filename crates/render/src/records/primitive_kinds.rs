//! The kinds of primitives, as a table for both backends, packing and the dispatch by kind in kernels.

#[cfg(doc)]
use super::Primitive;
use super::record::constants;

/// A kind of primitive.
pub struct PrimitiveKind {
    /// The name of its constant, in Rust and in WGSL.
    pub name: &'static str,
    /// Its form: flat, a convex solid or infinite.
    pub form: PrimitiveForm,
}

/// The form of a kind of primitive.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum PrimitiveForm {
    /// Flat and bounded.
    Flat,
    /// The surface of a convex solid: a ray that leaves it through the inside hits it again.
    Solid,
    /// A plane, which is never in a BVH.
    Infinite,
}

macro_rules! primitive_kinds {
    (($d:tt) $($(#[$doc:meta])* $name:ident = $number:literal, $form:ident;)*) => {
        constants! {
            $($(#[$doc])* pub const $name: u32 = $number;)*
            /// The number of kinds of primitives.
            pub const KINDS: u32 = [$($number),*].len() as u32;
            /// The bits of the kinds whose primitives have an inside.
            pub const SOLID_KINDS: u32 = solid(PRIMITIVE_KINDS);
        }

        /// All kinds, in the order of their numbers.
        pub const PRIMITIVE_KINDS: &[PrimitiveKind] = &[
            $(PrimitiveKind { name: stringify!($name), form: PrimitiveForm::$form }),*
        ];

        /// Evaluates an expression with a kind as a constant, so that it is compiled for each kind.
        macro_rules! with_primitive_kind {
            ($d kind:expr, |$d constant:ident| $d body:expr) => {
                match $d kind {
                    $($crate::records::$name => {
                        let $d constant = $crate::records::$name;
                        $d body
                    })*
                    other => {
                        let $d constant = other;
                        $d body
                    }
                }
            };
        }
        pub(crate) use with_primitive_kind;
    };
}

primitive_kinds! { ($)
    /// [`Primitive::kind`]: |x| <= 1, |y| <= 1, z = 0 in local space.
    RECTANGLE = 0, Flat;
    /// [`Primitive::kind`]: x >= 0, y >= 0, x + y <= 1, z = 0 in local space.
    TRIANGLE = 1, Flat;
    /// [`Primitive::kind`]: the unit sphere of local space.
    ELLIPSOID = 2, Solid;
    /// [`Primitive::kind`]: z = 0 in local space.
    PLANE = 3, Infinite;
    /// [`Primitive::kind`]: x² + y² <= 1, z = 0 in local space.
    DISK = 4, Flat;
    /// [`Primitive::kind`]: the surface of x² + y² <= 1, |z| <= 1 in local space.
    CYLINDER = 5, Solid;
}

const fn solid(kinds: &[PrimitiveKind]) -> u32 {
    let (mut bits, mut i) = (0, 0);
    while i < kinds.len() {
        bits |= if matches!(kinds[i].form, PrimitiveForm::Solid) {
            1 << i
        } else {
            0
        };
        i += 1;
    }
    bits
}

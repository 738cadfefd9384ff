//! Table of the kinds of primitives, for the backends, for packing and for the selection by kind in kernels.

#[cfg(doc)]
use super::Primitive;
use super::record::constants;

/// A kind of primitive.
pub struct PrimitiveKind {
    /// Name of the constant, in Rust and WGSL.
    pub name: &'static str,
    /// Form of the surface.
    pub form: PrimitiveForm,
}

/// Geometric form of the primitives of a kind.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum PrimitiveForm {
    /// Flat and bounded.
    Flat,
    /// The surface of a convex solid: a ray that starts on the surface towards the inside hits the surface again.
    Solid,
    /// A plane, never in a BVH.
    Infinite,
}

macro_rules! primitive_kinds {
    (($d:tt) $($(#[$doc:meta])* $name:ident = $number:literal, $form:ident;)*) => {
        constants! {
            $($(#[$doc])* pub const $name: u32 = $number;)*
            /// Number of kinds.
            pub const KINDS: u32 = [$($number),*].len() as u32;
            /// Bits of the solid kinds.
            pub const SOLID_KINDS: u32 = solid_bits(PRIMITIVE_KINDS);
        }

        /// All kinds, in the order of their numbers.
        pub const PRIMITIVE_KINDS: &[PrimitiveKind] = &[
            $(PrimitiveKind { name: stringify!($name), form: PrimitiveForm::$form }),*
        ];

        /// Compiles an expression for each kind, as a constant.
        macro_rules! with_primitive_kind {
            ($d kind:expr, |$d constant:ident| $d body:expr) => {
                match $d kind {
                    $($crate::records::$name => {
                        let $d constant = $crate::records::$name;
                        $d body
                    })*
                    unknown_kind => {
                        let $d constant = unknown_kind;
                        $d body
                    }
                }
            };
        }
        pub(crate) use with_primitive_kind;
    };
}

primitive_kinds! { ($)
    /// [`Primitive::kind`]: in object space, |x| <= 1, |y| <= 1, z = 0.
    RECTANGLE = 0, Flat;
    /// [`Primitive::kind`]: x >= 0, y >= 0, x + y <= 1, z = 0.
    TRIANGLE = 1, Flat;
    /// [`Primitive::kind`]: the unit sphere.
    ELLIPSOID = 2, Solid;
    /// [`Primitive::kind`]: z = 0.
    PLANE = 3, Infinite;
    /// [`Primitive::kind`]: x² + y² <= 1, z = 0.
    DISK = 4, Flat;
    /// [`Primitive::kind`]: the surface of x² + y² <= 1, |z| <= 1.
    CYLINDER = 5, Solid;
}

const fn solid_bits(kinds: &[PrimitiveKind]) -> u32 {
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

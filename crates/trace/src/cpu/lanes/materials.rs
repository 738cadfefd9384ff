//! Parameters of the materials at the hits of several paths.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8};
use glam::Vec3;

use super::{Lanes3, Real, Vector3, select};
use crate::records::{Material, NO_INDEX};

macro_rules! material_fields {
    (reals: $($real:ident)*; vectors: $($vector:ident)*;) => {
        /// The parameters of a material, or of the material at the hit of each lane. The fields of [`Material`] describe
        /// them.
        pub trait MaterialFields {
            type Real: Real;

            $(fn $real(&self) -> Self::Real;)*
            $(fn $vector(&self) -> <Self::Real as Real>::Vec3;)*
            fn is_thin(&self) -> <Self::Real as Real>::Mask;
            fn has_aniso_table(&self) -> <Self::Real as Real>::Mask;
        }

        impl MaterialFields for Material {
            type Real = f32;

            $(#[inline(always)]
            fn $real(&self) -> f32 {
                self.$real
            })*

            $(#[inline(always)]
            fn $vector(&self) -> Vec3 {
                self.$vector
            })*

            #[inline(always)]
            fn is_thin(&self) -> bool {
                self.thin != 0
            }

            #[inline(always)]
            fn has_aniso_table(&self) -> bool {
                self.aniso_table != 0
            }
        }

        /// The parameters of one material per lane.
        #[derive(Default)]
        pub struct MaterialRows {
            $($real: [f32; 8],)*
            $($vector: [[f32; 8]; 3],)*
            /// 1 for a thin sheet, else 0.
            is_thin: [f32; 8],
            /// 1 with an anisotropic albedo table, else 0.
            has_aniso_table: [f32; 8],
            /// 1 with multiple-scattering compensation that depends on the directions, else 0.
            has_energy_table: [f32; 8],
        }

        impl MaterialRows {
            #[inline(always)]
            pub fn set(&mut self, lane: usize, material: &Material) {
                $(self.$real[lane] = material.$real;)*
                $({
                    let v = material.$vector;
                    self.$vector[0][lane] = v.x;
                    self.$vector[1][lane] = v.y;
                    self.$vector[2][lane] = v.z;
                })*
                self.is_thin[lane] = if material.is_thin() { 1.0 } else { 0.0 };
                self.has_aniso_table[lane] = if material.has_aniso_table() { 1.0 } else { 0.0 };
                self.has_energy_table[lane] = if material.energy != NO_INDEX { 1.0 } else { 0.0 };
            }

            /// Sets the color of a diffuse material. Its other parameters have no effect.
            #[inline(always)]
            pub fn set_diffuse(&mut self, lane: usize, color: Vec3) {
                self.diffuse[0][lane] = color.x;
                self.diffuse[1][lane] = color.y;
                self.diffuse[2][lane] = color.z;
            }

            /// Sets the loss in the lanes whose material has an energy table. The other lanes keep theirs.
            #[inline(always)]
            pub fn set_loss<S: Simd>(&mut self, loss: f32x8<S>) {
                let has_energy_table = f32x8::simd_from(loss.simd, self.has_energy_table);
                let before = f32x8::simd_from(loss.simd, self.loss);
                self.loss = select(before, loss, has_energy_table.gt(Real::splat(loss, 0.0))).into();
            }
        }

        impl<S: Simd> MaterialFields for LaneMaterials<'_, S> {
            type Real = f32x8<S>;

            $(#[inline(always)]
            fn $real(&self) -> f32x8<S> {
                f32x8::simd_from(self.simd, self.rows.$real)
            })*

            $(#[inline(always)]
            fn $vector(&self) -> Lanes3<f32x8<S>> {
                let [x, y, z] = self.rows.$vector.map(|row| f32x8::simd_from(self.simd, row));
                Vector3::new(x, y, z)
            })*

            #[inline(always)]
            fn is_thin(&self) -> mask32x8<S> {
                let flags = f32x8::simd_from(self.simd, self.rows.is_thin);
                flags.gt(Real::splat(flags, 0.0))
            }

            #[inline(always)]
            fn has_aniso_table(&self) -> mask32x8<S> {
                let flags = f32x8::simd_from(self.simd, self.rows.has_aniso_table);
                flags.gt(Real::splat(flags, 0.0))
            }
        }
    };
}

material_fields! {
    reals: roughness anisotropy ior sheen_roughness metallic transmission clearcoat clearcoat_roughness specular_weight
        loss;
    vectors: diffuse specular sheen tint eta k;
}

/// [`MaterialRows`] with the SIMD instructions to load them.
#[derive(Clone, Copy)]
pub struct LaneMaterials<'a, S: Simd> {
    pub simd: S,
    pub rows: &'a MaterialRows,
}

//! Vectors of the surfaces at the hits of one or several paths.

use super::Real;

/// The vectors of a [`Surface`](crate::cpu::surface::Surface), or of the surfaces at the hits of several paths.
pub trait SurfaceVectors: Copy {
    type Real: Real;

    fn normal(&self) -> <Self::Real as Real>::Vec3;
    fn smooth_normal(&self) -> <Self::Real as Real>::Vec3;
    fn wo(&self) -> <Self::Real as Real>::Vec3;
}

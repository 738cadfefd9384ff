//! Prefetches of data.

use super::geometry::instance_of;
use super::ray::Hit;
use crate::records::{Packed, PackedMesh};

/// Starts to load the cache line at an address, which may be any.
#[inline(always)]
pub fn prefetch_line(address: *const u8) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch accepts any address, and changes no memory.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}

/// Starts to load all cache lines of an item, whose index may be any.
#[inline(always)]
pub fn prefetch_item<T>(items: &[T], index: u32) {
    let address = items.as_ptr().wrapping_add(index as usize).cast::<u8>();
    for offset in (0..size_of::<T>()).step_by(64) {
        prefetch_line(address.wrapping_add(offset));
    }
}

/// Starts to load the vertex indices of a triangle, given its position in leaf order.
#[inline(always)]
pub fn prefetch_triangle(mesh: &PackedMesh, slot: u32) {
    prefetch_item(&mesh.triangles, slot);
}

/// Starts to load the vertices of the triangle at a hit on a mesh.
#[inline(always)]
pub fn prefetch_vertices(scene: &Packed, hit: Hit) {
    let mesh = &scene.bvh.meshes[instance_of(scene, hit).mesh as usize];
    let triangle = mesh.triangles[hit.slot as usize];
    for vertex in [triangle.x, triangle.y, triangle.z] {
        prefetch_item(&mesh.vertices, vertex);
        if !mesh.attributes.is_empty() {
            prefetch_item(&mesh.attributes, vertex);
        }
    }
}

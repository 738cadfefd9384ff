//! Values that are computed from a mesh on first use.

use std::sync::{Arc, PoisonError, RwLock, Weak};

use super::Mesh;

/// A value computed from the mesh that contains the cache. It takes no part in comparisons, and a clone of the mesh starts without it.
///
/// The weak reference to the mesh proves that the value is current: while it exists `Arc::get_mut` fails, and a mesh that is moved out of its
/// `Arc` to be edited is at another address afterwards.
#[derive(Debug)]
pub(super) struct Cache<T>(RwLock<Option<(Weak<Mesh>, Arc<T>)>>);

impl<T> Cache<T> {
    /// Returns the value of this mesh, in which the cache is. No lock is held while it is computed, because the threads that compute it may
    /// need it as well.
    pub fn get_or_init(&self, mesh: &Arc<Mesh>, compute: impl FnOnce() -> T) -> Arc<T> {
        let is_current = |known: &&(Weak<Mesh>, Arc<T>)| known.0.as_ptr() == Arc::as_ptr(mesh);
        let known = self.0.read().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, value)) = known.as_ref().filter(is_current) {
            return Arc::clone(value);
        }
        drop(known);
        let computed = Arc::new(compute());
        let mut known = self.0.write().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, value)) = known.as_ref().filter(is_current) {
            return Arc::clone(value); // another thread was faster
        }
        *known = Some((Arc::downgrade(mesh), Arc::clone(&computed)));
        computed
    }
}

impl<T> Clone for Cache<T> {
    fn clone(&self) -> Self {
        Cache::default()
    }
}

impl<T> Default for Cache<T> {
    fn default() -> Self {
        Cache(RwLock::new(None))
    }
}

impl<T> PartialEq for Cache<T> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

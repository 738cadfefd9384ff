//! Values that are computed from a mesh on first use.

use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::{Arc, PoisonError, RwLock, Weak};

use super::Mesh;

/// Values computed from the mesh that contains the cache, one per type. Comparisons ignore the cache, and a clone of
/// the cache is empty.
#[derive(Debug, Default)]
pub(super) struct Cache(RwLock<Values>);

#[derive(Debug, Default)]
struct Values {
    /// The mesh that the values belong to. While this weak reference exists, `Arc::get_mut` fails, and a mesh that is
    /// moved out of its `Arc` gets a new address. The values remain valid while the address matches.
    mesh: Weak<Mesh>,
    by_type: HashMap<TypeId, Arc<dyn Any + Send + Sync>>,
}

impl Values {
    fn get<T: Any + Send + Sync>(&self, mesh: &Arc<Mesh>) -> Option<Arc<T>> {
        if self.mesh.as_ptr() != Arc::as_ptr(mesh) {
            return None;
        }
        Arc::clone(self.by_type.get(&TypeId::of::<T>())?).downcast().ok()
    }
}

impl Cache {
    /// Returns the value of type `T`, computed on the first call. `mesh` is the mesh that contains the cache. No lock
    /// is held during the computation, because threads that `compute` starts may use the cache.
    pub fn get_or_init<T: Any + Send + Sync>(&self, mesh: &Arc<Mesh>, compute: impl FnOnce() -> T) -> Arc<T> {
        if let Some(value) = self.0.read().unwrap_or_else(PoisonError::into_inner).get(mesh) {
            return value;
        }
        let computed = Arc::new(compute());
        let mut values = self.0.write().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = values.get(mesh) {
            return value; // another thread was faster
        }
        if values.mesh.as_ptr() != Arc::as_ptr(mesh) {
            *values = Values {
                mesh: Arc::downgrade(mesh),
                by_type: HashMap::new(),
            };
        }
        let value: Arc<dyn Any + Send + Sync> = Arc::<T>::clone(&computed);
        values.by_type.insert(TypeId::of::<T>(), value);
        computed
    }
}

impl Clone for Cache {
    fn clone(&self) -> Self {
        Cache::default()
    }
}

impl PartialEq for Cache {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

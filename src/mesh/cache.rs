//! What is computed from a value once it is asked for.

use std::sync::{Arc, OnceLock};

/// What is computed from the rest of a value once it is asked for. It plays no part in comparisons.
#[derive(Clone, Debug)]
pub struct Cache<T>(OnceLock<Arc<T>>);

impl<T> Cache<T> {
    /// What was computed before, or is now: not while others wait, as the threads that compute may come to wait themselves.
    pub fn get_or_init(&self, compute: impl FnOnce() -> T) -> Arc<T> {
        if let Some(known) = self.0.get() {
            return known.clone();
        }
        let computed = Arc::new(compute());
        self.0.get_or_init(|| computed).clone()
    }
}

impl<T> Default for Cache<T> {
    fn default() -> Self {
        Cache(OnceLock::new())
    }
}

impl<T> PartialEq for Cache<T> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

//! Cancellation of renders from other threads.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Cancels a render, from any thread. Clones share the state.
///
/// A render observes the token after each dispatch, while the scene is packed, and while the device is opened, and ends
/// within about 100 ms. A token stays cancelled.
#[derive(Clone, Debug, Default)]
pub struct CancelToken {
    flag: Arc<AtomicBool>,
    parent: Option<Arc<CancelToken>>,
}

impl CancelToken {
    /// Returns a token that is not cancelled.
    pub fn new() -> CancelToken {
        CancelToken::default()
    }

    /// Returns a token that is cancelled if this token is, but can also be cancelled alone.
    pub fn child(&self) -> CancelToken {
        CancelToken {
            flag: Arc::default(),
            parent: Some(Arc::new(self.clone())),
        }
    }

    /// Cancels all renders that use this token or one of its children.
    pub fn cancel(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }

    /// Returns true if the token is cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.flag.load(Ordering::Relaxed) || self.parent.as_ref().is_some_and(|parent| parent.is_cancelled())
    }
}

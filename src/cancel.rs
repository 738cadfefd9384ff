//! Cancellation of renders from other threads.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Cancels a render, from any thread. Clones share the state.
///
/// Rendering observes the token after each dispatch, and while the scene is packed and the device opened: within about
/// 100 ms. A token stays cancelled.
#[derive(Clone, Debug, Default)]
pub struct CancelToken(Arc<AtomicBool>);

impl CancelToken {
    /// Returns a token that is not cancelled.
    pub fn new() -> CancelToken {
        CancelToken::default()
    }

    /// Cancels all renders that have this token.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Returns true if the token is cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

//! A future for the result of work on another thread.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};

use crate::cancel::CancelToken;

/// The result of work on another thread. Dropping the task cancels its token.
pub(crate) struct Task<T> {
    slot: Arc<Mutex<Slot<T>>>,
    cancel: CancelToken,
}

enum Slot<T> {
    Running(Option<Waker>),
    Finished(T),
    /// The work panicked, or the result was taken.
    Empty,
}

/// Reports the end of the work, even by a panic.
struct Finish<T>(Arc<Mutex<Slot<T>>>);

impl<T> Finish<T> {
    fn set(&self, slot: Slot<T>) {
        let previous = std::mem::replace(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner), slot);
        if let Slot::Running(Some(waker)) = previous {
            waker.wake();
        }
    }
}

impl<T> Drop for Finish<T> {
    fn drop(&mut self) {
        let is_running = matches!(*self.0.lock().unwrap_or_else(PoisonError::into_inner), Slot::Running(_));
        if is_running {
            self.set(Slot::Empty);
        }
    }
}

/// Runs `work` on another thread, with the subscriber and the span of this thread.
pub(crate) fn spawn_thread(work: impl FnOnce() + Send + 'static) {
    let dispatch = tracing::dispatcher::get_default(Clone::clone);
    let span = tracing::Span::current();
    std::thread::spawn(move || tracing::dispatcher::with_default(&dispatch, || span.in_scope(work)));
}

impl<T: Send + 'static> Task<T> {
    /// Runs `work` on another thread. `cancel` is the token of the work.
    pub(crate) fn spawn(cancel: &CancelToken, work: impl FnOnce() -> T + Send + 'static) -> Task<T> {
        let slot = Arc::new(Mutex::new(Slot::Running(None)));
        let finish = Finish(Arc::clone(&slot));
        spawn_thread(move || finish.set(Slot::Finished(work())));
        Task {
            slot,
            cancel: cancel.clone(),
        }
    }
}

impl<T> Future for Task<T> {
    type Output = T;

    /// # Panics
    ///
    /// Panics if the work panicked.
    fn poll(self: Pin<&mut Self>, context: &mut Context) -> Poll<T> {
        let mut slot = self.slot.lock().unwrap_or_else(PoisonError::into_inner);
        match std::mem::replace(&mut *slot, Slot::Empty) {
            Slot::Running(_) => {
                *slot = Slot::Running(Some(context.waker().clone()));
                Poll::Pending
            }
            Slot::Finished(result) => Poll::Ready(result),
            Slot::Empty => panic!("the render thread panicked"),
        }
    }
}

impl<T> Drop for Task<T> {
    fn drop(&mut self) {
        self.cancel.cancel();
    }
}

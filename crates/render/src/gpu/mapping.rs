//! The mapping of a buffer for reading, as a future.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};

/// A buffer that is being mapped. As a future, it ends when the buffer can be read. Natively, wgpu maps buffers only
/// while the device is polled.
pub struct Mapping(Arc<Mutex<MappingState>>);

#[derive(Default)]
struct MappingState {
    result: Option<Result<(), String>>,
    waker: Option<Waker>,
}

/// Reports the result of a mapping, an error if wgpu drops the callback without a call.
struct Report(Arc<Mutex<MappingState>>);

impl Report {
    fn set(&self, result: Result<(), String>) {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        state.result.get_or_insert(result);
        if let Some(waker) = state.waker.take() {
            waker.wake();
        }
    }
}

impl Drop for Report {
    fn drop(&mut self) {
        self.set(Err("the buffer was not mapped".to_owned())); // without effect after a call
    }
}

impl Mapping {
    /// Starts to map a whole buffer, after the work submitted so far.
    pub fn start(buffer: &wgpu::Buffer) -> Mapping {
        let state = Arc::new(Mutex::new(MappingState::default()));
        let report = Report(Arc::clone(&state));
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            report.set(result.map_err(|error| error.to_string()));
        });
        Mapping(state)
    }

    /// Returns the result; `None` while pending.
    pub fn result(&self) -> Option<Result<(), String>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).result.clone()
    }
}

impl Future for &Mapping {
    type Output = Result<(), String>;

    fn poll(self: Pin<&mut Self>, context: &mut Context) -> Poll<Result<(), String>> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match state.result.clone() {
            Some(result) => Poll::Ready(result),
            None => {
                state.waker = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }
}

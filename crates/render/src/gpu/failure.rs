//! Device failures: errors, out-of-memory and device loss. wgpu reports failures by error scopes, callbacks and panics.
//! It reports a device loss only once, by a callback.

use std::error::Error;
use std::fmt::Display;
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::RenderError;

/// Failures of a device, shared by clones.
#[derive(Clone, Default)]
pub struct Failure(Arc<Mutex<FailureState>>);

#[derive(Default)]
struct FailureState {
    /// The device loss, which is permanent.
    lost: Option<DeviceFault>,
    /// First error outside of scopes, until `check` reports the error.
    unreported: Option<DeviceFault>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum DeviceFault {
    Lost(String),
    Memory,
    Other(String),
}

/// Messages of wgpu after a device loss, and for out-of-memory in an infallible call.
const LOST: &str = "Device is lost";
const NO_MEMORY: &str = "Out of memory";

/// Messages of wgpu for a device that cannot be opened, because the driver is being reset or has no memory.
const LOST_AT_OPENING: &str = "Parent device is lost";
const NO_MEMORY_AT_OPENING: &str = "Not enough memory left.";

impl DeviceFault {
    fn of(error: &wgpu::Error) -> DeviceFault {
        match error {
            wgpu::Error::OutOfMemory { .. } => DeviceFault::Memory,
            other => DeviceFault::Other(other.to_string()),
        }
    }

    fn of_loss(reason: wgpu::DeviceLostReason, message: &str) -> DeviceFault {
        match (reason, message) {
            (wgpu::DeviceLostReason::Destroyed, _) => DeviceFault::Lost("the program released the device".to_string()),
            (_, NO_MEMORY) => DeviceFault::Memory,
            (_, LOST) => DeviceFault::Lost(
                "the driver removed it, for example after a reset or a dispatch that took too long".to_string(),
            ),
            (_, other) => DeviceFault::Lost(other.to_string()),
        }
    }

    fn into_error(self, device: &str) -> RenderError {
        let device = device.to_string();
        match self {
            DeviceFault::Lost(message) => RenderError::Lost { device, message },
            DeviceFault::Memory => RenderError::OutOfMemory { device, message: None },
            DeviceFault::Other(message) => RenderError::Device { device, message },
        }
    }
}

impl Failure {
    /// Records device loss, and errors outside of scopes, for which wgpu would panic.
    pub fn listen(&self, device: &wgpu::Device) {
        let (errors, losses) = (self.clone(), self.clone());
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            errors.record_error(DeviceFault::of(&error))
        }));
        device.set_device_lost_callback(move |reason, message| {
            losses.record_loss(DeviceFault::of_loss(reason, &message))
        });
    }

    fn with_state<T>(&self, access: impl FnOnce(&mut FailureState) -> T) -> T {
        access(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn record_error(&self, fault: DeviceFault) {
        self.with_state(|state| {
            state.unreported.get_or_insert(fault);
        });
    }

    fn record_loss(&self, fault: DeviceFault) {
        self.with_state(|state| {
            state.lost.get_or_insert(fault);
        });
    }

    /// Returns the value of wgpu calls, or an error: a device loss, the first error of the scopes, an error recorded
    /// outside of the scopes, or a panic, in this order.
    pub fn check<T>(
        &self,
        device: &str,
        value: Result<T, String>,
        scope_error: Option<&wgpu::Error>,
    ) -> Result<T, RenderError> {
        let (lost, unreported) = self.with_state(|state| (state.lost.clone(), state.unreported.take()));
        let fault = lost.or(scope_error.map(DeviceFault::of)).or(unreported);
        match (fault, value) {
            (Some(fault), _) => Err(fault.into_error(device)),
            (None, Err(message)) => Err(DeviceFault::Other(message).into_error(device)),
            (None, Ok(value)) => Ok(value),
        }
    }

    /// Returns the device loss if the device is lost, otherwise the error.
    pub fn error(&self, device: &str, message: &dyn Display) -> RenderError {
        let lost = self.with_state(|state| state.lost.clone());
        lost.unwrap_or_else(|| DeviceFault::Other(message.to_string()))
            .into_error(device)
    }
}

/// Returns the error of a device that cannot be opened.
pub fn error_of_opening(device: &str, error: &dyn Error) -> RenderError {
    let mentions = |text: &str| {
        let mut causes = std::iter::successors(Some(error), |error| (*error).source());
        causes.any(|cause| cause.to_string().contains(text))
    };
    if mentions(NO_MEMORY_AT_OPENING) {
        RenderError::OutOfMemory {
            device: device.to_string(),
            message: Some("the driver has no memory to open the device; use the CPU".to_owned()),
        }
    } else if mentions(LOST_AT_OPENING) {
        DeviceFault::Lost("the driver does not open the device".to_string()).into_error(device)
    } else {
        DeviceFault::Other(error.to_string()).into_error(device)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(result: Result<u8, RenderError>) -> String {
        result.map_or_else(|error| error.to_string(), |value| value.to_string())
    }

    #[test]
    fn a_device_loss_is_reported_every_time_and_other_errors_once() {
        let failure = Failure::default();
        let check = |value: Result<u8, &str>| error_of(failure.check("gpu", value.map_err(str::to_string), None));
        assert_eq!(check(Ok(7)), "7");
        assert_eq!(check(Err("a panic")), "gpu: a panic");
        failure.record_error(DeviceFault::Other("first".to_string()));
        failure.record_error(DeviceFault::Other("second".to_string()));
        assert_eq!(failure.error("gpu", &"another").to_string(), "gpu: another");
        assert_eq!(check(Ok(7)), "gpu: first");
        assert_eq!(check(Ok(7)), "7");
        failure.record_loss(DeviceFault::of_loss(wgpu::DeviceLostReason::Unknown, "reset"));
        failure.record_loss(DeviceFault::of_loss(wgpu::DeviceLostReason::Destroyed, ""));
        for value in [Ok(7), Err("a panic"), Ok(7)] {
            assert_eq!(check(value), "gpu: the device was lost: reset");
        }
        assert_eq!(
            failure.error("gpu", &"another").to_string(),
            "gpu: the device was lost: reset"
        );
    }

    #[test]
    fn out_of_memory_is_not_a_device_loss() {
        let fault_of = |message| DeviceFault::of_loss(wgpu::DeviceLostReason::Unknown, message);
        assert_eq!(fault_of("Out of memory"), DeviceFault::Memory);
        assert!(matches!(fault_of("Device is lost"), DeviceFault::Lost(_)));
        assert_eq!(fault_of("anything"), DeviceFault::Lost("anything".to_string()));
        let error = std::io::Error::other("Not enough memory left.");
        assert!(matches!(
            error_of_opening("gpu", &error),
            RenderError::OutOfMemory { .. }
        ));
        let error = std::io::Error::other("Parent device is lost");
        assert!(matches!(error_of_opening("gpu", &error), RenderError::Lost { .. }));
        let error = std::io::Error::other("a feature is missing");
        assert!(matches!(error_of_opening("gpu", &error), RenderError::Device { .. }));
    }
}

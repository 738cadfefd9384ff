//! Conversion of panics in libraries to errors. wgpu 30 panics when it waits for a lost device, and when some of its
//! objects are dropped after the device was lost.

use std::any::Any;
use std::cell::Cell;
use std::future::{Future, poll_fn};
use std::mem::ManuallyDrop;
use std::ops::Deref;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::task::Poll;

thread_local! {
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Returns true if [`catch_panic`] would catch a panic of this thread. The hook of [`install_quiet_hook`] does not print
/// such panics.
pub fn is_contained() -> bool {
    DEPTH.try_with(Cell::get).is_ok_and(|depth| depth > 0)
}

/// Installs a panic hook that passes uncaught panics to the previous hook.
pub fn install_quiet_hook() {
    let previous_hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !is_contained() {
            previous_hook(info);
        }
    }));
}

/// Calls a closure.
///
/// # Errors
///
/// The panic message, if the closure panics. After a panic, values that the closure modified may only be dropped.
pub fn catch_panic<T>(closure: impl FnOnce() -> T) -> Result<T, String> {
    let _guard = DepthGuard::enter();
    catch_unwind(AssertUnwindSafe(closure)).map_err(|panic| message(panic.as_ref()))
}

/// Like [`catch_panic`], for each poll of a future.
pub async fn catch_panic_of_future<T>(future: impl Future<Output = T>) -> Result<T, String> {
    let mut future = pin!(future);
    poll_fn(|context| match catch_panic(|| future.as_mut().poll(context)) {
        Ok(Poll::Pending) => Poll::Pending,
        Ok(Poll::Ready(value)) => Poll::Ready(Ok(value)),
        Err(message) => Poll::Ready(Err(message)),
    })
    .await
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    // wgpu prints each cause on its own line.
    let lines = text.unwrap_or("it panicked").lines().map(str::trim);
    lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(": ")
}

/// Marks the thread as inside [`catch_panic`].
struct DepthGuard;

impl DepthGuard {
    fn enter() -> DepthGuard {
        // Thread-local variables fail while the thread ends, and the panics of the thread are then printed.
        let _ = DEPTH.try_with(|depth| depth.set(depth.get() + 1));
        DepthGuard
    }
}

impl Drop for DepthGuard {
    fn drop(&mut self) {
        let _ = DEPTH.try_with(|depth| depth.set(depth.get().saturating_sub(1)));
    }
}

/// A wrapper of a library's value that ignores panics while the value is dropped.
#[derive(Clone)]
pub struct CatchPanicOnDrop<T>(ManuallyDrop<T>);

impl<T> CatchPanicOnDrop<T> {
    /// Wraps a value.
    pub fn new(value: T) -> CatchPanicOnDrop<T> {
        CatchPanicOnDrop(ManuallyDrop::new(value))
    }
}

impl<T> Deref for CatchPanicOnDrop<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> Drop for CatchPanicOnDrop<T> {
    fn drop(&mut self) {
        // SAFETY: the value is not used afterwards.
        let value = unsafe { ManuallyDrop::take(&mut self.0) };
        let _ = catch_panic(|| drop(value)); // a destructor cannot return errors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct PanicsOnDrop;

    impl Drop for PanicsOnDrop {
        fn drop(&mut self) {
            panic!("in a drop");
        }
    }

    #[test]
    fn panics_become_errors_with_the_panic_message() {
        assert_eq!(catch_panic(|| 7), Ok(7));
        assert_eq!(catch_panic(|| panic!("text")), Err::<(), _>("text".to_string()));
        let causes = "Error in Device::poll: Validation Error\n\nCaused by:\n  Parent device is lost\n";
        let caught = catch_panic(|| panic!("{causes}"));
        let line = "Error in Device::poll: Validation Error: Caused by:: Parent device is lost";
        assert_eq!(caught, Err::<(), _>(line.to_string()));
        assert_eq!(
            catch_panic(|| std::panic::panic_any(7)),
            Err::<(), _>("it panicked".to_string())
        );
    }

    #[test]
    fn is_contained_is_true_only_inside_catch_panic() {
        assert!(!is_contained());
        let inner = catch_panic(|| {
            let deeper = catch_panic(|| panic!("deeper"));
            assert_eq!(deeper, Err::<(), _>("deeper".to_string()));
            is_contained()
        });
        assert_eq!(inner, Ok(true));
        assert_eq!(
            catch_panic(|| std::thread::spawn(is_contained).join().ok()),
            Ok(Some(false))
        );
        assert!(!is_contained());
    }

    #[test]
    fn catch_panic_on_drop_ignores_panics_of_destructors() {
        drop(CatchPanicOnDrop::new(PanicsOnDrop));
        assert!(
            catch_unwind(|| drop(PanicsOnDrop)).is_err(),
            "dropping without the wrapper did not panic"
        );
    }
}

//! Allocations that may fail. The global allocator queries [`is_fallible`]: if the caller does not handle the failure of
//! an allocation, the allocator can end the program in an orderly way.

use std::cell::Cell;

thread_local! {
    static FALLIBLE: Cell<bool> = const { Cell::new(false) };
}

/// Runs `allocate`, which must return allocation failures as errors, like [`Vec::try_reserve`].
pub fn fallible<T>(allocate: impl FnOnce() -> T) -> T {
    struct Restore(bool);
    impl Drop for Restore {
        fn drop(&mut self) {
            FALLIBLE.set(self.0);
        }
    }
    let _restore = Restore(FALLIBLE.replace(true));
    allocate()
}

/// Returns true if the caller handles the failure of this thread's current allocation.
pub fn is_fallible() -> bool {
    FALLIBLE.try_with(Cell::get).unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_marked_allocations_are_fallible() {
        assert!(!is_fallible());
        assert!(fallible(|| fallible(is_fallible) && is_fallible()));
        let _ = std::panic::catch_unwind(|| fallible(|| std::panic::resume_unwind(Box::new(()))));
        assert!(!is_fallible());
        assert!(!fallible(|| std::thread::spawn(is_fallible).join().unwrap()));
    }

    /// The failure of an unmarked allocation ends the program, even with `try_reserve`.
    #[test]
    fn every_fallible_allocation_is_marked() {
        let workspace = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
        let mut folders = vec![workspace.join("src"), workspace.join("crates")];
        let mut count = 0;
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|extension| extension == "rs")
                    && !path.ends_with("crates/image/src/memory.rs")
                {
                    let text = std::fs::read_to_string(&path).unwrap();
                    for line in text.lines().filter(|line| line.contains(".try_reserve")) {
                        count += 1;
                        assert!(line.contains("fallible("), "{}: {line}", path.display());
                    }
                }
            }
        }
        assert!(count >= 4, "{count}");
    }
}

//! Memory in huge pages, for which a processor needs fewer address translations.

/// Size of a huge page on x86-64, in bytes. Huge pages are requested for vectors that are at least as large.
#[cfg(target_os = "linux")]
const MIN_SIZE: usize = 2 << 20;

/// Returns an empty vector with the capacity. Linux is asked for huge pages; other systems are not.
pub fn vec_in_huge_pages<T>(capacity: usize) -> Vec<T> {
    let vec = Vec::with_capacity(capacity);
    #[cfg(target_os = "linux")]
    request_huge_pages(&vec);
    vec
}

#[cfg(target_os = "linux")]
fn request_huge_pages<T>(vec: &Vec<T>) {
    use rustix::mm::{Advice, madvise};
    let size = vec.capacity() * size_of::<T>();
    if size < MIN_SIZE {
        return;
    }
    let page = rustix::param::page_size();
    let padding = vec.as_ptr().addr().wrapping_neg() % page;
    let start = vec.as_ptr().cast::<u8>().wrapping_add(padding).cast_mut().cast();
    // SAFETY: the pages belong to the vector, and this advice does not change their contents.
    let result = unsafe { madvise(start, (size - padding) / page * page, Advice::LinuxHugepage) };
    if let Err(e) = result {
        tracing::debug!("no huge pages: {e}"); // the kernel may be built without them
    }
}

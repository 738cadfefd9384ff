//! Iteration over a mask.

/// Returns the positions of the bits that are set, the lowest first.
#[inline(always)]
pub fn bits_of(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(
        #[inline(always)]
        move || {
            let i = bits.trailing_zeros();
            bits &= bits.checked_sub(1)?;
            Some(i as usize)
        },
    )
}

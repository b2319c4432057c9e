//! Lines of memory that kernels write, and prefetching.

use super::F32x16;

/// Sixteen lines to write, a stride apart.
pub(crate) struct StridedLines<'a> {
    lines: &'a mut [F32x16],
    stride: usize,
}

impl<'a> StridedLines<'a> {
    /// The first line, and each of the fifteen that are `stride` lines further.
    ///
    /// # Panics
    /// Where `lines` ends before the last of them.
    #[inline(always)]
    pub(crate) fn new(lines: &'a mut [F32x16], stride: usize) -> Self {
        // No more than 2^58 lines: their product is a number.
        assert!(stride <= lines.len());
        assert!((F32x16::LANES - 1) * stride < lines.len());
        Self { lines, stride }
    }

    /// One of the sixteen.
    #[inline(always)]
    pub(crate) fn line(&mut self, index: usize) -> &mut F32x16 {
        assert!(index < F32x16::LANES);
        // SAFETY: `new` has checked the last of the sixteen lines.
        unsafe { self.lines.get_unchecked_mut(index * self.stride) }
    }
}

/// Asks the machine for an element that will be read. It need not exist.
#[inline(always)]
pub(crate) fn prefetch<T>(table: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 has SSE; any address may be asked for.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(table.as_ptr().wrapping_add(index).cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (table, index);
}

/// Asks the machine for an element that will be written. It need not exist.
#[inline(always)]
pub(crate) fn prefetch_for_write<T>(table: &mut [T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_ET0, _mm_prefetch};
        // SAFETY: every x86-64 has SSE; any address may be asked for.
        unsafe { _mm_prefetch::<_MM_HINT_ET0>(table.as_ptr().wrapping_add(index).cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (table, index);
}

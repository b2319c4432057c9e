//! Sixteen rows of [`F32x16`]s that kernels write side by side, and prefetching.

use std::marker::PhantomData;

use super::F32x16;

/// Sixteen [`F32x16`]s to write, one for each lane.
pub(crate) trait Sixteen {
    /// The [`F32x16`] of the lane `index`.
    fn line(&mut self, index: usize) -> &mut F32x16;
}

/// Sixteen [`F32x16`]s to write at equal distances in memory.
pub(crate) struct StridedLines<'a> {
    lines: &'a mut [F32x16],
    stride: usize,
}

impl<'a> StridedLines<'a> {
    /// The first [`F32x16`] of `lines`, and fifteen more at multiples of `stride`.
    ///
    /// # Panics
    /// If `lines` ends before the last of them.
    #[inline(always)]
    pub(crate) fn new(lines: &'a mut [F32x16], stride: usize) -> Self {
        // A slice has at most 2^58 items, so the product does not overflow.
        assert!(stride <= lines.len());
        assert!((F32x16::LANES - 1) * stride < lines.len());
        Self { lines, stride }
    }
}

impl Sixteen for StridedLines<'_> {
    #[inline(always)]
    fn line(&mut self, index: usize) -> &mut F32x16 {
        assert!(index < F32x16::LANES);
        // SAFETY: `new` has checked the last of the sixteen lines.
        unsafe { self.lines.get_unchecked_mut(index * self.stride) }
    }
}

/// Sixteen rows of [`F32x16`]s to write, anywhere in memory.
pub(crate) struct RowLines<'a> {
    starts: [*mut F32x16; F32x16::LANES],
    /// Number of [`F32x16`]s of each row.
    length: usize,
    memory: PhantomData<&'a mut F32x16>,
}

impl RowLines<'_> {
    /// Rows that start at `starts`.
    ///
    /// # Safety
    /// The `length` items from each start on are valid for writes for as long as the rows live, and nobody else uses them.
    #[inline(always)]
    pub(super) unsafe fn of_starts(starts: [*mut F32x16; F32x16::LANES], length: usize) -> Self {
        Self {
            starts,
            length,
            memory: PhantomData,
        }
    }

    /// Prefetches an [`F32x16`] that will be written. It need not exist.
    #[inline(always)]
    pub(crate) fn prefetch(&self, row: usize, index: usize) {
        prefetch_line(self.starts[row].wrapping_add(index));
    }

    /// An [`F32x16`] of one row.
    #[inline(always)]
    pub(crate) fn line(&mut self, row: usize, index: usize) -> &mut F32x16 {
        assert!(row < F32x16::LANES && index < self.length);
        // SAFETY: a row's `length` lines are inside the memory that the rows were made of, and no other row has them.
        unsafe { &mut *self.starts[row].add(index) }
    }
}

/// Prefetches an element that will be read. It need not exist.
#[inline(always)]
pub(crate) fn prefetch<T>(element: *const T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 has SSE; any address may be asked for.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(element.cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = element;
}

/// Prefetches an [`F32x16`] that will be written. It need not exist.
#[inline(always)]
pub(crate) fn prefetch_for_write(lines: &[F32x16], index: usize) {
    prefetch_line(lines.as_ptr().wrapping_add(index));
}

/// Prefetches to the second-level cache. In the first-level cache, memory that waits to be written would displace memory
/// that is in use.
#[inline(always)]
fn prefetch_line(line: *const F32x16) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T1, _mm_prefetch};
        // SAFETY: every x86-64 has SSE; any address may be asked for.
        unsafe { _mm_prefetch::<_MM_HINT_T1>(line.cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = line;
}

//! Lines of memory that kernels write, and prefetching.

use std::marker::PhantomData;

use super::F32x16;

/// Sixteen lines to write.
pub(crate) trait Sixteen {
    /// One of the sixteen.
    fn line(&mut self, index: usize) -> &mut F32x16;
}

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
}

impl Sixteen for StridedLines<'_> {
    #[inline(always)]
    fn line(&mut self, index: usize) -> &mut F32x16 {
        assert!(index < F32x16::LANES);
        // SAFETY: `new` has checked the last of the sixteen lines.
        unsafe { self.lines.get_unchecked_mut(index * self.stride) }
    }
}

/// Sixteen rows of lines to write, each of which starts anywhere.
pub(crate) struct RowLines<'a> {
    starts: [*mut F32x16; F32x16::LANES],
    /// Lines of a row that may be written.
    length: usize,
    memory: PhantomData<&'a mut F32x16>,
}

impl RowLines<'_> {
    /// Rows that start anywhere.
    ///
    /// # Safety
    /// `length` lines from each start on can be written for as long as the rows live, and nobody else uses them.
    #[inline(always)]
    pub(super) unsafe fn of_starts(starts: [*mut F32x16; F32x16::LANES], length: usize) -> Self {
        Self {
            starts,
            length,
            memory: PhantomData,
        }
    }

    /// Asks the machine for a line that will be written. It need not exist.
    #[inline(always)]
    pub(crate) fn prefetch(&self, row: usize, index: usize) {
        prefetch_line(self.starts[row].wrapping_add(index));
    }

    /// A line of one row.
    #[inline(always)]
    pub(crate) fn line(&mut self, row: usize, index: usize) -> &mut F32x16 {
        assert!(row < F32x16::LANES && index < self.length);
        // SAFETY: a row's `length` lines are inside the memory that the rows were made of, and no other row has them.
        unsafe { &mut *self.starts[row].add(index) }
    }
}

/// Asks the machine for what will be read. It need not exist.
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

/// Asks the machine for a line that will be written. It need not exist.
#[inline(always)]
pub(crate) fn prefetch_for_write(lines: &[F32x16], index: usize) {
    prefetch_line(lines.as_ptr().wrapping_add(index));
}

/// To the second cache: in the first one, lines that wait to be written would displace those that are computed meanwhile.
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

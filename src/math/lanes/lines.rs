//! Lines of memory that kernels write, and prefetching.

use std::marker::PhantomData;

use super::F32x16;

/// Sixteen rows of lines to write.
pub(crate) struct RowLines<'a> {
    starts: [*mut F32x16; F32x16::LANES],
    /// Lines of a row that may be written.
    length: usize,
    memory: PhantomData<&'a mut F32x16>,
}

impl<'a> RowLines<'a> {
    /// Rows of `length` lines, one after the other.
    ///
    /// # Panics
    /// Where `lines` ends before the last of them.
    #[inline(always)]
    pub(crate) fn new(lines: &'a mut [F32x16], length: usize) -> Self {
        assert!(length <= lines.len() / F32x16::LANES);
        let mut starts = [lines.as_mut_ptr(); F32x16::LANES];
        for (row, start) in starts.iter_mut().enumerate() {
            *start = start.wrapping_add(row * length);
        }
        Self {
            starts,
            length,
            memory: PhantomData,
        }
    }

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

    /// The same rows for a while.
    #[inline(always)]
    pub(crate) fn reborrow(&mut self) -> RowLines<'_> {
        RowLines { ..*self }
    }

    /// Asks the machine for a line that will be written. It need not exist.
    #[inline(always)]
    pub(crate) fn prefetch(&self, row: usize, index: usize) {
        prefetch_for_write(self.starts[row].wrapping_add(index));
    }

    /// A line of one row.
    #[inline(always)]
    pub(crate) fn line(&mut self, row: usize, index: usize) -> &mut F32x16 {
        assert!(row < F32x16::LANES && index < self.length);
        // SAFETY: a row's `length` lines are inside the memory that the rows were made of, and no other row has them.
        unsafe { &mut *self.starts[row].add(index) }
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

/// Asks the machine for memory that will be written. It need not exist.
#[inline(always)]
fn prefetch_for_write(line: *mut F32x16) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_ET0, _mm_prefetch};
        // SAFETY: every x86-64 has SSE; any address may be asked for.
        unsafe { _mm_prefetch::<_MM_HINT_ET0>(line.cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = line;
}

//! Tables of 16-bit keys, as kernels read them.

use std::marker::PhantomData;

use bytemuck::{Pod, Zeroable};

use super::{F32x16, prefetch};

/// Eight consecutive keys of a row: two quads, such as two quaternions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct KeyUnit(pub(crate) [i16; KeyUnit::KEYS]);

impl KeyUnit {
    /// Number of keys of a quad.
    pub(crate) const QUAD: usize = 4;
    /// Number of keys of a unit.
    pub(crate) const KEYS: usize = 2 * Self::QUAD;
}

/// Columns of keys. The first window starts at `start`, each following window `stride` keys after the one before.
#[derive(Clone, Copy)]
pub(crate) struct KeyColumns<'a> {
    pub(crate) table: &'a [i16],
    pub(crate) start: usize,
    pub(crate) stride: usize,
    /// Windows that are read next, for prefetching.
    pub(crate) next: NextColumns,
}

/// Columns of keys to prefetch. They need not be inside the table.
#[derive(Clone, Copy)]
pub(crate) struct NextColumns {
    pub(crate) start: usize,
    pub(crate) stride: usize,
}

impl KeyColumns<'_> {
    /// The table from the first window on. Checks that each of `N` windows has `reach` keys.
    #[inline(always)]
    pub(super) fn reaching<const N: usize>(&self, reach: usize) -> &[i16] {
        const { assert!(N > 0 && N <= 8) };
        let table = &self.table[self.start..];
        // A table has at most 2^62 keys, so eight strides do not overflow.
        assert!(self.stride <= table.len());
        assert!(table.len() >= (N - 1) * self.stride + reach);
        table
    }

    /// Prefetches the cache line of a window that is read next.
    #[inline(always)]
    #[cfg(target_arch = "x86_64")]
    pub(super) fn prefetch_next(&self, index: usize) {
        let next = self.next.start.wrapping_add(index * self.next.stride);
        let first = self.table.as_ptr().wrapping_add(next);
        prefetch(first.wrapping_add(2 * F32x16::LANES - 1));
    }
}

/// A row of keys for each of sixteen lanes, and the row after it.
#[derive(Clone, Copy)]
pub(crate) struct KeyRows<'a> {
    /// The first unit of each lane's row.
    starts: [*const KeyUnit; F32x16::LANES],
    length: usize,
    table: PhantomData<&'a [KeyUnit]>,
}

impl<'a> KeyRows<'a> {
    /// Rows of `length` units, the first of which has the index `starts[lane]` in the table.
    ///
    /// # Panics
    /// If the table ends before the row after a lane's own.
    #[inline(always)]
    pub(crate) fn new(table: &'a [KeyUnit], starts: [u32; F32x16::LANES], length: usize) -> Self {
        let mut last = 0;
        for start in starts {
            last = last.max(start);
        }
        assert!(last as usize + 2 * length <= table.len());
        let mut pointers = [table.as_ptr(); F32x16::LANES];
        for lane in 0..F32x16::LANES {
            pointers[lane] = table.as_ptr().wrapping_add(starts[lane] as usize);
        }
        Self {
            starts: pointers,
            length,
            table: PhantomData,
        }
    }

    /// Rows without units, as a placeholder.
    #[inline(always)]
    pub(crate) fn none(table: &'a [KeyUnit]) -> Self {
        Self {
            starts: [table.as_ptr(); F32x16::LANES],
            length: 0,
            table: PhantomData,
        }
    }

    /// Whether these rows are the placeholder [`KeyRows::none`].
    #[inline(always)]
    pub(crate) fn is_none(&self) -> bool {
        self.length == 0
    }

    /// Prefetches the cache line of a unit in one lane's row, and in the row after it.
    #[inline(always)]
    pub(crate) fn prefetch(&self, lane: usize, unit: usize) {
        let own = self.starts[lane].wrapping_add(unit);
        prefetch(own);
        prefetch(own.wrapping_add(self.length));
    }

    /// Pointers to a unit in one lane's row, and in the row after it. Both are inside the table.
    #[inline(always)]
    #[cfg(target_arch = "x86_64")]
    pub(super) fn pointers(&self, lane: usize, unit: usize) -> [*const KeyUnit; 2] {
        assert!(unit < self.length);
        let own = self.starts[lane].wrapping_add(unit);
        [own, own.wrapping_add(self.length)]
    }

    /// A unit of one lane's row, and of the row after it.
    #[inline(always)]
    #[cfg(any(test, not(target_arch = "x86_64")))]
    pub(super) fn units(&self, lane: usize, unit: usize) -> [&'a KeyUnit; 2] {
        assert!(unit < self.length);
        let own = self.starts[lane].wrapping_add(unit);
        // SAFETY: `new` has checked that the table has all units of both rows.
        unsafe { [&*own, &*own.add(self.length)] }
    }
}

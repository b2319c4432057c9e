//! Memory that kernels read and write: tables of 16-bit keys, and rows of [`F32x16`]s that are written side by side.

use std::marker::PhantomData;

use bytemuck::{Pod, Zeroable};

use super::F32x16;

/// Eight consecutive keys of a row: two quads, such as two quaternions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct KeyUnit(pub(crate) [i16; KeyUnit::KEYS]);

impl KeyUnit {
    pub(crate) const QUAD: usize = 4;
    pub(crate) const KEYS: usize = 2 * Self::QUAD;
}

/// Position of a key in each column.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeyPlace {
    /// Index of the key in the first column.
    pub(crate) first: usize,
    /// Number of keys from the start of one column to the start of the next.
    pub(crate) stride: usize,
}

impl KeyPlace {
    #[inline(always)]
    pub(crate) fn column(self, column: usize) -> Self {
        let first = self.first.wrapping_add(column.wrapping_mul(self.stride));
        Self { first, ..self }
    }
}

/// Columns of keys, of which windows are read.
#[derive(Clone, Copy)]
pub(crate) struct KeyColumns<'a> {
    pub(crate) table: &'a [i16],
    /// First keys of the windows.
    pub(crate) at: KeyPlace,
    /// First keys of the windows that are read next, for prefetching. They need not be inside the table.
    pub(crate) next: KeyPlace,
}

impl<'a> KeyColumns<'a> {
    pub(crate) const WINDOW: usize = 2 * F32x16::LANES;
    pub(crate) const WIDE_WINDOW: usize = 2 * Self::WINDOW;

    /// The windows of `N` columns. Prefetches those that are read next, which are too far apart for hardware to predict.
    ///
    /// # Panics
    /// If the table ends before the last window does.
    #[inline(always)]
    pub(super) fn windows<const KEYS: usize, const N: usize>(&self) -> [&'a [i16; KEYS]; N] {
        const { assert!(N > 0 && N <= 8) };
        let (table, stride) = (&self.table[self.at.first..], self.at.stride);
        // A table has at most 2^62 keys, so eight strides do not overflow.
        assert!(stride <= table.len());
        assert!(table.len() >= (N - 1) * stride + KEYS);
        let mut windows = [&[0; KEYS]; N];
        for (column, window) in windows.iter_mut().enumerate() {
            let next = self.table.as_ptr();
            let next = next.wrapping_add(self.next.column(column).first);
            prefetch::<TO_READ, _>(next.wrapping_add(Self::WINDOW - 1));
            // SAFETY: the table has been found to reach to the end of the last window.
            *window = unsafe { &*table.as_ptr().add(column * stride).cast() };
        }
        windows
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
        prefetch::<TO_READ, _>(own);
        prefetch::<TO_READ, _>(own.wrapping_add(self.length));
    }

    /// A unit of one lane's row, and of the row after it.
    #[inline(always)]
    pub(super) fn units(&self, lane: usize, unit: usize) -> [&'a KeyUnit; 2] {
        assert!(unit < self.length);
        let own = self.starts[lane].wrapping_add(unit);
        // SAFETY: `new` has checked that the table has all units of both rows.
        unsafe { [&*own, &*own.add(self.length)] }
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
    /// Prefetches an [`F32x16`] that will be written. It need not exist.
    #[inline(always)]
    pub(crate) fn prefetch(&self, row: usize, index: usize) {
        prefetch::<TO_WRITE, F32x16>(self.starts[row].wrapping_add(index));
    }

    /// An [`F32x16`] of one row.
    #[inline(always)]
    pub(crate) fn line(&mut self, row: usize, index: usize) -> &mut F32x16 {
        assert!(row < F32x16::LANES && index < self.length);
        // SAFETY: a row's `length` lines are inside the memory that the rows were made of, and no row of another lane has them but the spare
        // one, of which no two lines are borrowed at once.
        unsafe { &mut *self.starts[row].add(index) }
    }
}

/// For [`prefetch`]: an element that will be read soon.
const TO_READ: i32 = 3;
/// For [`prefetch`]: an element that will be written, to the second-level cache. In the first-level cache, memory that waits to be written
/// would displace memory that is in use.
const TO_WRITE: i32 = 2;

/// Prefetches an element. It need not exist.
#[inline(always)]
fn prefetch<const HINT: i32, T>(element: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: every x86-64 has SSE; any address may be asked for.
    unsafe {
        std::arch::x86_64::_mm_prefetch::<HINT>(element.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = element;
}

/// Row numbers at positions. Each row is at one position at most.
#[derive(Clone, Debug, Default)]
pub(crate) struct DistinctRows {
    /// Row at each position; [`DistinctRows::NONE`] if there is none.
    rows: Vec<u32>,
    /// Whether each row is at a position.
    is_used: Vec<bool>,
}

impl DistinctRows {
    /// Marks a position without a row.
    const NONE: u32 = u32::MAX;

    /// Empties all positions. Rows below `rows` can then be put in.
    pub(crate) fn reset(&mut self, rows: usize) {
        self.rows.clear();
        self.is_used.clear();
        self.is_used.resize(rows, false);
    }

    pub(crate) fn reserve(&mut self, positions: usize, rows: usize) {
        self.rows.reserve(positions.saturating_sub(self.rows.len()));
        self.is_used
            .reserve(rows.saturating_sub(self.is_used.len()));
    }

    /// Rows below `rows` can be put in from now on.
    pub(crate) fn grow(&mut self, rows: usize) {
        if self.is_used.len() < rows {
            self.is_used.resize(rows, false);
        }
    }

    /// Puts a row at a position and removes the one that was there.
    ///
    /// # Panics
    /// If the row is at another position, or is not below the number of rows.
    pub(crate) fn put(&mut self, position: usize, row: u32) {
        self.remove(position);
        if position >= self.rows.len() {
            self.rows.resize(position + 1, Self::NONE);
        }
        let is_used = &mut self.is_used[row as usize];
        assert!(!*is_used, "row {row} is at two positions");
        *is_used = true;
        self.rows[position] = row;
    }

    /// Removes the row at a position, if there is one.
    pub(crate) fn remove(&mut self, position: usize) {
        if let Some(row) = self.rows.get_mut(position) {
            if let Some(is_used) = self.is_used.get_mut(*row as usize) {
                *is_used = false;
            }
            *row = Self::NONE;
        }
    }
}

/// The rows of a buffer at some of the positions of [`DistinctRows`].
pub(crate) struct RowSet<'a> {
    start: *mut F32x16,
    /// Length of a row, in [`F32x16`]s.
    length: usize,
    /// Distinct row numbers inside the buffer, or [`DistinctRows::NONE`].
    rows: &'a [u32],
    memory: PhantomData<&'a mut [F32x16]>,
}

// SAFETY: it is a mutable reference to rows that nobody else has.
unsafe impl Send for RowSet<'_> {}

impl<'a> RowSet<'a> {
    /// All rows, of `length` [`F32x16`]s each.
    ///
    /// # Panics
    /// If the buffer is too small for all rows that can be put in.
    pub(crate) fn new(memory: &'a mut [F32x16], length: usize, rows: &'a DistinctRows) -> Self {
        assert!(rows.is_used.len() * length <= memory.len());
        Self {
            start: memory.as_mut_ptr(),
            length,
            rows: &rows.rows,
            memory: PhantomData,
        }
    }

    /// Splits off the rows at the first `positions` positions.
    pub(crate) fn split_off_front(&mut self, positions: usize) -> Self {
        let (front, rest) = self.rows.split_at(positions.min(self.rows.len()));
        self.rows = rest;
        Self {
            rows: front,
            ..*self
        }
    }

    /// The rows at sixteen positions from `position` on; `spare` for positions without a row.
    ///
    /// # Panics
    /// If `spare` is shorter than a row.
    #[inline(always)]
    pub(crate) fn sixteen<'b>(
        &'b mut self,
        position: usize,
        spare: &'b mut [F32x16],
    ) -> RowLines<'b> {
        assert!(self.length <= spare.len());
        let mut starts = [spare.as_mut_ptr(); F32x16::LANES];
        let rows = self.rows.get(position..).unwrap_or_default();
        for (start, &row) in starts.iter_mut().zip(rows) {
            if row != DistinctRows::NONE {
                *start = self.start.wrapping_add(row as usize * self.length);
            }
        }
        // `new` has checked that all rows are inside the memory; they are distinct.
        RowLines {
            starts,
            length: self.length,
            memory: PhantomData,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_write_rows_of_their_own() {
        let mut rows = DistinctRows::default();
        rows.reset(40);
        for position in 0..32 {
            if position != 5 {
                rows.put(position, (position * 7 % 40) as u32);
            }
        }
        rows.put(3, 24);
        let mut memory = vec![F32x16::ZERO; 40 * 2];
        let mut second = RowSet::new(&mut memory, 2, &rows);
        let first = second.split_off_front(16);
        std::thread::scope(|scope| {
            for (number, mut set) in [(1.0, first), (2.0, second)] {
                scope.spawn(move || {
                    let mut spare = [F32x16::ZERO; 2];
                    let mut lines = set.sixteen(0, &mut spare);
                    for lane in 0..16 {
                        lines.line(lane, 1).0[0] = number;
                    }
                });
            }
        });
        for row in 0..40 {
            let position = (0..32).find(|&position| position != 3 && position * 7 % 40 == row);
            let expected = match position {
                _ if row == 24 => 1.0,
                Some(5) | None => 0.0,
                Some(position) if position < 16 => 1.0,
                Some(_) => 2.0,
            };
            assert_eq!(memory[2 * row + 1].0[0], expected, "row {row}");
            assert_eq!(memory[2 * row], F32x16::ZERO);
        }
    }

    #[test]
    #[should_panic(expected = "row 3 is at two positions")]
    fn no_row_is_at_two_positions() {
        let mut rows = DistinctRows::default();
        rows.reset(4);
        rows.put(0, 3);
        rows.remove(0);
        rows.put(1, 3);
        rows.put(2, 3);
    }
}

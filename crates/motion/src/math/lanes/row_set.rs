//! Rows of one buffer that several threads write, each row by one of them.

use std::marker::PhantomData;

use super::{F32x16, RowLines};

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

    /// Reserves memory for `positions` positions and `rows` rows.
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
        // SAFETY: `new` has checked that all rows are inside the memory; they are distinct.
        unsafe { RowLines::of_starts(starts, self.length) }
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

//! Transposes squares of bits.

/// Number of rows and number of columns of a square. A row is a word with a bit for each column.
pub(crate) const SIDE: usize = 32;

/// Returns the transposed square of some words: bit `i` of word `k` becomes bit `k` of word `i`. Missing words are 0.
pub(crate) fn transposed(words: impl Iterator<Item = u32>) -> [u32; SIDE] {
    let mut square = [0; SIDE];
    for (row, word) in square.iter_mut().zip(words) {
        *row = word;
    }
    transpose(&mut square);
    square
}

/// Transposes a square in place.
///
/// Source: Warren, Hacker's Delight, section 7-3: blocks off the diagonal are exchanged, from halves down to single bits.
fn transpose(words: &mut [u32; SIDE]) {
    let mut mask = u32::MAX;
    for side in [16, 8, 4, 2, 1] {
        mask ^= mask << side;
        for first in (0..SIDE).step_by(2 * side) {
            let (low, high) = words[first..first + 2 * side].split_at_mut(side);
            for (low, high) in low.iter_mut().zip(high) {
                let changed = (*low >> side ^ *high) & mask;
                *low ^= changed << side;
                *high ^= changed;
            }
        }
    }
}

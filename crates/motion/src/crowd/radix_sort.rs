//! Radix sort, least significant digit first: linear in the number of keys, and the same time whatever their order.
//!
//! Source: Knuth, "The Art of Computer Programming", volume 3, section 5.2.5, algorithm R. Differs: keys are arrays that are
//! copied between two buffers, not linked lists, so each pass first counts the keys of each digit (as algorithm 5.2D does).

use std::ops::Range;

/// Number of bits of a digit, by which one pass sorts.
pub(super) const DIGIT: u32 = 11;
const VALUES: usize = 1 << DIGIT;

/// Sorts keys by the bits in `bits`; equal ones stay in their order. `spare` may have any length and content.
pub(super) fn sort(keys: &mut Vec<u64>, spare: &mut Vec<u64>, bits: Range<u32>) {
    spare.resize(keys.len(), 0);
    for shift in bits.clone().step_by(DIGIT as usize) {
        let width = DIGIT.min(bits.end - shift);
        let digit = |key: u64| (key >> shift) as usize & ((1 << width) - 1);
        let mut places = [0u32; VALUES];
        for &key in keys.iter() {
            places[digit(key)] += 1;
        }
        let mut sum = 0;
        for place in &mut places {
            sum += std::mem::replace(place, sum);
        }
        for &key in keys.iter() {
            let place = &mut places[digit(key)];
            spare[*place as usize] = key;
            *place += 1;
        }
        std::mem::swap(keys, spare);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_the_library_sorts() {
        let mut state = 1u64;
        let mut random = || {
            state ^= state >> 12;
            state ^= state << 25;
            state ^= state >> 27;
            state.wrapping_mul(0x2545_F491_4F6C_DD1D)
        };
        let mut spare = Vec::new();
        for count in [0, 1, 2, 100, 5000] {
            for (low, high) in [(0, 64), (28, 42), (28, 64), (3, 3), (5, 6)] {
                let mut keys: Vec<u64> = (0..count).map(|_| random() >> (count % 7)).collect();
                let mut expected = keys.clone();
                let mask = (1u128 << high) - (1u128 << low);
                expected.sort_by_key(|&key| u128::from(key) & mask);
                sort(&mut keys, &mut spare, low..high);
                assert_eq!(keys, expected, "{count} keys, bits {low} to {high}");
            }
        }
    }
}

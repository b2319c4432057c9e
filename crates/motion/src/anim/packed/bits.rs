//! Codes of few bits, one after another.

/// The code of `width` bits, at most 24, that begins at a bit. Four bytes from its first one on are read.
#[inline(always)]
pub(super) fn code(bytes: &[u8], bit: usize, width: u8) -> i32 {
    let mut word = [0; 4];
    word.copy_from_slice(&bytes[bit / 8..bit / 8 + 4]);
    (u32::from_le_bytes(word) >> (bit % 8) & ((1 << width) - 1)) as i32
}

/// Number of bits of codes from 0 to `range`.
pub(super) fn width_of(range: u32) -> u8 {
    (u32::BITS - range.leading_zeros()) as u8
}

/// Appends codes to bytes, bit by bit from the lowest.
#[derive(Debug, Default)]
pub(super) struct BitWriter {
    bytes: Vec<u8>,
    /// Bits that fill no byte yet.
    rest: u64,
    bits: u32,
}

impl BitWriter {
    pub(super) fn push(&mut self, code: u32, width: u8) {
        self.rest |= u64::from(code) << self.bits;
        self.bits += u32::from(width);
        while self.bits >= 8 {
            self.bytes.push(self.rest as u8);
            self.rest >>= 8;
            self.bits -= 8;
        }
    }

    /// Fills the last byte with zeros.
    pub(super) fn align(&mut self) {
        if self.bits > 0 {
            self.push(0, (8 - self.bits) as u8);
        }
    }

    pub(super) fn extend(&mut self, bytes: &[u8]) {
        self.align();
        self.bytes.extend_from_slice(bytes);
    }

    pub(super) fn finish(mut self) -> Vec<u8> {
        self.align();
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn codes_come_back(
            codes in prop::collection::vec((0u32..1 << 24, 0u8..=24), 0..50),
            before in 0usize..20,
        ) {
            let cut = |(code, width): (u32, u8)| (code & ((1u32 << width) - 1), width);
            let codes: Vec<(u32, u8)> = codes.into_iter().map(cut).collect();
            let mut writer = BitWriter::default();
            writer.extend(&vec![0xa5; before]);
            for &(code, width) in &codes {
                writer.push(code, width);
            }
            let mut bytes = writer.finish();
            let mut bit = 8 * before;
            let bits: usize = codes.iter().map(|&(_, width)| usize::from(width)).sum();
            prop_assert_eq!(bytes.len(), before + bits.div_ceil(8));
            bytes.resize(bytes.len() + 4, 0xff);
            for (expected, width) in codes {
                prop_assert_eq!(code(&bytes, bit, width) as u32, expected);
                bit += usize::from(width);
            }
        }
    }

    #[test]
    fn widths_are_the_smallest() {
        let cases = [
            (0, 0),
            (1, 1),
            (2, 2),
            (3, 2),
            (4, 3),
            (255, 8),
            (256, 9),
            (u32::MAX, 32),
        ];
        for (range, width) in cases {
            assert_eq!(width_of(range), width);
        }
    }
}

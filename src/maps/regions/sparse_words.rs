//! Serializes lists of words that are mostly 0 as few bytes that are fast to read. For `#[serde(with = "sparse_words")]`.
//!
//! Source: run-length coding of zeros (S. Golomb, "Run-length encodings", 1966). Differs: counts take a byte each, and the words between
//! runs of zeros are copied as they are. Human-readable formats store the list of words.
//!
//! ```text
//! run   number of zeros, 1 byte, at most 24
//!       number of words, 1 byte
//!       the words, u32 little-endian
//! ```
//! A run of zeros is so short that a list takes at most 48 times the memory of its bytes.

use std::fmt;

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Maximum number of zeros in a run.
const MOST_ZEROS: usize = 24;
/// Maximum number of words in a run.
const MOST_WORDS: usize = 255;

pub(crate) fn serialize<S: Serializer>(words: &[u32], serializer: S) -> Result<S::Ok, S::Error> {
    if serializer.is_human_readable() {
        return words.serialize(serializer);
    }
    serializer.serialize_bytes(&packed(words))
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<u32>, D::Error> {
    if deserializer.is_human_readable() {
        return Vec::deserialize(deserializer);
    }
    deserializer.deserialize_bytes(RunVisitor)
}

fn packed(words: &[u32]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut left = words;
    while !left.is_empty() {
        let zeros = left.iter().take(MOST_ZEROS).take_while(|&&word| word == 0);
        let (_, rest) = left.split_at(zeros.count());
        let count = rest.iter().take(MOST_WORDS).take_while(|&&word| word != 0);
        let (own, rest_of_all) = rest.split_at(count.count());
        bytes.extend([(left.len() - rest.len()) as u8, own.len() as u8]);
        bytes.extend(own.iter().flat_map(|word| word.to_le_bytes()));
        left = rest_of_all;
    }
    bytes
}

/// The runs of some bytes: number of zeros, and the words after them. `None` is an invalid run, which ends the iterator.
fn runs(bytes: &[u8]) -> impl Iterator<Item = Option<(usize, &[[u8; 4]])>> {
    let mut left = Some(bytes).filter(|bytes| !bytes.is_empty());
    std::iter::from_fn(move || {
        let bytes = left.take()?;
        let run = || {
            let (&[zeros, words], rest) = bytes.split_first_chunk()?;
            let (words, rest) = rest.split_at_checked(4 * usize::from(words))?;
            let is_sound = usize::from(zeros) <= MOST_ZEROS;
            is_sound.then(|| (usize::from(zeros), words.as_chunks().0, rest))
        };
        Some(run().map(|(zeros, words, rest)| {
            left = Some(rest).filter(|bytes| !bytes.is_empty());
            (zeros, words)
        }))
    })
}

fn unpacked(bytes: &[u8]) -> Option<Vec<u32>> {
    let mut count = 0;
    for run in runs(bytes) {
        let (zeros, words) = run?;
        count += zeros + words.len();
    }
    // The list takes no more memory than the module promises.
    let mut out = Vec::with_capacity(count);
    for (zeros, words) in runs(bytes).flatten() {
        out.resize(out.len() + zeros, 0);
        out.extend(words.iter().map(|&word| u32::from_le_bytes(word)));
    }
    Some(out)
}

struct RunVisitor;

impl Visitor<'_> for RunVisitor {
    type Value = Vec<u32>;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "runs of words")
    }

    fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Vec<u32>, E> {
        unpacked(bytes).ok_or_else(|| E::invalid_length(bytes.len(), &self))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn any_bytes_take_a_bounded_memory(bytes in prop::collection::vec(0u8.., 0..200)) {
            if let Some(words) = unpacked(&bytes) {
                prop_assert!(4 * words.len() <= 48 * bytes.len());
            }
        }
    }

    #[test]
    fn what_ends_within_a_run_is_refused() {
        let bytes = packed(&[0, 0, 7, 8, 0]);
        assert_eq!(bytes, [2, 2, 7, 0, 0, 0, 8, 0, 0, 0, 1, 0]);
        assert!(unpacked(&bytes).is_some());
        for length in [1, 3, 9, 11] {
            assert_eq!(unpacked(&bytes[..length]), None, "{length}");
        }
        assert_eq!(unpacked(&[25, 0]), None);
    }
}

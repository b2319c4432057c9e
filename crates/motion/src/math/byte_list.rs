//! Serializes lists of small values of one size. Binary formats store such a list as one run of its bytes in memory, which is read many
//! times faster than value by value. Human-readable formats store a list of values. For `#[serde(with = "byte_list")]`.

use std::fmt;
use std::marker::PhantomData;

use bytemuck::Pod;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[cfg(target_endian = "big")]
compile_error!("files hold the bytes of little-endian machines");

/// Writes a list: as bytes, or as a list of values in human-readable formats.
///
/// # Errors
/// The serializer's errors.
pub fn serialize<T, S>(list: &[T], serializer: S) -> Result<S::Ok, S::Error>
where
    T: Pod + Serialize,
    S: Serializer,
{
    if serializer.is_human_readable() {
        return list.serialize(serializer);
    }
    serializer.serialize_bytes(bytemuck::cast_slice(list))
}

/// Reads a list that [`serialize`] wrote.
///
/// # Errors
/// The number of bytes does not fit the size of a value, or the deserializer's.
pub fn deserialize<'de, T, D>(deserializer: D) -> Result<Vec<T>, D::Error>
where
    T: Pod + Deserialize<'de>,
    D: Deserializer<'de>,
{
    if deserializer.is_human_readable() {
        return Vec::deserialize(deserializer);
    }
    deserializer.deserialize_bytes(ByteVisitor(PhantomData))
}

struct ByteVisitor<T>(PhantomData<T>);

impl<T: Pod> Visitor<'_> for ByteVisitor<T> {
    type Value = Vec<T>;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "bytes, {} for each value", size_of::<T>())
    }

    fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Vec<T>, E> {
        let values = bytes.chunks_exact(size_of::<T>());
        if values.remainder().is_empty() {
            Ok(values.map(bytemuck::pod_read_unaligned).collect())
        } else {
            Err(E::invalid_length(bytes.len(), &self))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Lists {
        #[serde(with = "super")]
        bytes: Vec<u8>,
        #[serde(with = "super")]
        words: Vec<u32>,
    }

    #[test]
    fn a_list_is_read_as_it_was_written_by_each_kind_of_format() {
        let lists = Lists {
            bytes: vec![0, 1, 255],
            words: vec![7, u32::MAX, 1 << 20],
        };
        let bytes = postcard::to_allocvec(&lists).unwrap();
        assert_eq!(bytes.len(), 1 + 3 + 1 + 12);
        assert_eq!(postcard::from_bytes::<Lists>(&bytes).unwrap(), lists);
        let text = serde_json::to_string(&lists).unwrap();
        assert!(text.contains("[7,4294967295,1048576]"), "{text}");
        assert_eq!(serde_json::from_str::<Lists>(&text).unwrap(), lists);
        // A list that ends in the middle of a value.
        let mut short = bytes;
        short[4] = 11;
        assert!(postcard::from_bytes::<Lists>(&short).is_err());
    }
}

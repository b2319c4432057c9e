//! Serializes the parts of a file one by one, so that they can be read in parallel.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Serializes a part.
pub(crate) fn to_bytes<T: Serialize + ?Sized>(part: &T) -> Result<Vec<u8>, postcard::Error> {
    postcard::to_extend(part, Vec::new())
}

/// Reads a part. It must use all bytes.
pub(crate) fn from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let (part, rest) = postcard::take_from_bytes(bytes).map_err(|error| error.to_string())?;
    match rest.len() {
        0 => Ok(part),
        left => Err(format!("{left} bytes follow its end")),
    }
}

//! Reads files as bytes, up to the maximum size, and JSON.

use std::io::Read;
use std::path::Path;

use sabaki::archive::{LARGEST_FILE, open_regular};
use serde::de::DeserializeOwned;
use thiserror::Error;
use unicode_normalization::UnicodeNormalization;

use crate::ReadError;

/// Name of a clip: its file's name without the folder.
pub(super) fn clip_name(path: &Path) -> String {
    composed(
        &path
            .file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy(),
    )
}

/// A name with composed characters (Unicode's form NFC), so that names of files that macOS decomposed equal those that were typed.
pub(super) fn composed(name: &str) -> String {
    name.nfc().collect()
}

pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    let io = |source| ReadError::Io {
        path: path.to_owned(),
        source,
    };
    let mut bytes = Vec::new();
    let file = open_regular(path).map_err(io)?;
    file.take(LARGEST_FILE + 1)
        .read_to_end(&mut bytes)
        .map_err(io)?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(ReadError::TooLarge {
            path: path.to_owned(),
        });
    }
    Ok(bytes)
}

/// A text without the byte order mark that editors may write before it.
#[must_use]
pub fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix("\u{FEFF}".as_bytes()).unwrap_or(text)
}

/// An error in a JSON text, with its position.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}, column {column}: {message}")]
pub struct JsonError {
    /// Line number, from 1, or 0 if the text is empty.
    pub line: usize,
    /// Column, from 1, or 0 at the end of a line.
    pub column: usize,
    /// Description of the error.
    pub message: String,
}

impl From<serde_json::Error> for JsonError {
    fn from(error: serde_json::Error) -> Self {
        let (line, column) = (error.line(), error.column());
        let text = error.to_string();
        let place = format!(" at line {line} column {column}");
        let message = text.strip_suffix(&place).unwrap_or(&text).to_owned();
        Self {
            line,
            column,
            message,
        }
    }
}

/// Parses a document, with or without a byte order mark.
pub(super) fn parse_json<T: DeserializeOwned>(text: &[u8]) -> Result<T, JsonError> {
    serde_json::from_slice(without_mark(text)).map_err(JsonError::from)
}

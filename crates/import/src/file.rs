//! Reads files as bytes, up to the maximum size, and JSON.

use std::io::Read;
use std::path::Path;

use sabaki::archive::{LARGEST_FILE, open_regular};
use serde::de::DeserializeOwned;
use thiserror::Error;
use unicode_normalization::UnicodeNormalization;

use crate::{FileError, ReadError};

/// Name of a clip: its file's name without the folder.
pub(super) fn clip_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    composed(&name.to_string_lossy())
}

/// A name with composed characters (Unicode's form NFC), so that names of files that macOS decomposed equal those that were typed.
pub(super) fn composed(name: &str) -> String {
    name.nfc().collect()
}

pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    let file = open_regular(path).map_err(ReadError::in_file(path))?;
    file.take(LARGEST_FILE + 1)
        .read_to_end(&mut bytes)
        .map_err(ReadError::in_file(path))?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(ReadError::in_file(path)(FileError::Invalid(format!(
            "larger than {} MB",
            LARGEST_FILE / 1_000_000
        ))));
    }
    Ok(bytes)
}

/// A text without the byte order mark that editors may write before it.
#[must_use]
pub fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix("\u{FEFF}".as_bytes()).unwrap_or(text)
}

/// An error in a text, with its position.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}{}: {message}", column.map_or_else(String::new, |column| format!(", column {column}")))]
pub struct TextError {
    /// Line number, from 1, or 0 if a JSON text is empty. Lines end with LF, CR LF or, except in JSON, CR.
    pub line: usize,
    /// Column, from 1, or 0 at the end of a line of JSON; `None` in ASF and AMC files. A byte order mark does not count.
    pub column: Option<usize>,
    /// Description of the error.
    pub message: String,
}

impl From<serde_json::Error> for TextError {
    fn from(error: serde_json::Error) -> Self {
        let (line, column) = (error.line(), error.column());
        let text = error.to_string();
        let place = format!(" at line {line} column {column}");
        let message = text.strip_suffix(&place).unwrap_or(&text).to_owned();
        Self {
            line,
            column: Some(column),
            message,
        }
    }
}

/// A quoted text for an error message, shortened to 40 characters.
pub(crate) fn quoted(text: &str) -> String {
    const MOST: usize = 40;
    let short = text.chars().take(MOST).flat_map(char::escape_debug);
    let short: String = short.collect();
    let more = if text.chars().nth(MOST).is_some() {
        "…"
    } else {
        ""
    };
    format!("\"{short}{more}\"")
}

/// Parses a document, with or without a byte order mark.
pub(super) fn parse_json<T: DeserializeOwned>(text: &[u8]) -> Result<T, TextError> {
    serde_json::from_slice(without_mark(text)).map_err(TextError::from)
}

use serde::de::DeserializeOwned;
use thiserror::Error;

use crate::file::without_mark;

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
pub(super) fn parse<T: DeserializeOwned>(text: &[u8]) -> Result<T, JsonError> {
    serde_json::from_slice(without_mark(text)).map_err(JsonError::from)
}

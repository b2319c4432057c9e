use serde::de::DeserializeOwned;
use thiserror::Error;

/// Why a text is not the JSON that it should be, and where.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}, column {column}: {message}")]
pub struct JsonError {
    /// From 1; 0 where the text is empty.
    pub line: usize,
    /// From 1; 0 at a line's end.
    pub column: usize,
    /// What was expected or found.
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

/// Reads a document, with or without the byte order mark that some editors put before it.
pub(super) fn parse<T: DeserializeOwned>(text: &[u8]) -> Result<T, JsonError> {
    let text = text.strip_prefix("\u{FEFF}".as_bytes()).unwrap_or(text);
    serde_json::from_slice(text).map_err(JsonError::from)
}

//! Errors of exported answers.

use thiserror::Error;

use crate::json::JsonError;
use sabaki::query::{AttackError, QuerySettingsError};

/// Reason why a file is not a recording, or cannot be replayed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RecordingError {
    /// The text is not a valid exported answer.
    #[error(transparent)]
    Json(#[from] JsonError),
    /// The attack is invalid.
    #[error(transparent)]
    Attack(#[from] AttackError),
    /// A setting is out of range.
    #[error(transparent)]
    Settings(#[from] QuerySettingsError),
    /// The recording belongs to another graph.
    #[error(
        "it was answered on the graph {expected:08x}, and this one is {found:08x}: name the baked graph that it was exported from"
    )]
    Graph {
        /// Checksum of the recording's graph.
        expected: u32,
        /// Checksum of the given graph.
        found: u32,
    },
    /// The graph does not have the playhead's edge or frame.
    #[error("the playhead is no place of the graph")]
    Playhead,
    /// The checksum of the graph cannot be computed, because memory is exhausted.
    #[error("the graph cannot be named: {0}")]
    Unnamed(String),
}

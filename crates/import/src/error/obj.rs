//! Errors of OBJ files.

use thiserror::Error;

use crate::fit::MeshError;

/// Reason why an OBJ file cannot be read.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ObjError {
    /// The text is not valid OBJ. The message is that of the parser, which does not report lines.
    #[error("not an OBJ mesh: {0}")]
    Text(String),
    /// A corner of a face refers to no vertex.
    #[error("line {line}: a face's corner names vertex \"{found}\"")]
    Corner {
        /// Line number, from 1.
        line: usize,
        /// The corner as written, without texture and normal.
        found: String,
    },
    /// The mesh is invalid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

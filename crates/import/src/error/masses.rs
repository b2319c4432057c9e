//! Errors of files of masses.

use thiserror::Error;

use crate::json::JsonError;

/// Reason why a file of masses cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MassFileError {
    /// The text is not a valid file of masses.
    #[error(transparent)]
    Json(#[from] JsonError),
    /// The skeleton has no such joint.
    #[error("the skeleton has no joint \"{0}\"")]
    UnknownJoint(String),
    /// A mass is negative or infinite.
    #[error("joint \"{joint}\": a mass of {kilograms} kg is not possible")]
    Mass {
        /// Name of the joint.
        joint: String,
        /// Mass, in kilograms.
        kilograms: f32,
    },
}

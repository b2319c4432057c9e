//! Errors of body files.

use thiserror::Error;

use crate::json::JsonError;

/// Reason why a body file cannot be used. Spheres are counted from 0.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum BodyFileError {
    /// The text is not a valid body file.
    #[error(transparent)]
    Json(#[from] JsonError),
    /// The file has no sphere.
    #[error("the file holds no sphere")]
    NoSphere,
    /// A field is missing.
    #[error("sphere {sphere}{}: no {field}", of(joint))]
    Missing {
        /// Index of the sphere.
        sphere: usize,
        /// Name of the sphere's joint, or empty if it has none.
        joint: String,
        /// Name of the field.
        field: &'static str,
    },
    /// A field has an invalid value.
    #[error("sphere {sphere}{}: {field} is {found}; {wanted}", of(joint))]
    Field {
        /// Index of the sphere.
        sphere: usize,
        /// Name of its joint.
        joint: String,
        /// Name of the field.
        field: &'static str,
        /// Description of the value.
        found: String,
        /// Description of valid values.
        wanted: String,
    },
    /// Several joints of the clips' file have that name.
    #[error(
        "sphere {sphere}: several joints are called \"{joint}\"; name one of them, as \"{joint}_2\", or rename them in the file"
    )]
    Ambiguous {
        /// Index of the sphere.
        sphere: usize,
        /// Name of the joint, as written.
        joint: String,
    },
    /// The skeleton has no joint of this name.
    #[error("sphere {sphere}: the skeleton has no joint \"{joint}\"")]
    UnknownJoint {
        /// Index of the sphere.
        sphere: usize,
        /// Name of the joint.
        joint: String,
    },
}

fn of(joint: &str) -> String {
    match joint {
        "" => String::new(),
        joint => format!(" (joint \"{joint}\")"),
    }
}

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::ReadError;
use super::json::{self, JsonError};
use super::read::read_bytes;
use sabaki::anim::Skeleton;
use sabaki::lod::Masses;

/// A file of joint masses: `{"masses": {"LeftArm": 2.1, ...}}`, in kilograms. A joint's mass is
/// that of the bones that start at it. Joints that are not named have no mass.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MassFile {
    /// Masses by joint name, in kilograms.
    pub masses: BTreeMap<String, f32>,
}

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

impl MassFile {
    /// Reads a file.
    ///
    /// # Errors
    /// The first error, with the file and the position in it.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        json::parse(&read_bytes(path)?).map_err(|error| ReadError::Masses {
            path: path.to_owned(),
            error: error.into(),
        })
    }

    /// Masses of a skeleton's joints.
    ///
    /// # Errors
    /// The skeleton does not have a joint, or a mass is invalid.
    pub fn resolve(&self, skeleton: &Skeleton) -> Result<Masses, MassFileError> {
        let mut masses = vec![0.0; skeleton.len()];
        for (joint, &kilograms) in &self.masses {
            let id = skeleton
                .find(joint)
                .ok_or_else(|| MassFileError::UnknownJoint(joint.clone()))?;
            if !(kilograms.is_finite() && kilograms >= 0.0) {
                let joint = joint.clone();
                return Err(MassFileError::Mass { joint, kilograms });
            }
            masses[id.index()] = kilograms;
        }
        Ok(Masses::Given(masses))
    }
}

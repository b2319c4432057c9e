use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::{MassFileError, ReadError};
use super::file::read_bytes;
use super::json;
use sabaki::anim::Skeleton;
use sabaki::lod::Masses;

/// A file of joint masses: `{"masses": {"LeftArm": 2.1, ...}}`, in kilograms. A joint's mass is
/// that of the bones that start at it. Joints that are not named have no mass.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MassFile {
    /// Masses by joint name, in kilograms.
    pub masses: BTreeMap<String, f32>,
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

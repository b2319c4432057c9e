//! Files about bodies: spheres on joints, and masses of joints. Joints are identified by name.

use std::collections::BTreeMap;
use std::path::Path;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::events::several_joints;
use crate::file::{parse_json, read_bytes};
use crate::{FileError, ReadError};
use sabaki::anim::Skeleton;
use sabaki::lod::Masses;
use sabaki::maps::{Body, BodySphere};

/// A body file: `{"spheres": [{"joint": "LeftHand", "offset": [x, y, z], "radius": 0.05}, ...]}`,
/// in metres, in the joint's frame. The object may also be under the key `body`, as in files that
/// [`super::export`] writes. Unknown keys are ignored.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyFile {
    /// Spheres, in the order of the file.
    pub spheres: Vec<BodyEntry>,
}

/// One sphere.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyEntry {
    /// Name of the joint whose frame it moves with.
    pub joint: String,
    /// Position of the centre in the joint's frame, in metres.
    pub offset: Vec3,
    /// Radius, in metres.
    pub radius: f32,
}

/// The spheres of a file, which may be an exported answer.
#[derive(Deserialize)]
struct Stored {
    spheres: Option<Vec<BodyEntry>>,
    body: Option<BodyFile>,
}

impl BodyFile {
    /// Parses and checks JSON text.
    ///
    /// # Errors
    /// The first error, with line and column, or with the sphere, its joint and the field.
    pub fn parse(text: &[u8]) -> Result<Self, FileError> {
        let Stored { spheres, body } = parse_json(text)?;
        let spheres = spheres.or(body.map(|body| body.spheres));
        let spheres = spheres.unwrap_or_default();
        if spheres.is_empty() {
            return Err(FileError::invalid("the file holds no sphere"));
        }
        for (index, entry) in spheres.iter().enumerate() {
            let (offset, radius, furthest) = (entry.offset, entry.radius, Skeleton::FURTHEST);
            if !Skeleton::is_near(offset) {
                let problem = format!("offset is {offset}; it must lie within {furthest} m");
                return Err(entry.wrong(index, problem));
            }
            if !(radius > 0.0 && radius <= furthest) {
                let problem =
                    format!("radius is {radius}; it must be above 0 and at most {furthest} m");
                return Err(entry.wrong(index, problem));
            }
        }
        Ok(Self { spheres })
    }

    /// Reads and checks a file.
    ///
    /// # Errors
    /// The first error, with the file and the position in it.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::parse(&read_bytes(path)?).map_err(ReadError::in_file(path))
    }

    /// Converts a body to a file.
    #[must_use]
    pub fn of(body: &Body, skeleton: &Skeleton) -> Self {
        let entry = |sphere: &BodySphere| BodyEntry {
            joint: skeleton.joint(sphere.joint).name.clone(),
            offset: sphere.offset,
            radius: sphere.radius,
        };
        Self {
            spheres: body.spheres.iter().map(entry).collect(),
        }
    }

    /// Converts the file to a body on the joints of `skeleton`.
    ///
    /// # Errors
    /// The first joint that the skeleton does not have.
    pub fn resolve(&self, skeleton: &Skeleton) -> Result<Body, FileError> {
        let sphere = |(sphere, entry): (usize, &BodyEntry)| -> Result<_, FileError> {
            let unknown = || entry.wrong(sphere, "the skeleton has no such joint".to_owned());
            Ok(BodySphere {
                joint: skeleton.find(&entry.joint).ok_or_else(unknown)?,
                offset: entry.offset,
                radius: entry.radius,
            })
        };
        let spheres = self.spheres.iter().enumerate().map(sphere);
        Ok(Body::new(spheres.collect::<Result<_, _>>()?))
    }

    /// Refuses joints by names that several joints have ([`ClipSet::repeated_names`](super::ClipSet)).
    ///
    /// # Errors
    /// The first sphere on such a joint.
    pub fn check_names(&self, repeated: &[String]) -> Result<(), FileError> {
        let joint = |entry: &BodyEntry| repeated.contains(&entry.joint);
        match self.spheres.iter().position(joint) {
            None => Ok(()),
            Some(sphere) => {
                let entry = &self.spheres[sphere];
                Err(entry.wrong(sphere, several_joints(&entry.joint)))
            }
        }
    }
}

impl BodyEntry {
    fn wrong(&self, sphere: usize, problem: String) -> FileError {
        FileError::part(
            format!("sphere {sphere} (joint \"{}\")", self.joint),
            problem,
        )
    }
}

/// A file of joints or masses names a joint that the skeleton does not have.
pub(crate) fn unknown_joint(name: &str) -> FileError {
    FileError::Invalid(format!("the skeleton has no joint \"{name}\""))
}

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
        parse_json(&read_bytes(path)?).map_err(ReadError::in_file(path))
    }

    /// Masses of a skeleton's joints.
    ///
    /// # Errors
    /// The skeleton does not have a joint, or a mass is invalid.
    pub fn resolve(&self, skeleton: &Skeleton) -> Result<Masses, FileError> {
        let mut masses = vec![0.0; skeleton.len()];
        for (joint, &kilograms) in &self.masses {
            let id = skeleton.find(joint).ok_or_else(|| unknown_joint(joint))?;
            if !(kilograms.is_finite() && kilograms >= 0.0) {
                let problem = format!("a mass of {kilograms} kg is not possible");
                return Err(FileError::part(format!("joint \"{joint}\""), problem));
            }
            masses[id.index()] = kilograms;
        }
        Ok(Masses::Given(masses))
    }
}

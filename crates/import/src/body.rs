//! Files about bodies: spheres on joints, and masses of joints. Joints are identified by name.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use glam::Vec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::ReadError;
use crate::file::{JsonError, parse_json, read_bytes};
use sabaki::anim::Skeleton;
use sabaki::archive::write_atomically;
use sabaki::lod::Masses;
use sabaki::maps::{Body, BodySphere};

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

/// A body file: `{"spheres": [{"joint": "LeftHand", "offset": [x, y, z], "radius": 0.05}, ...]}`,
/// in metres, in the joint's frame. The object may also be under the key `body`, as in files that
/// [`super::export`] writes. Unknown keys are ignored.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BodyFile {
    /// Spheres, in the order of the file.
    pub spheres: Vec<BodyEntry>,
}

/// One sphere.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BodyEntry {
    /// Name of the joint whose frame it moves with.
    pub joint: String,
    /// Position of the centre in the joint's frame, in metres.
    pub offset: Vec3,
    /// Radius, in metres.
    pub radius: f32,
}

/// The file before it is checked, so that errors about missing fields can name the sphere.
#[derive(Deserialize)]
struct RawFile {
    spheres: Option<Vec<RawEntry>>,
    body: Option<RawBody>,
}

#[derive(Deserialize)]
struct RawBody {
    spheres: Vec<RawEntry>,
}

#[derive(Deserialize)]
struct RawEntry {
    joint: Option<String>,
    offset: Option<Vec<f64>>,
    radius: Option<f64>,
}

impl BodyFile {
    /// Parses and checks JSON text.
    ///
    /// # Errors
    /// The first error, with line and column, or with the sphere, its joint and the field.
    pub fn parse(text: &[u8]) -> Result<Self, BodyFileError> {
        let raw: RawFile = parse_json(text)?;
        let spheres = raw.spheres.or(raw.body.map(|body| body.spheres));
        let spheres = spheres.unwrap_or_default();
        if spheres.is_empty() {
            return Err(BodyFileError::NoSphere);
        }
        let entries = spheres.into_iter().enumerate();
        let spheres = entries
            .map(|(index, raw)| raw.check(index))
            .collect::<Result<_, BodyFileError>>()?;
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
    pub fn resolve(&self, skeleton: &Skeleton) -> Result<Body, BodyFileError> {
        let sphere = |(sphere, entry): (usize, &BodyEntry)| -> Result<_, BodyFileError> {
            let unknown = || BodyFileError::UnknownJoint {
                sphere,
                joint: entry.joint.clone(),
            };
            Ok(BodySphere {
                joint: skeleton.find(&entry.joint).ok_or_else(unknown)?,
                offset: entry.offset,
                radius: entry.radius,
            })
        };
        let spheres = self
            .spheres
            .iter()
            .enumerate()
            .map(sphere)
            .collect::<Result<_, BodyFileError>>()?;
        Ok(Body::new(spheres))
    }

    /// Refuses joints by names that several joints have ([`ClipSet::repeated_names`](super::ClipSet)).
    ///
    /// # Errors
    /// The first sphere on such a joint.
    pub fn check_names(&self, repeated: &[String]) -> Result<(), BodyFileError> {
        let joint = |entry: &BodyEntry| repeated.contains(&entry.joint);
        match self.spheres.iter().position(joint) {
            None => Ok(()),
            Some(sphere) => Err(BodyFileError::Ambiguous {
                sphere,
                joint: self.spheres[sphere].joint.clone(),
            }),
        }
    }

    /// Writes the file atomically.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        write_atomically(path, |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            writeln!(file)
        })
    }
}

impl RawEntry {
    fn check(self, sphere: usize) -> Result<BodyEntry, BodyFileError> {
        let joint = self.joint.unwrap_or_default();
        let missing = |field| BodyFileError::Missing {
            sphere,
            joint: joint.clone(),
            field,
        };
        let wrong = |field, found: String, wanted: String| BodyFileError::Field {
            sphere,
            joint: joint.clone(),
            field,
            found,
            wanted,
        };
        if joint.is_empty() {
            return Err(missing("joint"));
        }
        let offset = self.offset.ok_or_else(|| missing("offset"))?;
        let radius = self.radius.ok_or_else(|| missing("radius"))?;
        let [x, y, z] = offset[..] else {
            let found = format!("a list of {}", offset.len());
            return Err(wrong(
                "offset",
                found,
                "three numbers are wanted".to_owned(),
            ));
        };
        let place = Vec3::new(x as f32, y as f32, z as f32);
        let furthest = Skeleton::FURTHEST;
        if !Skeleton::is_near(place) {
            let wanted = format!("it must lie within {furthest} m");
            return Err(wrong("offset", format!("[{x}, {y}, {z}]"), wanted));
        }
        let metres = radius as f32;
        if !(metres > 0.0 && metres <= furthest) {
            let wanted = format!("it must be above 0 and at most {furthest} m");
            return Err(wrong("radius", radius.to_string(), wanted));
        }
        Ok(BodyEntry {
            joint,
            offset: place,
            radius: metres,
        })
    }
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
        let parsed = parse_json(&read_bytes(path)?).map_err(MassFileError::from);
        parsed.map_err(ReadError::in_file(path))
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

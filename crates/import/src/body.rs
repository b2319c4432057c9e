//! Body files: spheres on joints, which are identified by name.

use std::io::Write;
use std::path::Path;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::error::{BodyFileError, ReadError};
use super::file::read_bytes;
use super::json;
use sabaki::anim::Skeleton;
use sabaki::archive::write_atomically;
use sabaki::maps::{Body, BodySphere};

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
        let raw: RawFile = json::parse(text)?;
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
        Self::parse(&read_bytes(path)?).map_err(|error| ReadError::Body {
            path: path.to_owned(),
            error,
        })
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

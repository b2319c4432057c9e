//! Spheres that stand for a mesh: a body's skin on its bones, or a thing that a hand holds.
//!
//! The mesh is cut by joint, and points are spread over each piece, on vertices and between them. Balls
//! inside the mesh that touch it are its candidates; grown by [`FitSettings::bulge`], as few are kept as cover the piece's
//! points to [`FitSettings::cover`]. Sources stand in the files: where inside is, what a largest ball is, which of them are kept.
//! All is reported as measured on the points, whose spacing is reported with it. The same input gives the same spheres.
//!
//! ```
//! use sabaki::anim::{Joint, JointId, JointKind, JointTransform, Skeleton};
//! use sabaki_import::fit::{BindPose, FitSettings, Mesh, fit_body};
//! # use glam::Vec3;
//! # let joint = |name: &str, parent, offset| Joint { name: name.into(), parent, offset, kind: JointKind::Moving };
//! let skeleton = Skeleton::new(vec![
//!     joint("Hips", None, Vec3::ZERO),
//!     joint("Head", Some(JointId(0)), Vec3::new(0.0, 0.5, 0.0)),
//! ])?;
//! // A box around both, in centimetres, its origin at the hips.
//! let corner = |i: usize| Vec3::new([-10.0, 10.0][i & 1], [-10.0, 60.0][i >> 1 & 1], [-10.0, 10.0][i >> 2]);
//! let sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
//! let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
//! let mesh = Mesh::new((0..8).map(corner).collect(), triangles, Vec::new())?;
//! let mesh = mesh.placed(0.01, JointTransform::IDENTITY)?;
//!
//! let (body, report) = fit_body(&BindPose::rest(&skeleton), &mesh, &FitSettings::default())?;
//! assert!(report.worst().mesh_out_max <= 0.02);
//! assert!(body.is_sound(&skeleton));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bind;
mod cover;
mod medial;
mod mesh;
mod piece;
mod prop;
mod report;
mod surface;
mod tree;
mod winding;

use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use bind::BindPose;
pub use mesh::{Mesh, MeshError, MeshPart};
use piece::Piece;
pub use prop::fit_prop;
use report::Misfit;
pub use report::{FitReport, JointFit};
use sabaki::anim::JointId;
use sabaki::maps::{Body, BodySphere, LocalSphere};
use surface::Surface;

/// How closely spheres follow a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitSettings {
    /// The mesh may stick out of the spheres by this much, metres; 0.02 by default.
    pub cover: f32,
    /// The spheres may stick out of the mesh by this much, metres; 0.01 by default.
    pub bulge: f32,
    /// Spheres for each joint at most; 64 by default. Where they do not do, [`FitSettings::cover`] is not kept, and the report says so.
    pub most_spheres: usize,
    /// A vertex further than this from all bones, or from the hand that holds it, is an error: the mesh has another scale, or
    /// stands somewhere else. Metres; 1 by default, 10 for what is held.
    pub furthest: f32,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            cover: 0.02,
            bulge: 0.01,
            most_spheres: 64,
            furthest: 1.0,
        }
    }
}

impl FitSettings {
    /// For what is held in a hand.
    pub const HELD: Self = Self {
        cover: 0.02,
        bulge: 0.01,
        most_spheres: 64,
        furthest: 10.0,
    };

    /// Errors and distances from 1 mm to 10 m, 1 to 1000 spheres.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let lengths = [self.cover, self.bulge, self.furthest];
        lengths.iter().all(|metres| (0.001..=10.0).contains(metres))
            && (1..=1000).contains(&self.most_spheres)
    }
}

/// Why a mesh cannot be fitted.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    /// Settings out of range.
    #[error(
        "a fit needs errors and distances of 0.001 to 10 m and 1 to 1000 spheres a joint: {0:?}"
    )]
    Settings(FitSettings),
    /// The clip that was named as the bind pose is shorter, or of another skeleton.
    #[error(
        "the bind pose should be frame {frame} of clip \"{clip}\", which has {frames} frames of its own skeleton"
    )]
    NoFrame {
        /// Name of the clip.
        clip: String,
        /// Counted from 0.
        frame: usize,
        /// How many the clip has.
        frames: usize,
    },
    /// The mesh does not stand where the bones are.
    #[error(
        "vertex {vertex} is {metres:.2} m from the nearest bone (of joint \"{joint}\"), {furthest} m is the most: another scale, place or bind pose?"
    )]
    Far {
        /// Counted from 0.
        vertex: usize,
        /// How far.
        metres: f32,
        /// Name of the joint whose bone is near.
        joint: String,
        /// The limit, metres.
        furthest: f32,
    },
    /// The mesh itself is none, or its placement.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Fits a body to a mesh that stands in the space of `pose`, in metres ([`Mesh::placed`]).
///
/// A vertex goes to the joint that its part is named after, else to the nearest bone; a joint without vertices gets no sphere.
///
/// # Errors
/// Settings out of range; a mesh that is not where the bones are.
pub fn fit_body(
    pose: &BindPose<'_>,
    mesh: &Mesh,
    settings: &FitSettings,
) -> Result<(Body, FitReport), FitError> {
    check(settings)?;
    let vertices = bind::bind(pose, mesh, settings.furthest)?;
    let surface = Surface::new(mesh, &vertices, 0.5 * settings.cover);
    let mut body = Body::default();
    let mut report = FitReport::of(&surface);
    for joint in pose.skeleton.ids() {
        let piece = Piece::of(&surface, joint);
        if piece.points.is_empty() {
            continue;
        }
        let balls = piece.fit(&surface, settings);
        let name = pose.skeleton.joint(joint).name.clone();
        report.joints.push(JointFit {
            joint: name,
            vertices: piece.vertices(mesh, &vertices),
            ..piece.measure(&surface, &balls, settings)
        });
        let frame = pose.joints[joint.index()];
        body.spheres.extend(balls.iter().map(|ball| BodySphere {
            joint,
            offset: frame.rotation.inverse() * (ball.centre - frame.translation),
            radius: ball.radius,
        }));
    }
    Ok((body, report))
}

/// Fits spheres to a mesh that stands in the frame of the joint that holds it, in metres ([`Mesh::placed`] with the grip).
///
/// # Errors
/// Settings out of range; a mesh that reaches further from the joint than they allow.
pub fn fit_held(
    mesh: &Mesh,
    settings: &FitSettings,
) -> Result<(Vec<LocalSphere>, JointFit), FitError> {
    check(settings)?;
    for &vertex in mesh.triangles().iter().flatten() {
        let metres = mesh.positions()[vertex as usize].length();
        if metres > settings.furthest {
            let (vertex, furthest) = (vertex as usize, settings.furthest);
            let joint = "the hand".to_owned();
            return Err(FitError::Far {
                vertex,
                metres,
                joint,
                furthest,
            });
        }
    }
    let vertices = vec![JointId::ROOT; mesh.positions().len()];
    let surface = Surface::new(mesh, &vertices, 0.5 * settings.cover);
    let piece = Piece::of(&surface, JointId::ROOT);
    let balls = piece.fit(&surface, settings);
    let fit = JointFit {
        vertices: piece.vertices(mesh, &vertices),
        ..piece.measure(&surface, &balls, settings)
    };
    let sphere = |ball: &medial::Ball| LocalSphere {
        offset: ball.centre,
        radius: ball.radius,
    };
    Ok((balls.iter().map(sphere).collect(), fit))
}

fn check(settings: &FitSettings) -> Result<(), FitError> {
    if settings.is_sound() {
        Ok(())
    } else {
        Err(FitError::Settings(*settings))
    }
}

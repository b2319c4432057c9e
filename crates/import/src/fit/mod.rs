//! Fits spheres to a mesh: to the skin of a body, or to a prop that a hand holds.
//!
//! The mesh is divided by joint, and points are distributed over each piece, on vertices and
//! between them. Candidates are balls inside the mesh that touch it. They are enlarged by
//! [`FitSettings::bulge`], and as few as possible are kept to cover the piece's points up to
//! [`FitSettings::cover`]. The files of this module name the sources of these steps. All reported
//! errors are measured on the points; their spacing is reported too. The result is deterministic.
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
mod pieces;
mod prop;
mod report;
mod sampling;
mod settings;
mod surface;
mod tree;
mod winding;

pub use bind::BindPose;
pub use mesh::{Mesh, MeshError, MeshPart};
use piece::Piece;
pub use prop::fit_prop;
pub use report::{FitReport, JointFit};
use sabaki::anim::JointId;
use sabaki::maps::{Body, BodySphere};
use sabaki::math::Sphere;
pub use settings::{FitError, FitSettings};
use surface::Surface;

/// Fits a body to a mesh in the space of `pose`, in metres ([`Mesh::placed`]).
///
/// A vertex is assigned to the joint that its part is named after, otherwise to the nearest bone. A
/// joint without vertices gets no spheres.
///
/// # Errors
/// A setting is out of range, or the mesh is not where the bones are.
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

/// Fits spheres to a mesh in the frame of the joint that holds it, in metres ([`Mesh::placed`] with
/// the grip).
///
/// # Errors
/// A setting is out of range, or the mesh is too far from the joint.
pub fn fit_held(mesh: &Mesh, settings: &FitSettings) -> Result<(Vec<Sphere>, JointFit), FitError> {
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
    let sphere = |ball: &medial::Ball| Sphere::new(ball.centre, ball.radius);
    Ok((balls.iter().map(sphere).collect(), fit))
}

fn check(settings: &FitSettings) -> Result<(), FitError> {
    if settings.is_sound() {
        Ok(())
    } else {
        Err(FitError::Settings(*settings))
    }
}

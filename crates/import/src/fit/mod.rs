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
mod mesh;
mod surface;
mod winding;

use sabaki::anim::JointId;
use sabaki::maps::{Body, BodySphere, Prop};
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use bind::BindPose;
use cover::cover;
pub(crate) use mesh::bounds;
pub use mesh::{Mesh, MeshError, MeshPart};
use surface::Surface;

/// Settings of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitSettings {
    /// Maximum distance by which the mesh may stick out of the spheres, in metres. Default 0.02.
    pub cover: f32,
    /// Maximum distance by which the spheres may stick out of the mesh, in metres. Default 0.01.
    pub bulge: f32,
    /// Maximum number of spheres for each joint. Default 64. If they are too few for
    /// [`FitSettings::cover`], the report says so.
    pub most_spheres: usize,
    /// Maximum distance of a vertex from all bones, or from the hand that holds the mesh, in
    /// metres. A larger distance is an error, because the mesh has another scale or position.
    /// Default 1, or 10 for props.
    pub furthest: f32,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            furthest: 1.0,
            ..Self::HELD
        }
    }
}

impl FitSettings {
    /// Settings for a prop.
    pub const HELD: Self = Self {
        cover: 0.02,
        bulge: 0.01,
        most_spheres: 64,
        furthest: 10.0,
    };

    /// Whether distances are 1 mm to 10 m and the number of spheres is 1 to 1000.
    pub fn is_sound(&self) -> bool {
        let lengths = [self.cover, self.bulge, self.furthest];
        lengths.iter().all(|metres| (0.001..=10.0).contains(metres))
            && (1..=1000).contains(&self.most_spheres)
    }
}

/// Reason why a mesh cannot be fitted.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    /// A setting is out of range.
    #[error(
        "a fit needs errors and distances of 0.001 to 10 m and 1 to 1000 spheres a joint: {0:?}"
    )]
    Settings(FitSettings),
    /// The frame of the bind pose does not exist, or the clip has another skeleton.
    #[error(
        "the bind pose should be frame {frame} of clip \"{clip}\", which has {frames} frames of its own skeleton"
    )]
    NoFrame {
        /// Name of the clip.
        clip: String,
        /// Frame, counted from 0.
        frame: usize,
        /// Number of frames of the clip.
        frames: usize,
    },
    /// A vertex is too far from all bones.
    #[error(
        "vertex {vertex} is {metres:.2} m from the nearest bone (of joint \"{joint}\"), {furthest} m is the most: another scale, place or bind pose?"
    )]
    Far {
        /// Index of the vertex, from 0.
        vertex: usize,
        /// Distance to the nearest bone, in metres.
        metres: f32,
        /// Name of the nearest bone's joint.
        joint: String,
        /// Maximum distance, in metres.
        furthest: f32,
    },
    /// The mesh or its placement is invalid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Quality of a fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitReport {
    /// Quality for each joint with spheres, in the skeleton's order.
    pub joints: Vec<JointFit>,
    /// Maximum distance of any place on the mesh from the nearest measured point, in metres.
    pub spacing: f32,
    /// Share of the points at which the mesh separates inside from outside. It is near 1 for a
    /// closed skin, smaller if parts intersect, and 0 for sheets, whose spheres lie on them.
    pub border: f32,
}

/// Quality of a joint's spheres, in metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct JointFit {
    /// Name of the joint.
    pub joint: String,
    /// Number of vertices that move with the joint.
    pub vertices: usize,
    /// Number of points at which the errors are measured.
    pub points: usize,
    /// Number of spheres.
    pub spheres: usize,
    /// Maximum distance by which the mesh sticks out of the joint's spheres.
    pub mesh_out_max: f32,
    /// Mean of that distance over the points. Points inside the spheres count as 0.
    pub mesh_out_mean: f32,
    /// Maximum distance by which the spheres stick out of the whole mesh, sampled on their
    /// surfaces.
    pub spheres_out_max: f32,
    /// Mean of that distance over the samples outside the joint's other spheres. Samples inside the
    /// mesh count as 0.
    pub spheres_out_mean: f32,
    /// Whether the number of spheres was too small to reach the wanted error.
    pub limited: bool,
}

impl JointFit {
    /// Describes the fit if it misses the settings by far: the spheres stick out by more than twice the bulge and `spacing`,
    /// or the mesh by more than twice the cover and `spacing`.
    pub fn misfit(&self, settings: &FitSettings, spacing: f32) -> Option<String> {
        let mut words = Vec::new();
        let mut check = |what: &str, found: f32, wanted: f32| {
            if found > 2.0 * wanted + spacing {
                let (found, wanted) = (found * 1e3, wanted * 1e3);
                words.push(format!("{what} by {found:.0} mm, {wanted:.0} mm is wanted"));
            }
        };
        let (bulge, cover) = (settings.bulge, settings.cover);
        check(
            "the spheres stick out of the mesh",
            self.spheres_out_max,
            bulge,
        );
        check(
            "the mesh sticks out of the spheres",
            self.mesh_out_max,
            cover,
        );
        (!words.is_empty()).then(|| format!("joint \"{}\": {}", self.joint, words.join("; ")))
    }
}

impl FitReport {
    /// The joints whose fit misses the settings by far, one line each.
    pub fn misfits(&self, settings: &FitSettings) -> Vec<String> {
        let joints = self.joints.iter();
        joints
            .filter_map(|joint| joint.misfit(settings, self.spacing))
            .collect()
    }

    /// Summary of all joints: sums of counts, maxima of maxima, and means weighted by points and
    /// spheres.
    pub fn worst(&self) -> JointFit {
        let mut all = JointFit {
            joint: "all".to_owned(),
            ..JointFit::default()
        };
        for fit in &self.joints {
            all.vertices += fit.vertices;
            all.points += fit.points;
            all.spheres += fit.spheres;
            all.mesh_out_max = all.mesh_out_max.max(fit.mesh_out_max);
            all.spheres_out_max = all.spheres_out_max.max(fit.spheres_out_max);
            all.mesh_out_mean += fit.mesh_out_mean * fit.points as f32;
            all.spheres_out_mean += fit.spheres_out_mean * fit.spheres as f32;
            all.limited |= fit.limited;
        }
        all.mesh_out_mean /= all.points.max(1) as f32;
        all.spheres_out_mean /= all.spheres.max(1) as f32;
        all
    }
}

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
    if !settings.is_sound() {
        return Err(FitError::Settings(*settings));
    }
    let vertices = bind::bind(pose, mesh, settings.furthest)?;
    let surface = Surface::new(mesh, &vertices, 0.5 * settings.cover);
    let mut body = Body::default();
    let border = surface.border.order.len() as f32 / surface.places.len().max(1) as f32;
    let mut report = FitReport {
        joints: Vec::new(),
        spacing: surface.spacing,
        border,
    };
    for joint in pose.skeleton.ids() {
        let Some((balls, fit)) = cover(mesh, &vertices, &surface, joint, settings) else {
            continue;
        };
        let joint_name = pose.skeleton.joint(joint).name.clone();
        report.joints.push(JointFit {
            joint: joint_name,
            ..fit
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

/// Fits spheres to a mesh that `joint` holds. The mesh is in the joint's frame, in metres;
/// [`Mesh::placed`] with the grip (position and rotation of the mesh in the hand) brings it there.
/// The prop is not part of the body.
///
/// # Errors
/// A setting is out of range, or the mesh is too far from the joint.
pub fn fit_prop(
    joint: JointId,
    mesh: &Mesh,
    settings: &FitSettings,
) -> Result<(Prop, JointFit), FitError> {
    if !settings.is_sound() {
        return Err(FitError::Settings(*settings));
    }
    for &vertex in mesh.triangles().iter().flatten() {
        let metres = mesh.positions()[vertex as usize].length();
        if metres > settings.furthest {
            return Err(FitError::Far {
                vertex: vertex as usize,
                metres,
                joint: "the hand".to_owned(),
                furthest: settings.furthest,
            });
        }
    }
    let vertices = vec![JointId::ROOT; mesh.positions().len()];
    let surface = Surface::new(mesh, &vertices, 0.5 * settings.cover);
    // A mesh has a triangle.
    let fitted = cover(mesh, &vertices, &surface, JointId::ROOT, settings);
    let (spheres, fit) = fitted.unwrap_or_default();
    let prop = Prop {
        joint,
        spheres,
        is_body: false,
    };
    Ok((prop, fit))
}

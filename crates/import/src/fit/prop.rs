//! Fits spheres to a prop.

use sabaki::anim::JointId;
use sabaki::maps::Prop;

use super::{FitError, FitSettings, JointFit, Mesh, fit_held};

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
    let (spheres, fit) = fit_held(mesh, settings)?;
    let prop = Prop {
        joint,
        spheres,
        is_body: false,
    };
    Ok((prop, fit))
}

//! Spheres for a mesh that a joint holds.

use sabaki::anim::JointId;
use sabaki::maps::Prop;

use super::{FitError, FitSettings, JointFit, Mesh, fit_held};

/// Fits spheres to a mesh that `joint` holds. The mesh is in the joint's frame, in metres: [`Mesh::placed`] takes it there by
/// the grip (where the mesh's origin lies in the hand, and how its axes are turned). The prop is no part of the body.
///
/// # Errors
/// Settings out of range; a mesh that reaches further from the joint than they allow.
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

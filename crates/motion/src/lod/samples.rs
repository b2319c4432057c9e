use glam::DVec3;

use super::frames::{Place, place_all};
use crate::anim::{Clip, JointId, Skeleton};

/// Length below which a bone has no direction, in metres.
const NO_BONE: f64 = 1e-4;

/// Evenly spread frames of the clips, and the points of the body at which displacements are measured.
pub(super) struct Samples {
    joints: usize,
    /// Joint transforms, `[frame][joint]`.
    places: Vec<Place>,
    /// Points of each joint, in the joint's frame.
    points: Vec<Vec<DVec3>>,
}

/// Extent of the samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct SampleSettings {
    /// Maximum number of frames.
    pub(super) frames: usize,
    /// Distance from the bones to the surface of the body, in metres.
    pub(super) skin: f32,
}

impl Samples {
    /// Samples the clips.
    pub(super) fn of(skeleton: &Skeleton, clips: &[Clip], settings: SampleSettings) -> Self {
        let total: usize = clips.iter().map(Clip::frames).sum();
        let count = total.min(settings.frames.max(1));
        let (mut places, mut frame_places) = (Vec::new(), Vec::new());
        let (mut clip, mut first) = (0, 0);
        for sample in 0..count {
            let at = (sample * total + total / 2) / count;
            while at - first >= clips[clip].frames() {
                first += clips[clip].frames();
                clip += 1;
            }
            let moment = clips[clip].at((at - first) as f32);
            place_all(skeleton, moment, &mut frame_places);
            places.extend_from_slice(&frame_places);
        }
        let mut samples = Self {
            joints: skeleton.len(),
            places,
            points: Vec::new(),
        };
        samples.points = skeleton
            .ids()
            .map(|id| samples.points_of(skeleton, id, f64::from(settings.skin)))
            .collect();
        samples
    }

    /// The joint transforms of each frame.
    pub(super) fn frames(&self) -> impl Iterator<Item = &[Place]> {
        self.places.chunks_exact(self.joints)
    }

    /// Points of a joint in the joint's frame, in metres.
    pub(super) fn points(&self, joint: JointId) -> &[DVec3] {
        &self.points[joint.index()]
    }

    /// The joint itself, and for each bone that starts there the mean position of its far end and the corners of the box that contains
    /// everything within `skin` of the bone. A rigid displacement is largest at a corner.
    fn points_of(&self, skeleton: &Skeleton, joint: JointId, skin: f64) -> Vec<DVec3> {
        let mut points = vec![DVec3::ZERO];
        let frames = self.frames().count() as f64;
        for child in skeleton.children(joint) {
            let seen =
                |frame: &[Place]| frame[joint.index()].sees(&frame[child.index()]).translation;
            // Rounded to a micrometre, so that rounding errors do not decide the box's rotation about the bone.
            let end = self.frames().map(seen).sum::<DVec3>() / frames;
            let end = (end * 1e6).round() * 1e-6 + DVec3::ZERO;
            if end.length() > NO_BONE {
                points.push(end);
                points.extend(corners(end, end.normalize(), skin));
            }
        }
        if points.len() == 1 {
            points.extend(corners(DVec3::ZERO, DVec3::X, skin));
        }
        points
    }
}

/// The corners of a box along a bone from the origin to `end`, `skin` away from it on all sides.
fn corners(end: DVec3, along: DVec3, skin: f64) -> impl Iterator<Item = DVec3> {
    let (u, v) = along.any_orthonormal_pair();
    let ends = [-skin * along, end + skin * along];
    let sides = [u + v, u - v, v - u, -u - v];
    ends.into_iter()
        .flat_map(move |end| sides.map(|side| end + skin * side))
}

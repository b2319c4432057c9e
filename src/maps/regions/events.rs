//! Evasions and attacks as edges of a graph, and the spheres of an attack over time.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::body::{Body, BodySphere, Prop};
use super::sphere::{MovingSphere, SphereKey};
use crate::anim::{JointId, Pose, Skeleton, forward_kinematics};
use crate::graph::{EdgeId, GraphEvent, MotionGraph, Playhead};
use crate::math::Rigid2;

/// Index of an evasion's maps in a [`RegionAtlas`](super::RegionAtlas).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct RegionId(pub u32);

impl RegionId {
    /// The id as an index into per-region arrays.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// An edge that plays an evasion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evasion {
    /// Edge that plays the whole event and nothing else.
    pub edge: EdgeId,
    /// Maps of the evasion in the [`RegionAtlas`](super::atlas::RegionAtlas).
    pub region: RegionId,
    /// Character's frame at the event's start, in the space of its clip.
    pub placement: Rigid2,
}

impl Evasion {
    /// Playhead at the evasion's start, whose world is the character's frame there.
    pub fn playhead(&self) -> Playhead {
        Playhead {
            edge: self.edge,
            frame: 0.0,
            clip_to_world: self.placement.inverse(),
        }
    }
}

/// An edge that plays an attack.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AttackMove {
    /// Edge that plays the whole event and nothing else.
    pub edge: EdgeId,
    /// Character's frame at the event's start, in the space of its clip.
    pub placement: Rigid2,
}

/// Spheres of an attack over time: those of the attacking joints, of their descendants and of the
/// props that they hold. There is one key for each frame, in the character's frame at the event's
/// start. Time 0 is the start.
pub(crate) fn attack_spheres(
    graph: &MotionGraph,
    body: &Body,
    event: &GraphEvent,
) -> Vec<MovingSphere> {
    let to_start = graph.placement(event.clip, event.first).inverse();
    let attacking = attacking(graph.skeleton(), body, event);
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    let mut keys = vec![Vec::new(); attacking.len()];
    for frame in event.first..=event.last {
        graph.clip(event.clip).pose(frame as usize, &mut pose);
        pose.place(to_start);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        let t = (f64::from(frame - event.first) / graph.frame_rate()) as f32;
        for (keys, sphere) in keys.iter_mut().zip(&attacking) {
            keys.push(SphereKey {
                t,
                center: sphere.centre(&joints),
                radius: sphere.radius,
            });
        }
    }
    keys.into_iter().filter_map(MovingSphere::new).collect()
}

/// Spheres of the joints that the event names, of their descendants, and of the props that take
/// part ([`Prop::takes_part`]).
pub(crate) fn attacking(skeleton: &Skeleton, body: &Body, event: &GraphEvent) -> Vec<BodySphere> {
    let props = body.props.iter();
    let taking_part = props.filter(|prop| prop.takes_part(skeleton, &event.joints));
    let mut spheres = limbs(skeleton, body, event);
    spheres.extend(taking_part.flat_map(Prop::body_spheres));
    spheres
}

/// Attacking spheres without props. If the event names no joint, the whole body attacks.
///
/// A joint at the end of a chain has no bone and no spheres. It attacks with one sphere, whose
/// radius is the smallest of its nearest ancestor with spheres.
fn limbs(skeleton: &Skeleton, body: &Body, event: &GraphEvent) -> Vec<BodySphere> {
    let takes_part = |joint: JointId| {
        event.joints.is_empty()
            || skeleton
                .ancestry(joint)
                .any(|above| event.joints.contains(&above))
    };
    // Spheres of props that are part of the body.
    let held = body.props.iter().filter(|prop| prop.is_body);
    let held: Vec<BodySphere> = held.flat_map(Prop::body_spheres).collect();
    let own = || body.spheres.iter().filter(|sphere| !held.contains(sphere));
    let attacking = own().filter(|sphere| takes_part(sphere.joint));
    let spheres: Vec<BodySphere> = attacking.copied().collect();
    if !spheres.is_empty() {
        return spheres;
    }
    let thinnest = |joint: JointId| {
        let here = own().filter(move |sphere| sphere.joint == joint);
        here.map(|sphere| sphere.radius).min_by(f32::total_cmp)
    };
    let fist = |&joint: &JointId| {
        let radius = skeleton.ancestry(joint).find_map(thinnest)?;
        Some(BodySphere {
            joint,
            offset: Vec3::ZERO,
            radius,
        })
    };
    event.joints.iter().filter_map(fist).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::EventKind;
    use crate::graph::ClipId;
    use sabaki_fixtures::clips::skeleton;

    #[test]
    fn a_hand_without_a_bone_attacks_as_thick_as_its_arm() {
        let skeleton = skeleton(&[
            ("Hips", None, Vec3::ZERO),
            ("LeftArm", Some(0), Vec3::X),
            ("LeftHand", Some(1), Vec3::X),
        ]);
        let body = Body::from_bones(&skeleton);
        let event = GraphEvent {
            clip: ClipId(0),
            kind: EventKind::Attack,
            first: 0,
            last: 1,
            joints: vec![JointId(2)],
        };
        let spheres = attacking(&skeleton, &body, &event);
        assert_eq!((spheres.len(), spheres[0].joint), (1, JointId(2)));
        assert!(spheres[0].radius > 0.0);
    }
}

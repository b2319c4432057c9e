use serde::{Deserialize, Serialize};

use super::{Body, MovingSphere, SphereKey};
use crate::anim::{JointId, Pose, Skeleton, forward_kinematics};
use crate::graph::{EdgeId, GraphEvent, MotionGraph};
use crate::math::Rigid2;

/// An edge that attacks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Strike {
    /// The edge; it plays the whole event and nothing else.
    pub edge: EdgeId,
    /// The character's frame at the event's start, in the space of its clip.
    pub placement: Rigid2,
}

/// Where an attack passes: the spheres of the attacking joints and of all that hangs from them, frame by frame, in the
/// character's frame at the event's start. The clock starts with the event.
#[must_use]
pub fn attack_spheres(graph: &MotionGraph, body: &Body, event: &GraphEvent) -> Vec<MovingSphere> {
    let to_start = graph.placement(event.clip, event.first).inverse();
    let attacking: Vec<_> = body
        .spheres
        .iter()
        .filter(|sphere| takes_part(graph.skeleton(), event, sphere.joint))
        .collect();
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

/// Whether a joint is one that the event names, or hangs from one; all do where it names none.
fn takes_part(skeleton: &Skeleton, event: &GraphEvent, joint: JointId) -> bool {
    event.joints.is_empty()
        || skeleton
            .ancestry(joint)
            .any(|above| event.joints.contains(&above))
}

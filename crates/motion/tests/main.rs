//! The tests of `sabaki-motion`. Folders mirror `src`.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod anim;
mod crowd;
mod lod;

use sabaki_motion::anim::{Pose, Skeleton};

#[global_allocator]
static COUNTING: sabaki_fixtures::memory::Counting = sabaki_fixtures::memory::Counting;

/// Rotation and position of a joint in model space.
type ExactPlace = (glam::DQuat, glam::DVec3);

/// All joints of a pose in double precision, from the definition.
fn exact_places(skeleton: &Skeleton, pose: &Pose) -> Vec<ExactPlace> {
    let mut places: Vec<ExactPlace> = Vec::new();
    for (id, joint) in skeleton.ids().zip(skeleton.joints()) {
        let (turn, local) = pose.local(skeleton, id);
        let (turn, local) = (turn.as_dquat().normalize(), local.as_dvec3());
        places.push(match joint.parent {
            None => (turn, local),
            Some(parent) => {
                let (rotation, place) = places[parent.index()];
                (rotation * turn, rotation * local + place)
            }
        });
    }
    places
}

//! Promise: the spine, the limbs and what moves a joint are found by names and by the shape of the skeleton.

use glam::Vec3;
use sabaki_fixtures::clips::{biped, skeleton};
use sabaki_motion::anim::{JointId, Part, Rig};

#[test]
fn the_spine_ends_where_the_arms_begin() {
    let skeleton = biped();
    let rig = Rig::of(&skeleton);
    assert_eq!(rig.spine(), [JointId(1), JointId(2)]);
    let hips = rig.limbs().map(|limb| limb.unwrap().hip.0);
    assert_eq!(hips, [11, 14, 5, 8]);
    assert_eq!(rig.part(JointId(4)).spine, 2);
    assert_eq!(rig.part(JointId(1)).spine, 1);
    assert_eq!(
        rig.part(JointId(12)),
        Part {
            spine: 0,
            limb: Some(0),
            is_end: false
        }
    );
    assert_eq!(
        rig.part(JointId(10)),
        Part {
            spine: 2,
            limb: Some(3),
            is_end: true
        }
    );
}

#[test]
fn a_chain_without_names_has_neither() {
    let skeleton = skeleton(&[
        ("a", None, Vec3::ZERO),
        ("b", Some(0), Vec3::Y),
        ("c", Some(1), Vec3::Y),
    ]);
    let rig = Rig::of(&skeleton);
    assert!(rig.spine().is_empty() && rig.limbs().iter().all(Option::is_none));
}

//! A motion that is written as BVH and read again is unchanged.

use glam::{Quat, Vec3};
use proptest::prelude::*;
use sabaki::anim::{Clip, ClipDesc, Joint, JointId, JointKind, Pose, Skeleton, forward_kinematics};
use sabaki_fixtures::clips::{skeleton, still_clip};
use sabaki_import::bvh::{parse, write};

/// Parents as numbers that are taken modulo the joint's own index; whether leaves may be End Sites;
/// offsets.
fn skeletons() -> impl Strategy<Value = Skeleton> {
    let joint = (any::<u16>(), any::<bool>(), places(0.6));
    prop::collection::vec(joint, 1..20).prop_map(|joints| {
        let parents = joints.iter().enumerate();
        let parents = parents.map(|(index, joint)| usize::from(joint.0).checked_rem(index));
        let parents: Vec<Option<usize>> = parents.collect();
        let list = joints.iter().enumerate().map(|(index, joint)| {
            let is_leaf = !parents.contains(&Some(index));
            let is_end = index > 0 && joint.1 && is_leaf;
            Joint {
                name: format!("joint {index}"),
                parent: parents[index].map(|parent| JointId(parent as u16)),
                offset: joint.2,
                kind: match is_end {
                    true => JointKind::EndSite,
                    false => JointKind::Moving,
                },
            }
        });
        Skeleton::new(list.collect()).unwrap()
    })
}

fn places(most: f32) -> impl Strategy<Value = Vec3> {
    [-most..most, -most..most, -most..most].prop_map(Vec3::from_array)
}

/// Right angles are frequent: Euler angles are hardest there.
fn rotations() -> impl Strategy<Value = Quat> {
    let angle = prop_oneof![
        -180.0_f32..180.0,
        prop::sample::select(vec![-90.0_f32, 0.0, 90.0, 180.0]),
        89.99_f32..90.01
    ];
    [angle.clone(), angle.clone(), angle].prop_map(|[z, x, y]| {
        Quat::from_rotation_z(z.to_radians())
            * Quat::from_rotation_x(x.to_radians())
            * Quat::from_rotation_y(y.to_radians())
    })
}

fn motions() -> impl Strategy<Value = (Skeleton, Clip)> {
    let with_frames = (skeletons(), 1_usize..5, any::<bool>());
    with_frames.prop_flat_map(|(skeleton, frames, moves_joints)| {
        let entries = frames * skeleton.len();
        let translations = if moves_joints { entries } else { 0 };
        let values = (
            prop::collection::vec(places(10.0), frames),
            prop::collection::vec(rotations(), entries),
            prop::collection::vec(places(0.5), translations),
            prop::sample::select(vec![24.0, 30.0, 120.0, 1.0 / 0.008_333_3]),
        );
        values.prop_map(
            move |(roots, mut rotations, mut translations, frame_rate)| {
                for (index, joint) in skeleton.joints().iter().cycle().take(entries).enumerate() {
                    if joint.kind == JointKind::EndSite {
                        rotations[index] = Quat::IDENTITY;
                        // An End Site cannot leave its offset.
                        if let Some(translation) = translations.get_mut(index) {
                            *translation = joint.offset;
                        }
                    }
                }
                let desc = ClipDesc {
                    name: "random".into(),
                    frame_rate,
                    roots,
                    rotations,
                    translations,
                };
                let clip = Clip::new(&skeleton, desc).unwrap();
                (skeleton.clone(), clip)
            },
        )
    })
}

/// The root, and the places of all joints relative to it in the order in which a file has them:
/// depth first.
fn places_depth_first(skeleton: &Skeleton, clip: &Clip, frame: usize) -> (Vec3, Vec<Vec3>) {
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    clip.pose(frame, &mut pose);
    // Far from the origin every joint of a chain would round its place more coarsely.
    let root = std::mem::take(&mut pose.root);
    forward_kinematics(skeleton, &pose, &mut joints);
    let mut next = vec![JointId::ROOT];
    let mut places = Vec::new();
    while let Some(id) = next.pop() {
        places.push(joints[id.index()].translation);
        let mut children: Vec<JointId> = skeleton.children(id).collect();
        children.reverse();
        next.extend(children);
    }
    (root, places)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn positions_survive((skeleton, clip) in motions(), scale in prop::sample::select(vec![1.0, 0.01, 0.0254])) {
        let mut text = Vec::new();
        write(&mut text, &skeleton, &clip, scale).unwrap();
        let file = parse(&text).unwrap();
        let (skeleton_again, again) = file.motion("random", scale).unwrap();
        prop_assert_eq!(skeleton_again.len(), skeleton.len());
        prop_assert_eq!(again.frames(), clip.frames());
        prop_assert!((again.frame_rate() / clip.frame_rate() - 1.0).abs() < 1e-12);
        for frame in 0..clip.frames() {
            let (root, before) = places_depth_first(&skeleton, &clip, frame);
            let (root_again, after) = places_depth_first(&skeleton_again, &again, frame);
            prop_assert!(root.distance(root_again) < 1e-7, "{root} {root_again}");
            for (before, after) in before.iter().zip(&after) {
                prop_assert!(before.distance(*after) < 4e-6, "{before} {after}");
            }
        }
    }
}

#[test]
fn names_that_a_file_cannot_hold_are_changed_not_lost() {
    let names = [("a\n{b}", None), ("", Some(0)), (" c d ", Some(0))];
    let skeleton = skeleton(&names.map(|(name, parent)| (name, parent, Vec3::Y)));
    let clip = still_clip(&skeleton, "", 30.0, vec![Vec3::ZERO]);
    let mut text = Vec::new();
    write(&mut text, &skeleton, &clip, 1.0).unwrap();
    let file = parse(&text).unwrap();
    let names = file.joints.iter().map(|joint| joint.name.as_str());
    assert!(names.eq(["a__b_", "_", "c d"]));
    assert!(write(&mut text, &skeleton, &clip, 0.0).is_err());
}

//! The humanoid: 24 nodes, 1.75 m tall, T-pose with identity rotations, left is +X, facing +Z.

use glam::Vec3;

use sabaki::anim::{Joint, JointId, JointKind, Skeleton, SkeletonError};

/// Left, as an index of the sides; +X.
pub(super) const LEFT: usize = 0;
/// Right, as an index of the sides; -X.
pub(super) const RIGHT: usize = 1;

/// Indices of the trunk's joints.
pub(super) const HIPS: usize = 0;
pub(super) const SPINE: usize = 1;
pub(super) const CHEST: usize = 2;
pub(super) const NECK: usize = 3;
pub(super) const HEAD: usize = 4;

/// Places of the arm's joints after [`arm`].
pub(super) const UPPER_ARM: usize = 1;
pub(super) const FOREARM: usize = 2;
pub(super) const HAND: usize = 3;
pub(super) const HAND_END: usize = 4;

/// Places of the leg's joints after [`leg`].
pub(super) const SHIN: usize = 1;
pub(super) const FOOT: usize = 2;
pub(super) const FOOT_END: usize = 3;

/// Number of joints, including end sites.
pub(super) const JOINTS: usize = 24;

/// Offsets from the parents, in metres; the left side of paired joints.
pub(super) const SPINE_OFFSET: Vec3 = Vec3::new(0.0, 0.11, 0.0);
pub(super) const CHEST_OFFSET: Vec3 = Vec3::new(0.0, 0.19, 0.0);
const NECK_OFFSET: Vec3 = Vec3::new(0.0, 0.21, 0.0);
const HEAD_OFFSET: Vec3 = Vec3::new(0.0, 0.09, 0.015);
const CROWN_OFFSET: Vec3 = Vec3::new(0.0, 0.18, 0.0);
const SHOULDER_OFFSET: Vec3 = Vec3::new(0.03, 0.16, 0.0);
const ARM_OFFSET: Vec3 = Vec3::new(0.14, 0.0, 0.0);
const HIP_OFFSET: Vec3 = Vec3::new(0.09, -0.04, 0.0);
const TOE_OFFSET: Vec3 = Vec3::new(0.0, -0.065, 0.16);
const FIST: f32 = 0.12;

/// Lengths of bones, metres.
pub(super) const UPPER_ARM_LENGTH: f32 = 0.28;
pub(super) const FOREARM_LENGTH: f32 = 0.26;
pub(super) const THIGH_LENGTH: f32 = 0.43;
pub(super) const SHIN_LENGTH: f32 = 0.42;

/// Height of the toes' end above the ground in a flat foot, metres.
pub(super) const TOE_HEIGHT: f32 = 0.015;

/// The shoulder of a side, the first joint of its arm.
pub(super) const fn arm(side: usize) -> usize {
    6 + 5 * side
}

/// The hip of a side, the first joint of its leg.
pub(super) const fn leg(side: usize) -> usize {
    16 + 4 * side
}

/// +1 on the left, -1 on the right.
pub(super) fn sign(side: usize) -> f32 {
    if side == LEFT { 1.0 } else { -1.0 }
}

fn sided(offset: Vec3, side: usize) -> Vec3 {
    Vec3::new(offset.x * sign(side), offset.y, offset.z)
}

/// Offset of a shoulder's collar joint from the chest, in metres.
pub(super) fn shoulder_offset(side: usize) -> Vec3 {
    sided(SHOULDER_OFFSET, side)
}

/// Offset of an upper arm from its collar joint, in metres.
pub(super) fn arm_offset(side: usize) -> Vec3 {
    sided(ARM_OFFSET, side)
}

/// Offset of a hip joint from the hips, in metres.
pub(super) fn hip_offset(side: usize) -> Vec3 {
    sided(HIP_OFFSET, side)
}

/// Offset of the toes' end from the ankle, in the foot's frame, in metres.
pub(super) const fn toe_offset() -> Vec3 {
    TOE_OFFSET
}

/// The fist or the foot of a side with the bone that carries it: what a strike hits with.
pub(super) fn striking_arm(side: usize) -> Vec<JointId> {
    [FOREARM, HAND, HAND_END]
        .map(|part| id(arm(side) + part))
        .to_vec()
}

/// As [`striking_arm`], for a kick.
pub(super) fn striking_leg(side: usize) -> Vec<JointId> {
    [SHIN, FOOT, FOOT_END]
        .map(|part| id(leg(side) + part))
        .to_vec()
}

fn id(index: usize) -> JointId {
    JointId(index as u16)
}

/// The skeleton in the order of the constants above.
pub(super) fn humanoid() -> Result<Skeleton, SkeletonError> {
    let mut joints: Vec<Joint> = Vec::with_capacity(JOINTS);
    let mut add = |name: String, parent: Option<usize>, offset: Vec3| {
        let kind = if name.ends_with("_End") {
            JointKind::EndSite
        } else {
            JointKind::Moving
        };
        joints.push(Joint {
            name,
            parent: parent.map(id),
            offset,
            kind,
        });
    };
    add("Hips".into(), None, Vec3::ZERO);
    add("Spine".into(), Some(HIPS), SPINE_OFFSET);
    add("Chest".into(), Some(SPINE), CHEST_OFFSET);
    add("Neck".into(), Some(CHEST), NECK_OFFSET);
    add("Head".into(), Some(NECK), HEAD_OFFSET);
    add("Head_End".into(), Some(HEAD), CROWN_OFFSET);
    for (side, prefix) in [(LEFT, "Left"), (RIGHT, "Right")] {
        let along = Vec3::X * sign(side);
        let chain = [
            ("Shoulder", shoulder_offset(side)),
            ("Arm", arm_offset(side)),
            ("ForeArm", along * UPPER_ARM_LENGTH),
            ("Hand", along * FOREARM_LENGTH),
            ("Hand_End", along * FIST),
        ];
        for (place, (name, offset)) in chain.into_iter().enumerate() {
            let parent = if place == 0 {
                CHEST
            } else {
                arm(side) + place - 1
            };
            add(format!("{prefix}{name}"), Some(parent), offset);
        }
    }
    for (side, prefix) in [(LEFT, "Left"), (RIGHT, "Right")] {
        let chain = [
            ("UpLeg", hip_offset(side)),
            ("Leg", Vec3::NEG_Y * THIGH_LENGTH),
            ("Foot", Vec3::NEG_Y * SHIN_LENGTH),
            ("Foot_End", TOE_OFFSET),
        ];
        for (place, (name, offset)) in chain.into_iter().enumerate() {
            let parent = if place == 0 {
                HIPS
            } else {
                leg(side) + place - 1
            };
            add(format!("{prefix}{name}"), Some(parent), offset);
        }
    }
    Skeleton::new(joints)
}

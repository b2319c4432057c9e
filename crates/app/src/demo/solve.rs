//! Solves joint rotations: spreads the trunk's rotation over the spine, and poses arms and legs by two-bone inverse
//! kinematics in closed form (law of cosines, with a pole for the elbow or knee).

use glam::{Mat3, Quat, Vec3};

use super::feet::{Foot, foot_rotation};
use super::keys::Body;
use super::skeleton::{
    CHEST, CHEST_OFFSET, FOOT, FOREARM, FOREARM_LENGTH, HEAD, HIPS, JOINTS, LEFT, NECK, RIGHT,
    SHIN, SHIN_LENGTH, SPINE, SPINE_OFFSET, THIGH_LENGTH, UPPER_ARM, UPPER_ARM_LENGTH, arm,
    arm_offset, hip_offset, leg, shoulder_offset, sign, toe_offset,
};
use sabaki::math::Rigid2;

/// Largest extension of a leg or an arm, as a share of its length; it is approached smoothly.
const STRAIGHT: f32 = 0.994;
/// Extension above which a leg is damped.
const LEG_SOFT: f32 = 0.955;
/// Extension above which an arm is damped.
const ARM_SOFT: f32 = 0.93;
/// Largest angle by which a heel rises to reach, in radians.
const HEEL_MAX: f32 = 0.75;
/// Largest rotation of the head against the chest, in radians.
const NECK_MAX: f32 = 1.05;

/// The root's position and all rotations relative to the parents, in the skeleton's order.
pub(super) struct Solved {
    pub(super) root: Vec3,
    pub(super) rotations: [Quat; JOINTS],
}

/// The rotation of (pitch forward, yaw left, roll left).
fn turned(turn: Vec3) -> Quat {
    Quat::from_scaled_axis(Vec3::new(turn.x, 0.0, -turn.z)) * Quat::from_rotation_y(turn.y)
}

/// Solves one pose. `shift` is added to the hips' position, in metres.
pub(super) fn solve(body: &Body, feet: [Foot; 2], shift: Vec3) -> Solved {
    let home = Rigid2::new(body.place.y, body.place.x, body.place.z);
    let facing = home.rotation();
    // World rotations first.
    let mut world = [Quat::IDENTITY; JOINTS];
    world[HIPS] = facing * turned(body.hips);
    world[CHEST] = facing * turned(body.chest);
    world[SPINE] = world[HIPS].slerp(world[CHEST], 0.5);
    world[HEAD] = limited(world[CHEST], facing * turned(body.head), NECK_MAX);
    world[NECK] = world[CHEST].slerp(world[HEAD], 0.45);
    world[HEAD + 1] = world[HEAD];

    let mut root = home.point(body.pelvis) + shift;
    for side in [LEFT, RIGHT] {
        let hip = world[HIPS] * hip_offset(side);
        root.y = root.y.min(highest(root, hip, &feet[side]));
    }
    for side in [LEFT, RIGHT] {
        solve_leg(
            &mut world,
            LegTarget {
                root,
                home,
                foot: feet[side],
            },
            side,
        );
    }
    let chest = root + world[HIPS] * SPINE_OFFSET + world[SPINE] * CHEST_OFFSET;
    for side in [LEFT, RIGHT] {
        let near = chest + world[CHEST] * body.hands[side];
        let target = near.lerp(home.point(body.reach[side]), body.reaching[side]);
        let target = ArmTarget {
            chest,
            wrist: target,
            lifted: body.elbows[side],
        };
        solve_arm(&mut world, target, side);
    }
    Solved {
        root,
        rotations: local(&world),
    }
}

/// Limits the rotation from `from` to `to` to an angle.
fn limited(from: Quat, to: Quat, angle: f32) -> Quat {
    let to = if from.dot(to) < 0.0 { -to } else { to };
    let apart = from.angle_between(to);
    if apart > angle {
        from.slerp(to, angle / apart)
    } else {
        to
    }
}

/// The height of the root above which a foot on the ground cannot be reached even with its heel raised. `hip` is the leg's hip relative
/// to the root.
fn highest(root: Vec3, hip: Vec3, foot: &Foot) -> f32 {
    let ankle = raised(foot, HEEL_MAX).ankle;
    let away = (root + hip - ankle).with_y(0.0).length();
    let reach = STRAIGHT * (THIGH_LENGTH + SHIN_LENGTH);
    let up = (reach * reach - away * away).max(0.04).sqrt();
    // A foot in the air does not limit the body.
    ankle.y + up - hip.y + foot.free * 10.0
}

/// The foot with its heel raised to at least `pitch` about the toes.
fn raised(foot: &Foot, pitch: f32) -> Foot {
    let pitch = foot.pitch.max(pitch * (1.0 - foot.free));
    let ankle = foot.toe() - foot_rotation(foot.yaw, pitch) * toe_offset();
    Foot {
        ankle,
        pitch,
        ..*foot
    }
}

/// Raises the heel only as far as the leg needs.
fn within_reach(hip: Vec3, foot: &Foot) -> Foot {
    let wanted = hip.distance(foot.ankle);
    let reach = softened(wanted, LEG_SOFT, THIGH_LENGTH + SHIN_LENGTH);
    if wanted <= reach {
        return *foot;
    }
    let (mut low, mut high) = (0.0, HEEL_MAX);
    for _ in 0..14 {
        let middle = 0.5 * (low + high);
        if hip.distance(raised(foot, middle).ankle) > reach {
            low = middle;
        } else {
            high = middle;
        }
    }
    raised(foot, high)
}

/// Target of a leg.
struct LegTarget {
    root: Vec3,
    home: Rigid2,
    foot: Foot,
}

fn solve_leg(world: &mut [Quat; JOINTS], target: LegTarget, side: usize) {
    let LegTarget { root, home, foot } = target;
    let first = leg(side);
    let hip = root + world[HIPS] * hip_offset(side);
    let foot = within_reach(hip, &foot);
    let outward = world[HIPS] * Vec3::X * (0.12 * sign(side));
    let forward = Quat::from_rotation_y(foot.yaw) * Vec3::Z;
    let standing = (forward * 0.65 + world[HIPS] * Vec3::Z * 0.35 + outward).normalize_or(Vec3::Z);
    let knee = standing.lerp(foot.knee.normalize_or(home.vector(Vec3::Z)), foot.free);
    let (upper, lower) = two_bones([hip, foot.ankle], knee, [THIGH_LENGTH, SHIN_LENGTH]);
    // At rest legs hang along -Y and knees point to +Z.
    let bone = |bend: &Bend| basis(bend.hinge, -bend.along);
    world[first] = bone(&upper);
    world[first + SHIN] = bone(&lower);
    let flat = foot_rotation(foot.yaw, foot.pitch);
    let hanging = world[first + SHIN] * Quat::from_rotation_x(foot.point);
    world[first + FOOT] = flat.slerp(hanging, foot.free);
    world[first + FOOT + 1] = world[first + FOOT];
}

/// Target of an arm.
struct ArmTarget {
    chest: Vec3,
    wrist: Vec3,
    /// Angle of the elbow from hanging to the side, in radians.
    lifted: f32,
}

fn solve_arm(world: &mut [Quat; JOINTS], target: ArmTarget, side: usize) {
    let ArmTarget {
        chest,
        wrist,
        lifted,
    } = target;
    let (first, s) = (arm(side), sign(side));
    let collar = chest + world[CHEST] * shoulder_offset(side);
    // The collar bone follows the hand a little.
    let rest = world[CHEST] * Vec3::X * s;
    let towards = (wrist - collar).normalize_or(rest);
    let follow = Quat::from_rotation_arc(rest, towards);
    world[first] = Quat::IDENTITY.slerp(follow, 0.16) * world[CHEST];
    let shoulder = collar + world[first] * arm_offset(side);
    let (sin, cos) = lifted.sin_cos();
    let elbow = world[CHEST] * Vec3::new(s * sin, -cos, -0.3);
    let to = wrist - shoulder;
    let whole = UPPER_ARM_LENGTH + FOREARM_LENGTH;
    let length = softened(to.length(), ARM_SOFT, whole).max(0.28 * whole);
    let wrist = shoulder + to.normalize_or(rest) * length;
    let (upper, lower) = two_bones([shoulder, wrist], elbow, [UPPER_ARM_LENGTH, FOREARM_LENGTH]);
    // At rest arms stretch along ±X and elbows point to -Z.
    let bone = |bend: &Bend| basis(bend.along * s, -bend.hinge * s);
    world[first + UPPER_ARM] = bone(&upper);
    world[first + FOREARM] = bone(&lower);
    for part in FOREARM + 1..5 {
        world[first + part] = world[first + FOREARM];
    }
}

/// Limits a length smoothly: from `soft · whole` on it approaches `STRAIGHT · whole`.
fn softened(wanted: f32, soft: f32, whole: f32) -> f32 {
    let (from, room) = (soft * whole, (STRAIGHT - soft) * whole);
    if wanted <= from {
        return wanted;
    }
    from + room * (1.0 - (-(wanted - from) / room).exp())
}

/// One bone of a bent limb.
struct Bend {
    /// Unit, along the bone.
    along: Vec3,
    /// Unit, the limb's hinge: pole × (root to end).
    hinge: Vec3,
}

/// Two bones of these lengths from `root` towards `end`, the joint between them towards `pole`. Where the end is out of reach, the
/// limb points there nearly straight.
fn two_bones([root, end]: [Vec3; 2], pole: Vec3, [first, second]: [f32; 2]) -> (Bend, Bend) {
    let whole = first + second;
    let to = end - root;
    let length = to.length().clamp(0.2 * whole, STRAIGHT * whole);
    let along = to.normalize_or(Vec3::NEG_Y);
    let hinge = pole.cross(along).normalize_or(Vec3::X);
    let side = along.cross(hinge);
    let cos = (first * first + length * length - second * second) / (2.0 * first * length);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let middle = along * (first * cos) + side * (first * sin);
    let upper = middle.normalize_or(along);
    let lower = (along * length - middle).normalize_or(along);
    let bend = |along| Bend { along, hinge };
    (bend(upper), bend(lower))
}

/// The rotation whose X and Y axes are the given ones (orthonormal).
fn basis(x: Vec3, y: Vec3) -> Quat {
    Quat::from_mat3(&Mat3::from_cols(x, y, x.cross(y))).normalize()
}

/// Converts world rotations to rotations relative to the parents.
fn local(world: &[Quat; JOINTS]) -> [Quat; JOINTS] {
    std::array::from_fn(|index| {
        let parent = match index {
            HIPS => return world[HIPS].normalize(),
            _ if index == arm(LEFT) || index == arm(RIGHT) => CHEST,
            _ if index == leg(LEFT) || index == leg(RIGHT) => HIPS,
            _ => index - 1,
        };
        let ends = [
            HEAD + 1,
            arm(LEFT) + 4,
            arm(RIGHT) + 4,
            leg(LEFT) + 3,
            leg(RIGHT) + 3,
        ];
        if ends.contains(&index) {
            return Quat::IDENTITY;
        }
        (world[parent].inverse() * world[index]).normalize()
    })
}

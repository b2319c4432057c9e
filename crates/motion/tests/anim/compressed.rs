//! Compressed clips: the error that is promised, the bytes read naively, hostile bytes.

use crate::exact_places;
use glam::{DVec3, Quat, Vec3};
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::clips::{skeleton as fixture_skeleton, small_skeleton, swinging_clip};
use sabaki_motion::anim::{Clip, ClipDesc, CompressionSettings, JointKind, Pose, Skeleton};
use sabaki_motion::math::Isa;
use serde_json::{Value, json};

fn settings() -> CompressionSettings {
    CompressionSettings::default()
}

/// A clip whose joints move in their parents' frames, some of them not.
fn stretching_clip(skeleton: &Skeleton) -> Clip {
    let mut desc = swinging_clip(skeleton, 50, 0.7).desc();
    for frame in 0..50 {
        for (index, joint) in skeleton.joints().iter().enumerate() {
            let stretch = if index % 2 == 0 {
                0.0
            } else {
                (frame as f32 * 0.2).sin() * 0.1
            };
            desc.translations.push(joint.offset * (1.0 + stretch));
        }
    }
    Clip::new(skeleton, desc).unwrap()
}

/// Checks the error of every joint in every frame and half way between.
fn holds_its_error(skeleton: &Skeleton, plain: &Clip, settings: &CompressionSettings) -> Clip {
    let packed = plain.compressed(skeleton, settings);
    let [joint_error, end_error] = packed.compression_errors().expect("it is compressed");
    assert!(joint_error <= settings.joint_error && end_error <= settings.end_error);
    assert_eq!(packed.frames(), plain.frames());
    let mut poses = [Pose::default(), Pose::default()];
    let mut largest = 0.0f64;
    for half in 0..2 * plain.frames() - 1 {
        for (clip, pose) in [plain, &packed].into_iter().zip(&mut poses) {
            clip.sample(half as f32 / 2.0, pose);
        }
        let [a, b] = poses.each_ref().map(|pose| exact_places(skeleton, pose));
        for (joint, (a, b)) in skeleton.joints().iter().zip(a.iter().zip(&b)) {
            let error = a.1.distance(b.1);
            let bound = match joint.kind {
                JointKind::Moving => settings.joint_error,
                JointKind::EndSite => settings.end_error,
            };
            // Between frames the interpolated errors of two frames; a little for single precision.
            assert!(error <= 1.02 * f64::from(bound), "{}: {error}", joint.name);
            if half % 2 == 0 && joint.kind == JointKind::Moving {
                largest = largest.max(error);
                let skin = DVec3::AXES
                    .map(|axis| (a.0 * axis * 0.1 + a.1).distance(b.0 * axis * 0.1 + b.1));
                assert!(
                    skin.iter()
                        .all(|&error| error <= 1.001 * f64::from(settings.end_error))
                );
            }
        }
    }
    assert!((largest - f64::from(joint_error)).abs() < 2e-6, "{largest}");
    packed
}

#[test]
fn the_error_is_held_and_stated() {
    let skeleton = small_skeleton();
    for frames in [1, 2, 15, 16, 17, 150] {
        holds_its_error(
            &skeleton,
            &swinging_clip(&skeleton, frames, 0.3),
            &settings(),
        );
    }
    let coarse = CompressionSettings {
        joint_error: 1e-3,
        end_error: 3e-3,
    };
    let clip = swinging_clip(&skeleton, 150, 1.1);
    let sizes = [settings(), coarse]
        .map(|settings| holds_its_error(&skeleton, &clip, &settings).stored_bytes()[0]);
    assert!(sizes[1] < sizes[0], "{sizes:?}");
    // Helpers keep the bones from being aimed, so that errors add up along the arm, and fingers have them all.
    let mut arm = vec![(None, Vec3::ZERO)];
    for bone in 0..5 {
        arm.extend([0.1, 0.3].map(|length| (Some(2 * bone), length * Vec3::X)));
    }
    for finger in 0..5 {
        let (base, side) = (11 + 3 * finger, 0.02 * f32::from(finger) * Vec3::Z);
        let tips =
            [(base, 0.03), (base + 1, 0.02)].map(|(from, length)| (Some(from), length * Vec3::X));
        arm.push((Some(10), 0.09 * Vec3::X + side));
        arm.extend(tips);
    }
    let names: Vec<String> = (0..arm.len())
        .map(|index| format!("joint {index}"))
        .collect();
    let arm = names
        .iter()
        .zip(arm)
        .map(|(name, (parent, offset))| (name.as_str(), parent, offset));
    let arm = fixture_skeleton(&arm.collect::<Vec<_>>());
    holds_its_error(&arm, &swinging_clip(&arm, 150, 0.3), &settings());
    let stretching = stretching_clip(&skeleton);
    assert!(holds_its_error(&skeleton, &stretching, &settings()).moves_joints());
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn real_motion_is_a_third_of_its_size() {
    let set = captures("fight");
    let mut bytes = [0; 2];
    for clip in set.clips.iter().step_by(5) {
        let packed = holds_its_error(&set.skeleton, clip, &settings());
        for (sum, own) in bytes.iter_mut().zip(packed.stored_bytes()) {
            *sum += own;
        }
    }
    assert!(3 * bytes[0] <= bytes[1], "{bytes:?}");
}

#[test]
fn a_clip_that_cannot_hold_the_error_stays_plain() {
    let skeleton = small_skeleton();
    let clip = swinging_clip(&skeleton, 40, 0.3);
    let impossible = CompressionSettings {
        joint_error: 1e-9,
        end_error: 1e-9,
    };
    assert_eq!(clip.compressed(&skeleton, &impossible), clip);
    // A joint turns by more than half a turn a frame: there is no shorter way.
    let mut desc = clip.desc();
    for (frame, rotations) in desc.rotations.chunks_mut(skeleton.len()).enumerate() {
        rotations[5] = Quat::from_rotation_x(std::f32::consts::PI * frame as f32);
    }
    let spinning = Clip::new(&skeleton, desc).unwrap();
    let packed = spinning.compressed(&skeleton, &settings());
    assert!(
        packed
            .compression_errors()
            .is_none_or(|[error, _]| error <= 1e-4)
    );
    let packed = clip.compressed(&skeleton, &settings());
    assert_eq!(packed.compressed(&skeleton, &settings()), packed);
}

/// Reads bits of a clip's bytes one by one.
struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Bits<'_> {
    fn take(&mut self, bits: usize) -> i64 {
        let value = (0..bits).map(|bit| {
            let at = self.at + bit;
            i64::from(self.bytes[at / 8] >> (at % 8) & 1) << bit
        });
        let value = value.sum();
        self.at += bits;
        value
    }

    fn signed(&mut self, bits: usize) -> i64 {
        let value = self.take(bits);
        if value >> (bits - 1) == 1 {
            value - (1 << bits)
        } else {
            value
        }
    }
}

/// Reads a compressed clip as the format is written down, bit by bit.
fn read_naively(skeleton: &Skeleton, packed: &Clip) -> ClipDesc {
    let value = serde_json::to_value(packed).unwrap();
    let stored = &value["frames"]["Packed"];
    let bytes: Vec<u8> = serde_json::from_value(stored["bytes"].clone()).unwrap();
    let lanes: Vec<usize> = serde_json::from_value(stored["lanes"].clone()).unwrap();
    let joints = skeleton.len();
    let rows = 4 * lanes.len().div_ceil(8);
    let places = if packed.moves_joints() {
        3 * joints.div_ceil(8)
    } else {
        0
    };
    let mut bits = Bits {
        bytes: &bytes,
        at: 0,
    };
    let mut desc = ClipDesc {
        name: packed.name().to_owned(),
        frame_rate: packed.frame_rate(),
        roots: Vec::new(),
        rotations: Vec::new(),
        translations: Vec::new(),
    };
    let mut segment = (Vec::new(), Vec::new());
    // The largest code of each width, which is to need all of its bits.
    let mut most = Vec::new();
    for frame in 0..packed.frames() {
        if frame % 16 == 0 {
            let widths: Vec<usize> = (0..rows + places + 3)
                .map(|_| bits.take(8) as usize)
                .collect();
            let mut bases: Vec<i64> = (0..8 * rows).map(|_| bits.signed(16)).collect();
            bases.extend((0..8 * places + 3).map(|_| bits.signed(32)));
            most = vec![0; widths.len()];
            segment = (widths, bases);
        }
        let (widths, bases) = &segment;
        let mut values = Vec::new();
        for (index, base) in bases.iter().enumerate() {
            let row = if index < 8 * (rows + places) {
                index / 8
            } else {
                rows + places + index - 8 * (rows + places)
            };
            let code = bits.take(widths[row]);
            most[row] = code.max(most[row]);
            values.push(base + code);
        }
        if frame % 16 == 15 || frame + 1 == packed.frames() {
            let needed = most
                .iter()
                .map(|code| (i64::BITS - code.leading_zeros()) as usize);
            assert!(needed.eq(widths.iter().copied()), "{widths:?}");
        }
        bits.at = bits.at.next_multiple_of(8);
        let metres = |value: i64| value as f32 / 32768.0;
        let root = &values[8 * (rows + places)..];
        desc.roots
            .push(Vec3::new(metres(root[0]), metres(root[1]), metres(root[2])));
        let first = desc.rotations.len();
        desc.rotations.resize(first + joints, Quat::IDENTITY);
        for (lane, joint) in lanes.iter().enumerate() {
            let [x, y, z, w] =
                [0, 1, 2, 3].map(|row| values[8 * (4 * (lane / 8) + row) + lane % 8] as f32);
            let scale = 1.0 / ((x * x + y * y) + (z * z + w * w)).sqrt();
            desc.rotations[first + joint] =
                Quat::from_xyzw(x * scale, y * scale, z * scale, w * scale);
        }
        if places > 0 {
            let place = |joint: usize| {
                let at =
                    |row: usize| metres(values[8 * (rows + 3 * (joint / 8) + row) + joint % 8]);
                Vec3::new(at(0), at(1), at(2))
            };
            desc.translations.extend((0..joints).map(place));
        }
    }
    assert_eq!(bits.at / 8 + 16, bytes.len());
    desc
}

#[test]
fn frames_are_read_as_the_format_says() {
    let skeleton = small_skeleton();
    let swinging = swinging_clip(&skeleton, 37, 0.4);
    // Its root flies so far that its codes take 24 bits.
    let mut flying = swinging.desc();
    for (frame, root) in flying.roots.iter_mut().enumerate() {
        *root = Vec3::X * (frame % 16) as f32 * 32.0;
    }
    let flying = Clip::new(&skeleton, flying).unwrap();
    for clip in [swinging, stretching_clip(&skeleton), flying] {
        let packed = clip.compressed(&skeleton, &settings());
        assert!(packed.compression_errors().is_some());
        let expected = read_naively(&skeleton, &packed);
        assert_eq!(packed.desc(), expected);
        let mut pose = Pose::default();
        for frame in 0..packed.frames() {
            packed.pose(frame, &mut pose);
            assert_eq!(pose.root, packed.root(frame));
            assert_eq!(
                pose.rotations,
                expected.rotations[frame * 9..(frame + 1) * 9]
            );
        }
    }
}

#[test]
fn every_instruction_set_samples_the_same_bits() {
    let skeleton = small_skeleton();
    let plain = stretching_clip(&skeleton);
    let packed = plain.compressed(&skeleton, &settings());
    let (mut first, mut other) = (Pose::default(), Pose::default());
    for (moment, clip) in (0..500).flat_map(|moment| [(moment, &plain), (moment, &packed)]) {
        let frame = moment as f32 * 0.1;
        clip.sample_on(Isa::Portable, frame, &mut first);
        for isa in Isa::available() {
            clip.sample_on(isa, frame, &mut other);
            assert_eq!(other, first, "{isa:?} at {frame}");
        }
    }
}

#[test]
fn hostile_clips_are_refused() {
    let skeleton = small_skeleton();
    let packed = swinging_clip(&skeleton, 40, 0.4).compressed(&skeleton, &settings());
    let whole = serde_json::to_value(&packed).unwrap();
    let is_clip = |value: &Value| serde_json::from_value::<Clip>(value.clone()).is_ok();
    assert!(is_clip(&whole));
    let changes = [
        ("frames", json!(0)),
        ("frames", json!(41)),
        ("frames", json!(u32::MAX)),
        ("joints", json!(0)),
        ("joints", json!(3)),
        ("moves_joints", json!(true)),
        ("lanes", json!([])),
        ("lanes", json!([0, 0, 1, 3, 5, 7])),
        ("lanes", json!([0, 1, 3, 5, 7, 9])),
        ("bytes", json!([])),
        ("bytes", json!([17, 0, 0])),
    ];
    for (field, change) in changes {
        let mut hostile = whole.clone();
        hostile["frames"]["Packed"][field] = change.clone();
        assert!(!is_clip(&hostile), "{field} = {change}");
    }
    // A width beyond what is read, and a byte too many.
    for (at, byte) in [(0, 17), (4, 25)] {
        let mut hostile = whole.clone();
        hostile["frames"]["Packed"]["bytes"][at] = json!(byte);
        assert!(!is_clip(&hostile), "byte {at} = {byte}");
    }
    let mut longer = whole.clone();
    longer["frames"]["Packed"]["bytes"]
        .as_array_mut()
        .unwrap()
        .push(json!(0));
    assert!(!is_clip(&longer));
}

//! Promise: a clip at another frame rate is the same motion, and a frame rate that no memory holds is an error.

use sabaki_fixtures::clips::{small_skeleton, swinging_clip};
use sabaki_motion::anim::{Clip, ClipError, CompressionSettings, Pose};

#[test]
fn the_motion_stays_the_same() {
    let skeleton = small_skeleton();
    let clip = swinging_clip(&skeleton, 50, 0.7);
    let faster = clip.resampled(3.0 * clip.frame_rate()).unwrap();
    assert_eq!(faster.frames(), 49 * 3 + 1);
    let (mut expected, mut found) = (Pose::default(), Pose::default());
    for frame in 0..50 {
        clip.sample(frame as f32, &mut expected);
        faster.sample(3.0 * frame as f32, &mut found);
        let angle = |pair: (&glam::Quat, &glam::Quat)| pair.0.angle_between(*pair.1);
        let pairs = expected.rotations.iter().zip(&found.rotations);
        let worst = pairs.map(angle).fold(0.0, f32::max);
        assert!(worst < 2e-3, "frame {frame}: {worst}");
        assert!(expected.root.distance(found.root) < 1e-5);
    }
}

#[test]
fn a_frame_rate_that_no_memory_holds_is_an_error() {
    let skeleton = small_skeleton();
    let plain = swinging_clip(&skeleton, 50, 0.7);
    let packed = plain.compressed(&skeleton, &CompressionSettings::default());
    for clip in [plain, packed] {
        for rate in [1e15, 1e300, f64::MAX, f64::INFINITY, f64::NAN, 0.0, -30.0] {
            let error = clip.resampled(rate).unwrap_err();
            let ClipError::FrameRate { rate: found, .. } = &error else {
                panic!("{error}");
            };
            assert_eq!(found.to_bits(), rate.to_bits());
            assert!(error.to_string().contains(clip.name()), "{error}");
        }
        let one: Clip = clip.resampled(1e-300).unwrap();
        assert_eq!(one.frames(), 1);
    }
}

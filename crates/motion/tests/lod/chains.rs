//! Promise: skeletons and distances at the ends of the range give finite bands in bounded time, or an error.

use sabaki_fixtures::clips::{chain, swinging_chain};
use sabaki_fixtures::lod::{build, rules};
use sabaki_motion::lod::{LevelSettings, Levels, LodError, Order, Switching};

/// Without motion the errors are rounding, and the room that blending needs is less than the distance can show.
#[test]
fn a_chain_without_motion_has_finite_bands() {
    for (joints, angle) in [(12, 0.0), (12, 1e-6), (12, 0.05), (100, 0.0), (300, 0.0)] {
        let skeleton = chain(joints);
        let clip = swinging_chain(&skeleton, 20, angle);
        let levels = build(&skeleton, std::slice::from_ref(&clip), Order::Energy);
        for settings in rules() {
            let switching = Switching::new(&levels, &settings).unwrap();
            let mut before = 0.0;
            for band in switching.bands() {
                let [start, full, end] = [band.start, band.full, band.end];
                assert!(end.is_finite(), "{joints} joints: {band:?}");
                assert!(before <= start && start <= full && full <= end, "{band:?}");
                before = end;
            }
        }
    }
}

#[test]
fn skeletons_and_clips_that_would_take_hours_are_refused() {
    for (joints, frames) in [(1024, 2), (400, 30_000)] {
        let skeleton = chain(joints);
        let clip = swinging_chain(&skeleton, frames, 0.0);
        let error = Levels::build(&skeleton, &[clip], &LevelSettings::default()).unwrap_err();
        let LodError::TooMuch {
            joints: of,
            frames: over,
            ..
        } = error
        else {
            panic!("{error}")
        };
        assert_eq!((of, over), (joints + 1, frames));
        let words = format!("{} joints in {frames} frames: 1024 joints", joints + 1);
        assert!(error.to_string().contains(&words), "{error}");
    }
}

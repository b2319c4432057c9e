//! Promise: posing a crowd allocates nothing, from the second time on, on no thread; nor does sorting it.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_testing as common;
use sabaki_testing::memory as counting;

use common::clips::{small_skeleton, swinging_clip};
use common::crowd::{Stage, crowd_of, forms, posed, settings};
use counting::all_allocations;
use sabaki::crowd::LevelId;
use sabaki::math::Isa;

#[test]
fn frames_allocate_nothing() {
    let skeleton = small_skeleton();
    let clips = vec![
        swinging_clip(&skeleton, 90, 0.3),
        swinging_clip(&skeleton, 47, 1.1),
    ];
    let stage = Stage::new(skeleton, clips, &[1, 3, 5]);
    let characters = stage.characters(1000, 7);
    for output in forms() {
        for threads in [1, 3] {
            let settings = settings(output, Isa::best(), threads);
            let (mut crowd, ids) = crowd_of(&stage, &characters, settings);
            // All are put on level 0 and back: the most memory that any order takes.
            let mut out = posed(&mut crowd);
            for &id in &ids {
                crowd.set_level(id, LevelId(0)).unwrap();
            }
            out.resize(out.len().max(crowd.output_len()) * 2, out[0]);
            for (&id, character) in ids.iter().zip(&characters) {
                crowd.set_level(id, character.level).unwrap();
            }
            crowd.pose(&mut out).unwrap();
            let before = all_allocations();
            for frame in 0..300 {
                crowd.advance(1.0 / 30.0);
                if frame % 50 == 0 {
                    let level = LevelId(frame % 4);
                    crowd.set_level(ids[usize::from(frame)], level).unwrap();
                    let blend = f32::from(frame % 7) / 6.0;
                    crowd.set_detail(ids[1], level, blend).unwrap();
                }
                crowd.pose(&mut out).unwrap();
            }
            assert_eq!(
                all_allocations() - before,
                0,
                "{output:?}, {threads} threads"
            );
        }
    }
}

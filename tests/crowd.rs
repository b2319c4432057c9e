//! Promise: a crowd's poses are those of its clips, within 0.2 mm of slerp in double precision, on
//! every instruction set, in every form and layout.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::clips::{small_skeleton, swinging_clip};
use common::crowd::{Stage, forms, furthest, settings};
use sabaki::crowd::{Character, ClipId, Fade, Layout, LevelId, Memory, Output};
use sabaki::math::Isa;

/// Metres: what the issue of quantising is held to.
const NEAR: f64 = 2e-4;

fn stage() -> Stage {
    let skeleton = small_skeleton();
    let clips = [
        swinging_clip(&skeleton, 120, 0.3),
        swinging_clip(&skeleton, 47, 1.1),
        swinging_clip(&skeleton, 9, 2.0),
    ];
    Stage::new(skeleton, clips.to_vec(), &[1, 3, 5])
}

#[test]
fn poses_are_those_of_double_precision() {
    let stage = stage();
    let characters = stage.characters(300, 7);
    for isa in Isa::available() {
        for output in forms() {
            let apart = furthest(&stage, &characters, settings(output, isa, 1), 0.37);
            assert!(apart < NEAR, "{isa:?} {output:?}: {apart} m");
        }
    }
}

#[test]
fn any_number_of_characters() {
    let stage = stage();
    for count in [0, 1, 15, 16, 17, 33] {
        for threads in [1, 2, 3] {
            let characters = stage.characters(count, count as u64);
            let output = Output::default();
            let apart = furthest(
                &stage,
                &characters,
                settings(output, Isa::best(), threads),
                0.1,
            );
            assert!(
                apart < NEAR,
                "{count} characters, {threads} threads: {apart} m"
            );
        }
    }
}

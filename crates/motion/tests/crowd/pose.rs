//! Promise: a crowd's poses are those of its clips, within 0.2 mm of slerp in double precision, on
//! every instruction set, in every layout, at every moment.

use sabaki_fixtures::captures::mocap;
use sabaki_fixtures::clips::{small_skeleton, swinging_clip};
use sabaki_fixtures::crowd::{Stage, crowd_of, furthest, outputs, posed, settings};
use sabaki_import::{ReadOptions, read_clip};
use sabaki_motion::crowd::{CrowdSettings, Output};
use sabaki_motion::lod::{LevelSettings, Levels};
use sabaki_motion::math::{F32x16, Isa};

/// Metres.
pub(super) const NEAR: f64 = 2e-4;

pub(super) fn stage() -> Stage {
    let skeleton = small_skeleton();
    let clips = [
        swinging_clip(&skeleton, 120, 0.3),
        swinging_clip(&skeleton, 47, 1.1),
        swinging_clip(&skeleton, 9, 2.0),
    ];
    Stage::new(skeleton, clips.to_vec(), &[1, 3, 5])
}

pub(super) fn default() -> CrowdSettings {
    settings(Output::default(), Isa::best(), 1)
}

#[test]
fn poses_are_those_of_double_precision() {
    let stage = stage();
    let characters = stage.characters(300, 7);
    for isa in Isa::available() {
        for output in outputs() {
            for seconds in [0.37, 30.0] {
                let apart = furthest(&stage, &characters, settings(output, isa, 1), seconds);
                assert!(apart < NEAR, "{isa:?} {output:?}, {seconds} s: {apart} m");
            }
        }
    }
}

#[test]
fn any_number_of_characters() {
    let stage = stage();
    for count in [0, 1, 15, 16, 17, 33] {
        for threads in [1, 2, 3] {
            let characters = stage.characters(count, count as u64);
            let settings = settings(Output::default(), Isa::best(), threads);
            let apart = furthest(&stage, &characters, settings, 0.1);
            assert!(apart < NEAR, "{count}, {threads} threads: {apart} m");
        }
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn captured_walks_on_all_levels() {
    for name in ["Male2_B3_Walk", "fighting-01-provocation-takiguchi"] {
        let path = mocap(&format!("walk/{name}.bvh"));
        let loaded = read_clip(&path, &ReadOptions::default()).unwrap();
        let clips = [loaded.clip];
        let levels = Levels::build(&loaded.skeleton, &clips, &LevelSettings::default()).unwrap();
        let stage = Stage::on_levels(&loaded.skeleton, &clips, &levels);
        let mut characters = stage.characters(2_000, 3);
        for character in &mut characters {
            // Mixing is measured against itself, not against slerp.
            character.fade = None;
        }
        let apart = furthest(&stage, &characters, default(), 0.37);
        assert!(apart < NEAR, "{name}: {apart} m");
        println!("{name}: {:.3} mm", apart * 1e3);
    }
}

#[test]
fn fused_kernels_give_the_same_bits_and_the_portable_one_is_near() {
    let stage = stage();
    let characters = stage.characters(500, 11);
    for output in outputs() {
        let pose = |isa, threads| {
            let (mut crowd, _) = crowd_of(&stage, &characters, settings(output, isa, threads));
            crowd.advance(0.5);
            posed(&mut crowd)
        };
        let bits = |lines: &[F32x16]| bytemuck::cast_slice::<_, u32>(lines).to_vec();
        let best = pose(Isa::best(), 1);
        for threads in [2, 3, 7] {
            assert!(
                bits(&best) == bits(&pose(Isa::best(), threads)),
                "{threads} threads"
            );
        }
        for isa in Isa::available() {
            let found = pose(isa, 1);
            // The portable one rounds products twice, but on aarch64.
            if isa == Isa::Portable && !cfg!(target_arch = "aarch64") {
                let numbers = found
                    .iter()
                    .zip(&best)
                    .flat_map(|(a, b)| a.0.into_iter().zip(b.0));
                // Numbers of up to 8 m and 1, which a float tells in steps of 4.8e-7.
                for (a, b) in numbers.filter(|(a, b)| !(a.is_nan() && b.is_nan())) {
                    assert!((a - b).abs() < 4e-6, "{output:?}: {a} {b}");
                }
            } else {
                assert!(bits(&best) == bits(&found), "{isa:?} {output:?}");
            }
        }
    }
}

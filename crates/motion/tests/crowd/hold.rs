//! Promise: which poses are held follows from the groups alone: not from the number of threads, nor from what comes into view
//! elsewhere.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use super::frame::{SECONDS, stage};
use common::crowd::{Stage, crowd_of, settings};
use glam::Vec4;
use sabaki_motion::crowd::{
    Character, Crowd, CrowdSettings, Frame, Frustum, Hold, Layout, LevelId, MemberId, Output,
    Placement,
};
use sabaki_motion::math::{F32x16, Isa, Rigid2};
use std::f32::consts::TAU;

const COUNT: usize = 640;

/// Characters on a circle around the camera, of one clip and level, so that neighbours are of one group.
fn ring() -> Vec<Character> {
    let on = |index: usize| {
        let share = index as f32 / COUNT as f32;
        let (sin, cos) = (TAU * share).sin_cos();
        Character {
            time: 3.9 * share,
            placement: Placement {
                ground: Rigid2::new(0.0, 10.0 * cos, 10.0 * sin),
                height: 0.0,
            },
            ..Character::default()
        }
    };
    (0..COUNT).map(on).collect()
}

/// Half of the circle; a camera that turns by a group from frame to frame.
fn frustum(frame: usize) -> Frustum {
    let (sin, cos) = (TAU * (16 * frame) as f32 / COUNT as f32).sin_cos();
    Frustum {
        planes: [Vec4::new(cos, 0.0, sin, 0.1); 6],
        radius: 0.0,
        centre: 0.0,
    }
}

/// A crowd on the circle, and what it has written.
struct Ring {
    crowd: Crowd,
    ids: Vec<MemberId>,
    out: Vec<F32x16>,
}

impl Ring {
    fn new(stage: &Stage, settings: CrowdSettings) -> Self {
        let (crowd, ids) = crowd_of(stage, &ring(), settings);
        let out = vec![F32x16::ZERO; crowd.max_output_len(COUNT)];
        Self { crowd, ids, out }
    }

    /// All are seen in the first frame, so that all have a group.
    fn step(&mut self, index: usize) {
        let frame = Frame {
            seconds: SECONDS,
            frustum: (index > 0).then(|| frustum(index)),
            ..Frame::default()
        };
        self.crowd.frame(&frame, &mut self.out).unwrap();
    }

    fn numbers(&self, id: MemberId) -> Option<Vec<u32>> {
        let slice = self.crowd.pose_slice(id).ok()?;
        let number = |at: usize| slice.number(&self.out, at / 12, at % 12).to_bits();
        Some((0..12 * slice.joints).map(number).collect())
    }
}

fn held(layout: Layout, threads: usize) -> CrowdSettings {
    let output = Output {
        layout,
        ..Output::default()
    };
    CrowdSettings {
        hold: Hold {
            from: LevelId(0),
            frames: 3,
        },
        ..settings(output, Isa::best(), threads)
    }
}

#[test]
fn any_number_of_threads_holds_the_same_poses() {
    let (stage, _) = stage();
    for layout in [Layout::Blocks, Layout::Rows, Layout::Instances] {
        let mut crowds = [1, 2, 4].map(|threads| Ring::new(&stage, held(layout, threads)));
        for index in 0..60 {
            let [one, others @ ..] = &mut crowds;
            one.step(index);
            for other in others {
                other.step(index);
                let numbers = one.out.iter().zip(&other.out);
                let numbers = numbers.flat_map(|(a, b)| a.0.into_iter().zip(b.0));
                let apart = numbers.filter(|(a, b)| a.to_bits() != b.to_bits()).count();
                assert_eq!(apart, 0, "{layout:?}, frame {index}");
            }
        }
    }
}

#[test]
fn groups_stay_held_while_others_come_into_view() {
    let (stage, _) = stage();
    let mut ring = Ring::new(&stage, held(Layout::Blocks, 1));
    let mut free = Ring::new(
        &stage,
        CrowdSettings {
            hold: Hold::default(),
            ..held(Layout::Blocks, 1)
        },
    );
    let mut before: Vec<Option<Vec<u32>>> = vec![None; COUNT];
    for index in 0..30 {
        ring.step(index);
        free.step(index);
        let (mut seen, mut kept, mut new) = (0, 0, 0);
        for (&id, before) in ring.ids.iter().zip(&mut before) {
            let now = ring.numbers(id);
            if now.is_some() {
                seen += 1;
                kept += usize::from(*before == now);
                new += usize::from(before.is_none());
            }
            if now.is_some() && before.is_none() {
                // It is late only where others of its group were in view before.
                let is_fresh = now == free.numbers(id);
                let first = id.0 / 16 * 16;
                let seen = (first..first + 16).filter(|&id| ring.crowd.is_posed(MemberId(id)));
                assert!(is_fresh || seen.count() > 1, "frame {index}, {id:?}");
            }
            *before = now;
        }
        if index > 1 {
            assert!(new > 0, "frame {index}");
            assert!(2 * kept > seen, "frame {index}: {kept} of {seen} are held");
        }
    }
}

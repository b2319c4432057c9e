//! Promise: one call a frame gives every character the level, the blend and the pose that the single calls give it, on every
//! instruction set, whatever the camera does, with and without hysteresis and culling.

use super::pose::default;
use glam::{Vec3, Vec4};
use sabaki_fixtures::clips::{small_skeleton, swinging_clip};
use sabaki_fixtures::crowd::{Stage, crowd_of, settings};
use sabaki_motion::crowd::{
    Character, Crowd, CrowdError, Frame, Frustum, Layout, MemberId, Output, Placement,
};
use sabaki_motion::lod::{LevelId, Levels, Rule, SwitchSettings, Switching};
use sabaki_motion::math::{F32x16, Isa, Rigid2};
use std::sync::Arc;

pub(super) const SECONDS: f64 = 1.0 / 60.0;

pub(super) fn stage() -> (Stage, Levels) {
    let skeleton = small_skeleton();
    let clips = [
        swinging_clip(&skeleton, 120, 0.3),
        swinging_clip(&skeleton, 47, 1.1),
    ];
    let order = [1, 3, 5].map(|id| (sabaki_motion::anim::JointId(id), f32::from(id)));
    let levels = Levels::in_order(&skeleton, &order).unwrap();
    (Stage::on_levels(&skeleton, &clips, &levels), levels)
}

pub(super) fn switchings(levels: &Levels) -> Vec<Switching> {
    let rules = [None, Some(0.5)];
    let new = |blend_step| {
        let settings = SwitchSettings {
            rule: Rule::Energy { furthest: 6.0 },
            hysteresis: 0.1,
            blend_step,
            ..SwitchSettings::default()
        };
        Switching::new(levels, &settings).unwrap()
    };
    let mut all: Vec<Switching> = rules.map(new).into();
    // Bands with room to blend in, whatever the levels' errors are.
    let mut wide = levels.clone();
    for level in &mut wide.levels {
        level.error.step = 0.05;
    }
    let settings = SwitchSettings {
        rule: Rule::Energy { furthest: 6.0 },
        ..SwitchSettings::default()
    };
    all.push(Switching::new(&wide, &settings).unwrap());
    all
}

/// Walks past, comes back, and jumps.
fn eye(frame: usize) -> Vec3 {
    match frame {
        60..80 => Vec3::new(-3.0, 1.0, 4.0),
        _ => Vec3::new(
            0.02 * frame as f32 - 2.0,
            1.5,
            (0.05 * frame as f32).sin() * 3.0,
        ),
    }
}

fn frustum(frame: usize) -> Frustum {
    let turn = 0.03 * frame as f32;
    let plane = |angle: f32| Vec4::new((turn + angle).cos(), 0.0, (turn + angle).sin(), 1.0);
    let open = Vec4::new(0.0, 1.0, 0.0, 100.0);
    Frustum {
        planes: [plane(0.0), plane(1.2), plane(-1.2), open, open, open],
        radius: 0.3,
        centre: 0.9,
    }
}

fn position(character: &Character) -> Vec3 {
    let Placement { ground, height } = character.placement;
    Vec3::new(ground.x, height, ground.z)
}

fn is_inside(frustum: &Frustum, position: Vec3) -> bool {
    let centre = (position + Vec3::Y * frustum.centre).extend(1.0);
    frustum
        .planes
        .iter()
        .all(|plane| plane.dot(centre) >= -frustum.radius)
}

/// The crowd of the single calls: levels chosen one by one.
struct Reference {
    characters: Vec<Character>,
    levels: Vec<LevelId>,
}

impl Reference {
    fn choose(&mut self, switching: &Switching, eye: Vec3) {
        for (character, level) in self.characters.iter_mut().zip(&mut self.levels) {
            let distance = position(character).distance(eye);
            let choice = switching.choose(distance, Some(*level));
            *level = choice.level;
            (character.level, character.blend) = (choice.level, choice.blend);
        }
    }
}

#[test]
fn a_frame_is_what_the_single_calls_give() {
    let (stage, levels) = stage();
    for isa in Isa::available() {
        for (index, switching) in switchings(&levels).iter().enumerate() {
            for culls in [false, true] {
                compare(&stage, switching, isa, culls, index);
            }
        }
    }
}

/// Compares frames with the single calls. `index` is that of the switching.
fn compare(stage: &Stage, switching: &Switching, isa: Isa, culls: bool, index: usize) {
    let mut characters = stage.characters(400, 9);
    // A character that starts between two levels may be on either.
    characters
        .iter_mut()
        .for_each(|character| character.blend = 0.0);
    let (mut crowd, ids) = crowd_of(stage, &characters, settings(Output::default(), isa, 1));
    let mut reference = Reference {
        levels: characters.iter().map(|character| character.level).collect(),
        characters,
    };
    let mut out = vec![F32x16::ZERO; crowd.max_output_len(ids.len())];
    let (mut posed, mut blended, mut moved) = (0, 0, 0);
    // Without blending hysteresis can be seen.
    let blends = index > 0;
    for step in 0..120 {
        let frustum = culls.then(|| frustum(step));
        let frame = Frame {
            seconds: SECONDS,
            switching: Some(switching),
            eye: eye(step),
            frustum,
        };
        moved += crowd.frame(&frame, &mut out).unwrap().moved;
        let visible = |character: &Character| {
            frustum.is_none_or(|frustum| is_inside(&frustum, position(character)))
        };
        if culls {
            // A hidden character keeps its level: only where nothing is hidden is it known without hysteresis.
            reference.levels.fill(LevelId(0));
        }
        reference.choose(switching, eye(step));
        for (&id, character) in ids.iter().zip(&reference.characters) {
            assert_eq!(crowd.is_posed(id), visible(character), "frame {step}");
            if !visible(character) {
                continue;
            }
            posed += 1;
            let found = crowd.character(id).unwrap();
            let expected = f32::from(character.level.0) + character.blend;
            let detail = f32::from(found.level.0) + found.blend;
            if blends {
                assert_eq!(detail, expected.min(3.0), "frame {step}");
            } else if !culls {
                assert_eq!(detail, f32::from(character.level.0), "frame {step}");
            }
            blended += usize::from(character.blend > 0.0);
            if step % 13 == 0 {
                check(stage, &crowd, &out, id, step);
            }
        }
    }
    assert!(posed > 1000 && moved > 400, "{posed} {moved}");
    assert!(index < 2 || blended > 100, "{blended}");
}

/// Compares the pose of a character with the oracle's.
fn check(stage: &Stage, crowd: &Crowd, out: &[F32x16], id: MemberId, frame: usize) {
    let found = &crowd.character(id).unwrap();
    let slice = crowd.pose_slice(id).unwrap();
    let expected = stage.drawn(found, 0.0, &slice);
    for (joint, expected) in expected.iter().enumerate() {
        let found = sabaki_fixtures::crowd::joint_of(out, &slice, joint);
        let apart = found.translation.distance(expected.translation);
        assert!(apart < 4e-4, "frame {frame}, {apart} m");
    }
}

#[test]
fn hidden_characters_have_no_pose_and_come_back() {
    let (stage, _) = stage();
    let characters = stage.characters(50, 4);
    let (mut crowd, ids) = crowd_of(&stage, &characters, default());
    let mut out = vec![F32x16::ZERO; crowd.max_output_len(ids.len())];
    let nowhere = Frustum {
        planes: [Vec4::new(0.0, 0.0, 0.0, -10.0); 6],
        ..frustum(0)
    };
    let frame = Frame {
        frustum: Some(nowhere),
        ..Frame::default()
    };
    crowd.frame(&frame, &mut out).unwrap();
    assert_eq!(crowd.output_len(), 0);
    let hidden = CrowdError::NotVisible { id: ids[7].0 };
    assert_eq!(crowd.pose_slice(ids[7]), Err(hidden));
    // It is moved while it is hidden.
    let placement = Placement {
        ground: Rigid2::new(1.0, 2.0, 3.0),
        height: 0.5,
    };
    crowd.place(ids[7], &placement).unwrap();
    crowd.frame(&Frame::default(), &mut out).unwrap();
    assert!(ids.iter().all(|&id| crowd.is_posed(id)));
    let found = crowd.character(ids[7]).unwrap();
    assert_eq!(position(&found), Vec3::new(2.0, 0.5, 3.0));
    check(&stage, &crowd, &out, ids[7], 1);
}

#[test]
fn time_is_exact_after_a_day() {
    let (stage, _) = stage();
    let characters = stage.characters(60, 5);
    let (mut crowd, ids) = crowd_of(&stage, &characters, default());
    let mut out = vec![F32x16::ZERO; crowd.max_output_len(ids.len())];
    crowd.pose(&mut out).unwrap();
    let (step, frames) = (0.5, 2 * 3600 * 24);
    for _ in 0..frames {
        crowd.advance(step);
    }
    let seconds = step * f64::from(frames);
    assert_eq!(crowd.time(), seconds);
    let by_steps = ids.iter().map(|&id| crowd.character(id).unwrap());
    let by_steps: Vec<Character> = by_steps.collect();
    let (mut at_once, _) = crowd_of(&stage, &characters, default());
    at_once.set_time(seconds);
    for ((&id, character), start) in ids.iter().zip(&by_steps).zip(&characters) {
        // Exactly: the clips have 119 and 46 intervals, 30 a second.
        let duration = [119.0, 46.0][start.clip.index()] / 30.0;
        let exact = f64::from(start.time) + f64::from(start.speed) * seconds;
        let exact = exact.rem_euclid(duration);
        for found in [*character, at_once.character(id).unwrap()] {
            let apart = (f64::from(found.time) - exact).abs();
            let apart = apart.min((duration - apart).abs());
            assert!(apart < 1e-4, "{apart} s, {start:?}");
        }
        assert_eq!(character.time, at_once.character(id).unwrap().time);
    }
}

#[test]
fn instances_stay_in_their_places() {
    let (stage, levels) = stage();
    let switching = switchings(&levels).remove(2);
    let characters = stage.characters(300, 9);
    for layout in [Layout::Instances, Layout::Blocks] {
        let output = Output {
            layout,
            ..Output::default()
        };
        let settings = settings(output, Isa::best(), 2);
        let mut crowd = Crowd::with_capacity(Arc::clone(&stage.animations), settings, 400);
        let ids: Vec<MemberId> = characters.iter().map(|c| crowd.add(c).unwrap()).collect();
        assert_eq!(crowd.capacity(), 400);
        let most = crowd.max_output_len(crowd.capacity());
        let mut out = vec![F32x16::ZERO; most];
        let mut posed = 0;
        for frame in 0..60 {
            let input = Frame {
                seconds: SECONDS,
                switching: Some(&switching),
                eye: eye(frame),
                frustum: (frame % 3 > 0).then(|| frustum(frame)),
            };
            assert!(crowd.output_len() <= most);
            crowd.frame(&input, &mut out).unwrap();
            for (index, &id) in ids.iter().enumerate() {
                if !crowd.is_posed(id) {
                    continue;
                }
                posed += 1;
                let slice = crowd.pose_slice(id).unwrap();
                if layout == Layout::Instances {
                    let row = output.row_len(crowd.animations().joints(LevelId(0)));
                    assert_eq!(slice.start, 16 * row * index);
                }
            }
        }
        assert!(posed > 600, "{posed}");
    }
}

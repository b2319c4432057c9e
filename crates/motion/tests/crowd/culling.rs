//! Promise: a character that the camera sees is posed in that very frame, whatever it saw before, and one that it does not see has
//! no pose.

use super::frame::{stage, switchings};
use super::pose::default;
use glam::{Vec3, Vec4};
use sabaki_fixtures::crowd::{Stage, crowd_of};
use sabaki_motion::crowd::{
    Character, Crowd, CrowdError, Frame, Frustum, LevelId, MemberId, Placement,
};
use sabaki_motion::lod::Switching;
use sabaki_motion::math::{F32x16, Rigid2};

/// Stands apart from the others.
const OUTSIDER: MemberId = MemberId(100);
/// Where it stands, in metres along X; the others are nearer to the origin than 6 m.
const OUTSIDE: f32 = 50.0;

/// Sees everything whose X is below this, in metres.
fn up_to(x: f32) -> Frustum {
    Frustum {
        planes: [Vec4::new(-1.0, 0.0, 0.0, x); 6],
        radius: 0.0,
        centre: 0.0,
    }
}

/// A crowd in which [`OUTSIDER`] is hidden.
struct Outside {
    crowd: Crowd,
    out: Vec<F32x16>,
}

impl Outside {
    fn new(stage: &Stage, switching: &Switching) -> Self {
        let mut characters = stage.characters(400, 9);
        characters[OUTSIDER.0 as usize].placement = Placement {
            ground: Rigid2::new(0.0, OUTSIDE, 0.0),
            height: 0.0,
        };
        let (crowd, _) = crowd_of(stage, &characters, default());
        let out = vec![F32x16::ZERO; crowd.max_output_len(characters.len())];
        let mut outside = Self { crowd, out };
        let far = Frame {
            switching: Some(switching),
            eye: Vec3::Z * 1000.0,
            ..Frame::default()
        };
        outside.step(&far);
        let hidden = Frame {
            frustum: Some(up_to(10.0)),
            ..far
        };
        for _ in 0..2 {
            outside.step(&hidden);
            assert!(!outside.crowd.is_posed(OUTSIDER));
        }
        outside
    }

    fn step(&mut self, frame: &Frame<'_>) {
        self.crowd.frame(frame, &mut self.out).unwrap();
    }
}

#[test]
fn a_character_that_comes_near_and_into_view_is_posed_at_once() {
    let (stage, levels) = stage();
    let switching = switchings(&levels).swap_remove(2);
    let mut outside = Outside::new(&stage, &switching);
    outside.step(&Frame {
        switching: Some(&switching),
        eye: Vec3::X * OUTSIDE,
        frustum: Some(up_to(100.0)),
        ..Frame::default()
    });
    assert!(outside.crowd.is_posed(OUTSIDER));
    let slice = outside.crowd.pose_slice(OUTSIDER).unwrap();
    assert_eq!(slice.level, LevelId(0));
}

#[test]
fn a_visible_character_that_is_given_a_finer_level_stays_posed() {
    let (stage, levels) = stage();
    let switching = switchings(&levels).swap_remove(2);
    let mut outside = Outside::new(&stage, &switching);
    // Still far away, so that it keeps its group.
    outside.step(&Frame {
        switching: Some(&switching),
        eye: Vec3::Z * 1000.0,
        frustum: Some(up_to(100.0)),
        ..Frame::default()
    });
    assert!(outside.crowd.is_posed(OUTSIDER));
    outside.crowd.set_level(OUTSIDER, LevelId(0)).unwrap();
    outside.crowd.pose(&mut outside.out).unwrap();
    assert!(outside.crowd.is_posed(OUTSIDER));
}

#[test]
fn characters_are_posed_again_when_there_is_no_frustum_any_more() {
    let (stage, _) = stage();
    let characters = stage.characters(32, 4);
    let (mut crowd, ids) = crowd_of(&stage, &characters, default());
    let mut out = vec![F32x16::ZERO; crowd.max_output_len(ids.len())];
    let nothing = Frame {
        frustum: Some(up_to(-100.0)),
        ..Frame::default()
    };
    crowd.frame(&Frame::default(), &mut out).unwrap();
    assert!(ids.iter().all(|&id| crowd.is_posed(id)));
    crowd.frame(&nothing, &mut out).unwrap();
    assert!(!ids.iter().any(|&id| crowd.is_posed(id)));
    out.fill(F32x16([f32::NAN; 16]));
    crowd.frame(&Frame::default(), &mut out).unwrap();
    for &id in &ids {
        assert!(crowd.is_posed(id), "{id:?}");
        let slice = crowd.pose_slice(id).unwrap();
        let mut numbers = (0..12 * slice.joints).map(|at| slice.number(&out, at / 12, at % 12));
        assert!(numbers.all(f32::is_finite), "{id:?}");
    }
}

#[test]
fn a_hidden_character_has_no_slice_though_it_keeps_its_group() {
    let (stage, _) = stage();
    let characters: Vec<Character> = stage.characters(40, 4);
    let (mut crowd, ids) = crowd_of(&stage, &characters, default());
    let mut out = vec![F32x16::ZERO; crowd.max_output_len(ids.len())];
    crowd.frame(&Frame::default(), &mut out).unwrap();
    let half = Frame {
        frustum: Some(up_to(0.0)),
        ..Frame::default()
    };
    let report = crowd.frame(&half, &mut out).unwrap();
    assert_eq!((report.moved, report.sorted), (0, false));
    let mut hidden = 0;
    for (&id, character) in ids.iter().zip(&characters) {
        let is_seen = character.placement.ground.x <= 0.0;
        let error = CrowdError::NotVisible { id: id.0 };
        assert_eq!(crowd.pose_slice(id).err(), (!is_seen).then_some(error));
        assert_eq!(crowd.is_posed(id), is_seen);
        hidden += usize::from(!is_seen);
    }
    assert!((5..35).contains(&hidden), "{hidden}");
}

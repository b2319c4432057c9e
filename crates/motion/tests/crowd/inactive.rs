//! Promise: characters that are deactivated cost nothing, whatever is told about them, until they are set again.

use super::pose::{default, stage};
use sabaki_fixtures::crowd::crowd_of;
use sabaki_motion::crowd::{CrowdError, Frame, FrameReport, LevelId, MemberId, Placement};
use sabaki_motion::math::{F32x16, Rigid2};

const COUNT: usize = 2000;

#[test]
fn what_is_told_about_inactive_characters_moves_nobody() {
    let stage = stage();
    let mut characters = stage.characters(COUNT, 6);
    let (mut crowd, ids) = crowd_of(&stage, &characters, default());
    let mut out = vec![F32x16::ZERO; crowd.max_output_len(COUNT)];
    let frame = Frame::default();
    crowd.frame(&frame, &mut out).unwrap();
    // More than may be moved without sorting all.
    let inactive: Vec<MemberId> = ids.iter().copied().take(COUNT * 7 / 100).collect();
    for &id in &inactive {
        crowd.deactivate(id).unwrap();
    }
    assert!(crowd.frame(&frame, &mut out).unwrap().sorted);
    for step in 0..5 {
        let placements: Vec<Placement> = characters
            .iter_mut()
            .map(|character| {
                character.placement.ground = Rigid2::new(0.1 * step as f32, 1.0, 2.0);
                character.placement
            })
            .collect();
        crowd.place_all(&placements);
        for &id in &inactive {
            crowd.deactivate(id).unwrap();
            crowd.place(id, &placements[0]).unwrap();
            crowd.set_level(id, LevelId(step % 4)).unwrap();
        }
        let report = crowd.frame(&frame, &mut out).unwrap();
        assert_eq!(report, FrameReport::default(), "frame {step}");
    }
    for &id in &inactive {
        let gone = CrowdError::NoSuchCharacter {
            id: id.0,
            characters: COUNT,
        };
        assert_eq!(crowd.pose_slice(id), Err(gone));
        // What was told is remembered.
        let found = crowd.character(id).unwrap();
        assert_eq!((found.level, found.placement.ground.x), (LevelId(0), 1.0));
    }
    // They come back by being set, while others stay where they are.
    for &id in &inactive[..20] {
        crowd.set(id, &characters[id.0 as usize]).unwrap();
    }
    let report = crowd.frame(&frame, &mut out).unwrap();
    assert_eq!((report.moved, report.sorted), (20, false));
    assert!(
        inactive[..20]
            .iter()
            .all(|&id| crowd.pose_slice(id).is_ok())
    );
}

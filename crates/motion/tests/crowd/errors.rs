//! Promise: what a crowd cannot do is said by name.

use super::pose::{default, stage};
use sabaki_fixtures::clips::{small_skeleton, swinging_clip};
use sabaki_fixtures::with;
use sabaki_motion::crowd::{AnimationSet, Character, ClipId, Crowd, CrowdError, LevelId, MemberId};
use sabaki_motion::lod::Levels;
use sabaki_motion::math::F32x16;

#[test]
fn errors_say_what_is_missing() {
    let stage = stage();
    let mut crowd = Crowd::new(stage.animations.clone(), default());
    let stranger = with(|s: &mut Character| s.clip = ClipId(3));
    let no_clip = CrowdError::NoSuchClip { clip: 3, clips: 3 };
    assert_eq!(crowd.add(&stranger), Err(no_clip.clone()));
    let id = crowd.add(&Character::default()).unwrap();
    assert_eq!(crowd.set(id, &stranger), Err(no_clip));
    let nobody = CrowdError::NoSuchCharacter {
        id: 1,
        characters: 1,
    };
    assert_eq!(
        crowd.set_level(MemberId(1), LevelId(0)),
        Err(nobody.clone())
    );
    assert_eq!(crowd.pose_slice(MemberId(1)), Err(nobody));
    let needed = crowd.output_len();
    let mut small = vec![F32x16::ZERO; needed - 1];
    let found = needed - 1;
    assert_eq!(
        crowd.pose(&mut small),
        Err(CrowdError::TooSmall { needed, found })
    );

    let skeleton = small_skeleton();
    let none = AnimationSet::new(
        &skeleton,
        &[],
        &Levels::in_order(&skeleton, &[]).unwrap().levels,
    );
    assert_eq!(none.unwrap_err(), CrowdError::NoClip);
    let clip = swinging_clip(&skeleton, 3, 0.1);
    let none = AnimationSet::new(&skeleton, &[clip], &[]);
    assert_eq!(none.unwrap_err(), CrowdError::NoLevel);
}

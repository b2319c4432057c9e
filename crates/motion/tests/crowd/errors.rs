//! Promise: what a crowd cannot do is said by name.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use super::pose::{default, stage};
use common::clips::{small_skeleton, swinging_clip};
use common::crowd::Stage;
use sabaki_motion::crowd::{
    AnimationSet, Character, ClipId, ClipMix, Crowd, CrowdError, LevelId, MemberId,
};
use sabaki_motion::lod::Levels;
use sabaki_motion::math::F32x16;

#[test]
fn clips_and_layers_are_told_apart() {
    let skeleton = small_skeleton();
    let clips = [swinging_clip(&skeleton, 20, 0.3)];
    let levels = Levels::in_order(&skeleton, &[]).unwrap();
    let stage = Stage::with_layers(&skeleton, &clips, &clips, &levels);
    let layer = stage.animations.layer(0).unwrap();
    assert_eq!(stage.animations.layer(1), None);
    let mut crowd = Crowd::new(stage.animations, default());
    let mix = |clip| {
        Some(ClipMix {
            clip,
            weight: 1.0,
            ..ClipMix::default()
        })
    };
    let fine = Character {
        layer: mix(layer),
        fade: mix(ClipId(0)),
        ..Character::default()
    };
    let id = crowd.add(&fine).unwrap();
    assert_eq!(crowd.character(id).unwrap(), fine);
    let mut wrong = |character| crowd.set(id, &character).unwrap_err();
    let is_layer = CrowdError::IsALayer { clip: layer.0 };
    assert_eq!(
        wrong(Character {
            clip: layer,
            ..fine
        }),
        is_layer
    );
    assert_eq!(
        wrong(Character {
            fade: mix(layer),
            ..fine
        }),
        is_layer
    );
    let not = CrowdError::NotALayer { clip: 0 };
    assert_eq!(
        wrong(Character {
            layer: mix(ClipId(0)),
            ..fine
        }),
        not
    );
    let unknown = CrowdError::NoSuchClip { clip: 2, clips: 1 };
    assert_eq!(
        wrong(Character {
            layer: mix(ClipId(2)),
            ..fine
        }),
        unknown
    );
}

#[test]
fn errors_say_what_is_missing() {
    let stage = stage();
    let mut crowd = Crowd::new(stage.animations.clone(), default());
    let stranger = Character {
        clip: ClipId(3),
        ..Character::default()
    };
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

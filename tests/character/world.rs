//! Characters of the embedded motions, for the tests of this folder.

use std::sync::{Arc, OnceLock};

use glam::Vec3;
use sabaki::anim::JointTransform;
use sabaki::character::{CharacterEvent, CharacterId, CharacterSettings, Characters, Goal, Threat};
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::random::Random;

/// Duration of a frame, in seconds.
pub(super) const FRAME: f32 = 1.0 / 60.0;

pub(super) fn baked() -> Arc<BakedGraph> {
    static BAKED: OnceLock<Arc<BakedGraph>> = OnceLock::new();
    Arc::clone(BAKED.get_or_init(|| Arc::new(embedded().clone())))
}

pub(super) fn characters(settings: CharacterSettings) -> Characters {
    Characters::new(baked(), settings).unwrap()
}

/// So many characters in a row, half of them walking.
pub(super) fn spawn(characters: &mut Characters, count: usize) -> Vec<CharacterId> {
    let one = |index: usize| {
        let place = Rigid2::new(index as f32, 8.0 * index as f32, 0.0);
        let id = characters.spawn(place).unwrap();
        if index % 2 == 1 {
            let velocity = Vec3::new(0.3, 0.0, 0.8);
            let facing = None;
            characters
                .steer(id, Goal::Walk { velocity, facing })
                .unwrap();
        }
        id
    };
    (0..count).map(one).collect()
}

pub(super) fn play(characters: &mut Characters, frames: usize) -> Vec<CharacterEvent> {
    let mut events = Vec::new();
    (0..frames).for_each(|_| characters.step(FRAME, &[], &mut events));
    events
}

pub(super) fn joints(characters: &mut Characters, id: CharacterId) -> Vec<JointTransform> {
    let count = characters.baked().graph().skeleton().len();
    let mut joints = vec![JointTransform::IDENTITY; count];
    characters.pose(id, &mut joints).unwrap();
    joints
}

/// A ball at a character, from somewhere around it; it reaches it after 0.5 to 1.3 s.
pub(super) fn ball(characters: &mut Characters, id: CharacterId, random: &mut Random) -> Threat {
    let mut number = |most: f32| random.float(0.0, most);
    let around = number(std::f32::consts::TAU);
    let (seconds, height, lead) = (0.3 + number(0.4), number(0.7) - 0.2, 0.2 + number(0.4));
    let middle = joints(characters, id)[0].translation + Vec3::Y * height;
    let from = Vec3::new(around.sin(), 0.1, around.cos()) * 4.0;
    let time = characters.now() + f64::from(lead);
    Threat {
        target: Some(id),
        seconds: 2.0 * seconds,
        ..Threat::ball(time, middle + from, -from / seconds, 0.1)
    }
}

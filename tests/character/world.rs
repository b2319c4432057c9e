//! Characters of the embedded motions, for the tests of this folder.

use std::sync::{Arc, OnceLock};

use glam::{Vec2, Vec3};
use sabaki::anim::JointTransform;
use sabaki::character::{
    CharacterEvent, CharacterEventKind, CharacterId, CharacterSettings, Characters, Goal, Threat,
};
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

pub(super) fn walk(velocity: Vec3) -> Goal {
    let facing = None;
    Goal::Walk { velocity, facing }
}

/// So many characters in a row, the first at the origin, every other one walking.
pub(super) fn spawn<const COUNT: usize>(characters: &mut Characters) -> [CharacterId; COUNT] {
    std::array::from_fn(|index| {
        let place = Rigid2::new(index as f32, 8.0 * index as f32, 0.0);
        let id = characters.spawn(place).unwrap();
        if index % 2 == 1 {
            let goal = walk(Vec3::new(0.3, 0.0, 0.8));
            characters.steer(id, goal).unwrap();
        }
        id
    })
}

/// The same, by default.
pub(super) fn game<const COUNT: usize>() -> (Characters, [CharacterId; COUNT]) {
    let mut game = characters(CharacterSettings::default());
    let ids = spawn(&mut game);
    (game, ids)
}

pub(super) fn play(characters: &mut Characters, frames: usize) -> Vec<CharacterEvent> {
    steps(characters, FRAME, frames)
}

pub(super) fn steps(characters: &mut Characters, dt: f32, count: usize) -> Vec<CharacterEvent> {
    let mut events = Vec::new();
    (0..count).for_each(|_| characters.step(dt, &[], &mut events));
    events
}

/// Plays a game on, and what is saved of it now, in bytes and by serde: they go on alike, to the bit.
pub(super) fn play_from_saved(
    game: &mut Characters,
    settings: CharacterSettings,
    frames: usize,
) -> Vec<CharacterEvent> {
    let [mut loaded, mut restored] = [characters(settings), characters(settings)];
    loaded.load(&game.save().unwrap()).unwrap();
    let text = serde_json::to_string(&game.state()).unwrap();
    let state = serde_json::from_str(&text).unwrap();
    restored.restore(state).unwrap();
    let events = play(game, frames);
    for mut other in [loaded, restored] {
        assert_eq!(play(&mut other, frames), events);
        assert!(other.save().unwrap() == game.save().unwrap());
    }
    events
}

/// The events of a kind.
pub(super) fn count(events: &[CharacterEvent], is: impl Fn(CharacterEventKind) -> bool) -> usize {
    events.iter().filter(|event| is(event.kind)).count()
}

pub(super) fn joints(characters: &mut Characters, id: CharacterId) -> Vec<JointTransform> {
    let count = characters.baked().graph().skeleton().len();
    let mut joints = vec![JointTransform::IDENTITY; count];
    characters.pose(id, &mut joints).unwrap();
    joints
}

pub(super) fn pelvis(characters: &mut Characters, id: CharacterId) -> Vec3 {
    joints(characters, id)[0].translation
}

pub(super) fn place(game: &Characters, id: CharacterId) -> Vec2 {
    game.place(id).unwrap().ground()
}

/// The way of a character over the ground within some frames.
pub(super) fn way(game: &mut Characters, id: CharacterId, frames: usize) -> Vec2 {
    let from = place(game, id);
    play(game, frames);
    place(game, id) - from
}

/// A [`ball`] at each.
pub(super) fn throw_at(game: &mut Characters, ids: &[CharacterId], random: &mut Random) {
    for &id in ids {
        let threat = ball(game, id, random);
        game.threaten(threat).unwrap();
    }
}

/// A ball at a character, from somewhere around it; it reaches it after 0.5 to 1.3 s.
pub(super) fn ball(characters: &mut Characters, id: CharacterId, random: &mut Random) -> Threat {
    let mut number = |most: f32| random.float(0.0, most);
    let around = number(std::f32::consts::TAU);
    let (seconds, height, lead) = (0.3 + number(0.4), number(0.7) - 0.2, 0.2 + number(0.4));
    let middle = pelvis(characters, id) + Vec3::Y * height;
    let from = Vec3::new(around.sin(), 0.1, around.cos()) * 4.0;
    let time = characters.now() + f64::from(lead);
    Threat {
        target: Some(id),
        seconds: 2.0 * seconds,
        ..Threat::ball(time, middle + from, -from / seconds, 0.1)
    }
}

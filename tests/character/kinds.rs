//! Promise: characters of several graphs share one game. Each plays as in a game of its own kind, and all know each other.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use sabaki::anim::JointTransform;
use sabaki::character::{
    CharacterError, CharacterEvent, CharacterEventKind, CharacterId, CharacterSettings, Characters,
    KindId, Threat,
};
use sabaki::math::Rigid2;
use sabaki_fixtures::random::Random;
use sabaki_fixtures::small::small;
use sabaki_fixtures::with;

use super::world::{FRAME, baked, characters, count, place, play, spawn, walk};

/// A game of two graphs with different skeletons.
fn mixed(settings: CharacterSettings) -> (Characters, KindId) {
    let mut game = characters(settings);
    let kind = game.add_kind(Arc::new(small().clone()), settings).unwrap();
    (game, kind)
}

/// Characters 3 and 4, far from all others.
fn spawn_far(game: &mut Characters, kind: KindId) -> [CharacterId; 2] {
    [100.0, 104.0].map(|x| game.spawn_kind(kind, Rigid2::new(0.3, x, 9.0)).unwrap())
}

fn pose(game: &Characters, id: CharacterId) -> Vec<JointTransform> {
    let joints = game.baked_of(id).unwrap().graph().skeleton().len();
    let mut pose = vec![JointTransform::IDENTITY; joints];
    game.pose(id, &mut pose).unwrap();
    pose
}

/// A ball at each, which comes in half a second.
fn throw_at(game: &mut Characters, ids: &[CharacterId], random: &mut Random) {
    for &id in ids {
        let root = pose(game, id)[0].translation;
        let way = Vec3::new(random.float(-3.0, 3.0), 0.2, 3.0);
        let mut threat = Threat::ball(game.now(), root + way, way * -2.0, 0.1);
        threat.target = Some(id);
        game.threaten(threat).unwrap();
    }
}

fn of(events: &[CharacterEvent], ids: &[CharacterId]) -> Vec<(u64, String)> {
    let own = events.iter().filter(|event| ids.contains(&event.character));
    // The ids of threats differ.
    let kinds = own.map(|event| {
        let kind = format!("{:?}", std::mem::discriminant(&event.kind));
        (event.time.to_bits() ^ event.character.to_bits(), kind)
    });
    kinds.collect()
}

#[test]
fn kinds_that_do_not_meet_play_as_in_games_of_their_own() {
    for threads in [1, 2] {
        let settings = with(|s: &mut CharacterSettings| s.threads = threads);
        let (mut game, kind) = mixed(settings);
        let people = spawn::<3>(&mut game);
        let others = spawn_far(&mut game, kind);
        let mut alone = characters(CharacterSettings::default());
        assert_eq!(spawn::<3>(&mut alone), people);
        let small = Arc::new(small().clone());
        let mut small = Characters::new(small, CharacterSettings::default()).unwrap();
        for x in [-2000.0, -2100.0, -2200.0] {
            small.spawn(Rigid2::new(0.0, x, 0.0)).unwrap();
        }
        assert_eq!(spawn_far(&mut small, KindId::default()), others);
        assert_eq!(game.kind(others[1]).unwrap(), kind);
        let mut planned = [0, 0];
        for round in 0..6 {
            let random = || Random::new(round);
            throw_at(&mut game, &people, &mut random());
            throw_at(&mut game, &others, &mut random());
            throw_at(&mut alone, &people, &mut random());
            throw_at(&mut small, &others, &mut random());
            for _ in 0..60 {
                let [all, own, far] = [&mut game, &mut alone, &mut small].map(|game| play(game, 1));
                assert_eq!(of(&all, &people), of(&own, &people));
                assert_eq!(of(&all, &others), of(&far, &others));
                for (planned, events) in planned.iter_mut().zip([&own, &far]) {
                    let is_answer = |kind| {
                        use CharacterEventKind::{Cannot, Kept, Planned};
                        matches!(kind, Planned { .. } | Kept { .. } | Cannot)
                    };
                    *planned += count(events, is_answer);
                }
                for &id in &people {
                    assert_eq!(pose(&game, id), pose(&alone, id));
                }
                for &id in &others {
                    assert_eq!(pose(&game, id), pose(&small, id));
                }
            }
        }
        assert!(planned.iter().all(|&planned| planned > 5), "{planned:?}");
    }
}

/// How far a walker goes aside where another one stands in its way, whose kind has a body of this radius.
fn goes_aside(radius: f32) -> f32 {
    let with = |body_radius| with(|s: &mut CharacterSettings| s.body_radius = body_radius);
    let mut game = characters(with(0.3));
    let kind = game.add_kind(baked(), with(radius)).unwrap();
    let walker = game.spawn(Rigid2::IDENTITY).unwrap();
    let from = place(&game, walker);
    game.spawn_kind(kind, Rigid2::new(0.0, from.x, 4.0))
        .unwrap();
    game.steer(walker, walk(Vec3::Z * 1.2)).unwrap();
    let aside = (0..360).map(|_| {
        play(&mut game, 1);
        (place(&game, walker) - Vec2::new(from.x, 0.0)).x.abs()
    });
    aside.fold(0.0, f32::max)
}

#[test]
fn a_kind_has_settings_of_its_own() {
    let [none, body] = [0.0, 0.4].map(goes_aside);
    assert!(none < 0.3 && body > none + 0.2, "{none} {body}");
}

#[test]
fn a_game_of_several_kinds_is_saved_as_one() {
    let settings = CharacterSettings::default();
    let (mut game, kind) = mixed(settings);
    let people = spawn::<3>(&mut game);
    let others = spawn_far(&mut game, kind);
    throw_at(&mut game, &people, &mut Random::new(3));
    throw_at(&mut game, &others, &mut Random::new(4));
    play(&mut game, 10);
    let saved = game.save().unwrap();
    let (mut loaded, _) = mixed(settings);
    loaded.load(&saved).unwrap();
    assert_eq!(play(&mut game, 90), play(&mut loaded, 90));
    assert!(game.save().unwrap() == loaded.save().unwrap());
    let error = characters(settings).load(&saved).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the saved state belongs to another graph"
    );
    let unknown = game.spawn_kind(KindId(7), Rigid2::IDENTITY);
    assert_eq!(unknown, Err(CharacterError::NoSuchKind(KindId(7))));
}

#[test]
fn one_character_goes_on_in_another_game_to_the_same_bit() {
    let settings = CharacterSettings::default();
    let [(mut from, kind), (mut to, _)] = [mixed(settings), mixed(settings)];
    for game in [&mut from, &mut to] {
        spawn::<3>(game);
        spawn_far(game, kind);
        play(game, 40);
    }
    let id = |index| CharacterId::from_bits(index);
    // The host of the one moves a character, and steers it otherwise.
    from.move_by(id(1), Rigid2::new(0.4, 1.0, 0.0)).unwrap();
    from.steer(id(1), walk(Vec3::X)).unwrap();
    play(&mut from, 30);
    play(&mut to, 30);
    for game in [&mut from, &mut to] {
        let root = Vec3::new(1.0, 1.0, 8.0);
        let ball = Threat::ball(game.now(), root + Vec3::Z * 4.0, Vec3::Z * -8.0, 0.1);
        game.threaten(ball).unwrap();
    }
    let saved = from.save_character(id(1)).unwrap();
    assert_ne!(pose(&from, id(1)), pose(&to, id(1)));
    to.load_character(id(1), &saved).unwrap();
    for _ in 0..90 {
        let own = |game: &mut Characters| of(&play(game, 1), &[id(1)]);
        assert_eq!(own(&mut from), own(&mut to));
        assert_eq!(pose(&from, id(1)), pose(&to, id(1)));
    }
    // What does not fit is refused, and what is damaged, and changes nothing.
    let before = to.save().unwrap();
    let mut refused = |id, bytes: &[u8]| to.load_character(id, bytes).unwrap_err().to_string();
    let words = "the saved state belongs to another graph";
    assert_eq!(refused(id(3), &saved), words);
    let words = "the saved state does not begin with the mark of a saved character";
    assert_eq!(refused(id(1), &before), words);
    let mut random = Random::new(5);
    for _ in 0..50 {
        let mut damaged = saved.clone();
        damaged[random.below(saved.len())] ^= 1 << random.below(8);
        refused(id(1), &damaged);
    }
    assert!(to.save().unwrap() == before);
    // With a checksum it is refused, or harmless.
    for _ in 0..100 {
        let mut damaged = saved.clone();
        damaged[16 + random.below(saved.len() - 16)] ^= 1 << random.below(8);
        let checksum = crc32fast::hash(&damaged[16..]);
        damaged[12..16].copy_from_slice(&checksum.to_le_bytes());
        if to.load_character(id(1), &damaged).is_ok() {
            to.step(FRAME, &[], &mut Vec::new());
        }
    }
}

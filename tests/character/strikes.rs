//! Promise: a character goes to where an attack of its clips reaches, and strikes; its limb is a threat to others, and is where its pose is; what
//! is said of a strike is what the poses show; a fight is saved, loaded and shared among threads bit for bit.

use std::collections::BTreeMap;
use std::f32::consts::{PI, TAU};

use glam::Vec3;
use sabaki::character::{
    CharacterError, CharacterEvent, CharacterEventKind as Kind, CharacterId, CharacterSettings,
    Characters, Goal, StrikeAt, StrikeKind, ThreatId,
};
use sabaki::graph::EdgeId;
use sabaki::math::{Rigid2, Sphere};
use sabaki_fixtures::memory::allocations;
use sabaki_fixtures::with;

use super::world::{FRAME, characters, count, game, joints, play, play_from_saved, steps};

/// Nobody sees a threat, so that every strike lands that reaches.
fn unseeing() -> CharacterSettings {
    CharacterSettings {
        horizon: 0.0,
        ..fighting()
    }
}

fn fighting() -> CharacterSettings {
    with(|s: &mut CharacterSettings| s.body_radius = 0.15)
}

/// So many characters on a circle that face its middle.
fn circle(settings: CharacterSettings, count: usize) -> (Characters, Vec<CharacterId>) {
    let mut game = characters(settings);
    let radius = 0.25 * count as f32;
    let one = |index: usize| {
        let around = TAU * index as f32 / count as f32;
        let place = Rigid2::new(around + PI, radius * around.sin(), radius * around.cos());
        game.spawn(place).unwrap()
    };
    let ids = (0..count).map(one).collect();
    (game, ids)
}

/// Two of which the first one strikes the second one.
fn duel(settings: CharacterSettings) -> (Characters, [CharacterId; 2]) {
    let (mut game, ids) = circle(settings, 2);
    let at = StrikeAt::Character(ids[1]);
    strike(&mut game, ids[0], at, StrikeKind::Any).unwrap();
    (game, [ids[0], ids[1]])
}

/// A [`circle`] of which each one strikes the next one.
fn fight(settings: CharacterSettings, count: usize) -> (Characters, Vec<CharacterId>) {
    let (mut game, ids) = circle(settings, count);
    for (index, &id) in ids.iter().enumerate() {
        let at = StrikeAt::Character(ids[(index + 1) % count]);
        strike(&mut game, id, at, StrikeKind::Any).unwrap();
    }
    (game, ids)
}

fn strike(
    game: &mut Characters,
    id: CharacterId,
    at: StrikeAt,
    kind: StrikeKind,
) -> Result<(), CharacterError> {
    game.steer(id, Goal::Strike { at, kind })
}

/// The strikes that were announced: who strikes, the limb and the attack.
fn strikes(events: &[CharacterEvent]) -> Vec<(CharacterId, ThreatId, EdgeId)> {
    let announced = events.iter().filter_map(|event| match event.kind {
        Kind::Strikes { threat, attack, .. } => Some((event.character, threat, attack)),
        _ => None,
    });
    announced.collect()
}

/// The spheres of a character's body.
fn body(game: &mut Characters, id: CharacterId) -> Vec<Sphere> {
    let joints = joints(game, id);
    let spheres = game.baked().body().spheres.iter();
    spheres
        .map(|part| Sphere::new(part.centre(&joints), part.radius))
        .collect()
}

/// The limb of a strike now, if it strikes.
fn limb(game: &Characters, threat: ThreatId) -> Option<Vec<Sphere>> {
    let mut limb = Vec::new();
    game.limb(threat, game.now(), &mut limb).ok()?;
    Some(limb)
}

fn apart(a: &[Sphere], b: &[Sphere]) -> f32 {
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
    let apart = pairs.map(|(a, b)| a.centre.distance(b.centre) - a.radius - b.radius);
    apart.fold(f32::INFINITY, f32::min)
}

/// How far the worst sphere of a limb is from the nearest one of a body.
fn off(limb: &[Sphere], body: &[Sphere]) -> f32 {
    let nearest = limb.iter().map(|sphere| {
        let off = body.iter().map(|own| own.centre.distance(sphere.centre));
        off.fold(f32::INFINITY, f32::min)
    });
    nearest.fold(0.0, f32::max)
}

/// Steps shorter than the poses of a limb, so that these alone tell the distance.
#[test]
fn what_is_said_of_a_strike_is_what_the_poses_show() {
    const STEP: f32 = 1.0 / 480.0;
    let (mut game, ids) = duel(unseeing());
    // Limb, begin and end of the attack, and the least distance so far.
    let mut running: Option<(ThreatId, f32)> = None;
    let (mut told, mut struck, mut whole) = (BTreeMap::new(), 0, 0);
    for _ in 0..480 * 20 {
        for event in steps(&mut game, STEP, 1) {
            match event.kind {
                Kind::Strikes { threat, .. } => running = Some((threat, f32::INFINITY)),
                Kind::Struck { by, threat, .. } => {
                    assert_eq!((event.character, by), (ids[1], ids[0]));
                    assert!(told.insert(threat, true).is_none(), "said twice");
                }
                Kind::MissedBy { threat, metres } => {
                    assert!(told.insert(threat, false).is_none(), "said twice");
                    assert!(metres >= 0.0);
                }
                Kind::StrikeEnded { is_whole } => {
                    whole += usize::from(is_whole);
                    let (threat, least) = running.take().unwrap();
                    if least.abs() > 0.01 {
                        assert_eq!(told.get(&threat) == Some(&true), least < 0.0, "{least}");
                        struck += usize::from(least < 0.0);
                    }
                }
                _ => {}
            }
        }
        if let Some((threat, least)) = &mut running
            && game.limb(*threat, game.now(), &mut Vec::new()).is_ok()
        {
            let (limb, other) = (limb(&game, *threat).unwrap(), body(&mut game, ids[1]));
            // While the attack plays, the limb is that of the pose.
            if off(&limb, &body(&mut game, ids[0])) < 5e-3 {
                *least = least.min(apart(&limb, &other));
            }
        }
    }
    assert!(whole > 4 && struck > 2, "{whole} {struck}");
}

#[test]
fn a_place_that_is_struck_is_reached() {
    let (mut game, [id]) = game::<1>();
    let place = Vec3::new(0.1, 1.2, 0.8);
    strike(&mut game, id, StrikeAt::Place(place), StrikeKind::Any).unwrap();
    let (mut least, mut running, mut reached) = (f32::INFINITY, None, Vec::new());
    for _ in 0..60 * 20 {
        for event in play(&mut game, 1) {
            match event.kind {
                Kind::Strikes { threat, .. } => running = Some(threat),
                Kind::StrikeEnded { is_whole } => {
                    assert!(is_whole);
                    running = None;
                    reached.push(std::mem::replace(&mut least, f32::INFINITY));
                }
                _ => {}
            }
        }
        let limb = running.and_then(|threat| limb(&game, threat));
        least = least.min(apart(&limb.unwrap_or_default(), &[Sphere::new(place, 0.0)]));
    }
    let near = reached.iter().filter(|&&metres| metres < 0.15).count();
    assert!(near > 4 && 5 * near >= 4 * reached.len(), "{reached:?}");
}

#[test]
fn most_strikes_that_are_seen_are_avoided() {
    let outcomes = [unseeing(), fighting()].map(|settings| {
        let events = play(&mut duel(settings).0, 60 * 30);
        let struck = count(&events, |kind| matches!(kind, Kind::Struck { .. }));
        (strikes(&events).len(), struck)
    });
    let [(blind, hit), (seen, struck)] = outcomes;
    assert!(blind > 5 && 3 * hit > blind, "{outcomes:?}");
    assert!(seen > 3 && 3 * struck * blind < hit * seen, "{outcomes:?}");
}

#[test]
fn only_the_attacks_of_a_kind_are_chosen() {
    let (mut game, ids) = circle(unseeing(), 2);
    let at = StrikeAt::Character(ids[1]);
    let attack = game.baked().attack_moves()[0].edge;
    strike(&mut game, ids[0], at, StrikeKind::Attack(attack)).unwrap();
    let played = strikes(&play(&mut game, 60 * 15));
    assert!(!played.is_empty() && played.iter().all(|&(_, _, edge)| edge == attack));
    let graph = game.baked().graph();
    let event = graph.event(graph.edge(attack).event.unwrap());
    let joint = event.joints[0];
    strike(&mut game, ids[0], at, StrikeKind::Limb(joint)).unwrap();
    play(&mut game, 60);
    let played = strikes(&play(&mut game, 60 * 30));
    let graph = game.baked().graph();
    for (_, _, edge) in &played {
        let event = graph.event(graph.edge(*edge).event.unwrap());
        let mut above = graph.skeleton().ancestry(joint);
        assert!(above.any(|above| event.joints.contains(&above)));
    }
    assert!(!played.is_empty());
}

#[test]
fn what_cannot_be_struck_is_refused() {
    let (mut game, ids) = circle(fighting(), 2);
    let other = StrikeAt::Character(ids[1]);
    let none = StrikeKind::Attack(EdgeId(u32::MAX));
    let refused = Err(CharacterError::CannotStrike);
    assert_eq!(strike(&mut game, ids[0], other, none), refused);
    let itself = StrikeAt::Character(ids[0]);
    assert_eq!(strike(&mut game, ids[0], itself, StrikeKind::Any), refused);
    let far = StrikeAt::Place(Vec3::splat(f32::NAN));
    assert!(strike(&mut game, ids[0], far, StrikeKind::Any).is_err());
    strike(&mut game, ids[0], other, StrikeKind::Any).unwrap();
    // Who has nothing to strike any more stands.
    game.despawn(ids[1]).unwrap();
    play(&mut game, 120);
    assert!(strike(&mut game, ids[0], other, StrikeKind::Any).is_err());
    assert!(strikes(&play(&mut game, 300)).is_empty());
}

/// Plays until a strike is announced and its attack has begun.
fn until_struck(game: &mut Characters) -> (CharacterId, ThreatId) {
    for _ in 0..60 * 20 {
        if let Some(&(id, threat, _)) = strikes(&play(game, 1)).last() {
            return (id, threat);
        }
    }
    panic!("nobody strikes");
}

#[test]
fn a_limb_moves_with_its_character_and_ends_with_its_strike() {
    for ends in 0..3 {
        let (mut game, ids) = duel(unseeing());
        let (id, threat) = until_struck(&mut game);
        game.move_by(id, Rigid2::new(0.3, 2.0, 0.0)).unwrap();
        game.set_height(id, 1.0).unwrap();
        // The attack has begun after the longest lead-in.
        let mut frames = 0;
        while frames < 120 && limb(&game, threat).is_some() {
            play(&mut game, 1);
            frames += 1;
            if frames == 40
                && let Some(limb) = limb(&game, threat)
            {
                // A limb before its attack is where that begins.
                let off = off(&limb, &body(&mut game, id));
                assert!(off < 0.02, "{off} m at {}", game.now());
            }
        }
        assert!((10..120).contains(&frames), "{frames}");
        // Moved away, it reaches nobody.
        game.move_by(id, Rigid2::new(0.0, -2.0, 0.0)).unwrap();
        game.set_height(id, 0.0).unwrap();
        let (id, threat) = match ends {
            0 => continue,
            _ => {
                game.despawn(ids[1]).unwrap();
                let around = Rigid2::new(PI, 0.0, 0.0);
                let place = game.place(id).unwrap() * Rigid2::new(0.0, 0.0, 0.8) * around;
                let other = game.spawn(place).unwrap();
                let at = StrikeAt::Character(other);
                strike(&mut game, id, at, StrikeKind::Any).unwrap();
                until_struck(&mut game)
            }
        };
        match ends {
            1 => game.release(id).unwrap(),
            _ => game.despawn(id).unwrap(),
        }
        let events = play(&mut game, 120);
        assert!(limb(&game, threat).is_none());
        let struck = count(&events, |kind| matches!(kind, Kind::Struck { .. }));
        assert_eq!(struck, 0, "{events:?}");
        let broken = Kind::StrikeEnded { is_whole: false };
        let ended = count(&events, |kind| kind == broken);
        assert_eq!(ended, usize::from(ends == 1));
    }
}

#[test]
fn a_fight_is_saved_loaded_and_shared_among_threads_bit_for_bit() {
    let (mut game, _) = fight(fighting(), 4);
    let mut threads = fighting();
    threads.threads = 3;
    let (mut shared, _) = fight(threads, 4);
    let (mut events, mut moments) = (Vec::new(), 0);
    for _ in 0..60 * 12 {
        let happened = play(&mut game, 1);
        assert_eq!(play(&mut shared, 1), happened);
        let begins = !strikes(&happened).is_empty();
        events.extend(happened);
        if begins && moments < 3 {
            moments += 1;
            assert!(game.save().unwrap() == shared.save().unwrap());
            let later = play_from_saved(&mut game, fighting(), 30);
            assert_eq!(play(&mut shared, 30), later);
            events.extend(later);
        }
    }
    assert_eq!(moments, 3);
    // What is said of a limb is said once to each.
    let mut told = BTreeMap::new();
    for event in &events {
        if let Kind::Struck { threat, .. } | Kind::MissedBy { threat, .. } = event.kind {
            *told.entry((threat, event.character)).or_insert(0) += 1;
        }
    }
    assert!(told.values().all(|&times| times == 1), "{told:?}");
}

#[test]
fn a_fight_hardly_allocates_once_warm() {
    const FRAMES: usize = 60 * 10;
    let (mut game, _) = fight(fighting(), 4);
    let mut events = Vec::with_capacity(10_000);
    let made = [(); 4].map(|()| {
        let before = allocations();
        for _ in 0..FRAMES {
            game.step(FRAME, &[], &mut events);
        }
        allocations() - before
    });
    assert!(!strikes(&events).is_empty());
    // A motion or a list of threats may still become longer than any before.
    assert!(made[3] < FRAMES as u64 / 4, "{made:?}");
}

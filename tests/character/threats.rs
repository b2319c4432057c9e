//! Promise: what a character says of a threat is what its poses show; nothing pops.

use glam::{Quat, Vec3};
use sabaki::anim::{EventKind, JointId};
use sabaki::character::{
    CharacterError, CharacterEventKind as Kind, CharacterId, CharacterSettings, Characters, Goal,
    Threat, ThreatId,
};
use sabaki_fixtures::clips::most_apart;
use sabaki_fixtures::memory::allocations;
use sabaki_fixtures::random::Random;
use sabaki_fixtures::with;

use super::world::{
    FRAME, baked, ball, characters, count, game, joints, pelvis, play, spawn, steps, throw_at, walk,
};

/// The smallest distance of a ball from a character's spheres at one moment.
fn distance(characters: &mut Characters, id: CharacterId, threat: &Threat) -> f32 {
    let joints = joints(characters, id);
    let at = threat.at(characters.now());
    let spheres = &characters.baked().body().spheres;
    let apart = spheres.iter().map(|sphere| {
        sphere.centre(&joints).distance(at) - sphere.radius - threat.spheres[0].radius
    });
    apart.fold(f32::INFINITY, f32::min)
}

#[test]
fn what_is_said_of_a_threat_is_what_the_poses_show() {
    let mut random = Random::new(5);
    let (mut characters, ids) = game::<4>();
    let (mut hits, mut misses) = (0, 0);
    for round in 0..6 {
        play(&mut characters, 60 + round);
        for &id in &ids {
            let threat = ball(&mut characters, id, &mut random);
            let name = characters.threaten(threat.clone()).unwrap();
            let mut least = f32::INFINITY;
            let (mut is_hit, mut missed_by) = (false, None);
            // Steps so short that the moments alone tell the distance.
            for _ in 0..1000 {
                let events = steps(&mut characters, 1.0 / 500.0, 1);
                if (threat.time..threat.time + f64::from(threat.seconds))
                    .contains(&characters.now())
                {
                    least = least.min(distance(&mut characters, id, &threat));
                }
                for event in &events {
                    match event.kind {
                        Kind::Hit { threat, .. } if threat == name => is_hit = true,
                        Kind::MissedBy { threat, metres } if threat == name => {
                            missed_by = Some(metres);
                        }
                        _ => {}
                    }
                    assert_eq!(event.character, id);
                }
            }
            assert_eq!(characters.threats().count(), 0);
            if least.abs() > 0.01 {
                assert_eq!(is_hit, least < 0.0, "{least}");
            }
            if let Some(metres) = missed_by {
                let is_far = metres > 0.3 && (least - 0.02..5.0).contains(&metres);
                assert!(is_far || (metres - least).abs() < 0.02, "{metres} {least}");
                misses += 1;
            }
            hits += usize::from(is_hit);
        }
    }
    assert!(misses > 12 && misses > hits, "{misses} {hits}");
}

/// A character that leans its trunk to a side, and the lean.
fn leaning(angle: f32) -> (Characters, CharacterId) {
    let (mut game, [id]) = game::<1>();
    let baked = baked();
    let mut joints = baked.graph().skeleton().joints().iter();
    let spine = joints.position(|joint| joint.name == "Spine");
    let lean = (JointId(spine.unwrap() as u16), Quat::from_rotation_z(angle));
    game.set_additive(id, &[lean]).unwrap();
    play(&mut game, 60);
    (game, id)
}

#[test]
fn what_is_added_to_the_joints_is_seen_by_plans_and_hits() {
    let top = |game: &mut Characters, id: CharacterId| {
        let joints = joints(game, id);
        let heights = joints.iter().map(|joint| joint.translation);
        heights.max_by(|a, b| a.y.total_cmp(&b.y)).unwrap()
    };
    let (mut straight, mut sure) = (leaning(0.0), 0);
    let upright = top(&mut straight.0, straight.1);
    for round in 0..24 {
        let (mut game, id) = leaning(0.9);
        play(&mut game, 7 * round);
        let head = top(&mut game, id);
        assert!(head.distance(upright) > 0.3, "{head} {upright}");
        // To where the head is.
        let around = round as f32;
        let way = Vec3::new(around.sin(), 0.1, around.cos()) * 5.0;
        let threat = Threat::ball(game.now(), head + way, way * -1.2, 0.08);
        let name = game.threaten(threat.clone()).unwrap();
        let (mut least, mut is_hit, mut planned) = (f32::INFINITY, false, false);
        for _ in 0..400 {
            for event in steps(&mut game, 1.0 / 300.0, 1) {
                match event.kind {
                    Kind::Hit { threat, .. } => is_hit |= threat == name,
                    Kind::Planned { .. } => planned = true,
                    Kind::Cannot => planned = false,
                    _ => {}
                }
            }
            least = least.min(distance(&mut game, id, &threat));
        }
        assert!(least.abs() < 0.01 || is_hit == (least < 0.0), "{least}");
        // What was planned with the lean is played with it.
        assert!(!planned || least > -0.003, "{round}: {least}");
        sure += usize::from(planned);
    }
    assert!(sure > 12, "{sure}");
    let wrong = straight
        .0
        .set_additive(straight.1, &[(JointId(999), Quat::IDENTITY)]);
    assert!(wrong.is_err());
    let long = [(JointId(1), Quat::from_xyzw(0.0, 0.0, 0.5, 1.0))];
    assert!(straight.0.set_additive(straight.1, &long).is_err());
}

#[test]
fn a_hit_names_the_joint_and_the_point_that_is_deepest() {
    let mut random = Random::new(3);
    let (mut game, ids) = game::<4>();
    let mut hits = 0;
    for _ in 0..5 {
        play(&mut game, 40);
        for &id in &ids {
            let mut threat = ball(&mut game, id, &mut random);
            // It is seen too late.
            let moved = threat.velocity * 0.9 * (0.5 * threat.seconds);
            threat.position += moved;
            threat.time = game.now();
            game.threaten(threat).unwrap();
        }
        for _ in 0..80 {
            for event in steps(&mut game, 1.0 / 240.0, 1) {
                let Kind::Hit {
                    threat,
                    joint,
                    point,
                    depth,
                    normal,
                } = event.kind
                else {
                    continue;
                };
                hits += 1;
                let known = game.threats().find(|(id, _)| *id == threat);
                let ball = known.unwrap().1.at(event.time);
                assert!((normal.length() - 1.0).abs() < 1e-4 && depth > 0.0);
                // The ball and the joint's sphere have moved by less since.
                assert!((point - normal * depth).distance(ball) < 0.1 + 0.1);
                let at = joints(&mut game, event.character);
                let spheres = game.baked().body().spheres.iter();
                let own = spheres.filter(|sphere| sphere.joint == joint);
                let off = own.map(|one| (one.centre(&at).distance(point) - one.radius).abs());
                assert!(off.fold(f32::INFINITY, f32::min) < 0.05, "{joint:?}");
            }
        }
    }
    assert!(hits > 5, "{hits}");
}

#[test]
fn a_dodge_names_what_comes_first_and_its_end_is_said_once() {
    let mut random = Random::new(23);
    let (mut game, [id]) = game::<1>();
    let mut planned = 0;
    for _ in 0..12 {
        play(&mut game, 60);
        let near = ball(&mut game, id, &mut random);
        let contact = near.time + 0.5 * f64::from(near.seconds);
        let near = game.threaten(near).unwrap();
        let events = play(&mut game, 240);
        let mut dodges = 0;
        for event in &events {
            match event.kind {
                Kind::Planned {
                    threat,
                    contact: told,
                    ..
                } => {
                    assert_eq!(threat, near);
                    assert!((told - contact).abs() < 0.2, "{told} {contact}");
                    dodges = 1;
                }
                Kind::Ended => {
                    assert_eq!(std::mem::take(&mut dodges), 1);
                    planned += 1;
                }
                _ => {}
            }
        }
        assert_eq!(dodges, 0, "{events:?}");
    }
    assert!(planned > 5, "{planned}");
}

#[test]
fn nothing_is_said_twice_of_a_threat_however_long_a_frame_is() {
    let mut random = Random::new(31);
    for dt in [1.0 / 240.0, 1.0 / 30.0, 0.1, 0.25] {
        let (mut game, ids) = game::<4>();
        let mut ends = std::collections::BTreeMap::new();
        for _ in 0..5 {
            for &id in &ids {
                let mut threat = ball(&mut game, id, &mut random);
                threat.seconds = 3.0;
                ends.insert(game.threaten(threat).unwrap(), 0);
            }
            for event in steps(&mut game, dt, (4.0 / dt) as usize) {
                if let Kind::Hit { threat, .. } | Kind::MissedBy { threat, .. } = event.kind {
                    *ends.get_mut(&threat).unwrap() += 1;
                }
            }
        }
        assert!(ends.values().all(|&ends| ends == 1), "{dt}: {ends:?}");
    }
}

#[test]
fn nothing_pops_at_any_delay() {
    /// A joint goes less far within this time, seconds and metres. The knee of a leg that is nearly straight goes millimetres where rounding moves
    /// its foot by micrometres.
    const MOMENT: (f32, f32) = (2e-5, 3e-3);
    let mut random = Random::new(11);
    for delay in [0, 1, 2, 6] {
        let settings = with(|s: &mut CharacterSettings| s.delay = delay);
        let (mut game, mut other) = (characters(settings), characters(settings));
        let ids = spawn::<2>(&mut game);
        let mut began = 0;
        for frame in 0..600 {
            if frame % 80 == 20 {
                throw_at(&mut game, &ids, &mut random);
            }
            let before: Vec<_> = ids.iter().map(|&id| joints(&mut game, id)).collect();
            other.restore(game.state()).unwrap();
            other.step(MOMENT.0, &[], &mut Vec::new());
            for (&id, before) in ids.iter().zip(&before) {
                let later = joints(&mut other, id);
                let apart = most_apart(before, &later);
                assert!(apart < MOMENT.1, "delay {delay}, frame {frame}: {apart} m");
            }
            began += count(&play(&mut game, 1), |kind| kind == Kind::Began);
        }
        assert!(began > 3, "delay {delay}: {began}");
    }
}

const WAY: Vec3 = Vec3::new(0.3, 0.0, 1.2);

/// Frames in which some characters play an evasion although their threats have passed. They walk until they are threatened, stop, and have `goal`
/// once they have planned.
fn frames_of_evasions(goal: Goal) -> usize {
    let mut random = Random::new(19);
    let (mut game, ids) = game::<12>();
    let mut evading = 0;
    for _ in 0..4 {
        ids.iter()
            .for_each(|&id| game.steer(id, walk(WAY)).unwrap());
        play(&mut game, 120);
        let mut ends = Vec::new();
        for &id in &ids {
            let threat = ball(&mut game, id, &mut random);
            ends.push(threat.time + f64::from(threat.seconds));
            game.threaten(threat).unwrap();
            game.steer(id, Goal::Idle).unwrap();
        }
        let last = ends.iter().copied().fold(0.0, f64::max);
        play(&mut game, 1);
        ids.iter().for_each(|&id| game.steer(id, goal).unwrap());
        let frames = ((last + 1.0 - game.now()) / f64::from(FRAME)) as usize;
        for _ in 0..frames {
            play(&mut game, 1);
            for (&id, &end) in ids.iter().zip(&ends) {
                let graph = game.baked().graph();
                let event = graph.edge(game.playhead(id).unwrap().edge).event;
                let kind = event.map(|event| graph.event(event).kind);
                evading += usize::from(game.now() > end && kind == Some(EventKind::Evasion));
            }
        }
    }
    evading
}

#[test]
fn who_walks_on_leaves_an_evasion_when_its_threat_has_passed() {
    let [walks, stands] = [walk(WAY), Goal::Idle].map(frames_of_evasions);
    println!("{walks} {stands}");
    assert!(2 * walks < stands && stands > 40, "{walks} {stands}");
}

#[test]
fn those_that_are_reached_first_plan_first() {
    let one_at_a_time = with(|s: &mut CharacterSettings| s.plans_per_step = 1);
    let no_time_for_two = with(|s: &mut CharacterSettings| s.plan_milliseconds = 1e-6);
    for settings in [one_at_a_time, no_time_for_two] {
        let mut characters = characters(settings);
        let ids = spawn::<3>(&mut characters);
        play(&mut characters, 5);
        for (index, &id) in ids.iter().enumerate() {
            throw(&mut characters, id, 1.2 - 0.2 * index as f32);
        }
        let mut events = play(&mut characters, 40);
        events.retain(|event| looks(event.kind));
        let order: Vec<_> = events.iter().map(|event| event.character).collect();
        // Later a plan may change.
        assert_eq!(order[..3], [ids[2], ids[1], ids[0]]);
    }
}

/// Whether an event is the first of a plan.
fn looks(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::Planned { .. } | Kind::Kept { .. } | Kind::Cannot
    )
}

/// Throws a ball at a character, which reaches it after so many seconds.
fn throw(characters: &mut Characters, target: CharacterId, seconds: f32) {
    let middle = pelvis(characters, target);
    let velocity = Vec3::new(0.0, 0.0, -8.0);
    let from = middle - velocity * seconds;
    let threat = Threat::ball(characters.now(), from, velocity, 0.1);
    let target = Some(target);
    characters.threaten(Threat { target, ..threat }).unwrap();
}

/// A plan that is broken off is finished in a later step.
#[test]
fn plans_for_which_there_is_no_time_are_made_later() {
    for threads in [1, 2] {
        let mut characters = characters(CharacterSettings {
            plan_milliseconds: 0.4,
            threads,
            ..CharacterSettings::default()
        });
        let ids = spawn::<4>(&mut characters);
        play(&mut characters, 20);
        for &id in &ids {
            throw(&mut characters, id, 1.2);
        }
        let events = play(&mut characters, 60);
        for id in ids {
            let mut own = events.iter().filter(|event| event.character == id);
            assert!(own.any(|event| looks(event.kind)), "{id:?}");
        }
    }
}

/// Answers to balls that are seen early, and the saved game at the end, with a limit of the work of a plan in a step.
fn answers_within(plan_work: u32, threads: usize) -> ([usize; 2], Vec<u8>) {
    let mut random = Random::new(41);
    let mut game = characters(CharacterSettings {
        plan_work,
        threads,
        ..CharacterSettings::default()
    });
    let ids = spawn::<6>(&mut game);
    let mut answers = [0, 0];
    for _ in 0..6 {
        play(&mut game, 60);
        throw_at(&mut game, &ids, &mut random);
        let events = play(&mut game, 100);
        answers[0] += count(&events, |kind| matches!(kind, Kind::Planned { .. }));
        answers[1] += count(&events, |kind| kind == Kind::Cannot);
    }
    (answers, game.save().unwrap())
}

#[test]
fn plans_of_little_work_go_on_in_the_next_step_and_do_not_depend_on_the_threads() {
    let ([all, none], _) = answers_within(0, 1);
    let (little, saved) = answers_within(300, 1);
    println!("{all} {none} {little:?}");
    assert!(all > 10 && little[0] * 10 >= all * 9, "{little:?} of {all}");
    let others = answers_within(300, 3);
    assert_eq!(others.0, little);
    assert!(others.1 == saved, "the saved games differ");
}

/// A character with a ball of a radius that stays in its chest for so many seconds.
fn with_a_ball_in_the_chest(radius: f32, seconds: f32) -> (Characters, CharacterId, ThreatId) {
    let (mut game, [id]) = game::<1>();
    play(&mut game, 20);
    let chest = pelvis(&mut game, id) + Vec3::Y * 0.3;
    let mut stays = Threat::ball(game.now(), chest, Vec3::ZERO, radius);
    stays.seconds = seconds;
    let stays = game.threaten(stays).unwrap();
    (game, id, stays)
}

#[test]
fn what_cannot_be_avoided_does_not_keep_others_from_being_avoided() {
    let (mut game, id, stays) = with_a_ball_in_the_chest(0.2, 60.0);
    let mut random = Random::new(3);
    let (mut missed, mut hits) = (0, 0);
    for _ in 0..40 {
        throw_at(&mut game, &[id], &mut random);
        let events = play(&mut game, 90);
        missed += count(&events, |kind| matches!(kind, Kind::MissedBy { .. }));
        let other = |kind| matches!(kind, Kind::Hit { threat, .. } if threat != stays);
        hits += count(&events, other);
    }
    assert!(missed >= 32 && hits <= 8, "{missed} {hits}");
}

#[test]
fn the_same_threat_is_tried_again_after_ever_longer_pauses() {
    let (mut game, ..) = with_a_ball_in_the_chest(0.3, 20.0);
    let (mut pauses, mut last) = (Vec::new(), 0.0);
    for _ in 0..400 {
        play(&mut game, 1);
        let state = serde_json::to_value(game.state()).unwrap();
        let given_up = &state["slots"][0]["state"]["given_up"][0];
        let at = given_up["until"].as_f64().unwrap_or_default();
        if at != last && at > 0.0 {
            pauses.push(at - game.now());
            last = at;
        }
    }
    assert!(pauses.len() >= 5, "{pauses:?}");
    for pair in pauses.windows(2).take(4) {
        assert!(pair[1] > 1.5 * pair[0], "{pauses:?}");
    }
}

#[test]
fn of_a_threat_that_is_watched_it_is_said_once_that_it_is_avoided() {
    let (mut characters, ids) = game::<1>();
    play(&mut characters, 20);
    let middle = pelvis(&mut characters, ids[0]);
    let velocity = Vec3::new(0.0, 0.0, -6.0);
    let from = middle - velocity * 1.2 + Vec3::X * 0.9;
    let beside = Threat::ball(characters.now(), from, velocity, 0.1);
    let threat = characters.threaten(beside.clone()).unwrap();
    let mut events = Vec::new();
    for frame in 0..70 {
        let mut seen = beside.clone();
        seen.position.x += 0.01 * (frame % 2) as f32;
        characters.update(threat, seen).unwrap();
        events.extend(play(&mut characters, 1));
    }
    let kept = count(&events, |kind| matches!(kind, Kind::Kept { .. }));
    assert_eq!(kept, 1, "{events:?}");
}

#[test]
fn settings_that_no_step_could_use_are_refused_by_name() {
    type Spoil = fn(&mut CharacterSettings);
    let bad: [(Spoil, &str); 9] = [
        (|s| s.delay = 61, "the delay is 61; it must be 0 to 60"),
        (
            |s| s.plans_per_step = 0,
            "the number of plans in a step is 0; it must be at least 1",
        ),
        (
            |s| s.plan_milliseconds = -5.0,
            "the time for plans is -5; it must be 0 to 1000000",
        ),
        (
            |s| s.horizon = f32::NAN,
            "the horizon is NaN; it must be 0 to 60",
        ),
        (
            |s| s.threads = 1025,
            "the number of threads is 1025; it must be 0 to 1024",
        ),
        (|s| s.margin = f32::NAN, "NaN"),
        (|s| s.steer.slowest = 1.3, "1.3"),
        (|s| s.steer.turn = -1.0, "-1"),
        (|s| s.steer.blend = f32::NAN, "NaN"),
    ];
    for (spoil, words) in bad {
        let mut settings = CharacterSettings::default();
        spoil(&mut settings);
        let refused = Characters::new(baked(), settings).err().unwrap();
        assert!(refused.to_string().contains(words), "{refused}");
    }
    let mut characters = characters(CharacterSettings::default());
    let delay = CharacterSettings::MOST_DELAY;
    assert!(characters.set_delay(delay + 1).is_err());
    characters.set_delay(delay).unwrap();
}

#[test]
fn threats_that_no_attack_could_hold_are_refused_by_name() {
    let (mut characters, ids) = game::<2>();
    let good = Threat::ball(0.0, Vec3::Y, Vec3::X, 0.1);
    let with = |change: &dyn Fn(&mut Threat)| {
        let mut threat = good.clone();
        change(&mut threat);
        threat
    };
    let bad = [
        (
            with(&|threat| threat.time = 1e300),
            "the threat's time from now is inf; it must be -3600 to 3600",
        ),
        (
            with(&|threat| threat.position = Vec3::new(3000.0, 0.0, 4001.0)),
            "the threat's distance from the origin is 5000.8; it must be 0 to 5000",
        ),
        (
            with(&|threat| threat.spheres.clear()),
            "the threat's number of spheres is 0; it must be 1 to 64",
        ),
        (
            with(&|threat| threat.spheres[0].radius = 0.0),
            "the radius of a threat's sphere is 0; it must be 0.000001 to 50",
        ),
    ];
    for (threat, words) in bad {
        let made = characters.threaten(threat);
        assert_eq!(made.unwrap_err().to_string(), words);
    }
    // A target that is gone can no longer be threatened; a threat that it has may still change.
    let at_one = with(&|threat| threat.target = Some(ids[1]));
    let id = characters.threaten(at_one.clone()).unwrap();
    characters.despawn(ids[1]).unwrap();
    let gone = characters.threaten(at_one.clone());
    assert!(matches!(gone, Err(CharacterError::NoSuchCharacter { .. })));
    characters.update(id, at_one).unwrap();
    play(&mut characters, 2);
}

/// A body that leaves long before the ball comes is missed by the distance in the moment in which the ball passes.
#[test]
fn what_passes_far_away_is_measured() {
    let (mut characters, [id]) = game::<1>();
    play(&mut characters, 10);
    let middle = pelvis(&mut characters, id);
    let velocity = Vec3::new(0.0, 0.0, -6.0);
    let from = middle - velocity + 1.3 * Vec3::X;
    let mut threat = Threat::ball(characters.now(), from, velocity, 0.1);
    threat.seconds = 3.0;
    let name = characters.threaten(threat.clone()).unwrap();
    let (mut least, mut missed_by) = (f32::INFINITY, None);
    for _ in 0..240 {
        let events = play(&mut characters, 1);
        least = least.min(distance(&mut characters, id, &threat));
        for event in events {
            if let Kind::MissedBy { threat, metres } = event.kind {
                assert_eq!(threat, name);
                missed_by = Some(metres);
            }
        }
    }
    let metres = missed_by.unwrap();
    assert!(least > 0.5 && (metres - least).abs() < 0.1, "{metres}");
}

#[test]
fn threats_are_changed_and_removed_by_their_ids() {
    let (mut characters, ids) = game::<1>();
    let middle = pelvis(&mut characters, ids[0]);
    let velocity = Vec3::new(0.0, 0.0, -6.0);
    let threat = Threat::ball(0.5, middle - velocity, velocity, 0.1);
    let first = characters.threaten(threat.clone()).unwrap();
    let second = characters.threaten(threat.clone()).unwrap();
    assert_ne!(first, second);
    let mut wide = threat.clone();
    wide.position = threat.position + Vec3::X * 20.0;
    characters.update(first, wide.clone()).unwrap();
    characters.remove(second).unwrap();
    assert_eq!(
        characters.remove(second),
        Err(CharacterError::NoSuchThreat(second))
    );
    assert_eq!(characters.threats().collect::<Vec<_>>(), [(first, &wide)]);
    assert!(play(&mut characters, 120).is_empty());
    let mut bad = threat;
    bad.velocity = Vec3::NAN;
    assert!(characters.threaten(bad.clone()).is_err() && characters.update(first, bad).is_err());
}

#[test]
fn steps_under_fire_hardly_allocate_once_warm() {
    const FRAMES: usize = 240;
    let mut random = Random::new(3);
    let (mut characters, ids) = game::<8>();
    let mut events = Vec::new();
    let mut made = Vec::new();
    for _ in 0..6 {
        let mut sum = 0;
        for frame in 0..FRAMES {
            if frame % 80 == 0 {
                throw_at(&mut characters, &ids, &mut random);
                events.clear();
                events.reserve(1000);
            }
            let before = allocations();
            characters.step(FRAME, &[], &mut events);
            sum += allocations() - before;
        }
        made.push(sum);
    }
    assert!(made[0] > 0, "the counter counts");
    // A motion or a list of threats may still become longer than any before.
    assert!(made[5] < FRAMES as u64 / 2, "{made:?}");
}

/// The way of some walkers to their goal within 20 s, in metres, and the balls that hit them. `pause`: frames from one ball to the next for each.
fn way_under_fire(pause: usize) -> (f32, usize) {
    let mut random = Random::new(23);
    let (mut game, ids) = game::<6>();
    let goal = walk(Vec3::Z * 1.2);
    ids.iter().for_each(|&id| game.steer(id, goal).unwrap());
    let way = |game: &mut Characters| -> f32 { ids.iter().map(|&id| pelvis(game, id).z).sum() };
    let start = way(&mut game);
    let mut events = Vec::new();
    for frame in 1..1200 {
        for (index, &id) in ids.iter().enumerate() {
            if (frame + 7 * index) % pause == 0 {
                throw_at(&mut game, &[id], &mut random);
            }
        }
        game.step(FRAME, &[], &mut events);
    }
    let hits = count(&events, |kind| matches!(kind, Kind::Hit { .. }));
    (way(&mut game) - start, hits)
}

#[test]
fn who_is_thrown_at_each_second_still_gets_to_the_goal() {
    let (free, none) = way_under_fire(usize::MAX);
    let (way, hits) = way_under_fire(60);
    assert_eq!(none, 0);
    assert!(way > 0.5 * free, "{way} of {free} m");
    assert!(hits < 12, "{hits} of 114 balls");
}

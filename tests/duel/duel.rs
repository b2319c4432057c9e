//! Promise: two fighters attack and avoid in turn; each attack would land, is announced in time and is the attacker's own motion;
//! an answer is what the exact test says; nobody stands in the other one, leaves the arena or jumps; the same duel for a seed.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use std::sync::OnceLock;

use common::baked::embedded;
use common::small::{small_bake, small_evasion};
use sabaki::anim::{Pose, forward_kinematics};
use sabaki::duel::{
    Duel, DuelError, DuelSettings, Exchange, Fighter, LeadTime, Score, Side, Trunk,
};
use sabaki::graph::{Motion, Playhead};
use sabaki::maps::{AttackGrid, AttackGridSettings, PathSettings};
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};

const SIDES: [Side; 2] = [Side::White, Side::Blue];

struct Fought {
    exchanges: Vec<Exchange>,
    fighters: [Fighter; 2],
    score: Score,
    seconds: f32,
}

fn grid() -> &'static AttackGrid {
    static GRID: OnceLock<AttackGrid> = OnceLock::new();
    GRID.get_or_init(|| AttackGrid::new(embedded(), &AttackGridSettings::default()))
}

/// Number of exchanges of a duel.
const ROUNDS: usize = 6;

fn fight(seed: u64, grid: &AttackGrid, query: &QuerySettings) -> Fought {
    let settings = DuelSettings {
        seed,
        ..DuelSettings::default()
    };
    let mut duel = Duel::new(embedded(), grid, &settings).unwrap();
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let query = Query::new(embedded(), query);
    while duel.exchanges().len() < ROUNDS {
        let (turn, before) = (duel.turn(), duel.exchanges().len());
        let challenge = duel.challenge().unwrap();
        assert_eq!(challenge.attacker, turn);
        query.answer(challenge.request(), &mut context, &mut answer);
        match duel.settle(&challenge, &answer).cloned() {
            Some(exchange) => {
                assert_eq!(duel.exchanges().last(), Some(&exchange));
                assert_eq!(duel.turn(), turn.other(), "roles change");
                // What was tested relative to the evasion's start is tested in the world.
                let apart = exchange.clearance.metres - answer.clearance().metres;
                assert!(apart.abs() < 3e-3, "{apart} m");
                assert_eq!(exchange.avoided, exchange.clearance.metres >= 0.0);
            }
            None => {
                assert_eq!((duel.turn(), duel.exchanges().len()), (turn, before));
            }
        }
    }
    Fought {
        exchanges: duel.exchanges().to_vec(),
        score: duel.score(),
        seconds: duel.now(),
        fighters: duel.into_fighters(),
    }
}

fn some() -> &'static [Fought; 3] {
    static FOUGHT: OnceLock<[Fought; 3]> = OnceLock::new();
    FOUGHT.get_or_init(|| [1, 2, 3].map(|seed| fight(seed, grid(), &QuerySettings::default())))
}

#[test]
fn there_are_hits_and_dodges_and_the_score_counts_them() {
    let (mut hits, mut dodges) = (0, 0);
    for fought in some() {
        assert_eq!(fought.exchanges.len(), ROUNDS);
        let count = |side: Side, avoided: bool| {
            let of =
                |exchange: &&Exchange| exchange.attacker == side && exchange.avoided == avoided;
            fought.exchanges.iter().filter(of).count() as u32
        };
        for side in SIDES {
            assert_eq!(fought.score.hits[side.index()], count(side, false));
            assert_eq!(fought.score.dodges[side.index()], count(side.other(), true));
        }
        hits += count(Side::White, false) + count(Side::Blue, false);
        dodges += count(Side::White, true) + count(Side::Blue, true);
        let turns: Vec<Side> = fought
            .exchanges
            .iter()
            .map(|exchange| exchange.attacker)
            .collect();
        assert!(turns.windows(2).all(|pair| pair[0] != pair[1]) && turns[0] == Side::White);
    }
    assert!(dodges > hits && hits + dodges == 18, "{hits} {dodges}");
}

#[test]
fn attacks_are_announced_in_time_and_would_land() {
    let settings = DuelSettings::default();
    for exchange in some().iter().flat_map(|fought| &fought.exchanges) {
        let LeadTime { shortest, longest } = settings.lead;
        assert!(exchange.lead >= shortest - 1e-3, "{}", exchange.lead);
        // A long attack is known of before it starts, whatever its lead.
        assert!(exchange.lead <= longest.max(exchange.attack.end()) + 1e-3);
        assert!((exchange.attack.start()..=exchange.attack.end()).contains(&exchange.lead));
        assert!(exchange.without < -settings.depth, "{}", exchange.without);
        assert!(exchange.attack.start() >= 0.0);
    }
}

/// The spheres of the attack are on the limb of who attacks, while that plays the attack.
#[test]
fn an_attack_is_the_attackers_own_motion() {
    let graph = embedded().graph();
    let (mut pose, mut joints, mut centres) = (Pose::default(), Vec::new(), Vec::new());
    for fought in some() {
        for exchange in &fought.exchanges {
            let attacker = &fought.fighters[exchange.attacker.index()];
            let times = exchange.attack.spheres()[0].keys().iter().map(|key| key.t);
            let times: Vec<f32> = times.collect();
            for &t in &times[..times.len() - 1] {
                let playhead = attacker.playhead(graph, exchange.announced + t + 1e-4);
                assert_eq!(playhead.edge, exchange.strike);
                playhead.pose(graph, &mut pose);
                forward_kinematics(graph.skeleton(), &pose, &mut joints);
                embedded().body().centres(&joints, &mut centres);
                for sphere in exchange.attack.spheres() {
                    let place = sphere.at(t).center;
                    let nearest = centres.iter().map(|centre| centre.distance(place));
                    let nearest = nearest.fold(f32::INFINITY, f32::min);
                    assert!(nearest < 2e-3, "{nearest}");
                }
            }
        }
    }
}

/// Of what is played, a thousand times a second, and not by the code that chose it.
#[test]
fn a_dodge_is_none_by_hearsay() {
    let graph = embedded().graph();
    let (mut pose, mut joints, mut centres) = (Pose::default(), Vec::new(), Vec::new());
    for fought in some() {
        for exchange in &fought.exchanges {
            let defender = &fought.fighters[exchange.attacker.other().index()];
            let mut least = f32::INFINITY;
            let (start, end) = (exchange.attack.start(), exchange.attack.end());
            let steps = ((end - start) * 1000.0) as usize;
            for t in (0..=steps).map(|step| start + step as f32 / 1000.0) {
                defender.pose(graph, exchange.announced + t, &mut pose);
                forward_kinematics(graph.skeleton(), &pose, &mut joints);
                embedded().body().centres(&joints, &mut centres);
                for ball in exchange.attack.spheres().iter().map(|sphere| sphere.at(t)) {
                    for (centre, part) in centres.iter().zip(&embedded().body().spheres) {
                        least = least.min(centre.distance(ball.center) - part.radius - ball.radius);
                    }
                }
            }
            let told = exchange.clearance.metres;
            // The exact test's body goes straight between 120 samples a second: a millimetre or two.
            assert!(
                (least - told).abs() < 4e-3,
                "{least} m, and {told} m was told"
            );
        }
    }
}

#[test]
fn nobody_stands_in_the_other_one_leaves_the_arena_or_jumps() {
    let (baked, settings) = (embedded(), DuelSettings::default());
    let (graph, trunk) = (baked.graph(), Trunk::new(embedded()));
    for fought in some() {
        let ticks = (fought.seconds * 120.0) as usize;
        let mut before: Option<[glam::Vec3; 2]> = None;
        for t in (0..=ticks).map(|tick| tick as f32 / 120.0) {
            let playheads = SIDES.map(|side| fought.fighters[side.index()].playhead(graph, t));
            let apart = trunk.distance(baked, playheads);
            assert!(apart > 0.0, "at {t} s they are {apart} m apart");
            // What is seen: a blend into an evasion moves the root gradually, the playhead at once.
            let places = SIDES.map(|side| {
                let mut pose = Pose::default();
                fought.fighters[side.index()].pose(graph, t, &mut pose);
                glam::Vec3::new(pose.root.x, 0.0, pose.root.z)
            });
            for place in places {
                assert!(place.length() < settings.arena, "at {t} s {place}");
            }
            for (now, then) in places.iter().zip(before.iter().flatten()) {
                // Metres in a 120th of a second: 6 m/s.
                assert!(
                    now.distance(*then) < 0.05,
                    "at {t} s a jump of {}",
                    now.distance(*then)
                );
            }
            before = Some(places);
        }
    }
}

/// Every blow finds its mark where it is announced: they look at each other.
#[test]
fn fighters_face_each_other_when_one_strikes() {
    let graph = embedded().graph();
    for fought in some() {
        for exchange in &fought.exchanges {
            let t = exchange.announced + exchange.attack.start();
            let [me, them] = [exchange.attacker, exchange.attacker.other()]
                .map(|side| fought.fighters[side.index()].placement(graph, t));
            let way = (them.ground() - me.ground()).normalize();
            let facing = me.vector(glam::Vec3::Z);
            let cosine = way.dot(glam::Vec2::new(facing.x, facing.z));
            assert!(cosine > 0.3, "the attacker faces elsewhere: {cosine}");
        }
    }
}

#[test]
fn the_same_seed_fights_the_same_duel_on_any_number_of_threads() {
    let mut settings = AttackGridSettings::default();
    settings.paths.threads = 3;
    let other = AttackGrid::new(embedded(), &settings);
    let query = QuerySettings {
        threads: 3,
        ..QuerySettings::default()
    };
    let again = fight(1, &other, &query);
    assert!(again.exchanges == some()[0].exchanges);
    assert!(again.fighters == some()[0].fighters);
    assert_eq!(again.seconds.to_bits(), some()[0].seconds.to_bits());
    assert!(some()[1].exchanges != some()[0].exchanges, "another seed");
}

#[test]
fn what_makes_no_duel_is_said_by_name() {
    let settings = DuelSettings {
        arena: f32::NAN,
        ..DuelSettings::default()
    };
    let refused = Duel::new(embedded(), grid(), &settings).err().unwrap();
    assert!(refused.to_string().contains("arena"), "{refused}");
    let wide = DuelSettings {
        opening: 7.0,
        ..DuelSettings::default()
    };
    assert!(matches!(
        Duel::new(embedded(), grid(), &wide).err(),
        Some(DuelError::Setting {
            name: "opening",
            ..
        })
    ));
    // Clips that only evade.
    let unarmed = small_bake(
        150,
        &[0.3, 0.4],
        &[small_evasion(0, 1.8)],
        PathSettings::default(),
    );
    assert!(unarmed.attack_moves().is_empty());
    let grid = AttackGrid::new(&unarmed, &AttackGridSettings::default());
    let refused = Duel::new(&unarmed, &grid, &DuelSettings::default());
    assert_eq!(refused.err(), Some(DuelError::NoAttacks));
}

#[test]
fn who_cannot_come_near_says_so() {
    let settings = DuelSettings {
        // No blow goes as deep.
        depth: 1.0,
        patience: 1.0,
        ..DuelSettings::default()
    };
    let mut duel = Duel::new(embedded(), grid(), &settings).unwrap();
    assert_eq!(
        duel.challenge(),
        Err(DuelError::OutOfReach { seconds: 1.0 })
    );
}

/// What is left of a motion is the motion, later; a branch is the same up to the next node.
#[test]
fn what_is_left_of_a_motion_goes_on_where_it_was() {
    let graph = embedded().graph();
    let answers = some().iter().flat_map(|fought| &fought.exchanges);
    // An answer that enters an evasion at once has no steps.
    let stepped: Vec<_> = answers
        .filter(|exchange| !exchange.answer.is_empty())
        .collect();
    assert!(stepped.len() > 2, "{}", stepped.len());
    for exchange in stepped {
        let first = exchange.answer[0];
        let before = graph
            .edge_ids()
            .find(|&id| graph.edge(id).to == graph.edge(first.edge).from);
        let playhead = Playhead::at(graph, before.unwrap(), 0.0, Rigid2::new(0.4, 1.0, -2.0));
        let motion = Motion::new(graph, playhead, &exchange.answer);
        for share in [0.0, 0.2, 0.5, 0.83] {
            let t = share * motion.duration();
            let rest = motion.rest(graph, t);
            assert!((rest.duration() - (motion.duration() - t)).abs() < 1e-3);
            for later in [0.0, 0.07, 0.4] {
                let apart = rest
                    .root(graph, later)
                    .distance(motion.root(graph, t + later));
                assert!(apart < 2e-3, "{apart} m");
            }
            let branch = motion.branch(graph, t, &[]);
            let end = branch.duration();
            assert_eq!(branch.steps().count(), 0);
            let apart = branch
                .root(graph, end)
                .distance(motion.root(graph, t + end));
            assert!(apart < 2e-3, "{apart} m");
        }
    }
}

//! Promise: an entry begins where the character is and ends on the evasion's own motion, within what the clips show a body to do; what
//! it avoids is avoided, and it avoids what is too near for an edge. One foot stays where it is planted, and no toe goes below both motions.

use glam::Vec3;
use sabaki::anim::Pose;
use sabaki::graph::{EdgeMotion, Motion, MotionGraph, Playhead};
use sabaki::graph::{Entry, Played};
use sabaki::maps::{BakedGraph, SphereKey};
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Attack, EntryUse, Evaluation, Query};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::balls::TimedThrow;
use sabaki_fixtures::clips::joints_of;
use sabaki_fixtures::throw::key;

use super::{
    assert_made_again, balls_at, centres, furthest, joints, measured, taken_over, unwarped,
};

/// Some moments' first entries: the natural motion, when it is entered, and what.
pub(super) fn entered(baked: &BakedGraph) -> Vec<(Motion, f32, Entry)> {
    let graph = baked.graph();
    let mut found = Vec::new();
    for edge in graph.edge_ids().step_by(7) {
        if graph.edge(edge).motion != EdgeMotion::Clip {
            continue;
        }
        let mut motion = Motion::new(graph, Playhead::at(graph, edge, 0.0, Rigid2::IDENTITY), &[]);
        motion.extend(graph, 2.0);
        let seconds = 0.1;
        let entries = baked.entries_at(&motion, seconds);
        let Some(&entry) = entries.get(found.len() % entries.len().max(1)) else {
            continue;
        };
        found.push((motion, seconds, entry));
    }
    assert!(found.len() > 20, "{}", found.len());
    found
}

/// The motion that enters, for some seconds.
pub(super) fn after(baked: &BakedGraph, before: &Motion, seconds: f32, entry: &Entry) -> Motion {
    let mut motion = before.clone();
    motion.enter(baked.graph(), seconds, entry);
    motion.extend(baked.graph(), seconds + 2.0);
    motion
}

#[test]
fn an_entry_begins_where_the_motion_is_and_ends_on_its_clip() {
    let baked = embedded();
    let graph = baked.graph();
    for (before, seconds, entry) in entered(baked) {
        let motion = after(embedded(), &before, seconds, &entry);
        let start = [&before, &motion].map(|motion| centres(baked, motion, seconds));
        assert!(furthest(&start[0], &start[1]) < 1e-3);
        // A thousandth of a second further, both have gone the same way.
        let later = [&before, &motion].map(|motion| centres(baked, motion, seconds + 1e-3));
        assert!(furthest(&later[0], &later[1]) < 2e-3);
        assert!(motion.is_blending(seconds + 0.5 * entry.blend));
        let over = seconds + entry.blend + 1e-3;
        assert!(!motion.is_blending(over));
        let [mut played, mut of_graph] = [Pose::default(), Pose::default()];
        motion.sample(graph, over, &mut played);
        motion.playhead(graph, over).pose(graph, &mut of_graph);
        assert_eq!(played, of_graph);
        // A motion that begins in the blend is clamped to its start.
        let (rest, early) = (motion.rest(graph, seconds), -1e-6);
        let [start, clamped] = [0.0, early].map(|at| centres(baked, &rest, at));
        assert_eq!(start, clamped);
        assert_eq!(rest.root(graph, 0.0), rest.root(graph, early));
        // The rest of a motion fades on.
        let half = seconds + 0.5 * entry.blend;
        let rest = motion.rest(graph, half);
        let played = centres(baked, &motion, half + 0.02);
        assert!(furthest(&played, &centres(baked, &rest, 0.02)) < 1e-3);
    }
}

#[test]
fn an_entry_begins_where_the_motion_is_while_an_earlier_one_fades_out() {
    let baked = embedded();
    let graph = baked.graph();
    let mut faded = 0.0_f32;
    for (before, seconds, entry) in entered(baked) {
        let mut motion = before.clone();
        motion.enter(graph, seconds, &entry);
        let plain = motion.clone();
        let played = Played {
            motion: &before,
            seconds: 0.3,
            rate: 1.0,
        };
        // Change of the way of a thousandth of a second.
        let kink = |motion: &Motion| {
            let moments = [seconds - 1e-3, seconds.next_down(), seconds + 1e-3];
            let [from, left, to] = moments.map(|at| centres(baked, motion, at));
            let ways = from.iter().zip(&left).zip(&to);
            let change = ways.map(|((from, left), to)| ((*to - *left) - (*left - *from)).length());
            change.fold(0.0, f32::max)
        };
        // What was played is left for longer than until the entry, and until it.
        for blend in [0.4, seconds] {
            motion.clone_from(&plain);
            motion.blend_from(graph, played, blend);
            let at = |seconds: f32| centres(baked, &motion, seconds);
            let left = at(seconds.next_down());
            assert!(furthest(&left, &at(seconds)) < 1e-4);
            faded = faded.max(furthest(&left, &centres(baked, &plain, seconds)));
            // The velocity of an offset is its mean over a frame.
            assert!(kink(&motion) < kink(&plain) + 4e-3);
            let over = seconds + entry.blend + 1e-3;
            assert_eq!(at(over), centres(baked, &plain, over));
        }
        // The entry that it does not reach is as it was.
        let both = [&motion, &plain].map(|motion| centres(baked, motion, seconds));
        assert_eq!(both[0], both[1]);
    }
    assert!(faded > 0.05, "{faded}");
}

/// Speeds of the joints from frame to frame of an entry or an exit, as shares of what the clips show, in ascending order.
pub(super) fn speed_shares(
    baked: &BakedGraph,
    entered: impl IntoIterator<Item = (Motion, f32, Entry)>,
) -> Vec<f32> {
    let (graph, limits) = (baked.graph(), baked.entry_joint_speeds());
    let rate = graph.frame_rate() as f32;
    let mut shares = Vec::new();
    for (before, seconds, entry) in entered {
        let motion = after(baked, &before, seconds, &entry);
        let pose = |frame: usize| joints(baked, &motion, seconds + frame as f32 / rate).0;
        for frame in 0..(entry.blend * rate).ceil() as usize {
            let (from, to) = (pose(frame), pose(frame + 1));
            let angles = from.rotations.iter().zip(&to.rotations);
            let speeds = angles.map(|(from, to)| from.angle_between(*to) * rate);
            let moving = speeds.zip(limits).filter(|(_, limit)| **limit > 0.5);
            shares.extend(moving.map(|(speed, limit)| speed / limit));
        }
    }
    shares.sort_by(f32::total_cmp);
    shares
}

#[test]
fn entries_turn_no_joint_faster_than_the_clips_do() {
    let shares = speed_shares(embedded(), entered(embedded()));
    assert!(shares.len() > 10_000);
    // A moment is known by the nearest one that was tried, up to half a step away.
    let of_a_thousand = shares[shares.len() * 999 / 1000];
    assert!(of_a_thousand <= 1.05, "{of_a_thousand}");
    assert!(shares[shares.len() - 1] < 2.0);
}

fn balls(contact: f32) -> Vec<TimedThrow> {
    balls_at(std::iter::repeat_n(contact, 40), 5)
}

fn answer_to(entries: EntryUse, thrown: &TimedThrow, evaluation: Evaluation) -> Answer {
    let mut settings = unwarped();
    settings.entries = entries;
    let query = Query::new(embedded(), &settings);
    answer_throw(&query, &thrown.throw, evaluation)
}

#[test]
fn an_attack_in_the_middle_of_a_blend_is_answered_from_there() {
    let settings = unwarped();
    let query = Query::new(embedded(), &settings);
    let (mut asked, mut entered_again, now) = (0, 0, 0.08);
    for thrown in balls(0.4).iter().chain(&balls(0.5)) {
        let first = answer_to(EntryUse::default(), thrown, Evaluation::Lazy);
        let entered = first.chosen().entry;
        if entered.is_none_or(|entered| entered.delay > 0.0) {
            continue;
        }
        assert!(first.motion.is_blending(now));
        let spheres = thrown.throw.attack.spheres().iter().map(|sphere| {
            let later = |at: &SphereKey| key(at.t + 0.15, at.center, at.radius);
            sphere.keys().iter().map(later).collect()
        });
        let second = Attack::new(spheres.collect()).unwrap();
        let answer = taken_over(&query, embedded(), (&first.motion, now), &second, 1e-3);
        asked += 1;
        entered_again += usize::from(answer.chosen().entry.is_some());
    }
    assert!(asked > 10 && entered_again > 0, "{asked} {entered_again}");
}

#[test]
fn what_is_half_a_second_away_is_avoided_by_entries() {
    let (mut with, mut without) = (0, 0);
    for thrown in balls(0.5) {
        let lazy = answer_to(EntryUse::default(), &thrown, Evaluation::Lazy);
        let all = answer_to(EntryUse::default(), &thrown, Evaluation::Exhaustive);
        assert_eq!(lazy.avoided, all.avoided);
        let measured = measured(embedded(), &lazy.motion, &thrown.throw.attack);
        assert_eq!(measured.is_clean(), lazy.avoided);
        if lazy.chosen().entry.is_some() && lazy.avoided {
            assert!(lazy.counts.entered > 0);
            assert_made_again(&lazy, &thrown.throw);
        }
        with += usize::from(lazy.avoided);
        let bare = answer_to(EntryUse::none(), &thrown, Evaluation::Lazy);
        assert_eq!(bare.counts.entered, 0);
        without += usize::from(bare.avoided);
    }
    assert!(with >= without + 8, "{with} with, {without} without");
}

fn toes(graph: &MotionGraph, pose: &Pose) -> Vec<Vec3> {
    let joints = joints_of(graph.skeleton(), pose);
    let legs = graph.feet().legs().iter();
    legs.map(|leg| joints[leg.toe_or_foot().index()].translation)
        .collect()
}

fn played(graph: &MotionGraph, motion: &Motion, seconds: f32) -> Vec<Vec3> {
    toes(graph, &joints(embedded(), motion, seconds).0)
}

#[test]
fn one_foot_stays_while_an_evasion_is_entered() {
    let graph = embedded().graph();
    let step = 1.0 / graph.frame_rate() as f32;
    let mut slides = Vec::new();
    for (before, seconds, entry) in entered(embedded()) {
        let motion = after(embedded(), &before, seconds, &entry);
        let frames = (entry.blend / step).ceil() as usize;
        let at = |frame: usize| played(graph, &motion, seconds + frame as f32 * step);
        let slower = |frame: usize| {
            let (from, to) = (at(frame), at(frame + 1));
            let ways = from.iter().zip(&to);
            ways.map(|(from, to)| (*to - *from).with_y(0.0).length())
                .fold(f32::INFINITY, f32::min)
        };
        slides.push((0..frames).map(slower).sum::<f32>());
    }
    slides.sort_by(f32::total_cmp);
    // Moments between those of the bake, and moments at which no foot stands, may slide more.
    let of_ten = slides[slides.len() * 9 / 10];
    assert!(of_ten <= 0.03, "{of_ten}");
}

#[test]
fn no_toe_goes_below_both_motions() {
    let graph = embedded().graph();
    for (before, seconds, entry) in entered(embedded()) {
        let start = played(graph, &before, seconds);
        let motion = after(embedded(), &before, seconds, &entry);
        for part in 1..10 {
            let seconds = seconds + entry.blend * part as f32 / 10.0;
            let mut pose = Pose::default();
            motion.playhead(graph, seconds).pose(graph, &mut pose);
            let lowest = toes(graph, &pose).into_iter().zip(&start);
            let now = played(graph, &motion, seconds);
            for (toe, (target, start)) in now.iter().zip(lowest) {
                let floor = target.y.min(start.y);
                assert!(toe.y > floor - 0.01, "{} under {floor}", toe.y);
            }
        }
    }
}

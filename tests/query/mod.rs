//! Tests of `sabaki::query`, and what several of them need.

use glam::Vec3;
use sabaki::anim::{JointTransform, Pose};
use sabaki::graph::Motion;
use sabaki::maps::BakedGraph;
use sabaki::query::clearance::{ExactTest, MotionBody};
use sabaki::query::{
    Answer, Attack, Clearance, EntryUse, Query, QueryContext, QuerySettings, Request, WarpSettings,
};
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::balls::{BallThrower, TimedThrow};
use sabaki_fixtures::clips::joints_of;
use sabaki_fixtures::throw::Throw;
use sabaki_fixtures::with;

use crate::furthest;

mod alloc;
mod answer;
mod cull_cpu;
mod culling;
mod determinism;
mod entries;
mod exact;
mod exits;
mod first_use;
mod layers;
mod obstacles;
mod pause;
mod push;
mod spans;
mod warp;

/// Without warps.
fn unwarped() -> QuerySettings {
    with(|s: &mut QuerySettings| s.warp = WarpSettings::off())
}

/// Without entries: there is more to warp.
fn without_entries() -> QuerySettings {
    with(|s: &mut QuerySettings| s.entries = EntryUse::none())
}

/// The candidates that edges lead to, without warps.
fn of_edges() -> QuerySettings {
    QuerySettings {
        entries: EntryUse::none(),
        ..unwarped()
    }
}

/// Pose and joints of a motion at a moment.
fn joints(baked: &BakedGraph, motion: &Motion, seconds: f32) -> (Pose, Vec<JointTransform>) {
    let mut pose = Pose::default();
    motion.sample(baked.graph(), seconds, &mut pose);
    let joints = joints_of(baked.graph().skeleton(), &pose);
    (pose, joints)
}

/// Centres of the body's spheres at a moment of a motion.
fn centres(baked: &BakedGraph, motion: &Motion, seconds: f32) -> Vec<Vec3> {
    let mut out = Vec::new();
    baked
        .body()
        .centres(&joints(baked, motion, seconds).1, &mut out);
    out
}

/// The smallest distance of body and attack, at `rate` moments a second.
fn naive_clearance(baked: &BakedGraph, motion: &Motion, attack: &Attack, rate: f32) -> f32 {
    let mut least = f32::INFINITY;
    for step in (attack.start() * rate) as usize..=(attack.end() * rate) as usize {
        let t = (step as f32 / rate).clamp(attack.start(), attack.end());
        let centres = centres(baked, motion, t);
        for ball in attack.spheres() {
            let ball = ball.at(t);
            for (sphere, centre) in baked.body().spheres.iter().zip(&centres) {
                least = least.min(centre.distance(ball.center) - sphere.radius - ball.radius);
            }
        }
    }
    least
}

/// Random balls that hit the embedded motions, one for each time of contact.
fn balls_at(contacts: impl Iterator<Item = f32>, seed: u64) -> Vec<TimedThrow> {
    let thrower = BallThrower::new(embedded());
    let thrown = (0..)
        .zip(contacts)
        .filter_map(|(index, contact)| thrower.throw(contact, seed, index).unwrap());
    thrown.collect()
}

/// The answer to an attack at a moment of a motion. It must begin within `most` metres of that motion, and be clean if it says so.
fn taken_over(
    query: &Query<'_>,
    baked: &BakedGraph,
    (motion, now): (&Motion, f32),
    attack: &Attack,
    most: f32,
) -> Answer {
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let request = Request::from_motion(baked.graph(), motion.moment_at(now), attack);
    query.answer(request, &mut context, &mut answer);
    let moved = furthest(
        &centres(baked, motion, now),
        &centres(baked, &answer.motion, 0.0),
    );
    assert!(moved < most, "{moved} m at {now} s");
    let measured = measured(baked, &answer.motion, attack);
    assert_eq!(measured.is_clean(), answer.avoided);
    answer
}

/// The exact test of a motion.
fn measured(baked: &BakedGraph, motion: &Motion, attack: &Attack) -> Clearance {
    ExactTest::new(baked, attack).on_motion(motion, &mut MotionBody::default())
}

/// Asserts that the report of what was chosen makes the same motion again.
fn assert_made_again(answer: &Answer, throw: &Throw) {
    let (baked, end) = (embedded(), throw.attack.end());
    let again = answer.motion_of(baked, throw.playhead, answer.chosen());
    let mut again = again.unwrap();
    again.extend(baked.graph(), end);
    for step in 0..60 {
        let t = end * step as f32 / 60.0;
        let [a, b] = [&answer.motion, &again].map(|motion| joints(baked, motion, t).0);
        assert_eq!(a, b);
    }
}

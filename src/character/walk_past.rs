//! Walking past an attack: what a character with a goal does before it looks for an evasion.
//!
//! Not part of the papers. The path of its walk is shifted sideways, ahead or back, by a quintic, and stays shifted. The shift goes on after the
//! attack has arrived: a body that need not stop by then pushes off half as hard. A foot that stands stays where it is until it is lifted, unless
//! the other one would cross it, and one that is put down is put where the body will be above it. The shortest shift with which the exact test
//! finds the walk clean is taken, and of equal ones the narrowest miss. A character that does not walk yet, as an evasion has just ended, begins
//! to.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, Vec3Swizzles};

use super::goal::Aim;
use super::plan::{PlanTest, TestedMotion};
use super::playing::Playing;
use super::steer::SteerStep;
use super::world::PlanScratch;
use crate::anim::{Chain, Pose};
use crate::graph::{Motion, MotionGraph};
use crate::maps::Stance;

/// Number of directions of the shifts, and their lengths when the attack arrives, in metres.
const DIRECTIONS: usize = 8;
const LENGTHS: [f32; 3] = [0.2, 0.35, 0.5];

/// Smallest distance of the legs from each other, as a share of that in the walk: feet that are put aside do not cross.
const NEARER: f32 = 0.75;

/// Shortest and longest time from the start of a shift until it has such a length, and from then to the contact, in seconds.
const SHORTEST: f32 = 0.35;
const LONGEST: f32 = 0.9;
const EARLY: f32 = 0.05;

/// Duration of a shift as a multiple of that time, and the share of the shift that is reached then.
const STRETCH: f32 = 1.6;
const REACHED: f32 = 0.7247;

/// Time after a shift in which feet that were held come back to the walk, in seconds.
const RELEASED: f32 = 0.3;

/// The walk towards an aim that avoids the attack of `test`; `None` if there is none. `played` is the played motion, which is hit.
pub(super) fn walk_past(
    test: PlanTest<'_>,
    aim: Aim,
    played: &TestedMotion,
    scratch: &mut PlanScratch,
) -> Option<TestedMotion> {
    let (world, graph) = (test.world, test.world.baked.graph());
    let contact = played.clearance.time;
    if leads(graph, &played.motion, contact, aim.velocity) {
        return shifted(test, &aim, &played.motion, contact, scratch);
    }
    let step = SteerStep {
        baked: world.baked,
        settings: &world.settings.steer,
        aim,
        may_search: true,
        dt: world.dt,
    };
    let mut playing = Playing::new(scratch.motion());
    playing.motion.clone_from(&played.motion);
    world
        .steering
        .walk_on(&step, &mut playing, &mut scratch.steer);
    let walk = test.until_hit(playing.motion, scratch);
    if !leads(graph, &walk.motion, contact, aim.velocity) {
        scratch.keep_memory(walk.motion);
        return None;
    }
    if walk.is_clean() {
        return Some(walk);
    }
    let found = shifted(test, &aim, &walk.motion, walk.clearance.time, scratch);
    scratch.keep_memory(walk.motion);
    found
}

/// The walk with the shortest shift that avoids the attack, which hits it at `contact`. The body pushes off no harder than in the answers of
/// queries.
fn shifted(
    test: PlanTest<'_>,
    aim: &Aim,
    walk: &Motion,
    contact: f32,
    scratch: &mut PlanScratch,
) -> Option<TestedMotion> {
    let baked = test.world.baked;
    let seconds = (contact - EARLY).min(LONGEST);
    if seconds < SHORTEST {
        return None;
    }
    let until = contact.max(STRETCH * seconds) + RELEASED;
    let allowed = test.world.settings.query.allowed_push(baked, contact);
    let body = scratch.context.body();
    let limit = allowed.max(body.push(baked, None, walk, contact, f32::INFINITY));
    let stances = next_stances(baked.graph(), walk);
    let apart = NEARER * legs_apart(baked.graph(), walk, until, &mut scratch.pose);
    for length in LENGTHS {
        let mut best: Option<TestedMotion> = None;
        for direction in 0..DIRECTIONS {
            let angle = TAU * direction as f32 / DIRECTIONS as f32;
            let by = Vec2::from_angle(angle).rotate(aim.velocity.normalize()) * length;
            let mut motion = scratch.motion();
            motion.clone_from(walk);
            let by = Vec3::new(by.x, 0.0, by.y) / REACHED;
            motion.shift_on_feet(baked.graph(), by, STRETCH * seconds, &stances);
            motion.extend(baked.graph(), until);
            let tested = test.until_hit(motion, scratch);
            let metres = best.as_ref().map(|best| best.clearance.metres);
            let is_narrower = metres.is_none_or(|metres| tested.clearance.metres < metres);
            let body = scratch.context.body();
            let wins = tested.is_clean()
                && is_narrower
                && body.push(baked, None, &tested.motion, until, limit) <= limit
                && legs_apart(baked.graph(), &tested.motion, until, &mut scratch.pose) > apart;
            let left = if wins {
                best.replace(tested)
            } else {
                Some(tested)
            };
            left.into_iter()
                .for_each(|left| scratch.keep_memory(left.motion));
        }
        if best.is_some() {
            return best;
        }
    }
    None
}

/// Whether a motion leads towards where a velocity does, within `seconds`.
fn leads(graph: &MotionGraph, motion: &Motion, seconds: f32, velocity: Vec2) -> bool {
    /// Share of the way: a character that begins to walk has a part of it.
    const SHARE: f32 = 0.3;
    let [from, to] = [0.0, seconds].map(|t| motion.root(graph, t).xz());
    let wanted = velocity.length_squared() * seconds;
    (to - from).dot(velocity) > SHARE * wanted && wanted > 0.0
}

/// Smallest distance of knee, ankle and toe of one leg from those of the other until `seconds`, in metres.
fn legs_apart(graph: &MotionGraph, motion: &Motion, seconds: f32, pose: &mut Pose) -> f32 {
    /// Interval of the moments that are examined, in seconds.
    const EACH: f32 = 1.0 / 15.0;
    let [Some(left), Some(right)] = [0, 1].map(|leg| graph.feet().legs().get(leg)) else {
        return f32::INFINITY;
    };
    let mut least = f32::INFINITY;
    for step in 0..=(seconds / EACH) as usize {
        motion.sample(graph, step as f32 * EACH, pose);
        let chain = Chain::of(graph.skeleton(), pose);
        let [left, right] = [left, right].map(|leg| {
            let joints = [leg.knee, leg.foot, leg.toe_or_foot()];
            joints.map(|joint| chain.global(joint).translation)
        });
        let pairs = left.iter().flat_map(|a| right.map(|b| a.distance(b)));
        least = pairs.fold(least, f32::min);
    }
    least
}

/// For each leg the times when its foot is put down next and lifted again, in seconds; `None` if that is far. One that stands, or comes down too
/// soon to step aside first, is put down at 0.
fn next_stances(graph: &MotionGraph, walk: &Motion) -> [Option<[f32; 2]>; Stance::LEGS] {
    /// Interval of the moments that are examined, the time until a foot comes down too soon, and the longest times until it comes down and
    /// from then until it is lifted, in seconds.
    const EACH: f32 = 1.0 / 30.0;
    const SOON: f32 = 0.2;
    const LONGEST: f32 = 1.0;
    std::array::from_fn(|leg| {
        let stands = |t: f32| {
            let playhead = walk.playhead(graph, t);
            graph.foot_stands(playhead.edge, playhead.frame, leg)
        };
        let mut times = (0..).map(|step| step as f32 * EACH);
        let down = times
            .find(|&t| t > LONGEST || stands(t))
            .filter(|&t| t <= LONGEST)?;
        let lifted = times.find(|&t| t > down + LONGEST || !stands(t))?;
        Some([if down > SOON { down } else { 0.0 }, lifted])
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::anim::{JointTransform, forward_kinematics};
    use crate::graph::{EdgeId, Playhead};
    use crate::math::Rigid2;
    use crate::query::fixture::baked;

    #[test]
    fn a_shifted_walk_begins_as_it_was_keeps_its_standing_feet_and_ends_beside() {
        let graph = baked().graph();
        // Little of it sideways: a foot that stands gives way to one that would cross it.
        let by = Vec3::new(0.03, 0.0, -0.2);
        let (mut pose, mut joints) = (Pose::default(), Vec::<JointTransform>::new());
        let mut toes = |motion: &Motion, t: f32| -> Vec<Vec3> {
            motion.sample(graph, t, &mut pose);
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            let legs = graph.feet().legs().iter();
            let toe = |leg: &crate::anim::Leg| joints[leg.toe_or_foot().index()].translation;
            [pose.root].into_iter().chain(legs.map(toe)).collect()
        };
        let (mut held, mut put_down) = (0, 0);
        for frame in 0..8 {
            let at = 4.0 * frame as f32;
            let playhead = Playhead::at(graph, EdgeId(0), at, Rigid2::IDENTITY);
            let mut walk = Motion::new(graph, playhead, &[]);
            walk.extend(graph, 2.0);
            let mut stances = next_stances(graph, &walk);
            if frame % 2 == 1 {
                // As if this foot were in the air until then.
                stances[1] = Some([0.3, 0.5]);
            }
            let mut shifted = walk.clone();
            shifted.shift_on_feet(graph, by, 0.6, &stances);
            let [before, after] = [&walk, &shifted].map(|motion| toes(motion, 0.0));
            for (before, after) in before.iter().zip(after) {
                assert!(before.distance(after) < 1e-3, "{before} {after}");
            }
            let [before, after] = [&walk, &shifted].map(|motion| toes(motion, 2.0));
            for (before, after) in before.iter().zip(after) {
                assert!((before + by).distance(after) < 1e-3, "{before} {after}");
            }
            for (leg, stance) in stances.iter().enumerate().take(graph.feet().legs().len()) {
                if let Some([down, lifted]) = stance.filter(|[down, _]| *down > 0.0) {
                    // A foot that was put down stays where it is put until it is lifted.
                    let mut aside = |t| toes(&shifted, t)[1 + leg] - toes(&walk, t)[1 + leg];
                    let ways = [down + 0.05, lifted - 0.05].map(&mut aside);
                    assert!(ways[0].distance(ways[1]) < 0.02, "{leg}: {ways:?}");
                    assert!(ways[0].length() < by.length(), "{leg}: {ways:?}");
                    put_down += 1;
                }
                let Some([0.0, until]) = stance.filter(|stance| stance[1] > 0.1) else {
                    continue;
                };
                let now = until - 0.05;
                let [before, after] = [&walk, &shifted].map(|motion| toes(motion, now)[1 + leg]);
                assert!(
                    before.distance(after) < 0.02,
                    "{leg} {now}: {before} {after}"
                );
                held += 1;
            }
        }
        assert!(held > 0 && put_down > 0);
    }
}

//! When a character plans, and what it takes over.
//!
//! All known threats count in every plan: they are one attack of several spheres. A plan is made when what is played comes to be hit by
//! what is known now, and is kept as long as that does not happen. It keeps a margin, so that noise in what is seen does not
//! change it.

use std::hash::{Hash, Hasher};

use rustc_hash::FxHasher;

use super::event::CharacterEventKind;
use super::state::{CharacterState, Pending, World};
use super::threat::{Threat, Window};
use crate::graph::Motion;
use crate::maps::SphereKey;
use crate::query::clearance::{Clearance, ExactTest, Extent, MotionBody};
use crate::query::{Answer, Attack, Query, QueryContext, Request};

/// Scratch of planning.
#[derive(Default)]
pub(super) struct PlanScratch {
    context: QueryContext,
    answer: Answer,
    body: MotionBody,
}

/// The moment that a plan is made for.
struct Moment {
    /// On the characters' clock, in seconds.
    at: f64,
    /// Since the start of what is played.
    seconds: f32,
}

/// Blend of a takeover from another playback rate or from a bent pose, in seconds.
const BLEND: f32 = 0.2;

impl CharacterState {
    /// Answers the threats that are known, if what is played does not avoid them.
    pub(super) fn avoid(&mut self, index: u32, world: &World<'_>, scratch: &mut PlanScratch) {
        if self.pending.is_some() || world.threats.is_empty() {
            return;
        }
        let ahead = world.settings.delay as f32 * world.dt;
        let moment = Moment {
            at: world.now + f64::from(ahead),
            seconds: self.playing.seconds + ahead * self.playing.rate,
        };
        let graph = world.baked.graph();
        let horizon = world.settings.horizon;
        self.playing.motion.extend(graph, moment.seconds + horizon + 2.0);
        let (mut hasher, mut near) = (FxHasher::default(), Vec::new());
        for known in world.threats {
            if { known.threat.target }.is_some_and(|target| target.index() != index) {
                continue;
            }
            let window = self.window(world, moment.at, &known.threat);
            if let Some(window) = window.filter(|window| window.nearest < horizon && window.end > 0.0) {
                (known.id.0, known.version).hash(&mut hasher);
                near.push((&known.threat, window));
            }
        }
        let seen = if near.is_empty() { 0 } else { hasher.finish() };
        let is_known = seen == self.seen && self.retry_at.is_none_or(|at| world.now < at);
        if near.is_empty() {
            (self.seen, self.retry_at) = (0, None);
        } else if !is_known {
            self.answer(world, (&moment, &near), scratch);
            self.seen = seen;
        }
    }

    fn answer(
        &mut self,
        world: &World<'_>,
        (moment, near): (&Moment, &[(&Threat, Window)]),
        scratch: &mut PlanScratch,
    ) {
        let graph = world.baked.graph();
        let (Some(attack), Some(wider)) =
            (combined(moment, near, 0.0), combined(moment, near, world.settings.margin))
        else {
            return;
        };
        let was_retry = self.retry_at.is_some();
        let goes_on = self.continued(world, moment, self.playing.motion.rest(graph, moment.seconds));
        let kept = test(world, (goes_on, &attack), scratch);
        if kept.1.is_clean() {
            self.retry_at = None;
            self.hold(moment, &attack, None);
            let clearance = kept.1.metres;
            self.events.push((world.now, CharacterEventKind::Kept { clearance }));
            if self.playing.rate != 1.0 {
                self.take(moment, kept.0, world.now);
            }
            return;
        }
        let PlanScratch {
            context, answer, ..
        } = scratch;
        let request =
            Request::of_motion(graph, (&self.playing.motion, moment.seconds), &wider);
        Query::new(world.baked, &world.settings.query).answer(request, context, answer);
        let clearance = answer.clearance().metres + world.settings.margin;
        let found = self.continued(world, moment, answer.motion.clone());
        let (found, tested) = test(world, (found, &attack), scratch);
        if !tested.is_clean() {
            if !was_retry {
                self.events.push((world.now, CharacterEventKind::Cannot));
            }
            self.retry_at = Some(world.now + f64::from(world.settings.retry));
            return;
        }
        self.retry_at = None;
        let planned = CharacterEventKind::Planned {
            clearance,
            is_change: self.has_plan,
        };
        self.events.push((world.now, planned));
        self.has_plan = true;
        let end = evasion_end(world, &found, attack.end());
        self.hold(moment, &attack, end);
        self.take(moment, found, world.now);
    }

    /// Joins a motion to what is played, where that is bent or has another rate at its start.
    fn continued(&self, world: &World<'_>, moment: &Moment, mut motion: Motion) -> Motion {
        let is_bent = |motion: &Motion| motion.warp().is_some_and(|warp| warp.acts_at(0.0));
        let bent = { self.playing.motion.warp() }.is_some_and(|warp| warp.acts_at(moment.seconds));
        if self.playing.rate != 1.0 || bent != is_bent(&motion) {
            let played = self.playing.played_until(moment.seconds);
            motion.blend_from(world.baked.graph(), played, BLEND);
        }
        motion
    }

    /// Steering waits until the threats have passed and the evasion has ended.
    fn hold(&mut self, moment: &Moment, attack: &Attack, evasion_end: Option<f32>) {
        let seconds = attack.end().max(evasion_end.unwrap_or(0.0));
        self.held_until = moment.at + f64::from(seconds);
    }

    fn take(&mut self, moment: &Moment, motion: Motion, now: f64) {
        self.pending = Some(Pending {
            motion,
            at: moment.at,
        });
        self.take_over(now);
    }
}

/// All threats as one attack, which begins at the moment; `None` if they make none.
fn combined(moment: &Moment, near: &[(&Threat, Window)], margin: f32) -> Option<Attack> {
    let mut keys: Vec<Vec<SphereKey>> = Vec::new();
    for (threat, window) in near {
        threat.keys((moment.at, *window), margin, &mut keys);
    }
    Attack::new(keys).ok()
}

/// Tests a motion, which is extended until the attack's end.
fn test(
    world: &World<'_>,
    (mut motion, attack): (Motion, &Attack),
    scratch: &mut PlanScratch,
) -> (Motion, Clearance) {
    motion.extend(world.baked.graph(), attack.end() + 0.1);
    let test = ExactTest {
        extent: Extent::UNTIL_HIT,
        ..ExactTest::new(world.baked, attack)
    };
    let clearance = test.on_motion(&motion, &mut scratch.body);
    (motion, clearance)
}

/// End of the evasion that a motion plays before the attack ends.
fn evasion_end(world: &World<'_>, motion: &Motion, attack_end: f32) -> Option<f32> {
    let graph = world.baked.graph();
    let ends = motion.events(graph).filter_map(|(event, [start, end])| {
        let is_evasion = graph.event(event).kind == crate::anim::EventKind::Evasion;
        (is_evasion && start < attack_end).then_some(end)
    });
    ends.reduce(f32::max)
}

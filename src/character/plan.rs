//! When a character plans, and what it takes over.
//!
//! All known threats count in every plan: they are one attack of several spheres. A plan is made when what is played comes to be hit by
//! what is known now, and is kept as long as that does not happen. It keeps a margin, so that noise in what is seen does not
//! change it.

use std::hash::{Hash, Hasher};

use rustc_hash::FxHasher;

use super::event::CharacterEventKind;
use super::scratch::PlanScratch;
use super::state::{CharacterState, Pending};
use super::threat::{Threat, Window};
use super::world::{KnownThreat, World};
use crate::graph::Motion;
use crate::maps::SphereKey;
use crate::query::clearance::{Clearance, ExactTest, Extent};
use crate::query::{Attack, Query, Request};

/// The moment that a plan is made for.
struct Moment {
    /// On the characters' clock, in seconds.
    at: f64,
    /// Since the start of what is played.
    seconds: f32,
}

/// Blend of a takeover from another playback rate or from a bent pose, in seconds.
const BLEND: f32 = 0.2;

/// Where no evasion that starts early avoids the threats, one that starts so long before the contact is tried, in seconds.
const LATE: f32 = 0.2;

impl CharacterState {
    /// Time until a threat that was not looked at yet may reach the body, in seconds; `None` if all were looked at.
    pub(super) fn urgency(&mut self, index: u32, world: &World<'_>) -> Option<f32> {
        if self.pending.is_some() || world.threats.is_empty() {
            return None;
        }
        let moment = self.moment(world);
        let last = moment.seconds + world.settings.horizon + 2.0;
        self.playing.motion.extend(world.baked.graph(), last);
        let mut hasher = FxHasher::default();
        // Zeros alone would hash to 0, which stands for no threats.
        1u8.hash(&mut hasher);
        let mut nearest = f32::INFINITY;
        for (known, window) in self.near(index, world, &moment) {
            (known.id.0, known.version).hash(&mut hasher);
            nearest = nearest.min(window.nearest);
        }
        if nearest == f32::INFINITY {
            (self.seen, self.retry_at) = (0, None);
            return None;
        }
        let seen = hasher.finish();
        let is_known = seen == self.seen && self.retry_at.is_none_or(|at| world.now < at);
        self.next_seen = seen;
        (!is_known).then_some(nearest)
    }

    /// Answers the threats that are known, if what is played does not avoid them. [`CharacterState::urgency`] comes before it.
    pub(super) fn avoid(&mut self, index: u32, world: &World<'_>, scratch: &mut PlanScratch) {
        let moment = self.moment(world);
        let near: Vec<(&Threat, Window)> = { self.near(index, world, &moment) }
            .map(|(known, window)| (&known.threat, window))
            .collect();
        self.seen = self.next_seen;
        self.answer(world, (&moment, &near), scratch);
    }

    /// The moment at which an answer is taken over.
    fn moment(&self, world: &World<'_>) -> Moment {
        let ahead = world.settings.delay as f32 * world.dt;
        Moment {
            at: world.now + f64::from(ahead),
            seconds: self.playing.seconds + ahead * self.playing.rate,
        }
    }

    /// The threats that may reach the body within the horizon.
    fn near<'s, 'w: 's>(
        &'s self,
        index: u32,
        world: &'s World<'w>,
        moment: &'s Moment,
    ) -> impl Iterator<Item = (&'w KnownThreat, Window)> + use<'s, 'w> {
        let horizon = world.settings.horizon;
        let threats = world.threats.iter();
        let mine = threats.filter(move |known| known.threat.concerns(index));
        mine.filter_map(move |known| {
            let window = self.window(world, moment.at, &known.threat)?;
            (window.nearest < horizon && window.end > 0.0).then_some((known, window))
        })
    }

    fn answer(
        &mut self,
        world: &World<'_>,
        (moment, near): (&Moment, &[(&Threat, Window)]),
        scratch: &mut PlanScratch,
    ) {
        let graph = world.baked.graph();
        let Some(attack) = combined(moment, near, (0.0, None)) else {
            return;
        };
        let was_retry = self.retry_at.is_some();
        let goes_on = self.continued(
            world,
            moment,
            self.playing.motion.rest(graph, moment.seconds),
        );
        let kept = test(world, (goes_on, &attack), scratch);
        if kept.1.is_clean() {
            self.retry_at = None;
            self.hold(moment, &attack, None);
            let clearance = kept.1.metres;
            self.events
                .push((world.now, CharacterEventKind::Kept { clearance }));
            if self.playing.rate != 1.0 {
                self.take(moment, kept.0, world.now);
            }
            return;
        }
        let found = { [None, Some(LATE)] }.into_iter().find_map(|late| {
            let wider = combined(moment, near, (world.settings.margin, late))?;
            self.ask(world, (moment, [&attack, &wider]), scratch)
        });
        let Some((found, clearance)) = found else {
            if !was_retry {
                self.events.push((world.now, CharacterEventKind::Cannot));
            }
            self.retry_at = Some(world.now + f64::from(world.settings.retry));
            return;
        };
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

    /// A motion that avoids the attack, and by how much. The query asks for the wider one.
    fn ask(
        &self,
        world: &World<'_>,
        (moment, [attack, wider]): (&Moment, [&Attack; 2]),
        scratch: &mut PlanScratch,
    ) -> Option<(Motion, f32)> {
        let graph = world.baked.graph();
        let request = Request::of_motion(graph, (&self.playing.motion, moment.seconds), wider);
        let PlanScratch {
            context, answer, ..
        } = scratch;
        Query::new(world.baked, &world.settings.query).answer(request, context, answer);
        let found = self.continued(world, moment, answer.motion.clone());
        let (found, tested) = test(world, (found, attack), scratch);
        tested.is_clean().then_some((found, tested.metres))
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

/// All threats as one attack, which begins at the moment, with radii that are larger by a margin; `None` if they make none. Evasions
/// start when the attack does: with `late`, it begins so long before each threat is nearest.
fn combined(
    moment: &Moment,
    near: &[(&Threat, Window)],
    (margin, late): (f32, Option<f32>),
) -> Option<Attack> {
    let mut keys: Vec<Vec<SphereKey>> = Vec::new();
    for (threat, window) in near {
        let late = late.map_or(0.0, |late| window.nearest - late);
        let window = Window {
            start: window.start.max(late.min(window.end - 1e-3)),
            ..*window
        };
        threat.keys((moment.at, window), margin, &mut keys);
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

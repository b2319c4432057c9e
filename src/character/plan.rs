//! When a character plans, and what it takes over.
//!
//! Every plan treats all known threats as one attack of several spheres. A character plans when a known threat would hit the played motion,
//! and keeps the plan until that happens again. If no motion avoids all threats, the one that hits first is given up for a while, so that the
//! others are avoided. Plans keep a margin, so that noise in the observed threats does not change them.

use std::hash::{Hash, Hasher};

use glam::Vec2;
use glam::Vec3Swizzles;
use rustc_hash::FxHasher;
use serde::{Deserialize, Serialize};

use super::event::{CharacterEventKind, CharacterId, ThreatId};
use super::goal::Aim;
use super::state::{CharacterState, Pending};
use super::threat::Window;
use super::walk_past::walk_past;
use super::world::{KnownThreat, NearThreat, PlanScratch, Worker, World};
use crate::graph::Motion;
use crate::query::clearance::{Clearance, ExactTest, Extent, ObstacleTest, Sampling, WorkLimit};
use crate::query::{Attack, PlanScope, PlanStage, Query, Request, evasions_end};

/// The moment that a plan is made for.
struct Moment {
    /// Time of the game, in seconds.
    at: f64,
    /// Time since the start of the played motion, in seconds.
    seconds: f32,
}

/// Input of one plan.
struct Planning<'a> {
    world: &'a World<'a>,
    moment: Moment,
    near: &'a [NearThreat],
    /// [`CharacterState::height`].
    height: f32,
}

/// How the threats become the attack of one query.
#[derive(Clone, Copy)]
struct Attempt {
    /// Added to the radii, in metres.
    margin: f32,
    /// Time from the start of the attack, and so of the evasions, to the moment at which each threat is nearest, in seconds. `None`: the attack
    /// starts when the threat comes near.
    late: Option<f32>,
}

/// The result of a plan.
enum Plan {
    /// The played motion avoids the threats.
    Keep(TestedMotion),
    /// Another motion avoids them.
    Take(TestedMotion),
    /// No motion avoids all of them. This is the index of the threat that hits the played motion first.
    Fail(Option<u32>),
    /// The motion of the least harm, if none avoids all threats and obstacles.
    Corner {
        motion: TestedMotion,
        /// Whether it is not the played motion.
        is_other: bool,
    },
    /// The limit came before an answer.
    GoOn(Progress),
}

/// A threat that could not be avoided. Plans do without it until a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct GivenUp {
    threat: ThreatId,
    /// [`KnownThreat::version`].
    version: u32,
    /// In seconds.
    pub(super) until: f64,
    /// How often it was given up before.
    times: u8,
}

/// How far a plan has come: everything before was tested, and hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Progress {
    /// Number of the attempt.
    attempt: usize,
    stage: PlanStage,
    /// Hash of the ids of the threats.
    threats: u64,
}

/// Blend of a takeover from another playback rate or from a bent pose, in seconds.
const BLEND: f32 = 0.2;

/// The same of the root's position, so that the body does not push off for it.
const ROOT_BLEND: f32 = 0.8;

/// Time before the contact at which evasions start in the second attempt, after no early evasion avoids the threats, in seconds.
const LATE: f32 = 0.2;

/// How often the time between attempts is doubled while a threat cannot be avoided.
const MOST_DOUBLED: u8 = 4;

/// The next moments of a motion, in seconds.
const SOON: f32 = 0.2;

/// Among obstacles, another motion is taken only if its harm is less by this, in metres.
const GAIN: f32 = 0.02;

impl CharacterState {
    /// Time until a threat that has to be looked at may reach the body, in seconds; `None` if there is none.
    pub(super) fn urgency(
        &mut self,
        id: CharacterId,
        world: &World<'_>,
        threats: &mut Vec<u32>,
    ) -> Option<f32> {
        if self.pending.is_some() {
            return None;
        }
        if world.threats.is_empty() {
            self.forget_threats(world.now);
            return None;
        }
        let moment = self.moment(world);
        let last = moment.seconds + world.settings.horizon + 2.0;
        self.playing.motion.extend(world.baked.graph(), last);
        let mut hasher = FxHasher::default();
        // Zeros alone would hash to 0, which stands for no threats.
        1u8.hash(&mut hasher);
        let mut nearest = f32::INFINITY;
        self.find_near(world, &moment, threats);
        self.review_given_up(world, &moment);
        for NearThreat { index, window } in self.near(id, world, &moment, threats) {
            let known = &world.threats[index as usize];
            (known.id.0, known.version).hash(&mut hasher);
            nearest = nearest.min(window.nearest);
        }
        if nearest == f32::INFINITY {
            self.forget_threats(world.now);
            return None;
        }
        let seen = hasher.finish();
        let is_known = seen == self.seen && self.retry_at.is_none_or(|at| world.now < at);
        self.next_seen = seen;
        (!is_known).then_some(nearest)
    }

    /// Resets the state of planning if no threat is near. Steering then waits only for the end of a planned motion.
    fn forget_threats(&mut self, now: f64) {
        (self.seen, self.retry_at, self.avoided) = (0, None, 0);
        self.progress = Progress::default();
        self.passed_at = self.passed_at.min(now);
        if !self.has_plan {
            self.held_until = self.held_until.min(now);
        }
    }

    /// Forgets the threats that were given up and are no longer near. Those that have changed since are looked at again soon.
    fn review_given_up(&mut self, world: &World<'_>, moment: &Moment) {
        let soon = world.now + f64::from(world.settings.retry);
        let mut given_up = std::mem::take(&mut self.given_up);
        given_up.retain_mut(|one| {
            let Some(index) = world.threat_index(one.threat) else {
                return false;
            };
            let known = &world.threats[index];
            if std::mem::replace(&mut one.version, known.version) != known.version {
                one.until = one.until.min(soon);
            }
            self.window_within(world, moment, known).is_some()
        });
        self.given_up = given_up;
    }

    /// When a threat may reach the body within the horizon.
    fn window_within(
        &self,
        world: &World<'_>,
        moment: &Moment,
        known: &KnownThreat,
    ) -> Option<Window> {
        let window = self.window(world, moment.at, known)?;
        let is_near = window.nearest < world.settings.horizon && window.end > 0.0;
        is_near.then_some(window)
    }

    /// Answers the known threats, if the played motion does not avoid them. [`CharacterState::urgency`] comes before it. Returns
    /// `false` if the limit came before the answer: the next step then goes on.
    pub(super) fn avoid(
        &mut self,
        id: CharacterId,
        world: &World<'_>,
        worker: &mut Worker,
    ) -> bool {
        let moment = self.moment(world);
        self.near_obstacles(id, world, &mut worker.obstacles);
        let scratch = &mut worker.plan;
        let ahead = (moment.at - world.now) as f32;
        scratch.ahead.clear();
        scratch.wider.clear();
        for obstacle in &worker.obstacles {
            let margin = world.settings.obstacle_margin;
            scratch.ahead.push(obstacle.later(ahead, 0.0));
            scratch.wider.push(obstacle.later(ahead, margin));
        }
        self.find_near(world, &moment, &mut worker.threats);
        let mut near = std::mem::take(&mut scratch.near);
        near.clear();
        near.extend(self.near(id, world, &moment, &worker.threats));
        let attacks = scratch.attacks.take();
        let mut attacks = attacks.unwrap_or_else(|| [Attack::empty(), Attack::empty()]);
        let planning = Planning {
            world,
            moment,
            near: &near,
            height: self.height,
        };
        let is_over = self.answer_threats(&planning, &mut attacks, scratch);
        (scratch.near, scratch.attacks) = (near, Some(attacks));
        is_over
    }

    /// Plans, and begins the plan. Returns `false` if the limit came before the answer. The attacks are memory.
    fn answer_threats(
        &mut self,
        planning: &Planning<'_>,
        [attack, wider]: &mut [Attack; 2],
        scratch: &mut PlanScratch,
    ) -> bool {
        if planning.write_attack(Attempt::PLAIN, attack) {
            scratch.context.body().set_additive(&self.additive);
            scratch.context.start_plan(WorkLimit {
                deadline: scratch.deadline,
                most: planning.world.settings.plan_work as usize,
            });
            let plan = self.plan(planning, attack, wider, scratch);
            scratch.context.end_plan();
            if let Plan::GoOn(progress) = plan {
                self.progress = progress;
                return false;
            }
            self.progress = Progress::default();
            self.begin_plan(planning, attack, plan, scratch);
        }
        self.seen = self.next_seen;
        true
    }

    /// The moment at which an answer is taken over.
    fn moment(&self, world: &World<'_>) -> Moment {
        let ahead = world.settings.delay as f32 * world.dt;
        Moment {
            at: world.now + f64::from(ahead),
            seconds: self.playing.seconds + ahead * self.playing.rate,
        }
    }

    /// Lists the threats whose ways come near the body.
    fn find_near(&self, world: &World<'_>, moment: &Moment, out: &mut Vec<u32>) {
        let root = self
            .playing
            .motion
            .root(world.baked.graph(), moment.seconds);
        world.flights.near(root.xz(), out);
    }

    /// Those of the threats that may reach the body within the horizon, and are not given up.
    fn near<'s, 'w: 's>(
        &'s self,
        id: CharacterId,
        world: &'s World<'w>,
        moment: &'s Moment,
        threats: &'s [u32],
    ) -> impl Iterator<Item = NearThreat> + use<'s, 'w> {
        let is_given_up = |threat: ThreatId| {
            let mut given_up = self.given_up.iter();
            given_up.any(|one| one.threat == threat && world.now < one.until)
        };
        threats.iter().filter_map(move |&index| {
            let known = &world.threats[index as usize];
            let known = Some(known).filter(|known| known.is_for(id) && !is_given_up(known.id))?;
            let window = self.window_within(world, moment, known)?;
            Some(NearThreat { index, window })
        })
    }

    /// Tests the played motion, and looks for another one if it is hit. `wider` is memory for the attacks of the attempts.
    fn plan(
        &self,
        planning: &Planning<'_>,
        attack: &Attack,
        wider: &mut Attack,
        scratch: &mut PlanScratch,
    ) -> Plan {
        let world = planning.world;
        let test = PlanTest { world, attack };
        let rest = self.rest(planning, scratch);
        scratch.context.body().set_grace(true);
        let mut kept = test.until_hit(rest, scratch);
        if kept.is_clean() {
            return Plan::Keep(kept);
        }
        let is_among_obstacles = !scratch.ahead.is_empty();
        let mut least = None;
        let place = self.playing.ground(world.baked.graph());
        let aim = self.goal.aim(place, &mut self.has_arrived.clone());
        let velocity = aim.velocity;
        let threats = planning.threats();
        let before = Some(self.progress).filter(|progress| progress.threats == threats);
        if before.is_none() {
            scratch.context.body().set_grace(false);
            if let Some(found) = self.walk_past(planning, aim, wider, &kept, scratch) {
                scratch.keep_memory(kept.motion);
                return Plan::Take(found);
            }
            if scratch.context.body().is_late() {
                scratch.keep_memory(kept.motion);
                return Plan::GoOn(Progress {
                    threats,
                    ..Progress::default()
                });
            }
        }
        let progress = before.unwrap_or_default();
        let has_all_time = scratch.is_first || scratch.deadline.is_none();
        let attempts = Attempt::all(world.settings.margin, is_among_obstacles);
        for (number, attempt) in attempts.enumerate().skip(progress.attempt) {
            if !planning.write_attack(attempt, wider) {
                continue;
            }
            let first_stage = match number == progress.attempt {
                true => progress.stage,
                false => PlanStage::Grid,
            };
            let scope = PlanScope {
                plain: attack,
                margin: attempt.margin,
                evasions_only: attempt.late.is_some(),
                first_stage,
                velocity,
            };
            let mut tested = self.ask(planning, wider, scope, &kept, scratch);
            if let Some(clean) = tested.take_if(|tested| tested.is_clean()) {
                let unused = least.into_iter().chain([kept]);
                unused.for_each(|unused| scratch.keep_memory(unused.motion));
                return Plan::Take(clean);
            }
            scratch.context.body().set_grace(false);
            let is_late = scratch.context.body().is_late();
            let next = match scratch.context.late_stage() {
                // A stage that had all the time of a step is left.
                Some(late) if late == first_stage && has_all_time => late.next(),
                late => late,
            };
            if next.is_some() || is_late {
                let is_last =
                    |stage: &PlanStage| scope.evasions_only && *stage > PlanStage::Evasions;
                let (attempt, stage) = match next.filter(|stage| !is_last(stage)) {
                    Some(stage) => (number, stage),
                    None => (number + 1, PlanStage::Grid),
                };
                let unused = least.into_iter().chain(tested).chain([kept]);
                unused.for_each(|unused| scratch.keep_memory(unused.motion));
                return Plan::GoOn(Progress {
                    attempt,
                    stage,
                    threats,
                });
            }
            let Some(mut tested) = tested else { continue };
            if !is_among_obstacles {
                scratch.keep_memory(tested.motion);
                continue;
            }
            test.measure(&mut tested, scratch);
            least = Some(match least {
                None => tested,
                Some(before) => {
                    let [least, unused] = least_harm(before, tested);
                    scratch.keep_memory(unused.motion);
                    least
                }
            });
        }
        if !is_among_obstacles {
            scratch.keep_memory(kept.motion);
            return Plan::Fail(planning.hit_at(kept.clearance.time));
        }
        test.measure(&mut kept, scratch);
        let is_other = |other: &TestedMotion| other.harm() + GAIN < kept.harm();
        let is_other = least.as_ref().is_some_and(is_other);
        let (motion, unused) = match least {
            Some(other) if is_other => (other, Some(kept)),
            least => (kept, least),
        };
        if let Some(unused) = unused {
            scratch.keep_memory(unused.motion);
        }
        Plan::Corner { motion, is_other }
    }

    /// Walks on to the goal past the threats, if there is one. `kept` is the played motion, which is hit.
    fn walk_past(
        &self,
        planning: &Planning<'_>,
        aim: Aim,
        wider: &mut Attack,
        kept: &TestedMotion,
        scratch: &mut PlanScratch,
    ) -> Option<TestedMotion> {
        let world = planning.world;
        let margin = world.settings.margin;
        let attempt = Attempt { margin, late: None };
        if aim.stands() || !planning.write_attack(attempt, wider) {
            return None;
        }
        let test = PlanTest {
            world,
            attack: wider,
        };
        let mut found = walk_past(test, aim, kept, scratch)?;
        found.clearance.metres += margin;
        Some(found)
    }

    /// Begins the plan, and reports it.
    fn begin_plan(
        &mut self,
        planning: &Planning<'_>,
        attack: &Attack,
        plan: Plan,
        scratch: &mut PlanScratch,
    ) {
        let Planning { world, moment, .. } = planning;
        let now = world.now;
        match plan {
            Plan::Keep(kept) => {
                self.keep(planning);
                let threats = planning.threats();
                if std::mem::replace(&mut self.avoided, threats) != threats {
                    let clearance = kept.clearance.metres;
                    self.events
                        .push((now, CharacterEventKind::Kept { clearance }));
                }
                // The tested motion has the rate in it.
                if self.playing.rate != 1.0 && now < self.held_until {
                    self.take(moment, kept.motion, now, scratch);
                } else {
                    scratch.keep_memory(kept.motion);
                }
            }
            Plan::GoOn(_) => {}
            Plan::Take(found) => {
                self.forget_attempts(now);
                self.avoided = planning.threats();
                let is_change = self.has_plan;
                self.events
                    .extend(planning.first().map(|(threat, contact)| {
                        let planned = CharacterEventKind::Planned {
                            clearance: found.clearance.metres,
                            is_change,
                            threat,
                            contact,
                        };
                        (now, planned)
                    }));
                self.has_plan = true;
                self.hold(moment, attack, found.end);
                self.take(moment, found.motion, now, scratch);
            }
            Plan::Fail(threat) => {
                self.avoided = 0;
                // The next plan avoids the others.
                if threat.is_some_and(|threat| self.give_up(threat, world)) {
                    self.events.push((now, CharacterEventKind::Cannot));
                }
            }
            Plan::Corner { motion, is_other } => {
                self.avoided = 0;
                let cornered = CharacterEventKind::Cornered {
                    hit: -motion.clearance.metres,
                    entered: motion.entered,
                };
                if is_other {
                    self.has_plan = true;
                    self.hold(moment, attack, motion.end);
                    self.take(moment, motion.motion, now, scratch);
                } else {
                    scratch.keep_memory(motion.motion);
                }
                let mut is_new = false;
                for near in planning.near {
                    is_new |= self.give_up(near.index, world);
                }
                if is_new {
                    self.events.push((now, cornered));
                }
            }
        }
    }

    /// Does without avoiding a threat for a while, the longer, the more often that failed. Returns whether it is the first time.
    fn give_up(&mut self, index: u32, world: &World<'_>) -> bool {
        let KnownThreat {
            id: threat,
            version,
            ..
        } = world.threats[index as usize];
        let mut given_up = self.given_up.iter();
        let before = given_up.position(|one| one.threat == threat);
        let times = before.map_or(0, |place| self.given_up.swap_remove(place).times + 1);
        let times = times.min(MOST_DOUBLED);
        let pause = world.settings.retry * 2.0f32.powi(times.into());
        let until = world.now + f64::from(pause);
        self.given_up.push(GivenUp {
            threat,
            version,
            until,
            times,
        });
        before.is_none()
    }

    /// Forgets how often threats were given up that are avoided now.
    fn forget_attempts(&mut self, now: f64) {
        self.given_up.retain(|one| now < one.until);
    }

    /// The answer to the wider attack, tested against the plain one; `None` if the body would push too hard, or the time was up before there was
    /// one.
    fn ask(
        &self,
        planning: &Planning<'_>,
        wider: &Attack,
        scope: PlanScope<'_>,
        kept: &TestedMotion,
        scratch: &mut PlanScratch,
    ) -> Option<TestedMotion> {
        let world = planning.world;
        let PlanScratch {
            context,
            answer,
            wider: obstacles,
            ..
        } = scratch;
        let playing = self.playing.motion.moment_at(planning.moment.seconds);
        let request = Request {
            obstacles,
            ..Request::from_motion(world.baked.graph(), playing, wider)
        };
        let query = Query::new(world.baked, &world.settings.query);
        context.body().set_grace(false);
        let had_time = !context.body().is_late();
        query.answer_in_scope(request, Some(scope), context, answer);
        context.body().set_grace(true);
        let has_failed = had_time && context.late_stage().is_some();
        if answer.too_hard || has_failed {
            return None;
        }
        let known = answer.clearance();
        let mut motion = scratch.motion();
        motion.clone_from(&scratch.answer.motion);
        let (motion, is_blended) = self.continued(planning, motion);
        let metres = known.metres + scope.margin;
        let known = Clearance { metres, ..known };
        let test = PlanTest {
            world,
            attack: scope.plain,
        };
        // A motion that is measured later needs no test.
        let weights = scratch.ahead.iter().map(|obstacle| obstacle.weight);
        let spared = weights.fold(0.0, f32::max) * world.settings.obstacle_margin;
        let is_measured_later = !scratch.ahead.is_empty() && metres < -spared;
        let is_known = scratch.answer.avoided && !scope.evasions_only || is_measured_later;
        let mut tested = match is_known && !is_blended {
            true => test.known(motion, known),
            false => test.until_hit(motion, scratch),
        };
        // Without a blend the query has measured all but the first moments.
        let end = if is_blended { tested.end } else { SOON };
        let is_clean = tested.is_clean();
        if is_clean && self.pushes_too_hard(planning, &mut tested.motion, end, kept, scratch) {
            scratch.keep_memory(tested.motion);
            return None;
        }
        Some(tested)
    }

    /// Whether a motion that continues the played one asks the body until `end` to push off harder than in the answers of queries, and harder
    /// than the played motion, `kept`, does anyway in the next moments.
    fn pushes_too_hard(
        &self,
        planning: &Planning<'_>,
        motion: &mut Motion,
        end: f32,
        kept: &TestedMotion,
        scratch: &mut PlanScratch,
    ) -> bool {
        let Planning { world, moment, .. } = planning;
        let baked = world.baked;
        motion.extend(baked.graph(), end);
        let body = scratch.context.body();
        let played = Some(self.playing.played_until(moment.seconds));
        let contact = kept.clearance.time;
        let allowed = world.settings.query.allowed_push(baked, contact);
        if body.push(baked, played, motion, end, allowed) <= allowed {
            return false;
        }
        let soon = SOON.max(kept.motion.blends_until());
        let natural = body.push(baked, played, &kept.motion, soon, f32::INFINITY);
        let limit = allowed.max(natural);
        body.push(baked, played, motion, end, limit) > limit
    }

    /// What remains of the played motion, as it is played. One that is bent returns to its own rate.
    fn rest(&self, planning: &Planning<'_>, scratch: &mut PlanScratch) -> Motion {
        let graph = planning.world.baked.graph();
        let mut rest = scratch.motion();
        rest.clone_from(&self.playing.motion);
        rest.leave_behind(graph, planning.moment.seconds);
        if self.playing.drift == Vec2::ZERO && rest.retime(self.playing.rate) {
            return rest;
        }
        self.continued(planning, rest).0
    }

    /// Joins a motion to the played one, with a blend if that is warped or has another rate at the join. Returns whether there is a blend, too.
    fn continued(&self, planning: &Planning<'_>, mut motion: Motion) -> (Motion, bool) {
        let Planning { world, moment, .. } = planning;
        let is_bent = |motion: &Motion| motion.warp().is_some_and(|warp| warp.acts_at(0.0));
        let bent = self
            .playing
            .motion
            .warp()
            .is_some_and(|warp| warp.acts_at(moment.seconds));
        let is_steered = self.playing.rate != 1.0 || self.playing.drift != Vec2::ZERO;
        let is_blended = is_steered || bent != is_bent(&motion);
        if is_blended {
            let played = self.playing.played_until(moment.seconds);
            // Until an answer that comes later, the motion has no drift.
            let drift = match moment.at <= world.now {
                true => self.playing.drift,
                false => Vec2::ZERO,
            };
            motion.blend_on_feet(world.baked.graph(), played, [BLEND, ROOT_BLEND], drift, &[]);
        }
        (motion, is_blended)
    }

    /// Steering waits until the threats have passed and the evasion has ended, or been left.
    fn hold(&mut self, moment: &Moment, attack: &Attack, evasion_end: f32) {
        let seconds = attack.end().max(evasion_end);
        self.held_until = moment.at + f64::from(seconds);
        self.passed_at = moment.at + f64::from(attack.end());
        self.retry_at = Some(self.held_until);
    }

    /// Keeps what is played. Steering waits no longer than for the threats that an evasion was begun for; what it then plays is tested again
    /// and again.
    fn keep(&mut self, planning: &Planning<'_>) {
        let Planning { world, .. } = planning;
        self.forget_attempts(world.now);
        let mut again = world.now + f64::from(world.settings.retry);
        if self.has_plan {
            again = again.max(self.held_until);
        }
        self.retry_at = Some(again);
    }

    fn take(&mut self, moment: &Moment, motion: Motion, now: f64, scratch: &mut PlanScratch) {
        self.pending = Some(Pending {
            motion,
            at: moment.at,
        });
        self.take_over(now, scratch);
    }
}

impl Attempt {
    /// The threats as they are.
    const PLAIN: Self = Self {
        margin: 0.0,
        late: None,
    };

    /// The attempts, in their order, with a margin in metres. If a blend makes the answer to the wider attack a hit, the answer to the plain
    /// attack may still avoid it.
    fn all(margin: f32, is_among_obstacles: bool) -> impl Iterator<Item = Self> {
        let early = Self { margin, late: None };
        let late = Self {
            margin,
            late: Some(LATE),
        };
        let has_plain = margin > 0.0 && !is_among_obstacles;
        [early, late]
            .into_iter()
            .chain(has_plain.then_some(Self::PLAIN))
    }
}

impl Planning<'_> {
    /// Hash of the ids of the threats, wherever they move; not 0.
    fn threats(&self) -> u64 {
        let mut hasher = FxHasher::default();
        for near in self.near {
            self.known(near).id.hash(&mut hasher);
        }
        hasher.finish() | 1
    }

    /// The threat that comes first, and when it is nearest, as a time of the game; `None` without threats.
    fn first(&self) -> Option<(ThreatId, f64)> {
        let each = self.near.iter();
        let first = each.min_by(|a, b| a.window.nearest.total_cmp(&b.window.nearest))?;
        let contact = self.moment.at + f64::from(first.window.nearest);
        Some((self.known(first).id, contact))
    }

    /// Index of the threat that is nearest to the body about so many seconds after the moment; `None` without threats.
    fn hit_at(&self, seconds: f32) -> Option<u32> {
        let off = |near: &NearThreat| (near.window.nearest - seconds).abs();
        let near = self.near.iter();
        let found = near.min_by(|a, b| off(a).total_cmp(&off(b)));
        found.map(|found| found.index)
    }

    fn known(&self, near: &NearThreat) -> &KnownThreat {
        &self.world.threats[near.index as usize]
    }

    /// Writes all threats as one attack, which begins at the moment. Returns whether they make one.
    fn write_attack(&self, attempt: Attempt, out: &mut Attack) -> bool {
        out.clear();
        for near in self.near {
            let window = near.window;
            let late = attempt.late.map_or(0.0, |late| window.nearest - late);
            let window = Window {
                start: window.start.max(late.min(window.end - 1e-3)),
                ..window
            };
            let known = self.known(near);
            known.add_to(out, &window, self.height, attempt.margin);
        }
        out.check().is_ok()
    }
}

/// A motion, tested against threats and obstacles.
pub(super) struct TestedMotion {
    pub(super) motion: Motion,
    pub(super) clearance: Clearance,
    /// Depth in an obstacle times its weight, in metres; 0 for none.
    entered: f32,
    /// When threats have passed and evasions have ended, in seconds.
    end: f32,
}

impl TestedMotion {
    pub(super) fn is_clean(&self) -> bool {
        self.clearance.is_clean() && self.entered == 0.0
    }

    /// Depth of the hit, or of the entry times the obstacle's weight, in metres.
    fn harm(&self) -> f32 {
        self.entered.max(-self.clearance.metres)
    }
}

/// The one with the least harm, the first of equals, and the other.
fn least_harm(before: TestedMotion, other: TestedMotion) -> [TestedMotion; 2] {
    match before.harm() <= other.harm() {
        true => [before, other],
        false => [other, before],
    }
}

/// Tests motions against an attack and the obstacles of a plan.
#[derive(Clone, Copy)]
pub(super) struct PlanTest<'a> {
    pub(super) world: &'a World<'a>,
    attack: &'a Attack,
}

impl PlanTest<'_> {
    /// A motion whose clearance is known, with what it enters left out.
    fn known(&self, mut motion: Motion, clearance: Clearance) -> TestedMotion {
        let graph = self.world.baked.graph();
        motion.extend(graph, self.attack.end() + 0.1);
        let end = evasions_end(graph, &motion, self.attack.end());
        motion.extend(graph, end);
        TestedMotion {
            motion,
            clearance,
            entered: 0.0,
            end,
        }
    }

    /// Tests a motion, which is extended until the attack's end, until it is known whether it is clean.
    pub(super) fn until_hit(&self, mut motion: Motion, scratch: &mut PlanScratch) -> TestedMotion {
        motion.extend(self.world.baked.graph(), self.attack.end() + 0.1);
        let test = ExactTest {
            extent: Extent::UNTIL_HIT,
            sampling: Sampling::CoarseFirst,
            ..ExactTest::new(self.world.baked, self.attack)
        };
        let clearance = test.on_motion(&motion, scratch.context.body());
        let mut tested = self.known(motion, clearance);
        if clearance.is_clean() {
            tested.entered = self.entered(&tested, 0.0, scratch);
        }
        tested
    }

    /// Measures the deepest hit and the most harmful entry.
    fn measure(&self, tested: &mut TestedMotion, scratch: &mut PlanScratch) {
        let test = ExactTest {
            sampling: Sampling::CoarseFirst,
            ..ExactTest::new(self.world.baked, self.attack)
        };
        tested.clearance = test.on_motion(&tested.motion, scratch.context.body());
        tested.entered = self.entered(tested, f32::INFINITY, scratch);
    }

    /// Largest harm by an obstacle, or one above `enough`, in metres; 0 for none.
    fn entered(&self, tested: &TestedMotion, enough: f32, scratch: &mut PlanScratch) -> f32 {
        let test = ObstacleTest {
            baked: self.world.baked,
            obstacles: &scratch.ahead,
            seconds: (0.0, tested.end),
            enough,
        };
        let entered = scratch.context.body().worst_entry(&test, &tested.motion);
        entered.map_or(0.0, |entered| entered.harm)
    }
}

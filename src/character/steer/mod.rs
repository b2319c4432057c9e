//! Steering: chooses the moment of the clips that a character plays so that it follows its goal.
//!
//! Source: Clavet, "Motion Matching and The Road to Next-Gen Animation" (GDC 2016), sections on the search and on inertialization. Differs:
//! the rest of the error is removed by playback rate and by a slow turn of the root, as in Kovar & Gleicher, "Flexible Automatic Motion
//! Blending with Registration Curves" (2003), section 5, and then by shorter or longer strides: the motion is moved over the ground while feet
//! that stand are held by inverse kinematics ("stride warping" in game engines). Jumps, turns, rates and strides keep within the acceleration
//! that the clips reach: a jump costs more the harder the body would push off in it, its root blends the longer, no blend is cut by a search,
//! and a turn has what the motion leaves. An idle character plays standing moments and chooses none of them twice within a
//! time. Each of them moves the body a little, and over an hour these steps would add up to metres: each jump moves it a little towards its
//! place.

mod jump;
mod memory;
mod strikes;
mod table;

use glam::{Vec2, Vec3, Vec3Swizzles};

use super::goal::{Aim, direction, heading_of, wrapped};
use super::playing::{Momentum, Playing};
use super::settings::SteerSettings;
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::{EdgeId, Entry, Motion, Playhead};
use crate::maps::{BakedGraph, Stance};
use crate::math::Rigid2;
use jump::{Body, Jumps};
use memory::SHORTLY;
pub(super) use memory::SteerState;
pub(super) use strikes::{Reach, Recent, StrikeTable, Target, Times};
use table::{AHEAD, BoxOrder, Features, Moment, Row, Table, centre_of_mass, distance, pace};

/// Maximum distance by which a jump brings a character back to the place where it came to stand, in metres. The jump's blend fades it in.
const MOST_RETURN: f32 = 0.02;

/// Speed above which a character walks, in metres per second.
const WALKS: f32 = 0.3;

/// Time in which a character that hardly moves is not searched for again after it has begun to, in seconds.
const STARTING: f32 = 0.6;

/// Scratch of steering.
#[derive(Clone, Debug, Default)]
pub(super) struct SteerScratch {
    pose: Pose,
    joints: Vec<JointTransform>,
    axes: Vec<f32>,
    spare: Motion,
    order: BoxOrder,
}

/// The tables of one graph.
#[derive(Clone, Debug)]
pub(super) struct Steering {
    table: Table,
    /// The moments at which a new character may start.
    starts: Vec<u32>,
    pub(super) strikes: StrikeTable,
}

/// Input of one step of one character.
pub(super) struct SteerStep<'a> {
    pub baked: &'a BakedGraph,
    pub settings: &'a SteerSettings,
    pub aim: Aim,
    /// Whether the step may search, even if the played motion does not end.
    pub may_search: bool,
    /// Duration of the step, in seconds.
    pub dt: f32,
}

/// Position and movement of a character in the world.
struct Now {
    stance: Stance,
    /// Heading, in radians; averaged over a stride if the table has the average.
    heading: f32,
    features: Features,
    /// Centre of mass over the ground (x, z).
    centre: Vec2,
    /// Its velocity in the character's frame (x, z), in metres per second.
    pace: Vec2,
    /// Rate at which the motion is played.
    rate: f32,
}

impl Steering {
    pub(super) fn new(baked: &BakedGraph) -> Self {
        /// It stands for so long at least, in seconds.
        const STANDS: f32 = 1.0;
        let table = Table::new(baked);
        let calm = |(_, moment): &(u32, &Moment)| moment.calm_for > STANDS;
        let starts = (0..).zip(&table.moments).filter(calm);
        Self {
            starts: starts.map(|(index, _)| index).collect(),
            strikes: StrikeTable::new(baked),
            table,
        }
    }

    /// Number of moments that can be steered to.
    pub(super) fn len(&self) -> usize {
        self.table.moments.len()
    }

    /// The moment at which the character of a place in the list starts: one that stands, or the first one. Characters that are added one
    /// after the other start at moments that lie far apart, so that they do not move in step.
    pub(super) fn start(&self, index: u32) -> Option<(EdgeId, f32)> {
        /// Multiples of it are spread evenly over [0, 1), however many there are.
        const GOLDEN: f64 = 0.618_033_988_749_895;
        let share = (f64::from(index) * GOLDEN).fract();
        let start = (share * self.starts.len() as f64) as usize;
        let start = self.starts.get(start).map_or(0, |&start| start as usize);
        let moment = self.table.moments.get(start)?;
        Some((moment.edge, moment.edge_frame as f32))
    }

    /// Chooses the motion and turns it. The caller then advances time.
    pub(super) fn step(
        &self,
        step: &SteerStep<'_>,
        playing: &mut Playing,
        state: &mut SteerState,
        scratch: &mut SteerScratch,
    ) {
        let graph = step.baked.graph();
        playing.ensure(graph, step.dt);
        state.search_in -= step.dt;
        let playhead = playing.motion.playhead(graph, playing.seconds);
        let current = self.table.at(graph, playhead);
        let moment = current.map(|current| self.table.moments[current]);
        let is_new = step.aim.differs(&state.last_aim());
        state.follow(playing.ground(graph), &step.aim, is_new, step.dt);
        let ends = moment.is_none_or(|moment| moment.left < 0.05);
        let speed = moment.map_or_else(|| playing.speed(graph), |moment| moment.velocity.length());
        let is_slow = speed < WALKS;
        let is_idle = is_slow && step.aim.stands() && step.faces(playing, moment.as_ref());
        if let Some(moment) = moment.filter(|_| is_idle) {
            state.remember(&moment, step, self.table.calm);
            if moment.is_calm() {
                let here = || playing.ground(graph).to_array();
                state.place.get_or_insert_with(here);
            }
        }
        if !step.aim.stands() {
            state.place = None;
        }
        let goes_on = |moment: Moment| moment.is_calm() && !state.repeats(&moment);
        let is_held = is_idle && !ends && moment.is_some_and(goes_on);
        state.is_held = is_held;
        state.stands = moment.is_some_and(|moment| moment.is_calm());
        let needs_search = (is_new || ends || state.search_in <= 0.0) && !is_held;
        // A blend is never cut, as the offsets of both would add up.
        let is_over = ends || is_idle && moment.is_some_and(|moment| state.repeats(&moment));
        let blends = playing.motion.is_blending_body(playing.seconds);
        if needs_search && state.may_search((step.may_search || is_over) && !blends) {
            state.search_in = step.settings.interval;
            state.aim = step.aim.velocity.to_array();
            state.facing = step.aim.facing;
            let now = step.now(playing, moment.as_ref(), scratch);
            let wanted = wanted(&step.aim, &now, self.table.limit).row();
            let kept = current.filter(|_| !ends);
            let body = Body::new(&now, moment.as_ref());
            let jumps = Jumps::new(&self.table, step, body, step.settings.blend);
            let order = &mut scratch.order;
            let found = self.choose(&jumps, step, state, (&wanted, kept), is_idle, order);
            if let Some(found) = found {
                let rate = jumps.rate(found);
                // What stands stays where it is.
                let blend = match is_idle {
                    true => 0.0,
                    false => jumps.blend(found, rate),
                };
                let mut entry = step.entry(found, &now, [rate, blend]);
                if is_idle {
                    let root = now.stance.root.xz();
                    let way = state.off_place(root).clamp_length_max(MOST_RETURN);
                    entry.clip_to_world.x -= way.x;
                    entry.clip_to_world.z -= way.y;
                }
                let spare = &mut scratch.spare;
                playing.enter(graph, &entry, [rate, blend], &found.standing, spare);
                // What begins slowly would be left for another beginning.
                if state.is_stuck(self.table.speed(step.aim.velocity)) {
                    state.search_in = STARTING.max(step.settings.interval);
                }
            }
        }
        // One of many that stand and are to walk does not turn before its search.
        let waits = is_new && !step.may_search && state.stands && !step.aim.stands();
        if !waits {
            self.turn(step, playing);
        }
    }

    /// Begins to walk towards the aim at the clips' own rate, whatever is played.
    pub(super) fn walk_on(
        &self,
        step: &SteerStep<'_>,
        playing: &mut Playing,
        scratch: &mut SteerScratch,
    ) {
        let graph = step.baked.graph();
        playing.ensure(graph, step.dt);
        let playhead = playing.motion.playhead(graph, playing.seconds);
        let moment = self.table.at(graph, playhead);
        let moment = moment.map(|moment| &self.table.moments[moment]);
        let now = step.now(playing, moment, scratch);
        let jumps = Jumps::new(
            &self.table,
            step,
            Body::new(&now, moment),
            step.settings.blend,
        );
        let walks = |moment: &Moment| moment.ahead >= WALKS;
        let effort = |moment: &Moment, room: f32| jumps.effort(moment, 1.0, room);
        let wanted = wanted(&step.aim, &now, self.table.limit).row();
        if let Some((found, _)) =
            self.table
                .nearest(&wanted, f32::INFINITY, &mut scratch.order, walks, effort)
        {
            let found = &self.table.moments[found];
            let played = [1.0, jumps.blend(found, 1.0)];
            let entry = step.entry(found, &now, played);
            playing.enter(graph, &entry, played, &found.standing, &mut scratch.spare);
        }
    }

    /// The moment to jump to; `None` to continue the played motion. `current` is the played moment, if it may be continued. `is_idle` says
    /// whether the character stands and should stand.
    fn choose(
        &self,
        jumps: &Jumps<'_>,
        step: &SteerStep<'_>,
        state: &SteerState,
        (wanted, current): (&Row, Option<usize>),
        is_idle: bool,
        order: &mut BoxOrder,
    ) -> Option<&Moment> {
        /// An idle character goes to what stands for so long at least, in seconds.
        const LINGERS: f32 = 0.5;
        let mut nearest = |within: f32, allowed: &dyn Fn(&Moment) -> bool| {
            self.table
                .nearest(wanted, within, order, allowed, |moment, room| {
                    jumps.effort(moment, jumps.rate(moment), room)
                })
        };
        let (gain, moments) = (step.settings.gain, &self.table.moments);
        let playing = current.map(|current| &moments[current]);
        let kept = current.map(|current| distance(&self.table.rows[current], wanted));
        let kept = kept.unwrap_or(f32::INFINITY);
        let (found, kept) = if is_idle {
            // What stands and was not played for long, or else not just now, or else anything that stands.
            let mut fresh = |within: f32| {
                nearest(f32::INFINITY, &|moment| {
                    moment.calm_for > LINGERS && !state.has_played(moment, within)
                })
            };
            let found = fresh(f32::INFINITY).or_else(|| fresh(SHORTLY));
            // Motion that was played just now, or that moves the hands, is left.
            let leaves = |moment: &Moment| state.repeats(moment) || !moment.is_calm();
            let kept = match playing {
                Some(playing) if found.is_some() && leaves(playing) => f32::INFINITY,
                _ => kept,
            };
            let found = found.or_else(|| nearest(f32::INFINITY, &|moment| moment.is_calm()));
            (found, kept)
        } else {
            (nearest(kept - gain, &|_| true), kept)
        };
        let found = found.filter(|(_, apart)| apart + gain < kept);
        let found = found.map(|(found, _)| &moments[found]);
        // Standing, or steps to and fro, may stay nearly as similar to the aim as a walk, for as long as that is the aim.
        let wanted = self.table.speed(step.aim.velocity);
        let is_stuck = state.is_stuck(wanted);
        let least = if is_stuck {
            WALKS.max(0.6 * wanted)
        } else {
            WALKS
        };
        let is_slow = |moment: &Moment| moment.ahead < least;
        let stays = is_stuck || playing.is_none_or(is_slow) && found.is_none_or(is_slow);
        if wanted > WALKS && stays {
            let start = nearest(f32::INFINITY, &|moment| !is_slow(moment));
            return start.map(|(start, _)| &moments[start]).or(found);
        }
        found
    }

    /// Leaves an evasion for the natural motion nearest to the aim, if an exit of the baked graph allows it. Returns whether it does.
    pub(super) fn leave(
        &self,
        step: &SteerStep<'_>,
        playing: &mut Playing,
        state: &mut SteerState,
        scratch: &mut SteerScratch,
    ) -> bool {
        let graph = step.baked.graph();
        // This may move the motion's start.
        playing.ensure(graph, step.dt);
        let seconds = playing.seconds;
        if playing.motion.is_composed(seconds) {
            return false;
        }
        let now = step.now(playing, None, scratch);
        let wanted = wanted(&step.aim, &now, self.table.limit).row();
        let body = Body::new(&now, None);
        let cost = |exit: &Entry| {
            let index = self.table.at(graph, exit.playhead())?;
            let moment = &self.table.moments[index];
            let jumps = Jumps::new(&self.table, step, body, exit.blend);
            let effort = jumps.effort(moment, jumps.rate(moment), f32::INFINITY)?;
            Some((index, distance(&self.table.rows[index], &wanted) + effort))
        };
        let playhead = playing.motion.playhead(graph, seconds);
        let exits = step.baked.exits(playhead, now.stance);
        let known = exits.filter_map(|exit| Some((cost(&exit)?, exit)));
        let nearest = known.min_by(|(a, _), (b, _)| a.1.total_cmp(&b.1));
        let Some(((moment, _), exit)) = nearest else {
            return false;
        };
        let moment = &self.table.moments[moment];
        let jumps = Jumps::new(&self.table, step, body, exit.blend);
        let rate = jumps.rate(moment);
        let blend = jumps.blend(moment, rate);
        let heading = exit.clip_to_world.heading();
        let entry = Entry {
            blend: exit.blend,
            ..step.entry_at(moment, heading, &now, [rate, blend])
        };
        let spare = &mut scratch.spare;
        playing.enter(graph, &entry, [rate, blend], &moment.standing, spare);
        state.search_in = step.settings.interval;
        true
    }

    /// A motion that goes on from two poses of any origin, which were seen `seconds` apart, at the moment that is nearest to them.
    pub(super) fn resume(
        &self,
        baked: &BakedGraph,
        poses: [&Pose; 2],
        seconds: f32,
    ) -> Option<Motion> {
        /// The poses may be far from any of the clips.
        const BLEND: f32 = 0.4;
        let graph = baked.graph();
        let mut joints = Vec::new();
        let [before, stance] = poses.map(|pose| {
            forward_kinematics(graph.skeleton(), pose, &mut joints);
            baked.stance(&joints)
        });
        let now = Features::from_body(&stance, [&before, &stance], seconds);
        let ahead = |seconds: f32| Vec2::new(now.velocity.x, now.velocity.z) * seconds;
        let wanted = Features {
            ways: AHEAD.map(ahead),
            ..now
        };
        let (found, _) = self.table.nearest(
            &wanted.row(),
            f32::INFINITY,
            &mut BoxOrder::new(),
            |_| true,
            |_, _| Some(0.0),
        )?;
        let moment = &self.table.moments[found];
        let turn = Rigid2::new(stance.placement.heading() - moment.heading, 0.0, 0.0);
        let root = turn.point(Vec3::new(moment.root.x, 0.0, moment.root.y));
        let place = Rigid2::new(0.0, stance.root.x - root.x, stance.root.z - root.z);
        let playhead = Playhead {
            edge: moment.edge,
            frame: moment.edge_frame as f32,
            clip_to_world: place * turn,
        };
        let mut motion = Motion::new(graph, playhead, &[]);
        motion.blend_from_poses(graph, poses, [seconds, BLEND]);
        Some(motion)
    }

    /// Turns the played motion towards the aim, and sets its rate and the length of its strides. What the motion itself accelerates leaves less for
    /// them.
    fn turn(&self, step: &SteerStep<'_>, playing: &mut Playing) {
        /// Time in which an error is removed, in seconds.
        const SETTLING: f32 = 0.12;
        /// Fastest change of the rate, per second.
        const RATE_CHANGE: f32 = 1.0;
        /// The shortest and the longest stride, in strides of the clip, and how fast the velocity changes for it, in metres per second squared.
        const SHORTEST: f32 = 0.6;
        const LONGEST: f32 = 1.1;
        const STRIDE_CHANGE: f32 = 2.0;
        /// The acceleration up to which a motion is played faster than it is, in limits.
        const FASTER: f32 = 1.1;
        let (graph, settings) = (step.baked.graph(), step.settings);
        let playhead = playing.motion.playhead(graph, playing.seconds);
        let Momentum {
            speed: pace,
            acceleration,
            hardest,
        } = playing.momentum(graph);
        let Some(moment) = self.table.at(graph, playhead) else {
            let spare = (self.table.limit - acceleration).max(0.0);
            let change = RATE_CHANGE.min(spare / pace.max(0.01)) * step.dt;
            playing.rate += (1.0 - playing.rate).clamp(-change, change);
            playing.drift = Vec2::ZERO;
            return;
        };
        playing.take_rate(graph);
        playing.ensure(graph, step.dt);
        let moment = &self.table.moments[moment];
        let turned = playhead.clip_to_world.heading();
        let (speed, wanted) = (moment.velocity.length(), step.aim.velocity.length());
        let moves = !step.aim.stands() && speed > WALKS;
        let off = match step.aim.facing {
            None if moves => heading_of(step.aim.velocity) - heading_of(moment.velocity) - turned,
            _ => step
                .aim
                .heading()
                .map_or(0.0, |heading| heading - moment.heading - turned),
        };
        let most = if step.aim.stands() {
            settings.standing_turn
        } else {
            settings.turn
        };
        let push = moment.push * playing.rate * playing.rate;
        let pace = pace.max(speed);
        let spare = (self.table.limit - acceleration.max(push)).max(0.0);
        let most = most.min(spare / pace.max(0.01));
        let turn = (wrapped(off) / SETTLING.max(step.dt)).clamp(-most, most);
        let mut rate = match moves {
            true => (wanted / speed).clamp(settings.slowest, settings.fastest),
            false => 1.0,
        };
        let least = settings.slowest.max(1.0);
        if rate > least {
            let fastest = playing.rate * (FASTER * self.table.limit / hardest.max(0.01)).sqrt();
            rate = rate.min(fastest.max(least));
        }
        let spare = (spare - turn.abs() * pace).max(0.0);
        let change = RATE_CHANGE.min(spare / pace.max(0.01)) * step.dt;
        playing.rate += (rate - playing.rate).clamp(-change, change);
        let stride = match moves {
            true => (wanted / (rate * speed)).clamp(SHORTEST, LONGEST),
            false => 1.0,
        };
        let velocity = table::turned(playhead.clip_to_world, moment.velocity);
        let drift = velocity * (playing.rate * (stride - 1.0));
        let change = STRIDE_CHANGE.min(spare) * step.dt;
        playing.drift += (drift - playing.drift).clamp_length_max(change);
        let by = (turn * step.dt, playing.drift * step.dt);
        if by.0.abs() > 1e-6 || by.1.length_squared() > 1e-12 {
            let toes = moment.toes.into_iter().zip(moment.standing);
            let standing = toes.enumerate().filter_map(|(leg, (toe, lifted))| {
                let toe = playhead.clip_to_world.point(Vec3::new(toe.x, 0.0, toe.y));
                Some((leg, toe, lifted?))
            });
            let seconds = playing.seconds;
            playing.motion.move_on_feet(graph, seconds, by, standing);
        }
    }
}

impl SteerStep<'_> {
    /// Whether a character faces the wanted direction, or no direction is wanted.
    fn faces(&self, playing: &Playing, moment: Option<&Moment>) -> bool {
        /// Difference from the wanted heading below which the character does not turn, in radians.
        const NEAR: f32 = 0.15;
        let (Some(wanted), Some(moment)) = (self.aim.heading(), moment) else {
            return true;
        };
        let graph = self.baked.graph();
        let turned = playing
            .motion
            .playhead(graph, playing.seconds)
            .clip_to_world;
        wrapped(wanted - turned.heading() - moment.heading).abs() < NEAR
    }

    /// The body as it is. `moment` is the one that it plays, if the table has it.
    fn now(&self, playing: &Playing, moment: Option<&Moment>, scratch: &mut SteerScratch) -> Now {
        let graph = self.baked.graph();
        let frame = (1.0 / graph.frame_rate()) as f32;
        let SteerScratch {
            pose, joints, axes, ..
        } = scratch;
        let mut at = |seconds: f32| {
            playing.motion.sample(graph, seconds, pose);
            forward_kinematics(graph.skeleton(), pose, joints);
            let centre = centre_of_mass(self.baked, joints, axes);
            (self.baked.stance(joints), centre)
        };
        let [(stance, centre), (next, later)] =
            [playing.seconds, playing.seconds + frame].map(&mut at);
        let turned = playing
            .motion
            .playhead(graph, playing.seconds)
            .clip_to_world;
        Now {
            stance,
            heading: moment.map_or(stance.placement.heading(), |moment| {
                turned.heading() + moment.heading
            }),
            features: Features::from_body(&stance, [&stance, &next], frame),
            centre,
            pace: playing.rate * pace(&stance, [centre, later], frame),
            rate: playing.rate,
        }
    }

    /// The entry into a moment, turned towards the aim. It is played at `rate`, and the root's blend takes `blend` seconds.
    fn entry(&self, moment: &Moment, now: &Now, [rate, blend]: [f32; 2]) -> Entry {
        let kept = now.stance.placement.heading() - moment.facing;
        let off = match self.aim.facing {
            None if !self.aim.stands() && moment.velocity.length() > WALKS => {
                heading_of(self.aim.velocity) - (heading_of(moment.velocity) + kept)
            }
            _ => self
                .aim
                .heading()
                .map_or(0.0, |heading| heading - (moment.heading + kept)),
        };
        let most = self.settings.jump_turn;
        let turn = kept + wrapped(off).clamp(-most, most);
        self.entry_at(moment, turn, now, [rate, blend])
    }

    /// The entry into a moment, turned by an angle in radians. The centre of mass is where it is, and goes on as it goes.
    fn entry_at(&self, moment: &Moment, turn: f32, now: &Now, played: [f32; 2]) -> Entry {
        let turned = Rigid2::new(turn, 0.0, 0.0);
        let centre = turned.point(Vec3::new(moment.centre.x, 0.0, moment.centre.y));
        let way = now.centre + self.carried(moment, turn, now, played) - centre.xz();
        Entry {
            edge: moment.edge,
            frame: moment.edge_frame as f32,
            clip_to_world: Rigid2::new(0.0, way.x, way.y) * turned,
            rate: 1.0,
            blend: self.settings.blend,
        }
    }

    /// The way by which a body with another velocity than a moment's comes further while the difference fades out within `blend` seconds, by a
    /// smooth step. A blend that did not leave it that way would have to brake the body first.
    fn carried(&self, moment: &Moment, turn: f32, now: &Now, [rate, blend]: [f32; 2]) -> Vec2 {
        let heading = now.stance.placement.heading();
        let velocity =
            |pace: Vec2, heading: f32| table::turned(Rigid2::new(heading, 0.0, 0.0), pace);
        let apart =
            velocity(now.pace, heading) - rate * velocity(moment.pace, turn + moment.facing);
        apart * (0.5 * blend)
    }
}

/// The features that an aim asks for: the body's present features, and the path that it should take.
fn wanted(aim: &Aim, now: &Now, limit: f32) -> Features {
    /// Time in which speed and heading are reached, in seconds.
    const REACHED: f32 = 0.5;
    /// Fastest turn that is asked for, in radians per second.
    const FASTEST_TURN: f32 = 2.5;
    const STEPS: usize = 4;
    let mut features = now.features;
    let theta = aim
        .heading()
        .map_or(0.0, |heading| wrapped(heading - now.heading));
    let turn = |seconds: f32| {
        let reached = theta * (1.0 - (-seconds / (1.5 * REACHED)).exp());
        let most = FASTEST_TURN * seconds;
        reached.clamp(-most, most)
    };
    let heading = now.stance.placement.heading();
    let (start, speed) = (
        Vec2::new(now.features.velocity.x, now.features.velocity.z),
        aim.velocity.length(),
    );
    let mut way = Vec2::ZERO;
    let mut seconds = 0.0;
    for (index, end) in AHEAD.into_iter().enumerate() {
        let dt = (end - seconds) / STEPS as f32;
        for _ in 0..STEPS {
            seconds += dt;
            let goes = match aim.facing {
                _ if speed < 1e-3 => Vec2::ZERO,
                None => direction(turn(seconds)) * speed,
                Some(_) => direction(heading_of(aim.velocity) - heading) * speed,
            };
            let share = 1.0 - (-seconds / REACHED).exp();
            let gained = ((goes - start) * share).clamp_length_max(limit * seconds);
            way += (start + gained) * dt;
        }
        features.ways[index] = way;
        features.turns[index] = turn(end);
    }
    features
}

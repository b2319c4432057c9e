//! What a jump of steering costs the body: how hard it pushes off, which feet have to be put elsewhere, how soon it has to jump again.
//!
//! Not part of the papers. The way of the centre of mass after a jump is known before it: that of the clip, and what is left of the body's own
//! place and velocity, which fades out as in [`Inertia`](crate::graph). Its acceleration over a tenth of a second is how hard the legs push.

use glam::{Vec2, Vec3, Vec3Swizzles};

use super::table::{Moment, Table, turned};
use super::{Now, SteerStep};
use crate::graph::play::inertia::{Decay, HeldFoot, Weights};
use crate::graph::push::{PUSH_WINDOW, acceleration};
use crate::maps::Stance;
use crate::math::Rigid2;

/// The way is looked at from [`PUSH_WINDOW`] before a jump on, at times this far apart, in seconds.
const STEP: f32 = 0.5 * PUSH_WINDOW;
const BEFORE: usize = 2;
const TIMES: usize = 16;

/// One of the times, in seconds since the jump.
fn since(time: usize) -> f32 {
    (time as f32 - BEFORE as f32) * STEP
}

/// Durations of the root's blend of a jump, in times of that of the joints, which is the first.
const LENGTHS: [f32; 3] = [1.0, 1.5, 2.0];

/// Offsets that fade out within a blend, at each of the times.
#[derive(Clone, Copy, Debug)]
struct Fade {
    /// Its duration, in seconds.
    seconds: f32,
    weights: [Weights; TIMES],
}

/// Jumps from the body as it is.
pub(super) struct Jumps<'a> {
    table: &'a Table,
    step: &'a SteerStep<'a>,
    body: Body,
    fades: [Fade; LENGTHS.len()],
}

/// What decides whether a body can jump to a moment. Vectors are in the character's frame (x, z).
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    /// Velocities of the centre of mass and of the root, in metres per second.
    pub pace: Vec2,
    pub root_pace: Vec2,
    /// From the root to the centre of mass, in metres.
    pub lean: Vec2,
    /// From the centre of mass to the toe of each foot that stands, in metres.
    standing: [Option<Vec2>; Stance::LEGS],
    /// Whether what is left of the velocity carries the body further, as in [`SteerStep::carried`].
    is_carried: bool,
}

impl Body {
    /// The body as it is. `moment` is the one that it plays, if the table has it.
    pub(super) fn new(now: &Now, moment: Option<&Moment>) -> Self {
        let inverse = now.stance.placement.inverse();
        let from_centre = |place: Vec3| turned(inverse, place.xz() - now.centre);
        let stands = moment.map_or([false; Stance::LEGS], Moment::stands);
        Self {
            pace: now.pace,
            root_pace: now.rate * now.features.velocity.xz(),
            lean: -from_centre(now.stance.root),
            standing: std::array::from_fn(|leg| {
                stands[leg].then(|| from_centre(now.stance.toes[leg]))
            }),
            is_carried: true,
        }
    }

    /// The same for a jump in which the root stays on its way.
    pub(super) fn on_root(self) -> Self {
        Self {
            pace: self.root_pace,
            lean: Vec2::ZERO,
            is_carried: false,
            ..self
        }
    }
}

impl<'a> Jumps<'a> {
    /// Jumps of `body` whose joints blend within `blend` seconds.
    pub(super) fn new(table: &'a Table, step: &'a SteerStep<'a>, body: Body, blend: f32) -> Self {
        let fades = LENGTHS.map(|length| {
            let (seconds, shown) = (length * blend, (length * blend).max(STEP));
            Fade {
                seconds,
                weights: std::array::from_fn(|time| Weights::new(since(time) / shown, shown)),
            }
        });
        Self {
            table,
            step,
            body,
            fades,
        }
    }

    /// The playback rate at which a moment's velocity is nearest to that of the body, unless the clip would then accelerate too hard.
    pub(super) fn rate(&self, moment: &Moment) -> f32 {
        let settings = self.step.settings;
        if moment.velocity.length() <= super::WALKS {
            return 1.0;
        }
        let nearest = self.body.pace.dot(moment.pace) / moment.pace.length_squared().max(0.01);
        let hardest = (self.table.limit / moment.push.max(0.01)).sqrt();
        let fastest = settings.fastest.min(hardest.max(1.0));
        nearest.clamp(settings.slowest, fastest.max(settings.slowest))
    }

    /// Duration of the root's blend of a jump at a playback rate, in seconds: the shortest in which the body pushes easily, or the gentlest.
    pub(super) fn blend(&self, moment: &Moment, rate: f32) -> f32 {
        self.gentlest(moment, rate, f32::INFINITY).0
    }

    /// The duration of the root's blend, and how hard the body pushes with it; infinite if it is harder than `most` with each.
    fn gentlest(&self, moment: &Moment, rate: f32, most: f32) -> (f32, f32) {
        let mut best = (0.0, f32::INFINITY);
        for fade in &self.fades {
            let push = self.push(moment, rate, fade, most.min(best.1));
            if push < best.1 {
                best = (fade.seconds, push);
            }
            if push <= EASY * self.table.hardest {
                break;
            }
        }
        best
    }

    /// How much further the body comes while the difference of velocities fades out, as in [`SteerStep::carried`].
    fn carried(&self, moment: &Moment, rate: f32, blend: f32) -> Vec2 {
        match self.body.is_carried {
            true => (self.body.pace - rate * moment.pace) * (0.5 * blend),
            false => Vec2::ZERO,
        }
    }

    /// Whether a foot that stands can stay where it is, or none stands before and after the jump.
    fn keeps_foot(&self, moment: &Moment, carried: Vec2) -> bool {
        let (now, then) = (self.body.standing, moment.standing);
        let inverse = Rigid2::new(-moment.facing, 0.0, 0.0);
        let stays = now.into_iter().enumerate().any(|(leg, toe)| {
            let (Some(toe), Some(_)) = (toe, then[leg]) else {
                return false;
            };
            let placed = turned(inverse, moment.toes[leg] - moment.centre) + carried;
            toe.distance(placed) < HeldFoot::MOST
        });
        let flies = now.iter().all(Option::is_none) && then.iter().all(Option::is_none);
        stays || flies
    }

    /// Largest horizontal acceleration of the centre of mass in a jump, in metres per second squared; infinite if it is above `most`.
    fn push(&self, moment: &Moment, rate: f32, fade: &Fade, most: f32) -> f32 {
        let body = &self.body;
        let carried = self.carried(moment, rate, fade.seconds);
        let lean = body.lean - moment.lean;
        let root_speed = body.root_pace - rate * moment.root_pace;
        let lean_speed = body.pace - rate * moment.pace - root_speed;
        let decay = |value: Vec2, speed: Vec2| {
            Decay::new(value.extend(0.0), (value + speed).extend(0.0), 1.0)
        };
        let (root, lean) = (decay(-carried - lean, root_speed), decay(lean, lean_speed));
        let track = self.table.track(moment);
        let joints = &self.fades[0].weights;
        let place = |time: usize| {
            if time < BEFORE {
                return body.pace * since(time);
            }
            let faded = root.at(fade.weights[time]) + lean.at(joints[time]);
            carried + track(since(time) * rate) + faded.xy()
        };
        let mut places = [Vec2::ZERO; TIMES];
        let mut hardest: f32 = 0.0;
        for time in 0..TIMES {
            places[time] = place(time);
            if time >= 2 * BEFORE {
                let way = [2 * BEFORE, BEFORE, 0].map(|before| places[time - before]);
                hardest = hardest.max(acceleration(way));
                if hardest > most {
                    return f32::INFINITY;
                }
            }
        }
        hardest
    }

    /// What a jump costs beside the distance of features: a hard push, feet that all have to be put elsewhere, another jump soon; `None` if that
    /// is `room` or more.
    pub(super) fn effort(&self, moment: &Moment, rate: f32, room: f32) -> Option<f32> {
        /// Cost of a jump in which no foot stays, in squared distances of features.
        const NO_FOOT: f32 = 12.0;
        /// Costs of an acceleration that is not easy, and of one that is harder than in the clips, per (m/s²)².
        const PUSH: f32 = 4.0;
        const TOO_HARD: f32 = 40.0;
        /// Cost of a moment that has to be left at once, and the time from which on none counts, in seconds.
        const SHORT: f32 = 12.0;
        const SOON: f32 = 0.6;
        let short = SHORT * (1.0 - moment.left / SOON).max(0.0);
        if short >= room {
            return None;
        }
        let hardest = self.table.hardest;
        let most = EASY * hardest + ((room - short) / PUSH).sqrt();
        let (blend, push) = self.gentlest(moment, rate, most);
        let [uneasy, too_hard] = [EASY * hardest, hardest].map(|from| (push - from).max(0.0));
        let pushes = PUSH * uneasy * uneasy + TOO_HARD * too_hard * too_hard;
        let steps = match self.keeps_foot(moment, self.carried(moment, rate, blend)) {
            true => 0.0,
            false => NO_FOOT,
        };
        let effort = short + pushes + steps;
        (effort < room).then_some(effort)
    }
}

/// The part of the hardest push of the clips that is easy.
const EASY: f32 = 0.6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::{Pose, forward_kinematics};
    use crate::character::goal::Aim;
    use crate::character::playing::Playing;
    use crate::character::settings::SteerSettings;
    use crate::character::steer::table::centre_of_mass;
    use crate::character::steer::{SteerScratch, Steering};
    use crate::graph::{Motion, Playhead};
    use crate::query::fixture::baked;
    use sabaki_fixtures::random::Random;

    /// Poses the motion after jumps between random moments, of which the prediction knows the centre of mass of the clips alone.
    #[test]
    fn a_predicted_push_is_near_that_of_the_posed_motion() {
        let (baked, graph) = (baked(), baked().graph());
        let steering = Steering::new(baked);
        let moments = &steering.table.moments;
        let settings = SteerSettings::default();
        let step = SteerStep {
            baked,
            settings: &settings,
            aim: Aim::default(),
            may_search: true,
            dt: 1.0 / 60.0,
        };
        let (mut random, mut scratch) = (Random::new(7), SteerScratch::default());
        let (mut near, mut hard) = (0, 0);
        const JUMPS: usize = 300;
        for _ in 0..JUMPS {
            let [from, to] = [0; 2].map(|_| moments[random.below(moments.len())]);
            let playhead = Playhead {
                edge: from.edge,
                frame: from.edge_frame as f32,
                clip_to_world: Rigid2::IDENTITY,
            };
            let mut playing = Playing::new(Motion::new(graph, playhead, &[]));
            playing.ensure(graph, step.dt);
            let now = step.now(&playing, Some(&from), &mut scratch);
            let jumps = Jumps::new(
                &steering.table,
                &step,
                Body::new(&now, Some(&from)),
                settings.blend,
            );
            let (blend, predicted) = jumps.gentlest(&to, 1.0, f32::INFINITY);
            let entry = step.entry(&to, &now, [1.0, blend]);
            playing.enter(graph, &entry, [1.0, blend], &[], &mut Motion::default());
            playing.motion.extend(graph, 2.0);
            let (mut pose, mut joints, mut axes) = (Pose::default(), Vec::new(), Vec::new());
            let start = now.centre;
            let pace = turned(now.stance.placement, now.pace);
            let places: Vec<Vec2> = (0..TIMES)
                .map(|time| {
                    if time < BEFORE {
                        return start + pace * since(time);
                    }
                    playing.motion.sample(graph, since(time), &mut pose);
                    forward_kinematics(graph.skeleton(), &pose, &mut joints);
                    centre_of_mass(baked, &joints, &mut axes)
                })
                .collect();
            let ways = places.windows(5);
            let posed = ways.map(|way| acceleration([way[0], way[2], way[4]]));
            let posed = posed.fold(0.0, f32::max);
            hard += usize::from(posed > 0.8);
            near += usize::from((predicted - posed).abs() < 0.3 + 0.25 * posed);
        }
        assert!(hard > JUMPS / 10, "{hard} of {JUMPS} push");
        assert!(near > JUMPS * 17 / 20, "{near} of {JUMPS}");
    }
}

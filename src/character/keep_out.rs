//! Keeps a body out of obstacles by a shift on the ground.
//!
//! Plans and steering avoid obstacles. Remaining entries, such as an arm that swings into a wall, are removed by a shift of the whole body on
//! the ground, as character controllers of games do: the deepest entry is removed first, several times (projected Gauss-Seidel). Between obstacles that close in from two sides this does not converge. Then the nearest free place is
//! searched on rings around the body, for the moment [`LOOK`] ahead, so that the body is out before it is squeezed. A limb can be faster
//! than the shift may be: the shift begins when the pose [`POSE_AHEAD`] enters. A body that an obstacle was put on is shoved out at the speed of
//! a run, and one without a free place around it stays where it is.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::event::CharacterEventKind;
use super::state::CharacterState;
use super::world::{Worker, World};
use crate::maps::BodySphere;
use crate::math::Rigid2;
use crate::query::Obstacle;

/// Distance that is kept, in metres.
const SKIN: f32 = 0.004;
/// How far ahead moving obstacles are looked at, in seconds.
const LOOK: f32 = 0.25;

/// How far ahead the body's own motion is looked at, in seconds.
const POSE_AHEAD: f32 = 0.1;

/// No limb swings as deep as this into an obstacle, which was put on the body then, in metres. The body is shoved out at [`SHOVE`].
const DEEP: f32 = 0.35;

/// Speed at which a body is shoved out, in metres per second: that of a run.
const SHOVE: f32 = 3.0;

/// A body is shoved no further than this, in metres.
const FURTHEST_OUT: f32 = 2.0;

/// Time until a free place is sought again for a body that has none, in seconds.
const STUCK: f64 = 0.5;

/// How a body is among obstacles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) enum Squeezed {
    /// Free, or out of everything after this step.
    #[default]
    Free,
    /// It is shoved out.
    Shoved,
    /// There is no free place around it. One is sought again at this time, in seconds.
    Stuck(f64),
}

/// Maximum factor on the speed of the shift for a body that would otherwise stay in an obstacle. Between moving obstacles that close in, the
/// nearest free place may be decimetres away.
const HURRY: f32 = 12.0;

/// A posed body among obstacles.
#[derive(Clone, Copy)]
struct Squeeze<'a> {
    obstacles: &'a [Obstacle],
    centres: &'a [Vec3],
    spheres: &'a [BodySphere],
    /// Position of the root.
    root: Vec3,
    /// How far the body reaches from the root, in metres.
    widest: f32,
}

/// The deepest entry of a body.
#[derive(Clone, Copy, Debug)]
struct Depth {
    /// In metres; negative when nothing is entered.
    metres: f32,
    /// The shift on the ground that ends it.
    out: Vec2,
}

impl CharacterState {
    /// Shifts the body out of the obstacles that it enters at the end of the step.
    pub(super) fn keep_out(&mut self, world: &World<'_>, worker: &mut Worker) {
        if worker.obstacles.is_empty() {
            self.squeezed = Squeezed::Free;
            return;
        }
        let (body, reach) = (world.baked.body(), self.reach(world.baked));
        let playing = &self.playing;
        let (dt, ahead) = (world.dt, POSE_AHEAD * playing.rate);
        let [root, later_root] = [0.0, ahead].map(|later| {
            let seconds = playing.seconds + later;
            playing.motion.root(world.baked.graph(), seconds)
        });
        let way = root.distance(later_root);
        let near = |one: &Obstacle, reach: f32| {
            one.distance(root, dt) < reach + SKIN + LOOK * one.velocity().length()
        };
        let is_near = |reach: f32, all: &[Obstacle]| all.iter().any(|one| near(one, reach));
        if !is_near(reach + way, &worker.obstacles) {
            self.squeezed = Squeezed::Free;
            return;
        }
        if matches!(self.squeezed, Squeezed::Stuck(until) if world.now < until) {
            return;
        }
        let pose = |seconds: f32, worker: &mut Worker| {
            worker.pose_body(
                world.baked,
                playing.motion.moment_at(seconds),
                &self.additive,
            );
        };
        pose(playing.seconds + ahead, worker);
        std::mem::swap(&mut worker.centres, &mut worker.later_centres);
        pose(playing.seconds, worker);
        // Only a sphere that reaches as far from the root as an obstacle is can enter it.
        let widest = |centres: &[Vec3], root: Vec3| {
            let extents = centres.iter().zip(&body.spheres);
            let extents = extents.map(|(centre, part)| centre.distance(root) + part.radius);
            extents.fold(0.0, f32::max)
        };
        let [now_widest, later_widest] = [
            widest(&worker.centres, root),
            widest(&worker.later_centres, later_root),
        ];
        let step = world.settings.push * dt;
        let reach = now_widest.max(later_widest + way);
        if !is_near(reach + step, &worker.obstacles) {
            self.squeezed = Squeezed::Free;
            return;
        }
        // A shift may lead into obstacles that are further away.
        let furthest = Squeeze::FURTHEST.max(HURRY * step);
        worker.obstacles.retain(|one| near(one, reach + furthest));
        let squeeze = Squeeze {
            obstacles: &worker.obstacles,
            centres: &worker.centres,
            spheres: &body.spheres,
            root,
            widest: now_widest,
        };
        let later = Squeeze {
            centres: &worker.later_centres,
            root: later_root,
            widest: later_widest,
            ..squeeze
        };
        let shift = squeeze.shift([dt, dt + LOOK], step);
        let shift = squeeze.towards(&later, shift, [dt, dt + POSE_AHEAD], step);
        let was_shoved = self.squeezed == Squeezed::Shoved;
        let (shift, squeezed) = squeeze.hurried(shift, dt, step, was_shoved);
        let is_new = std::mem::discriminant(&squeezed) != std::mem::discriminant(&self.squeezed);
        self.squeezed = match squeezed {
            Squeezed::Stuck(_) => Squeezed::Stuck(world.now + STUCK),
            other => other,
        };
        match squeezed {
            Squeezed::Shoved if is_new => {
                self.events.push((world.end(), CharacterEventKind::Shoved));
            }
            Squeezed::Stuck(_) if is_new => {
                let depth = squeeze.deepest(shift, dt, SKIN).metres - SKIN;
                let stuck = CharacterEventKind::Stuck { depth };
                self.events.push((world.end(), stuck));
            }
            _ => {}
        }
        if shift == Vec2::ZERO {
            return;
        }
        let by = Rigid2::new(0.0, shift.x, shift.y);
        self.playing.motion.transform(by);
        if let Some(pending) = &mut self.pending {
            pending.motion.transform(by);
        }
    }
}

impl Squeeze<'_> {
    /// The shift for this step, of at most `step` metres. Times are from now, in seconds.
    fn shift(&self, [now, later]: [f32; 2], step: f32) -> Vec2 {
        let moves = |one: &Obstacle| one.velocity() != Vec3::ZERO;
        let may_close = self.obstacles.len() > 1 && self.obstacles.iter().any(moves);
        let free = self.settle(Vec2::ZERO, now);
        let start = free.unwrap_or(Vec2::ZERO);
        let is_closing = may_close && self.settle(start, later).is_none();
        let shift = match (free, is_closing) {
            (Some(shift), false) => shift,
            (_, true) => {
                let way = self.escape(later).unwrap_or(start);
                let start = way.clamp_length_max(step);
                let settled = self.settle(start, now).or_else(|| self.escape(now));
                settled.unwrap_or(start)
            }
            (None, false) => self.escape(now).unwrap_or(start),
        };
        shift.clamp_length_max(step)
    }

    /// The shift for this step, longer where the body enters something [`POSE_AHEAD`]. Times are those of the two poses from now, in seconds.
    fn towards(&self, later: &Self, shift: Vec2, [now, then]: [f32; 2], step: f32) -> Vec2 {
        let is_free = shift.length() < step;
        let Some(wanted) = is_free.then(|| later.settle(shift, then)).flatten() else {
            return shift;
        };
        let share = (2.0 * now / POSE_AHEAD).min(1.0);
        let start = shift + (wanted - shift) * share;
        match self.settle(start, now) {
            Some(free) if wanted != shift => free.clamp_length_max(step),
            _ => shift,
        }
    }

    /// The shift, longer where the body would stay in something that is left by a step [`HURRY`] times as long, and slower where it is [`DEEP`], until it is out.
    fn hurried(&self, shift: Vec2, now: f32, step: f32, is_shoved: bool) -> (Vec2, Squeezed) {
        if self.deepest(shift, now, SKIN).metres <= SKIN {
            return (shift, Squeezed::Free);
        }
        let settled = self
            .settle(shift, now)
            .or_else(|| self.settle(Vec2::ZERO, now));
        let free = settled.or_else(|| self.escape(now));
        match free {
            None => (shift, Squeezed::Stuck(0.0)),
            Some(free) if free.length() > FURTHEST_OUT => (Vec2::ZERO, Squeezed::Stuck(0.0)),
            Some(free) if is_shoved || self.deepest(Vec2::ZERO, now, SKIN).metres > DEEP => {
                let slow = free.clamp_length_max(step.min(SHOVE * now));
                (slow, Squeezed::Shoved)
            }
            Some(free) => (free.clamp_length_max(HURRY * step), Squeezed::Free),
        }
    }

    /// Removes the deepest entry until none is left; `None` if some are left.
    fn settle(&self, start: Vec2, seconds: f32) -> Option<Vec2> {
        const TURNS: usize = 20;
        let mut shift = start;
        for _ in 0..TURNS {
            let deepest = self.deepest(shift, seconds, 0.0);
            if deepest.metres <= 0.0 {
                return Some(shift);
            }
            shift += deepest.out;
        }
        None
    }

    /// The shortest shift to a free place; `None` if none is within [`Squeeze::FURTHEST`]. Among places at one distance the freest
    /// is taken.
    fn escape(&self, seconds: f32) -> Option<Vec2> {
        const RINGS: usize = 24;
        const WAYS: usize = 24;
        (1..=RINGS).find_map(|ring| {
            let far = Self::FURTHEST * ring as f32 / RINGS as f32;
            let ways = (0..WAYS).map(|way| {
                let shift =
                    Vec2::from_angle(way as f32 * std::f32::consts::TAU / WAYS as f32) * far;
                (self.deepest(shift, seconds, -self.widest).metres, shift)
            });
            let freest = ways.min_by(|a, b| a.0.total_cmp(&b.0));
            freest
                .filter(|(metres, _)| *metres <= 0.0)
                .map(|(_, shift)| shift)
        })
    }

    /// Longest shift to a free place, in metres.
    const FURTHEST: f32 = 1.2;

    /// The deepest entry of the body, shifted on the ground, at a time; one of `least` metres if none is deeper.
    fn deepest(&self, shift: Vec2, seconds: f32, least: f32) -> Depth {
        let shift = Vec3::new(shift.x, 0.0, shift.y);
        let mut deepest = Depth {
            metres: least,
            out: Vec2::ZERO,
        };
        for obstacle in self.obstacles {
            let reach = self.widest + SKIN - obstacle.distance(self.root + shift, seconds);
            if reach <= deepest.metres {
                continue;
            }
            for (centre, part) in self.centres.iter().zip(self.spheres) {
                let at = *centre + shift;
                let nearest = obstacle.nearest(at, seconds);
                let metres = part.radius + SKIN - nearest.metres;
                if metres > deepest.metres {
                    let out = Vec2::new(nearest.normal.x, nearest.normal.z);
                    let out = match out.length() > 0.3 {
                        true => out / out.length_squared(),
                        false => obstacle.outwards(at, seconds),
                    };
                    deepest = Depth {
                        metres,
                        out: out * (metres + 1e-4),
                    };
                }
            }
        }
        deepest
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3Swizzles;

    use super::*;
    use crate::anim::JointId;

    const RADIUS: f32 = 0.2;
    const STEP: f32 = 0.1;
    const FRAME: f32 = 1.0 / 60.0;

    /// Three spheres, one above the other.
    fn centres(at: Vec2) -> [Vec3; 3] {
        [0.3, 0.9, 1.5].map(|y| Vec3::new(at.x, y, at.y))
    }

    /// Calls `test` with a body at a place.
    fn squeezed(at: Vec2, obstacles: &[Obstacle], test: impl Fn(Squeeze<'_>) -> Vec2) -> Vec2 {
        let sphere = BodySphere {
            joint: JointId::ROOT,
            offset: Vec3::ZERO,
            radius: RADIUS,
        };
        test(Squeeze {
            obstacles,
            centres: &centres(at),
            spheres: &[sphere; 3],
            root: Vec3::new(at.x, 0.9, at.y),
            widest: 0.8,
        })
    }

    fn shift(at: Vec2, obstacles: &[Obstacle]) -> Vec2 {
        squeezed(at, obstacles, |body| {
            body.shift([FRAME, FRAME + LOOK], STEP)
        })
    }

    fn depth(at: Vec2, obstacles: &[Obstacle], seconds: f32) -> f32 {
        let of = |one: &Obstacle| centres(at).map(|centre| RADIUS - one.distance(centre, seconds));
        let depths = obstacles.iter().flat_map(of);
        depths.fold(f32::NEG_INFINITY, f32::max)
    }

    #[test]
    fn a_free_body_stays_and_one_in_a_wall_leaves_it_the_short_way() {
        let wall = Obstacle::half_space(Vec3::ZERO, Vec3::X).unwrap();
        assert_eq!(shift(Vec2::new(0.5, 0.0), &[wall]), Vec2::ZERO);
        let out = shift(Vec2::new(0.15, 0.0), &[wall]);
        assert!((out - Vec2::new(0.05 + SKIN, 0.0)).length() < 1e-3, "{out}");
    }

    #[test]
    fn a_limb_that_is_deeper_than_a_step_is_out_after_one() {
        let wall = Obstacle::half_space(Vec3::ZERO, Vec3::X).unwrap();
        let at = Vec2::new(-0.1, 0.0);
        let slow = shift(at, &[wall]);
        assert!((slow.length() - STEP).abs() < 1e-4, "{slow}");
        let hurry = |shift: Vec2| {
            squeezed(at, &[wall], |body| {
                body.hurried(shift, FRAME, STEP, false).0
            })
        };
        let hurried = hurry(slow);
        assert!(depth(at + hurried, &[wall], FRAME) < 1e-4, "{hurried}");
        // Not further than it has to, and not at all where it is out.
        assert!(hurried.length() < 0.31, "{hurried}");
        assert_eq!(hurry(hurried), hurried);
    }

    #[test]
    fn a_body_slips_out_between_discs_that_close_in() {
        for turned in 0..12 {
            let way = Vec2::from_angle(turned as f32 * 0.53);
            let mut at = way.perp() * 0.02;
            for frame in 0..150 {
                let gone = frame as f32 * FRAME;
                let discs = [1.0, -1.0].map(|side| {
                    let disc = Obstacle::disc(way * side * (1.6 - gone), 0.3).unwrap();
                    disc.moving((-way * side).extend(0.0).xzy()).unwrap()
                });
                at += shift(at, &discs);
                let depth = depth(at, &discs, FRAME);
                assert!(depth < 1e-3, "{turned}, frame {frame}: {depth}");
            }
        }
    }
}

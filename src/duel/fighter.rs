use crate::anim::Pose;
use crate::graph::{Motion, MotionGraph, MotionStep, Playhead};
use crate::math::Rigid2;

/// The motion of one fighter, from the duel's start on.
#[derive(Clone, Debug, PartialEq)]
pub struct Fighter {
    /// Motions, each of which is played until the next one begins.
    motions: Vec<TimedMotion>,
}

#[derive(Clone, Debug, PartialEq)]
struct TimedMotion {
    /// Time from the duel's start to the start of the motion, in seconds.
    from: f32,
    motion: Motion,
}

/// Time for which motions are planned ahead, in seconds.
const AHEAD: f32 = 8.0;

impl Fighter {
    pub(super) fn new(graph: &MotionGraph, playhead: Playhead) -> Self {
        let mut motion = Motion::new(graph, playhead, &[]);
        motion.extend(graph, AHEAD);
        let current = TimedMotion { from: 0.0, motion };
        Self {
            motions: vec![current],
        }
    }

    /// Plays a motion from `now` on. It replaces later motions.
    pub(super) fn play(&mut self, graph: &MotionGraph, now: f32, mut motion: Motion) {
        motion.extend(graph, AHEAD);
        self.motions.retain(|current| current.from < now);
        self.motions.push(TimedMotion { from: now, motion });
    }

    fn current(&self, t: f32) -> &TimedMotion {
        let later = self.motions.partition_point(|current| current.from <= t);
        &self.motions[later.saturating_sub(1)]
    }

    /// Position in graph and world at a time, in seconds since the duel's start.
    #[must_use]
    pub fn playhead(&self, graph: &MotionGraph, t: f32) -> Playhead {
        let current = self.current(t);
        current.motion.playhead(graph, t - current.from)
    }

    /// Writes the pose at a time, in the world.
    pub fn pose(&self, graph: &MotionGraph, t: f32, out: &mut Pose) {
        let current = self.current(t);
        current.motion.sample(graph, t - current.from, out);
    }

    /// The character's frame at a time, in the world.
    #[must_use]
    pub fn placement(&self, graph: &MotionGraph, t: f32) -> Rigid2 {
        self.playhead(graph, t).placement(graph)
    }

    /// The planned motion from `now` on.
    pub(super) fn ahead(&self, graph: &MotionGraph, now: f32) -> Motion {
        let current = self.current(now);
        let mut rest = current.motion.rest(graph, now - current.from);
        rest.extend(graph, AHEAD);
        rest
    }

    /// The motion from `now` to the next node, and then `steps`.
    pub(super) fn branch(&self, graph: &MotionGraph, now: f32, steps: &[MotionStep]) -> Motion {
        let current = self.current(now);
        current.motion.branch(graph, now - current.from, steps)
    }
}

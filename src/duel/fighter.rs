use crate::anim::Pose;
use crate::graph::{Motion, MotionGraph, Playhead};
use crate::math::Rigid2;

/// What a fighter does, from the duel's start on.
#[derive(Clone, Debug, PartialEq)]
pub struct Fighter {
    /// Each is played until the next one begins.
    takes: Vec<Take>,
}

#[derive(Clone, Debug, PartialEq)]
struct Take {
    /// Seconds since the duel's start.
    from: f32,
    motion: Motion,
}

/// Motions are known so far ahead, seconds.
const AHEAD: f32 = 8.0;

impl Fighter {
    pub(super) fn new(graph: &MotionGraph, playhead: Playhead) -> Self {
        let mut motion = Motion::new(graph, playhead, &[]);
        motion.extend(graph, AHEAD);
        let take = Take { from: 0.0, motion };
        Self { takes: vec![take] }
    }

    /// From `now` on it plays a motion; later plans are forgotten.
    pub(super) fn play(&mut self, graph: &MotionGraph, now: f32, mut motion: Motion) {
        motion.extend(graph, AHEAD);
        self.takes.retain(|take| take.from < now);
        self.takes.push(Take { from: now, motion });
    }

    fn take(&self, t: f32) -> &Take {
        let later = self.takes.partition_point(|take| take.from <= t);
        &self.takes[later.saturating_sub(1)]
    }

    /// Where it is in graph and world `t` seconds after the duel's start.
    #[must_use]
    pub fn playhead(&self, graph: &MotionGraph, t: f32) -> Playhead {
        let take = self.take(t);
        take.motion.playhead(graph, t - take.from)
    }

    /// The pose then, in the world.
    pub fn pose(&self, graph: &MotionGraph, t: f32, out: &mut Pose) {
        let take = self.take(t);
        take.motion.sample(graph, t - take.from, out);
    }

    /// The character's frame then, in the world.
    #[must_use]
    pub fn placement(&self, graph: &MotionGraph, t: f32) -> Rigid2 {
        self.playhead(graph, t).placement(graph)
    }

    /// What it goes on to do from `now` on, if nothing changes.
    pub(super) fn ahead(&self, graph: &MotionGraph, now: f32) -> Motion {
        let take = self.take(now);
        let mut rest = take.motion.rest(graph, now - take.from);
        rest.extend(graph, AHEAD);
        rest
    }

    /// What is being played at `now`, to its end, and then `steps`.
    pub(super) fn branch(
        &self,
        graph: &MotionGraph,
        now: f32,
        steps: &[crate::graph::Step],
    ) -> Motion {
        let take = self.take(now);
        take.motion.branch(graph, now - take.from, steps)
    }
}

use glam::{Vec2, Vec3Swizzles};
use serde::{Deserialize, Serialize};

use crate::graph::push::{PUSH_WINDOW, acceleration};
use crate::graph::{Entry, Motion, MotionGraph, Played};

/// Motion that a character plays, with the position in it and the rate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Playing {
    pub motion: Motion,
    /// Time since the motion's start, in seconds.
    pub seconds: f32,
    /// Rate at which the motion's time passes.
    pub rate: f32,
    /// Velocity over the ground (x, z) that steering adds to that of the motion, in metres per second: strides are shorter or longer than in the
    /// clips.
    pub drift: Vec2,
}

/// How the root moves over the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Momentum {
    /// Speed, in metres per second.
    pub speed: f32,
    /// Horizontal acceleration now, and its maximum over the next moments, in metres per second squared.
    pub acceleration: f32,
    pub hardest: f32,
}

impl Playing {
    pub(super) fn new(motion: Motion) -> Self {
        Self {
            motion,
            seconds: 0.0,
            rate: 1.0,
            drift: Vec2::ZERO,
        }
    }

    /// Position of the root on the ground (x, z), in metres.
    pub(super) fn ground(&self, graph: &MotionGraph) -> Vec2 {
        let root = self.motion.root(graph, self.seconds);
        Vec2::new(root.x, root.z)
    }

    /// Speed of the root over the ground, in metres per second of the motion.
    pub(super) fn speed(&self, graph: &MotionGraph) -> f32 {
        let [from, to] = [self.seconds, self.seconds + PUSH_WINDOW]
            .map(|seconds| self.motion.root(graph, seconds).xz());
        from.distance(to) / PUSH_WINDOW
    }

    /// How the root moves over the ground now and over the next moments.
    pub(super) fn momentum(&self, graph: &MotionGraph) -> Momentum {
        /// Number of the places that are examined, from a window before on, each a window after the other.
        const PLACES: usize = 6;
        let window = PUSH_WINDOW * self.rate;
        let places: [Vec2; PLACES] = std::array::from_fn(|at| {
            let seconds = self.seconds + (at as f32 - 1.0) * window;
            self.motion.root(graph, seconds.max(0.0)).xz()
        });
        let ways = places.windows(3);
        let accelerations = ways.map(|way| acceleration([way[0], way[1], way[2]]));
        // What was played before a jump is not known any more.
        let known = usize::from(self.seconds < window);
        let ahead = accelerations.skip(known);
        Momentum {
            speed: places[1].distance(places[2]) / PUSH_WINDOW,
            acceleration: ahead.clone().take(2 - known).fold(0.0, f32::max),
            hardest: ahead.fold(0.0, f32::max),
        }
    }

    /// Makes sure that the motion lasts for a step and the search after it.
    pub(super) fn ensure(&mut self, graph: &MotionGraph, dt: f32) {
        /// The search looks this far ahead, in seconds.
        const AHEAD: f32 = 0.5;
        /// Time after which the played part of the motion is dropped, in seconds.
        const KEPT: f32 = 4.0;
        if self.seconds > KEPT {
            self.motion.leave_behind(graph, self.seconds);
            self.seconds = 0.0;
        }
        self.motion
            .extend(graph, self.seconds + dt * self.rate + AHEAD);
    }

    /// Plays a motion whose own rate is not 1 at that rate instead.
    pub(super) fn take_rate(&mut self, graph: &MotionGraph) {
        let rate = self.motion.rate(self.seconds);
        if rate == 1.0 || rate == 0.0 {
            return;
        }
        self.motion.leave_behind(graph, self.seconds);
        self.seconds = 0.0;
        self.motion.truncate_at_other_rate();
        if self.motion.retime(1.0 / rate) {
            self.rate *= rate;
        }
    }

    /// Lets time pass.
    pub(super) fn advance(&mut self, graph: &MotionGraph, dt: f32) {
        self.ensure(graph, dt);
        self.seconds += dt * self.rate;
    }

    /// Continues from another moment at `rate`. The motion that was played until now fades out; the root's offset within `root_blend` seconds.
    /// `standing` has for each leg whose foot stands then the time until it is lifted, in seconds of the motion. `spare` is memory for the new motion.
    pub(super) fn enter(
        &mut self,
        graph: &MotionGraph,
        entry: &Entry,
        [rate, root_blend]: [f32; 2],
        standing: &[Option<f32>],
        spare: &mut Motion,
    ) {
        let playhead = entry.playhead();
        spare.restart(graph, playhead, []);
        // The motion that was played, in the time of the new one.
        let played = Played {
            rate: self.rate / rate,
            ..self.played_until(self.seconds)
        };
        let blends = [entry.blend, root_blend].map(|seconds| seconds * rate);
        spare.blend_on_feet(graph, played, blends, Vec2::ZERO, standing);
        std::mem::swap(&mut self.motion, spare);
        (self.seconds, self.rate) = (0.0, rate);
    }

    pub(super) fn played_until(&self, seconds: f32) -> Played<'_> {
        Played {
            motion: &self.motion,
            seconds,
            rate: self.rate,
        }
    }
}

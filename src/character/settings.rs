use serde::{Deserialize, Serialize};

use super::error::{CharacterError, within};
use crate::query::QuerySettings;

/// Settings of [`Characters`](super::Characters).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CharacterSettings {
    /// Settings of each query. Default: [`QuerySettings::default`].
    pub query: QuerySettings,
    /// Limits of steering.
    pub steer: SteerSettings,
    /// Number of steps from a query to the frame in which its answer begins, at most [`CharacterSettings::MOST_DELAY`]. Default 0. The query
    /// starts from the state that the character will have in that frame.
    pub delay: u32,
    /// A threat is answered when it may reach the body within this time, in seconds; at most 60. Default 1.6.
    pub horizon: f32,
    /// Plans keep this distance from threats if they can, in metres; at most 10. A plan is kept until a threat would touch the body. Default 0.03.
    pub margin: f32,
    /// Distance that plans keep from obstacles if they can, in metres; at most 10. Default 0.02.
    pub obstacle_margin: f32,
    /// Maximum speed at which a body is shifted out of obstacles, in metres per second; at most 1,000. Default 6. Where a limb would otherwise
    /// stay in an obstacle, the body is shifted up to twelve times as fast; where it is deeper than 0.35 m, at most at 3 m/s.
    pub push: f32,
    /// Radius of the disc by which the others avoid a character, in metres, at most 100; 0: characters do not avoid each other. Default 0.
    pub body_radius: f32,
    /// Time until a character plans again for a threat that it could not avoid, in seconds; at most 60. Default 0.1. It is doubled each time, up to
    /// four times.
    pub retry: f32,
    /// Number of characters whose steering searches in one step, if as many have to; at least 1, and more where all could not search each
    /// [`SteerSettings::interval`] otherwise. One that stands counts twice. Those that wait longest search first. Default 8.
    pub searches_per_step: usize,
    /// Maximum number of characters that plan in one step, at least 1. Characters that may be reached first plan first. Default 24.
    pub plans_per_step: usize,
    /// Time for plans in one step, in milliseconds, at most 1,000,000; 0 for no limit. Default 0. Characters that may be reached first plan first,
    /// at least one in each step. A plan that is not finished in time is broken off, and the next step goes on with the candidates that were not
    /// tested; those of one stage have at most one step. With a limit, results depend on the machine's speed.
    pub plan_milliseconds: f32,
    /// Work of one plan in one step, in poses and spheres that are tested; 0 for no limit. Default 4000. Like
    /// [`CharacterSettings::plan_milliseconds`], but the same on every machine. A thousand take about a millisecond.
    pub plan_work: u32,
    /// Number of threads of [`Characters::step`](super::Characters::step), at most 1,024; 0 for one per core. Default 1. The result does not depend
    /// on it.
    pub threads: usize,
}

impl Default for CharacterSettings {
    fn default() -> Self {
        Self {
            query: QuerySettings::default(),
            steer: SteerSettings::default(),
            delay: 0,
            horizon: 1.6,
            margin: 0.03,
            obstacle_margin: 0.02,
            push: 6.0,
            body_radius: 0.0,
            retry: 0.1,
            searches_per_step: 8,
            plans_per_step: 24,
            plan_milliseconds: 0.0,
            plan_work: 4000,
            threads: 1,
        }
    }
}

impl CharacterSettings {
    /// Largest [`CharacterSettings::delay`], in steps.
    pub const MOST_DELAY: u32 = 60;

    /// Refuses what no step could use.
    pub(super) fn check(&self) -> Result<(), CharacterError> {
        self.query.check()?;
        self.steer.check()?;
        let [plans, searches] =
            [self.plans_per_step, self.searches_per_step].map(|count| count.min(1) as f32);
        for (name, value, least, most) in [
            ("the delay", self.delay as f32, 0.0, Self::MOST_DELAY as f32),
            ("the horizon", self.horizon, 0.0, 60.0),
            ("the margin", self.margin, 0.0, 10.0),
            ("the margin of obstacles", self.obstacle_margin, 0.0, 10.0),
            ("the push", self.push, 0.0, 1_000.0),
            ("the radius of the bodies", self.body_radius, 0.0, 100.0),
            ("the time between attempts", self.retry, 0.0, 60.0),
            ("the number of plans in a step", plans, 1.0, f32::INFINITY),
            (
                "the number of searches in a step",
                searches,
                1.0,
                f32::INFINITY,
            ),
            ("the number of threads", self.threads as f32, 0.0, 1024.0),
            ("the time for plans", self.plan_milliseconds, 0.0, 1e6),
        ] {
            within(name, value, least..=most)?;
        }
        Ok(())
    }
}

/// Limits of steering.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SteerSettings {
    /// Time between two searches, in seconds, 0 to 60. Default 0.15. A new goal starts a search at once, if not many others do.
    pub interval: f32,
    /// Time in which a jump blends, in seconds, 0 to 10. Up to twice as long where the velocity changes much. Default 0.3.
    pub blend: f32,
    /// Minimum gain of a jump, 0 to 1,000,000: by how much the new moment must be nearer to the aim than the played one. The unit is a squared
    /// distance of features; 1 is about 8 cm of travel in 0.2 s. Default 1.5.
    pub gain: f32,
    /// Slowest playback rate, 0.1 to 10. Default 0.7. Characters that go slower still take shorter strides, down to 0.6 of the clip's.
    pub slowest: f32,
    /// Fastest playback rate, from the slowest to 10. Default 1.25. Characters that go faster still take longer strides, up to 1.1 of the clip's.
    pub fastest: f32,
    /// Maximum turn that is added to a walking character, in radians per second, 0 to 100. Default 3.5.
    pub turn: f32,
    /// Maximum turn that is added to a standing character, in radians per second, 0 to 100. Default 0.8.
    pub standing_turn: f32,
    /// Largest turn that a jump adds, in radians, 0 to 10. Default 0.1.
    pub jump_turn: f32,
    /// Distance that the root keeps from obstacles on the ground, in metres, 0 to 100. Default 0.45.
    pub clearance: f32,
    /// Steering avoids obstacles that the character would reach within this time, in seconds, 0 to 60. Default 1.2.
    pub foresight: f32,
    /// An idle character repeats no motion within this time if the clips allow it, in seconds, 0 to 3,600. Default 60.
    pub repeat: f32,
}

impl Default for SteerSettings {
    fn default() -> Self {
        Self {
            interval: 0.15,
            blend: 0.3,
            gain: 1.5,
            slowest: 0.7,
            fastest: 1.25,
            turn: 3.5,
            standing_turn: 0.8,
            jump_turn: 0.1,
            clearance: 0.45,
            foresight: 1.2,
            repeat: 60.0,
        }
    }
}

impl SteerSettings {
    /// Refuses what no step could use.
    fn check(&self) -> Result<(), CharacterError> {
        for (name, value, least, most) in [
            ("the time between searches", self.interval, 0.0, 60.0),
            ("the time of a jump's blend", self.blend, 0.0, 10.0),
            ("the gain of a jump", self.gain, 0.0, 1e6),
            ("the slowest rate", self.slowest, 0.1, 10.0),
            ("the fastest rate", self.fastest, self.slowest, 10.0),
            ("the turn of what walks", self.turn, 0.0, 100.0),
            ("the turn of what stands", self.standing_turn, 0.0, 100.0),
            ("the turn of a jump", self.jump_turn, 0.0, 10.0),
            ("the distance from obstacles", self.clearance, 0.0, 100.0),
            ("the foresight", self.foresight, 0.0, 60.0),
            ("the time without repetition", self.repeat, 0.0, 3600.0),
        ] {
            within(name, value, least..=most)?;
        }
        Ok(())
    }
}

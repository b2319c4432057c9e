use serde::{Deserialize, Serialize};

use super::error::CharacterError;
use super::range::within;
use super::steer::SteerSettings;
use crate::query::QuerySettings;

/// Settings of [`Characters`](super::Characters).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CharacterSettings {
    /// Settings of each query. Default: [`QuerySettings::default`].
    pub query: QuerySettings,
    /// Limits of steering.
    pub steer: SteerSettings,
    /// Number of steps from the query to the frame in which its answer is taken over, at most [`CharacterSettings::MOST_DELAY`]. Default
    /// 0. The request is made for the state that the character will have then.
    pub delay: u32,
    /// A threat is answered when it may reach the body within this time, in seconds; at most 60. Default 1.6.
    pub horizon: f32,
    /// Plans keep this distance from threats if they can, in metres; at most 10. A plan is kept until a threat would touch the body. Default 0.03.
    pub margin: f32,
    /// Distance that plans keep from obstacles if they can, in metres; at most 10. Default 0.02.
    pub obstacle_margin: f32,
    /// Fastest shift by which a body is kept out of obstacles, in metres per second; at most 1,000. Default 6. A body that this would leave in an obstacle is
    /// shifted as fast as it has to be, up to twelve times as fast.
    pub push: f32,
    /// Radius of the disc that each character is to the others, in metres, at most 100; 0 if they do not avoid each other. Default 0.
    pub body_radius: f32,
    /// Time between two attempts to avoid a threat that could not be avoided, in seconds; at most 60. Default 0.1.
    pub retry: f32,
    /// Largest number of characters that plan in one step, those that may be reached first before others; at least 1. Default: no limit.
    pub plans_per_step: usize,
    /// Time for plans in one step, in milliseconds, at most 1,000,000; 0 for no limit. Default 0. Those that may be reached first plan first, at least one in
    /// each step. A plan that is not finished in time is broken off: it comes first in the next step, which finishes it however long that takes. With a
    /// limit, results depend on the machine's speed.
    pub plan_milliseconds: f32,
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
            plans_per_step: usize::MAX,
            plan_milliseconds: 0.0,
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
        let plans = self.plans_per_step.min(1) as f32;
        for (name, value, least, most) in [
            ("the delay", self.delay as f32, 0.0, Self::MOST_DELAY as f32),
            ("the horizon", self.horizon, 0.0, 60.0),
            ("the margin", self.margin, 0.0, 10.0),
            ("the margin of obstacles", self.obstacle_margin, 0.0, 10.0),
            ("the push", self.push, 0.0, 1_000.0),
            ("the radius of the bodies", self.body_radius, 0.0, 100.0),
            ("the time between attempts", self.retry, 0.0, 60.0),
            ("the number of plans in a step", plans, 1.0, f32::INFINITY),
            ("the number of threads", self.threads as f32, 0.0, 1024.0),
            ("the time for plans", self.plan_milliseconds, 0.0, 1e6),
        ] {
            within(name, value, least..=most)?;
        }
        Ok(())
    }
}

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::LinkGoal;

/// Which links were made.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkReport {
    /// Links, all together.
    pub links: usize,
    /// Those of them that were made so that an event is not dropped.
    pub joins: usize,
    /// Largest distance of a link, metres.
    pub loosest: f32,
    /// Longest blend of a link, seconds.
    pub longest: f64,
    /// What was wanted and what was reached, in the settings' order.
    pub goals: Vec<GoalReport>,
    /// Events that no link could join to the graph.
    pub unlinked: Vec<UnlinkedEvent>,
}

/// What was wanted and what was reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoalReport {
    /// What was wanted.
    pub goal: LinkGoal,
    /// Share of the moments without links.
    pub before: f64,
    /// Share of the moments with them.
    pub reached: f64,
}

/// An event that is not in the graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnlinkedEvent {
    /// Its clip and seconds: `"duck.bvh 0.77-1.77"`.
    pub event: String,
    /// Why.
    pub obstacle: LinkObstacle,
}

/// Why an event is not in the graph.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Error)]
pub enum LinkObstacle {
    /// It has no motion.
    #[error("it is shorter than a frame")]
    TooShort,
    /// It starts too near to its clip's start, or to another event's end.
    #[error(
        "only {seconds:.2} s of motion lead to it, and the shortest blend takes {shortest:.2} s"
    )]
    NoLeadIn {
        /// How long the motion before it is.
        seconds: f64,
        /// How long a blend must be.
        shortest: f64,
    },
    /// It ends too near to its clip's end, or to another event's start.
    #[error(
        "only {seconds:.2} s of motion follow it, and the shortest blend takes {shortest:.2} s"
    )]
    NoTail {
        /// How long the motion after it is.
        seconds: f64,
        /// How long a blend must be.
        shortest: f64,
    },
    /// Nothing in the graph is close enough.
    #[error("no moment of the graph within {loosest} m leads to it, or none to which it leads")]
    NothingNear {
        /// How close it would have to be, metres.
        loosest: f32,
    },
}

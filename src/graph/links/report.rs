use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::LinkGoal;

/// Statistics of the links.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkReport {
    /// Number of links.
    pub links: usize,
    /// Number of links that were not added because a foot darts in them.
    #[serde(default)]
    pub darting: usize,
    /// Number of links that keep an event in the graph.
    pub joins: usize,
    /// Maximum distance of a link, in metres.
    pub loosest: f32,
    /// Maximum length of a link, in seconds.
    pub longest: f64,
    /// Results of the goals, in the settings' order.
    pub goals: Vec<GoalReport>,
    /// Events that no link could connect to the graph.
    pub unlinked: Vec<UnlinkedEvent>,
}

/// Result of one goal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoalReport {
    /// The goal.
    pub goal: LinkGoal,
    /// Share of the moments that meet the goal without links.
    pub before: f64,
    /// Share of the moments that meet the goal with links.
    pub reached: f64,
}

/// An event that is not part of the graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnlinkedEvent {
    /// Clip and seconds of the event, for example `"duck.bvh 0.77-1.77"`.
    pub event: String,
    /// Reason why it could not be linked.
    pub obstacle: LinkObstacle,
}

/// Reason why an event could not be linked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Error)]
pub enum LinkObstacle {
    /// The event has no motion.
    #[error("it is shorter than a frame")]
    TooShort,
    /// The event starts too close to its clip's start or to the end of another event.
    #[error(
        "only {seconds:.2} s of motion lead to it, and the shortest blend takes {shortest:.2} s"
    )]
    NoLeadIn {
        /// Duration of the motion before the event, in seconds.
        seconds: f64,
        /// Duration of the shortest blend, in seconds.
        shortest: f64,
    },
    /// The event ends too close to its clip's end or to the start of another event.
    #[error(
        "only {seconds:.2} s of motion follow it, and the shortest blend takes {shortest:.2} s"
    )]
    NoTail {
        /// Duration of the motion after the event, in seconds.
        seconds: f64,
        /// Duration of the shortest blend, in seconds.
        shortest: f64,
    },
    /// No moment of the graph is close enough.
    #[error("no moment of the graph within {loosest} m leads to it, or none to which it leads")]
    NothingNear {
        /// Maximum distance of a link, in metres.
        loosest: f32,
    },
}

//! The motion graph: finds similar poses in the clips and connects them with transitions.
//!
//! Source: Kovar, Gleicher & Pighin, "Motion Graphs" (2002), which Masaoka & Oshita use in section
//! 4.4.
//!
//! A caller fills a [`ClipSource`], calls [`build()`](build()) with [`GraphSettings`], and gets a [`MotionGraph`] and a [`BuildReport`]. A
//! [`Playhead`] is a position in the graph, and a [`Motion`] is what is played from there. `search` finds the transitions, `build` makes a
//! strongly connected graph of them, and `play` plays it.

pub(crate) mod build;
mod error;
pub(crate) mod motion_graph;
pub(crate) mod play;
pub(crate) mod push;
pub mod search;
pub(crate) mod settings;
pub(crate) mod stored;
pub(crate) mod watch;

pub use build::builder::build;
pub use build::input::GraphBuilder;
pub use build::islands::JoinedClip;
pub use build::report::{
    BuildReport, Dropped, DroppedPart, EventCounts, GoalReport, LinkObstacle, LinkReport,
    Responsiveness, UnlinkedEvent,
};
pub use build::slide::FootSlide;
pub use error::GraphError;
pub use motion_graph::{
    ClipId, Edge, EdgeId, EdgeMotion, EventId, Feet, GraphEvent, MotionGraph, Node, NodeId, Plant,
};
pub use play::inertia::Entry;
pub(crate) use play::inertia::{
    BESIDE, BlendReach, Decay, FootDecay, Inertia, JointReach, LegPose, Weights, leg_targets,
    rotation_vector,
};
pub use play::motion::{Layer, Motion, MotionMoment};
pub(crate) use play::motion::{heading, layer_tilt};
pub use play::motion_edit::Played;
pub use play::playhead::{MotionStep, Playhead};
pub(crate) use play::sample::ClipPosition;
pub use search::transition::blend_weight;
pub use settings::{ClipSource, GraphSettings, LinkGoal, LinkSettings};
pub use watch::{BakeProgress, BakeStage, BakeWatch, Unwatched};

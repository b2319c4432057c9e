//! The motion graph: which moments of the clips look alike, and the motion that leads from one to the other.
//!
//! Source: Kovar, Gleicher & Pighin, "Motion Graphs" (2002), used by Masaoka & Oshita in section 4.4.

mod build;
mod cloud;
pub mod distance;
mod minima;
mod motion;
mod motion_graph;
mod prune;
mod transition;

pub use build::{BuildReport, ClipSource, Dropped, GraphError, GraphSettings, build};
pub use cloud::PointCloud;
pub use motion::{Motion, Playhead, Step};
pub use motion_graph::{
    ClipId, Edge, EdgeId, EdgeMotion, EventId, GraphEvent, MotionGraph, Node, NodeId,
};
pub use transition::{Transition, blend_weight};

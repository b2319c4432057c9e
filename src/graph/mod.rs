//! The motion graph: finds similar poses in the clips and connects them with transitions.
//!
//! Source: Kovar, Gleicher & Pighin, "Motion Graphs" (2002), which Masaoka & Oshita use in section
//! 4.4.

pub(crate) mod build;
pub(crate) mod cloud;
mod component;
pub(crate) mod distance;
mod edges_into;
mod error;
mod events;
pub(crate) mod feet;
pub(crate) mod ids;
pub(crate) mod inertia;
mod limits;
pub(crate) mod links;
mod moments;
pub(crate) mod motion;
pub(crate) mod motion_edit;
mod motion_graph;
mod motion_moment;
mod parts;
mod playhead;
mod prune;
mod report;
pub(crate) mod responsiveness;
mod sample;
pub(crate) mod search;
pub(crate) mod section;
mod settings;
mod source;
mod stored;
mod transition;
mod validate;
mod waits;
pub(crate) mod watch;

pub use build::build;
pub(crate) use cloud::PointCloud;
pub(crate) use edges_into::EdgesInto;
pub use error::GraphError;
pub(crate) use feet::Feet;
pub(crate) use feet::FeetSettings;
pub use ids::{ClipId, EdgeId, EventId, NodeId};
pub(crate) use inertia::Entry;
pub(crate) use inertia::{BESIDE, BlendReach, JointReach};
pub(crate) use inertia::{Decay, FootDecay, LegPose, Weights, rotation_vector};
pub(crate) use links::{LinkReport, LinkSettings};
pub use motion::Motion;
pub(crate) use motion::{ContinuedBlend, Layer};
pub(crate) use motion::{heading, layer_tilt};
pub(crate) use motion_edit::Played;
pub use motion_graph::{Edge, EdgeMotion, GraphEvent, MotionGraph, Node};
pub use motion_moment::MotionMoment;
pub use playhead::{MotionStep, Playhead};
pub use report::{BuildReport, Dropped, EventCounts};
pub(crate) use responsiveness::Responsiveness;
pub(crate) use sample::ClipPosition;
pub use settings::GraphSettings;
pub use source::ClipSource;
pub(crate) use transition::Transition;
pub use transition::blend_weight;

//! Draws the maps of all events and puts everything that a query needs into one immutable [`BakedGraph`].

mod baked_graph;
mod baker;
mod drawings;
mod restore;
mod settings;

pub use baked_graph::BakedGraph;
pub use baker::{Baker, DrawnMaps};
pub use settings::{BakeError, BakeSettings};

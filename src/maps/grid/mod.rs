//! From each node of a graph, the paths to its evasions and the cells of space that they vacate.
//!
//! Source: Masaoka & Oshita, sections 4.1 and 4.2.

mod cells;
mod node_grid;
mod path_search;
mod paths;
mod retime;
mod vacated;

pub use cells::{CellColumn, TouchedCells};
pub use node_grid::Grid;
pub(super) use node_grid::GridCells;
pub(super) use path_search::find_paths;
pub use paths::{NodePath, PathId, PathReport, PathSettings, PathTable};
pub(super) use retime::retimable_edges;
pub use retime::{Retimable, RetimeSettings};

//! The search for transitions: pairs of similar windows of the clips.
//!
//! [`GraphBuilder::find_transitions`](crate::graph::GraphBuilder::find_transitions) searches in one process. To divide the search among
//! machines, let each call [`PrunedSearch::search`] for some of the bands of [`SearchSettings::bands`]. One of them gives all minima to the
//! [`TransitionList`] of a [`GraphBuilder`](crate::graph::GraphBuilder). The result is the same to the bit.

pub(crate) mod bands;
pub(crate) mod diagonal;
pub(crate) mod distance;
pub(crate) mod features;
pub(crate) mod minima;
pub(crate) mod projection;
pub(crate) mod pruned;
pub(crate) mod transition;
pub(crate) mod windows;

pub use bands::{MapBand, Minimum, SearchSettings};
pub use distance::{DistanceMap, WindowPair};
pub use minima::TransitionList;
pub use pruned::{BandMinima, PrunedSearch, SearchScratch};
pub use windows::{PointCloud, Windows};

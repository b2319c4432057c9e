//! Types that the packages of this workspace share with the component and that a host does not need: searches for transitions, feet, shares of a bake.
//!
//! They are not covered by semantic versioning: any patch release may change them.
pub use crate::graph::build::builder::GraphBuilder;
pub use crate::graph::build::report::Responsiveness;
pub use crate::graph::build::report::{GoalReport, LinkObstacle, LinkReport, UnlinkedEvent};
pub use crate::graph::build::slide::FootSlide;
pub use crate::graph::motion_graph::{Feet, Plant};
pub use crate::graph::play::inertia::Entry;
pub use crate::graph::play::motion::Layer;
pub use crate::graph::play::motion_edit::Played;
pub use crate::graph::search::bands::Minimum;
pub use crate::graph::search::bands::{MapBand, SearchSettings};
pub use crate::graph::search::cloud::PointCloud;
pub use crate::graph::search::distance::{DistanceMap, WindowPair};
pub use crate::graph::search::minima::TransitionList;
pub use crate::graph::search::pruned::{BandMinima, PrunedSearch, SearchScratch};
pub use crate::graph::search::windows::Windows;
pub use crate::graph::settings::FeetSettings;
pub use crate::graph::settings::{LinkGoal, LinkSettings};
pub use crate::graph::watch::{BakeProgress, BakeStage, BakeWatch, Unwatched};
pub use crate::maps::entries::{EntryShare, MomentShare};

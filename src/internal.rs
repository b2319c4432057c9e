//! Types that the packages of this workspace share with the component and that a host does not need: maps as bits, drawings, the exact test.
//!
//! They are not covered by semantic versioning: any patch release may change them.
pub use crate::duel::trunk::Trunk;
#[cfg(feature = "vulkan")]
pub use crate::gpu::stencil::{Batch, BatchMaps, MapKind, Rasterizer, RasterizerDesc};
pub use crate::graph::build::GraphBuilder;
pub use crate::graph::cloud::PointCloud;
pub use crate::graph::distance::{DistanceMap, WindowPair, Windows};
pub use crate::graph::feet::{Feet, FeetSettings, FootSlide, Plant};
pub use crate::graph::inertia::Entry;
pub use crate::graph::links::{
    GoalReport, LinkGoal, LinkObstacle, LinkReport, LinkSettings, UnlinkedEvent,
};
pub use crate::graph::motion::Layer;
pub use crate::graph::motion_edit::Played;
pub use crate::graph::responsiveness::Responsiveness;
pub use crate::graph::search::{
    BandMinima, BandParts, MapBand, Minimum, PrunedSearch, SearchScratch, SearchSettings,
    TransitionList,
};
pub use crate::graph::watch::{BakeProgress, BakeStage, BakeWatch, Unwatched};
pub use crate::maps::atlas::RegionId;
pub use crate::maps::attack_grid::{AttackGridReport, AttackOption, Contact};
pub use crate::maps::collect::DrawnMaps;
pub use crate::maps::disc::{Disc, SUB_TEXELS};
pub use crate::maps::entries::{
    EntryReport, EntrySettings, EntryShare, MomentShare, PlausibilitySettings, Stretches,
};
pub use crate::maps::fixed_transform::FixedTransform2;
pub use crate::maps::grid::{CellColumn, Grid, GridSettings, TouchedCells};
pub use crate::maps::map::{BitMap, Drawing, MapRect};
pub use crate::maps::mask::MaskMap;
pub use crate::maps::paths::{NodePath, PathId, PathReport, PathTable};
pub use crate::maps::raster::EvasionMaps;
pub use crate::maps::region_maps::{AttackMaps, RegionMaps, SlabMaps};
pub use crate::maps::retime::Retimable;
pub use crate::maps::slab::{Section, Slab};
pub use crate::maps::track::{BodyTrack, TrackDesc};
pub use crate::query::answer::EnteredAt;
pub use crate::query::clearance::{
    ExactTest, Extent, MotionBody, PlacedEvasion, SAMPLE_RATE, Sampling, closest,
};
pub use crate::query::cull::drawing::{AttackDrawing, AttackLayer, TimedDisc};
pub use crate::query::cull::input::CullCandidate;
pub use crate::query::moves::{MoveSettings, SearchReport};
pub use crate::query::obstacle::{ObstacleHit, ObstacleTest};
pub use crate::query::retime::{Rate, RateError};
pub use crate::query::warp::{WarpBounds, WarpLimits};

/// The CPU rasterizer, whose results the shaders reproduce.
pub mod raster {
    pub use crate::maps::raster::{EvasionMaps, any_frame, every_frame};
}

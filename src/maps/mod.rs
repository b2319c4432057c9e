//! Maps: spheres over time, drawn into one 2-D map for each height slab.
//!
//! Source: Masaoka & Oshita, sections 3.2 and 4.3. A sphere becomes one [`Disc`] in each [`Slab`]
//! that it reaches. Integer arithmetic decides whether a disc covers a texel, so that the GPU's
//! rasterizer and the CPU's [`raster`] produce identical maps.

mod atlas;
mod attack_grid;
mod attack_move;
mod bake;
mod bake_settings;
mod baked;
mod body;
mod body_rows;
mod body_sphere;
mod bounding_cylinder;
mod coarse;
mod collect;
mod disc;
mod drawings;
mod entries;
mod evasion;
mod fixed_transform;
mod grid;
mod hulls;
mod map;
mod mask;
mod moving_sphere;
mod paths;
mod prop;
pub mod raster;
mod region_maps;
mod retime;
mod slab;
mod sphere_key;
mod track;

#[cfg(feature = "vulkan")]
pub(crate) use atlas::{PackedAtlas, PackedMap};
pub use atlas::{RegionAtlas, RegionId};
pub use attack_grid::{AttackGrid, AttackGridReport, AttackGridSettings, AttackOption, Contact};
pub use attack_move::AttackMove;
pub use bake::Baker;
pub use bake_settings::{BakeError, BakeSettings};
pub use baked::BakedGraph;
pub use body::Body;
pub(crate) use body_rows::BodyRows;
pub use body_sphere::BodySphere;
pub(crate) use coarse::{CoarseMap, CoarseRegion};
pub use collect::DrawnMaps;
pub use disc::{Disc, SUB_TEXELS};
pub(crate) use drawings::{CLOCK_ERROR, HALF_DIAGONAL, ROUNDING};
pub use entries::{EntryReport, EntrySettings, PlausibilitySettings};
pub(crate) use entries::{EntryTable, KnownEntry, Stance};
pub use evasion::Evasion;
pub use fixed_transform::FixedTransform2;
pub use grid::{CellColumn, Grid, GridSettings, TouchedCells};
pub(crate) use hulls::{HullRows, PART};
pub use map::{BitMap, Drawing, MapRect};
pub use mask::MaskMap;
pub use moving_sphere::MovingSphere;
pub use paths::{NodePath, PathId, PathReport, PathSettings, PathTable};
pub use prop::{LocalSphere, Prop};
pub use raster::EvasionMaps;
pub(crate) use raster::blocks_near;
pub use region_maps::{AttackMaps, RegionMaps, SlabMaps};
pub use retime::{Retimable, RetimeSettings};
pub(crate) use slab::Cut;
pub use slab::{MapGrid, Section, Slab};
pub use sphere_key::SphereKey;
pub use track::{BodyTrack, TrackStart};

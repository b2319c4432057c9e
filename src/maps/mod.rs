//! Maps: spheres over time, drawn into one 2-D map for each height slab.
//!
//! Source: Masaoka & Oshita, sections 3.2 and 4.3. A sphere becomes one [`Disc`] in each [`Slab`]
//! that it reaches. Integer arithmetic decides whether a disc covers a texel, so that the GPU's
//! rasterizer and the CPU's `raster` produce identical maps.

pub(crate) mod atlas;
pub(crate) mod attack_grid;
pub(crate) mod attack_move;
pub(crate) mod bake;
mod bake_settings;
mod baked;
pub(crate) mod bit_square;
mod body;
mod body_rows;
mod body_sphere;
mod bounding_cylinder;
mod bounding_spheres;
mod coarse;
pub(crate) mod collect;
pub(crate) mod disc;
mod drawings;
pub(crate) mod entries;
mod evasion;
pub(crate) mod fixed_transform;
pub(crate) mod grid;
pub(crate) mod map;
pub(crate) mod mask;
mod moving_sphere;
mod on_first_use;
pub(crate) mod paths;
mod prop;
pub(crate) mod raster;
pub(crate) mod region_maps;
pub(crate) mod retime;
pub(crate) mod slab;
mod sparse_words;
mod sphere_key;
pub(crate) mod track;

pub use atlas::RegionAtlas;
pub(crate) use atlas::RegionId;
pub(crate) use attack_grid::AttackOption;
pub use attack_grid::{AttackGrid, AttackGridSettings};
pub use attack_move::AttackMove;
pub use bake::Baker;
pub use bake_settings::{BakeError, BakeSettings};
pub use baked::BakedGraph;
pub use body::Body;
pub(crate) use body_rows::BodyRows;
pub use body_sphere::BodySphere;
pub(crate) use bounding_cylinder::BoundingCylinder;
pub(crate) use bounding_spheres::{PART, SphereRows};
pub(crate) use coarse::{CoarseMap, CoarseRegion};
pub(crate) use disc::{Disc, SUB_TEXELS};
pub(crate) use drawings::{CLOCK_ERROR, HALF_DIAGONAL, ROUNDING};
pub(crate) use entries::{EntrySettings, EntryTable, KnownEntry, Stance};
pub use evasion::Evasion;
pub(crate) use fixed_transform::FixedTransform2;
pub(crate) use grid::GridSettings;
pub(crate) use grid::{CellColumn, TouchedCells};
pub(crate) use map::{BitMap, Drawing, MapRect};
pub(crate) use mask::MaskMap;
pub use moving_sphere::MovingSphere;
pub(crate) use on_first_use::OnFirstUse;
pub(crate) use paths::PathReport;
pub use paths::PathSettings;
pub(crate) use paths::{NodePath, PathId, PathTable};
pub use prop::Prop;
pub(crate) use raster::BlockAxis;
pub(crate) use region_maps::{RegionMaps, SlabMaps};
pub(crate) use retime::Retimable;
pub use retime::RetimeSettings;
pub(crate) use slab::Cut;
pub use slab::MapGrid;
pub(crate) use slab::{Section, Slab};
pub use sphere_key::SphereKey;
pub(crate) use track::{BodyTrack, TrackDesc};

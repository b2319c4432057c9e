//! What a body and an attack sweep over: spheres over time, drawn into one 2-D map for each slab of heights.
//!
//! Source: Masaoka & Oshita, sections 3.2 and 4.3. A sphere becomes one [`Disc`] in each [`Slab`] that it reaches. Integer arithmetic decides
//! whether a disc covers a texel, so that the GPU's rasterizer and the CPU's [`raster`] produce identical maps.

mod atlas;
mod bit_map;
mod body;
mod body_rows;
mod bounding_cylinder;
mod coarse;
mod events;
mod fixed_transform;
mod map_grid;
mod mask_map;
pub mod raster;
mod region_maps;
mod sphere;
mod track;

pub use atlas::RegionAtlas;
pub use bit_map::{BitMap, Drawing, MapRect};
pub use body::{Body, BodySphere, Prop};
pub(crate) use body_rows::{BodyRows, pushes};
pub(crate) use bounding_cylinder::BoundingCylinder;
pub(super) use bounding_cylinder::ClipCylinders;
pub(crate) use coarse::{CoarseMap, CoarseRegion};
pub use events::{AttackMove, Evasion, RegionId};
pub(super) use events::{attack_spheres, attacking};
pub use fixed_transform::FixedTransform2;
pub(crate) use map_grid::Cut;
pub use map_grid::{Disc, MapGrid, SUB_TEXELS, Section, Slab};
pub(crate) use map_grid::{HALF_DIAGONAL, ROUNDING, TIME_ERROR};
pub use mask_map::MaskMap;
pub(crate) use raster::BlockAxis;
pub use raster::EvasionMaps;
pub use region_maps::{AttackMaps, RegionMaps, SlabMaps};
pub use sphere::{MovingSphere, SphereKey};
pub use track::BodyTrack;
pub(super) use track::EvasionTracks;
pub(crate) use track::{PART, SphereRows};

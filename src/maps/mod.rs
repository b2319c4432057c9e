//! Regions: spheres over time, drawn into one 2-D map for each height slab.
//!
//! Source: Masaoka & Oshita, sections 3.2 and 4.3. A sphere becomes one [`Disc`] in each [`Slab`]
//! that it reaches. Whether a disc covers a texel is decided in integers, so that the device's
//! rasterizer and the CPU's [`raster`] agree to the texel.

mod atlas;
mod attack_grid;
mod bake;
mod baked;
mod body;
mod body_rows;
mod disc;
mod drawings;
mod gather;
mod grid;
mod hulls;
mod map;
mod mask;
mod moving_sphere;
mod near;
mod paths;
mod prop;
pub mod raster;
mod retime;
mod slab;
mod sphere_key;
mod strike;
mod track;
mod turn;
mod upright;

pub use atlas::{
    AttackMaps, PackedAtlas, PackedMap, PackedMaps, RegionAtlas, RegionId, RegionMaps, SlabMaps,
};
pub use attack_grid::{AttackGrid, AttackGridReport, AttackGridSettings, Blow, Contact};
pub use bake::{BakeError, BakeSettings, Baker, DrawnMaps};
pub use baked::{BakedGraph, Evasion};
pub use body::{Body, BodySphere};
pub use body_rows::BodyRows;
pub use disc::{Disc, SUB_TEXELS};
pub(crate) use drawings::{CLOCK_ERROR, HALF_DIAGONAL, ROUNDING};
pub use grid::{CellColumn, Grid, GridSettings, TouchedCells};
pub(crate) use hulls::{HullRows, PART};
pub use map::{BitMap, Drawing, MapRect};
pub use mask::MaskMap;
pub use moving_sphere::MovingSphere;
pub(crate) use near::{NearMap, NearRegion};
pub use paths::{NodePath, PathId, PathReport, PathSettings, PathTable};
pub use prop::{LocalSphere, Prop};
pub use raster::EvasionMaps;
pub(crate) use raster::blocks_near;
pub use retime::{Retimable, RetimeSettings, retimable_edges};
pub(crate) use slab::Cut;
pub use slab::{MapGrid, Section, Slab};
pub use sphere_key::SphereKey;
pub use strike::{Strike, attack_spheres};
pub use track::BodyTrack;
pub use turn::MapTurn;
